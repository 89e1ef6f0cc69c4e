"""Smoothness prior of the weights, its precision by expectation maximisation.

Let ``wᵀ R w`` be the roughness of an action coordinate with weights w (see
:meth:`~unconstrain.NormalisedRBF.roughness`), and N(0, (λ R)⁻¹) their prior.
Given posterior means w_k and covariance C, the M-step for the prior precision
λ is

    λ = rank(R) d / (Σ_k w_kᵀ R w_k + tr C (R ⊗ I))

Misfit of the model is no reason to smooth, so λ is multiplied by the share of
noise in the residual variance.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ...base.arrays import Array
from ...risks import Quadratic, eigensystem, vec
from ...training import Samples
from ..thresholds import judged
from .constants import ROUGHNESS_RANK_TOLERANCE
from .posterior import Posterior


@dataclass(frozen=True, eq=False)
class Smoothness:
    """Smoothness prior of each of M models.

    Parameters
    ----------
    penalty : Quadratic
        Roughness ``Σ_k w_kᵀ R w_k``.
    rank : ndarray, shape (M,)
        Of its Hessian.
    precision : ndarray, shape (M,)
        Prior precision λ times the share of noise; zero at first.
    least : float
        Roughness up to which it is rounding.
    """

    penalty: Quadratic
    rank: Array
    precision: Array
    least: float

    @classmethod
    def of(cls, samples: Samples) -> Self:
        """The prior of precision zero."""
        rough, d = samples.roughness, samples.actions.shape[1]
        models, p = rough.shape[:2]
        hessian = np.einsum("mij,kl->mikjl", rough, np.eye(d)).reshape(models, p * d, p * d)
        values, _ = eigensystem(rough)
        rank = d * (values > np.maximum(ROUGHNESS_RANK_TOLERANCE * values[:, -1:], 1e-300)).sum(axis=1)
        none = np.zeros(models)
        penalty = Quadratic(hessian, np.zeros((models, p * d)), none)
        return cls(penalty, rank, none, max(ROUGHNESS_RANK_TOLERANCE**2 * samples.energy, 1e-290))

    def prior(self, factors: Array | float = 1.0) -> Quadratic:
        """−2 times the logarithm of the prior density, times a factor (M,)."""
        return (self.precision * factors) * self.penalty

    def updated(self, weights: Array, posterior: Posterior, noise: Array | float, unit: Array | float = 1.0) -> Self:
        """M-step: with the precision of maximum likelihood.

        Parameters
        ----------
        weights : ndarray, shape (M, d, p)
        posterior : Posterior
            Whose mean the weights are.
        noise : ndarray, shape (M,), or float
            Share of noise in the residual variance.
        unit : ndarray, shape (M,), or float
            Residual variance by which ``posterior`` has yet to be divided.
        """
        if not self.rank.any():
            return self
        covariance = np.linalg.pinv(posterior.evidence.hessian + posterior.prior.hessian, hermitian=True)
        rough = judged(self.penalty, vec(weights)) + unit * np.einsum("mij,mji->m", covariance, self.penalty.hessian)
        return replace(self, precision=noise * self.rank / np.maximum(rough, self.least))

"""A prior by which policies are smooth, and how much it counts, from the data.

Noise leaves weights that only few samples speak of rough. Let ``wᵀ R w``
measure the roughness of an action coordinate, as features tell it, and let
weights have the prior density N(0, (λ R)⁻¹). Given a posterior with
covariance C, expectation maximisation takes the λ that makes the expected
roughness what it is:

    λ = rank(R) d / (Σ_k w_kᵀ R w_k + tr C (R ⊗ I))

What the model itself misses is no reason to smooth, so λ counts by the share
of the residuals that is noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ...base.arrays import Array
from ...risks import Quadratic, eigensystem, vec
from ...training import Samples
from ..thresholds import judged
from .posterior import Posterior

_RANK = 1e-10
"""Eigenvalues of R below this share of the largest are rounding."""


@dataclass(frozen=True, eq=False)
class Smoothness:
    """How rough weights are, and how much that counts.

    Parameters
    ----------
    penalty : Quadratic
        ``Σ_k w_kᵀ R w_k`` of each of M models.
    rank : ndarray, shape (M,)
        Of its Hessian.
    precision : ndarray, shape (M,)
        The λ of each model, by as much as it counts; zero at first.
    least : float
        Squared roughness that is rounding.
    """

    penalty: Quadratic
    rank: Array
    precision: Array
    least: float

    @classmethod
    def of(cls, samples: Samples) -> Self:
        """Before anything is known of the weights."""
        rough, d = samples.roughness, samples.actions.shape[1]
        models, p = rough.shape[:2]
        hessian = np.einsum("mij,kl->mikjl", rough, np.eye(d)).reshape(models, p * d, p * d)
        values, _ = eigensystem(rough)
        rank = d * (values > np.maximum(_RANK * values[:, -1:], 1e-300)).sum(axis=1)
        none = np.zeros(models)
        penalty = Quadratic(hessian, np.zeros((models, p * d)), none)
        return cls(penalty, rank, none, max(_RANK**2 * samples.energy, 1e-290))

    def prior(self, factors: Array | float = 1.0) -> Quadratic:
        """Twice the negative logarithm of the density, times a factor (M,)."""
        return (self.precision * factors) * self.penalty

    def updated(self, weights: Array, posterior: Posterior, noise: Array | float, unit: Array | float = 1.0) -> Self:
        """With the λ that goes best with weights.

        Parameters
        ----------
        weights : ndarray, shape (M, d, p)
        posterior : Posterior
            Of them.
        noise : ndarray, shape (M,), or float
            Share of the residuals that is noise.
        unit : ndarray, shape (M,), or float
            Variance of the posterior's residuals, in which it is not measured yet.
        """
        if not self.rank.any():
            return self
        covariance = np.linalg.pinv(posterior.evidence.hessian + posterior.prior.hessian, hermitian=True)
        rough = judged(self.penalty, vec(weights)) + unit * np.einsum("mij,mji->m", covariance, self.penalty.hessian)
        return replace(self, precision=noise * self.rank / np.maximum(rough, self.least))

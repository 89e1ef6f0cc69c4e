"""Gaussian posterior of the weights: quadratic log-likelihood and a unit-information prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import SECONDARY_NOISE, Quadratic, eigensystem, minimum, unvec
from .constants import LEAST_PRIOR_PRECISION


def unit_information(weights: float, sizes: Array) -> Array:
    """Factor P / n of the standard risk in a unit-information prior, shape (M,).

    It scales the information of the n samples to that of P, such as one for each
    weight. With one sample altogether this is the prior of Kass and Wasserman,
    *Journal of the American Statistical Association* 90(431), 1995.
    """
    return weights / np.maximum(sizes, 1.0)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Posterior density of each model's weights: −2 times its logarithm is ``evidence + prior``, up to a constant.

    Parameters
    ----------
    evidence : Quadratic
        −2 times the log-likelihood: consistency, divided by the residual variance.
    prior : Quadratic
        −2 times the logarithm of the prior density: standard risk and smoothness.
    """

    evidence: Quadratic
    prior: Quadratic

    def __add__(self, other: Posterior) -> Posterior:
        return Posterior(self.evidence + other.evidence, self.prior + other.prior)

    def weights(self, actions: int) -> Array:
        """The weights of maximum posterior density, shape (M, d, p)."""
        return unvec(minimum(self.evidence + self.prior), actions)

    def covariances(self) -> tuple[Array, Array]:
        """Posterior covariance of the weights in two parts, from noise and undetermined by the data, each (M, P, P).

        For the Hessians A of the evidence and B of the prior, ``C = (A + B)⁻¹`` is the sum of C A C and C B C.
        Eigenvalues of B have a floor: features that no sample excites have no prior
        precision, and their weights must not count as known.
        """
        prior = self.floored_prior()
        eigenvalues, vectors = eigensystem(self.evidence.hessian + prior)
        lowest = np.maximum(1e-15 * eigenvalues[:, -1:], 1e-300)
        both = (vectors / np.maximum(eigenvalues, lowest)[:, None, :]) @ vectors.swapaxes(1, 2)
        return both @ self.evidence.hessian @ both, both @ prior @ both

    def floored_prior(self) -> Array:
        """Hessian of the prior with a floor under its eigenvalues, shape (M, P, P)."""
        values, axes = eigensystem(self.prior.hessian)
        floored = np.maximum(values, LEAST_PRIOR_PRECISION * values.mean(axis=1, keepdims=True))
        return np.asarray((axes * floored[:, None, :]) @ axes.swapaxes(1, 2))

    def determined(self) -> NDArray[np.intp]:
        """Number of directions in which the evidence has more than half of the posterior precision, shape (M,)."""
        eigenvalues, vectors = eigensystem(self.evidence.hessian + self.prior.hessian)
        kept = eigenvalues > SECONDARY_NOISE * eigenvalues[:, -1:]
        scale = np.where(kept, 1.0 / np.sqrt(np.where(kept, eigenvalues, 1.0)), 0.0)
        white = vectors * scale[:, None, :]
        share, _ = eigensystem(white.swapaxes(1, 2) @ self.evidence.hessian @ white)
        return np.asarray((share > 0.5).sum(axis=1), dtype=np.intp)

"""What is believed of the weights: evidence of the data, and a prior worth little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import SECONDARY_NOISE, Quadratic, eigensystem, minimum, unvec


def unit_information(weights: int, sizes: Array) -> Array:
    """How much the standard risk counts beside the inconsistency, as priors go, shape (M,).

    All samples together say as much, in all P directions together, as one
    sample for each: enough to hold what the data leaves undetermined, and
    nothing where it speaks.
    """
    return weights / np.maximum(sizes, 1.0)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Twice the negative logarithm of a density over the weights of each model, in two parts.

    Parameters
    ----------
    evidence : Quadratic
        From the data's consistency, per variance of its residuals.
    prior : Quadratic
        The standard risk and smoothness, by as much as they count.
    """

    evidence: Quadratic
    prior: Quadratic

    def weights(self, actions: int) -> Array:
        """The most probable weights, shape (M, d, p)."""
        return unvec(minimum(self.evidence + self.prior), actions)

    def spreads(self) -> tuple[Array, Array]:
        """Covariance of the weights, due to the noise in the data and due to what it does not say, each (M, P, P).

        With ``C = (A + B)⁻¹`` for evidence A and prior B, they are C A C and C B C, and add up to C. In what no
        sample has excited, B is at least a hundredth of its mean over all directions: it must not count as known.
        """
        values, axes = eigensystem(self.prior.hessian)
        floored = np.maximum(values, 1e-2 * values.mean(axis=1, keepdims=True))
        prior = (axes * floored[:, None, :]) @ axes.swapaxes(1, 2)
        eigenvalues, vectors = eigensystem(self.evidence.hessian + prior)
        lowest = np.maximum(1e-15 * eigenvalues[:, -1:], 1e-300)
        both = (vectors / np.maximum(eigenvalues, lowest)[:, None, :]) @ vectors.swapaxes(1, 2)
        return both @ self.evidence.hessian @ both, both @ prior @ both

    def determined(self) -> NDArray[np.intp]:
        """In how many directions the data says more than the prior, shape (M,)."""
        eigenvalues, vectors = eigensystem(self.evidence.hessian + self.prior.hessian)
        kept = eigenvalues > SECONDARY_NOISE * eigenvalues[:, -1:]
        scale = np.where(kept, 1.0 / np.sqrt(np.where(kept, eigenvalues, 1.0)), 0.0)
        white = vectors * scale[:, None, :]
        share, _ = eigensystem(white.swapaxes(1, 2) @ self.evidence.hessian @ white)
        return np.asarray((share > 0.5).sum(axis=1), dtype=np.intp)

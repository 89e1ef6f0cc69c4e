"""What is believed of the weights: evidence of the data, and a prior worth little."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import SECONDARY_NOISE, Quadratic, eigensystem, minimum, unvec
from ..plain import Solution

__all__ = ["Posterior", "RobustSolution", "scaled", "unit_information"]


def unit_information(weights: int, sizes: Array) -> Array:
    """How much the standard risk counts beside the inconsistency, as priors go, shape (M,).

    All samples together say as much, in all P directions together, as one
    sample for each: enough to hold what the data leaves undetermined, and
    nothing where it speaks.
    """
    return weights / np.maximum(sizes, 1.0)


def scaled(objective: Quadratic, factors: Array) -> Quadratic:
    """Each model's objective times its factor, shape (M,)."""
    return Quadratic(
        factors[:, None, None] * objective.hessian, factors[:, None] * objective.linear, factors * objective.constant
    )


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


@dataclass(frozen=True, eq=False)
class RobustSolution(Solution):
    """What a learner found that looks at the samples.

    Parameters
    ----------
    method : str
        Which of the candidates it is.
    noise : float
        Standard deviation of the noise on each action coordinate, misfit of the model included.
    misfit : float
        Standard deviation, per action coordinate, of what the model of the policy misses: the part of the residuals
        that goes on smoothly in time, and 1.5 % of the actions' size, which no model is trusted to be below.
    free_share : float
        Estimated share of samples that nothing constrained.
    free : ndarray, shape (N,)
        Probability that each sample was free, in the order in which they were given.
    from_noise, undetermined : ndarray, shape (M, d p, d p)
        Covariance of the weights, due to noise in the data and due to what the data does not say.
    held_out_score : float
        Share of the observed motion that is explained where it is held out, as by ``Policy.score``.
    compared : dict
        Logarithm of each candidate's held-out inconsistency over that on noise-corrected moments.
    refuted : bool
        Whether that of the most probable policy was too far above.
    candidates : dict
        Weights (M, d, p) of everything that was learnt to choose from, by name.
    """

    method: str = ""
    noise: float = 0.0
    misfit: float = 0.0
    free_share: float = 0.0
    free: Array = field(default_factory=lambda: np.zeros(0))
    from_noise: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    undetermined: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    held_out_score: float = float("nan")
    compared: dict[str, float] = field(default_factory=dict)
    refuted: bool = False
    candidates: dict[str, Array] = field(default_factory=dict)

"""A candidate policy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Array
from ...training import Samples
from .posterior import Posterior
from .smoothness import Smoothness


@dataclass(frozen=True, eq=False)
class Candidate:
    """A policy learnt in one way, of which :class:`~unconstrain.Robust` takes one.

    Parameters
    ----------
    name : str
        Of the way of learning.
    weights : ndarray, shape (M, d, p)
    posterior : Posterior
    held_out : ndarray, shape (N, d)
        Cross-validated predictions: each sample's from the other folds.
    variance : float
        Residual variance per coordinate, of noise and misfit.
    smoothness : Smoothness
        Smoothness prior in ``posterior``.
    refits : ndarray, shape (R, M, d, p)
        Weights learnt without each of R folds: those that predict ``held_out``.
    softness : float
        Share of the standard risk that biases the policy towards the actions: that of a softened hybrid or of a prior,
        infinite for direct regression, zero where it has next to no information; −1 where more is known of the
        constraints than their actions.
    spread : float, optional
        Mean variance of the predictions, where refits do not tell it; see :mod:`.agreement`.
    alone : float
        Share of the squared motion that was missed in demonstrations left out, where ``held_out`` is not about that.
    by_segments : bool
        Whether demonstrations that were held in the same way all the time show it more than samples along themselves.
    otherwise : tuple of Candidate and Samples, optional
        The same learnt where other samples were held out together.
    """

    name: str
    weights: Array
    posterior: Posterior
    held_out: Array
    variance: float
    smoothness: Smoothness
    refits: Array
    softness: float = 0.0
    spread: float | None = None
    alone: float = 0.0
    by_segments: bool = False
    otherwise: tuple[Candidate, Samples] | None = None

    @property
    def agreed(self) -> bool:
        """Whether demonstrations agree on the policy, so that it misses no more than noise; see :mod:`.agreement`."""
        return self.spread is not None


def scaled(posterior: Posterior, variance: Array) -> Posterior:
    """Divided by the residual variance, shape (M,)."""
    by = 1.0 / np.maximum(variance, 1e-300)
    return Posterior(by * posterior.evidence, by * posterior.prior)

"""A candidate policy."""

from dataclasses import dataclass

from ...base.arrays import Array
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
    most_consistent : ndarray, shape (N, d)
        As ``held_out``, with the softness of the least held-out inconsistency.
    """

    name: str
    weights: Array
    posterior: Posterior
    held_out: Array
    variance: float
    smoothness: Smoothness
    most_consistent: Array

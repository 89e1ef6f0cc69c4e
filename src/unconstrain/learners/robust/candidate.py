"""A policy to choose from."""

from __future__ import annotations

from dataclasses import dataclass

from ...base.arrays import Array
from .posterior import Posterior
from .smoothness import Smoothness


@dataclass(frozen=True, eq=False)
class Candidate:
    """What one way of learning found.

    Parameters
    ----------
    name : str
        How it was learnt.
    weights : ndarray, shape (M, d, p)
    posterior : Posterior
    held_out : ndarray, shape (N, d)
        Prediction of each sample by what is learnt from the other folds.
    variance : float
        Of the noise, per coordinate, misfit included.
    smoothness : Smoothness
        Of the policy, as far as it is part of the prior.
    most_consistent : ndarray, shape (N, d)
        As ``held_out``, but as held-out consistency alone would choose, and no prior.
    """

    name: str
    weights: Array
    posterior: Posterior
    held_out: Array
    variance: float
    smoothness: Smoothness
    most_consistent: Array

"""Learners, from training data to a solution: those of the paper, and the robust ones."""

from . import robust
from .direct import Direct
from .hybrid import Hybrid
from .inconsistency import Inconsistency
from .learner import Learner
from .named import named
from .robust import (
    SPHERE_HIDDEN_BY_NOISE,
    Likelihood,
    NoiseCorrected,
    Robust,
    Segments,
    Uncertainty,
    noise_by_differences,
)
from .solution import Belief, Solution

__all__ = [
    "SPHERE_HIDDEN_BY_NOISE",
    "Belief",
    "Direct",
    "Hybrid",
    "Inconsistency",
    "Learner",
    "Likelihood",
    "NoiseCorrected",
    "Robust",
    "Segments",
    "Solution",
    "Uncertainty",
    "named",
    "noise_by_differences",
    "robust",
]

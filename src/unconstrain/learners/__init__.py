"""From what was observed to a solution: the paper's learners, and the robust ones."""

from . import robust
from .direct import Direct
from .hybrid import Hybrid
from .inconsistency import Inconsistency
from .learner import Learner
from .named import named
from .robust import HIDDEN, Likelihood, NoiseCorrected, Robust, Segments, Uncertainty, noise_by_differences
from .solution import Belief, Solution

__all__ = [
    "HIDDEN",
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

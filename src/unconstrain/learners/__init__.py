"""Learners, from training data to a solution: those of the paper, and the robust ones.

Examples
--------
>>> uc.learners.Hybrid(softness=0.1).softness
0.1
"""

from . import robust, secondary
from .contracting import Contracting
from .direct import Direct
from .hybrid import Hybrid
from .inconsistency import Inconsistency
from .learner import Learner
from .named import named
from .robust.learner import Likelihood, NoiseCorrected, Robust, Segments
from .solution import Belief, Judged, Solution, Uncertainty

__all__ = [
    "Belief",
    "Contracting",
    "Direct",
    "Hybrid",
    "Inconsistency",
    "Judged",
    "Learner",
    "Likelihood",
    "NoiseCorrected",
    "Robust",
    "Segments",
    "Solution",
    "Uncertainty",
    "named",
    "robust",
    "secondary",
]

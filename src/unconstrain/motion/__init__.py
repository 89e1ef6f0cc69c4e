"""A policy in motion: roll-outs, arriving, and what is guaranteed of it.

Examples
--------
>>> uc.motion.rollout(lambda x: -x, [1.0], steps=3, dt=0.5, method="euler").states[:, 0]
array([1.  , 0.5 , 0.25])
"""

from . import obstacles
from .certificate import certify
from .guided import STORED, Guided
from .potential import Potential
from .rollouts import rollout

__all__ = ["STORED", "Guided", "Potential", "certify", "obstacles", "rollout"]

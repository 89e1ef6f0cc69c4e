"""A policy in motion: roll-outs, arriving, and keeping near the data.

Examples
--------
>>> uc.motion.rollout(lambda x: -x, [1.0], steps=3, dt=0.5).states[:, 0]
array([1.  , 0.5 , 0.25])
"""

from .containment import Contained
from .guided import Guided
from .potential import Potential
from .rollouts import rollout

__all__ = ["Contained", "Guided", "Potential", "rollout"]

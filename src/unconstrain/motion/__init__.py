"""A policy in motion: roll-outs, arriving, and keeping near the data."""

from .containment import Contained
from .guided import Guided
from .potential import Potential
from .rollouts import rollout

__all__ = ["Contained", "Guided", "Potential", "rollout"]

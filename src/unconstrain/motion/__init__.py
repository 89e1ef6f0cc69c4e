"""A policy in motion: roll-outs, and keeping near the data."""

from .containment import Contained
from .rollouts import rollout

__all__ = ["Contained", "rollout"]

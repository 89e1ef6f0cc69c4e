"""Wiping with contact, in a physics engine: a hand that demonstrates, an arm that reproduces.

Needs the extra ``sim``.
"""

from .engine import BACKENDS, backend
from .hand import demonstrate
from .postures import postures_along
from .reproduction import Wipe, turning, wipe

__all__ = ["BACKENDS", "Wipe", "backend", "demonstrate", "postures_along", "turning", "wipe"]

"""Wiping with contact, in a physics engine: a hand that demonstrates, an arm that reproduces.

Needs the extra ``sim``.
"""

from .engine import BACKENDS, backend
from .hand import demonstrate
from .reproduction import wipe

__all__ = ["BACKENDS", "backend", "demonstrate", "wipe"]

"""Wiping with contact, in a physics engine: a hand that demonstrates, an arm that reproduces.

Needs the extra ``sim``.
"""

from .control import Controller, Gains
from .engine import BACKENDS, backend, engine
from .hand import demonstrate
from .postures import postures_along
from .reproduction import Wipe, centres, turning, wipe
from .scene import Scene, arm_scene, hand_scene

__all__ = [
    "BACKENDS",
    "Controller",
    "Gains",
    "Scene",
    "Wipe",
    "arm_scene",
    "backend",
    "centres",
    "demonstrate",
    "engine",
    "hand_scene",
    "postures_along",
    "turning",
    "wipe",
]

"""A pendulum with friction, as a velocity field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Array, check_at_least


@dataclass(frozen=True)
class Pendulum:
    """The phase flow of a pendulum, ``π(x) = (s x₂, −sin(k x₁) − c x₂)``: a spiral into the origin, of uneven speed.

    Parameters
    ----------
    speed : float
        s.
    stiffness : float
        k.
    friction : float
        c.
    """

    speed: float = 1.5
    stiffness: float = 2.5
    friction: float = 0.4

    def __post_init__(self) -> None:
        for name in ("speed", "stiffness", "friction"):
            check_at_least(name, getattr(self, name), 0.0)

    def __call__(self, states: Array) -> Array:
        """Actions (T, 2) at states (T, 2)."""
        angle, rate = np.asarray(states, dtype=np.float64).T
        return np.column_stack([self.speed * rate, -np.sin(self.stiffness * angle) - self.friction * rate])

"""A goal that is reached: the smallest change of a velocity with which a potential falls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array
from ..base.display import Shown
from ..models import Correction
from ..risks import project
from .potential import TOLD, Potential, radius


@dataclass(frozen=True, eq=False, repr=False)
class Descent(Shown):
    """Velocities in the ball ``‖u + m‖ ≤ r``, ``m = ½ N ∇V``: with each of them V falls; see :class:`.Guided`.

    Parameters
    ----------
    potential : Potential
    pace : float
        The s in ``r = max(‖m‖ − s, ½ ‖m‖)``, in units of the state per second.

    Examples
    --------
    >>> bowl = uc.motion.Potential(np.zeros(2), np.vstack([np.eye(2), -np.eye(2)]), np.zeros(4), np.ones(4))
    >>> uc.motion.descent.Descent(bowl, pace=0.1).guided(np.array([[1.0, 0.0]]), np.array([[1.0, 0.0]]))  # away
    array([[-0.5,  0. ]])
    """

    potential: Potential
    pace: float

    @property
    def dt(self) -> float:
        """The longest Euler step with which V is sure to fall, seconds."""
        return 2.0 / self.potential.curvature

    @property
    def promise(self) -> str:
        """What is added, when that is right, and what is guaranteed, in words."""
        goal = ", ".join(f"{each:.4g}" for each in self.potential.goal)
        return (
            "Where the policy does not lead to the goal, a velocity is added that leads down a bowl, fitted to "
            "the demonstrations, with its bottom at the goal. Right where every movement is to end there; ways from "
            f"new starts are not learnt. From every state, movements arrive: free at ({goal}), and under any flat "
            f"constraint that it is told of ({TOLD}) where the bowl is lowest on it. Every step of up to "
            f"{self.dt:.3g} s leads nearer, at {0.75 * self.pace:.3g} a second or faster, and slower only near the "
            "end. A constraint that moves or is not told, or an obstacle, may lead away."
        )

    def correction(self) -> Correction:
        """The same as numbers, for where there is no Python."""
        table = self.potential
        parts = table.goal, table.directions, table.offsets, table.weights
        return Correction("descent", *parts, {"pace": self.pace}, np.zeros((0, len(table.goal))), self.promise)

    def spare(self, states: Array, velocities: Array, slope: Array) -> Array:
        """By how much V falls faster than it has to where ``N ∇V`` (N, n) is so, as a share of what that is made of."""
        falls, half = -np.vecdot(slope, velocities), 0.5 * np.linalg.norm(slope, axis=1)
        least = (velocities**2).sum(axis=1) + half**2 - radius(half, self.pace) ** 2
        return (falls - least) / np.maximum(np.abs(falls) + half**2, np.finfo(float).tiny)

    def guided(self, states: Array, wanted: Array, projections: Array | None = None) -> Array:
        """Velocities (N, n) for those that are wanted, both in the null space of projections N (N, n, n)."""
        half = 0.5 * self.potential.gradient(states)
        if projections is not None:
            half = project(projections, half)
        away = wanted + half
        distance, depth = (np.linalg.norm(each, axis=1) for each in (away, half))
        allowed, usual = radius(depth, self.pace), np.sqrt((wanted**2).sum(axis=1) + self.pace**2)
        inside = distance <= allowed
        climb = np.maximum(np.vecdot(wanted, half), 0.0) / np.maximum(depth * usual, np.finfo(float).tiny)
        share = (allowed - climb**2 * (distance - allowed)) / np.where(inside, 1.0, distance)
        return np.where(inside[:, None], wanted, np.maximum(share, 0.0)[:, None] * away - half)

    def single(self) -> Callable[[ArrayLike, Array], None]:
        """The same for one state (n,) and its velocity (n,), which is changed in place."""
        potential, pace = self.potential, self.pace
        directions, halved = potential.directions, 0.5 * potential.weights[:, None] * potential.directions
        begin = directions @ potential.goal + potential.offsets
        along, maximum, zeros, least = directions.dot, np.maximum, np.zeros(len(begin)), np.finfo(float).tiny

        def guide(x: ArrayLike, wanted: Array) -> None:
            beyond = along(x)
            beyond -= begin
            half = maximum(beyond, zeros).dot(halved)
            fast, rise, steep = wanted.dot(wanted), wanted.dot(half), half.dot(half)
            distance, depth = sqrt(max(fast + 2.0 * rise + steep, 0.0)), sqrt(steep)
            allowed = max(depth - pace, 0.5 * depth)
            if distance > allowed:
                climb = rise / (depth * sqrt(fast + pace**2) or least) if rise > 0.0 else 0.0
                share = (allowed - climb**2 * (distance - allowed)) / distance
                np.subtract(max(share, 0.0) * (wanted + half), half, out=wanted)

        return guide

    def _summary(self) -> tuple[str, ...]:
        goal = ", ".join(f"{each:.4g}" for each in self.potential.goal)
        return f"goal=({goal})", f"dt={self.dt:.3g}"

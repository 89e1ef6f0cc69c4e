"""A cycle that attracts: on every plane that cuts it, at the pace that was shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array
from ..base.display import Shown, counted
from ..recordings import Demonstration, stack
from ..risks import project
from .potential import Potential, spread_over

PULL = 0.5
"""The cycle attracts at least at this share of the turning rate, rad/s."""

RUSH = 2.0
"""And at most at this."""

MIDDLE = 0.2
"""Where V is as level as nearer to the middle than this share of the radius, motion is slower in proportion."""

STRAY = 0.2
"""The pace is that of the demonstrations to within this share."""

ROUND = 1e-3
"""Weight of a sphere beside the demonstrated states, where these say nothing of the shape."""

_DIRECTIONS = 24
"""Of the slopes that the shape is made of, for each dimension."""


@dataclass(frozen=True, eq=False, repr=False)
class Orbit(Shown):
    """The closed convex surface ``V(x) = ½ r²``, and the way round on it.

    A plane through its inside cuts it in one closed convex curve. With ``g = N ∇V`` and the distance
    ``e ≈ (V − ½ r²) / ‖g‖``, the speed along g is kept between −PULL and −RUSH times ω e, so that the surface attracts
    under every constraint, and from both sides. What is left of a velocity is along the surface. Its part along the
    demonstrated way round, ``t = N B (x − x*)`` less what is along g, is kept within STRAY of ‖t‖.

    Parameters
    ----------
    potential : Potential
        V, in squared units of the state, about the middle x* of the cycle.
    radius : float
        Its r.
    turn : ndarray, shape (n, n)
        B, 1/s.
    rate : float
        ω, rad/s.
    """

    potential: Potential
    radius: float
    turn: Array
    rate: float

    @property
    def promise(self) -> str:
        """What is guaranteed, in words."""
        middle = ", ".join(f"{each:.4g}" for each in self.potential.goal)
        return (
            f"A closed convex surface attracts, of radius {self.radius:.4g} about ({middle}), from every state but its "
            f"middle, free and under any flat constraint: at {PULL * self.rate:.4g} to {RUSH * self.rate:.4g} per "
            "second. A plane through its inside cuts it in one cycle, on which the pace is within "
            f"{STRAY:.0%} of the demonstrated one wherever the plane lets it turn. A constraint that moves may leave "
            "it."
        )

    def spare(self, states: Array, velocities: Array, slope: Array) -> Array:
        """By how much the surface attracts more than it has to where ``N ∇V`` (N, n) is so, as a share of that."""
        off = self.potential(states) - 0.5 * self.radius**2
        share = np.minimum(1.0, np.linalg.norm(slope, axis=1) / self._width(states))
        least = share**2 * PULL * self.rate * off**2
        nearer = -off * np.vecdot(slope, velocities)
        return (nearer - least) / np.maximum(np.abs(nearer) + least, np.finfo(float).tiny)

    def guided(self, states: Array, wanted: Array, projections: Array | None = None) -> Array:
        """Velocities (N, n) for those that are wanted, both in the null space of projections N (N, n, n)."""
        slope, round_ = self.potential.gradient(states), (states - self.potential.goal) @ self.turn.T
        if projections is not None:
            slope, round_ = project(projections, slope), project(projections, round_)
        steep, tiny = np.linalg.norm(slope, axis=1), np.finfo(float).tiny
        outward = slope / np.maximum(steep, tiny)[:, None]
        width = self._width(states)
        off = (self.potential(states) - 0.5 * self.radius**2) / np.maximum(steep, width)
        speed = np.vecdot(outward, wanted)
        bounds = np.sort([-PULL * self.rate * off, -RUSH * self.rate * off], axis=0)
        along = wanted - speed[:, None] * outward
        round_ = round_ - np.vecdot(outward, round_)[:, None] * outward
        pace = np.linalg.norm(round_, axis=1)
        way = round_ / np.maximum(pace, self.rate * width)[:, None]
        now = np.vecdot(way, along)
        kept = np.clip(now, (1.0 - STRAY) * pace, (1.0 + STRAY) * pace) - now
        moved = along + kept[:, None] * way + np.clip(speed, *bounds)[:, None] * outward
        return np.minimum(1.0, steep / width)[:, None] * moved

    def _width(self, states: Array) -> Array:
        """Where ``‖N ∇V‖`` is less, V is nearly level, and motion slower in proportion, (N,)."""
        return MIDDLE * np.sqrt(np.maximum(2.0 * self.potential(states), self.radius**2))

    @property
    def dt(self) -> float:
        """Euler steps of this length widen the cycle by two hundredths, seconds."""
        return 0.04 * PULL / self.rate

    def single(self) -> Callable[[ArrayLike, Array], None]:
        """The same for one state (n,) and its velocity (n,), which is changed in place."""
        table, n, rate = self.potential, len(self.turn), self.rate
        directions, weighted = table.directions, table.weights[:, None] * table.directions
        rows = np.concatenate([np.eye(n), self.turn, directions])
        begin, zeros = rows @ table.goal, np.zeros(len(directions))
        level = self.radius**2

        def guide(x: ArrayLike, wanted: Array) -> None:
            seen = rows.dot(x)
            seen -= begin
            vectors = np.empty((4, n))  # z, B z, ∇V and what is wanted: all else is in their inner products
            vectors[:2] = seen[: 2 * n].reshape(2, n)
            np.maximum(seen[2 * n :], zeros).dot(weighted, out=vectors[2])
            vectors[3] = wanted
            (_, _, gz, _), (_, ww, gw, vw), (_, _, gg, vg), _ = vectors.dot(vectors.T).tolist()
            # V is quadratic: 2 V = ∇Vᵀ z.
            steep, least = max(sqrt(gg), 1e-150), MIDDLE * sqrt(max(gz, level))
            off, speed = 0.5 * (gz - level) / max(steep, least), vg / steep
            first, last = -PULL * rate * off, -RUSH * rate * off
            radial = min(max(speed, min(first, last)), max(first, last))
            across = gw / (steep * steep)
            pace = sqrt(max(ww - across * gw, 0.0))
            longest = max(pace, rate * least)
            now = (vw - across * vg) / longest
            kept = (min(max(now, (1.0 - STRAY) * pace), (1.0 + STRAY) * pace) - now) / longest
            share = min(1.0, steep / least)
            weights = np.array([0.0, share * kept, share * ((radial - speed) / steep - kept * across), share])
            weights.dot(vectors, out=wanted)

        return guide

    def _summary(self) -> tuple[str, ...]:
        return counted(len(self.turn), "state"), f"radius={self.radius:.4g}", f"rate={self.rate:.4g}"


def turns(demos: Sequence[Demonstration]) -> float:
    """How often demonstrations go round the middle of their states, in their mean, as seen along the least of them."""
    states = stack(demos).states
    middle = states.mean(axis=0)
    axes = np.linalg.svd(states - middle, full_matrices=False)[2][:2]
    if len(axes) < 2:
        return 0.0
    plane = [(demo.states - middle) @ axes.T @ np.array([1.0, 1j]) for demo in demos]
    return float(abs(sum(np.angle(z[1:] * z[:-1].conj()).sum() for z in plane))) / (2.0 * np.pi * len(demos))


def encircled(states: Array, velocities: Array) -> Orbit:
    """The orbit that these states (N, n) are on, with the way round of velocities (N, n) there."""
    middle = states.mean(axis=0)
    z = states - middle
    radius = float(np.sqrt((z**2).sum(axis=1).mean()))
    axes = np.stack([np.eye(len(middle)), -np.eye(len(middle))])
    directions = spread_over(np.concatenate([z, -z, *(radius * axes)]), _DIRECTIONS)
    weights = _level((np.maximum(z @ directions.T, 0.0) / radius) ** 2)
    used = weights > 0.0
    potential = Potential(middle, directions[used], np.zeros(int(used.sum())), weights[used])
    turn = np.linalg.lstsq(z, velocities, rcond=1e-6)[0].T
    return Orbit(potential, radius, turn, float(np.sqrt((velocities**2).sum(axis=1).mean())) / radius)


def _level(beyond: Array) -> Array:
    """Weights (K,) at least zero with which sums of ``beyond`` (N, K) are one: in the mean, and as nearly as can be."""
    from scipy.optimize import nnls

    count, slopes = beyond.shape
    prior, sphere = ROUND * count / slopes, 1.0 / float(beyond.sum(axis=1).mean())
    root = np.linalg.cholesky(beyond.T @ beyond + prior * np.eye(slopes))
    weights = nnls(root.T, np.linalg.solve(root, beyond.sum(axis=0) + prior * sphere))[0]
    return weights / float((beyond @ weights).mean())  # least squares alone are for less where sums vary

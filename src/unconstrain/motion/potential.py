"""A Lyapunov function that movements descend: convex, learnt from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from math import comb
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.display import Shown, counted

PACE = 0.05
"""V falls at least as by moving straight down at this share of the usual speed, or at half of m where that is less.

On 15 of LASA's shapes 0.02 and 0.05 cost the same, and with 0.02 not all starts had arrived in four times the time.
"""

TOLD = "'unconstrain rollout' tells it; exported, 'under' takes its projection, and 'step' knows of none"
"""How a guided policy is told of a constraint, for which alone anything is promised on it."""

STEEPNESS, STEEPEST = 1e-5, 6e-7
"""Weights of V's curvature beside the squared correction, free of units; the second where a step's length is given."""

MOST = 500
"""Samples that V is learnt from: of more, so many, evenly."""

_DIRECTIONS, _LEAST = 24, 96
"""Directions of the slopes that V may be made of: so many for each dimension, and no fewer in all."""

TRIED = 20_000
"""So many directions at most are tried for the sharpest bend of V; of more, all slopes count as one bend."""

_PARALLEL = 1e-9

_OFFSETS = np.arange(0.0, 1.0, 0.1)
"""Where V's curvature along a direction may change, as shares of the farthest sample in it."""

_MARGINS = 10.0, 30.0
"""How fast V is to fall at first, times the usual speed: searches begin there, and the better is gone on with."""


@dataclass(frozen=True, eq=False, repr=False)
class Potential(Shown):
    """``V(x) = ½ Σ w (aᵀ(x − x*) − b)₊²``, with offsets at least zero.

    The weights of a direction, added up in the order of offsets, are V's curvature along it, and at least zero. So V is
    convex, with continuous slope, zero at the goal and positive elsewhere: it has one minimum on every flat surface
    and no other place there where it is level.

    Parameters
    ----------
    goal : ndarray, shape (n,)
    directions : ndarray, shape (K, n)
        Unit vectors a; the axes are among them, both ways and without offset.
    offsets : ndarray, shape (K,)
    weights : ndarray, shape (K,)
        In 1/s: V's gradient is a velocity. Some may be negative, running sums along a direction are not.

    Examples
    --------
    >>> bowl = uc.motion.Potential(np.zeros(2), np.vstack([np.eye(2), -np.eye(2)]), np.zeros(4), np.ones(4))
    >>> bowl(np.array([[3.0, 4.0]])), bowl.gradient(np.array([[3.0, 4.0]]))
    (array([12.5]), array([[3., 4.]]))
    """

    goal: Array
    directions: Array
    offsets: Array
    weights: Array

    def __call__(self, states: Array) -> Array:
        """V at N states, shape (N,), in squared units of the state per second."""
        return self._height(self._beyond(states))

    def gradient(self, states: Array) -> Array:
        """∇V at N states, shape (N, n)."""
        return self._slope(self._beyond(states))

    def both(self, states: Array) -> tuple[Array, Array]:
        """V (N,) and ∇V (N, n)."""
        beyond = self._beyond(states)
        return self._height(beyond), self._slope(beyond)

    @property
    def curvature(self) -> float:
        """An upper bound of V's second derivatives, 1/s."""
        directions, bends = self.bends()
        return steepest(directions, np.maximum(bends.max(axis=1), 0.0))

    def bends(self) -> tuple[Array, Array]:
        """Directions (D, n) that differ, and V's curvatures (D, K) along them, each from an offset to the next."""
        directions, which = np.unique(self.directions, axis=0, return_inverse=True)
        order = np.argsort(self.offsets, kind="stable")
        weights = np.where(which[order] == np.arange(len(directions))[:, None], self.weights[order], 0.0)
        return directions, np.cumsum(weights, axis=1)

    def _beyond(self, states: Array) -> Array:
        return np.maximum((states - self.goal) @ self.directions.T - self.offsets, 0.0)

    def _height(self, beyond: Array) -> Array:
        return 0.5 * beyond**2 @ self.weights

    def _slope(self, beyond: Array) -> Array:
        return beyond @ (self.weights[:, None] * self.directions)

    def _summary(self) -> tuple[str, ...]:
        return counted(len(self.goal), "state"), counted(len(self.weights), "slope")


def descended(states: Array, velocities: Array, goal: Array, most: float = np.inf) -> Potential:
    """The potential that these velocities (N, n) descend with the least squared correction; see :func:`excess`.

    Among those whose curvature changes at offsets along directions of the motion, and of the states as seen from the
    goal. It is at most ``most``, in 1/s. Units of length and time do not matter.
    """
    some = np.unique(np.linspace(0, len(states) - 1, MOST).astype(np.intp))
    z, v = states[some] - goal, velocities[some]
    size, speed = _size(z), _size(v)
    z, v = z / size, v / speed
    directions = spread_over(np.concatenate([-v, z, np.eye(z.shape[1])]), max(_DIRECTIONS, _LEAST / z.shape[1]))
    offsets = np.outer(np.maximum((z @ directions.T).max(axis=0), 0.0), _OFFSETS)
    curvatures = _curvatures(z, v, directions, offsets, most * size / speed)
    weights = np.diff(np.where(curvatures > 1e-3 * curvatures.max(), curvatures, 0.0), axis=1, prepend=0.0)
    way, at = np.nonzero(weights)
    axes = np.concatenate([np.eye(len(goal)), -np.eye(len(goal))])
    found = Potential(
        goal,
        np.concatenate([axes, directions[way]]),
        size * np.concatenate([np.zeros(len(axes)), offsets[way, at]]),
        speed / size * np.concatenate([np.ones(len(axes)), weights[way, at]]),
    )
    return replace(found, weights=min(1.0, most / found.curvature) * found.weights)


def steepest(directions: Array, weights: Array) -> float:
    """Largest eigenvalue of ``Σ w a aᵀ`` over slopes (K, n) felt together, those with ``aᵀz ≥ 0`` for some z."""
    felt, n = weights * _felt(directions), directions.shape[1]
    squares = (directions[:, :, None] * directions[:, None]).reshape(-1, n * n)
    return float(np.linalg.eigvalsh((felt @ squares).reshape(-1, n, n))[:, -1].max())


def _felt(directions: Array) -> Array:
    """Which of directions (K, n) have ``aᵀz ≥ 0``, for some z: of each set that no other includes, or one row of all.

    Turned until it is at right angles to n − 1 of them, z loses none of these; so such z are tried, where not too many.
    """
    count, n = directions.shape
    if n == 1 or comb(count, n - 1) > TRIED:
        return np.ones((1, count))
    some = np.array(list(combinations(range(count), n - 1)))
    across = np.linalg.svd(directions[some])[2][:, -1] @ directions.T
    return np.concatenate([across >= -_PARALLEL, across <= _PARALLEL]).astype(np.float64)


def _size(vectors: Array) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean())) or 1.0


def spread_over(seen: Array, most: float) -> Array:
    """Unit vectors (K, n) in the directions that occur (N, n): farthest first, at most so many for each dimension."""
    lengths = np.linalg.norm(seen, axis=1)
    seen = seen[lengths > 1e-2 * _size(seen)] / lengths[lengths > 1e-2 * _size(seen), None]
    chosen = [int(np.linalg.norm(seen - seen.mean(axis=0), axis=1).argmax())]
    gaps = np.linalg.norm(seen - seen[chosen[0]], axis=1)
    while len(chosen) < most * seen.shape[1] and gaps.max() > 1e-6:
        chosen.append(int(gaps.argmax()))
        gaps = np.minimum(gaps, np.linalg.norm(seen - seen[chosen[-1]], axis=1))
    return seen[chosen]


def _curvatures(z: Array, v: Array, directions: Array, offsets: Array, most: float) -> Array:
    """Curvatures (K, m) of V from each offset on, beside a sphere of curvature one, with the least squared correction.

    That V falls fast along all motion is a convex problem: from where that ends, the least correction is searched.
    """
    from scipy.optimize import minimize

    beyond = np.maximum((z @ directions.T)[:, :, None] - offsets, 0.0)
    between = -np.diff(beyond, axis=2, append=0.0)
    slopes = (between[:, None] * directions.T[:, :, None]).reshape(z.size, -1)
    bent, scale, pace = _bent(directions, most), min(most, 1e3), np.linalg.norm(v, axis=1)
    ahead = v / np.maximum(pace, PACE)[:, None]

    def correction(gradients: Array) -> tuple[float, Array]:
        changed, slope = excess(v, -0.5 * gradients)
        return float(changed @ changed), -slope

    def falling(margin: float, gradients: Array) -> tuple[float, Array]:
        lack = pace * np.maximum(margin + np.vecdot(ahead, gradients), 0.0)
        return float(lack @ lack), 2.0 * (pace * lack)[:, None] * ahead

    def search(of: Callable[[Array], tuple[float, Array]], began: Array, steps: int) -> Any:
        def cost(shares: Array) -> tuple[float, Array]:
            lack, down = of((slopes @ (scale * shares)).reshape(z.shape) + z)
            price, dearer = bent(scale * shares.reshape(offsets.shape))
            slope = down.ravel() @ slopes / len(z) + dearer.ravel()
            return 1e4 * (lack / len(z) + price), 1e4 * scale * slope

        began = began * min(1.0, most / (1.0 + steepest(directions, scale * began.reshape(offsets.shape).max(axis=1))))
        until = {"gtol": 1e-7, "ftol": 1e-6, "maxiter": steps, "maxcor": 20}
        return minimize(cost, began, jac=True, bounds=[(0.0, None)] * len(began), method="L-BFGS-B", options=until)

    even = np.full(offsets.size, 1.0 / (scale * len(directions)))
    begun = (search(correction, search(partial(falling, margin), even, 60).x, 100) for margin in _MARGINS)
    best = min(begun, key=lambda found: found.fun)
    for _ in range(3):  # where the sharpest bend moves to another direction a search may stall
        best = search(correction, best.x, 150)
    return scale * best.x.reshape(offsets.shape)


def _bent(directions: Array, most: float) -> Callable[[Array], tuple[float, Array]]:
    """Of curvatures (K, m): what they cost, little below the most that is allowed and much above, and its slope."""
    felt, n, steepness = _felt(directions), directions.shape[1], STEEPNESS if most == np.inf else STEEPEST
    felt = felt[:: -(-len(felt) // 400)]  # evenly, no more than needed
    squares = (directions[:, :, None] * directions[:, None]).reshape(-1, n * n)

    def cost(curvatures: Array) -> tuple[float, Array]:
        sharpest = curvatures.max(axis=1)
        at = curvatures == sharpest[:, None]
        bends, ways = np.linalg.eigh((felt * sharpest @ squares).reshape(-1, n, n))
        over = np.maximum((1.0 + bends[:, -1]) / most - 1.0, 0.0)
        down = 0.2 * (over / most) @ (felt * (ways[:, :, -1] @ directions.T) ** 2) + steepness
        return float(0.1 * over @ over + steepness * sharpest.sum()), (down / at.sum(axis=1))[:, None] * at

    return cost


def excess(velocities: Array, centres: Array) -> tuple[Array, Array]:
    """By how much :meth:`.Descent.guided` changes velocities (N,), and half its square's slope in centres (N, n)."""
    away, tiny = velocities - centres, np.finfo(float).tiny
    distance, depth = (np.maximum(np.linalg.norm(each, axis=1), tiny) for each in (away, centres))
    usual = np.maximum(depth * np.sqrt((velocities**2).sum(axis=1) + PACE**2), tiny)
    outside = np.maximum(distance - radius(depth, PACE), 0.0)
    climb = np.maximum(-np.vecdot(velocities, centres), 0.0) / usual
    changed = np.minimum((1.0 + climb**2) * outside, distance)
    toward, outward = away / distance[:, None], centres / depth[:, None]
    grown = np.where(depth > 2.0 * PACE, 1.0, 0.5)[:, None]
    turned = velocities / usual[:, None] + (climb / depth)[:, None] * outward
    slope = (1.0 + climb**2)[:, None] * (toward + grown * outward) + (2.0 * outside * climb)[:, None] * turned
    return changed, -changed[:, None] * np.where((changed < distance)[:, None], slope, toward)


def radius(depth: Array, pace: float) -> Array:
    """Radii of balls with centres so far from rest: what is slower than the pace is outside, near rest half of it."""
    return np.maximum(depth - pace, 0.5 * depth)

"""A Lyapunov function that movements descend: convex, learnt from them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from ..base.arrays import Array
from ..base.display import Shown, counted

PACE = 0.05
"""V falls at least as by moving straight down at this share of the usual speed, or at half of m where that is less.

On 15 of LASA's shapes 0.02 and 0.05 cost the same, and with 0.02 not all starts had arrived in four times the time.
"""

STEEPNESS = 1e-5
"""Weight of V's curvature beside the squared correction, both free of units.

On the same shapes 1e-6 halved the longest step, for a fifth less correction.
"""

STEEPEST = 1e-6
"""The same where a length of steps is asked for: the least that is tried, and then more until V falls with them.

Narrow turns need it: of LASA's "BendedLine" guiding costs 1.4 times the error with steps of 20 ms, 1.1 with 5 ms.
"""

MOST = 2000
"""Samples that V is learnt from: of more, so many, evenly."""

_DIRECTIONS, _LEAST = 24, 96
"""Directions of the slopes that V may be made of: so many for each dimension, and no fewer in all.

In the plane half as many cost LASA's "BendedLine" 1.19 times the error with steps of 5 ms, these 1.10, in fields of the
default width; five other shapes cost the same with both. Half as many again change the price by two hundredths at most.
"""

TRIED = 20_000
"""So many directions at most are tried for the sharpest bend of V; of more, all slopes count as one bend."""

_PARALLEL = 1e-9

_OFFSETS = np.array([0.0, 0.2, 0.4, 0.6, 0.8])
"""Where slopes begin, as shares of the farthest sample in their direction."""


@dataclass(frozen=True, eq=False, repr=False)
class Potential(Shown):
    """``V(x) = ½ Σ w (aᵀ(x − x*) − b)₊²``, with weights and offsets at least zero.

    Convex, with continuous slope, zero at the goal and positive elsewhere. So it has one minimum on every flat surface,
    and no other place there where it is level.

    Parameters
    ----------
    goal : ndarray, shape (n,)
    directions : ndarray, shape (K, n)
        Unit vectors a; the axes are among them, both ways and without offset.
    offsets : ndarray, shape (K,)
    weights : ndarray, shape (K,)
        In 1/s: V's gradient is a velocity.
    """

    goal: Array
    directions: Array
    offsets: Array
    weights: Array

    def __call__(self, states: Array) -> Array:
        """V at N states, shape (N,), in squared units of the state per second."""
        return 0.5 * self._beyond(states) ** 2 @ self.weights

    def gradient(self, states: Array) -> Array:
        """∇V at N states, shape (N, n)."""
        return self._beyond(states) @ (self.weights[:, None] * self.directions)

    @property
    def curvature(self) -> float:
        """An upper bound of V's second derivatives, 1/s."""
        return steepest(self.directions, self.weights)

    def scaled(self, factor: float) -> Potential:
        """The same with all weights multiplied."""
        return Potential(self.goal, self.directions, self.offsets, factor * self.weights)

    def _beyond(self, states: Array) -> Array:
        return np.maximum((states - self.goal) @ self.directions.T - self.offsets, 0.0)

    def _summary(self) -> tuple[str, ...]:
        return counted(len(self.goal), "state"), counted(len(self.weights), "slope")


def descended(states: Array, velocities: Array, goal: Array, most: float = np.inf) -> Potential:
    """The potential that these velocities (N, n) descend with the least squared correction; see :func:`excess`.

    Among slopes in directions of the motion and of the states as seen from the goal. Its curvature is at most ``most``,
    in 1/s. Units of length and time do not matter.
    """
    some = np.unique(np.linspace(0, len(states) - 1, MOST).astype(np.intp))
    z, v = states[some] - goal, velocities[some]
    size, speed = _size(z), _size(v)
    z, v = z / size, v / speed
    directions, offsets = _slopes(z, v)
    weights = np.full(len(offsets), len(_OFFSETS) / len(offsets))
    first = 0 if most > speed / size else 63  # the axes alone bend as much
    for steepness in (STEEPNESS if most == np.inf else STEEPEST) * 1.2 ** np.arange(first, 64):
        weights = _weights(z, v, directions, offsets, steepness, weights)
        kept, axes = weights > 1e-4 * weights.max(), np.eye(len(goal))
        found = Potential(
            goal,
            np.concatenate([axes, -axes, directions[kept]]),
            size * np.concatenate([np.zeros(2 * len(goal)), offsets[kept]]),
            speed / size * np.concatenate([np.ones(2 * len(goal)), weights[kept]]),
        )
        if found.curvature <= most:
            break
    return found.scaled(min(1.0, most / found.curvature))


def steepest(directions: Array, weights: Array) -> float:
    """Largest eigenvalue of ``Σ w a aᵀ`` over slopes (K, n) that are felt together, those with ``aᵀz ≥ 0`` for some z.

    Turned until it is at right angles to n − 1 of them, z loses none of these; so such z are tried, where not too many.
    """
    count, n = directions.shape
    if n == 1 or comb(count, n - 1) > TRIED:
        return float(np.linalg.eigvalsh((weights * directions.T) @ directions)[-1])
    some = np.array(list(combinations(range(count), n - 1)))
    across = np.linalg.svd(directions[some])[2][:, -1] @ directions.T
    felt = weights * np.concatenate([across >= -_PARALLEL, across <= _PARALLEL])
    squares = (directions[:, :, None] * directions[:, None]).reshape(count, n * n)
    return float(np.linalg.eigvalsh((felt @ squares).reshape(-1, n, n))[:, -1].max())


def _size(vectors: Array) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean())) or 1.0


def _slopes(z: Array, v: Array) -> tuple[Array, Array]:
    """Directions (K, n) and offsets (K,) to choose from."""
    chosen = spread_over(np.concatenate([-v, z, np.eye(z.shape[1])]), max(_DIRECTIONS, _LEAST / z.shape[1]))
    farthest = np.maximum((z @ chosen.T).max(axis=0), 0.0)
    return np.repeat(chosen, len(_OFFSETS), axis=0), np.outer(farthest, _OFFSETS).ravel()


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


def _weights(z: Array, v: Array, directions: Array, offsets: Array, steepness: float, began: Array) -> Array:
    """Weights (K,) of the slopes, beside weights of one on the axes: those of the least correction."""
    from scipy.optimize import minimize

    beyond = np.maximum(z @ directions.T - offsets, 0.0)

    def loss(weights: Array) -> tuple[float, Array]:
        centres = -0.5 * ((beyond * weights) @ directions + z)
        outside, slope = excess(v, centres)
        return float(outside @ outside) / len(z) + steepness * weights.sum(), (
            -((slope @ directions.T) * beyond).sum(axis=0) / len(z) + steepness
        )

    until = {"gtol": 1e-8, "ftol": 1e-10, "maxiter": 300}
    bounds = [(0.0, None)] * len(offsets)
    return np.asarray(minimize(loss, began, jac=True, bounds=bounds, method="L-BFGS-B", options=until).x)


def excess(velocities: Array, centres: Array) -> tuple[Array, Array]:
    """How far velocities are outside the balls (N,), and of half its square the slope in the centres (N, n)."""
    away, tiny = velocities - centres, np.finfo(float).tiny
    distance, depth = np.linalg.norm(away, axis=1), np.linalg.norm(centres, axis=1)
    outside = np.maximum(distance - radius(depth, PACE), 0.0)
    toward, outward = away / np.maximum(distance, tiny)[:, None], centres / np.maximum(depth, tiny)[:, None]
    grown = np.where(depth > 2.0 * PACE, 1.0, 0.5)[:, None]
    return outside, -outside[:, None] * (toward + grown * outward)


def radius(depth: Array, pace: float) -> Array:
    """Radii of balls with centres so far from rest: what is slower than the pace is outside, near rest half of it."""
    return np.maximum(depth - pace, 0.5 * depth)

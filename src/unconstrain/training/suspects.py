"""Samples that look wrong: by their neighbours in time where those are at hand, by their length in the sums.

Every projection of a policy is at most as long as the policy itself, and an action that is recorded next to others of
the same movement is like one of its neighbours, on one side at least, even where a constraint switches.
"""

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, namespace, on_host

TIMES_AS_LARGE = 6.0
"""An action is suspect where it is so many times as far from its neighbours in time as other samples are from theirs.

Of 480 samples of wiping, one wrong by 3 standard deviations of the policy was found in 60 of 60 sets at no and 2 %
noise, and in 54 of 60 at 10 %, with 8 in 49 of 60. None is in 44 clean sets of ``regimes`` at no and 5 % noise, with
either."""

SHARE_OF_LENGTH = 0.25
"""Nor is it suspect where it is nearer than this share of the typical action: without noise, curvature is all."""

STEPS = (1, 2, 3)
"""Between the samples of a second difference. With fewer, all of a sample near the end may hold the same bad one."""

LEAST_SAMPLES = 5
"""Shorter demonstrations tell nothing."""

AROUND = 5
"""Samples before and after that say how far samples are from their neighbours."""

QUARTILE = 0.75
"""They say so by their upper quartile: two more that are wrong do not change it, constraints that switch often do."""

MOST = 0.05
"""Where more than this share of a demonstration, and more than two samples, look wrong, it is how the movement is.

Constraints that switch every third sample on average look so, and speeds of a few steps of an encoder."""

SHARE_OF_WAY = 0.7
LONGEST = 3.0
"""Actions longer than three times what is enough for 70 % of the way count less.

Of nine kinds of ``regimes`` and ten hand-drawn shapes, the longest action was 2.8 times that. With 1 % of the samples
wrong by 30 standard deviations, these make up a quarter of the way."""

DECLINE = 8
"""Power of the length by which they do: at twice the longest plausible length, a sample counts 1/256."""


def unlike_neighbours(actions: Array, groups: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which actions are like none of their neighbours in time, shape (N,).

    Of the second differences ``u(t−s) − 2 u(t) + u(t+s)``, s up to 3, in which a sample stands, the smallest counts:
    before and after a switch of the constraint, those on its own side are small. It is compared with that of the
    samples around, and of the whole demonstration. Rotations and units change nothing.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    groups : ndarray of int, shape (N,)
        Demonstrations, each in one piece and in the order of time.
    """
    edges = np.flatnonzero(np.diff(groups)) + 1
    return np.concatenate([_unlike(movement) for movement in np.split(actions, edges)])


def longest_plausible(lengths: Array) -> float:
    """Length up to which actions count in full, from some of them (N,); infinite where nothing moves."""
    ascending = np.sort(lengths)
    way = np.cumsum(ascending)
    if not len(way) or not way[-1] > 0.0:
        return np.inf
    return float(LONGEST * ascending[np.searchsorted(way, SHARE_OF_WAY * way[-1])])


def credibility(lengths: Array) -> Array:
    """Factor of the sample weights for lengths in units of the longest plausible one, shape (N,)."""
    return np.asarray(np.maximum(lengths, 1.0) ** -DECLINE)


def lengths_in(unit: float, actions: Array) -> Array:
    """Lengths (N,) of actions (N, d) of any array library in some unit, at most 1e100, so that squares are finite."""
    xp = namespace(actions)
    with np.errstate(over="ignore"):
        sizes = xp.clip(xp.abs(actions) / unit, 0.0, 1e100)
    return np.asarray(on_host(xp.sqrt(xp.sum(sizes**2, axis=1))))


def _unlike(actions: Array) -> NDArray[np.bool_]:
    apart = _least_second_difference(actions)
    if len(actions) < LEAST_SAMPLES:
        return np.zeros(len(actions), dtype=bool)
    lengths = np.linalg.norm(actions, axis=1)
    ordinary = TIMES_AS_LARGE * _around(apart, QUARTILE)
    found = apart > np.maximum(ordinary, SHARE_OF_LENGTH * _around(lengths, 0.5))
    return np.asarray(found & (found.sum() <= max(2, MOST * len(actions))))


def _least_second_difference(actions: Array) -> Array:
    """Length of the smallest second difference, at steps of one to three, in which each sample stands, (T,)."""
    least = np.full(len(actions), np.inf)
    for step in STEPS:
        count = max(len(actions) - 2 * step, 0)
        first, middle, last = (slice(start, start + count) for start in (0, step, 2 * step))
        size = np.linalg.norm(actions[first] - 2.0 * actions[middle] + actions[last], axis=1)
        for part in (first, middle, last):
            least[part] = np.minimum(least[part], size)
    return least


def _around(values: Array, quantile: float) -> Array:
    """Quantile of the values around each, at least that of all, (T,)."""
    width = min(2 * AROUND + 1, len(values))
    windows = np.lib.stride_tricks.sliding_window_view(values, width)
    local = np.quantile(windows, quantile, axis=1, method="lower")
    nearest = np.clip(np.arange(len(values)) - AROUND, 0, len(windows) - 1)
    return np.asarray(np.maximum(local[nearest], np.quantile(values, quantile, method="lower")))

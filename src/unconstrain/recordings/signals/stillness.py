"""Standing still, in the middle of a movement or all the time."""

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array

SLOW = 0.08
"""Whoever moves by less than this share of a usual movement in the same time stands still."""

SHORTEST_SHARE = 0.15
"""A stop shorter than this share of the recording is a part of the movement."""

LEFT = 0.05
"""Movement before and after a pause covers at least this share of the whole extent of a column."""

SHORTEST = 10
"""Samples that a pause has at least."""


def noise_share(values: Array) -> Array:
    """Share of each column's variance that changes from sample to sample, shape (n,): near 1 for noise (von Neumann).

    A constant column has a share of 1.
    """
    variance = values.var(axis=0)
    changes = (np.diff(values, axis=0) ** 2).mean(axis=0) / 2 if len(values) > 1 else variance
    return np.divide(changes, variance, out=np.ones_like(variance), where=variance > 0)


def is_noise(values: Array) -> bool:
    """Whether no column holds more than noise."""
    return bool((noise_share(values) > 0.5).all())


def pauses(values: Array) -> list[tuple[int, int]]:
    """Half-open stretches of rows, with movement before and after, in which nothing moves.

    Parameters
    ----------
    values : ndarray, shape (T, n)
    """
    if len(values) < 4 * SHORTEST:
        return []
    moving = values[:, noise_share(values) < 0.3]
    span = _span(moving) if moving.size else None
    if span is None:
        return []
    still = _is_still(moving, span)
    rows = _reached(still, span)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]])))
    runs = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    near = np.maximum(4.5 * _noise(moving), 0.3 * _usual(moving, span) / span)
    shortest = max(SHORTEST, SHORTEST_SHARE * len(values))
    exact = [_around(moving, start, stop, near) for start, stop in runs if stop - start >= shortest]
    return [run for run in exact if _is_left(moving, *run)]


def _reached(windows: NDArray[np.bool_], span: int) -> NDArray[np.bool_]:
    """Rows inside any of the windows that begin where a flag is, shape (T - 1,)."""
    begun = np.cumsum(np.concatenate([windows, np.zeros(span - 1, dtype=bool)]))
    ended = np.concatenate([np.zeros(span, dtype=begun.dtype), begun[:-span]])
    return np.asarray(begun > ended)


def _around(values: Array, start: int, stop: int, near: Array) -> tuple[int, int]:
    """The stretch of rows around the middle of another that are near its usual place, but for single ones."""
    place = np.median(values[start:stop], axis=0)
    off: NDArray[np.bool_] = np.asarray((np.abs(values - place) > near).any(axis=1))
    away = np.flatnonzero(off & (np.append(off[1:], True) | np.append(True, off[:-1])))
    after = int(np.searchsorted(away, (start + stop) // 2))
    first = int(away[after - 1]) + 1 if after > 0 else 0
    last = int(away[after]) if after < len(away) else len(values)
    return max(first, start - SHORTEST), min(last, stop + SHORTEST)


def _is_left(values: Array, start: int, stop: int) -> bool:
    """Whether there is movement from elsewhere before, and to elsewhere after."""
    if stop <= start or min(start, len(values) - stop) < max(3, len(values) // 15):
        return False
    place, extent = np.median(values[start:stop], axis=0), np.ptp(values, axis=0)
    before, after = (np.abs(part - place).max(axis=0) for part in (values[:start], values[stop:]))
    return bool((before > LEFT * extent).any() and (after > LEFT * extent).any())


def _span(values: Array) -> int | None:
    """Samples between which to look for movement: as few as noise allows; None where that is too many."""
    noise = _noise(values)
    span = max(3, len(values) // 60)
    while span <= len(values) // 12:
        if (3.0 * noise < SLOW * _usual(values, span)).all():
            return span
        span *= 2
    return None


def _noise(values: Array) -> Array:
    """Standard deviation of white noise on each column, from second differences."""
    return np.median(np.abs(np.diff(values, 2, axis=0)), axis=0) / (0.6745 * np.sqrt(6.0))


def _usual(values: Array, span: int) -> Array:
    return np.quantile(np.abs(values[span:] - values[:-span]), 0.9, axis=0)


def _is_still(values: Array, span: int) -> NDArray[np.bool_]:
    """Whether nothing moves from each row to the one ``span`` later, shape (T - span,)."""
    moved = np.abs(values[span:] - values[:-span])
    return np.all(moved < SLOW * _usual(values, span), axis=1)

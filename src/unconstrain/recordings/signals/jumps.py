"""Samples far off their neighbours, and jumps to somewhere else.

Smooth movement leaves small differences of high order, and a fast one is fast for several samples. A glitch has a
shape that neither has: away and back, within a few samples, by much more than anything around it.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import BLOCK_ROWS, Array, slices

FAR = 6.0
"""A jump is this many times larger than nine in ten steps, and half as many times than the steps around it."""

AROUND = 10
"""Samples on each side that a jump is compared with."""

LONGEST_GLITCH = 30
"""Samples that are off their neighbours together for longer are no glitch but a place."""

COUNTS = 3.0
"""So many counts of an encoder, or fewer, are no jump, and no way from a pause: it moves slowly."""

MOST_COLUMNS = 100
"""Of more columns, so many show whether rows are at two places."""

LIKE_AN_IMPULSE = 0.11
"""A lone bad sample leaves residuals that differ from those of an impulse by less than this share; a corner, by 1/6."""

_INTERPOLATION = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0
"""A sample minus the cubic through its four neighbours."""


class Glitch(NamedTuple):
    """Rows ``start`` to ``stop`` (half open) of a column that are off their neighbours."""

    column: int
    start: int
    stop: int


def glitches(values: Array) -> list[Glitch]:
    """Find samples far off their neighbours, by row.

    Parameters
    ----------
    values : ndarray, shape (T, n)

    Returns
    -------
    list of Glitch
    """
    some = max(BLOCK_ROWS // max(len(values), 1), 1)
    rough = [at + columns.start for columns in slices(values.T, some) for at in _rough(values[:, columns])]
    found = [
        Glitch(column, start, stop)
        for column in rough
        for start, stop in sorted({*_single(values[:, column]), *_bursts(values[:, column])})
    ]
    return sorted({*found, *_unseen(values)}, key=lambda glitch: (glitch.start, glitch.column))


def _rough(values: Array) -> list[int]:
    """Columns that may have glitches: of the others no residual and no step is far larger than most of them."""
    if len(values) < 2:
        return []
    steps, residuals = np.abs(np.diff(values, axis=0)), np.abs(_residuals(values))
    rough = steps.max(axis=0) > FAR * np.quantile(steps, 0.9, axis=0)
    rough |= residuals.max(axis=0) > FAR * np.quantile(residuals, 0.95, axis=0)
    return np.flatnonzero(rough).tolist()


def _residuals(values: Array) -> Array:
    """Samples minus the cubics through their neighbours, the same shape; beyond the ends values go on as mirrored."""
    padded = np.pad(values, ((2, 2), *[(0, 0)] * (values.ndim - 1)), mode="reflect", reflect_type="odd")
    return np.asarray(sum(share * padded[at : at + len(values)] for at, share in enumerate(_INTERPOLATION)))


def repaired(values: Array, found: list[Glitch]) -> Array:
    """Put straight lines in the place of glitches, shape (T, n); the same table where there are none."""
    if not found:
        return values
    smooth = values.copy()
    rows = np.arange(len(values))
    for column in {glitch.column for glitch in found}:
        bad: NDArray[np.bool_] = np.zeros(len(values), dtype=bool)
        for glitch in found:
            if glitch.column == column:
                bad[glitch.start : glitch.stop] = True
        smooth[bad, column] = np.interp(rows[bad], rows[~bad], values[~bad, column])
    return smooth


def seams(values: Array) -> list[int]:
    """Rows at which a table jumps to another place and stays there; the first row after each jump.

    Parameters
    ----------
    values : ndarray, shape (T, n)
        Without glitches.
    """
    far = _far(steps := _steps(values, resolution(values)), _steps(values))
    alone = [start for start, stop in stretches(far) if stop - start == 1 and _stands_out(steps, far, start, stop)]
    return [start + 1 for start in alone if AROUND / 2 <= start + 1 <= len(values) - AROUND / 2]


def resolution(values: Array) -> Array:
    """What some counts of an encoder make in each column, by its smallest steps, shape (n,); 0 where nothing moves."""
    steps = (np.abs(np.diff(column)) for column in values.T)
    return COUNTS * np.array([np.quantile(one[one > 0], 0.1) if one.any() else 0.0 for one in steps])


def _steps(values: Array, least: Array | None = None) -> Array:
    """Lengths (T − 1,) of steps, each column in its extent, without those of at most some lengths (n,)."""
    extent, least = np.ptp(values, axis=0), np.zeros(values.shape[1]) if least is None else least
    squares = np.zeros(len(values) - 1)
    for column in np.flatnonzero(extent > 0):
        steps = np.diff(values[:, column])
        squares += np.where(np.abs(steps) > least[column], steps / extent[column], 0.0) ** 2
    return np.sqrt(squares)


def _unseen(values: Array) -> Iterator[Glitch]:
    """Rows at an end that repeat one value in all columns, a jump away: a tracker did not see yet, or any more."""
    steps = _steps(values) if len(values) else np.zeros(0)
    far, moved = _far(steps, steps), np.flatnonzero(steps)
    ends = [(moved[0], 0, moved[0] + 1), (moved[-1], moved[-1] + 1, len(values))] if moved.size else []
    for jump, start, stop in ends:
        if 1 < stop - start <= len(values) / 2 and far[jump] and _stands_out(steps, far, jump, jump + 1):
            yield from (Glitch(int(column), int(start), int(stop)) for column in np.flatnonzero(np.ptp(values, axis=0)))


def _single(signal: Array) -> Iterator[tuple[int, int]]:
    """One sample off: the residuals of cubic interpolation around it are those of a lone impulse."""
    if len(signal) < 2 * AROUND:
        return
    residual = _residuals(signal)
    size, steps = np.abs(residual), np.abs(np.diff(signal))
    moving = steps[steps > 0]
    if not moving.size:
        return
    least = max(FAR * float(np.quantile(size, 0.95)), 3.0 * float(np.median(moving)), 5.0 * float(moving.min()))
    for row in np.flatnonzero(size > least):
        if _is_impulse(residual, int(row)):
            yield int(row), int(row) + 1


def _is_impulse(residual: Array, row: int) -> bool:
    """Whether the residuals around a row are the filter's answer to one bad sample, and all others are small."""
    first, last = max(row - AROUND, 0), min(row + AROUND + 1, len(residual))
    expected = np.zeros(last - first)
    for offset, share in enumerate(_INTERPOLATION, start=row - 2 - first):
        if 0 <= offset < len(expected):
            expected[offset] = share * residual[row]
    inner = slice(2 if first == 0 else 0, len(expected) - (2 if last == len(residual) else 0))
    misfit = np.abs(residual[first:last] - expected)[inner]
    return bool(misfit.max(initial=0.0) < LIKE_AN_IMPULSE * abs(residual[row]))


def _bursts(signal: Array) -> Iterator[tuple[int, int]]:
    """Several samples off together: a jump away, and the same one back."""
    steps = np.diff(signal)
    far = _far(np.abs(steps), np.abs(steps))
    runs = [(start, stop) for start, stop in stretches(far) if _stands_out(np.abs(steps), far, start, stop)]
    for start, stop in runs:
        if 2 <= stop - start <= 4 and abs(steps[start:stop].sum()) < 0.3 * np.abs(steps[start:stop]).max():
            yield start + 1, stop
    single = [start for start, stop in runs if stop - start == 1]
    for away, back in pairwise(single):
        returns = abs(steps[away] + steps[back]) < 0.3 * abs(steps[away])
        if returns and back - away <= min(LONGEST_GLITCH, len(signal) // 5):
            yield away + 1, back + 1


def _far(sizes: Array, every: Array) -> NDArray[np.bool_]:
    moving = every[every > 0]
    usual = float(np.quantile(moving, 0.9)) if moving.size >= AROUND else np.inf
    far: NDArray[np.bool_] = sizes > FAR * usual
    return far


def _stands_out(sizes: Array, far: NDArray[np.bool_], start: int, stop: int) -> bool:
    """Whether steps are much larger than all others around them that are not far themselves."""
    around = slice(max(start - AROUND, 0), stop + AROUND)
    others = sizes[around][~far[around]]
    return bool(sizes[start:stop].max() > FAR / 2 * others.max(initial=0.0))


def stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Half-open stretches in which all are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def topics(values: Array) -> int | None:
    """Find rows that alternate between two movements at different places.

    Parameters
    ----------
    values : ndarray, shape (T, n)

    Returns
    -------
    int or None
        The first row of the second movement; None where there is one movement.
    """
    values = values[:, :: -(-values.shape[1] // MOST_COLUMNS)]
    along = _along_widest(values)
    order = np.sort(along)
    between = np.diff(order)
    widest = int(np.argmax(between))
    second = along > (order[widest] + order[widest + 1]) / 2
    if np.count_nonzero(np.diff(second)) < max(6, len(values) // 20):
        return None
    extent = np.ptp(values, axis=0)
    scaled = values / np.where(extent > 0, extent, 1.0)
    within = np.concatenate([np.linalg.norm(np.diff(scaled[side], axis=0), axis=1) for side in (second, ~second)])
    if np.quantile(within, 0.95) > 0.25 * between[widest]:
        return None
    return int(np.argmax(second != second[0]))


def _along_widest(values: Array) -> Array:
    """Coordinate along the widest direction of columns that are scaled to extent one, shape (T,)."""
    extent, middle = np.ptp(values, axis=0), values.mean(axis=0)
    scale = np.where(extent > 0, extent, 1.0)
    blocks = list(slices(values, BLOCK_ROWS))
    spread = sum((part := (values[rows] - middle) / scale).T @ part for rows in blocks)
    widest = np.linalg.eigh(spread)[1][:, -1] / scale
    return np.concatenate([(values[rows] - middle) @ widest for rows in blocks])

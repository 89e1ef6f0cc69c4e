"""Standing still, in the middle of a movement or all the time."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import BLOCK_ROWS, Array, slices
from .jumps import COUNTS, resolution, stretches

SLOW = 0.08
"""Whoever moves by less than this share of a usual movement in the same time stands still."""

SHORTEST_SHARE = 0.15
"""A stop shorter than this share of the recording is a part of the movement."""

LEFT = 0.05
"""Movement before and after a pause covers at least this share of the whole extent of a column."""

NOISE = 4.5
"""What moves by less than this many standard deviations of the noise stands still."""

SHORTEST = 10
"""Samples that a pause has at least."""

SHORTEST_STOP_S, STOP_ROWS, BESIDE_S = 0.3, 6, 4.0
"""A stop takes so many seconds, and rows, at least, and what moves within so many seconds of it tells it."""

HALVES, HALF, ADDED_UP, SHARED = 2.0, 4, 3.0, 1.5
"""Means of both halves of a rest are nearer than so many standard errors of their difference, by white noise; or, where
steps between its parts, so many in a half, are the fourth number times as large as by that, than the third number times
the median step over the root of how many they are."""

SUDDEN, FAR = 0.1, 4.0
"""Who leaves a rest suddenly gets on, from one quarter of the time of the shortest stop to the next, by this share of
usual movement in that time, and by so many standard deviations of the noise."""

SHORTER = 60
"""Lengths of a rest that are tried, from the longest to the shortest."""

LOUD, RISE, FINEST = 0.25, 0.7, 0.02
"""A stop is seen where noise is below the first share of usual movement, and begins and ends at the second share, near
it. Noise counts as the third share at least. None is found in handwriting and contours; strokes to and fro on a line,
which turn in 4 s or more, seem to stop from noise of a hundredth of them on."""


def noise_share(values: Array) -> Array:
    """Share of each column's variance that changes from sample to sample, shape (n,): near 1 for noise (von Neumann).

    A constant column has a share of 1.
    """
    return _by_column(_share_of_noise, values) if len(values) else np.ones(values.shape[1])


def _share_of_noise(columns: Array) -> Array:
    extent = np.ptp(columns, axis=0)
    moving = extent > 0  # the variance of a constant may be more than nothing, by rounding
    scaled = (columns - columns.min(axis=0)) / np.where(moving, extent, 1.0)  # squares of what is tiny are nothing
    changed = 0.5 * (np.diff(scaled, axis=0) ** 2).sum(axis=0) / max(len(columns) - 1, 1)
    return np.asarray(np.where(moving, changed, 1.0) / np.where(moving, scaled.var(axis=0), 1.0))


def _by_column(measure: Callable[[Array], Array], values: Array) -> Array:
    """A number for each column, (n,), with no more than a long one or some short ones in memory beside the table."""
    some = max(BLOCK_ROWS // max(len(values), 1), 1)
    return np.concatenate([np.zeros(0), *(measure(values[:, columns]) for columns in slices(values.T, some))])


def is_noise(values: Array) -> bool:
    """Whether no column holds more than noise."""
    return bool((noise_share(values) > 0.5).all())


def stands(values: Array, interval: float = 0.0) -> list[tuple[int, int]]:
    """Half-open stretches of rows (T, n), with movement before and after, in which nothing moves.

    Each is told by what moves within :data:`BESIDE_S` of it, whatever else there is; where it takes a good share of all
    rows, or their interval is not known (0 or NaN, seconds), by the whole.
    """
    found = pauses(values)
    if not 0.0 < interval <= SHORTEST_STOP_S / STOP_ROWS:
        return found
    shortest, beside = round(SHORTEST_STOP_S / interval), round(BESIDE_S / interval)
    for first, last in _slow_runs(values, shortest, 0.9)[1]:
        start = max(first - beside, 0) // shortest * shortest  # a row or two of one run make no other window
        near = values[start : -(-(last + beside) // shortest) * shortest]
        least = SLOW * float(np.linalg.norm(_usual(near, shortest)))
        both = [*pauses(near), *_stops(near, shortest)]
        both = [one for one in both if min(_spread(near[: one[1]]), _spread(near[one[0] :])) > least]
        inner = [(start + one, start + two) for one, two in both if start + one < last and first < start + two]
        found += [run for run in inner if min(run[0], len(values) - run[1]) >= shortest]
    still = np.zeros(len(values), dtype=bool)
    for first, last in found:
        still[first:last] = True
    return stretches(still)


def pauses(values: Array) -> list[tuple[int, int]]:
    """Stretches as :func:`stands` finds, of a good share of all rows (T, n)."""
    if len(values) < 4 * SHORTEST:
        return []
    smooth = noise_share(values) < 0.3
    moving = values if smooth.all() else values[:, smooth]
    if not moving.size:
        return []
    shortest = int(max(SHORTEST, SHORTEST_SHARE * len(values)))
    return _slow(moving, shortest) or _motionless(moving, max(shortest, 2 * SHORTEST))


def _stops(values: Array, shortest: int) -> list[tuple[int, int]]:
    """Stretches of so many rows (T, n) or more in which nothing moves.

    Means of neighbouring thirds of so many rows are compared in units of their noise. At a turning point these are near
    each other, too, but not long before and after: there a stop is left at the usual pace, to go somewhere.
    """
    moved, runs, fast = _slow_runs(values, shortest, 0.5)
    last = 1 - 2 * (shortest // 3)
    found = [run for run in runs if _is_sudden(moved, run[0], run[1] + last, shortest, fast)]
    exact = [_exact(values, run, NOISE * _noise(values)) or run for run in found]
    return _left([run for run in exact if run[1] - run[0] >= shortest], values, LEFT * np.ptp(values, axis=0))


def rest_at_ends(values: Array, interval: float = 0.0) -> tuple[int, int]:
    """Rows (T, n) before the start, and after an end that is sudden, in which nothing moves; ``interval`` as above."""
    known = 0.0 < interval <= SHORTEST_STOP_S / STOP_ROWS
    shortest = round(SHORTEST_STOP_S / interval) if known else max(20, len(values) // 10)
    first, last = _standing(values, shortest), _standing(values[::-1], shortest, only_sudden=True)
    return first, last if first + last < len(values) else 0


def _standing(values: Array, shortest: int, only_sudden: bool = False) -> int:
    """Rows (T, n) at the start, so many or more, that stay at one place but for noise; 0 where noise hides movement.

    Whatever the speed after it, unless only what is sudden counts; of that half as many rows do. The longest stretch
    that goes nowhere counts, up to where rows leave the place of its first part for good.
    """
    least = max(shortest // 2, STOP_ROWS)
    if len(values) < 4 * max(shortest, STOP_ROWS):
        return 0
    white, usual = _noise(values), float(np.linalg.norm(_usual(values, shortest)))
    loud = float(np.linalg.norm(white))
    if 2.0 * HALVES * loud / np.sqrt(shortest) > LOUD * usual:
        return 0
    tried = np.geomspace(3 * len(values) // 4, least, SHORTER).astype(int).tolist()
    together = _spreads(values, tried) <= max(2.0 * loud, SLOW * usual)
    near = (rows for rows, one in zip(tried, together, strict=True) if one)
    rows = next((rows for rows in near if _goes_nowhere(values[:rows], loud, usual)), tried[0])
    if rows == tried[0]:
        return 0
    first = values[: 3 * rows // 4]
    place, noise = first.mean(axis=0), np.maximum(first.std(axis=0), white)
    longer = tried[tried.index(rows) - 1]
    edge = len(first) + _near(values[len(first) : longer], place, NOISE * noise)
    soon, later = (part.mean(axis=0) for part in np.array_split(values[edge : edge + least], 2))
    sudden = (np.abs(later - soon) > FAR * noise).any() and np.linalg.norm(later - soon) > SUDDEN * usual
    return edge if sudden or (min(rows, edge) >= shortest and not only_sudden) else 0


def _goes_nowhere(values: Array, white: float, usual: float) -> bool:
    """Whether halves of a stretch (T, n) near one place differ by no more than noise.

    Parts of it show what noise there is, white or not: by noise neighbours differ as much as halves do, but movement,
    however slow, adds up.
    """
    parts = _parts(values)
    half = len(parts) // 2
    gone = float(np.linalg.norm(parts[half:].mean(axis=0) - parts[:half].mean(axis=0)))
    steps = float(np.median(np.linalg.norm(np.diff(parts, axis=0), axis=1))) if len(values) >= 4 * HALF else 0.0
    shared = steps > SHARED * white * np.sqrt(2.0 * len(parts) / len(values))
    chance = max(2.0 * HALVES * white / np.sqrt(len(values)), shared * ADDED_UP * steps / np.sqrt(HALF))
    return gone <= max(chance, SLOW * FINEST * usual)


def _parts(values: Array) -> Array:
    """Means of so many parts, one after the other, shape (2 HALF, n) or fewer."""
    count = min(2 * HALF, len(values))
    sizes = len(values) // count + (np.arange(count) < len(values) % count)
    return np.asarray(np.add.reduceat(values, np.cumsum(sizes) - sizes, axis=0) / sizes[:, None])


def _spread(values: Array) -> float:
    return float(np.linalg.norm(values.std(axis=0)))


def _spreads(values: Array, counts: list[int]) -> Array:
    """That of the first so many rows, for each count."""
    rows, squares = np.array(counts), np.zeros(len(counts))
    for off in (column - column[0] for column in values.T):  # one at a time: a recording may be long
        first, second = (np.cumsum(one)[rows - 1] / rows for one in (off, off**2))
        squares += np.maximum(second - first**2, 0.0)
    return np.sqrt(squares)


def _near(values: Array, place: Array, far: Array) -> int:
    """Rows (T, n), from the first on, of which no two in a row are farther from a place than some lengths (n,)."""
    off = np.zeros(len(values), dtype=bool)
    for column, at, least in zip(values.T, place, far, strict=True):
        off |= np.abs(column - at) > least
    gone = np.flatnonzero(off & np.append(off[1:], True))
    return int(gone[0]) if len(gone) else len(values)


def _slow_runs(values: Array, shortest: int, share: float) -> tuple[Array, list[tuple[int, int]], float]:
    """How far means before and after each row are apart, stretches where hardly beside a quantile, and what is fast."""
    if len(values) < 4 * shortest:
        return values[:0, 0], [], np.inf
    span = shortest // 3
    moved = np.sqrt(sum(_moved(column, span) ** 2 for column in values.T))
    noise = np.sqrt(values.shape[1]) + 1.0
    usual = float(np.quantile(moved[moved > noise], share)) if (moved > noise).any() else 0.0
    runs = _stretches(moved <= max(SLOW * usual, noise), 2 * span - 1, shortest) if noise <= LOUD * usual else []
    return moved, runs, RISE * usual


def _is_sudden(moved: Array, first: int, last: int, least: int, fast: float) -> bool:
    """Whether movement just before and after a slow stretch, in their geometric mean, is fast."""
    near = max(last - first, least)
    return bool(moved[max(first - near, 0) : first + 1].max() * moved[last - 1 :][:near].max() > fast**2)


def _moved(column: Array, span: int) -> Array:
    """How far means of so many rows before and after each row are apart, in units of noise or a share of the usual."""
    sums = np.concatenate([[0.0], np.cumsum(column - column[0])])
    means = (sums[span:] - sums[:-span]) / span
    moved = np.abs(means[span:] - means[:-span])
    noise = float(np.median(np.abs(np.diff(column, 3)))) / (0.6745 * np.sqrt(20.0)) * np.sqrt(2.0 / span)
    count = float(resolution(column[:, None])[0]) / COUNTS
    return np.asarray(moved / (max(noise, count, FINEST * float(np.quantile(moved, 0.9))) or 1.0))


def _slow(values: Array, shortest: int) -> list[tuple[int, int]]:
    """Stretches that are slow beside the movement before and after, told by as few rows as noise allows."""
    noise, span = NOISE * _noise(values), _span(values)
    while span is not None and span <= len(values) // 12:
        usual = _usual(values, span)
        near = np.maximum(noise, 0.3 * usual / span)
        runs = _runs(values, span, SLOW * usual, shortest)
        exact = [_exact(values, run, near) for run in runs]
        if found := _left([run for run in exact if run is not None], values, LEFT * np.ptp(values, axis=0)):
            return found
        span *= 2
    return []


def _exact(values: Array, run: tuple[int, int], near: Array) -> tuple[int, int] | None:
    """The stretch around the middle of another that is near one place; None where it is less than half as long."""
    start, stop = _around(values, *run, np.maximum(near, _trembling(values[slice(*run)])))
    return (start, stop) if 2 * (stop - start) > run[1] - run[0] else None


def _trembling(values: Array) -> Array:
    """How far rows are from one place by their own noise, shape (n,): nothing for columns that go on meanwhile."""
    inner = values[len(values) // 4 : -(len(values) // 4)]
    half = len(parts := _parts(inner)) // 2
    gone = np.abs(parts[half:].mean(axis=0) - parts[:half].mean(axis=0))
    steps, noise = np.median(np.abs(np.diff(parts, axis=0)), axis=0), np.maximum(inner.std(axis=0), _noise(values))
    return np.asarray(np.where(gone < ADDED_UP * steps / np.sqrt(HALF), NOISE * noise, 0.0))


def _motionless(values: Array, shortest: int) -> list[tuple[int, int]]:
    """Stretches in which nothing but noise moves, however slow the movement before and after is."""
    near = NOISE * _noise(values)
    runs = _runs(values, shortest // 2, near, shortest)
    exact = [_around(values, *run, near) for run in runs]
    long = [(start, stop) for start, stop in exact if stop - start >= shortest and _stays(values[start:stop], near)]
    return _left(long, values, 2.0 * near)


def _stays(values: Array, near: Array) -> bool:
    """Whether the middles of both halves are nearer than their noise: what creeps under noise does not stand still."""
    first, second = (np.median(half, axis=0) for half in np.array_split(values, 2))
    return bool((np.abs(first - second) <= near / 3.0).all())


def _runs(values: Array, span: int, least: Array, shortest: int) -> list[tuple[int, int]]:
    """Stretches of so many rows in which no column moves by more than the least (n,) within a span of rows."""
    still = np.ones(len(values) - span, dtype=bool)
    for column, allowed in zip(values.T, least, strict=True):
        still &= np.abs(column[span:] - column[:-span]) <= allowed
    return _stretches(still, span, shortest)


def _stretches(still: NDArray[np.bool_], span: int, shortest: int) -> list[tuple[int, int]]:
    """Stretches of so many rows in windows of ``span`` and one more that begin where a flag is."""
    return [(start, stop) for start, stop in stretches(_reached(still, span)) if stop - start >= shortest]


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


def _left(runs: list[tuple[int, int]], values: Array, far: Array) -> list[tuple[int, int]]:
    """Those with movement from elsewhere before, and to elsewhere after, farther than some lengths (n,)."""
    least = np.maximum(far, resolution(values)) if runs else far
    return [run for run in runs if _is_left(values, *run, least)]


def _is_left(values: Array, start: int, stop: int, far: Array) -> bool:
    if stop <= start or min(start, len(values) - stop) < max(3, len(values) // 15):
        return False
    place = np.median(values[start:stop], axis=0)
    before, after = (np.abs(part - place).max(axis=0) for part in (values[:start], values[stop:]))
    return bool((before > far).any() and (after > far).any())


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
    bends = _by_column(lambda columns: np.median(np.abs(np.diff(columns, 2, axis=0)), axis=0), values)
    return np.asarray(bends / (0.6745 * np.sqrt(6.0)))


def _usual(values: Array, span: int) -> Array:
    return _by_column(lambda columns: np.quantile(np.abs(columns[span:] - columns[:-span]), 0.9, axis=0), values)

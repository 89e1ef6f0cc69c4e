"""Orders that depend on nothing but what the samples are: not on the order of arrival, nor on names or units."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from .batches import Batch
from .suspects import lengths_in

_STEPS_OF_MOVEMENT = 0.25
"""Half the mean square of the steps is below this share of the variance in a movement: nine samples of a circle do."""

_NEIGHBOURS = 8
"""Neighbours of a state that may follow it."""

_DIGITS = 1e-6
"""Demonstrations whose means differ by less than this share of the spread count as equal: rounding must not decide."""

UNNAMED = "No groups were given: all samples count as one demonstration."
ALONE = "One demonstration alone: nothing tells what held it, so across its motion the policy is not known."


def content(places: NDArray[np.intp], states: Array, actions: Array, counts: Array) -> Array:
    """Sums that tell demonstrations apart, ``Σ w (1, x, ‖u‖)``, shape (K, n + 2).

    They add, in any order, and a weight of two is the same as a repetition.

    Parameters
    ----------
    places : ndarray of int, shape (N,)
        Which of K demonstrations each sample is from.
    states : ndarray, shape (N, n)
    actions : ndarray, shape (N, d)
    counts : ndarray, shape (N,)
    """
    unit = float(np.abs(actions).max(initial=0.0)) or 1.0
    columns = (np.ones(len(states)), *states.T, unit * lengths_in(unit, actions))
    return np.column_stack([np.bincount(places, counts * column) for column in columns])


def by_content(sums: Array, origin: Array, scale: Array) -> NDArray[np.intp]:
    """A random order of demonstrations, drawn by their mean state, weight and mean speed, all relative, shape (K,).

    Parameters
    ----------
    sums : ndarray, shape (K, n + 2)
        Of :func:`content`. Demonstrations of no weight come last.
    origin, scale : ndarray, shape (n,)
        A state in the midst of all, and how far they spread.
    """
    counting = sums[:, 0] > 0.0
    weight, total = np.where(counting, sums[:, 0], 1.0), sums.sum(axis=0)
    means = (sums[:, 1:-1] / weight[:, None] - origin) / scale
    speeds = sums[:, -1] / weight / (total[-1] / total[0] if total[-1] > 0.0 else 1.0)
    table = np.rint(np.column_stack([means, weight / total[0], speeds]) / _DIGITS)
    cells = np.clip(table, -(2.0**52), 2.0**52).astype(np.int64).view(np.uint64)
    return np.lexsort((mixed(cells.T, 0), ~counting))


def distinct(samples: Batch) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first of each kind of copies, (K,), ascending, and which kind each sample is of, (N,).

    Copies agree in state, action, demonstration and time; a weight of two is the same as one.
    """
    columns = [*samples.states.T, *samples.actions.T, *([] if samples.times is None else [samples.times])]
    bits = [np.ascontiguousarray(column + 0.0, dtype=np.float64).view(np.uint64) for column in columns]
    return by_arrival(mixed(np.stack([*bits, _codes(samples).astype(np.uint64)]), 0))


def by_arrival(values: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where each different value (N,) is first, ascending, (K,), and which of these each one is, (N,)."""
    _, first, places = np.unique(values, return_index=True, return_inverse=True)
    arrival = np.argsort(first)
    return first[arrival], np.argsort(arrival)[places]


def arranged(samples: Batch) -> tuple[NDArray[np.intp], NDArray[np.intp], bool, tuple[str, ...]]:
    """Order samples by demonstration, and by time within each.

    Demonstrations are in the order of :func:`by_content`. Where no times are given, the order of arrival is taken for
    that of time if states move along it; otherwise one is reconstructed by :func:`path`. So shuffling samples that
    came in no order, or have times, changes nothing.

    Parameters
    ----------
    samples : Batch
        Different ones; see :func:`distinct`.

    Returns
    -------
    order : ndarray of int, shape (N,)
    demonstrations : ndarray of int, shape (N,)
        Number of each sample's demonstration, in that order.
    reconstructed : bool
        Whether the order within some of them had to be.
    notes : tuple of str
        What had to be assumed.
    """
    codes, (origin, scale) = _codes(samples), _spread(samples.states[samples.counts > 0.0])
    states = (samples.states - origin) / scale
    number = np.argsort(by_content(content(codes, samples.states, samples.actions, samples.counts), origin, scale))
    demonstrations = number[codes]
    columns = *samples.actions.T[::-1], *states.T[::-1]
    unnamed = (UNNAMED if samples.groups is None else ALONE,) if not codes.any() else ()
    if samples.times is not None:
        order = np.lexsort((*columns, samples.times, demonstrations))
        return order, demonstrations[order], False, unnamed
    arrival = np.argsort(demonstrations, kind="stable")
    pieces = np.split(arrival, np.flatnonzero(np.diff(demonstrations[arrival])) + 1)
    canonical, still = np.argsort(np.lexsort(columns)), 0
    for i, rows in enumerate(pieces):
        counting = samples.counts[rows] > 0.0  # others are put behind: a weight of zero is the same as not being there
        some = rows[counting]
        if not is_movement(states[some]):
            some, still = some[np.argsort(canonical[some])], still + 1
            some = some[path(states[some])] if len(some) else some
        pieces[i] = np.concatenate([some, rows[~counting]])
    order = np.concatenate(pieces)
    return order, demonstrations[order], still > 0, (*unnamed, _said(len(pieces), still))


def is_movement(states: Array) -> bool:
    """Whether states (N, n) move from each to the next, and do not jump among all.

    By the ratio of von Neumann (*Annals of Mathematical Statistics* 12(4), 1941): half the mean square of the steps
    over the variance is about 1 for a random order.
    """
    variance = float(states.var(axis=0).sum()) if len(states) else 0.0
    steps = float((np.diff(states, axis=0) ** 2).sum(axis=1).mean()) if len(states) > 2 else np.inf
    return 0.5 * steps < _STEPS_OF_MOVEMENT * variance


def path(states: Array) -> NDArray[np.intp]:
    """Order of states along a path of short steps through all of them, shape (N,).

    Pairs of neighbours are joined, the nearest first, unless one of them has two neighbours already or a circle would
    close (greedy edges of the travelling salesman; Bentley, *ORSA Journal on Computing* 4(4), 1992).
    """
    count = len(states)
    joined: list[list[int]] = [[] for _ in range(count)]
    ends = np.arange(count)  # other end of the piece that each end is of
    loose, left = np.arange(count), count - 1
    while left > 0:
        for i, j in _nearest_pairs(states, loose):
            if len(joined[i]) < 2 and len(joined[j]) < 2 and ends[i] != j:
                joined[i].append(j)
                joined[j].append(i)
                far, other = ends[i], ends[j]
                ends[far], ends[other] = other, far
                left -= 1
        loose = np.array([i for i in range(count) if len(joined[i]) < 2])
    return _walked(joined)


def path_beside(states: Array, more: Array) -> NDArray[np.intp]:
    """Order along a :func:`path` through states (N, n), which together spread by one, and more columns (N, k), (N,)."""
    origin, scale = _spread(states)
    return path(np.column_stack([(states - origin) / (scale * np.sqrt(states.shape[1])), more]))


def _nearest_pairs(states: Array, among: NDArray[np.intp]) -> Iterator[tuple[int, int]]:
    """Pairs of neighbouring states, the nearest first."""
    from scipy.spatial import cKDTree  # takes long to import

    reach = min(_NEIGHBOURS + 1, len(among))
    apart, near = cKDTree(states[among]).query(states[among], reach)
    first = np.repeat(np.arange(len(among)), reach)
    low, high = np.minimum(first, near.ravel()), np.maximum(first, near.ravel())
    order = np.lexsort((high, low, apart.ravel()))
    pairs = zip(among[low[order]].tolist(), among[high[order]].tolist(), strict=True)
    return (pair for pair in pairs if pair[0] != pair[1])


def _walked(joined: Sequence[Sequence[int]]) -> NDArray[np.intp]:
    """From the first end to the other."""
    here = next(i for i, near in enumerate(joined) if len(near) < 2)
    walked, before = [here], -1
    while len(walked) < len(joined):
        here, before = next(i for i in joined[here] if i != before), here
        walked.append(here)
    return np.array(walked, dtype=np.intp)


def _spread(states: Array) -> tuple[Array, Array]:
    """A state in the midst of all, and how far each coordinate spreads; 1 where that is rounding."""
    spread = states.std(axis=0)
    return states.mean(axis=0), np.where(spread > 1e-9 * np.abs(states).max(axis=0), spread, 1.0)


def _codes(samples: Batch) -> NDArray[np.intp]:
    """Number of each sample's demonstration."""
    if samples.groups is None:
        return np.zeros(len(samples.states), dtype=np.intp)
    return np.unique(np.asarray(samples.groups), return_inverse=True)[1]


def _said(demonstrations: int, still: int) -> str:
    if not still:
        return "No times were given: rows count as recorded one after the other."
    which = "The rows" if demonstrations == 1 else f"The rows of {still} of {demonstrations} demonstrations"
    return f"{which} came in no order of time: one was reconstructed from neighbouring states."


def mixed(columns: NDArray[np.uint64], seed: int) -> NDArray[np.uint64]:
    """A hash for each row of a table, given by columns (k, N): SplitMix64's finaliser, shape (N,)."""
    hashes = np.full(columns.shape[1], seed % 2**32 + 1, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for column in columns:
            hashes = (hashes ^ column) * np.uint64(0x9E3779B97F4A7C15)
            hashes = (hashes ^ (hashes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            hashes = (hashes ^ (hashes >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            hashes ^= hashes >> np.uint64(31)
    return hashes

"""Samples that are kept for learners that look at them: all, or evenly as many as there is room for."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import BLOCK_ROWS, Groups, on_host
from .batches import Batch


@dataclass(frozen=True, eq=False)
class Kept:
    """Of each demonstration every ``stride``-th sample that counts, in the order of arrival.

    Thinned by demonstration, steps in time stay equal within each, in whatever order demonstrations come. Each begins
    elsewhere, so that of many short ones some are left out.

    Parameters
    ----------
    most : int, optional
        Samples for which there is room; None keeps all.
    batches : tuple of Batch
        What is kept.
    stride : int
        A power of two: 1 while all have room.
    seen : mapping
        By name of the demonstration, where its next sample is in it: its samples are numbered from its own place among
        the demonstrations on, and those are kept whose number is a multiple of the stride.
    """

    most: int | None = None
    batches: tuple[Batch, ...] = ()
    stride: int = 1
    seen: Mapping[Hashable, int] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Number of samples that are kept."""
        return sum(batch.states.shape[0] for batch in self.batches)

    @property
    def whole(self) -> Batch:
        """All in one, in memory."""
        return reduce(Batch.followed_by, map(_on_host, self.batches))

    def with_batch(self, batch: Batch) -> Kept:
        """With what has room of a further batch, copied: the caller may use a buffer again."""
        numbers, seen = _numbered(batch, self.seen)
        came, stride = sum(seen.values()) - sum(range(len(seen))), self.stride
        while self.most is not None and came > self.most * stride:
            stride *= 2
        kept = batch if stride == 1 else batch.at(np.flatnonzero(numbers % stride == 0))
        thinned = self._thinned(stride)
        return replace(thinned, batches=(*thinned.batches, deepcopy(kept)), seen=seen)

    def __add__(self, other: Kept) -> Kept:
        """Both, this one first, as those of different demonstrations."""
        stride = max(self.stride, other.stride)
        mine, theirs = self._thinned(stride), other._thinned(stride)
        seen = {name: self.seen.get(name, 0) + other.seen.get(name, 0) for name in (*self.seen, *other.seen)}
        both = replace(mine, batches=(*mine.batches, *theirs.batches), seen=seen)
        return both if both.most is None or both.size <= both.most else both._thinned(2 * stride)

    def _thinned(self, stride: int) -> Kept:
        """With a stride that is a multiple of this one."""
        if stride == self.stride or not self.batches:
            return replace(self, stride=stride)
        whole, factor = self.whole, stride // self.stride
        starts = {name: -(-place // self.stride) for place, name in enumerate(self.seen)}
        few = whole.at(np.flatnonzero(_numbered(whole, starts)[0] % factor == 0))
        return replace(self, batches=(few,), stride=stride)


def _on_host(batch: Batch) -> Batch:
    states, actions = (np.asarray(on_host(table), dtype=np.float64) for table in batch[:2])
    return batch._replace(states=states, actions=actions)


def _numbered(batch: Batch, following: Mapping[Hashable, int]) -> tuple[NDArray[np.intp], dict[Hashable, int]]:
    """The number of each sample, −1 of no weight, and that which follows in each demonstration."""
    numbers, after = np.full(batch.states.shape[0], -1), dict(following)
    for start in range(0, len(numbers), BLOCK_ROWS):
        rows = np.arange(start, min(start + BLOCK_ROWS, len(numbers)))
        rows = rows if batch.weights is None else rows[batch.weights[rows] > 0.0]
        names, firsts, places = _names(None if batch.groups is None else batch.groups[rows], len(rows))
        sizes = np.bincount(places, minlength=len(names))
        for at in np.argsort(firsts):
            after.setdefault(names[at], len(after))
        before = np.array([after[name] for name in names], dtype=np.intp)
        order, ends = np.argsort(places, kind="stable"), np.cumsum(sizes)
        numbers[rows[order]] = np.arange(len(rows)) + np.repeat(before - ends + sizes, sizes)
        after |= dict(zip(names, (before + sizes).tolist(), strict=True))
    return numbers, after


def _names(groups: Groups | None, count: int) -> tuple[list[Hashable], NDArray[np.intp], NDArray[np.intp]]:
    """Different names, where each is first, and which one each sample has."""
    if groups is None:
        return [None], np.zeros(1, dtype=np.intp), np.zeros(count, dtype=np.intp)
    names, firsts, places = np.unique(np.asarray(groups), return_index=True, return_inverse=True)
    return names.tolist(), firsts, places

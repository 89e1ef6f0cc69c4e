"""The little that has to be known of all samples before the first is summed."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, Groups, on_host
from ..base.errors import InvalidDataError
from ..models import spaces
from .batches import Batch
from .order import by_arrival, content, mixed
from .suspects import lengths_in

PLACING_SAMPLES = 20_000
"""Features and fields are placed on at most this many different states."""

_ALL = np.uint64(2**64 - 1)

_STATES_PER_WEIGHT = 10
"""Different states for each weight of an affine model, n + 1 of them: fewer do not tell how states spread."""

_WIDENED = 1.2
"""A spread that the later half of small batches has not widened by more than this has settled."""

_STRAIGHT = spaces.Euclidean()

_MOST_WAITING = 1000
"""Samples at which nothing waits any longer."""


@dataclass(frozen=True, eq=False)
class FirstLook:
    """What features, fields and folds are chosen by. First looks add, in the order of the samples.

    Parameters
    ----------
    weight, heaviest : float
        ``Σ w``, and the largest w.
    mean, scatter : ndarray, shape (n,)
        Weighted mean of the states, as everywhere in here as coordinates, and ``Σ w (x − mean)² / Σ w``.
    size : ndarray, shape (n,)
        Largest absolute value of each state.
    actions : int
        Dimension d of the actions.
    fastest : float
        Largest absolute value in the actions.
    keys : ndarray of uint64, shape (K,)
        Hashes of different states, ascending: the smallest of all, at most :data:`PLACING_SAMPLES`.
        So the choice depends neither on the order of the samples nor on how they come in batches.
    states : ndarray, shape (K, n)
        Those states; of a placed look in a fixed order, since repetition and order of the samples must not matter.
    lengths : ndarray, shape (K,)
        Of the longest action in each of them.
    groups : dict, optional
        The :func:`content` (n + 2,) of each demonstration by name, in the order of first appearance.
    embedding : Embedding
        How states became coordinates.
    """

    weight: float
    heaviest: float
    mean: Array
    scatter: Array
    size: Array
    actions: int
    fastest: float
    keys: NDArray[np.uint64]
    states: Array
    lengths: Array
    groups: dict[Hashable, Array] | None
    embedding: spaces.Embedding

    @classmethod
    def whole(cls, batches: Iterable[Batch], space: spaces.Space) -> FirstLook | None:
        """Look at all there is, to place features and fields by; None if it is empty but for samples of no weight."""
        look = cls.total(cls.at(batch, space) for batch in batches)
        return look and look.placed

    @property
    def placed(self) -> FirstLook:
        """What to place features and fields by: coordinates do not depend on where angles begin, states on no order."""
        look = self if self.embedding.frame is None else self._turned(self.embedding.seen_from(self.mean))
        return replace(look, states=np.unique(look.states, axis=0))

    def _turned(self, embedding: spaces.Embedding) -> FirstLook:
        states, groups = embedding.turned(self.states), self.groups
        if groups is not None:
            groups = {name: np.r_[sums[0], embedding.turned(sums[1:-1]), sums[-1]] for name, sums in groups.items()}
        return replace(
            self,
            mean=embedding.turned(self.mean),
            scatter=states.var(axis=0),
            size=np.abs(states).max(axis=0),
            states=states,
            groups=groups,
            embedding=embedding,
        )

    @classmethod
    def at(cls, batch: Batch, space: spaces.Space = _STRAIGHT) -> FirstLook | None:
        """Look at a batch; None if it is empty but for samples of no weight.

        Raises
        ------
        InvalidDataError
            If the space is not one of such states.
        """
        look: FirstLook | None = None
        embedding = spaces.Embedding(space.over(batch.states.shape[1]))
        for block in batch.blocks():
            full = look is not None and len(look.keys) == PLACING_SAMPLES
            further = cls._at_block(block, look.keys[-1] if look is not None and full else _ALL, embedding)
            look = further if look is None else look + further
        return look

    @classmethod
    def _at_block(cls, block: Batch, largest_key: np.uint64, embedding: spaces.Embedding) -> FirstLook:
        states, actions, counts = on_host(embedding(block.states)), on_host(block.actions), block.counts
        weight = float(counts.sum())
        columns, shares = np.ascontiguousarray(states.T), counts / weight  # sums along memory are fast
        mean = (shares * columns).sum(axis=1)
        keys = mixed((columns + 0.0).view(np.uint64), 0)
        every, (keys, first) = keys, _smallest(keys, largest_key)
        fastest = float(np.abs(actions).max())
        return cls(
            weight,
            float(counts.max()),
            mean,
            (shares * (columns - mean[:, None]) ** 2).sum(axis=1),
            np.abs(columns).max(axis=1),
            actions.shape[1],
            fastest,
            keys,
            states[first],
            _largest_at(keys, every, fastest * lengths_in(fastest or 1.0, actions)),
            None if block.groups is None else _contents(block.groups, states, actions, counts),
            embedding,
        )

    def __add__(self, other: FirstLook) -> FirstLook:
        """Look at both, this one first.

        Raises
        ------
        InvalidDataError
            If they differ in the number of columns, or only one names its demonstrations.
        """
        for what, mine, theirs in (
            ("states", len(self.mean), len(other.mean)),
            ("actions", self.actions, other.actions),
        ):
            if mine != theirs:
                raise InvalidDataError(f"{what}: got {theirs} columns, expected {mine} as before.")
        if (self.groups is None) != (other.groups is None):
            raise InvalidDataError("groups: got them for some batches only, expected them for all or for none.")
        weight = self.weight + other.weight
        gap, share = other.mean - self.mean, other.weight / weight
        every = np.concatenate([self.keys, other.keys])
        keys, first = np.unique(every, return_index=True)
        keys, first = keys[:PLACING_SAMPLES], first[:PLACING_SAMPLES]
        return FirstLook(
            weight,
            max(self.heaviest, other.heaviest),
            self.mean + share * gap,
            self.scatter + share * (other.scatter - self.scatter) + share * (self.weight / weight) * gap**2,
            np.maximum(self.size, other.size),
            self.actions,
            max(self.fastest, other.fastest),
            keys,
            np.concatenate([self.states, other.states])[first],
            _largest_at(keys, every, np.concatenate([self.lengths, other.lengths])),
            None if self.groups is None else _added(self.groups, other.groups or {}),
            self.embedding,
        )

    @staticmethod
    def total(looks: Iterable[FirstLook | None]) -> FirstLook | None:
        """Sum of several, in their order; None if nothing was seen."""
        whole: FirstLook | None = None
        for look in looks:
            whole = look if whole is None else whole if look is None else whole + look
        return whole


def is_typical(seen: Batch, newest: int, space: spaces.Space = _STRAIGHT) -> bool:
    """Whether what was seen of a stream so far is enough to place features and fields on, and to deal folds by.

    It is if the newest samples alone have ten different states for each weight of an affine model. Where they are
    fewer, such as one at a time, so many have to have come together, and the later half must not have widened the
    spread much: a movement that has just begun says little of where it will go.
    """
    count = seen.states.shape[0]
    enough = _STATES_PER_WEIGHT * (seen.states.shape[1] + 1)
    if count >= _MOST_WAITING or _different(seen, count - newest, count) >= enough:
        return True
    whole, half = (FirstLook.at(seen.at(np.arange(part)), space) for part in (count, count // 2))
    if whole is None or half is None or len(whole.keys) < enough:
        return False
    return bool((whole.scatter <= _WIDENED**2 * half.scatter).all())


def _different(seen: Batch, start: int, stop: int) -> int:
    look = FirstLook.at(seen.at(np.arange(start, stop)))
    return 0 if look is None else len(look.keys)


@dataclass(frozen=True)
class Seen:
    """First look at a part of the data, and what was noted of its columns meanwhile. Parts add, in their order."""

    look: FirstLook | None
    noted: dict[str, Any]

    def __add__(self, other: Seen) -> Seen:
        """Both; the columns are those of the first part that holds anything."""
        return Seen(FirstLook.total([self.look, other.look]), self.noted if self.look is not None else other.noted)


def _smallest(keys: NDArray[np.uint64], largest: np.uint64) -> tuple[NDArray[np.uint64], NDArray[np.intp]]:
    """The smallest different keys, ascending, and where each is first; finding them is faster than sorting all."""
    low = np.flatnonzero(keys <= largest)
    few = low
    if len(low) > 2 * PLACING_SAMPLES:
        few = low[keys[low] <= np.partition(keys[low], PLACING_SAMPLES)[PLACING_SAMPLES]]
    for places in (few, low):
        different, first = np.unique(keys[places], return_index=True)
        if len(different) >= PLACING_SAMPLES or len(places) == len(low):
            break  # or else many of the few are equal
    return different[:PLACING_SAMPLES], places[first[:PLACING_SAMPLES]]


def _contents(groups: Groups, states: Array, actions: Array, counts: Array) -> dict[Hashable, Array]:
    """Content of each demonstration, in the order of first appearance."""
    names = np.asarray(groups)
    first, places = by_arrival(names)
    return dict(zip(names[first].tolist(), content(places, states, actions, counts), strict=True))


def _added(mine: dict[Hashable, Array], theirs: dict[Hashable, Array]) -> dict[Hashable, Array]:
    return mine | {name: mine[name] + sums if name in mine else sums for name, sums in theirs.items()}


def _largest_at(keys: NDArray[np.uint64], every: NDArray[np.uint64], values: Array) -> Array:
    """Largest of the values (N,) that have each of some keys (K,), ascending; ``every`` (N,) are the values' own."""
    low = np.flatnonzero(every <= keys[-1])
    largest = np.zeros(len(keys))
    np.maximum.at(largest, np.searchsorted(keys, every[low]), values[low])
    return largest


def in_order(names: Groups) -> list[Hashable]:
    """Different names in the order of first appearance."""
    every = np.asarray(names)
    ordered: list[Hashable] = every[by_arrival(every)[0]].tolist()
    return ordered

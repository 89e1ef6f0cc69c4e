"""The little that has to be known of all samples before the first is summed."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, Groups, on_host
from ..base.errors import InvalidDataError
from .batches import Batch

PLACING_SAMPLES = 20_000
"""Features and fields are placed on at most this many different states."""

_ALL = np.uint64(2**64 - 1)

_STATES_PER_WEIGHT = 10
"""Different states for each weight of an affine model, n + 1 of them: fewer do not tell how states spread."""

_WIDENED = 1.2
"""A spread that the later half of small batches has not widened by more than this has settled."""

_MOST_WAITING = 1000
"""Samples at which nothing waits any longer."""


@dataclass(frozen=True, eq=False)
class FirstLook:
    """What features, fields and folds are chosen by. First looks add, in the order of the samples.

    Parameters
    ----------
    weight : float
        ``Σ w``.
    mean, scatter : ndarray, shape (n,)
        Weighted mean of the states, and ``Σ w (x − mean)²``.
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
        Those states.
    groups : dict, optional
        Names of the demonstrations, in the order of first appearance.
    """

    weight: float
    mean: Array
    scatter: Array
    size: Array
    actions: int
    fastest: float
    keys: NDArray[np.uint64]
    states: Array
    groups: dict[Hashable, None] | None

    @property
    def different(self) -> Array:
        """Its states in a fixed order: repetition and order of the samples must not move the features."""
        return np.unique(self.states, axis=0)

    @classmethod
    def at(cls, batch: Batch) -> FirstLook | None:
        """Look at a batch; None if it is empty but for samples of no weight."""
        look: FirstLook | None = None
        for block in batch.blocks():
            full = look is not None and len(look.keys) == PLACING_SAMPLES
            further = cls._at_block(block, look.keys[-1] if look is not None and full else _ALL)
            look = further if look is None else look + further
        return look

    @classmethod
    def _at_block(cls, block: Batch, largest_key: np.uint64) -> FirstLook:
        states, actions, counts, groups = on_host(block.states), on_host(block.actions), block.counts, block.groups
        weight = float(counts.sum())
        columns, shares = np.ascontiguousarray(states.T), counts / weight  # sums along memory are fast
        mean = (shares * columns).sum(axis=1)
        keys = mixed((columns + 0.0).view(np.uint64), 0)
        keys, first = _smallest(keys, largest_key)
        return cls(
            weight,
            mean,
            weight * (shares * (columns - mean[:, None]) ** 2).sum(axis=1),
            np.abs(columns).max(axis=1),
            actions.shape[1],
            float(np.abs(actions).max()),
            keys,
            states[first],
            None if groups is None else dict.fromkeys(in_order(groups)),
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
        keys, first = np.unique(np.concatenate([self.keys, other.keys]), return_index=True)
        first = first[:PLACING_SAMPLES]
        return FirstLook(
            weight,
            self.mean + share * gap,
            self.scatter + other.scatter + self.weight * share * gap**2,
            np.maximum(self.size, other.size),
            self.actions,
            max(self.fastest, other.fastest),
            keys[:PLACING_SAMPLES],
            np.concatenate([self.states, other.states])[first],
            None if self.groups is None else self.groups | (other.groups or {}),
        )

    @staticmethod
    def total(looks: Iterable[FirstLook | None]) -> FirstLook | None:
        """Sum of several, in their order; None if nothing was seen."""
        whole: FirstLook | None = None
        for look in looks:
            whole = look if whole is None else whole if look is None else whole + look
        return whole


def is_typical(seen: Batch, newest: int) -> bool:
    """Whether what was seen of a stream so far is enough to place features and fields on, and to deal folds by.

    It is if the newest samples alone have ten different states for each weight of an affine model. Where they are
    fewer, such as one at a time, so many have to have come together, and the later half must not have widened the
    spread much: a movement that has just begun says little of where it will go.
    """
    count = seen.states.shape[0]
    enough = _STATES_PER_WEIGHT * (seen.states.shape[1] + 1)
    if count >= _MOST_WAITING or _different(seen, count - newest, count) >= enough:
        return True
    whole, half = FirstLook.at(seen), FirstLook.at(seen.at(np.arange(count // 2)))
    if whole is None or half is None or len(whole.keys) < enough:
        return False
    return bool((whole.scatter / whole.weight <= _WIDENED**2 * half.scatter / half.weight).all())


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


def in_order(names: Groups) -> list[Hashable]:
    """Different names in the order of first appearance."""
    different, first = np.unique(np.asarray(names), return_index=True)
    ordered: list[Hashable] = different[np.argsort(first)].tolist()
    return ordered


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

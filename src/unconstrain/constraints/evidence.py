"""What was seen of a constraint: sums for each form and fold, and some of the samples. It never changes; parts add."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, beside, on_host, power_of_two
from ..base.errors import InvalidDataError
from ..risks import Sums, unit_actions
from ..training import Batch, FirstLook, Folds, Split, mixed
from .forms import Form

FOLDS = 4

MOST_KEPT = 2000
"""Samples that are kept, those of the smallest hashes: they tell the rank, and forms are compared on them."""


@dataclass(frozen=True, eq=False)
class Pencil:
    """The two sums of one form (a matrix pencil), over its coefficients ``w = vec(a_i)``, fold by fold.

    Parameters
    ----------
    motion : ndarray, shape (K, P, P)
        ``S = Σ φφᵀ ⊗ vvᵀ``, so that ``wᵀ S w = Σ |A(x) u|²``. It is the moment ``consistent`` at weights ``|v|²``.
    size : ndarray, shape (K, P, P)
        ``G = Σ φφᵀ ⊗ ΦΦᵀ``, so that ``wᵀ G w = Σ |A(x)|²``; ``gram ⊗ I`` where Φ is the identity.
    weight : ndarray, shape (K,)
        Sum of the sample weights.
    """

    motion: Array
    size: Array
    weight: Array

    def __add__(self, other: Pencil) -> Pencil:
        """Sums of both."""
        return Pencil(self.motion + other.motion, self.size + other.size, self.weight + other.weight)

    @property
    def filled(self) -> NDArray[np.intp]:
        """Folds that hold anything."""
        return np.flatnonzero(self.weight)

    def means(self, folds: Sequence[int] | NDArray[np.intp]) -> tuple[Array, Array, float]:
        """S and G of some folds, of weight one, and that weight."""
        weight = float(self.weight[folds].sum())
        return self.motion[folds].sum(axis=0) / weight, self.size[folds].sum(axis=0) / weight, weight


def gathered(form: Form, batch: Batch, folds: NDArray[np.intp]) -> Pencil:
    """Sums over a batch, of any array library, each sample in its fold."""
    lifted = form.lift(batch.states, batch.actions)
    phi = lifted.features
    counts = batch.counts[:, None] * (folds[:, None] == np.arange(FOLDS))
    weights = beside(counts, phi)
    motion = _consistent(phi, [lifted.motions], weights)
    if lifted.matrices is None:
        grams = on_host((weights.T[:, :, None] * phi).mT @ phi)
        size = np.stack([np.kron(gram, np.eye(batch.actions.shape[1])) for gram in grams])
    else:
        size = _consistent(phi, np.moveaxis(lifted.matrices, 2, 0), weights)
    return Pencil(motion, size, counts.sum(axis=0))


def _consistent(phi: Array, vectors: Iterable[Array], weights: Array) -> Array:
    """``Σ w φφᵀ ⊗ vvᵀ`` in each fold, over samples and over one vector v or several for each, shape (K, P, P)."""
    sums: Sums | None = None
    for each in vectors:
        sums = sums or Sums(FOLDS, each.shape[1], phi.shape[1])
        counts = weights * (unit_actions(each)[1] ** 2)[:, None]
        for rows in sums.pieces(phi):
            sums.add(phi[rows, :], each[rows, :], counts[rows, :])
    assert sums is not None
    return on_host(sums.moments.consistent)


@dataclass(frozen=True, eq=False)
class Kept:
    """Some samples, each of several copies once: those of the smallest hashes, ascending, in whatever order."""

    keys: NDArray[np.uint64]
    states: Array
    actions: Array
    weights: Array
    folds: NDArray[np.intp]

    @classmethod
    def of(cls, states: Array, actions: Array, weights: Array, folds: NDArray[np.intp]) -> Kept:
        """The smallest of some samples."""
        bits = np.ascontiguousarray(np.column_stack([states, actions]).T + 0.0).view(np.uint64)
        keys = mixed(bits, 0)
        few = np.argpartition(keys, MOST_KEPT)[:MOST_KEPT] if len(keys) > MOST_KEPT else np.arange(len(keys))
        edge = keys <= keys[few].max()  # copies of the largest too
        return cls(keys[edge], states[edge], actions[edge], weights[edge], folds[edge])._sorted()

    def __add__(self, other: Kept) -> Kept:
        """The smallest of both."""
        pairs: Any = zip(vars(self).values(), vars(other).values(), strict=True)
        return Kept(*map(np.concatenate, pairs))._sorted()

    def _sorted(self) -> Kept:
        keys, first, places = np.unique(self.keys, return_index=True, return_inverse=True)
        weights = np.bincount(places, self.weights).astype(np.float64, copy=False)[:MOST_KEPT]
        first = first[:MOST_KEPT]
        return Kept(keys[:MOST_KEPT], self.states[first], self.actions[first], weights, self.folds[first])


@dataclass(frozen=True, eq=False)
class Evidence:
    """All that was seen so far.

    Parameters
    ----------
    forms : dict
        Forms to choose from, by name.
    split : Split, optional
        Which fold a demonstration is in. Without it, rows in a row are held out together.
    block : int
        So many of them.
    unit : float
        Actions are divided by it: a power of two about the largest at first look.
    pencils : dict
        By the name of the form.
    kept : Kept, optional
        Some of the samples.
    rows : int
        How many there were.
    """

    forms: Mapping[str, Form]
    split: Split | None
    block: int
    unit: float
    pencils: Mapping[str, Pencil]
    kept: Kept | None = None
    rows: int = 0

    @classmethod
    def begin(cls, look: FirstLook, forms: Mapping[str, Form], scaled: bool = True) -> Evidence:
        """Nothing seen but a first look; actions are ``scaled`` to about one unless they are none, as of a surface."""
        named = look.groups is not None and len(look.groups) > 1
        split = Split.begin(Folds(FOLDS, "demonstration"), look) if named else None
        block = max(1, round(look.weight / look.heaviest / (4 * FOLDS)))
        return cls(forms, split, block, power_of_two(look.fastest) if scaled else 1.0, {})

    def with_batches(self, batches: Iterable[Batch]) -> Evidence:
        """With further samples summed."""
        return reduce(Evidence._with_block, (block for batch in batches for block in batch.blocks()), self)

    def __add__(self, other: Evidence) -> Evidence:
        """Two parts of the same data, begun alike."""
        names = {**self.pencils, **other.pencils}
        pencils = {name: _sum_of(self.pencils.get(name), other.pencils.get(name)) for name in names}
        split = self.split if self.split is None or other.split is None else self.split.dealing(other.split.fold_of)
        kept = _sum_of(self.kept, other.kept)
        return replace(self, split=split, pencils=pencils, kept=kept, rows=self.rows + other.rows)

    def _with_block(self, batch: Batch) -> Evidence:
        sizes = batch.states.shape[1], batch.actions.shape[1]
        if self.kept is not None and sizes != (self.kept.states.shape[1], self.kept.actions.shape[1]):
            raise InvalidDataError(f"got {sizes[0]} columns of states and {sizes[1]} of actions, others than before.")
        batch = batch._replace(actions=batch.actions / self.unit)
        split = None if self.split is None else self.split.seeing(batch.groups)
        count = batch.states.shape[0]
        if split is None:
            folds = (self.rows + np.arange(count)) // self.block % FOLDS
        else:
            folds = split.assign(on_host(batch.states), batch.groups)
        pencils = {name: gathered(form, batch, folds) for name, form in self.forms.items()}
        kept = Kept.of(on_host(batch.states), on_host(batch.actions), batch.counts, folds)
        return self + replace(self, split=split, pencils=pencils, kept=kept, rows=count)


def _sum_of(first: Any, second: Any) -> Any:
    return second if first is None else first if second is None else first + second

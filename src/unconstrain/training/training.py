"""What a learner may look at: the model, moments fold by fold and, where it needs them, the samples."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, beside, is_foreign, on_host
from ..base.display import Shown, counted
from ..base.errors import SettingError
from ..base.threads import Workers, workers
from ..models import Model
from ..risks import FoldedMoments, Sums
from .batches import Batch
from .first_look import FirstLook
from .folds import Split
from .samples import Samples

AT_REST = 1e-12
"""Actions shorter than this share of the largest at first look are rounding around rest."""

_SPREAD = 200
"""Weights from which on folds are summed in threads: with fewer, steps are short and threads mostly wait."""


@dataclass(frozen=True, eq=False, repr=False)
class Training(Shown):
    """All that was seen so far. It never changes: what has seen more is another one, and parts add.

    Parameters
    ----------
    model : Model
        Features and fields, as they were placed at first look.
    actions : int
        Dimension d of the actions.
    split : Split
        Which fold each sample is in.
    at_rest : float
        Actions of at most this length have no direction.
    gathered : FoldedMoments
        Sums over the features φ(x), fold by fold.
    batches : tuple of Batch, optional
        The samples, where they are kept.
    """

    model: Model
    actions: int
    split: Split
    at_rest: float
    gathered: FoldedMoments
    batches: tuple[Batch, ...] | None = None

    @classmethod
    def begin(cls, look: FirstLook, model: Model, split: Split, *, keep: bool = False) -> Training:
        """Nothing seen but a first look; with ``keep``, samples are kept from now on."""
        nothing = FoldedMoments((), split.validation.held_out)
        return cls(model, look.actions, split, AT_REST * look.fastest, nothing, () if keep else None)

    def with_batches(self, batches: Iterable[Batch]) -> Training:
        """With further samples summed, in one pass.

        Raises
        ------
        SettingError
            If demonstrations are held out and a batch does not name them.
        """
        split, kept = self.split, []
        d, (models, p) = self.actions, self._sizes
        sums = [Sums(models, d, p, self.at_rest) for _ in range(split.validation.count)]
        for batch in batches:
            if self.batches is not None:
                batch = deepcopy(batch)  # the caller may use a buffer again
                kept.append(batch)
            with workers() as threads:  # not around the batches: what makes them is the caller's
                for block in batch.blocks():
                    split = split.seeing(block.groups)
                    _add(block, self.model, split, sums, threads)
        further = FoldedMoments(tuple(each.moments.on_host() for each in sums), self.gathered.held_out)
        return replace(
            self,
            split=split,
            gathered=self.gathered + further,
            batches=None if self.batches is None else (*self.batches, *kept),
        )

    def __add__(self, other: Training) -> Training:
        """Two parts of the same data, begun alike; this one's samples come first."""
        both = self.batches is not None and other.batches is not None
        return replace(
            self,
            split=self.split.dealing(other.split.fold_of),
            gathered=self.gathered + other.gathered,
            batches=(*self.batches, *other.batches) if both else None,  # type: ignore[misc]
        )

    def of_folds(self, indices: Sequence[int]) -> Training:
        """What is in some of the folds, each held out in turn; without the samples."""
        parts = tuple(self.gathered.parts[i] for i in indices)
        return replace(self, gathered=FoldedMoments(parts, range(len(parts))), batches=None)

    def without_samples(self) -> Training:
        """The sums alone."""
        return replace(self, batches=None)

    @property
    def folds(self) -> FoldedMoments:
        """Moments over the features ``T_m φ``, centred for each model: those to which a learner's weights belong."""
        centring = self.model.centring
        return self.gathered if centring is None else self.gathered.in_features(centring)

    @property
    def filled(self) -> FoldedMoments:
        """As ``folds``, of those that hold anything, with the weights that samples have in ``samples``."""
        folds, factor = self.folds, _proportion(self._counts())
        parts = tuple(factor * folds.parts[i] for i in folds.filled)
        return FoldedMoments(parts, range(len(parts)))

    @property
    def samples(self) -> Samples:
        """All samples that were given, those of no weight too.

        Weights such as 1/N are no weak data: where they are below one on average, they are scaled up to it. Folds are
        numbered as in ``filled``.

        Raises
        ------
        SettingError
            If they were not kept.
        """
        blocks, counts = [_on_host(batch) for batch in self._kept()], self._counts()
        states, actions = (np.concatenate([block[i] for block in blocks]) for i in (0, 1))
        named = [block.groups for block in blocks]
        groups = np.zeros(len(states)) if any(one is None for one in named) else np.concatenate(named)  # type: ignore[arg-type]
        times = None if any(block.times is None for block in blocks) else np.concatenate([b.times for b in blocks])
        order = np.argsort(groups, kind="stable")  # in the order of time, wherever demonstrations come interleaved
        models, p = self._sizes
        centring, fields = self.model.centring, self.model.fields
        every = Samples(
            states,
            self.model.design(states),
            actions,
            _proportion(counts) * counts,
            fields.weights(states),
            fields.shares(states),
            np.unique(groups, return_inverse=True)[1],
            self._folds_of(blocks, counts),
            np.tile(np.eye(p), (models, 1, 1)) if centring is None else centring,
            self.model.roughness(models, p),
            np.arange(len(states)),
            times,
        )
        return every[order]

    def _kept(self) -> tuple[Batch, ...]:
        if self.batches is None:
            raise SettingError(
                "learner: it needs the samples, and this policy has their sums alone: it was stored, or fitted by a "
                "learner that needs no samples. Fit with this learner from the start."
            )
        return self.batches

    def _counts(self) -> Array:
        """Sample weights, ones where none were given, shape (N,)."""
        return np.concatenate([batch.counts for batch in self._kept()])

    def _folds_of(self, blocks: Sequence[Batch], counts: Array) -> NDArray[np.intp]:
        """Fold of each sample, (N,), numbered among those that hold anything; others are with the first."""
        rows, found = np.flatnonzero(counts), np.zeros(len(counts), dtype=np.intp)
        dealt = [self.split.assign(part.states, part.groups) for block in blocks for part in [_of_weight(block)]]
        filled, number = self.gathered.filled, np.zeros(self.split.validation.count, dtype=np.intp)
        number[filled] = np.arange(len(filled))  # what no field sees is in none of them either
        found[rows] = number[np.concatenate(dealt)]
        return found

    @property
    def _sizes(self) -> tuple[int, int]:
        """Numbers of models M and of features p."""
        typical = self.split.origin[None]
        return self.model.fields.weights(typical).shape[1], self.model.design(typical).shape[1]

    def _summary(self) -> tuple[str, ...]:
        folds = f"{counted(len(self.gathered.parts), 'fold')} by {self.split.by}"
        kept = "sums alone" if self.batches is None else "samples kept"
        return counted(len(self.split.origin), "state"), counted(self.actions, "action"), folds, kept


def _proportion(counts: Array) -> float:
    return max(1.0, np.count_nonzero(counts) / counts.sum())


def _of_weight(batch: Batch) -> Batch:
    return batch if batch.weights is None else batch.at(np.flatnonzero(batch.weights))


def _on_host(batch: Batch) -> Batch:
    states, actions = (np.asarray(on_host(table), dtype=np.float64) for table in batch[:2])
    return batch._replace(states=states, actions=actions)


def _add(batch: Batch, model: Model, split: Split, sums: Sequence[Sums], threads: Workers) -> None:
    """Add samples to the sums of their folds."""
    folds = split.assign(on_host(batch.states), batch.groups)
    # Each fold in one piece; of small integers NumPy sorts by counting.
    order = np.argsort(folds.astype(np.min_scalar_type(len(sums))), kind="stable")
    starts = np.searchsorted(folds[order], np.arange(len(sums) + 1)).tolist()
    ordered = batch.at(order)
    states, actions, weights = ordered.states, ordered.actions, beside(ordered.counts, ordered.states)

    def add(fold: Sums, start: int, stop: int) -> None:
        for rows in fold.pieces(states, start, stop):
            part = states[rows, :]
            fold.add(model.design(part), actions[rows, :], weights[rows][:, None] * model.fields.weights(part))

    ends = zip(sums, pairwise(starts), strict=True)
    calls = [partial(add, fold, start, stop) for fold, (start, stop) in ends if start < stop]
    models, d, p = sums[0].shape
    # Of tensors, what runs where is for their library to say.
    worth = d * p >= _SPREAD and not is_foreign(states)
    threads.run(calls, 0.5 * len(order) * models * (d * p) ** 2 if worth else 0.0)

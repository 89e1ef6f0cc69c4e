"""What a learner may look at: the model, moments fold by fold and, where it needs them, the samples."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, beside, is_foreign, on_host, power_of_two
from ..base.display import Shown, counted
from ..base.errors import SettingError
from ..base.threads import Workers, workers
from ..models import Model
from ..risks import FoldedMoments, Moments, Sums
from .batches import Batch
from .first_look import FirstLook
from .folds import Split
from .order import arranged, distinct
from .samples import Samples
from .suspects import longest_plausible

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
        The samples as they were given, where they are kept.
    action_unit, weight_unit : float
        Powers of two about the largest action and sample weight at first look. Sums and samples are in these units,
        and so is ``at_rest``: squares of actions that are numbers at all are then numbers, too.
    most : int, optional
        Samples are kept up to so many, and none if there are more; None keeps all.
    longest : float
        Longest plausible action. Longer ones count less; see :mod:`.suspects`.

    Examples
    --------
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit([[0.0], [1.0]], [[0.0], [2.0]])
    >>> float(policy.training_.moments.energy[0])
    4.0
    """

    MOST_KEPT: ClassVar[int] = 200_000
    """Samples that are kept for a learner that can do without: of more, sums alone."""

    model: Model
    actions: int
    split: Split
    at_rest: float
    gathered: FoldedMoments
    batches: tuple[Batch, ...] | None = field(default=None, metadata={"stored": False})
    action_unit: float = 1.0
    weight_unit: float = 1.0
    most: int | None = 0
    longest: float = np.inf

    @classmethod
    def begin(
        cls, look: FirstLook, model: Model, split: Split, most: int | None = 0, *, more: bool = False
    ) -> Training:
        """Nothing seen but a first look; up to ``most`` samples are kept from now on, all for None.

        With ``more``, it is at the first of further batches, which may well be faster: no length is implausible.
        """
        nothing = FoldedMoments((), split.validation.held_out)
        units = power_of_two(look.fastest), power_of_two(look.heaviest)
        at_rest = AT_REST * (look.fastest / units[0])
        longest = np.inf if more else longest_plausible(look.lengths)
        return cls(model, look.actions, split, at_rest, nothing, None if most == 0 else (), *units, most, longest)

    def with_batches(self, batches: Iterable[Batch]) -> Training:
        """With further samples summed, in one pass.

        Raises
        ------
        SettingError
            If demonstrations are held out and a batch does not name them.
        """
        split, kept, room = self.split, list(self.batches or ()), self._room(self.batches)
        d, (models, p) = self.actions, self._sizes
        sums = [Sums(models, d, p, self.at_rest) for _ in range(split.validation.count)]
        for batch in batches:
            batch = batch.tempered(self.longest)
            room -= batch.states.shape[0]
            if room >= 0:
                batch = deepcopy(batch)  # the caller may use a buffer again
                kept.append(batch)
            with workers() as threads:  # not around the batches: what makes them is the caller's
                for block in batch.blocks():
                    split = split.seeing(block.groups)
                    _add(self._in_units(block), self.model, split, sums, threads)
        further = FoldedMoments(tuple(each.moments.on_host() for each in sums), self.gathered.held_out)
        return replace(
            self,
            split=split,
            gathered=self.gathered + further,
            batches=tuple(kept) if room >= 0 else None,
        )

    def __add__(self, other: Training) -> Training:
        """Two parts of the same data, begun alike; this one's samples come first."""
        return replace(
            self,
            split=self.split.dealing(other.split.fold_of),
            gathered=self.gathered + other.gathered,
            batches=(*self.batches, *other.batches) if self._room(self.batches, other.batches) >= 0 else None,  # type: ignore[misc]
        )

    def _room(self, *parts: Sequence[Batch] | None) -> float:
        """How many more samples may be kept beside these; less than none where some were not kept."""
        if any(part is None for part in parts):
            return -np.inf
        most = np.inf if self.most is None else self.most
        return most - sum(batch.states.shape[0] for part in parts for batch in part or ())

    def of_folds(self, indices: Sequence[int]) -> Training:
        """What is in some of the folds, each held out in turn; without the samples."""
        parts = tuple(self.gathered.parts[i] for i in indices)
        return replace(self, gathered=FoldedMoments(parts, range(len(parts))), batches=None)

    def without(self, rows: NDArray[np.intp]) -> Training:
        """The same without some of the samples, which were kept: rows among all that were given."""
        batches, start = [], 0
        for batch in self.batches or ():
            stop = start + batch.states.shape[0]
            batches.append(batch.without(rows[(start <= rows) & (rows < stop)] - start))
            start = stop
        nothing = FoldedMoments((), self.gathered.held_out)
        begun = replace(self, gathered=nothing, batches=(), longest=np.inf)  # they were tempered when kept
        return replace(begun.with_batches(batches), longest=self.longest)

    @property
    def moments(self) -> Moments:
        """Sums over the features φ(x) of all folds, in the units of what was given."""
        return self.gathered.whole.in_units(self.action_unit, self.weight_unit)

    @property
    def folds(self) -> FoldedMoments:
        """Moments over the features ``T_m φ``, centred for each model: those to which a learner's weights belong."""
        centring = self.model.centring
        return self.gathered if centring is None else self.gathered.in_features(centring)

    @property
    def filled(self) -> FoldedMoments:
        """As ``folds``, of those that hold anything, with the weights that samples have in ``samples``."""
        folds, (given, _, places) = self.folds, self._distinct()
        factor = _proportion(_summed(given.counts, places))
        parts = tuple(factor * folds.parts[i] for i in folds.filled)
        return FoldedMoments(parts, range(len(parts)))

    @property
    def samples(self) -> Samples:
        """All samples that were given, those of no weight too, each of several copies once; see :mod:`.order`.

        Folds are numbered as in ``filled``.

        Raises
        ------
        SettingError
            If they were not kept.
        """
        given, first, places = self._distinct()
        counts, each = _summed(given.counts, places), given.at(first)
        order, demonstrations, notes = arranged(self._in_coordinates(each)._replace(weights=counts))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        each, counts = each.at(order), counts[order]
        model, (models, p) = self.model, self._sizes
        centring = np.tile(np.eye(p), (models, 1, 1)) if model.centring is None else model.centring
        return Samples(
            each.states,
            model.design(each.states),
            each.actions,
            _proportion(counts) * counts,
            model.memberships(each.states),
            model.shares(each.states),
            demonstrations,
            self._folds_of(each, counts),
            centring,
            model.roughness(models, centring.shape[1]),
            place[places],
            each.times,
            None if each.noise is None else np.sqrt((each.noise**2).mean(axis=1)),
            notes,
        )

    def _distinct(self) -> tuple[Batch, NDArray[np.intp], NDArray[np.intp]]:
        """All samples in one, the first of each kind of copies, and which kind each is of."""
        if self.batches is None:
            raise SettingError(
                "learner: it needs the samples, and this policy has their sums alone: it was stored, or fitted by a "
                "learner that needs no samples. Fit with this learner from the start."
            )
        given = reduce(Batch.followed_by, map(_on_host, self.batches))
        return self._in_units(given), *distinct(self._in_coordinates(given))

    def _in_units(self, batch: Batch) -> Batch:
        noise = None if batch.noise is None else batch.noise / self.action_unit
        actions, weights = batch.actions / self.action_unit, batch.counts / self.weight_unit
        return batch._replace(actions=actions, weights=weights, noise=noise)

    def _in_coordinates(self, batch: Batch) -> Batch:
        return batch._replace(states=self.model.embedding(batch.states))

    def _folds_of(self, samples: Batch, counts: Array) -> NDArray[np.intp]:
        """Fold of each sample, (N,), numbered among those that hold anything; others are with the first."""
        rows, found = np.flatnonzero(counts), np.zeros(len(counts), dtype=np.intp)
        filled, number = self.gathered.filled, np.zeros(self.split.validation.count, dtype=np.intp)
        number[filled] = np.arange(len(filled))  # what no field sees is in none of them either
        found[rows] = number[self.split.assign(samples.states[rows], samples.at(rows).groups)]
        return found

    @property
    def _sizes(self) -> tuple[int, int]:
        """Numbers of models M and of features p."""
        typical = self._typical
        return self.model.memberships(typical).shape[1], self.model.design(typical).shape[1]

    @property
    def _typical(self) -> Array:
        """A state (1, n) in the midst of all."""
        return self.model.embedding.states(self.split.origin[None])

    def _summary(self) -> tuple[str, ...]:
        folds = f"{counted(len(self.gathered.parts), 'fold')} by {self.split.by}"
        kept = "sums alone" if self.batches is None else "samples kept"
        return counted(self._typical.shape[1], "state"), counted(self.actions, "action"), folds, kept


def _summed(counts: Array, places: NDArray[np.intp]) -> Array:
    return np.bincount(places, counts).astype(np.float64, copy=False)


def _proportion(counts: Array) -> float:
    """What makes the mean weight one, over the samples of any: only ratios of weights count."""
    return float(np.count_nonzero(counts) / counts.sum())


def _on_host(batch: Batch) -> Batch:
    states, actions = (np.asarray(on_host(table), dtype=np.float64) for table in batch[:2])
    return batch._replace(states=states, actions=actions)


def _add(batch: Batch, model: Model, split: Split, sums: Sequence[Sums], threads: Workers) -> None:
    """Add samples to the sums of their folds."""
    folds = split.assign(batch.states, batch.groups)
    # Each fold in one piece; of small integers NumPy sorts by counting.
    order = np.argsort(folds.astype(np.min_scalar_type(len(sums))), kind="stable")
    starts = np.searchsorted(folds[order], np.arange(len(sums) + 1)).tolist()
    ordered = batch.at(order)
    states, actions, weights = ordered.states, ordered.actions, beside(ordered.counts, ordered.states)

    def add(fold: Sums, start: int, stop: int) -> None:
        for rows in fold.pieces(states, start, stop):
            part = states[rows, :]
            fold.add(model.design(part), actions[rows, :], weights[rows][:, None] * model.memberships(part))

    ends = zip(sums, pairwise(starts), strict=True)
    calls = [partial(add, fold, start, stop) for fold, (start, stop) in ends if start < stop]
    models, d, p = sums[0].shape
    # Of tensors, what runs where is for their library to say.
    worth = d * p >= _SPREAD and not is_foreign(states)
    threads.run(calls, 0.5 * len(order) * models * (d * p) ** 2 if worth else 0.0)

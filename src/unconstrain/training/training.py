"""What a learner may look at: the model, moments fold by fold and, where it needs them, the samples."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, beside, is_foreign, namespace, power_of_two
from ..base.display import Shown, counted
from ..base.errors import InvalidDataError, SettingError
from ..base.foreign import MOST_NUMBERS
from ..base.threads import Workers, workers
from ..models import Model
from ..risks import FoldedMoments, Moments, Sums
from .batches import Batch
from .first_look import FirstLook
from .folds import Split
from .kept import Kept
from .order import arranged, distinct
from .samples import Samples
from .suspects import longest_plausible

AT_REST = 1e-12
"""Actions shorter than this share of the largest at first look are rounding around rest."""

_SPREAD = 200
"""Weights from which on folds are summed in threads: with fewer, steps are short and threads mostly wait."""

LARGEST_IN_UNITS = 1e70
"""Actions and weights of so many times those seen first are refused: fourth powers would not be finite."""


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
    kept : Kept, optional
        The samples as they were given, where they are kept: all, or some of each demonstration.
    action_unit, weight_unit : float
        Powers of two about the largest action and sample weight at first look. Sums and samples are in these units,
        and so is ``at_rest``: squares of actions that are numbers at all are then numbers, too.
    longest : float
        Longest plausible action. Longer ones count less; see :mod:`.suspects`.

    Examples
    --------
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit([[0.0], [1.0]], [[0.0], [2.0]])
    >>> float(policy.training_.moments.energy[0])
    4.0
    """

    MOST_KEPT: ClassVar[int] = 50_000
    """Samples that are kept for a learner that can do without: of more, every second, fourth, ... one.

    With a quarter of 100,000 samples of 100 demonstrations the squared error was 0.95 to 1.04 times that with all, at 5
    and 30 % noise, in a quarter of the time.
    """

    model: Model
    actions: int
    split: Split
    at_rest: float
    gathered: FoldedMoments
    kept: Kept | None = field(default=None, metadata={"stored": False})
    action_unit: float = 1.0
    weight_unit: float = 1.0
    longest: float = np.inf

    @classmethod
    def begin(
        cls, look: FirstLook, model: Model, split: Split, most: int | None = 0, *, more: bool = False
    ) -> Training:
        """Nothing seen but a first look; about ``most`` samples at most are kept from now on, all for None.

        With ``more``, it is at the first of further batches, which may well be faster: no length is implausible.
        """
        nothing = FoldedMoments((), split.validation.held_out)
        units = power_of_two(look.fastest), power_of_two(look.heaviest)
        at_rest = AT_REST * (look.fastest / units[0])
        longest = np.inf if more else longest_plausible(look.lengths)
        return cls(model, look.actions, split, at_rest, nothing, None, *units, longest).keeping(most)

    @classmethod
    def opening(cls, batches: Iterable[Batch]) -> Iterator[Batch]:
        """The first of some batches, of about as many samples as are kept."""
        room = cls.MOST_KEPT
        for batch in batches:
            yield batch
            room -= batch.states.shape[0]
            if room <= 0:
                return

    def keeping(self, most: int | None) -> Training:
        """The same with samples kept from now on, as in :meth:`begin`."""
        return replace(self, kept=None if most == 0 else Kept(most))

    def with_batches(self, batches: Iterable[Batch]) -> Training:
        """With further samples summed, in one pass.

        Raises
        ------
        InvalidDataError
            If the sums of all folds would have more numbers than go into memory, or are beyond the finite numbers.
        SettingError
            If demonstrations are held out and a batch does not name them.
        """
        begun, split, kept = self, self.split, self.kept
        d, (models, p) = self.actions, self._sizes
        _check_size(split.validation.count, models, d, p)
        sums = [Sums(models, d, p, self.at_rest) for _ in range(split.validation.count)]
        for batch in batches:
            batch = batch.tempered(self.longest)
            begun = begun._setting_out(batch)
            kept = None if kept is None else kept.with_batch(batch)
            with workers() as threads:  # not around the batches: what makes them is the caller's
                for block in batch.blocks():
                    split = split.seeing(block.groups)
                    _add(begun._in_units(block), self.model, split, sums, threads)
        further = FoldedMoments(tuple(each.moments.on_host() for each in sums), self.gathered.held_out)
        gathered = self.gathered + further
        _check_range(np.inf, *(sums for part in gathered.parts for sums in (part.energy, part.consistent)))
        return replace(begun, split=split, gathered=gathered, kept=kept)

    def _setting_out(self, batch: Batch) -> Training:
        """The same in a unit of these actions, where all before were zero: so are their sums, in any unit."""
        fastest = 0.0 if self.at_rest > 0.0 else float(namespace(batch.actions).abs(batch.actions).max())
        unit = power_of_two(fastest)
        return replace(self, action_unit=unit, at_rest=AT_REST * (fastest / unit)) if fastest else self

    def __add__(self, other: Training) -> Training:
        """Two parts of the same data, begun alike; this one's samples come first."""
        return replace(
            self,
            split=self.split.dealing(other.split.fold_of),
            gathered=self.gathered + other.gathered,
            kept=None if self.kept is None or other.kept is None else self.kept + other.kept,
        )

    def of_folds(self, indices: Sequence[int]) -> Training:
        """What is in some of the folds, each held out in turn; without the samples."""
        parts = tuple(self.gathered.parts[i] for i in indices)
        return replace(self, gathered=FoldedMoments(parts, range(len(parts))), kept=None)

    def without(self, rows: NDArray[np.intp]) -> Training:
        """What is kept, without some of it: rows among all that were given, or of those that are kept."""
        batches, start = [], 0
        for batch in self.kept.batches if self.kept else ():
            stop = start + batch.states.shape[0]
            batches.append(batch.without(rows[(start <= rows) & (rows < stop)] - start))
            start = stop
        nothing = FoldedMoments((), self.gathered.held_out)
        begun = replace(self, gathered=nothing, longest=np.inf).keeping(None)  # they were tempered when kept
        return replace(begun.with_batches(batches), longest=self.longest)

    @property
    def fastest(self) -> float:
        """A length that no plausible action at first look exceeded, by its largest coordinate."""
        return min(self.longest, float(np.sqrt(self.actions)) * self.action_unit * self.at_rest / AT_REST)

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
        """All samples that are kept, those of no weight too, each of several copies once; see :mod:`.order`.

        Folds are numbered as in ``filled``.

        Raises
        ------
        SettingError
            If they were not kept.
        """
        given, first, places = self._distinct()
        counts, each = _summed(given.counts, places), given.at(first)
        order, demonstrations, reconstructed, notes = arranged(self._in_coordinates(each)._replace(weights=counts))
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
            reconstructed,
        )

    def _distinct(self) -> tuple[Batch, NDArray[np.intp], NDArray[np.intp]]:
        """All samples in one, the first of each kind of copies, and which kind each is of."""
        if self.kept is None:
            raise SettingError(
                "learner: it needs the samples, and this policy has their sums alone: it was stored, or fitted by a "
                "learner that needs no samples. Fit with this learner from the start."
            )
        given = self.kept.whole
        return self._in_units(given), *distinct(self._in_coordinates(given))

    def _in_units(self, batch: Batch) -> Batch:
        noise = None if batch.noise is None else batch.noise / self.action_unit
        with np.errstate(over="ignore"):
            actions, weights = batch.actions / self.action_unit, batch.counts / self.weight_unit
        _check_range(LARGEST_IN_UNITS, actions, weights)
        return batch._replace(actions=actions, weights=weights, noise=noise)

    def _in_coordinates(self, batch: Batch) -> Batch:
        return batch._replace(states=self.model.embedding(batch.states))

    def _folds_of(self, samples: Batch, counts: Array) -> NDArray[np.intp]:
        """Fold of each sample, (N,), numbered among those that hold anything; others are with the first."""
        rows, found = np.flatnonzero(counts), np.zeros(len(counts), dtype=np.intp)
        filled, number = self.gathered.filled, np.zeros(self.split.validation.count, dtype=np.intp)
        number[filled] = np.arange(len(filled))  # what no field sees is in none of them either
        found[rows] = number[self.split.assign(samples.states[rows], samples.at(rows).groups)]
        return np.asarray(np.unique(found, return_inverse=True)[1], dtype=np.intp)  # one may be missing of what is kept

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
        kept = "sums alone" if self.kept is None else "samples kept"
        return counted(self._typical.shape[1], "state"), counted(self.actions, "action"), folds, kept


def _check_size(folds: int, models: int, d: int, p: int) -> None:
    """Refuse sums that would not go into memory, before there are any."""
    numbers = folds * models * (d * p) ** 2
    if numbers > MOST_NUMBERS:
        raise InvalidDataError(
            f"{counted(d, 'action')} and {counted(p, 'feature')} in {counted(models, 'model')} make sums of "
            f"{8e-9 * numbers:,.0f} GB. Take fewer columns as states and actions, fewer features, or Folds(2)."
        )


def _check_range(largest: float, *tables: Array) -> None:
    """Refuse what is not smaller, in the units of the first samples."""
    if not all(bool(namespace(table).all(namespace(table).abs(table) < largest)) for table in tables):
        raise InvalidDataError(
            "these samples are beyond all numbers beside the first, as their actions or weights are so much larger. "
            "Take one unit for all batches, in which they are nearer to 1."
        )


def _summed(counts: Array, places: NDArray[np.intp]) -> Array:
    return np.bincount(places, counts).astype(np.float64, copy=False)


def _proportion(counts: Array) -> float:
    """What makes the mean weight one, over the samples of any: only ratios of weights count."""
    return float(np.count_nonzero(counts) / counts.sum())


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

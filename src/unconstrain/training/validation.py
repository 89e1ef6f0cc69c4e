"""Which samples are held out together, decided sample by sample as they arrive."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from itertools import accumulate
from operator import add
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, check_at_least
from ..base.errors import SettingError
from ..recordings import FirstLook, Groups, in_order, mixed
from ..risks import Moments, total

__all__ = ["FoldedMoments", "Folds", "HeldOut", "Splitter", "Validation"]

Unit = Literal["auto", "demonstration", "sample"]


@dataclass(frozen=True)
class Folds:
    """K-fold validation: each fold is held out once.

    Parameters
    ----------
    count : int
        Number of folds. As many as demonstrations, or more, leaves one
        demonstration out at a time.
    by : {"auto", "demonstration", "sample"}
        What stays together. "auto" holds out demonstrations where ``groups``
        names at least two (in a stream: where it is given), and samples otherwise.
    seed : int
        Of the draw, where samples are held out.
    """

    count: int = 10
    by: Unit = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        check_at_least("count", self.count, 2, whole=True)
        _check_unit(self.by)

    @property
    def held_out(self) -> range:
        """Indices of the folds that are held out, one after the other."""
        return range(self.count)

    def deal(self, drawn: NDArray[np.float64]) -> NDArray[np.intp]:
        """Fold of each unit from a number in [0, 1)."""
        return (drawn * self.count).astype(np.intp)

    def deal_in_turn(self, index: int) -> int:
        """Fold of the index-th demonstration."""
        return index % self.count


@dataclass(frozen=True)
class HeldOut:
    """Hold one share out, once, to choose the threshold; the final policy learns from everything.

    Parameters
    ----------
    share : float
        Between 0 and 1.
    by : {"auto", "demonstration", "sample"}
        See :class:`Folds`.
    seed : int
        Of the draw, where samples are held out.
    """

    share: float = 0.2
    by: Unit = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        check_at_least("share", self.share, 0.0, strict=True)
        if self.share >= 1.0:
            raise SettingError(f"share: got {self.share!r}, expected a number between 0 and 1.")
        _check_unit(self.by)

    @property
    def count(self) -> int:
        """Parts to keep apart: held out, and the rest."""
        return 2

    @property
    def held_out(self) -> range:
        """Only the first part is ever held out."""
        return range(1)

    def deal(self, drawn: NDArray[np.float64]) -> NDArray[np.intp]:
        """Part of each unit from a number in [0, 1): 0 is held out."""
        return (drawn >= self.share).astype(np.intp)

    def deal_in_turn(self, index: int) -> int:
        """Part of the index-th demonstration: the first is held out, then evenly as many as the share says."""
        return 0 if np.ceil((index + 1) * self.share) > np.ceil(index * self.share) else 1


Validation = Folds | HeldOut


class Splitter:
    """Assigns samples to folds as they arrive, so that one pass over any stream is enough.

    A demonstration's fold depends on the order in which demonstrations are
    first seen. A sample's fold is a hash of its state, to a thousandth of the
    spread at first look: it depends neither on order nor on units, equal
    samples stay together, and so a weight of two is the same as a repetition.

    Parameters
    ----------
    validation : Folds or HeldOut
    look : FirstLook
        At everything, or at the first batch. Fixes the spread and what "auto"
        means, and deals the demonstrations in it.
    more : bool
        Whether further batches may come. Then a single demonstration is the
        first of several.
    """

    def __init__(self, validation: Validation, look: FirstLook, more: bool = False) -> None:
        self.validation = validation
        several = look.groups is not None and (more or len(look.groups) > 1)
        automatic: Unit = "demonstration" if several else "sample"
        self.by = automatic if validation.by == "auto" else validation.by
        self._origin, size = look.mean, look.size
        spread = np.sqrt(look.scatter / look.weight)
        # A coordinate that has not moved yet may do so later; its size is all that is known of it.
        self._scale = np.where(spread > 1e-9 * size, spread, np.where(size > 0, size, 1.0))
        self._fold_of: dict[Hashable, int] = {}
        if self.by == "demonstration":
            self._deal(look.groups or ())

    @property
    def typical(self) -> Array:
        """A state in the midst of those at first look, shape (n,)."""
        return self._origin

    def assign(self, states: Array, groups: Groups | None) -> NDArray[np.intp]:
        """Folds of some samples, shape (N,).

        Raises
        ------
        SettingError
            If demonstrations are to be held out and ``groups`` does not name them.
        """
        if self.by == "sample":
            return self.validation.deal(_scatter((states - self._origin) / self._scale, self.validation.seed))
        if groups is None:
            raise SettingError(
                "validation by demonstration: expected groups=, one name or number for each sample, in every batch."
            )
        self._deal(in_order(groups))
        names, places = np.unique(np.asarray(groups), return_inverse=True)
        return np.array([self._fold_of[name] for name in names.tolist()], dtype=np.intp)[places]

    def _deal(self, names: Iterable[Hashable]) -> None:
        for name in names:
            if name not in self._fold_of:
                self._fold_of[name] = self.validation.deal_in_turn(len(self._fold_of))


@dataclass(frozen=True, eq=False)
class FoldedMoments:
    """Moments of each fold, from a single pass over the data.

    Parameters
    ----------
    parts : tuple of Moments
        One for each fold, all of the same shape.
    held_out : range
        Which of them are held out, one after the other.
    """

    parts: tuple[Moments, ...]
    held_out: range

    @property
    def whole(self) -> Moments:
        """Moments of everything."""
        return total(self.parts)

    @property
    def filled(self) -> list[int]:
        """Indices of the parts that hold anything."""
        return [i for i, part in enumerate(self.parts) if part.weight.any()]

    def rounds(self) -> list[tuple[Moments, Moments]]:
        """Pairs of training and held-out moments; empty if nothing can be held out."""
        filled = self.filled
        if len(filled) < 2:
            return []
        # Everything but one from the sums before and after it: subtracting would leave rounding behind.
        before = list(accumulate(self.parts[i] for i in filled[:-1]))
        after = list(accumulate(self.parts[i] for i in reversed(filled[1:])))[::-1]
        others = [after[0], *map(add, before[:-1], after[1:]), before[-1]]
        return [(rest, self.parts[i]) for rest, i in zip(others, filled, strict=True) if i in self.held_out]

    def in_features(self, change: Array) -> FoldedMoments:
        """Change the features of every part; see :meth:`Moments.in_features`."""
        return FoldedMoments(tuple(part.in_features(change) for part in self.parts), self.held_out)

    def __add__(self, other: FoldedMoments) -> FoldedMoments:
        """Add, fold by fold."""
        return FoldedMoments(
            tuple(mine + theirs for mine, theirs in zip(self.parts, other.parts, strict=True)), self.held_out
        )


def _check_unit(by: str) -> None:
    if by not in ("auto", "demonstration", "sample"):
        raise SettingError(f"by: got {by!r}, expected 'auto', 'demonstration' or 'sample'.")


def _scatter(states: Array, seed: int) -> Array:
    """A number in [0, 1) for each state, the same for the same state to 1e-3."""
    cells = np.rint(np.clip(1e3 * states, -(2.0**52), 2.0**52)).astype(np.int64).astype(np.uint64)
    return (mixed(cells.T, seed) >> np.uint64(11)) / 2.0**53

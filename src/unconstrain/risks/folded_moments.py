"""Moments of each fold, for cross-validation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import accumulate
from operator import add

from ..base.arrays import Array
from ..base.display import Shown, counted
from .moments import Moments


@dataclass(frozen=True, eq=False, repr=False)
class FoldedMoments(Shown):
    """Moments of each fold, from a single pass over the data.

    Parameters
    ----------
    parts : tuple of Moments
        One for each fold, all of the same shape; empty before the first sample.
    held_out : range
        Indices of the folds that are held out, one after the other.

    Examples
    --------
    >>> parts = tuple(uc.gather(np.ones((count, 1)), np.ones((count, 1))) for count in (5, 2))
    >>> [(train.weight, test.weight) for train, test in uc.risks.FoldedMoments(parts, range(2)).rounds()]
    [(array([2.]), array([5.])), (array([5.]), array([2.]))]
    """

    parts: tuple[Moments, ...]
    held_out: range

    @property
    def whole(self) -> Moments:
        """Moments of all folds."""
        return Moments.total(self.parts)

    @property
    def filled(self) -> list[int]:
        """Indices of the folds that are not empty."""
        return [i for i, part in enumerate(self.parts) if part.weight.any()]

    def rounds(self) -> list[tuple[Moments, Moments]]:
        """Training and held-out moments of each round of cross-validation; empty with less than two folds."""
        filled = self.filled
        if len(filled) < 2:
            return []
        # All folds but one are the sum of those before and after it: subtracting it would leave rounding errors.
        before = list(accumulate(self.parts[i] for i in filled[:-1]))
        after = list(accumulate(self.parts[i] for i in reversed(filled[1:])))[::-1]
        others = [after[0], *map(add, before[:-1], after[1:]), before[-1]]
        return [(rest, self.parts[i]) for rest, i in zip(others, filled, strict=True) if i in self.held_out]

    def in_features(self, change: Array) -> FoldedMoments:
        """Change the features of every part; see :meth:`Moments.in_features`."""
        return replace(self, parts=tuple(part.in_features(change) for part in self.parts))

    def __add__(self, other: FoldedMoments) -> FoldedMoments:
        """Add, fold by fold."""
        if not self.parts:
            return other
        return replace(self, parts=tuple(mine + theirs for mine, theirs in zip(self.parts, other.parts, strict=True)))

    def _summary(self) -> tuple[str, ...]:
        sizes = self.parts[0]._summary()[:-1] if self.parts else ()
        return counted(len(self.parts), "fold"), f"{len(self.held_out)} held out", *sizes

"""Which samples are held out together, decided sample by sample as they arrive."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, Groups, check_at_least, on_host
from ..base.errors import SettingError
from ..base.parameters import Parameters
from ..models import spaces
from .first_look import FirstLook, in_order
from .order import by_content, mixed

Unit = Literal["auto", "demonstration", "sample"]


@dataclass(frozen=True)
class Folds(Parameters):
    """K-fold validation: each fold is held out once.

    Parameters
    ----------
    count : int
        Number of folds. As many as demonstrations, or more, leaves one demonstration out at a time.
    by : {"auto", "demonstration", "sample"}
        What stays together. "auto" holds out demonstrations where ``groups``
        names at least two (in a stream: where it is given), and samples otherwise.
    seed : int
        Of the draw, where samples are held out.

    Examples
    --------
    >>> uc.ParametricPolicy(uc.Affine(), uc.Hybrid(), validation=uc.Folds(5, by="demonstration")).validation
    Folds(count=5, by='demonstration', seed=0)
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
class HeldOut(Parameters):
    """Hold one share out, once, to choose the threshold; the final policy learns from everything.

    Parameters
    ----------
    share : float
        Between 0 and 1.
    by : {"auto", "demonstration", "sample"}
        See :class:`Folds`.
    seed : int
        Of the draw, where samples are held out.

    Examples
    --------
    >>> uc.ParametricPolicy(uc.Affine(), uc.Hybrid(), validation=uc.HeldOut(0.3)).validation
    HeldOut(share=0.3, by='auto', seed=0)
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


@dataclass(frozen=True, eq=False)
class Split:
    """Which fold each sample is in, decided as samples arrive, so that one pass over any stream is enough.

    Demonstrations seen at first look are dealt in turn, in an order drawn by hashes of their mean states: their fold
    depends neither on the order of arrival nor on their names. What comes later in a stream is dealt as it arrives. A
    sample's fold is a hash of its state, to a thousandth of the spread at first look: it depends neither on order nor
    on units, equal samples stay together, and so a weight of two is the same as a repetition.

    Parameters
    ----------
    validation : Folds or HeldOut
    by : {"demonstration", "sample"}
        What stays together.
    origin, scale : ndarray, shape (n,)
        A state in the midst of those at first look, and how far they spread.
    fold_of : mapping
        Fold of each demonstration seen so far, by name.
    embedding : Embedding
        States to the coordinates that origin and scale are in.
    """

    validation: Validation
    by: Literal["demonstration", "sample"]
    origin: Array
    scale: Array
    fold_of: Mapping[Hashable, int] = field(default_factory=dict)
    embedding: spaces.Embedding = field(default_factory=spaces.Embedding)

    @classmethod
    def begin(cls, validation: Validation, look: FirstLook, more: bool = False) -> Split:
        """Deal the demonstrations seen at first look.

        Parameters
        ----------
        validation : Folds or HeldOut
        look : FirstLook
            At everything, or at the first batch. Fixes the spread and what "auto" means.
        more : bool
            Whether further batches may come. Then a single demonstration is the first of several.
        """
        several = look.groups is not None and (more or len(look.groups) > 1)
        automatic: Literal["demonstration", "sample"] = "demonstration" if several else "sample"
        by = automatic if validation.by == "auto" else validation.by
        spread = np.sqrt(look.scatter)
        # A coordinate that has not moved yet may do so later; its size is all that is known of it.
        scale = np.where(spread > 1e-9 * look.size, spread, np.where(look.size > 0, look.size, 1.0))
        split = cls(validation, by, look.mean, scale, embedding=look.embedding)
        if by == "sample" or not look.groups:
            return split
        names = list(look.groups)
        order = by_content(np.stack(list(look.groups.values())), split.origin, split.scale)
        return split.dealing(names[place] for place in order)

    def dealing(self, names: Iterable[Hashable]) -> Split:
        """With further demonstrations dealt, in their order; those that are known keep their fold."""
        further = dict.fromkeys(name for name in names if name not in self.fold_of)
        dealt = {name: self.validation.deal_in_turn(place) for place, name in enumerate(further, len(self.fold_of))}
        return replace(self, fold_of={**self.fold_of, **dealt}) if dealt else self

    def seeing(self, groups: Groups | None) -> Split:
        """With the demonstrations of some samples dealt.

        Raises
        ------
        SettingError
            If demonstrations are to be held out and ``groups`` does not name them.
        """
        if self.by == "sample":
            return self
        if groups is None:
            raise SettingError(
                "validation by demonstration: expected groups=, one name or number for each sample, in every batch."
            )
        return self.dealing(in_order(groups))

    def assign(self, states: Array, groups: Groups | None) -> NDArray[np.intp]:
        """Folds of some samples, shape (N,), whose demonstrations have been seen."""
        if self.by == "sample":
            apart = (on_host(self.embedding(states)) - self.origin) / self.scale
            return self.validation.deal(_scatter(apart, self.validation.seed))
        names, places = np.unique(np.asarray(groups), return_inverse=True)
        return np.array([self.fold_of[name] for name in names.tolist()], dtype=np.intp)[places]


def _check_unit(by: str) -> None:
    if by not in ("auto", "demonstration", "sample"):
        raise SettingError(f"by: got {by!r}, expected 'auto', 'demonstration' or 'sample'.")


def _scatter(states: Array, seed: int) -> Array:
    """A number in [0, 1) for each state, the same for the same state to 1e-3."""
    cells = np.rint(np.clip(1e3 * states, -(2.0**52), 2.0**52)).astype(np.int64).astype(np.uint64)
    return (mixed(cells.T, seed) >> np.uint64(11)) / 2.0**53

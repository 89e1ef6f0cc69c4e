"""What checks look at: the columns that a recipe uses, without the rows that have gaps in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....base.arrays import Array
from ...demonstration import Recording
from ...signals.jumps import Glitch, glitches, repaired, seams, stretches, topics
from ...signals.orientations import Wrap, continuous_quaternions, quaternion_flips, rotation_flips, wraps
from ...signals.stillness import stands
from ..continuity import continuous, unturned
from ..recipes import Recipe, select, stamps

LEAST_ROWS = 10
"""Fewer rows show no movement."""

FEW = 3
"""Samples in a row, at most, that a straight line replaces unasked: of more, nobody knows what was between."""

GAP_INTERVALS = 5.0
"""An interval of this many median ones is a gap, where nothing else is said."""


class Flip(NamedTuple):
    """A kind of orientation whose numbers turn their sign: its code, option, columns, and rows."""

    code: str
    setting: str
    width: int
    rows: Callable[[Array], list[int]]
    repair: Callable[[Array], Array]
    found: Sequence[int] = ()


FLIPS = (
    Flip("quaternion-flip", "quaternions", 4, quaternion_flips, continuous_quaternions),
    Flip("rotation-vector-flip", "rotation_vectors", 3, rotation_flips, unturned),
)


@dataclass(frozen=True, eq=False)
class Subject:
    """One recording as its recipe means it.

    Parameters
    ----------
    recording : Recording
    recipe : Recipe
        With states, unless its columns do not tell.
    """

    recording: Recording
    recipe: Recipe

    @cached_property
    def times(self) -> Array | None:
        """Time stamps of all rows, seconds."""
        return stamps(self.recording, self.recipe)

    @cached_property
    def filled(self) -> NDArray[np.bool_]:
        """Rows of the recording whose used cells are finite, whatever their stamp, shape (T,)."""
        finite = np.ones(len(self.recording), dtype=bool)
        for used in (self.recipe.states, self.recipe.actions):
            for name in used or ():
                finite &= np.isfinite(self.recording.select((name,))[:, 0])
        return finite

    @cached_property
    def skips(self) -> bool:
        """Whether rows without numbers are left out, as the clock then shows that something is missing there."""
        return self.times is not None and not self.filled.all() and bool(self.filled.any())

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Rows of the recording whose used cells and stamps are finite, the first of each stamp, shape (R,)."""
        rows = np.flatnonzero(self.filled if self.times is None else self.filled & np.isfinite(self.times))
        return rows if self.times is None else rows[np.append(True, np.diff(self.times[rows]) != 0)[: len(rows)]]

    @cached_property
    def stamps(self) -> Array | None:
        """Times of :attr:`rows`, seconds."""
        return self.times if self.times is None or len(self.rows) == len(self.times) else self.times[self.rows]

    @cached_property
    def states(self) -> Array:
        """States, with angles and orientations as continuous as the recipe makes them, shape (R, n)."""
        return continuous(self._select(self.recipe.states or ()), self.recipe)

    @cached_property
    def actions(self) -> Array:
        """Action columns, shape (R, d); d is 0 where the velocity of the states is the action."""
        return self._select(self.recipe.actions or ())

    @cached_property
    def is_in_order(self) -> bool:
        """Whether rows follow each other in time, as far as is known."""
        return self.stamps is None or bool((np.diff(self.stamps) >= 0).all())

    @cached_property
    def moves(self) -> bool:
        """Whether there are states to look at, one after the other."""
        return self.states.shape[1] > 0 and len(self.rows) >= LEAST_ROWS and self.is_in_order

    @cached_property
    def flips(self) -> dict[int, Flip]:
        """First columns of quaternions and rotation vectors that turn their sign."""
        found = [
            (start, flip._replace(found=rows))
            for flip in (FLIPS if self.moves else ())
            for start in range(self.states.shape[1] - flip.width + 1)
            if (rows := flip.rows(self.states[:, start : start + flip.width]))
        ]
        kept: dict[int, Flip] = {}
        for start, flip in sorted(found, key=lambda one: -len(one[1].found)):
            if not any(start < other + kept[other].width and other < start + flip.width for other in kept):
                kept[start] = flip
        return kept

    @cached_property
    def unturned(self) -> Array:
        """States with orientations of continuous signs, shape (R, n)."""
        smooth = self.states.copy() if self.flips else self.states
        for start, flip in self.flips.items():
            columns = slice(start, start + flip.width)
            smooth[:, columns] = flip.repair(smooth[:, columns])
        return smooth

    @cached_property
    def wraps(self) -> dict[int, Wrap]:
        """Columns of states that jump by a whole turn."""
        found = {column: wraps(angle) for column, angle in enumerate(self.unturned.T)} if self.moves else {}
        return {column: wrap for column, wrap in found.items() if wrap is not None}

    @cached_property
    def unwrapped(self) -> Array:
        """States without jumps by whole turns and turned signs, shape (R, n)."""
        smooth = self.unturned.copy() if self.wraps else self.unturned
        for column, wrap in self.wraps.items():
            smooth[:, column] = np.unwrap(smooth[:, column], period=wrap.turn)
        return smooth

    @cached_property
    def glitches(self) -> list[Glitch]:
        """Samples of states far off their neighbours."""
        return glitches(self.unwrapped) if self.moves else []

    @cached_property
    def isolated(self) -> list[Glitch]:
        """Those of at most :data:`FEW` rows in a row, whatever the column, where a recipe lets them be repaired."""
        bad = np.isin(np.arange(len(self.rows)), [row for one in self.glitches for row in range(one.start, one.stop)])
        long = {row for start, stop in stretches(bad) if stop - start > FEW for row in range(start, stop)}
        return [one for one in self.glitches if self.recipe.glitches == "auto" and one.start not in long]

    @cached_property
    def clean(self) -> Array:
        """States without jumps by whole turns and without glitches, shape (R, n)."""
        return repaired(self.unwrapped, self.glitches)

    @cached_property
    def topic(self) -> int | None:
        """The first row of a second movement at another place, where rows alternate between two."""
        return topics(self.unwrapped) if self.moves else None

    @cached_property
    def seams(self) -> list[int]:
        """Jumps to another place where time does not jump too, rows of :attr:`states`."""
        ends = {row for one in self.glitches for row in (one.start, one.stop)}
        found = [row for row in seams(self.clean) if row not in ends] if self.moves and self.topic is None else []
        if self.stamps is None or not found:
            return found
        intervals = np.diff(self.stamps)
        return [row for row in found if intervals[row - 1] <= GAP_INTERVALS * float(np.median(intervals))]

    @cached_property
    def stands(self) -> list[tuple[int, int]]:
        """Half-open stretches of :attr:`states` that stand still in the middle, between seams."""
        bounds = [0, *self.seams, len(self.rows)] if self.moves and self.topic is None else []
        pieces = [(first, stands(self.clean[first:last], self.interval)) for first, last in pairwise(bounds)]
        return [(first + start, first + stop) for first, found in pieces for start, stop in found]

    @cached_property
    def interval(self) -> float:
        """Median seconds between :attr:`rows`; 0 where they have no stamps."""
        return 0.0 if self.stamps is None else float(np.median(np.diff(self.stamps)))

    def lasting(self, rows: int) -> str:
        """So many rows of all, in seconds, too, where these are known."""
        seconds = "" if self.stamps is None else f" ({rows * self.interval:.3g} s)"
        return f"{rows} of {len(self.rows)} rows{seconds}"

    def row(self, index: int) -> int:
        """The row of the recording behind a row of :attr:`states`."""
        return int(self.rows[index])

    def name(self, column: int) -> str:
        """The name of a column of :attr:`states`."""
        return (self.recipe.states or ())[column]

    def _select(self, names: Sequence[str]) -> Array:
        every = len(self.rows) == len(self.recording)
        if every and names == self.recording.columns and not self.recipe.degrees:
            return self.recording.values  # nobody writes to it, and a large one is not held twice
        values = select(self.recording, names, self.recipe)
        return values if every else values[self.rows]

"""From files to batches to learn from, with no more in memory than one file, or the rows of a part of a long one."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import BLOCK_ROWS, Array, check_at_least
from ..base.errors import NOTHING_LEFT, ReadError
from ..base.foreign import Stamp, unchanged
from ..models import spaces
from .demonstration import Demonstration, Recording, noise_of, times_of
from .preparation import Recipe, decide, prepare
from .preparation.decisions import unused
from .preparation.movements import prepare_one, warn
from .preparation.plausibility.outlines import Outline
from .preparation.plausibility.sets import compare, outline
from .preparation.plausibility.subject import Subject
from .preparation.surveys import pieces
from .readers import Reading, check_left_out, expand, read_blocks
from .readers.blocks import WHOLE_ROWS
from .remarks import Remark

HELD_BYTES = 2**25
"""Demonstrations that take no more than this in all are kept after the first walk, so files are walked through once."""

MOST_OUTLINES = 1000
"""So many demonstrations, of very long ones their first rows, are compared with each other."""


class Block(NamedTuple):
    """Samples to learn from: ``states`` (N, n), ``actions`` (N, d), ``weights`` (N,) if not ones, ``groups`` (N,).

    ``times`` (N,), seconds, and ``noise`` (N, d), where all demonstrations have them.
    """

    states: Array
    actions: Array
    weights: Array | None
    groups: NDArray[Any]
    times: Array | None = None
    noise: Array | None = None


class Stream:
    """Files as batches, for :meth:`~unconstrain.ParametricPolicy.fit_batches`; can be walked through many times.

    One file is in memory at a time; of text, Parquet, HDF5 and NumPy arrays at most 262,144 rows, where the recipe
    treats each by itself (actions are columns, nothing is resampled, trimmed or centred). What is small is kept.

    Parameters
    ----------
    paths : path or iterable of paths
        As :func:`~unconstrain.read` takes them.
    recipe : Recipe, optional
        What it leaves open about the columns is guessed from the first recording.
    reading : Reading, optional
        How to read them; ``group`` and ``time`` alone may be given by name instead.
    speed_power : float
        Samples count by this power of their speed; see :meth:`~unconstrain.ParametricPolicy.fit_demonstrations`.
    leave_out : iterable of str
        Names of recordings to pass over.
    progress : callable, optional
        Called with how many rows this walk has read, and of how many, which the first does not know.

    Examples
    --------
    >>> t = np.linspace(0, 1, 50)
    >>> np.savetxt("wipe.csv", np.column_stack([t, t, 1 - t]), delimiter=",", header="t,x,vx", comments="")
    >>> uc.LocallyLinearPolicy(learner="hybrid").fit_batches(uc.Stream("wipe.csv")).n_outputs_
    1
    """

    def __init__(
        self,
        paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
        recipe: Recipe | None = None,
        *,
        group: str | None = None,
        time: str | None = None,
        reading: Reading | None = None,
        speed_power: float = 0.0,
        leave_out: Iterable[str] = (),
        progress: Callable[[int, int | None], None] | None = None,
    ) -> None:
        check_at_least("speed_power", speed_power, 0.0)
        self.paths = expand(paths)
        self.reading = reading or Reading(group, time)
        self.speed_power = speed_power
        self.leave_out = frozenset(leave_out)
        self._progress = progress
        self._asked = recipe or Recipe()
        self._first_file = 0
        self._held: list[tuple[str, Demonstration]] | None = None
        self._begun: list[Demonstration] = []
        self._rows: int | None = None
        self._walked = False
        self._came: dict[str, None] = {}
        self._stamps: dict[Path, Stamp] = {}
        self._outlines: list[tuple[str, Outline | None]] = []
        self.contents: list[str] = []  # of the recordings of a whole walk, Recording.content

    @cached_property
    def first(self) -> Recording:
        """The first recording, or the first rows of a very long one; a ReadError where none is left."""
        blocks = (block for path in self.paths for block in self._blocks(path))
        try:
            return next(blocks)
        except StopIteration:
            raise ReadError(NOTHING_LEFT) from None

    @cached_property
    def recipe(self) -> Recipe:
        """The recipe, completed by a look at the first recording."""
        recipe, remarks = decide(self._asked, self.first)
        warn(self.first.title, remarks)
        return recipe

    @property
    def space(self) -> spaces.Space:
        """State space, as the recipe says it."""
        return self.recipe.space

    @cached_property
    def unit(self) -> float:
        """Speeds are taken relative to the largest of the first recording."""
        actions = prepare(self.first, self.recipe)[0].actions if self.speed_power else np.zeros((1, 1))
        return float(np.linalg.norm(actions, axis=1).max()) or 1.0

    def __iter__(self) -> Iterator[Block]:
        """Batches of at least :data:`~unconstrain.base.arrays.BLOCK_ROWS` samples, but for the last."""
        waiting: list[tuple[str, Demonstration]] = []
        samples = 0
        for named in self.named_demonstrations():
            waiting.append(named)
            samples += len(named[1])
            if samples >= BLOCK_ROWS:
                yield self._batch(waiting)
                waiting, samples = [], 0
        if waiting:
            yield self._batch(waiting)

    def named_demonstrations(self) -> Iterator[tuple[str, Demonstration]]:
        """Demonstrations, very long ones in parts, each with a name that no other demonstration has."""
        if self._held is not None:
            yield from self._held
            return
        held: list[tuple[str, Demonstration]] = []
        size = 0
        for named in self._read():
            size += sum(table.nbytes for table in (named[1].states, named[1].actions))
            if size <= HELD_BYTES:
                held.append(named)
            yield named
        if not self._walked:
            self._say_what_differs()
            check_left_out(sorted(self.leave_out), self._came)
        self._walked = True
        self._begun = _begins(held)
        if size <= HELD_BYTES:
            self._held = held

    def beginning(self) -> list[Demonstration]:
        """Demonstrations, of long ones the first part, as many as :data:`HELD_BYTES` hold: what a page can show."""
        if self._begun:
            return list(self._begun)
        shown: list[tuple[str, Demonstration]] = []
        size = 0
        for named in self.named_demonstrations():
            size += named[1].states.nbytes + named[1].actions.nbytes
            if shown and size > HELD_BYTES:
                break
            shown.append(named)
        return _begins(shown)

    def parts(self) -> list[Stream]:
        """One stream for each file, which together say the same; they can be sent to other processes."""
        streams = []
        for number, path in enumerate(self.paths):
            part = Stream(
                path, self.recipe, reading=self.reading, speed_power=self.speed_power, leave_out=self.leave_out
            )
            part.__dict__ |= {"recipe": self.recipe, "unit": self.unit}
            part._first_file = self._first_file + number
            part._came |= dict.fromkeys(self.leave_out)  # another file may have it
            streams.append(part)
        return streams

    def _read(self) -> Iterator[tuple[str, Demonstration]]:
        by_rows = self.recipe.is_row_by_row
        read, contents = 0, dict[str, Any]()
        self._outlines.clear()  # of a walk that was left
        for number, path in enumerate(self.paths, start=self._first_file):
            before = Counter[str]()
            for recording in self._blocks(path, not by_rows, self.recipe):
                with warnings.catch_warnings():
                    if self._walked:  # it was said on the first walk
                        warnings.simplefilter("ignore", UserWarning)
                    elif before[recording.name]:  # that it stands still in a part says nothing of the whole
                        warnings.filterwarnings("ignore", "(rest|pause): ", UserWarning)
                    demonstration = self._prepared(recording, before[recording.name])
                name = f"{number}/{recording.name}"
                contents[name] = recording.content(self.recipe, contents.get(name))
                before[recording.name] += len(recording)
                read += len(recording)
                if self._progress is not None:
                    self._progress(read, self._rows)
                yield name, demonstration
        self._rows, self.contents = read, [one.hexdigest() for one in contents.values()]

    def _blocks(self, path: Path, whole: bool = False, cut: Recipe | None = None) -> Iterator[Recording]:
        with unchanged(path, self._stamps.setdefault(path, Stamp.of(path))):
            every = read_blocks(path, self.reading, whole=whole)
            for recording in (piece for one in every for piece in pieces(one, cut or Recipe())):
                self._came[recording.name] = None
                if recording.name not in self.leave_out:
                    yield recording

    def _prepared(self, recording: Recording, before: int) -> Demonstration:
        """A recording, or a part of it after so many rows, whose start is in the middle, as a demonstration."""
        subject = Subject(recording, replace(self.recipe, pauses="keep") if before else self.recipe)
        if not self._walked and not before and len(self._outlines) < MOST_OUTLINES:
            self._outlines.append((recording.title, outline(subject)))
        if before:
            said = f"has more than {WHOLE_ROWS:,} rows, so it is prepared in parts; rest after the first is kept."
            warn(recording.title, [Remark("in-parts", said)])
        elif recording.title != self.first.title:  # what stands still in the first may move in another
            warn(recording.title, unused(self.recipe, self.recipe, recording))
        prepared = prepare_one(subject)
        source = prepared.source
        return replace(prepared, source=None if source is None else source._replace(rows=source.rows + before))

    def _say_what_differs(self) -> None:
        said = compare([one for _, one in self._outlines])
        for (title, _), remarks in zip(self._outlines, said, strict=True):
            warn(title, remarks)

    def _batch(self, named: list[tuple[str, Demonstration]]) -> Block:
        actions = np.concatenate([demo.actions for _, demo in named])
        return Block(
            np.concatenate([demo.states for _, demo in named]),
            actions,
            self._counts(actions),
            np.repeat([name for name, _ in named], [len(demo) for _, demo in named]),
            times_of([demo for _, demo in named]),
            noise_of([demo for _, demo in named]),
        )

    def _counts(self, actions: Array) -> Array | None:
        if self.speed_power == 0.0:
            return None
        counts: Array = (np.linalg.norm(actions, axis=1) / self.unit) ** self.speed_power
        return counts

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_held": None, "_begun": [], "_progress": None}


def _begins(named: Iterable[tuple[str, Demonstration]]) -> list[Demonstration]:
    """Demonstrations, of very long ones the first part."""
    return [next(parts)[1] for _, parts in groupby(named, itemgetter(0))]

"""What every file format ends as: named columns, split into recordings."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.display import legible, listed, meant
from ...base.errors import ReadError
from ..demonstration import Recording
from ..remarks import Remark
from .clocks import Clock, ClockColumns, find_clock, find_clock_of, find_pair, read_words, unit_of_word, usual
from .reading import Reading

GROUP_NAMES = (
    *("demo", "demonstration", "trial", "bout", "group", "episode", "episode_index", "run"),
    *("demo_id", "demonstration_id", "trial_id", "episode_id", "run_id", "traj", "trajectory", "traj_id"),
)
"""A column of one of these names, in any case, tells the demonstrations apart."""

NO_GROUP = "none"
"""Told as the group, no column tells demonstrations apart."""

EXPONENTIAL = re.compile(r"[+-]?\d\.\d+[eE][+-]?\d{1,3}")
"""A number as ``numpy.savetxt`` writes it; demonstrations are called by it in short."""

INDEX_NAME = re.compile(
    r"frame([_ ]?(index|number|id|#))?|frame#|index|idx|step|seq|sample|packetcounter", re.IGNORECASE
)
"""A column of such a name counts rows; where it begins anew, so does a demonstration."""

FEWEST_ROWS = 5
"""What is shorter is no demonstration of its own: its bounds are not taken for such."""

JUMP = 5.0
"""A change from a row to the next of so many times the mean one is a jump."""

NEAR_START = 5.0
"""A clock that goes back begins anew where it is within so many intervals of where it began."""


class ReadFile(Protocol):
    """What a format must be able to do."""

    def __call__(self, path: Path, reading: Reading, /) -> Iterable[Table]:
        """Read one file as tables; of blocks, those that are called the same are one table.

        Raises
        ------
        MissingExtraError
            If the library that reads this format is not installed.
        ReadError
            If it holds no numbers; the message names the file.
        Exception
            Any, if it is no such file, or a damaged one.
        """


class Format(NamedTuple):
    """A file format: how to know it, and how to read it.

    ``suffixes`` in small letters with the dot; ``recognises`` looks at the first bytes of a file; ``read`` reads it,
    ``in_blocks`` by some rows at a time. A format ``by_content`` is known by its first bytes whatever
    the suffix says; one that ``has_names`` says itself what its columns are called, one that ``has_topics`` holds
    several recordings of which one is chosen. ``expected`` is what errors say that such a file is.
    """

    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    read: ReadFile
    in_blocks: bool = False
    by_content: bool = True
    has_names: bool = False
    has_topics: bool = False
    expected: str = "a file of that format"


@dataclass(frozen=True)
class Table:
    """Columns as a file holds them, before anyone says which one is the clock.

    Parameters
    ----------
    name : str
        What its recording is called where nothing splits it.
    columns : tuple of str
    values : ndarray, shape (T, c)
        Numbers, NaN where there is none.
    words : mapping of str to sequence
        Columns that are no numbers, as far as anyone may want them: names of demonstrations, times in words.
    breaks : tuple of int
        Rows before which the file itself makes a break, such as a blank line.
    rate : float, optional
        Rows a second, where the file says so; used where it has no clock.
    labels : tuple of str
        Lists that the file keeps of demonstrations, such as ``train``, in which this one is.
    units, attributes, remarks, lines
        As in :class:`~unconstrain.recordings.demonstration.Recording`.
    """

    name: str
    columns: tuple[str, ...]
    values: Array
    words: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    breaks: tuple[int, ...] = ()
    rate: float | None = None
    labels: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    attributes: Mapping[str, Any] = field(default_factory=dict)
    remarks: tuple[Remark, ...] = ()
    lines: NDArray[np.integer] | None = None


def numbers_of(table: Any) -> Array:
    """A table of pyarrow whose columns are float64, shape (T, c), NaN where there is no number.

    What pyarrow itself converts to NumPy makes it import pandas, where that is installed.
    """
    parts = [batch.to_tensor(null_to_nan=True).to_numpy() for batch in table.to_batches()]
    return np.concatenate([np.empty((0, table.num_columns)), *parts])


class Roles(NamedTuple):
    """Names of the columns that tell demonstrations apart, hold the time, and count the rows; None if there is none."""

    group: str | None
    clock: ClockColumns | None
    counter: str | None

    @property
    def taken(self) -> set[str]:
        """Columns that are no values."""
        clock = (self.clock.whole, self.clock.nanoseconds) if self.clock else ()
        return {name for name in (self.group, *clock) if name is not None}


def find_roles(names: Sequence[str], reading: Reading, path: Path) -> Roles:
    """What the columns are for: as told, else by their names; a ReadError where one that was told does not exist."""
    for name, role in ((reading.group, "group"), (reading.time, "time")):
        if name is not None and name not in names and (role, name) != ("group", NO_GROUP):
            none = f" Give another, or group={NO_GROUP!r} where each file is one." if role == "group" else ""
            cure = meant([name], names) or none
            raise ReadError(f"{path}: no column {name!r} for {role}; it has {listed(names)}.{cure}")
    group = reading.group or next(
        (name for name in names if name.lower() in GROUP_NAMES and name != reading.time), None
    )
    group = group if group in names else None
    others = [name for name in names if name != group]
    clock = find_clock(others)
    if reading.time is not None:
        pair = find_pair([reading.time, *others])
        clock = pair if pair is not None and pair.whole == reading.time else ClockColumns(reading.time)
    index = next((name for name in others if INDEX_NAME.fullmatch(name)), None)
    return Roles(group, clock, index)


class Assembly:
    """Turns the tables of one file into recordings; remembers its clocks from block to block.

    Parameters
    ----------
    path : Path
    reading : Reading
    """

    def __init__(self, path: Path, reading: Reading) -> None:
        self.path = path
        self.reading = reading
        self._clocks: dict[str, Clock] = {}
        self._parts: dict[str, int] = {}
        self._starts: dict[str, Start] = {}
        self._latest: dict[str, float | None] = {}
        self._rows = Counter[str]()

    def recordings(self, table: Table) -> list[Recording]:
        """The recordings in a table, or in a block of it, as far as they are asked for."""
        roles = find_roles([*table.columns, *table.words], self.reading, self.path)
        times, remarks = self._times(table, roles)
        taken = roles.taken
        places = [at for at, name in enumerate(table.columns) if name not in taken]
        if not places:
            raise ReadError(f"{self.path}: no column of numbers; it has {listed([*table.columns, *table.words])}.")
        names = tuple(table.columns[at] for at in places)
        whole = Recording(
            names,
            table.values[:, _as_slice(np.array(places))],
            times,
            name=legible(table.name),
            remarks=(*table.remarks, *remarks),
            units={name: unit for name, unit in table.units.items() if name in names},
            attributes=table.attributes,
            file=legible(str(self.path)),
            words=tuple(name for name in table.words if name not in taken),
            lines=table.lines,
        )
        groups = _groups(table, roles.group)
        tasks = table.words.get("task")
        split = self._at_breaks(whole, table, roles) if groups is None else split_by_group(whole, groups, tasks)
        if groups is None or sum(one != other for one, other in pairwise(groups)) >= len({*groups}):  # mixed up
            split = self._hinted(split, table, roles)
        return [each for each in split if self.reading.takes(each.name, table.labels, each.attributes.get("task"))]

    def _times(self, table: Table, roles: Roles) -> tuple[Array | None, tuple[Remark, ...]]:
        if roles.clock is None:
            return self._times_of_rate(table), ()
        name = roles.clock.whole
        if name in table.words:
            times = read_words([str(word) for word in table.words[name]])
            return (times, ()) if times is not None else (None, (self._no_times(name, table.words[name]),))
        stamps = _column(table, name)
        if roles.clock.nanoseconds is not None:
            parts = _column(table, roles.clock.nanoseconds) * 1e-9
            clock = self._clocks.setdefault(table.name, find_clock_of(stamps, "stamp_s", "s"))
            return clock.seconds(stamps) + parts, ()
        unit = self.reading.time_unit or unit_of_word(table.units.get(name, ""))
        label = name if unit is None else f"stamp_{unit}"
        clock = self._clocks.setdefault(table.name, find_clock_of(stamps, label, self.reading.time_unit))
        return clock.seconds(stamps), ()

    def _no_times(self, name: str, words: Sequence[Any]) -> Remark:
        """Words that are no times: an error if they were to be, else worth a word."""
        first = next((str(word) for word in words if str(word).strip()), "")
        said = f"got {first[:40]!r}, expected a number or a time as ISO 8601 writes it, such as 2024-05-01T10:00:00.02"
        if self.reading.time is not None:
            raise ReadError(f"{self.path}, column {name!r}: {said}.")
        return Remark("dropped-column", f"is called as a clock, but was left out: {said}.", name, 0)

    def _times_of_rate(self, table: Table) -> Array | None:
        if not table.rate or not np.isfinite(table.rate) or table.rate <= 0:
            return None
        self._rows[table.name] += len(table.values)
        return np.arange(self._rows[table.name] - len(table.values), self._rows[table.name]) / table.rate

    def _hinted(self, found: list[Recording], table: Table, roles: Roles) -> list[Recording]:
        """Recordings, the first with a remark where another column takes apart more."""
        first, *others = found
        name, count = _labels(table, roles)
        said = f"has {count} values, a stroke each by its jumps: give group={name!r}."
        hint = (Remark("several-in-one", said, name),) if count > 1 + len(others) else ()
        return [replace(first, remarks=(*first.remarks, *hint)), *others]

    def _at_breaks(self, whole: Recording, table: Table, roles: Roles) -> list[Recording]:
        """Recordings between breaks: blank lines, and where the clock or the count of rows begins anew."""
        counter = roles.counter if roles.counter in table.columns else None
        counts = whole.times if counter is None or whole.times is not None else _column(table, counter)
        bounds = _continued(_long_enough(table.breaks, len(whole)), whole.times)
        where = "blank lines"
        start = self._starts.setdefault(whole.name, Start.of(counts))
        part = self._parts.get(whole.name, 0) + start.is_again(self._latest.get(whole.name), counts)
        if not bounds:
            bounds, where = _restarts(counts, start), "where the clock or the count of rows begins anew"
        self._parts[whole.name] = part + len(bounds)
        self._latest[whole.name] = None if counts is None or not len(counts) else float(counts[-1])
        said = f"{len(bounds) + 1} demonstrations in one table, taken apart at {where}, the first time at {{}}."
        notes = tuple(Remark("split", said.format(whole.place(row)), row=row) for row in bounds[:1])
        return [
            replace(
                rows_of(whole, slice(begin, end)),
                name=f"{whole.name}.{number}" if number else whole.name,
                remarks=(*whole.remarks, *notes) if number == part else (),
            )
            for number, (begin, end) in enumerate(pairwise([0, *bounds, len(whole)]), start=part)
        ]


class Start(NamedTuple):
    """Where a clock began, and its usual interval."""

    first: float
    interval: float

    @classmethod
    def of(cls, counts: Array | None) -> Start:
        """The start of some rows; none where they have no clock."""
        if counts is None or not len(counts):
            return cls(float("nan"), 0.0)
        return cls(float(counts[0]), usual(np.diff(counts)))

    def is_again(self, before: float | None, counts: Array | None) -> bool:
        """Whether rows begin where a clock began, after rows that ended later."""
        if before is None or counts is None or not len(counts):
            return False
        return bool(counts[0] < before and abs(counts[0] - self.first) <= NEAR_START * self.interval)


def split_by_group(whole: Recording, groups: Sequence[str], tasks: Sequence[str] | None = None) -> list[Recording]:
    """One recording for each group, called as it, in the order of first appearance, with the task of its first row."""
    codes = {text: code for code, text in enumerate(dict.fromkeys(groups))}
    code_of_row = np.fromiter((codes[text] for text in groups), dtype=np.intp, count=len(groups))
    order = np.argsort(code_of_row, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(code_of_row))[:-1]) if len(groups) else []
    return [
        replace(
            rows_of(whole, _as_slice(rows)),
            name=f"{float(text):.15g}" if EXPONENTIAL.fullmatch(text) else text,
            remarks=whole.remarks if number == 0 else (),
            attributes=whole.attributes if tasks is None else {**whole.attributes, "task": tasks[int(rows[0])]},
        )
        for number, (text, rows) in enumerate(zip(codes, parts, strict=True))
    ]


def rows_of(recording: Recording, rows: slice | NDArray[np.intp]) -> Recording:
    """Some rows of a recording."""
    times = None if recording.times is None else recording.times[rows]
    lines = None if recording.lines is None else recording.lines[rows]
    return replace(recording, values=recording.values[rows], times=times, lines=lines)


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Make names differ: the second ``x`` becomes ``x.1``, the third ``x.2``."""
    names = tuple(names)
    taken, next_number, unique = set(names), dict.fromkeys(names, 0), []
    for name in names:
        fresh = name
        while next_number[name] and fresh in taken:
            fresh = f"{name}.{next_number[name]}"
            next_number[name] += 1
        next_number[name] = next_number[name] or 1
        taken.add(fresh)
        unique.append(fresh)
    return tuple(unique)


def named_by(names: Sequence[str] | None, held: Sequence[str], path: Path) -> tuple[str, ...]:
    """Names of columns: as told, else those that the file has; a ReadError where they are too many or too few."""
    if names is None:
        return tuple(held)
    if len(names) != len(held):
        raise ReadError(
            f"{path}: got {len(names)} names of columns ({listed(names)}), expected {len(held)}, one for each."
        )
    return tuple(names)


def _labels(table: Table, roles: Roles) -> tuple[str, int]:
    """The column with the most values, one after the other, at whose changes other columns jump, and their number."""
    most = "", 0
    head = table.values[:1000]
    steady = np.count_nonzero(head[1:] != head[:-1], axis=0) <= len(head) // FEWEST_ROWS  # as few columns are
    columns = ((table.columns[at], table.values[:, at]) for at in np.flatnonzero(steady))
    for name, cells in (*table.words.items(), *columns):
        bounds = [] if name in roles.taken or name == roles.counter else _stretches(cells)
        if len(bounds) > max(1, most[1] - 1) and _jumps(table.values, np.array(bounds)):
            most = name, len(bounds) + 1
    return most


def _stretches(cells: Collection[Any]) -> list[int]:
    """Rows where the value changes; none where a value comes again, or stands in too few rows."""
    values = cells if isinstance(cells, np.ndarray) else np.fromiter(cells, object, len(cells))
    bounds = (np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()
    if (
        len(bounds) >= len(values) // FEWEST_ROWS
        or np.diff([0, *bounds, len(values)]).min(initial=len(values)) < FEWEST_ROWS
    ):
        return []
    return bounds if len({str(values[at]) for at in (0, *bounds)}) == len(bounds) + 1 else []


def _jumps(values: Array, bounds: NDArray[np.intp]) -> bool:
    """Whether a column of which no value stays jumps at most of the bounds."""
    changes = (np.abs(np.diff(column)) for column in values.T)
    return any(np.median(each[bounds - 1]) > JUMP * each.mean() and np.median(each) > 0.0 for each in changes)


def _column(table: Table, name: str) -> Array:
    return table.values[:, table.columns.index(name)]


def _groups(table: Table, group: str | None) -> list[str] | None:
    if group is None:
        return None
    if group in table.words:
        return list(map(str, table.words[group]))
    return [f"{number:.17g}" for number in _column(table, group).tolist()]


def _as_slice(places: NDArray[np.intp]) -> slice | NDArray[np.intp]:
    """Places in a row as a slice, which copies nothing."""
    first, last = int(places[0]), int(places[-1])
    return slice(first, last + 1) if last - first + 1 == len(places) else places


def _long_enough(breaks: Sequence[int], rows: int) -> list[int]:
    """The breaks, if there is a demonstration between any two of them; none otherwise."""
    bounds = sorted({at for at in breaks if 0 < at < rows})
    long = np.diff([0, *bounds, rows]).min(initial=rows) >= FEWEST_ROWS
    return bounds if long else []


def _continued(bounds: list[int], times: Array | None) -> list[int]:
    """The breaks over which the clock does not just go on."""
    if times is None or not bounds:
        return bounds
    steps = np.diff(times)
    return [at for at in bounds if not 0 < steps[at - 1] <= 3 * usual(steps)]


def _restarts(counts: Array | None, start: Start) -> list[int]:
    """Rows where a clock begins anew: each time it goes back, it goes back to where it began; none otherwise."""
    if counts is None:
        return []
    back = np.flatnonzero(np.diff(counts) < 0) + 1
    # The first and the last may go on in the blocks before and after.
    if np.diff(back).min(initial=FEWEST_ROWS) < FEWEST_ROWS:
        return []
    is_near = np.abs(counts[back] - start.first) <= NEAR_START * start.interval
    return [int(at) for at in back] if is_near.all() else []

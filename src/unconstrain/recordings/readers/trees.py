"""Nested arrays, as HDF5, MATLAB, NumPy and JSON hold them, as tables.

A mapping whose arrays have one length in common is a table. An array of one dimension is a column of its name; one of
two is as many columns, numbered from 1, whichever way it lies; one of three holds a demonstration in each part, with
what has as many samples, as a clock of all or of each. Each member of a sequence of mappings or arrays is a
demonstration. Single numbers and words are attributes.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import Array
from ...base.display import listed
from ...base.errors import ReadError
from ..columns import SHORT
from ..remarks import Remark
from .clocks import TIME_NAME
from .reading import Reading
from .table import FEWEST_ROWS, Table, named_by, unique_names

ACTIONS = ("actions", "action")
"""An array of such a name has a row for each sample; observations may have one more, after the last action."""

PERIODS = ("dt", "ts", "sampling_time", "sample_time", "period")
RATES = ("fs", "rate", "rate_hz", "frequency", "freq", "fps", "hz", "sample_rate", "sampling_rate", "control_freq")

_DEMONSTRATION = re.compile(
    r"(demo|demonstration|traj|trajectory|trial|episode|ep|run|rec|recording|bout|take|arr)[_ -]?\d+", re.IGNORECASE
)

EPISODE_ENDS = ("episode_ends",)
"""Arrays that hold the row after the last of each episode."""

UNNAMED = "column"
"""What an array without a name, or of many that are alike, makes is called by this and a number."""

MOST_ROWS = 10**9
MOST_COLUMNS = 16
"""Of three dimensions the second is that of the columns if it is no larger and the first is."""

WIDEST = 4
"""An array that has so many times more columns than rows lies on its side."""


@dataclass
class Branch:
    """A mapping on the way to the arrays, with what holds for all below it."""

    members: Mapping[str, Any]
    name: str
    attributes: Mapping[str, Any] = field(default_factory=dict)
    labels: tuple[str, ...] = ()
    is_short: bool = True


class Elsewhere:
    """A member that is in another file, which is not read."""


@dataclass(frozen=True)
class Leaf:
    """An array with its samples along ``axis``, the first ``length`` of them."""

    array: Any
    axis: int
    length: int

    def rows(self, start: int, stop: int) -> Any:
        """Some samples, one a row."""
        stop = min(stop, self.length)
        return self.array[start:stop] if self.axis == 0 else np.asarray(self.array[:, start:stop]).T


def tables_of(branch: Branch, path: Path, reading: Reading, rows: int | None = None) -> Iterator[Table]:
    """All tables in a tree, with their columns called as told, whole or by so many rows at a time.

    Raises
    ------
    ReadError
        If there is none, or other than so many columns, or a clock that is none of the demonstrations beside it.
    """
    found, names = False, reading.columns
    for table in _tables(branch, path, rows, reading.time):
        found = True
        yield table if names is None else replace(table, columns=named_by(names, table.columns, path))
    if not found:
        held = described(branch.members)
        raise ReadError(f"{path}: no arrays of numbers with one length in common; it holds {held}.")


def described(members: Mapping[str, Any]) -> str:
    """What is in a mapping, in a few words."""
    shapes = {name: getattr(one, "shape", type(one).__name__) for name, one in members.items()}
    return listed([f"{name} {shape}" for name, shape in shapes.items()]) or "nothing"


def _tables(branch: Branch, path: Path, rows: int | None, time: str | None) -> Iterator[Table]:
    arrays = {name: member for name, member in branch.members.items() if _is_array(member)}
    if episodes := _episodes(arrays):
        arrays = {name: array for name, array in arrays.items() if name not in EPISODE_ENDS} | episodes
    branch.attributes = {**branch.attributes, **_attributes(branch.members)}
    flat = {name: array for name, array in arrays.items() if array.ndim < 3}
    leaves = {} if _are_demonstrations(flat) else _leaves(flat)
    called = {name for name in arrays if name == time or TIME_NAME.fullmatch(name)}
    clocks = {name for name in called if arrays[name].dtype.kind in "fiu" and arrays[name].shape[2:] in ((), (1,))}
    deep = _deep(arrays, leaves, clocks, branch, path)
    below = [*deep, *_branches(branch)]
    if leaves and not deep and (not below or _length(leaves) >= FEWEST_ROWS):
        yield from _cut(leaves, branch, path, rows)
    elif not below:
        alike = _are_demonstrations(arrays)
        for name, array in arrays.items():
            if array.ndim == 2 and (single := _leaves({UNNAMED if alike else name: array})):
                below_it = Branch({}, _under(branch, name), branch.attributes, branch.labels)
                yield from _cut(single, below_it, path, rows)
    for child in below:
        yield from _tables(child, path, rows, time)


def _cut(leaves: dict[str, Leaf], branch: Branch, path: Path, rows: int | None) -> Iterator[Table]:
    """The table of some arrays, whole or by so many rows at a time."""
    length = _length(leaves)
    for start in range(0, length, rows or max(length, 1)):
        parts = {name: np.asarray(leaf.rows(start, start + (rows or length))) for name, leaf in leaves.items()}
        words = {name: _words(part, name, path) for name, part in parts.items() if part.dtype.kind in "SUO"}
        short = SHORT if branch.is_short and set(SHORT) <= set(leaves) else {}
        numbers = {name: part for name, part in parts.items() if name not in words}
        columns = [column for name, part in numbers.items() for column in _columns(name, part, short)]
        if not columns:
            return
        yield Table(
            branch.name,
            unique_names(name for name, _ in columns),
            np.column_stack([values for _, values in columns]),
            words,
            rate=_rate(branch.attributes),
            attributes=branch.attributes,
            labels=branch.labels,
            remarks=() if start else (*_remarks(leaves), *_left_out(leaves, branch)),
        )


def _columns(name: str, part: Any, short: Mapping[str, str]) -> list[tuple[str, Array]]:
    with np.errstate(all="ignore"):  # a long double beyond float64 becomes infinity, which is found later
        values = part.astype(np.float64)
    if values.ndim == 1 or values.shape[1] == 1:
        return [(name if name not in short else f"{short[name]}1", values.reshape(len(values)))]
    return [(f"{short.get(name, name)}{place + 1}", column) for place, column in enumerate(values.T)]


def _remarks(leaves: Mapping[str, Leaf]) -> tuple[Remark, ...]:
    """A word about an array of which nothing tells which way it lies."""
    turned = [name for name, leaf in leaves.items() if leaf.axis == 1]
    single = [leaf for leaf in leaves.values() if leaf.array.ndim == 2]
    if len(leaves) > 1 or not single:
        return ()
    rows, columns = single[0].array.shape
    if not turned and columns <= rows:
        return ()
    samples, rest = (columns, "") if turned else (rows, "; transpose it if it lies the other way")
    return (Remark("orientation", f"an array of {rows} x {columns} was read as {samples} samples{rest}."),)


def _left_out(leaves: Mapping[str, Leaf], branch: Branch) -> Iterator[Remark]:
    """A word about each array of numbers that has another length."""
    for name, member in branch.members.items():
        if isinstance(member, Elsewhere):
            yield Remark("dropped-column", f"{name!r} is in another file, and was left out.", name)
        if (
            name not in (*leaves, *EPISODE_ENDS)
            and _is_array(member)
            and member.ndim < 3
            and member.dtype.kind in "fiu"
        ):
            said = f"of shape {tuple(member.shape)} was left out: the others have {_length(leaves)} samples."
            yield Remark("dropped-column", said, name)


def _leaves(arrays: Mapping[str, Any]) -> dict[str, Leaf]:
    """Arrays that share a length, numbers among them; none if they share none."""
    length = _common_length(arrays)
    leaves = {name: leaf for name, array in arrays.items() if (leaf := _leaf(array, length)) is not None}
    has_numbers = any(leaf.array.dtype.kind in "fiub" for leaf in leaves.values())
    shares = length is not None and (len(leaves) > 1 or len(arrays) == 1)
    return leaves if has_numbers and shares else {}


def _leaf(array: Any, length: int | None) -> Leaf | None:
    for extra in (0, 1):  # observations may have one more, after the last action
        for axis in range(array.ndim):
            if length is not None and array.shape[axis] == length + extra:
                return Leaf(array, axis, length)
    return None


def _common_length(arrays: Mapping[str, Any]) -> int | None:
    """Samples: of the actions if there are any, else the length that most arrays share, the largest of several."""
    numbers = {name: array for name, array in arrays.items() if array.dtype.kind in "fiub"}
    for name in ACTIONS:
        if name in numbers:
            return int(numbers[name].shape[0])
    if len(arrays) == 1:
        return next((_longer(array) for array in numbers.values()), None)
    votes = Counter(size for array in arrays.values() for size in set(array.shape))
    flat = {array.shape[0] for array in arrays.values() if array.ndim == 1}
    # What is the smaller side of every array is a number of columns.
    sides = {max(array.shape) for array in arrays.values()}
    shared = [size for size, count in votes.items() if count > 1 and size > 1 and size in sides]
    return max(shared, key=lambda size: (size in flat, votes[size], size), default=None)


def _are_demonstrations(arrays: Mapping[str, Any]) -> bool:
    """Whether each array is one demonstration: they are numbered, and have the same columns."""
    tables = [array for array in arrays.values() if array.ndim == 2]
    numbered = all(_DEMONSTRATION.fullmatch(name) for name, array in arrays.items() if array.ndim == 2)
    return len(tables) > 1 and numbered and len({min(array.shape) for array in tables}) == 1


def _longer(array: Any) -> int:
    if array.ndim == 1:
        return int(array.shape[0])
    rows, columns = array.shape
    return int(columns if columns >= WIDEST * rows else rows)


def _length(leaves: Mapping[str, Leaf]) -> int:
    return next((leaf.length for leaf in leaves.values()), 0)


def _branches(branch: Branch) -> Iterator[Branch]:
    """Mappings and sequences below, with their names."""
    for name, member in branch.members.items():
        if isinstance(member, Branch):
            member.attributes = {**branch.attributes, **member.attributes}
            member.labels = member.labels or branch.labels
            yield member
        elif isinstance(member, Mapping):
            yield Branch(member, _under(branch, name), branch.attributes, branch.labels, branch.is_short)
        elif isinstance(member, Sequence) and not isinstance(member, str | bytes):
            for number, each in enumerate(member, start=1):
                inside = each if isinstance(each, Mapping) else {name: each}
                yield Branch(inside, f"{_under(branch, name)}_{number}", branch.attributes, branch.labels)


def _deep(
    arrays: dict[str, Any], leaves: dict[str, Leaf], clocks: set[str], branch: Branch, path: Path
) -> list[Branch]:
    """Arrays of three dimensions as demonstrations, each with what goes along; none where others are the samples."""
    found: list[Branch] = []
    flat = {name: each for name, each in arrays.items() if each.ndim < 3 or name in clocks}
    strange = set(clocks)
    for (last, count, samples), deep in _of_one_size(arrays, clocks).items():
        along = _along(flat, {samples, next(iter(deep.values())).shape[1 - last]}, count)
        of_each = {name for name, leaf in leaves.items() if leaf.array.shape == (count,)} - clocks
        are_parts = not last and (along or (count < samples and not clocks))
        if set(leaves) <= ({*along, *of_each} if are_parts else clocks):
            strange -= {name for name in strange & set(along) if _increases(along[name].astype(np.float64))}
            lie = len(deep) > 1 and not last and all(each.shape[2] == samples for each in deep.values())
            axes = (2, 0, 1) if last else (0, 2, 1) if lie else (0, 1, 2)
            turned = {name: np.asarray(each).transpose(axes) for name, each in deep.items()} | along
            for at in range(count):
                members = {name: each[at] for name, each in turned.items()}
                name = f"{_under(branch, next(iter(deep)))}_{at + 1}"
                found.append(Branch(members, name, branch.attributes, branch.labels))
    if found and strange:
        raise ReadError(
            f"{path}: {listed(sorted(strange))} does not increase as a clock, or not with the samples of the rest: it "
            f"holds {described(arrays)}. Give a stamp for each sample, of one demonstration or of each in turn."
        )
    return found


def _of_one_size(arrays: Mapping[str, Any], clocks: set[str]) -> dict[tuple[bool, int, int], dict[str, Any]]:
    """Arrays of three dimensions by whether demonstrations are along the last or the first, their number, and size."""
    found: dict[tuple[bool, int, int], dict[str, Any]] = {}
    for name, array in arrays.items():
        if array.ndim != 3 or name in clocks or array.dtype.kind not in "fiub" or min(array.shape) < 1:
            continue
        last = FEWEST_ROWS <= array.shape[0] > array.shape[1] <= MOST_COLUMNS and array.shape[0] >= array.shape[2]
        *part, count = array.shape if last else (*array.shape[1:], len(array))
        if array.shape[0] <= max(array.shape[1:]) * 1000:
            found.setdefault((last, count, max(part)), {})[name] = array
    return found


def _along(others: Mapping[str, Any], lengths: set[int], count: int) -> dict[str, Any]:
    """Arrays that have a number for each of so many samples, of all demonstrations or of each, as shape (count, T)."""
    shapes = {name: tuple(size for size in array.shape if size > 1) for name, array in others.items()}
    return {
        name: np.broadcast_to(np.asarray(others[name]).reshape(shape), (count, shape[-1]))
        for name, shape in shapes.items()
        if shape[-1:] and shape[-1] in lengths and shape[:-1] in ((), (count,))
    }


def _increases(stamps: Array) -> bool:
    """Whether stamps never go back in any demonstration, NaN aside, nor all stand still."""
    return not (np.diff(stamps) < 0).any() and bool((np.fmax.reduce(stamps, 1) > np.fmin.reduce(stamps, 1)).all())


def _episodes(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """The number of the episode of each row, where an array says where each ends."""
    ends = next((np.asarray(arrays[name]) for name in EPISODE_ENDS if name in arrays), None)
    if ends is None or ends.ndim != 1 or ends.dtype.kind not in "iu" or not (np.diff(ends, prepend=0) > 0).all():
        return {}
    numbers = np.repeat(np.arange(len(ends)), np.diff(ends, prepend=0)) if ends[-1] < MOST_ROWS else np.empty(0)
    return {"episode": numbers} if any(len(numbers) == len(array) for array in arrays.values()) else {}


def _attributes(members: Mapping[str, Any]) -> dict[str, Any]:
    """Single numbers and words."""
    arrays = {name: one for name, one in members.items() if isinstance(one, np.ndarray) and one.dtype.kind in "fiubU"}
    single = {name: one.reshape(()).item() for name, one in arrays.items() if one.size == 1}
    return single | {name: member for name, member in members.items() if isinstance(member, str | int | float | bool)}


def _rate(attributes: Mapping[str, Any]) -> float | None:
    """Rows a second, where an attribute says so."""
    numbers = {name.lower(): value for name, value in attributes.items() if isinstance(value, int | float)}
    rates = [numbers[name] for name in RATES if name in numbers]
    rates += [1 / numbers[name] for name in PERIODS if numbers.get(name)]
    return next((float(rate) for rate in rates if 0 < rate < 1e6), None)


def _is_array(member: Any) -> bool:
    return getattr(member, "ndim", 0) in (1, 2, 3) and member.dtype.kind in "fiubSU" and member.size > 1


def _words(part: Any, name: str, path: Path) -> list[str]:
    try:
        return [word.decode("utf-8", "replace") if isinstance(word, bytes) else str(word) for word in part.tolist()]
    except (SystemError, ValueError) as error:  # what NumPy and Python raise for characters that do not exist
        raise ReadError(f"{path}: {name} holds damaged text ({error}).") from error


def _under(branch: Branch, name: str) -> str:
    return "/".join(filter(None, (branch.name, name if name != UNNAMED else "")))

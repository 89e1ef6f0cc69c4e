"""Tables and recordings that came by some rows at a time, put together again as far as memory should hold them."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..demonstration import Recording
from .table import Table

WHOLE_ROWS = 2**18
"""What has no more rows than this is read whole; a longer table or demonstration comes by so many rows at a time."""


def gathered(tables: Iterable[Table], most: float) -> Iterator[Table]:
    """Blocks of rows as tables: whole where they have at most so many rows, else so many at a time."""
    return _merged(tables, _is_more, _joined, most)


def continued(recordings: Iterable[Recording], most: float) -> Iterator[Recording]:
    """Recordings of which one block may end with what the next goes on with, up to so many rows at once."""
    return _merged(recordings, _goes_on, _end_to_end, most)


def _merged(
    parts: Iterable[Any], goes_on: Callable[[Any, Any], bool], join: Callable[[list[Any]], Any], most: float
) -> Iterator[Any]:
    waiting, rows = list[Any](), 0
    for part in parts:
        if waiting and (rows + len(part.values) > most or not goes_on(waiting[-1], part)):
            yield join(waiting) if waiting[1:] else waiting[0]
            waiting, rows = [], 0
        waiting.append(part)
        rows += len(part.values)
    if waiting:
        yield join(waiting) if waiting[1:] else waiting[0]


def _is_more(one: Table, other: Table) -> bool:
    """Whether a block is of the same table."""
    same = all(getattr(one, name) == getattr(other, name) for name in ("name", "columns", "labels"))
    return same and [*one.words] == [*other.words]


def _joined(tables: list[Table]) -> Table:
    starts = np.cumsum([0, *(len(one.values) for one in tables)]).tolist()
    breaks = tuple(start + at for start, one in zip(starts, tables, strict=False) for at in one.breaks)
    words = {name: [cell for one in tables for cell in one.words[name]] for name in tables[0].words}
    return replace(tables[0], words=words, breaks=breaks, **_rows(tables, "values", "lines"))


def _goes_on(one: Recording, other: Recording) -> bool:
    """Whether a block is more of the same recording."""
    return one.name == other.name and (one.times is None or other.times is None or other.times[0] > one.times[-1])


def _end_to_end(parts: list[Recording]) -> Recording:
    remarks = tuple(remark for one in parts for remark in one.remarks)
    return replace(parts[0], remarks=remarks, **_rows(parts, "values", "times", "lines"))


def _rows(parts: Sequence[Any], *names: str) -> dict[str, Any]:
    every = {name: [getattr(one, name) for one in parts] for name in names}
    return {name: None if each[0] is None else np.concatenate(each) for name, each in every.items()}

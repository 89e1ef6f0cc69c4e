"""Tables and recordings that came by some rows at a time, put together again as far as memory should hold them."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from ..demonstration import Recording
from .table import Table

WHOLE_ROWS = 2**18
"""What has no more rows than this is read whole; a longer table or demonstration comes by so many rows at a time."""

RESERVED = 2**28
"""Bytes of addresses for a table, so that it grows in its place; none that is not used takes memory."""


def gathered(tables: Iterable[Table]) -> Iterator[Table]:
    """Blocks of rows as tables: whole where they have at most :data:`WHOLE_ROWS`, else so many rows at a time."""
    return _merged(tables, lambda one, other: _head(one) == _head(other), lambda parts: joined(iter(parts)), WHOLE_ROWS)


def continued(recordings: Iterable[Recording], most: float | None = None) -> Iterator[Recording]:
    """Recordings of which one block may end with what the next goes on with, up to so many rows at once."""
    return _merged(recordings, _goes_on, _end_to_end, WHOLE_ROWS if most is None else most)


def _merged(
    parts: Iterable[Any], goes_on: Callable[[Any, Any], bool], join: Callable[[list[Any]], Any], most: float
) -> Iterator[Any]:
    waiting, rows = list[Any](), 0
    for part in parts:
        if waiting and (rows + len(part.values) > most or not goes_on(waiting[-1], part)):
            yield join(waiting)
            waiting, rows = [], 0
        waiting.append(part)
        rows += len(part.values)
    if waiting:
        yield join(waiting)


def joined(tables: Iterator[Table]) -> Table:
    """Blocks of one table, end to end, with no more than one of them in memory twice; one alone as it is."""
    first = next(tables)
    second = next(tables, None)
    if second is None:
        return first
    width = first.values.shape[1]
    values = np.empty((RESERVED // (8 * max(width, 1)), width))
    words: dict[str, list[Any]] = {name: [] for name in first.words}
    breaks, lines, rows = list[int](), list[Any](), 0
    for table in chain([first, second], tables):
        breaks += [rows + at for at in table.breaks]
        lines.append(table.lines)
        stop = rows + len(table.values)
        if stop > len(values):
            values.resize((stop, width), refcheck=False)
        values[rows:stop], rows = table.values, stop
        for name, cells in table.words.items():
            words[name] += cells
    values.resize((rows, width), refcheck=False)
    known = None if lines[0] is None else np.concatenate(lines)
    return replace(first, values=values, words=words, breaks=tuple(breaks), lines=known)


def _head(table: Table) -> tuple[Any, ...]:
    """What blocks of one table have in common."""
    return table.name, table.columns, (*table.words,), table.labels


def _goes_on(one: Recording, other: Recording) -> bool:
    """Whether a block is more of the same recording."""
    return one.name == other.name and (one.times is None or other.times is None or other.times[0] > one.times[-1])


def _end_to_end(parts: list[Recording]) -> Recording:
    tables = {name: [getattr(one, name) for one in parts] for name in ("values", "times", "lines")}
    rows: dict[str, Any] = {name: None if each[0] is None else np.concatenate(each) for name, each in tables.items()}
    return replace(parts[0], **rows, remarks=tuple(remark for one in parts for remark in one.remarks))

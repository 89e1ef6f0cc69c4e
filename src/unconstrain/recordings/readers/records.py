"""JSON: a list of records, columns, or a list of demonstrations of either kind; and a record a line (``.jsonl``)."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...base.files import stem
from .packed import opened
from .reading import Reading
from .table import Format, Table
from .trees import UNNAMED, Branch, tables_of

LONGEST_CELL = 64
"""A record may hold lists, up to so many numbers; what is longer is a column."""


def read_json(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one file; see :class:`~.table.ReadFile`."""
    with opened(path) as file:
        tree = _tree(_parse(file.read().decode("utf-8-sig")))
    members = tree if isinstance(tree, Mapping) else {UNNAMED: tree}
    yield from tables_of(Branch(members, stem(path), is_short=False), path, reading)


def _parse(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) < 2 or not lines[0].lstrip().startswith("{"):
            raise
        return [json.loads(line) for line in lines]


def _tree(value: Any) -> Any:
    """Lists as arrays where they can be, records as columns."""
    if isinstance(value, dict):
        members = {name: _tree(member) for name, member in value.items()}
        has_column = any(isinstance(member, np.ndarray) for member in members.values())
        return dict(_flattened(members)) if has_column else members
    if not isinstance(value, list):
        return value
    if value and all(isinstance(each, dict) for each in value):
        rows = [dict(_flattened(each)) for each in value]
        return _columns(rows) if _are_records(rows) else [_tree(each) for each in value]
    array = _array(value)
    return [_tree(each) for each in value] if array is None else array


def _flattened(members: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """A mapping of mappings as one, with names joined by points."""
    for name, member in members.items():
        if isinstance(member, dict):
            yield from _flattened(member, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", member


def _are_records(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether mappings are rows of a table: numbers or short lists, and more rows than any list has entries."""
    cells = [cell for row in rows for cell in row.values()]
    longest = max((len(cell) for cell in cells if isinstance(cell, list)), default=0)
    has_number = any(isinstance(cell, int | float) for cell in cells)
    return all(_is_cell(cell) for cell in cells) and (has_number or longest < len(rows))


def _is_cell(cell: Any) -> bool:
    if isinstance(cell, list):
        return len(cell) <= LONGEST_CELL and all(isinstance(each, int | float) for each in cell)
    return cell is None or isinstance(cell, str | int | float)


def _columns(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {name: _array([row.get(name) for row in rows]) for name in names}
    return {name: column for name, column in columns.items() if column is not None}


def _array(cells: Sequence[Any]) -> Any:
    """Cells as an array of numbers, of words, or of lists of one length; None if they are neither."""
    if cells and all(cell is None or isinstance(cell, int | float) for cell in cells):
        return np.array([np.nan if cell is None else float(cell) for cell in cells])
    if cells and all(isinstance(cell, str) for cell in cells):
        return np.array(cells, dtype=np.str_)
    lists = [cell for cell in cells if isinstance(cell, list)]
    if not lists or len({len(cell) for cell in lists}) > 1 or len(lists) < sum(cell is not None for cell in cells):
        return None
    rows = [_array(cell) for cell in lists]
    if any(row is None or row.dtype.kind != "f" or row.ndim != 1 for row in rows):
        return None
    table = np.full((len(cells), len(lists[0])), np.nan)
    table[[cell is not None for cell in cells]] = rows
    return table


def _recognises(head: bytes) -> bool:
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"["))


FORMAT = Format(
    (".json", ".jsonl", ".ndjson"),
    _recognises,
    read_json,
    by_content=False,
    expected="JSON: records, or columns of numbers",
)

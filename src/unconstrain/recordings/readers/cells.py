"""From lines of text to numbers, by the layout that the beginning of the text has.

A block that is all numbers is parsed by pyarrow, where that is installed; any other by Python, which knows the line
of what it cannot read.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.errors import ReadError
from .layout import NOTHING, Layout, fitted, is_comment, number, read_list, split
from .lines import Lines
from .table import numbers_of

Row = tuple[int, list[str]]
"""Line number, from 1, and cells."""

ROWS_AT_ONCE = 20_000
"""A cell of text takes ten times the space of a number."""


class Cells(NamedTuple):
    """Rows as numbers (r, c) and their lines (r,), the cells of columns of words, and rows after a break."""

    numbers: Array
    words: Mapping[int, Sequence[str]]
    breaks: tuple[int, ...]
    lines: NDArray[np.int32]


class Parser:
    """Turns lines of some layout into numbers, but for columns of ``words``; that of ``group`` may not be empty."""

    def __init__(
        self, layout: Layout, names: Sequence[str], words: Sequence[int], group: int | None, path: Path
    ) -> None:
        self.layout = layout
        self.names = names
        self.words = list(words)
        self.group = group
        self.path = path
        self.numbers = [at for at, kind in enumerate(layout.kinds) if kind in "ne" and at not in words]
        self.lists = {at: 0 for at, kind in enumerate(layout.kinds) if kind == "l" and at not in words}
        self._has_number: NDArray[np.bool_] = np.zeros(len(names), dtype=bool)
        self._arrow = None if self.lists or len(names) > 4000 else _arrow()  # which has a reader for each column
        # Of lines that are no rows pyarrow notices most by their cells, if there are several and the first is a number.
        self._not_plain = _NOT_PLAIN[:2] if len(names) > 1 and 0 in self.numbers else _NOT_PLAIN

    @property
    def columns(self) -> list[tuple[int, str]]:
        """Place in the text and name of each column of numbers."""
        lists = ((at, f"{self.names[at]}{place + 1}") for at, width in self.lists.items() for place in range(width))
        return [*((at, self.names[at]) for at in self.numbers), *lists]

    def parse(self, lines: Lines) -> Cells:
        """Some lines as numbers.

        Raises a ReadError that names line and column where cells are too many, too few or words instead of numbers, and
        a UnicodeDecodeError or csv.Error where it is no text or quotes do not match.
        """
        return self._parse_numbers(*lines) or self._parse_any(lines)

    def _parse_numbers(self, first: int, text: bytes) -> Cells | None:
        """Lines that are nothing but cells, by pyarrow; None where there is anything else."""
        if self._arrow is None or text.startswith((b"\n", b" ")) or any(mark in text for mark in self._not_plain):
            return None
        if self.layout.delimiter == " ":
            text = re.sub(rb" *\n", b"\n", re.sub(rb"[ \t]+", b" ", text)).replace(b"\n ", b"\n")
        table = _read_csv(self._arrow, text, self.layout, self.numbers, self.words)
        words = {} if table is None else {at: _stripped(table[str(at)].to_pylist()) for at in self.words}
        if table is None or (self.group is not None and not all(words[self.group])):
            return None
        numbers = numbers_of(table.select([str(at) for at in self.numbers]))
        self._has_number[self.numbers] |= np.isfinite(numbers).any(axis=0)
        return Cells(numbers, words, (), np.arange(first + 1, first + 1 + len(numbers), dtype=np.int32))

    def _parse_any(self, lines: Lines) -> Cells:
        """Lines by Python: slower, but it knows the line of what is wrong, and passes over what is no row."""
        rows, breaks = self._rows(lines)
        parts = [self._columns(rows[at : at + ROWS_AT_ONCE]) for at in range(0, len(rows), ROWS_AT_ONCE)]
        words = {at: [cells[at] for _, cells in rows] for at in self.words}
        for row, cells in rows if self.group is not None else ():
            if not cells[self.group or 0]:
                said = f"line {row}, column {self.names[self.group or 0]!r}"
                raise ReadError(f"{self.path}, {said}: empty, expected the name of a demonstration.")
        numbers = np.concatenate(parts) if parts else np.empty((0, len(self.columns)))
        return Cells(numbers, words, tuple(breaks), np.array([line for line, _ in rows], dtype=np.int32))

    def _rows(self, lines: Lines) -> tuple[list[Row], list[int]]:
        """Rows of cells, and before which of them there is a blank line or the header once more."""
        rows: list[Row] = []
        breaks: list[int] = []
        for number_, line in enumerate(lines.text.decode().split("\n")[:-1], start=lines.first + 1):
            if is_comment(line):
                continue
            cells = split(line, self.layout.delimiter)
            if (not any(cells) and len(cells) < 2) or tuple(cells) in self.layout.header:
                breaks.append(len(rows))
            else:
                rows.append((number_, self._fitted(cells, number_)))
        return rows, breaks

    def _fitted(self, cells: list[str], line: int) -> list[str]:
        found = fitted(cells, self.layout.kinds)
        if found is None:
            expected = f"expected {len(self.names)} as in the header"
            raise ReadError(f"{self.path}, line {line}: got {len(cells)} cells, {expected}.")
        return found

    def _columns(self, rows: Sequence[Row]) -> Array:
        lines = [line for line, _ in rows]
        columns = list(zip(*(cells for _, cells in rows), strict=True))
        plain, word = _numbers([cell for at in self.numbers for cell in columns[at]], self.layout.decimal)
        plain = plain.reshape(len(self.numbers), len(rows)).T
        if word is not None:
            plain = np.column_stack([self._column(columns[at], at, lines) for at in self.numbers])
        self._has_number[self.numbers] |= np.isfinite(plain).any(axis=0)
        return np.hstack([plain, *(self._list(columns[at], at, lines) for at in self.lists)])

    def _column(self, cells: Sequence[str], at: int, lines: Sequence[int]) -> Array:
        numbers, word = _numbers(cells, self.layout.decimal)
        if word is not None and (self._has_number[at] or np.isfinite(numbers).any()):
            raise ReadError(
                f"{self.path}, line {lines[word]}, column {self.names[at]!r}: got {cells[word][:40]!r}, "
                "expected a number as elsewhere in this column."
            )
        return numbers

    def _list(self, cells: Sequence[str], at: int, lines: Sequence[int]) -> Array:
        """Lists of one length as columns; no column where the first rows have lists of several lengths."""
        lists = [read_list(cell) or [] for cell in cells]
        lengths = {len(values) for values in lists if values}
        if self.lists[at] == 0 and len(lengths) == 1 and not self._has_number[at]:
            self.lists[at] = lengths.pop()
        self._has_number[at] = True  # decided, one way or the other
        width = self.lists[at]
        wrong = next((row for row, values in enumerate(lists) if width and len(values) not in (0, width)), None)
        if wrong is not None:
            place = f"{self.path}, line {lines[wrong]}, column {self.names[at]!r}"
            raise ReadError(f"{place}: got a list of {len(lists[wrong])} numbers, expected {width} as before.")
        return np.array([values or [np.nan] * width for values in lists]) if width else np.empty((len(cells), 0))


_NOT_PLAIN = (b"#", b"\n\n", b"\n//", b"\n%", b"\n \n", b"\n\t\n")
"""What pyarrow would take for cells or pass over, and we do not."""


def _numbers(cells: Sequence[str], decimal: str) -> tuple[Array, int | None]:
    """Cells as numbers, NaN where empty or a word, and the row of the first word."""
    # float() reads 2019_02_14 as 20190214.
    if decimal == "." and "_" not in "".join(cells):
        try:
            return np.fromiter(map(float, cells), dtype=np.float64, count=len(cells)), None
        except ValueError:
            pass
    values = [number(cell, decimal) for cell in cells]
    word = next((row for row, value in enumerate(values) if value is None), None)
    return np.array([np.nan if value is None else value for value in values]), word


def _stripped(cells: Sequence[str]) -> list[str]:
    """Words without white space around them, equal ones in one place of memory."""
    once = {cell: cell.strip() for cell in cells}
    return [once[cell] for cell in cells]


def _arrow() -> ModuleType | None:
    try:
        return importlib.import_module("pyarrow")
    except ImportError:
        return None


def _read_csv(arrow: Any, text: bytes, layout: Layout, numbers: Sequence[int], words: Sequence[int]) -> Any:
    """A table whose columns are called by their places; None where pyarrow cannot read it."""
    from pyarrow import csv

    kinds: dict[int, Any] = dict.fromkeys(numbers, arrow.float64()) | dict.fromkeys(words, arrow.string())
    try:
        return csv.read_csv(
            arrow.BufferReader(text),
            csv.ReadOptions(
                use_threads=False, block_size=len(text) + 1, column_names=[str(at) for at in range(len(layout.kinds))]
            ),
            csv.ParseOptions(delimiter=layout.delimiter, ignore_empty_lines=False),
            csv.ConvertOptions(
                column_types={str(at): kind for at, kind in kinds.items()},
                include_columns=[str(at) for at in kinds],
                null_values=NOTHING,
                decimal_point=layout.decimal,
            ),
        )
    except (arrow.ArrowException, UnicodeDecodeError):
        return None

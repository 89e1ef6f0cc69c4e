"""Workbooks (``.xlsx``, ``.xls``, ``.ods``) by python-calamine: each sheet with a table is a recording.

A sheet is read as a text is: its header may have several rows, a row of units, lines above it (:mod:`~.layout`).
"""

from __future__ import annotations

import datetime as dt
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...base.arrays import require_extra
from ...base.display import meant
from ...base.errors import ReadError
from ...base.files import stem
from .layout import find_block
from .lines import Lines
from .reading import Reading
from .table import Format, Table
from .text import tables_of_text

DELIMITER = "\t"


def read_excel(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one workbook, or the sheet of it that is asked for as topic; see :class:`~.table.ReadFile`."""
    sheets = _sheets(path)
    if reading.topic is not None and reading.topic not in sheets:
        near = meant([reading.topic], sheets)
        raise ReadError(f"{path}: no sheet {reading.topic!r}; it has {', '.join(sheets) or 'none'}.{near}")
    asked = sheets if reading.topic is None else {reading.topic: sheets[reading.topic]}
    tables = [table for title, rows in asked.items() for table in _of_sheet(title, rows, path, reading, len(asked) > 1)]
    if not tables:
        raise ReadError(f"{path}: no sheet holds a table of numbers.")
    yield from tables


def _sheets(path: Path) -> dict[str, list[str]]:
    """The rows of each sheet, as lines of text."""
    calamine = require_extra("python_calamine", "formats")
    book = calamine.load_workbook(io.BytesIO(path.read_bytes()))
    tables = {title: book.get_sheet_by_name(title).to_python() for title in book.sheet_names}
    return {title: [DELIMITER.join(map(_cell, row)) for row in rows] for title, rows in tables.items()}


def _cell(cell: Any) -> str:
    if isinstance(cell, dt.datetime | dt.date | dt.time):
        return cell.isoformat()
    return " ".join(repr(cell).split()) if isinstance(cell, float) else " ".join(str(cell).split())


def _of_sheet(title: str, lines: list[str], path: Path, reading: Reading, several: bool) -> Iterator[Table]:
    cells = [[each.strip() for each in line.split(DELIMITER)] if line.strip() else None for line in lines]
    found = find_block(cells, lines, DELIMITER, ".")
    if found is None:
        return
    layout = found[1]
    text = "".join(f"{line}\n" for line in lines[layout.first :]).encode()
    name = f"{stem(path)}/{title}" if several else stem(path)
    yield from tables_of_text(layout, iter([Lines(layout.first, text)]), path, reading, name)


def _is_workbook(head: bytes) -> bool:
    is_zip = head.startswith(b"PK\x03\x04") and (
        b"[Content_Types].xml" in head or b"xl/" in head or b"opendocument" in head
    )
    return is_zip or head.startswith(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")


FORMAT = Format(
    (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods"),
    _is_workbook,
    read_excel,
    has_topics=True,
    expected="a workbook; or save it as CSV",
)

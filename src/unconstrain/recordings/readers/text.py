"""Tables as text: CSV, TSV, semicolons.

The first line names the columns. Comma, tab and semicolon separate cells;
whichever the header has most of is taken. Empty cells become NaN. Lines that
begin with ``#`` and blank lines are passed over; where only such a comment
carries the names, as ``numpy.savetxt(header=...)`` writes it, it is the header.

A column whose cells are all words is left out, unless it names the demonstrations.
"""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from itertools import chain, compress, islice
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.errors import ReadError
from ..demonstration import Recording
from .table import Format, find_roles, listed, seconds, split_by_group, unique_names

DELIMITERS = ",\t;"
_ROWS_AT_ONCE = 20_000  # bounds the memory: a cell of text takes ten times the space of a number
_QUOTED = re.compile(r'"[^"]*"')


Row = tuple[int, list[str]]
"""Line number and cells."""


class _Block(NamedTuple):
    """Some rows as numbers: ``numbers`` (r, c), which columns hold any, and the first word of each column."""

    numbers: Array
    numeric: NDArray[np.bool_]
    words: dict[int, tuple[int, str]]


def read_text(path: Path, group: str | None, time: str | None) -> list[Recording]:
    """Read one table; see :class:`~.table.ReadFile`. Errors name the line and the column too."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            return _read_table(file, path, group, time)
    except UnicodeDecodeError as error:
        raise ReadError(f"{path}: not UTF-8 text ({error.reason}). Save it as a CSV file in UTF-8.") from error
    except csv.Error as error:
        raise ReadError(f"{path}: not a table of comma-separated values ({error}). Check its quotes.") from error
    except OSError as error:
        raise ReadError(f"{path}: could not be read ({error.strerror}).") from error


def _read_table(file: TextIO, path: Path, group: str | None, time: str | None) -> list[Recording]:
    delimiter, comment = _look_ahead(file, path)
    file.seek(0)
    rows = _rows(file, delimiter)
    titles, used = _titles(rows, comment, delimiter, path)
    names = unique_names(title or f"column{at + 1}" for at, title in enumerate(titles))
    group_at, time_at = find_roles(names, group, time, path)
    if group is None and group_at == time_at:
        group_at = None

    block, groups = _collect(chain(used, rows), names, group_at, path)
    text = set(block.words)
    if time_at in text and time is not None:
        line, cell = block.words[time_at]
        raise ReadError(f"{path}, line {line}, column {time!r}: got {cell!r}, expected a time stamp as a number.")
    empty: NDArray[np.bool_] = np.all(np.isnan(block.numbers), axis=0)
    padding = {at for at, title in enumerate(titles) if not title and empty[at]}
    kept = [at for at in range(len(names)) if at not in text | padding | {group_at, time_at}]
    if not kept:
        raise ReadError(
            f"{path}: no column of numbers; it has {listed(names)}. "
            "Expected a header, then rows of numbers separated by comma, tab or semicolon, with decimal points."
        )
    times = None if time_at is None or time_at in text else seconds(block.numbers[:, time_at], names[time_at])
    return split_by_group([names[at] for at in kept], block.numbers[:, kept], times, groups, path.stem)


def _look_ahead(file: TextIO, path: Path) -> tuple[str, str]:
    """Delimiter, and the last comment before the first line of the table."""
    comment = ""
    for line in file:
        if line.lstrip().startswith("#"):
            comment = line.strip().lstrip("# ")
        elif line.strip():
            return max(DELIMITERS, key=_QUOTED.sub("", line).count), comment
    raise ReadError(f"{path}: the file is empty, expected a header and rows of numbers.")


def _rows(file: TextIO, delimiter: str) -> Iterator[Row]:
    """Rows that are not blank, with their line numbers."""
    # Comments become blank lines rather than vanish, so that the line numbers stay true.
    lines = ("\n" if line.lstrip().startswith("#") else line for line in file)
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
    for row in reader:
        if len(row) > 1 or (row and row[0].strip()):
            yield reader.line_num, row


def _titles(rows: Iterator[Row], comment: str, delimiter: str, path: Path) -> tuple[list[str], list[Row]]:
    """Cells of the header, and the row used up to find it if that is data."""
    line, cells = next(rows, (1, [""]))
    if not any(cell.strip() for cell in cells) or _numbers(cells)[1].any():
        return [cell.strip() for cell in cells], []
    titles = [title.strip() for title in next(csv.reader([comment], delimiter=delimiter), [])]
    if len(titles) != len(cells):
        raise ReadError(
            f"{path}, line {line}: got only numbers, expected a header with the names of the columns. "
            "Add a first line such as 't,x,y,z'."
        )
    return titles, [(line, cells)]


def _collect(
    rows: Iterator[Row], names: Sequence[str], group_at: int | None, path: Path
) -> tuple[_Block, list[str] | None]:
    """All rows as numbers, and the cells that name the demonstration."""
    blocks: list[_Block] = []
    groups: list[str] = []
    while chunk := list(islice(rows, _ROWS_AT_ONCE)):
        _check_widths(chunk, names, path)
        blocks.append(_parse(chunk, group_at))
        if group_at is not None:
            groups += [_group(row, group_at, names, path) for row in chunk]
    if not blocks:
        raise ReadError(f"{path}: a header but no rows, expected at least one row of numbers.")
    numeric = np.any([block.numeric for block in blocks], axis=0)
    words = {at: word for block in reversed(blocks) for at, word in block.words.items()}
    for at, (line, cell) in words.items():
        if numeric[at]:
            raise ReadError(
                f"{path}, line {line}, column {names[at]!r}: got {cell[:40]!r}, "
                "expected a number as elsewhere in this column."
            )
    numbers = np.concatenate([block.numbers for block in blocks])
    return _Block(numbers, numeric, words), None if group_at is None else groups


def _check_widths(chunk: Sequence[Row], names: Sequence[str], path: Path) -> None:
    for line, cells in chunk:
        if len(cells) != len(names):
            raise ReadError(f"{path}, line {line}: got {len(cells)} cells, expected {len(names)} as in the header.")


def _parse(chunk: Sequence[Row], group_at: int | None) -> _Block:
    columns = list(zip(*(cells for _, cells in chunk), strict=True))
    numbers = np.full((len(chunk), len(columns)), np.nan)
    numeric = np.zeros(len(columns), dtype=bool)
    words = {}
    for at, cells in enumerate(columns):
        if at == group_at:
            continue
        numbers[:, at], is_word = _numbers(cells)
        # Empty cells are no numbers either: they do not make a column of words a numeric one.
        numeric[at] = not is_word.any() or any(cell.strip() for cell in compress(cells, ~is_word))
        if is_word.any():
            first = int(np.argmax(is_word))
            words[at] = chunk[first][0], cells[first]
    return _Block(numbers, numeric, words)


def _numbers(cells: Sequence[str]) -> tuple[Array, NDArray[np.bool_]]:
    """Cells as numbers, NaN where empty or a word, and which ones are words."""
    is_word: NDArray[np.bool_] = np.zeros(len(cells), dtype=bool)
    # float() reads 2019_02_14 as 20190214.
    if "_" not in "".join(cells):
        try:
            return np.fromiter(map(float, cells), dtype=np.float64, count=len(cells)), is_word
        except ValueError:
            pass
    numbers = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if cell.strip():
            try:
                numbers[row] = float(cell.replace("_", "?"))
            except ValueError:
                is_word[row] = True
    return numbers, is_word


def _group(row: Row, at: int, names: Sequence[str], path: Path) -> str:
    line, cells = row
    if not cells[at].strip():
        raise ReadError(f"{path}, line {line}, column {names[at]!r}: empty, expected the name of a demonstration.")
    return cells[at].strip()


def _recognises(head: bytes) -> bool:
    """Text with a delimiter in it."""
    try:
        text = codecs.getincrementaldecoder("utf-8-sig")().decode(head)
    except UnicodeDecodeError:
        return False
    return "\0" not in text and any(delimiter in text for delimiter in DELIMITERS)


FORMAT = Format((".csv", ".tsv", ".txt", ".dat"), _recognises, read_text)

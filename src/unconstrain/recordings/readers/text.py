"""Tables as text: comma, tab, semicolon or white space between cells, a point or a comma in the decimals, ``.gz`` too.

What stands above the block of numbers is its header: names in one row or several (joined by ``.``), a row of units,
lines about the recording (:mod:`~.layout`). Lines that begin with ``#`` are passed over. Empty cells, ``NA``, ``None``
and the like become NaN; columns of words are left out, unless they name the demonstrations or hold the time; columns
of lists of one length become as many columns. Blank lines separate demonstrations.
"""

import codecs
import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...base.display import listed
from ...base.errors import ReadError
from ...base.files import stem
from ..remarks import Remark
from .cells import Cells, Parser
from .layout import Layout, find_layout, is_comment, split
from .lines import Lines, head_of, lines_of, texts
from .packed import opened
from .reading import Reading
from .table import Format, Table, find_roles, named_by

DELIMITERS = ",\t;|"


def read_text(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one text by some megabytes at a time; see :class:`~.table.ReadFile`. Errors name the line and column too."""
    try:
        with opened(path) as file:
            blocks = lines_of(file, path)
            head = head_of(blocks)
            layout = _layout(texts(head), path)
            below = Lines(0, b"".join(block.text for block in head)).after(layout.first)
            below.text.decode()  # a header may be in another encoding, but not the table
            inside = (block.before(layout.stop) for block in chain([below], blocks))
            yield from tables_of_text(layout, inside, path, reading, stem(path))
    except UnicodeDecodeError as error:
        raise ReadError(f"{path}: not UTF-8 text ({error.reason}). Save it as a CSV file in UTF-8.") from error
    except csv.Error as error:
        raise ReadError(f"{path}: not a table of comma-separated values ({error}). Check its quotes.") from error


def tables_of_text(layout: Layout, blocks: Iterator[Lines], path: Path, reading: Reading, name: str) -> Iterator[Table]:
    """Blocks of lines as blocks of one table, by the layout of the text."""
    names = named_by(reading.columns, layout.names, path)
    roles = find_roles(names, reading, path)
    group = None if roles.group is None else names.index(roles.group)
    clock = None if roles.clock is None else names.index(roles.clock.whole)
    words = [at for at in (group, clock) if at is not None and (at == group or layout.kinds[at] == "w")]
    if group is None:  # one of them may tell demonstrations apart
        words += [at for at, kind in enumerate(layout.kinds) if kind == "w" and at not in (clock, *layout.various)]
    parser = Parser(layout, names, words, group, path)
    kept: list[int] = []
    rows = 0
    for block in blocks:
        cells = parser.parse(block)
        if not len(cells.numbers):
            continue
        if rows == 0:
            kept = _kept(cells, parser, layout)
        table = _table(cells, kept, names, parser, layout, name)
        yield table if rows else replace(table, remarks=tuple(_remarks(layout, names, parser)))
        rows += len(cells.numbers)
    if not rows:
        raise ReadError(f"{path}: a header but no rows, expected at least one row of numbers.")


def _kept(cells: Cells, parser: Parser, layout: Layout) -> list[int]:
    """Columns of numbers without those that have neither a name nor a number."""
    empty: NDArray[np.bool_] = np.all(np.isnan(cells.numbers), axis=0)
    return [place for place, (at, _) in enumerate(parser.columns) if layout.titles[at] or not empty[place]]


def _table(cells: Cells, kept: list[int], names: Sequence[str], parser: Parser, layout: Layout, name: str) -> Table:
    columns = [name for _, name in parser.columns]
    renamed = dict(zip(layout.names, names, strict=True))
    return Table(
        name,
        tuple(columns[place] for place in kept),
        cells.numbers if len(kept) == len(columns) else cells.numbers[:, kept],
        {names[at]: words for at, words in cells.words.items()},
        cells.breaks,
        layout.rate,
        units={renamed[name]: unit for name, unit in layout.units.items()},
        attributes=layout.attributes,
        lines=cells.lines,
    )


def _remarks(layout: Layout, names: Sequence[str], parser: Parser) -> Iterator[Remark]:
    if not any(layout.titles) and tuple(names) == layout.names:
        said = f"it has no header, so its columns are called {listed(names)}; name them with columns=('t', 'x', 'y')."
        yield Remark("no-header", said)
    for line, rows, columns in layout.others:
        said = f"another table of {columns} columns, at least {rows} rows from line {line + 1} on, was left out."
        yield Remark("other-topic", said)
    lists = [at for at, width in parser.lists.items() if not width]
    for at in (*(place for place in layout.various if place not in parser.words), *lists):
        why = "lists of several lengths" if at in lists else "words"
        yield Remark("dropped-column", f"holds {why}, not numbers, and was left out.", names[at])


def _layout(lines: Sequence[str], path: Path) -> Layout:
    layout = find_layout(lines)
    if layout is not None:
        return layout
    rows = [line for line in lines if line.strip() and not is_comment(line)]
    if not rows:
        raise ReadError(f"{path}: the file is empty, expected a header and rows of numbers.")
    if len(rows) == 1:
        raise ReadError(f"{path}: a header but no rows, expected at least one row of numbers.")
    names = split(rows[0], max(DELIMITERS, key=rows[0].count))
    raise ReadError(
        f"{path}: no column of numbers; it has {listed(names)}. "
        "Expected a header, then rows of numbers separated by comma, tab, semicolon or white space."
    )


def _recognises(head: bytes) -> bool:
    """Text with a number in it."""
    try:
        text = codecs.getincrementaldecoder("utf-8-sig")().decode(head)
    except UnicodeDecodeError:
        return head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return "\0" not in text and any(character.isdecimal() for character in text)


SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".trc", ".mot", ".sto", ".log", ".asc", ".ssv", ".data", ".out")

FORMAT = Format(
    SUFFIXES, _recognises, read_text, in_blocks=True, by_content=False, expected="a table as text, in UTF-8"
)

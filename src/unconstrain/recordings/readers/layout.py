"""Where in a text the table of numbers is, and what its header says.

Programs write lines about the recording above the table, names in one row or several, a row of units, and separate
cells in many ways. What they all have is a rectangular block of numbers: it is looked for first, with each way to
separate cells, and what stands above it is its header.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import compress, takewhile
from typing import Any, NamedTuple

from .table import unique_names

NOTHING = {"", *"NA N/A n/a #N/A <NA> NaN nan -nan -NaN NAN None none null NULL -".split()}  # noqa: SIM905
"""Cells that stand for no number."""

DIALECTS = (*((mark, ".") for mark in ",\t;| "), *((mark, ",") for mark in "\t; "))
"""Delimiters and decimal marks that are tried, the usual ones first; a blank stands for any white space."""

LISTS = re.compile(r"[\[(].*[\])]")
"""A cell that holds a list: ``[0.1, 0.2]``, ``(1 2 3)``."""

HEADER_COUNTS = 10
"""A block below a row of names weighs so many times as much as one without."""

MOST_KINDS = 50
"""So many different kinds of rows are told apart."""

_UNIT_WORD = re.compile(
    r"[\[(]?(m|mm|cm|um|km|in|ft|px|pixels?|rad|deg|degrees?|radians?|°|%|s|secs?|seconds?|ms|us|µs|ns|hz"
    r"|n|nm|nmm|n\.?m|n\*m|kg|g|v|mv|uv|a|(mm|m|cm|px|rad|deg|°)/s(\^?[2²]|/s)?|m/s/s|pa|kpa|mpa|c|°c|none|-)[\])]?",
    re.IGNORECASE,
)
_UNIT_IN_NAME = re.compile(r"[_ ]?[\[(]([^\[\]()]{1,12})[\])]$")
_COMMENT = re.compile(r"\s*(#|//|%(?=\s))")
_MARK = re.compile(r"^\s*(?:#+|//+|%+(?=\s))\s*")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?")
_RATE = re.compile(
    r"(?:frequency|data ?rate|capture frame rate|sampling[_ ]?(?:rate|frequency)|(?:sample|update|frame)[_ ]?rate)"
    r"[\s,;:=\"]+([\d.]+)",
    re.IGNORECASE,
)
_VICON_RATE = re.compile(r"^\W*(?:Trajectories|Model Outputs|Joints|Segments|Devices)\W*\n\W*([\d.]+)", re.MULTILINE)
_IN_DEGREES = re.compile(r"^\W*in ?degrees\s*[=,;:\t ]\s*(yes|y|true|1)\b", re.IGNORECASE | re.MULTILINE)
_NO_ROTATION = re.compile(r".*_[tvp][xyz](/(value|speed))?|.*(force|torque|moment).*|time", re.IGNORECASE)
_MARKERS = re.compile(r"^MARKER_NAMES[\t,;](.+)$", re.MULTILINE)


@dataclass(frozen=True)
class Layout:
    """How a text holds its table.

    Parameters
    ----------
    delimiter : str
        Between cells; a blank for any white space.
    decimal : str
        Point or comma.
    first : int
        Line of the first row, from 0.
    titles : tuple of str
        Names of the columns, one for each cell of a row; empty where the header has none.
    kinds : str
        For each column ``n`` if it holds numbers, ``l`` lists, ``w`` words, ``e`` nothing yet.
    header : tuple of tuple of str
        The rows of the header, cell by cell; one that comes again is no row.
    units, attributes : mapping of str to str
        What the header says of columns, and of the recording.
    rate : float, optional
        Rows a second, where lines above the table say so.
    stop : int, optional
        Line where another table begins.
    others : tuple of (int, int, int)
        First line, number of rows and of columns of other tables in the part that was looked at.
    various : tuple of int
        Columns of words of which nearly each row has another: no labels, but something that is not understood.
    """

    delimiter: str
    decimal: str
    first: int
    titles: tuple[str, ...]
    kinds: str
    header: tuple[tuple[str, ...], ...]
    units: dict[str, str]
    attributes: dict[str, Any]
    rate: float | None
    stop: int | None
    others: tuple[tuple[int, int, int], ...]
    various: tuple[int, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, all different."""
        return unique_names(title or f"column{at + 1}" for at, title in enumerate(self.titles))


class _Run(NamedTuple):
    """Rows of one kind: the first and last line, their number, kinds of columns, and the length of all numbers."""

    first: int
    last: int
    rows: int
    kinds: str
    weight: float


Rows = Sequence[list[str] | None]
"""Cells of each line; None for a blank line or a comment."""


def is_comment(line: str) -> bool:
    """Whether a line only comments."""
    return _COMMENT.match(line) is not None


def split(line: str, delimiter: str) -> list[str]:
    """The cells of a line without white space around them."""
    if delimiter == " ":
        return [cell.strip('"') for cell in line.split()]
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def number(cell: str, decimal: str = ".") -> float | None:
    """A cell as a number; None if it is a word, NaN if it stands for no number."""
    if cell in NOTHING:
        return float("nan")
    if decimal == ",":
        if not _DECIMAL_COMMA.fullmatch(cell):
            return None
        cell = cell.replace(",", ".")
    try:
        return float(cell.replace("_", "?"))  # float() reads 2019_02_14 as 20190214
    except ValueError:
        return None


def find_layout(lines: Sequence[str]) -> Layout | None:
    """The table that most of the numbers in these lines are in; None if there is no number.

    Parameters
    ----------
    lines : sequence of str
        The beginning of a text, without the ends of the lines.
    """
    best: tuple[float, Layout] | None = None
    for delimiter, decimal in DIALECTS:
        if (delimiter != " " or decimal == ",") and not any(delimiter in line for line in lines):
            continue
        rows = [split(line, delimiter) if line.strip() and not is_comment(line) else None for line in lines]
        rows = [cells if cells and any(cells) else None for cells in rows]  # nothing but delimiters is a blank line
        found = find_block(rows, lines, delimiter, decimal)
        if found is not None and (best is None or found[0] > best[0]):
            best = found
    return best[1] if best else None


def find_block(rows: Rows, lines: Sequence[str], delimiter: str, decimal: str) -> tuple[float, Layout] | None:
    """The heaviest block of rows of one kind, and its weight; None if no number is there or none needs a comma."""
    runs = _runs(rows, decimal)
    if not runs or (decimal == "," and not _has_commas(runs[0], rows)):
        return None
    run, weight = max(((run, _weight(run, rows, decimal)) for run in runs), key=lambda pair: pair[1])
    first = _true_start(rows, run, decimal)
    header = _header(rows, lines, first, run.kinds, delimiter, decimal)
    if not header and _counts(rows[first] or []):
        header = [rows[first] or []]
        first += 1
    kinds = _kinds_below(rows, first, run, decimal)
    above = "\n".join(lines[:first])
    others = tuple(
        (other.first, other.rows, len(other.kinds))
        for other in runs
        if other is not run and other.rows > 4 and other.kinds.count("n") > 1 and len(other.kinds) != len(run.kinds)
    )
    after = [line for line, cells in enumerate(rows) if line > run.last and cells is not None]
    stop = after[0] if after and any(line > run.last for line, _, _ in others) else None
    titles, units = _titles(header, len(run.kinds), above)
    layout = Layout(
        delimiter,
        decimal,
        first,
        titles,
        kinds,
        header=tuple(map(tuple, header)),
        units=_degrees(titles, above) | units,
        attributes=_attributes(rows[:first], header),
        rate=_rate(above),
        stop=stop,
        others=others,
        various=_various(rows[first:], kinds),
    )
    return weight, layout


def _has_commas(run: _Run, rows: Rows) -> bool:
    """Whether a run has several columns, and a comma in a cell of its first row."""
    return len(run.kinds) > 1 and any("," in cell for cell in rows[run.first] or ())


def _runs(rows: Rows, decimal: str) -> list[_Run]:
    """Rows of one width and kind taken together; a run goes on after what interrupts it."""
    runs: list[_Run] = []
    latest: int | None = None
    for line, cells in enumerate(rows):
        if cells is None:
            continue
        kinds = _kinds(cells, decimal)
        weight = sum(map(len, compress(cells, map("nl".__contains__, kinds))))
        latest = _place(runs, kinds, latest)
        if latest is not None:
            run = runs[latest]
            runs[latest] = _Run(run.first, line, run.rows + 1, _merged(run.kinds, kinds) or kinds, run.weight + weight)
        elif weight and len(runs) < MOST_KINDS:
            runs.append(_Run(line, line, 1, kinds, weight))
            latest = len(runs) - 1
    return runs


def _place(runs: Sequence[_Run], kinds: str, latest: int | None) -> int | None:
    """Which run a row of these kinds belongs to: the latest if it can, else the first that can."""
    candidates = [*([] if latest is None else [latest]), *range(len(runs))]
    return next((at for at in candidates if _merged(runs[at].kinds, kinds) is not None), None)


def _merged(one: str, other: str) -> str | None:
    """Kinds of columns that hold both; None if a column would hold numbers and words."""
    if len(one) != len(other):
        return None
    if one == other:
        return one
    pairs = list(zip(one, other, strict=True))
    if any(a != b and "e" not in (a, b) for a, b in pairs):
        return None
    return "".join(b if a == "e" else a for a, b in pairs)


def _kinds(cells: Sequence[str], decimal: str) -> str:
    """Kinds of the cells of a row; parts that are all numbers are known at once."""
    with suppress(ValueError):
        if decimal == "." and "_" not in "".join(cells) and not any(map(math.isnan, map(float, cells))):
            return "n" * len(cells)
    if len(cells) > 16:  # of fewer each is looked at
        middle = len(cells) // 2
        return _kinds(cells[:middle], decimal) + _kinds(cells[middle:], decimal)
    return "".join(_kind(cell, decimal) for cell in cells)


@lru_cache(2**14)  # names are looked at again and again
def _kind(cell: str, decimal: str) -> str:
    if cell in NOTHING:
        return "e"
    if number(cell, decimal) is not None:
        return "n"
    return "l" if LISTS.fullmatch(cell) and read_list(cell) is not None else "w"


def read_list(cell: str) -> list[float] | None:
    """The numbers in a cell that holds a list; None if it holds anything else."""
    values = [number(part) for part in cell.strip("[]() ").replace(",", " ").split()]
    return None if None in values or not values else [value for value in values if value is not None]


def _weight(run: _Run, rows: Rows, decimal: str) -> float:
    above = next((cells for cells in reversed(rows[: run.first]) if cells is not None), None)
    named = above is not None and fitted(above, run.kinds) is not None and _is_words(above, decimal)
    return run.weight * (HEADER_COUNTS if named else 1)


def _is_words(cells: Sequence[str], decimal: str) -> bool:
    kinds = set(_kinds([cell for cell in cells if cell], decimal))
    return bool(kinds) and kinds <= {"w", "e"} and "w" in kinds


def _counts(cells: Sequence[str]) -> bool:
    """Whether a row numbers the columns, as a table without names is written by pandas: ``0,1,2``."""
    numbers = cells[1:] if cells and not cells[0] else cells
    return len(numbers) > 2 and numbers == [str(number) for number in range(len(numbers))]


def fitted(cells: list[str], kinds: str, *, pad: bool = False) -> list[str] | None:
    """Cells as many as columns, as a delimiter may stand at the end of a row or not; None if they are for others."""
    extra = len(cells) - len(kinds)
    if extra > 0:
        return None if any(cells[len(kinds) :]) else cells[: len(kinds)]
    if extra < 0 and not (pad or set(kinds[extra:]) == {"e"}):
        return None
    return cells + [""] * -extra


def _true_start(rows: Rows, run: _Run, decimal: str) -> int:
    """The first row below the names: a row with a word where numbers should be is a bad row, not a header."""
    start = first = _below_names(rows, run, decimal)
    for line in range(first - 1, -1, -1):
        cells = rows[line]
        if cells is None:
            continue
        if fitted(cells, run.kinds) is None:
            break
        if _is_words(cells, decimal):
            return start
        start = line
    return first


def _below_names(rows: Rows, run: _Run, decimal: str) -> int:
    """The first row of a run that is not itself above the names, as a row of numbers of markers is."""
    lines = [line for line in range(run.first, min(run.first + 8, len(rows))) if rows[line] is not None]
    names = [at for at in lines if len(rows[at] or ()) == len(run.kinds) and _is_words(rows[at] or (), decimal)]
    below = [line for line in lines if not names or line > names[-1]]
    return below[0] if below and len(lines) - len(below) < 5 else run.first


def _kinds_below(rows: Rows, first: int, run: _Run, decimal: str) -> str:
    """Kinds of the columns of all rows of the right width: a column that holds any number is one of numbers."""
    order = "ewln"
    kinds = run.kinds
    for cells in rows[first:]:
        if cells is not None and len(cells) == len(kinds):
            here = _kinds(cells, decimal)
            if here != kinds:
                kinds = "".join(max(pair, key=order.index) for pair in zip(kinds, here, strict=True))
    return kinds


def _various(rows: Rows, kinds: str) -> tuple[int, ...]:
    table = [cells for cells in rows if cells is not None and len(cells) == len(kinds)]
    places = (at for at, kind in enumerate(kinds) if kind == "w")
    return tuple(at for at in places if len({cells[at] for cells in table}) > max(len(table) // 2, 2))


def _header(rows: Rows, lines: Sequence[str], first: int, kinds: str, delimiter: str, decimal: str) -> list[list[str]]:
    """Rows of the header, from the top: the nearest above the block, and those directly above it that go with it."""
    above = [line for line in range(first) if rows[line] is not None]
    nearest = _nearest(rows[above[-1]] or [], rows[first] or [], kinds) if above else None
    if nearest is not None and _may_name(nearest, decimal):
        directly = [rows[line] or [] for line in range(above[-1] - 1, -1, -1)] if len(kinds) > 1 else []
        needed = "" in nearest[: len(kinds.rstrip("e"))]
        higher = takewhile(lambda cells: _goes_above(cells, len(kinds), decimal, needed), directly)
        return [*reversed([fitted(cells, kinds, pad=True) or cells for cells in higher]), nearest]
    comments = (line for line in reversed(lines[:first]) if is_comment(line))
    named = (split(_MARK.sub("", line), delimiter) for line in comments)
    return [cells for cells in named if len(cells) == len(kinds) and _is_words(cells, decimal)][:1]


def _nearest(cells: list[str], below: list[str], kinds: str) -> list[str] | None:
    """Cells as many as columns; R leaves out the name of the numbers of rows, which it writes first."""
    if len(cells) == len(kinds) - 1 and all(cells) and below[0] in ("0", "1"):
        return ["", *cells]
    return fitted(cells, kinds)


def _may_name(cells: Sequence[str], decimal: str) -> bool:
    """Whether a row may name the columns: words, or whole numbers beside words."""
    here = [_kind(cell, decimal) for cell in cells]
    numbers = [cell for cell, kind in zip(cells, here, strict=True) if kind == "n"]
    return "w" in here and all(cell.isdecimal() for cell in numbers)


def _goes_above(cells: Sequence[str], width: int, decimal: str, needed: bool) -> bool:
    """Whether a row is part of the header below it: words for each column, or what stands over some columns each."""
    last = max((at for at, cell in enumerate(cells) if cell), default=width)
    if last >= width or not (not cells[0] or _is_words(cells, decimal)):
        return False
    return last == width - 1 or "" in cells[:last] or (needed and len(cells) >= width)


def _titles(header: Sequence[list[str]], width: int, above: str) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names of the columns, joined from all rows, and their units."""
    if not header:
        markers = _MARKERS.search(above)
        names = markers[1].split("\t") if markers else []
        titles = tuple(f"{name.strip()}.{axis}" for name in names for axis in "XYZ")
        return titles if len(titles) == width else ("",) * width, {}
    rows = [list(row) for row in header]
    unit_row = next(
        (row for row in reversed(rows[1:]) if all(_UNIT_WORD.fullmatch(cell) for cell in row if cell)), None
    )
    rows = [row for row in rows if row is not unit_row]
    parts = [*(_spread(row, rows[-1]) for row in rows[:-1]), rows[-1]]
    titles = tuple(".".join(filter(None, column)) for column in zip(*parts, strict=True))
    units = {name: unit.strip("[]()") for name, unit in zip(unique_names(titles), unit_row or (), strict=False) if unit}
    in_names = {name: found[1] for name in titles if (found := _UNIT_IN_NAME.search(name))}
    return titles, {**{name: unit for name, unit in in_names.items() if _UNIT_WORD.fullmatch(unit)}, **units}


def _degrees(titles: Sequence[str], above: str) -> dict[str, str]:
    """Units of coordinates as OpenSim tells them: ``inDegrees=yes`` but for time, forces and translations (``_tx``)."""
    turning = titles if _IN_DEGREES.search(above) else ()
    return {name: "deg" for name in turning if name and not _NO_ROTATION.fullmatch(name)}


def _spread(row: Sequence[str], below: Sequence[str]) -> list[str]:
    """A row of the header with each name over all the columns that it stands for."""
    spread, latest = [], ""
    for cell, under in zip(row, below, strict=True):
        latest = cell or latest
        spread.append(latest if cell or under else "")
    return spread


def _attributes(rows: Rows, header: Sequence[list[str]]) -> dict[str, Any]:
    """What lines of a name and a value above the table say."""
    lines = [
        cells for cells in rows if cells is not None and len(cells) % 2 == 0 and all(cells) and cells not in header
    ]
    pairs = [pair for cells in lines for pair in zip(cells[::2], cells[1::2], strict=True)]
    return {name.rstrip(":="): value for name, value in pairs[:MOST_KINDS]}


def _rate(above: str) -> float | None:
    found = _RATE.findall(above) or _VICON_RATE.findall(above)
    try:
        return float(found[-1]) if found else None
    except ValueError:
        return None

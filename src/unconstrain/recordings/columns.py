"""Which columns are meant by names, patterns and ranges as a person gives them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from ..base.display import bare

_RANGE = re.compile(r"(.*?)(\d+)\.\.(?:\1)?(\d+)")
SHORT = {"states": "x", "actions": "u"}
"""What columns of arrays of these names are called, where both are there: x1..xn and u1..ud."""


def resolve(asked: Sequence[str], columns: Sequence[str]) -> tuple[str, ...]:
    """Columns that names mean, in order; a name that means none stays.

    A name is a column itself, with or without its unit (``x`` for ``x [m]``), a pattern (``joint_?``), a range
    (``q1..q7``), the stem of numbered columns (``observation.state``), or the last part of one column (``X`` of
    ``hand.X``).
    """
    if set(columns).issuperset(asked):
        return tuple(dict.fromkeys(asked))
    named = _named(columns)
    found = (name for each in asked for name in _meant(each, columns, named) or (each,))
    return tuple(dict.fromkeys(found))


def _meant(name: str, columns: Sequence[str], named: Mapping[str, str]) -> tuple[str, ...]:
    if name in named:
        return (named[name],)
    if found := _RANGE.fullmatch(name):
        numbers = range(int(found[2]), min(int(found[3]), 10_000) + 1)
        return tuple(named.get(each, each) for each in (f"{found[1]}{number}" for number in numbers))
    if ".." in name:
        ends = [columns.index(named[end]) if end in named else None for end in name.split("..", 1)]
        if None not in ends:
            return tuple(columns[ends[0] : (ends[1] or 0) + 1])
    if any(mark in name for mark in "*?["):
        return tuple(column for column in columns if fnmatchcase(column, name))
    numbered = re.compile(rf"({re.escape(name)}|{SHORT.get(name, '(?!)')})([_. \[]?\d+\]?|\..+)")
    of_stem = tuple(column for column in columns if numbered.fullmatch(column))
    ending = tuple(column for column in columns if re.search(rf"[._/ ]{re.escape(name)}$", column))
    return of_stem or (ending if len(ending) == 1 else ())


def _named(columns: Sequence[str]) -> dict[str, str]:
    """Columns by their names, and by those without their unit where no other has it."""
    plain = [*map(bare, columns)]
    count = Counter(plain)
    alone = {name: column for name, column in zip(plain, columns, strict=True) if count[name] == 1}
    return alone | {column: column for column in columns}

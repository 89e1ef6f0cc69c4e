"""What every file format ends as: named columns, split into recordings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from unconstrain.arrays import Array
from unconstrain.demonstration import Recording

__all__ = ["Format", "ReadFile", "seconds", "split_by_group", "unique_names"]

CLOCKS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Above these magnitudes a stamp counts nano-, micro- or milliseconds since 1970; the length of one in seconds."""

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_UNIT_IN_NAME = re.compile(r"[_ \[(](s|ms|us|ns)[\])]?$", re.IGNORECASE)


class ReadFile(Protocol):
    """What a format must be able to do."""

    def __call__(self, path: Path, *, group: str | None = None, time: str | None = None) -> list[Recording]:
        """Read one file into its recordings."""


class Format(NamedTuple):
    """A file format: how to know it, and how to read it.

    ``suffixes`` in small letters with the dot; ``recognises`` looks at the
    first bytes of a file whose suffix says nothing.
    """

    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    read: ReadFile


def seconds(stamps: Array, name: str) -> Array:
    """Time stamps in seconds.

    Stamps that count nano-, micro- or milliseconds since 1970, as loggers
    write them, become seconds from the first stamp. Otherwise a unit at the
    end of the name (``t_ms``, ``time[ns]``) decides; without one they are seconds.

    Parameters
    ----------
    stamps : ndarray, shape (T,)
        May hold NaN.
    name : str
        Name of the column.

    Returns
    -------
    ndarray, shape (T,)
    """
    known = stamps[np.isfinite(stamps)]
    if not known.size:
        return stamps
    for magnitude, unit in CLOCKS:
        if np.median(known) > magnitude:
            return (stamps - known[0]) * unit
    in_name = _UNIT_IN_NAME.search(name)
    return stamps * UNITS[in_name[1].lower()] if in_name else stamps


def split_by_group(
    columns: Sequence[str], values: Array, times: Array | None, groups: Sequence[str] | None, name: str
) -> list[Recording]:
    """One recording for each group, in the order of first appearance.

    Parameters
    ----------
    columns : sequence of str
    values : ndarray, shape (T, c)
    times : ndarray, shape (T,), optional
    groups : sequence of str, length T, optional
        Without it all rows are one recording, called ``name``; with it each is called as its group.
    name : str
    """
    if groups is None:
        return [Recording(tuple(columns), values, times, name)]
    codes = {text: code for code, text in enumerate(dict.fromkeys(groups))}
    code_of_row = np.fromiter((codes[text] for text in groups), dtype=np.intp, count=len(groups))
    order = np.argsort(code_of_row, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(code_of_row))[:-1])
    return [
        Recording(tuple(columns), values[rows], None if times is None else times[rows], text)
        for text, rows in zip(codes, parts, strict=True)
    ]


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Make names differ: the second ``x`` becomes ``x.1``, the third ``x.2``."""
    names = tuple(names)
    taken, next_number, unique = set(names), dict.fromkeys(names, 0), []
    for name in names:
        fresh = name
        while next_number[name] and fresh in taken:
            fresh = f"{name}.{next_number[name]}"
            next_number[name] += 1
        next_number[name] = next_number[name] or 1
        taken.add(fresh)
        unique.append(fresh)
    return tuple(unique)

"""What every file format ends as: named columns, split into recordings."""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from ...base.arrays import Array
from ...base.errors import ReadError
from ..demonstration import Recording

CLOCKS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Above these magnitudes a stamp counts nano-, micro- or milliseconds since 1970; the length of one in seconds."""

GROUP_NAMES = ("demo", "demonstration", "trial", "bout", "group", "episode", "episode_index", "run")
"""A column of one of these names, in any case, tells the demonstrations apart."""

TIME_NAME = re.compile(r"(t|times?|timestamps?|stamps?|rosbagtimestamp)([_ \[(]?(s|ms|us|ns)[\])]?)?", re.IGNORECASE)
"""A column of such a name holds the time stamps: ``t``, ``Time``, ``timestamp``, ``time_s``, ``t[ms]``, ..."""

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_UNIT_IN_NAME = re.compile(r"[_ \[(](s|ms|us|ns)[\])]?$", re.IGNORECASE)


class ReadFile(Protocol):
    """What a format must be able to do."""

    def __call__(self, path: Path, *, group: str | None, time: str | None) -> Iterable[Recording]:
        """Read one file into its recordings; of blocks, those that are called the same are one recording.

        Parameters
        ----------
        path : Path
        group, time : str, optional
            Columns (or arrays) that tell the demonstrations apart and hold the time stamps, where their names do not
            say so. Without groups the file is one demonstration, called as the file.

        Raises
        ------
        MissingExtraError
            If the library that reads this format is not installed.
        ReadError
            If it is no such file, or holds no numbers; the message names the file.
        """


class Format(NamedTuple):
    """A file format: how to know it, and how to read it.

    ``suffixes`` in small letters with the dot; ``recognises`` looks at the first bytes of a file whose suffix says
    nothing; ``read`` reads it whole, ``blocks``, if given, by no more than :data:`~unconstrain.base.arrays.BLOCK_ROWS`
    rows at a time.
    """

    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    read: ReadFile
    blocks: ReadFile | None = None


def find_roles(names: Sequence[str], group: str | None, time: str | None, path: Path) -> tuple[int | None, int | None]:
    """Where the columns are that name the demonstration and hold the time: as told, else by their names.

    Raises
    ------
    ReadError
        If a column that was told does not exist.
    """
    group_at = _find(names, group, "group", {at for at, name in enumerate(names) if name.lower() in GROUP_NAMES}, path)
    stamped = {at for at, name in enumerate(names) if TIME_NAME.fullmatch(name) and at != group_at}
    return group_at, _find(names, time, "time", stamped, path)


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


def _find(names: Sequence[str], wanted: str | None, role: str, fitting: set[int], path: Path) -> int | None:
    """Where a column is: by its name, or the first of those that fit."""
    if wanted is None:
        return min(fitting, default=None)
    if wanted not in names:
        raise ReadError(f"{path}: no column {wanted!r} for {role}; it has {listed(names)}.")
    return names.index(wanted)


def listed(names: Sequence[str]) -> str:
    """Names with commas between, the first thirty."""
    more = f" and {len(names) - 30} more" if len(names) > 30 else ""
    return ", ".join(names[:30]) + more

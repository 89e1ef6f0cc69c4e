"""HDF5 files: each group that holds data sets of one length is a recording.

A data set of one dimension is a column of its name. One of two dimensions is
as many columns, numbered from 1: ``states`` as x1..xn, ``actions`` as u1..ud,
``position`` as position1..positionN. Data sets directly in the file make one
recording, called as the file, which a data set of names or numbers
(``groups``, ``demo``, ``trial``, ...) may split.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import BLOCK_ROWS, Array, require_extra
from ...base.errors import ReadError
from ..demonstration import Recording
from .table import Format, find_roles, listed, seconds, split_by_group

_SHORT = {"states": "x", "actions": "u"}
_ROLES = {"groups": "group", "times": "time"}


def read_hdf5(path: Path, group: str | None, time: str | None, rows: int | None = None) -> Iterator[Recording]:
    """Read one file, whole or by so many rows at a time; see :class:`~.table.ReadFile`."""
    h5py = require_extra("h5py", "data")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise ReadError(f"{path}: cannot be read ({str(error).splitlines()[0]}). Expected an HDF5 file.") from error
    with file:
        found = [(node, sets) for node in _groups_in(file, h5py) if (sets := _data_sets(node, h5py))]
        if not found:
            raise ReadError(f"{path}: no data sets of numbers in one or two dimensions, expected some of one length.")
        for node, sets in found:
            yield from _of_group(sets, node.name.strip("/") or path.stem, path, group, time, rows)


def _groups_in(node: Any, h5py: Any) -> Iterator[Any]:
    """A group and all below it, in the order of their names."""
    yield node
    for child in node.values():
        if isinstance(child, h5py.Group):
            yield from _groups_in(child, h5py)


def _data_sets(node: Any, h5py: Any) -> dict[str, Any]:
    """What may be columns: numbers in one or two dimensions, and words in one."""
    sets = {name: child for name, child in node.items() if isinstance(child, h5py.Dataset) and child.ndim in (1, 2)}
    numbers = {name for name, child in sets.items() if child.dtype.kind in "fiub"}
    return {name: child for name, child in sets.items() if name in numbers or child.ndim == 1} if numbers else {}


def _of_group(
    sets: dict[str, Any], name: str, path: Path, group: str | None, time: str | None, rows: int | None
) -> Iterator[Recording]:
    lengths = {title: len(child) for title, child in sets.items()}
    if len(set(lengths.values())) > 1:
        said = listed([f"{title} ({length})" for title, length in lengths.items()])
        raise ReadError(f"{path}, group '{name}': data sets of different lengths, {said}; expected one length.")
    flat = [title for title, child in sets.items() if child.ndim == 1]
    known = [title if title in (group, time) else _ROLES.get(title, title) for title in flat]
    group_at, time_at = find_roles(known, group, time, path)
    label, clock = (None if at is None else flat[at] for at in (group_at, time_at))
    length = next(iter(lengths.values()))
    for start in range(0, length, rows or max(length, 1)):
        part = slice(start, start + rows if rows else length)
        columns: dict[str, Array] = {}
        for title, child in sets.items():
            if title not in (label, clock) and child.dtype.kind in "fiub":
                columns |= _columns(title, child[part].astype(np.float64))
        if not columns:
            raise ReadError(f"{path}, group '{name}': no column of numbers; it has {listed(list(sets))}.")
        times = None if clock is None else seconds(sets[clock][part].astype(np.float64), clock)
        names = None if label is None else [_text(value) for value in sets[label][part].tolist()]
        yield from split_by_group(list(columns), np.column_stack(list(columns.values())), times, names, name)


def _columns(title: str, values: Array) -> dict[str, Array]:
    if values.ndim == 1:
        return {title: values}
    return {f"{_SHORT.get(title, title)}{place + 1}": column for place, column in enumerate(values.T)}


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def read_hdf5_blocks(path: Path, group: str | None, time: str | None) -> Iterator[Recording]:
    """Go through one file by some rows at a time."""
    return read_hdf5(path, group, time, BLOCK_ROWS)


FORMAT = Format((".h5", ".hdf5"), lambda head: head.startswith(b"\x89HDF\r\n\x1a\n"), read_hdf5, read_hdf5_blocks)

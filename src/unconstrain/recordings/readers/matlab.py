"""MATLAB files: versions 5 to 7 (:mod:`~.mat5`), and 7.3 by h5py. Cells and arrays of structs are demonstrations.

The LASA handwriting data is such a file: a cell of structs with ``t`` (1, T), ``pos`` (2, T) and ``vel`` (2, T).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import require_extra
from ...base.foreign import ours_alone
from .apart import apart
from .mat5 import read_mat5
from .reading import Reading
from .table import Format, Table
from .trees import Branch, tables_of

EXPECTED = "a MATLAB file, as from save"

DEEPEST = 32
"""Structs within structs, beyond which a file is damaged."""

LARGEST_CELL = 100_000
"""More members than any cell of demonstrations has."""


def read_matlab(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one file; see :class:`~.table.ReadFile`."""
    if _is_hdf5(path):
        return apart(_read_hdf5, path, reading)
    return _tables({name: _plain(value) for name, value in read_mat5(path.read_bytes()).items()}, path, reading)


def _tables(contents: Mapping[str, Any], path: Path, reading: Reading) -> Iterator[Table]:
    return tables_of(Branch(contents, path.stem, is_short=False), path, reading)


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(520)
    return b"\x89HDF" in (head[:4], head[512:516])


def _plain(value: Any) -> Any:
    """A variable without the wrapping: one struct is no array of structs, and a vector that lies is a vector."""
    if isinstance(value, dict):
        return {name: _plain(member) for name, member in value.items()}
    if isinstance(value, list):
        members = [_plain(member) for member in value[:LARGEST_CELL] if member is not None]
        return members[0] if len(members) == 1 else members
    return _flat(value) if isinstance(value, np.ndarray) else value


def _flat(value: Any) -> Any:
    """A vector that lies or stands, as one."""
    return value.reshape(-1) if value.ndim == 2 and 1 in value.shape else value


def _read_hdf5(place: Path, path: Path, reading: Reading) -> Iterator[Table]:
    h5py = require_extra("h5py", "data")
    with ours_alone(path, EXPECTED):
        with h5py.File(place, "r") as file:
            contents = {name: _of_node(child, file, h5py) for name, child in file.items() if not name.startswith("#")}
        yield from _tables(contents, path, reading)


def _of_node(node: Any, file: Any, h5py: Any, depth: int = 0) -> Any:
    """A variable of version 7.3: groups are structs, references are cells, and arrays lie the other way round."""
    if depth > DEEPEST:
        raise ValueError("its structs are nested too deep")
    if not isinstance(node, h5py.Dataset):
        return _structs({name: _of_node(child, file, h5py, depth + 1) for name, child in node.items()})
    if node.dtype.kind == "O":
        references = np.asarray(node).T.reshape(-1)[:LARGEST_CELL]
        members = [_of_node(file[reference], file, h5py, depth + 1) for reference in references if reference]
        return members[0] if len(members) == 1 else members
    if node.attrs.get("MATLAB_class", b"") == b"char":
        return "".join(map(chr, np.asarray(node).reshape(-1).tolist()))
    return _flat(np.asarray(node).T)


def _structs(fields: dict[str, Any]) -> Any:
    """A struct, or several where each field holds as many members."""
    lengths = {len(member) if isinstance(member, list) else 0 for member in fields.values()}
    if len(lengths) != 1 or lengths == {0}:
        return fields
    return [dict(zip(fields, members, strict=True)) for members in zip(*fields.values(), strict=True)]


FORMAT = Format((".mat",), lambda head: head.startswith(b"MATLAB "), read_matlab, expected=EXPECTED)

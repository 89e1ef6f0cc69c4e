"""NumPy's files: one array (``.npy``), or several (``.npz``). Nothing in them is ever unpickled.

An archive of ``states`` (N, n), ``actions`` (N, d), and if known ``times`` (N,) and ``groups`` (N,) has the columns
x1..xn and u1..ud. Other arrays are read as :mod:`~.trees` says.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import BLOCK_ROWS
from ...base.errors import ReadError
from .reading import Reading
from .table import Format, Table, ours_alone
from .trees import UNNAMED, Branch, tables_of

_EXPECTED = "Expected a NumPy archive, as from numpy.savez(path, states=..., actions=..., times=..., groups=...)"
_ROLES = {"groups": "group"}


def read_npz(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one archive; see :class:`~.table.ReadFile`. Errors say what is in there."""
    contents = _load(path)
    if "header" in contents and "array0" in contents:
        raise ReadError(f"{path}: is a policy that was saved, not recordings to learn from.")
    asked = (reading.group, reading.time)
    if {"states", "actions"} <= set(contents):
        _check_pairs(path, contents, {"times", "groups", *filter(None, asked)})
    named = {name if name in asked else _ROLES.get(name, name): array for name, array in contents.items()}
    try:
        yield from tables_of(Branch(named, path.stem), path, reading.columns)
    except ReadError as error:
        raise ReadError(f"{path}: {str(error).removeprefix(f'{path}: ')} {_EXPECTED}.") from error


def read_npy(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one array."""
    return _npy(path, reading, None)


def read_npy_blocks(path: Path, reading: Reading) -> Iterator[Table]:
    """Go through one array by some rows at a time."""
    return _npy(path, reading, BLOCK_ROWS)


def _npy(path: Path, reading: Reading, rows: int | None) -> Iterator[Table]:
    array = _array(path)
    fields = array.dtype.names
    members = {UNNAMED: array} if fields is None else {name: array[name] for name in fields}
    yield from tables_of(Branch(members, path.stem), path, reading.columns, rows)


def _array(path: Path) -> Any:
    with ours_alone(path, "an array, as from numpy.save"), _nothing_unpickled(path):
        return np.load(path, mmap_mode="r", allow_pickle=False)


def _load(path: Path) -> dict[str, Any]:
    expected = _EXPECTED.removeprefix("Expected ")
    # Opened here, since numpy leaves a damaged file open.
    with (
        ours_alone(path, expected),
        _nothing_unpickled(path),
        path.open("rb") as stream,
        np.load(stream, allow_pickle=False) as archive,
    ):
        return {key: archive[key] for key in archive.files}


@contextmanager
def _nothing_unpickled(path: Path) -> Iterator[None]:
    """What would have to be unpickled is refused with the way on."""
    try:
        yield
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise ReadError(
            f"{path}: cannot be read: it holds Python objects, which would run code when unpickled. Save arrays of "
            "numbers instead, one for each demonstration, such as numpy.savez(path, demo_1=..., demo_2=...)."
        ) from error


def _check_pairs(path: Path, contents: Mapping[str, Any], single: set[str]) -> None:
    """States and actions make the columns; times and groups have a number or a word for each row."""
    for key in ("states", "actions"):
        array = contents[key]
        if array.dtype.kind not in "fiub" or array.ndim != 2 or not array.size:
            raise ReadError(
                f"{path}: {key} is {array.dtype} of shape {array.shape}, "
                "expected real numbers in 2 dimensions, not empty."
            )
    for key in single & set(contents):
        array = contents[key]
        if array.dtype.kind not in "iubfU" or array.ndim != 1:
            raise ReadError(f"{path}: {key} is {array.dtype} of shape {array.shape}, expected one for each sample.")
    rows = len(contents["states"])
    for key in ("actions", *(single & set(contents))):
        if len(contents[key]) != rows:
            raise ReadError(f"{path}: {rows} rows of states, but {len(contents[key])} of {key}; expected as many.")


def _is_archive(head: bytes) -> bool:
    return head.startswith(b"PK\x03\x04") and b".npy" in head[:512]


FORMAT = Format((".npz",), _is_archive, read_npz)
ARRAY = Format((".npy",), lambda head: head.startswith(b"\x93NUMPY"), read_npy, read_npy_blocks)

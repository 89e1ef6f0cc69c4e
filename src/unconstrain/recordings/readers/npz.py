"""NumPy's files: one array (``.npy``), or several (``.npz``). Nothing in them is ever unpickled.

An archive of ``states`` (N, n), ``actions`` (N, d), and if known ``times`` (N,) and ``groups`` (N,) has the columns
x1..xn and u1..ud. Other arrays are read as :mod:`~.trees` says, and so are those of R demonstrations, (R, T, n).
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import BLOCK_ROWS
from ...base.display import listed
from ...base.errors import ReadError
from ...base.foreign import check_size
from .reading import Reading
from .table import Format, Table
from .trees import UNNAMED, Branch, tables_of

_EXPECTED = "Expected a NumPy archive, as from numpy.savez(path, states=..., actions=..., times=..., groups=...)"
_ROLES = {"groups": "group"}


def read_npz(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one archive; see :class:`~.table.ReadFile`. Errors say what is in there."""
    contents = _load(path)
    if "header" in contents and "array0" in contents:
        raise ReadError(f"{path}: is a policy that was saved, not recordings to learn from.")
    asked, pair = (reading.group, reading.time), {"states", "actions"}
    if pair <= set(contents) and any(contents[name].ndim != 3 for name in pair):
        _check_pairs(path, contents, {"times", "groups", *filter(None, asked)})
    named = {name if name in asked else _ROLES.get(name, name): array for name, array in contents.items()}
    try:
        yield from tables_of(Branch(named, path.stem), path, reading)
    except ReadError as error:
        raise ReadError(f"{path}: {str(error).removeprefix(f'{path}: ')} {_EXPECTED}.") from error


def read_npy(path: Path, reading: Reading) -> Iterator[Table]:
    """Go through one array by some rows at a time."""
    array: Any = OnDisk(path)
    if not array.is_by_rows:
        with _nothing_unpickled(path):
            array = np.load(path, allow_pickle=False)
    fields = array.dtype.names
    members = {UNNAMED: array} if fields is None else {name: array[name] for name in fields}
    yield from tables_of(Branch(members, path.stem), path, reading, BLOCK_ROWS)


class OnDisk:
    """An array whose rows are read when asked for; mapped into memory, a file that shrinks would end Python."""

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            version = np.lib.format.read_magic(file)
            read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            self.shape, fortran, self.dtype = read(file)
            self._start = file.tell()
        self.path, self.ndim, self.size = path, len(self.shape), math.prod(self.shape)
        self.is_by_rows = self.ndim == 2 and not fortran and self.shape[0] > self.shape[1] and not self.dtype.hasobject
        check_size(self.size * self.dtype.itemsize // 8, path.stat().st_size)

    def __getitem__(self, rows: slice) -> Any:
        """Some rows.

        Raises
        ------
        ValueError
            If the file ends before.
        """
        start, stop, _ = rows.indices(self.shape[0])
        width = self.shape[1] * self.dtype.itemsize
        with self.path.open("rb") as file:
            file.seek(self._start + start * width)
            data = file.read((stop - start) * width)
        return np.frombuffer(data, self.dtype).reshape(stop - start, self.shape[1])


def _load(path: Path) -> dict[str, Any]:
    # Opened here, since numpy leaves a damaged file open.
    with _nothing_unpickled(path), path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        held = archive.zip.infolist()
        check_size(sum(one.file_size for one in held) // 8, sum(one.compress_size for one in held))
        contents = {key: archive[key] for key in archive.files}
    strange = [key for key, array in contents.items() if not isinstance(array, np.ndarray)]
    if strange:
        raise ReadError(f"{path}: {listed(strange)} in it: no array, as numpy.savez writes them.")
    return contents


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


FORMAT = Format((".npz",), _is_archive, read_npz, expected=_EXPECTED.removeprefix("Expected "))
ARRAY = Format(
    (".npy",),
    lambda head: head.startswith(b"\x93NUMPY"),
    read_npy,
    in_blocks=True,
    expected="an array, as from numpy.save",
)

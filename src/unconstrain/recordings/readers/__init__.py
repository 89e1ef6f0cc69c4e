"""From files to recordings; one module for each format.

A new format is one module with a :class:`~unconstrain.recordings.readers.table.Format`, listed in :data:`FORMATS`.
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from glob import glob
from pathlib import Path

from ...base.errors import ReadError, SettingError
from ..demonstration import Recording
from . import hdf5, npz, parquet, text
from .table import Format, unique_names

__all__ = ["expand", "read", "read_blocks", "unique_names"]

FORMATS = (npz.FORMAT, parquet.FORMAT, hdf5.FORMAT, text.FORMAT)

PathLike = str | os.PathLike[str]


def read(paths: PathLike | Iterable[PathLike], *, group: str | None = None, time: str | None = None) -> list[Recording]:
    """Read recordings from one file or several.

    Parameters
    ----------
    paths : path or iterable of paths
        CSV, TSV or semicolon-separated text, NumPy archives, Parquet or HDF5
        (extra ``data``); told apart by suffix, else by content. A folder
        stands for the Parquet files in it, and a pattern such as ``wipe_*.csv`` for what it matches.
    group : str, optional
        Column that tells the demonstrations apart. Without it, and without a column that
        is called like one (``demo``, ``trial``, ``bout``, ...), each file is one demonstration.
    time : str, optional
        Column of time stamps; by default one called like it (``t``, ``time``, ``timestamp``, ...).

    Returns
    -------
    list of Recording
        In the order of the files and of first appearance; of equal names the second becomes ``name.1``.

    Raises
    ------
    ReadError
        If a file cannot be read; the message names the file, and where known the line and the column.
    SettingError
        If there is no path, or one column is to be both group and time.
    """
    recordings = [
        recording for path in expand(paths) for recording in read_blocks(path, group=group, time=time, whole=True)
    ]
    names = unique_names(recording.name for recording in recordings)
    return [replace(recording, name=name) for recording, name in zip(recordings, names, strict=True)]


def read_blocks(
    path: PathLike, *, group: str | None = None, time: str | None = None, whole: bool = False
) -> Iterator[Recording]:
    """Read one file recording by recording, and larger ones by some rows at a time where the format can.

    Blocks of one recording have one name. Parameters and errors as in :func:`read`; with ``whole``
    each recording comes in one piece.
    """
    if group is not None and group == time:
        raise SettingError(f"got {group!r} for both group and time, expected two different columns.")
    file = Path(path)
    known = _format(file)
    read = known.read if whole or known.blocks is None else known.blocks
    yield from read(file, group=group, time=time)


def expand(paths: PathLike | Iterable[PathLike]) -> list[Path]:
    """Files to read, in the order of their names where a folder or a pattern stands for several.

    Raises
    ------
    SettingError
        If there is none.
    """
    listed = [Path(path) for path in ([paths] if isinstance(paths, (str, os.PathLike)) else paths)]
    matched = [match for path in listed for match in (_matches(path) if not path.exists() else []) or [path]]
    files = [file for path in matched for file in (sorted(path.rglob("*.parquet")) if path.is_dir() else []) or [path]]
    if not files:
        raise SettingError("got no file to read, expected at least one path.")
    return files


def _matches(pattern: Path) -> list[Path]:
    # A pattern may be absolute, which Path.glob refuses.
    return [Path(match) for match in sorted(glob(str(pattern)))]  # noqa: PTH207


def _format(path: Path) -> Format:
    if not path.is_file():
        raise ReadError(f"{path}: {'a folder' if path.is_dir() else 'no such file'}, expected the path of a file.")
    for known in FORMATS:
        if path.suffix.lower() in known.suffixes:
            return known
    head = _head(path)
    for known in FORMATS:
        if known.recognises(head):
            return known
    suffixes = ", ".join(suffix for known in FORMATS for suffix in known.suffixes)
    raise ReadError(f"{path}: neither its suffix nor its content is of a known format. Supported are {suffixes}.")


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4096)
    except OSError as error:
        raise ReadError(f"{path}: could not be read ({error.strerror}).") from error

"""From files to recordings; one module for each format.

A new format is one module with a :class:`~unconstrain.readers.table.Format`, listed in :data:`FORMATS`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from unconstrain.demonstration import Recording
from unconstrain.errors import ReadError, SettingError

from . import npz, text
from .table import ReadFile, unique_names

__all__ = ["FORMATS", "read"]

FORMATS = (npz.FORMAT, text.FORMAT)

PathLike = str | os.PathLike[str]


def read(paths: PathLike | Iterable[PathLike], *, group: str | None = None, time: str | None = None) -> list[Recording]:
    """Read recordings from one file or several.

    Parameters
    ----------
    paths : path or iterable of paths
        CSV, TSV or semicolon-separated text, or NumPy archives; told apart by
        suffix, else by content.
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
    files = [Path(path) for path in ([paths] if isinstance(paths, (str, os.PathLike)) else paths)]
    if not files:
        raise SettingError("got no file to read, expected at least one path.")
    if group is not None and group == time:
        raise SettingError(f"got {group!r} for both group and time, expected two different columns.")
    recordings = [recording for path in files for recording in _reader(path)(path, group=group, time=time)]
    names = unique_names(recording.name for recording in recordings)
    return [replace(recording, name=name) for recording, name in zip(recordings, names, strict=True)]


def _reader(path: Path) -> ReadFile:
    if not path.is_file():
        raise ReadError(f"{path}: {'a folder' if path.is_dir() else 'no such file'}, expected the path of a file.")
    for known in FORMATS:
        if path.suffix.lower() in known.suffixes:
            return known.read
    head = _head(path)
    for known in FORMATS:
        if known.recognises(head):
            return known.read
    suffixes = ", ".join(suffix for known in FORMATS for suffix in known.suffixes)
    raise ReadError(f"{path}: neither its suffix nor its content is of a known format. Supported are {suffixes}.")


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4096)
    except OSError as error:
        raise ReadError(f"{path}: could not be read ({error.strerror}).") from error

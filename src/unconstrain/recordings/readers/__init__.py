"""From files to recordings; one module for each format.

A new format is one module with a :class:`~unconstrain.recordings.readers.table.Format`, listed in
:data:`~unconstrain.recordings.readers.formats.FORMATS`.

Examples
--------
>>> np.savetxt("wipe_1.csv", np.eye(2), delimiter=",", header="x,y", comments="")
>>> [str(path) for path in uc.readers.expand(["wipe_*.csv"])]
['wipe_1.csv']
"""

import os
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from glob import glob
from math import inf
from pathlib import Path
from typing import Any

from ...base.display import listed, meant
from ...base.errors import NOTHING_LEFT, ReadError, SettingError
from ...base.foreign import ours_alone, unchanged
from ..demonstration import Recording
from . import blocks
from .folders import files_in
from .formats import format_of
from .reading import Reading
from .table import Assembly, unique_names

__all__ = ["Reading", "check_left_out", "expand", "read", "read_blocks", "unique_names"]

PathLike = str | os.PathLike[str]


def read(
    paths: PathLike | Iterable[PathLike],
    *,
    group: str | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    columns: Sequence[str] | None = None,
    topic: str | None = None,
    episodes: Sequence[str] | None = None,
    task: str | None = None,
) -> list[Recording]:
    """Read recordings from one file or several.

    Parameters
    ----------
    paths : path or iterable of paths
        Text, NumPy archives, MATLAB, Parquet, HDF5, LeRobot, JSON, Excel, ROS, C3D (:doc:`/your_own_data`);
        told apart by content and suffix. A folder stands for the files in it, and a pattern such as
        ``wipe_*.csv`` for what it matches.
    group : str, optional
        Column that tells the demonstrations apart. Without it, and without a column that
        is called like one (``demo``, ``trial``, ``bout``, ...), or with ``"none"``, each file is one demonstration.
    time : str, optional
        Column of time stamps; by default one called like it (``t``, ``time``, ``timestamp``, ...).
    time_unit : {"s", "ms", "us", "ns"}, optional
        What the stamps count; by default as the name of their column or their size says.
    columns : sequence of str, optional
        Names of the columns, in order, for files that have none.
    topic : str, optional
        Topic of a ROS recording, or several with commas between; or sheet of a workbook.
    episodes : sequence of str, optional
        Only these demonstrations: names, numbers, ranges such as ``"0-9"``, or a list that the file itself holds.
    task : str, optional
        Only the demonstrations of this task.

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

    Examples
    --------
    >>> np.savetxt("wipe.csv", [[0, 1, 2], [0.1, 3, 4]], delimiter=",", header="t,x,y", comments="")
    >>> [recording] = uc.read("wipe.csv")
    >>> recording.name, recording.columns
    ('wipe', ('x', 'y'))
    """
    told = Reading(group, time, time_unit, columns, topic, episodes, task)
    found = [recording for path in expand(paths) for recording in read_blocks(path, told, whole=True)]
    if not found:
        raise ReadError(NOTHING_LEFT)
    names = unique_names(recording.name for recording in found)
    return [replace(recording, name=name) for recording, name in zip(found, names, strict=True)]


def read_blocks(path: PathLike, reading: Reading | None = None, *, whole: bool = False) -> Iterator[Recording]:
    """Read one file recording by recording, each in one piece; very long ones by some rows where the format can.

    Blocks of one recording have one name. Errors as in :func:`read`; with ``whole`` nothing is too long for one piece.
    """
    file, told = Path(path), reading or Reading()
    known = format_of(file)
    if told.columns is not None and known.has_names:
        raise SettingError(f"columns: {file} says itself what its columns are called; leave them off.")
    if told.topic is not None and not known.has_topics:
        raise SettingError(f"topic: {file} has none; ROS recordings have topics, and workbooks sheets.")
    assembly, most = Assembly(file, told), (inf if whole else blocks.WHOLE_ROWS) if known.in_blocks else -1
    with ours_alone(file, known.expected), unchanged(file):
        tables = blocks.gathered(known.read(file, told), most)
        yield from blocks.continued((one for table in tables for one in assembly.recordings(table)), most)


def check_left_out(names: Iterable[str], came: Collection[str]) -> None:
    """Refuse to go on where recordings should be left out that never came.

    Raises
    ------
    SettingError
        With the names of those that came.
    """
    if absent := [name for name in names if name not in came]:
        said = f"no demonstration is called {listed([*map(repr, absent)])}; there are {listed([*map(repr, came)])}."
        raise SettingError(f"leave_out: {said}{meant(absent, came)}")


def expand(paths: PathLike | Iterable[PathLike]) -> list[Path]:
    """Files to read, in the order of their names where a folder or a pattern stands for several.

    Raises
    ------
    SettingError
        If there is none.
    """
    given: list[Any] = [paths] if isinstance(paths, str | os.PathLike) or hasattr(paths, "shape") else [*paths]
    if odd := [type(one).__name__ for one in given if not isinstance(one, str | os.PathLike)]:
        raise SettingError(f"paths: got {odd[0]}, expected paths; a table in memory is uc.Recording(columns, values).")
    listed = [*map(Path, given)]
    # A pattern may be absolute, which Path.glob refuses.
    there = [[] if path.exists() else sorted(glob(str(path), recursive=True)) for path in listed]  # noqa: PTH207
    matched = [Path(match) for path, found in zip(listed, there, strict=True) for match in found or [str(path)]]
    files = [file for path in matched for file in (files_in(path) if path.is_dir() else [path])]
    if not files:
        raise SettingError("got no file to read, expected at least one path.")
    return list(dict.fromkeys(files))

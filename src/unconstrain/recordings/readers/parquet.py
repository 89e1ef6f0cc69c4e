"""Parquet files: columns of numbers, or of lists of one length (``state`` becomes ``state1..stateN``).

Read by some rows at a time where asked for. Columns of words are left out, unless one names the demonstrations.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import BLOCK_ROWS, Array, require_extra
from ...base.errors import ReadError
from ..demonstration import Recording
from .table import UNITS, Format, find_roles, listed, seconds, split_by_group, unique_names


def read_parquet(path: Path, group: str | None, time: str | None) -> list[Recording]:
    """Read one file whole; see :class:`~.table.ReadFile`."""
    with _opened(path) as file:
        return _recordings(_checked(path, file.read), path, group, time)


def read_parquet_blocks(path: Path, group: str | None, time: str | None) -> Iterator[Recording]:
    """Go through one file by some rows at a time."""
    with _opened(path) as file:
        batches = file.iter_batches(batch_size=BLOCK_ROWS, use_threads=False)
        while (batch := _checked(path, lambda: next(batches, None))) is not None:
            yield from _recordings(batch, path, group, time)


def _opened(path: Path) -> Any:
    parquet = require_extra("pyarrow.parquet", "data")
    # Pages are read when they are needed; a buffer in between bounds what a column of a row group takes.
    return _checked(path, lambda: parquet.ParquetFile(path, buffer_size=2**20, pre_buffer=False))


def _checked(path: Path, call: Any) -> Any:
    from pyarrow import ArrowException

    try:
        return call()
    except (ArrowException, OSError) as error:
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ReadError(f"{path}: cannot be read ({said}). Expected a Parquet file.") from error


def _recordings(table: Any, path: Path, group: str | None, time: str | None) -> list[Recording]:
    titles = unique_names(table.schema.names)
    group_at, time_at = find_roles(titles, group, time, path)
    if not table.num_rows:
        raise ReadError(f"{path}: no rows, expected at least one.")
    names: list[str] = []
    columns: list[Array] = []
    for at, title in enumerate(titles):
        if at not in (group_at, time_at):
            for name, values in _numbers(table.column(at), title, path):
                names.append(name)
                columns.append(values)
    if not names:
        raise ReadError(f"{path}: no column of numbers; it has {listed(titles)}.")
    times = None if time_at is None else _times(table.column(time_at), titles[time_at], path)
    groups = None if group_at is None else [str(value) for value in table.column(group_at).to_pylist()]
    return split_by_group(names, np.column_stack(columns), times, groups, path.stem)


def _numbers(column: Any, title: str, path: Path) -> Iterator[tuple[str, Array]]:
    """A column as columns of numbers: itself, the entries of its lists, or nothing if it holds words."""
    from pyarrow import types

    kind = column.type
    if _is_number(kind):
        yield title, _float64(column)
        return
    lists = types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)
    if lists and _is_number(kind.value_type):
        rows = column.to_pylist()
        if None in rows or len(set(map(len, rows))) != 1:
            raise ReadError(f"{path}, column {title!r}: its lists are of different lengths, expected one length.")
        for place, values in enumerate(np.array(rows, dtype=np.float64).T):
            yield f"{title}{place + 1}", values


def _times(column: Any, title: str, path: Path) -> Array:
    from pyarrow import int64, types

    if types.is_timestamp(column.type) or types.is_duration(column.type):
        unit = UNITS[column.type.unit]
        stamps = _float64(column.cast(int64()))
        return (stamps - stamps[np.isfinite(stamps)][:1].sum()) * unit
    if not _is_number(column.type):
        raise ReadError(f"{path}, column {title!r}: is of type {column.type}, expected time stamps as numbers.")
    return seconds(_float64(column), title)


def _is_number(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_decimal(kind))


def _float64(column: Any) -> Array:
    """Numbers, NaN where there is none."""
    from pyarrow import float64, int8, types

    if types.is_boolean(column.type):
        column = column.cast(int8())
    return np.asarray(column.cast(float64(), safe=False).to_numpy(zero_copy_only=False), dtype=np.float64)


FORMAT = Format((".parquet", ".pq"), lambda head: head.startswith(b"PAR1"), read_parquet, read_parquet_blocks)

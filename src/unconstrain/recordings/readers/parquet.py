"""Parquet files: columns of numbers, or of lists of one length (``state`` becomes ``state1..stateN``).

Read by some rows at a time. Columns of words are left out, unless one names the demonstrations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import BLOCK_ROWS, Array, require_extra
from ...base.display import listed
from ...base.errors import ReadError
from .clocks import UNITS
from .lerobot import DataSet, data_set_of
from .reading import Reading
from .table import Format, Table, find_roles, numbers_of, unique_names


def read_parquet(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one file by some rows at a time; see :class:`~.table.ReadFile`."""
    whole = data_set_of(path)
    with _opened(path) as file:
        rows = 0
        for batch in file.iter_batches(batch_size=BLOCK_ROWS, use_threads=False):
            rows += batch.num_rows
            yield _table(batch, path, reading, whole)
        if not rows:
            raise ReadError(f"{path}: no rows, expected at least one.")
        if rows != file.metadata.num_rows:
            raise ReadError(f"{path}: says that it has {file.metadata.num_rows:,} rows, but {rows:,} could be read.")


def _opened(path: Path) -> Any:
    parquet = require_extra("pyarrow.parquet", "data")
    # Pages are read when they are needed; a buffer in between bounds what a column of a row group takes.
    return parquet.ParquetFile(path, buffer_size=2**20, pre_buffer=False)


def _table(table: Any, path: Path, reading: Reading, whole: DataSet) -> Table:
    titles = unique_names(table.schema.names)
    roles = find_roles(titles, reading, path)
    names: list[str] = []
    columns: list[Array] = []
    words: dict[str, list[Any]] = {}
    for at, title in enumerate(titles):
        wanted = title in roles.taken or roles.group is None
        if title == roles.group or (wanted and _is_words(table.column(at).type)):
            words[title] = table.column(at).to_pylist()
        else:
            for name, values in _numbers(table.column(at), title, path, whole.names):
                names.append(name)
                columns.append(values)
    if not names:
        raise ReadError(f"{path}: no column of numbers; it has {listed(titles)}.")
    return whole.described(Table(path.stem, tuple(names), np.column_stack(columns), words))


def _numbers(column: Any, title: str, path: Path, names: Mapping[str, list[str]]) -> Iterator[tuple[str, Array]]:
    """A column as columns of numbers: itself, the entries of its lists, or nothing if it holds words."""
    from pyarrow import types

    kind = column.type
    if types.is_timestamp(kind) or types.is_duration(kind):
        yield title, _elapsed(column)
    if _is_number(kind):
        yield title, _float64(column)
        return
    lists = types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)
    if lists and _is_number(kind.value_type):
        rows = _entries(column)
        if rows is None:
            raise ReadError(f"{path}, column {title!r}: its lists are of different lengths, expected one length.")
        entries = names.get(title, [])
        for place, values in enumerate(rows.T):
            yield f"{title}.{entries[place]}" if len(entries) == len(rows.T) else f"{title}{place + 1}", values


def _entries(column: Any) -> Array | None:
    """The lists of a column as rows; None if they are of different lengths."""
    from pyarrow import compute

    lengths = compute.unique(compute.list_value_length(column)).to_pylist()
    if len(lengths) != 1 or lengths[0] is None:
        return None
    return _float64(compute.list_flatten(column)).reshape(len(column), lengths[0])


def _elapsed(column: Any) -> Array:
    """Seconds from the first stamp that there is."""
    from pyarrow import int64

    stamps = column.cast(int64())
    first = next((stamp for stamp in stamps.to_pylist() if stamp is not None), 0)
    integers = stamps.fill_null(first).to_numpy(zero_copy_only=False) - first
    return np.where(column.is_null().to_numpy(zero_copy_only=False), np.nan, integers * UNITS[column.type.unit])


def _is_words(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_string(kind) or types.is_large_string(kind) or types.is_dictionary(kind))


def _is_number(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_decimal(kind))


def _float64(column: Any) -> Array:
    """Numbers, NaN where there is none."""
    from pyarrow import float64, int8, table, types

    if types.is_boolean(column.type):
        column = column.cast(int8())
    return numbers_of(table([column.cast(float64(), safe=False)], ["numbers"]))[:, 0]


FORMAT = Format(
    (".parquet", ".pq"),
    lambda head: head.startswith(b"PAR1"),
    read_parquet,
    in_blocks=True,
    has_names=True,
    expected="a Parquet file",
)

"""LeRobot data sets, versions 2 and 3: folders with the frames in ``data/`` and what they mean in ``meta/``."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import ReadError
from .table import Table

TASK = "task_index"


@dataclass(frozen=True)
class DataSet:
    """What the metadata says: names of the entries of list columns, frames a second, and the tasks by number."""

    names: Mapping[str, list[str]] = field(default_factory=dict)
    fps: float | None = None
    tasks: Mapping[int, str] = field(default_factory=dict)

    def described(self, table: Table) -> Table:
        """A table with its rate, and its tasks in words."""
        if TASK not in table.columns or not self.tasks:
            return replace(table, rate=self.fps)
        numbers = table.values[:, table.columns.index(TASK)]
        tasks = [self.tasks.get(int(number), "") if np.isfinite(number) else "" for number in numbers]
        return replace(table, rate=self.fps, words={**table.words, "task": tasks})


def frames_of(folder: Path) -> list[Path] | None:
    """The files with the frames of a data set, in order; None if a folder is none."""
    if not (folder / "meta").is_dir() or not (folder / "data").is_dir():
        return None
    return sorted((folder / "data").rglob("*.parquet"))


def data_set_of(path: Path) -> DataSet:
    """What is known of the data set that a file is in; nothing if it is in none."""
    root = next((each.parent for each in path.absolute().parents if each.name == "data"), None)
    if root is None or not (root / "meta").is_dir():
        return DataSet()
    info = root / "meta" / "info.json"
    return _data_set(root, info.stat().st_mtime_ns if info.is_file() else 0)


@lru_cache(maxsize=8)
def _data_set(root: Path, _changed: int) -> DataSet:
    """What the metadata says, read once for all files until it changes."""
    info = _read_json(root / "meta" / "info.json")
    described = info.get("features")
    features = described if isinstance(described, dict) else {}
    names = {title: _names(feature.get("names")) for title, feature in features.items() if isinstance(feature, dict)}
    fps = info.get("fps")
    return DataSet(names, float(fps) if isinstance(fps, int | float) else None, dict(_tasks(root / "meta")))


def _read_json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError, OSError) as error:
        raise ReadError(f"{path}: cannot be read ({error}). Expected the description of a LeRobot data set.") from error
    return content if isinstance(content, dict) else {}


def _names(names: Any) -> list[str]:
    """Names of the entries: a list, or a mapping that holds one, such as ``{"motors": [...]}``."""
    if isinstance(names, dict):
        inside = [member for member in names.values() if isinstance(member, list)]
        names = inside[0] if len(inside) == 1 else list(names)
    return [str(name) for name in names] if isinstance(names, list) else []


def _tasks(meta: Path) -> Iterator[tuple[int, str]]:
    """Number and words of each task: a line each (version 2), or a row (version 3, whose words may be the index)."""
    lines = meta / "tasks.jsonl"
    if lines.is_file():
        for line in lines.read_text(encoding="utf-8", errors="replace").splitlines():
            record = json.loads(line) if line.strip().startswith("{") else {}
            if isinstance(record.get(TASK), int):
                yield record[TASK], str(record.get("task", ""))
    rows = meta / "tasks.parquet"
    if rows.is_file():
        from pyarrow import parquet

        table = parquet.read_table(rows).to_pydict()
        words = table.get("task") or table.get("__index_level_0__") or []
        yield from zip(table.get(TASK, []), map(str, words), strict=False)

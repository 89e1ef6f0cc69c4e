"""Recordings as files for other programs: CSV, Parquet, LeRobot, MCAP.

Examples
--------
>>> recording = uc.Recording(("x",), np.array([[0.0], [1.0]]), np.array([0.0, 0.5]), name="wipe")
>>> uc.writers.write_recordings([recording], "wipe.csv")
>>> uc.read("wipe.csv")[0].columns
('x',)
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Array, require_extra
from ..base.errors import SettingError, WriteError
from ..base.files import put_folder, workshop, write
from .demonstration import Recording
from .readers.clocks import usual

GROUP, TIME = "demo", "t"
"""Columns with the name of the demonstration and the time, before those of the recordings."""

LEROBOT: dict[str, Any] = {
    "codebase_version": "v3.0",
    "robot_type": None,
    "splits": {},
    "chunks_size": 1000,
    "video_path": None,
}


def write_recordings(
    recordings: Sequence[Recording], path: str | Path, states: Sequence[str] = (), actions: Sequence[str] = ()
) -> None:
    """Write recordings that have the same columns to one file, or to a folder as a LeRobot data set.

    Parameters
    ----------
    recordings : sequence of Recording
    path : path
        Its suffix says what is written: ``.csv``, ``.parquet``, ``.mcap``; without one, a LeRobot data set (version 3).
        A file that is there is replaced.
    states, actions : sequence of str
        For LeRobot and MCAP: the columns of ``observation.state`` (positions of joints) and ``action`` (velocities);
        all columns are states by default.

    Raises
    ------
    SettingError
        If the suffix is another, or the recordings have different columns.
    WriteError
        If it cannot be written.
    MissingExtraError
        If the library of a format is not installed.

    Examples
    --------
    >>> uc.writers.write_recordings([uc.Recording(("x", "y"), np.eye(2), name="wipe")], "wipe.csv")
    >>> uc.read("wipe.csv")[0].columns
    ('x', 'y')
    """
    target = Path(path)
    writer = WRITERS.get(target.suffix.lower())
    if writer is None:
        kinds = ", ".join(suffix for suffix in WRITERS if suffix)
        raise SettingError(f"{target}: got the suffix {target.suffix!r}, expected {kinds}, or none for LeRobot.")
    for recording in recordings:
        if recording.columns != recordings[0].columns:
            raise SettingError(
                f"'{recording.name}' has the columns {', '.join(recording.columns)}, '{recordings[0].name}' has "
                f"{', '.join(recordings[0].columns)}; only recordings of the same columns go into one file."
            )
    writer(recordings, target, tuple(states) or recordings[0].columns, tuple(actions))


def _write_csv(recordings: Sequence[Recording], path: Path, *_: Any) -> None:
    timed = _has_times(recordings)

    def fill(stream: Any) -> None:
        text = io.TextIOWrapper(stream, "utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([GROUP, *([TIME] if timed else []), *recordings[0].columns])
        for one in recordings:
            rows = np.column_stack([_times(one), one.values]) if timed else one.values
            writer.writerows([one.name, *map(_cell, row)] for row in rows.tolist())
        text.detach()

    write(path, fill)


def _cell(value: float) -> str:
    return "" if value != value else f"{value:.17g}" if float(f"{value:.15g}") != value else f"{value:.15g}"


def _write_parquet(recordings: Sequence[Recording], path: Path, *_: Any) -> None:
    pyarrow = require_extra("pyarrow", "data")
    parquet = require_extra("pyarrow.parquet", "data")
    columns: dict[str, Any] = {GROUP: [recording.name for recording in recordings for _row in range(len(recording))]}
    if _has_times(recordings):
        columns[TIME] = np.concatenate([_times(recording) for recording in recordings])
    values = np.concatenate([recording.values for recording in recordings])
    columns |= dict(zip(recordings[0].columns, values.T, strict=True))
    write(path, lambda stream: parquet.write_table(pyarrow.table(columns), stream))


def _write_lerobot(recordings: Sequence[Recording], path: Path, states: Sequence[str], actions: Sequence[str]) -> None:
    require_extra("pyarrow", "data")
    if path.exists() and not (path / "meta" / "info.json").is_file():
        raise SettingError(f"{path}: is there and no LeRobot data set; give another name for the folder.")
    with workshop(path) as folder:
        root = folder / "set"
        for name, content in _lerobot_files(recordings, {"observation.state": states, "action": actions}):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            write(root / name, content)
        put_folder(root, path)


def _lerobot_files(
    recordings: Sequence[Recording], columns: dict[str, Sequence[str]]
) -> Iterator[tuple[str, str | Callable[[Any], Any]]]:
    """The files of a data set: frames, episodes, tasks, and what they mean."""
    from pyarrow import parquet, table

    used = {feature: names for feature, names in columns.items() if names}
    of = [str(recording.attributes.get("task", "")) for recording in recordings]
    tasks = list(dict.fromkeys(of))
    fps = _rate(recordings)
    frames = _frames(recordings, used, [tasks.index(task) for task in of], fps)
    for name, content in (
        ("data/chunk-000/file-000", frames),
        ("meta/episodes/chunk-000/file-000", _episodes([len(recording) for recording in recordings], of)),
        ("meta/tasks", {"task_index": np.arange(len(tasks)), "task": tasks}),
    ):
        yield f"{name}.parquet", partial(parquet.write_table, table(content))
    yield "meta/info.json", json.dumps(_info(used, frames, len(recordings), len(tasks), fps), indent=4)
    yield (
        "meta/stats.json",
        json.dumps({feature: _stats(_stacked(recordings, names)) for feature, names in used.items()}),
    )


def _frames(
    recordings: Sequence[Recording], used: dict[str, Sequence[str]], tasks: Sequence[int], fps: float
) -> dict[str, Any]:
    """A row for each sample of each recording."""
    from pyarrow import FixedSizeListArray, array

    lengths = [len(recording) for recording in recordings]
    numbers = np.concatenate([np.arange(length) for length in lengths])
    lists = {feature: _stacked(recordings, names).astype(np.float32) for feature, names in used.items()}
    return {
        **{
            feature: FixedSizeListArray.from_arrays(array(rows.ravel()), rows.shape[1])
            for feature, rows in lists.items()
        },
        "timestamp": (numbers / fps).astype(np.float32),
        "frame_index": numbers,
        "episode_index": np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(len(numbers)),
        "task_index": np.repeat(tasks, lengths),
    }


def _episodes(lengths: Sequence[int], tasks: Sequence[str]) -> dict[str, Any]:
    """A row for each recording: where it is, and its task."""
    starts = np.cumsum([0, *lengths])
    return {
        "episode_index": np.arange(len(lengths)),
        "tasks": [[task] for task in tasks],
        "length": lengths,
        "data/chunk_index": np.zeros(len(lengths), dtype=int),
        "data/file_index": np.zeros(len(lengths), dtype=int),
        "dataset_from_index": starts[:-1],
        "dataset_to_index": starts[1:],
    }


def _info(
    used: dict[str, Sequence[str]], frames: dict[str, Any], episodes: int, tasks: int, fps: float
) -> dict[str, Any]:
    features: dict[str, Any] = {
        feature: {"dtype": "float32", "shape": [len(names)], "names": list(names)} for feature, names in used.items()
    }
    features |= {
        name: {"dtype": "float32" if name == "timestamp" else "int64", "shape": [1], "names": None}
        for name in frames
        if name not in used
    }
    counts = {"total_episodes": episodes, "total_frames": len(frames["index"]), "total_tasks": tasks, "fps": fps}
    data = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
    return {**LEROBOT, **counts, "splits": {"train": f"0:{episodes}"}, "data_path": data, "features": features}


def _stats(values: Array) -> dict[str, list[float]]:
    of = {"min": values.min(axis=0), "max": values.max(axis=0), "mean": values.mean(axis=0), "std": values.std(axis=0)}
    return {name: one.tolist() for name, one in of.items()} | {"count": [len(values)]}


def _write_mcap(recordings: Sequence[Recording], path: Path, states: Sequence[str], actions: Sequence[str]) -> None:
    """Each demonstration as a topic of its name: a state of joints with the states as positions."""
    rosbag2 = require_extra("rosbags.rosbag2", "formats")
    typesys = require_extra("rosbags.typesys", "formats")
    if actions and len(actions) != len(states):
        raise SettingError(
            f"{path}: got {len(states)} states and {len(actions)} actions; a topic of joints has as many."
        )
    types = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    kind = "sensor_msgs/msg/JointState"
    with workshop(path) as folder:
        with rosbag2.Writer(folder / "bag", version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as bag:
            for recording in recordings:
                topic = bag.add_connection(f"/{recording.name.strip('/')}", kind, typestore=types)
                for stamp, message in _messages(recording, states, actions, types.types):
                    bag.write(topic, stamp, types.serialize_cdr(message, kind))
        [made] = (folder / "bag").glob("*.mcap")
        write(path, made.read_bytes())


def _messages(
    recording: Recording, states: Sequence[str], actions: Sequence[str], types: Any
) -> Iterator[tuple[int, Any]]:
    start = int(recording.attributes.get("start_ns", 0))
    stamps = start + np.round(_times(recording) * 1e9).astype(np.int64)
    empty: Array = np.empty(0)
    positions = np.ascontiguousarray(recording.select(states))
    velocities = np.ascontiguousarray(recording.select(actions)) if actions else None
    for row, stamp in enumerate(stamps.tolist()):
        time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
        header = types["std_msgs/msg/Header"](stamp=time, frame_id="")
        velocity = empty if velocities is None else velocities[row]
        yield stamp, types["sensor_msgs/msg/JointState"](header, list(states), positions[row], velocity, empty)


def _stacked(recordings: Sequence[Recording], names: Sequence[str]) -> Array:
    return np.concatenate([recording.select(names) for recording in recordings])


def _has_times(recordings: Sequence[Recording]) -> bool:
    return all(recording.times is not None for recording in recordings)


def _times(recording: Recording) -> Array:
    if recording.times is None:
        raise WriteError(f"'{recording.name}': has no times, which this format needs. Say its rate (rate=).")
    return recording.times


def _rate(recordings: Sequence[Recording]) -> float:
    """Samples a second of all, whole where they nearly are."""
    typical = usual(np.concatenate([np.diff(_times(recording)) for recording in recordings]))
    if not typical:
        raise WriteError("the recordings have no two samples at different times, and so no rate.")
    rate = 1.0 / typical
    return float(round(rate)) if abs(rate - round(rate)) < 0.01 * rate else rate


WRITERS: dict[str, Callable[[Sequence[Recording], Path, Sequence[str], Sequence[str]], None]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mcap": _write_mcap,
    "": _write_lerobot,
}

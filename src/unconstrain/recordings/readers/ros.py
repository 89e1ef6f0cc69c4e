"""Recordings of ROS 1 (``.bag``) and ROS 2 (``.db3``, ``.mcap``, folders), by rosbags: one topic is one recording.

A message becomes a row: each number in it is a column, called by its fields (``position.x``); the entries of a
``JointState`` are called by their joints (``position.elbow``). A topic of transforms holds a recording for each frame
(``topic="/tf:tool"``). Times are the stamps in the headers where they are set, else when a message was recorded.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import require_extra
from ...base.display import listed
from ...base.errors import ReadError
from ...base.files import stem
from .reading import Reading
from .table import Format, Table

MOTION = re.compile(r"(JointState|Pose|Twist|Wrench|Accel|Transform|Point|Vector3|Odometry)\w*|TFMessage")
"""Kinds of messages that are taken for the recording where one topic has such and no topic is named."""

LONGEST_ARRAY = 64
"""What holds more numbers is a picture or a cloud, not a state."""

NANOSECONDS = 1e-9

_MAGICS = (b"#ROSBAG V2.0", b"SQLite format 3\0", b"\x89MCAP0\r\n")

Row = tuple[int, dict[str, float]]
"""Stamp in nanoseconds, and cells by their columns."""


def read_ros(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one recording; see :class:`~.table.ReadFile`."""
    asked = reading.topic.split(",") if reading.topic is not None else [None]
    for topic in asked:
        yield from _read(path, topic, len(asked) > 1)


def _read(path: Path, asked: str | None, several: bool) -> Iterator[Table]:
    """The tables of one topic."""
    highlevel = require_extra("rosbags.highlevel", "formats")
    with highlevel.AnyReader([path], default_typestore=_types()) as bag:
        topic, frame = _chosen(bag, path, asked)
        rows = _rows(bag, topic)
    if not rows:
        raise ReadError(f"{path}: the topic {topic} has no message.")
    if frame is not None and frame not in rows:
        raise ReadError(f"{path}: the topic {topic} has no frame {frame!r}; it has {listed(list(rows))}.")
    held = rows if frame is None else {frame: rows[frame]}
    if len(held) > 1 and asked is None:
        frames = listed([f"{topic}:{name}" for name in rows])
        raise ReadError(f"{path}: the topic {topic} has several frames; say which with topic=: {frames}.")
    for name, one in held.items():
        parts = [stem(path), *([topic.strip("/")] if several else []), *([name] if len(held) > 1 else [])]
        yield _table(one, "/".join(parts), {"topic": topic, "frame": name, "start_ns": one[0][0]})


def _types() -> Any:
    """Definitions of messages for recordings that bring none."""
    typesys = require_extra("rosbags.typesys", "formats")
    return typesys.get_typestore(typesys.Stores.LATEST)


def _chosen(bag: Any, path: Path, asked: str | None) -> tuple[str, str | None]:
    """Topic, and the frame of it that is asked for."""
    kinds = {topic: str(info.msgtype or "several kinds") for topic, info in bag.topics.items()}
    if asked is not None:
        topic, _, frame = asked.partition(":")
        found = next((each for each in (topic, f"/{topic}") if each in kinds), None)
        if found is None:
            raise ReadError(f"{path}: no topic {topic!r}; it has {_described(kinds)}.")
        return found, frame or None
    moving = [topic for topic, kind in kinds.items() if MOTION.fullmatch(kind.rpartition("/")[2])]
    if len(moving) == 1 or len(kinds) == 1:
        return (moving or list(kinds))[0], None
    raise ReadError(f"{path}: holds several topics; say which with topic=: {_described(kinds)}.")


def _described(kinds: Mapping[str, str]) -> str:
    return listed([f"{topic} ({kind})" for topic, kind in kinds.items()]) or "none"


def _rows(bag: Any, topic: str) -> dict[str, list[Row]]:
    """The messages of a topic as rows, by the frame that they are about."""
    rows: dict[str, list[Row]] = defaultdict(list)
    connections = [each for each in bag.connections if each.topic == topic]
    for connection, stamp, raw in bag.messages(connections=connections):
        message = bag.deserialize(raw, connection.msgtype)
        for frame, each in _parts(message):
            rows[frame].append((_stamp(each) or stamp, dict(_cells(each))))
    return rows


def _parts(message: Any) -> Iterator[tuple[str, Any]]:
    """Messages in a message: each transform of a list is about a frame of its own."""
    transforms = getattr(message, "transforms", None)
    if transforms is None:
        yield "", message
        return
    for transform in transforms:
        yield str(transform.child_frame_id), transform


def _stamp(message: Any) -> int:
    """Nanoseconds in the header, 0 where there is none or it is not set."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _cells(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Each number in a message, with the fields that lead to it."""
    names = list(getattr(message, "name", ())) if hasattr(message, "position") else []
    for field in fields(message):
        value = getattr(message, field.name)
        title = f"{prefix}{field.name}"
        if field.name in ("header", "__msgtype__", "covariance", "layout"):
            continue
        if is_dataclass(value):
            # A pose in a PoseStamped is the pose: what wraps one message only is left out of the name.
            yield from _cells(value, f"{title}.")
        elif isinstance(value, np.ndarray | list):
            yield from _entries(title, value, names)
        elif isinstance(value, int | float | np.number):
            yield title, float(value)


def _entries(
    title: str, values: Sequence[Any] | np.ndarray[Any, Any], names: Sequence[str]
) -> Iterator[tuple[str, float]]:
    if len(values) > LONGEST_ARRAY or not all(isinstance(value, int | float | np.number) for value in values):
        return
    labels = [f".{name}" for name in names] if len(names) == len(values) else map(str, range(len(values)))
    for label, value in zip(labels, values, strict=True):
        yield f"{title}{label}", float(value)


def _table(rows: Sequence[Row], name: str, attributes: Mapping[str, Any]) -> Table:
    columns = tuple(dict.fromkeys(title for _, cells in rows for title in cells))
    first = rows[0][0]
    values = np.array([[cells.get(title, np.nan) for title in columns] for _, cells in rows])
    times = np.array([stamp - first for stamp, _ in rows], dtype=np.float64) * NANOSECONDS
    return Table(name, ("time", *columns), np.column_stack([times, values]), attributes=attributes)


def is_recording(folder: Path) -> bool:
    """Whether a folder is a recording of ROS 2."""
    kinds = ("*.db3*", "*.mcap*")
    return (folder / "metadata.yaml").is_file() and any(any(folder.glob(kind)) for kind in kinds)


FORMAT = Format(
    (".bag", ".db3", ".mcap"),
    lambda head: head.startswith(_MAGICS),
    read_ros,
    has_names=True,
    has_topics=True,
    expected="a ROS recording (.bag, .db3, .mcap)",
)

"""Motion capture in C3D: a column for each coordinate of a marker, and for each analog channel.

What a residual marks as not seen is a gap. Analog channels of a higher rate are averaged over each frame. The libraries
for this format can be brought down by damaged bytes, so this reader checks every length against the bytes there are.
The format is described in Motion Lab Systems' *C3D File Format User Guide*.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...base.arrays import Array
from ...base.errors import ReadError
from ...base.files import stem
from .reading import Reading
from .table import Format, Table, unique_names

BLOCK = 512
"""The format counts in blocks of so many bytes."""

ORDERS = {84: "<", 86: ">"}
"""Byte orders by the processor that a file names: Intel, MIPS; a third, DEC, has numbers of its own."""

KINDS = {1: "i1", 2: "i2", 4: "f4"}
"""NumPy's names for the types of parameters; -1 is text."""

Parameters = dict[str, list[Any]]
"""Values by group and name, such as ``POINT:RATE``."""


class Capture(NamedTuple):
    """Coordinates (frames, markers, 3), NaN where not seen; analog channels (frames, channels); parameters."""

    points: Array
    analogs: Array
    parameters: Parameters


def read_c3d(path: Path, _: Reading) -> Iterator[Table]:
    """Read one file; see :class:`~.table.ReadFile`."""
    capture = read_capture(path.read_bytes())
    parameters = capture.parameters
    frames, markers, _three = capture.points.shape
    labels = _labels(parameters, "POINT", markers, "marker")
    columns = [f"{label}.{axis}" for label in labels for axis in "XYZ"]
    names = unique_names([*columns, *_labels(parameters, "ANALOG", capture.analogs.shape[1], "analog")])
    if not names or not frames:
        raise ReadError(f"{path}: holds neither markers nor analog channels.")
    unit = str(next(iter(parameters.get("POINT:UNITS", [])), ""))
    rate = float(next(iter(parameters.get("POINT:RATE", [])), 0.0))
    yield Table(
        stem(path),
        names,
        np.hstack([capture.points.reshape(frames, -1), capture.analogs]),
        rate=rate or None,
        units=dict.fromkeys(names[: len(columns)], unit) if unit else {},
    )


def read_capture(content: bytes) -> Capture:
    """The frames of a file.

    Raises
    ------
    ValueError
        If the bytes do not say what they should.
    """
    if len(content) < 2 * BLOCK or content[1] != 0x50:
        raise ValueError("it is too short, or something else")
    section = (content[0] - 1) * BLOCK
    order = ORDERS.get(content[section + 3]) if 0 < section < len(content) - 4 else None
    if order is None:
        raise ValueError("numbers as DEC wrote them; convert it, as with ezc3d or Mokka")
    parameters = dict(_parameters(content, section + 4, order))
    markers, samples, first, last = struct.unpack_from(f"{order}4H", content, 2)
    scale, start, per_frame = struct.unpack_from(f"{order}fHH", content, 12)
    shape = Shape(markers, samples, per_frame, scale, (start - 1) * BLOCK)
    data = shape.frames(content, order, _frames(parameters, last - first + 1))
    return Capture(shape.points(data), shape.analogs(data, parameters), parameters)


@dataclass(frozen=True)
class Shape:
    """What a frame holds: markers, and analog samples, several of each channel; and where the first one is."""

    markers: int
    samples: int
    per_frame: int
    scale: float
    start: int

    def frames(self, content: bytes, order: str, frames: int) -> Array:
        """The frames as rows of numbers, as many as there are bytes for."""
        width = 4 * self.markers + self.samples
        kind = np.dtype(f"{order}f4" if self.scale < 0 else f"{order}i2")
        held = max(len(content) - self.start, 0) // max(width * kind.itemsize, 1)
        if self.start < 2 * BLOCK or not width or held < 1:
            raise ValueError("it ends before its frames")
        count = min(held, frames) if frames > 0 else held
        rows = np.frombuffer(content, kind, count * width, self.start).reshape(count, width)
        with np.errstate(all="ignore"):
            return rows.astype(np.float64)

    def points(self, data: Array) -> Array:
        """Coordinates, NaN where the residual is negative."""
        quadruples = data[:, : 4 * self.markers].reshape(len(data), self.markers, 4)
        points = quadruples[..., :3] * (1.0 if self.scale < 0 else self.scale)
        return np.where(quadruples[..., 3:] < 0, np.nan, points)

    def analogs(self, data: Array, parameters: Parameters) -> Array:
        """Each channel averaged over each frame, in its unit."""
        channels = self.samples // max(self.per_frame, 1)
        if not channels or channels * self.per_frame != self.samples:
            return np.empty((len(data), 0))
        means = data[:, 4 * self.markers :].reshape(len(data), self.per_frame, channels).mean(axis=1)
        offsets = _numbers(parameters.get("ANALOG:OFFSET", []), channels, 0.0)
        scales = _numbers(parameters.get("ANALOG:SCALE", []), channels, 1.0)
        return (means - offsets) * scales * _numbers(parameters.get("ANALOG:GEN_SCALE", []), 1, 1.0)


def _parameters(content: bytes, at: int, order: str) -> Iterator[tuple[str, list[Any]]]:
    """Parameters with their groups; those of a group may come before it is named."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, list[Any]]] = []
    while at + 5 < len(content) and content[at]:
        size, group = struct.unpack_from("2b", content, at)
        name = content[at + 2 : at + 2 + abs(size)].decode("latin-1").upper()
        after = at + 2 + abs(size)
        if after + 4 > len(content):
            break
        step = struct.unpack_from(f"{order}H", content, after)[0]
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _values(content, after + 2, order)))
        if not step:
            break
        at = after + step
    return ((f"{groups.get(group, '')}:{name}", values) for group, name, values in found)


def _values(content: bytes, at: int, order: str) -> list[Any]:
    """The numbers or words of a parameter."""
    kind, dimensions = struct.unpack_from("bB", content, at)
    sizes = list(content[at + 2 : at + 2 + dimensions])
    count, start = int(np.prod(sizes, dtype=np.int64)) if sizes else 1, at + 2 + dimensions
    if not 0 <= count * abs(kind) <= len(content) - start:
        return []
    if kind == -1:
        text, width = content[start : start + count].decode("latin-1"), sizes[0] if sizes else 1
        return [text[place : place + width].strip(" \0") for place in range(0, count, max(width, 1))]
    if kind not in KINDS:
        return []
    return np.frombuffer(content, f"{order}{KINDS[kind]}", count, start).tolist()


def _frames(parameters: Parameters, said: int) -> int:
    """Number of frames: two words hold them where one is too small."""
    first, last = parameters.get("TRIAL:ACTUAL_START_FIELD", []), parameters.get("TRIAL:ACTUAL_END_FIELD", [])
    if len(first) != 2 or len(last) != 2:
        return said
    begin, end = (int(low) % 2**16 + 2**16 * (int(high) % 2**16) for low, high in (first, last))
    return max(end - begin + 1, said)


def _labels(parameters: Parameters, group: str, count: int, otherwise: str) -> list[str]:
    labels = [str(label) for label in parameters.get(f"{group}:LABELS", [])] + [""] * count
    return [label or f"{otherwise}{place + 1}" for place, label in enumerate(labels[:count])]


def _numbers(values: list[Any], count: int, otherwise: float) -> Array:
    known = [float(value) for value in values[:count] if isinstance(value, int | float)]
    return np.array(known if len(known) == count else [otherwise] * count)


FORMAT = Format(
    (".c3d",),
    lambda head: len(head) > 1 and head[1] == 0x50 and head[0] == 2,
    read_c3d,
    has_names=True,
    expected="motion capture as C3D",
)

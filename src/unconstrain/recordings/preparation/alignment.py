"""Series of different rates on one clock: positions at 50 Hz beside forces at 1 kHz."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.arrays import Array
from ...base.errors import InvalidDataError
from ..demonstration import Recording
from ..readers import unique_names

START = "start_ns"
"""Attribute of a recording: when its clock began, in nanoseconds since 1970. Those that have it are moved by it."""


def align(recordings: Sequence[Recording], name: str | None = None) -> Recording:
    """Bring recordings of one movement onto the clock of the slowest.

    A faster one is averaged over each interval, half of it before and half after its stamp, so that nothing is aliased;
    one about as fast is interpolated linearly. Only the time in which all were recorded is kept.

    Parameters
    ----------
    recordings : sequence of Recording
        With times that increase. Columns that several have are called by their recordings too: ``force/x``.
    name : str, optional
        Of the result; that of the first by default.

    Raises
    ------
    InvalidDataError
        If one has no times, or there is no time in which all were recorded.

    Examples
    --------
    >>> arm = uc.Recording(("x",), np.arange(3.0)[:, None], np.array([0.0, 1.0, 2.0]), "arm")
    >>> force = uc.Recording(("f",), np.full((5, 1), 7.0), np.array([0.0, 0.5, 1.0, 1.5, 2.0]), "force")
    >>> uc.preparation.align([arm, force]).columns
    ('x', 'f')
    """
    clocks = [_clock(recording, recordings) for recording in recordings]
    start, end = max(clock[0] for clock in clocks), min(clock[-1] for clock in clocks)
    slowest = max(clocks, key=lambda clock: float(np.median(np.diff(clock))))
    times = slowest[(slowest >= start) & (slowest <= end)]
    if not times.size:
        listed = ", ".join(f"'{recording.name}'" for recording in recordings)
        raise InvalidDataError(f"{listed}: were not recorded at one time, the first ends before the last begins.")
    values = [_onto(times, clock, each.values) for clock, each in zip(clocks, recordings, strict=True)]
    return Recording(
        _columns(recordings),
        np.hstack(values),
        times - times[0],
        name or recordings[0].name,
        tuple(remark for recording in recordings for remark in recording.remarks),
        {column: unit for recording in recordings for column, unit in recording.units.items()},
        {key: value for recording in reversed(recordings) for key, value in recording.attributes.items()},
    )


def _clock(recording: Recording, recordings: Sequence[Recording]) -> Array:
    """Times of a recording on the clock that all have in common."""
    if recording.times is None or len(recording) < 2 or not (np.diff(recording.times) > 0).all():
        raise InvalidDataError(f"'{recording.name}': has no times that increase, and cannot be aligned without.")
    starts = [each.attributes.get(START) for each in recordings]
    known = [start for start in starts if start is not None]
    if len(known) < len(starts):
        return recording.times
    return recording.times + (recording.attributes[START] - min(known)) * 1e-9


def _onto(times: Array, clock: Array, values: Array) -> Array:
    """Values at other times: means over an interval around each where there are several, else in between two."""
    interval = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    if interval < 2.0 * float(np.median(np.diff(clock))):
        return np.column_stack([np.interp(times, clock, column) for column in values.T])
    first = np.searchsorted(clock, times - interval / 2)
    last = np.searchsorted(clock, times + interval / 2)
    sums = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0)])
    with np.errstate(invalid="ignore"):  # where there is none in the interval the mean is NaN
        return (sums[last] - sums[first]) / (last - first)[:, None]


def _columns(recordings: Sequence[Recording]) -> tuple[str, ...]:
    every = [column for recording in recordings for column in recording.columns]
    return unique_names(
        f"{recording.name}/{column}" if every.count(column) > 1 else column
        for recording in recordings
        for column in recording.columns
    )

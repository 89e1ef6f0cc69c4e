"""Which columns are a clock, and what it counts.

A clock is a column of numbers, a column of words (ISO 8601, or a time of day) or a pair of whole seconds and
nanoseconds, as ROS writes it. Where it counts from 1970, times start at the first stamp.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...base.arrays import Array

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Lengths of the units of time in seconds."""

CLOCKS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Above these magnitudes a stamp counts nano-, micro- or milliseconds since 1970; the length of one in seconds."""

SINCE_1970 = 5e8
"""Seconds above which a stamp counts from 1970, rather than from when a machine was switched on (16 years ago)."""

LONGEST = 1e11
"""More seconds than any stamp has: a unit in a name that makes it more is a mistake."""

_WORDS_OF_UNITS = {
    "s": r"s|secs?|seconds?",
    "ms": r"ms|msecs?|milli(?:s|secs?|seconds?)",
    "us": r"[uµμ]s|usecs?|micro(?:s|secs?|seconds?)",
    "ns": r"ns|nsecs?|nano(?:s|secs?|seconds?)",
}
_UNIT = "|".join(_WORDS_OF_UNITS.values())
_UNIT_IN_NAME = re.compile(rf"(?:[_. \[(]|(?<=time)|(?<=stamp)|(?<=^t))({_UNIT})[\])]?$", re.IGNORECASE)
_TIME = r"(?:t|times?|time[_ ]?stamps?|stamps?|rosbagtimestamp|elapsed|date[_ ]?time|clock|zeit|temps|tiempo|tempo)"
_WHOSE = r"(?:[a-z]+[_ ])?(?:elapsed|ros|robot|sys(?:tem)?|unix|utc|epoch|wall|sim(?:ulation)?|log|record(?:ing)?)[_ ]?"
TIME_NAME = re.compile(
    rf"(?:(?:.*[./])?header[./_]stamp|[%_#]*{_TIME}|{_WHOSE}{_TIME})(?:[_ ]?[\[(]?(?:{_UNIT})[\])]?)?", re.IGNORECASE
)
"""A column of such a name holds the time stamps: ``t``, ``%time``, ``Time (s)``, ``timestamp_ms``, ``header.stamp``."""

_WHOLE = re.compile(r"(.*?)(secs?|seconds)", re.IGNORECASE)
_PARTS = ("nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds", "nsecond", "nseconds")

_ZONE = re.compile(r"\s*(?:Z|UTC|[+-]\d\d:?\d\d)$")
_DATE = re.compile(r"^(\d{4})[/.](\d\d)[/.](\d\d)")
_OF_DAY = re.compile(r"(?:(\d+):)?(\d+):(\d+(?:[.,]\d*)?)")
_DAY = 86_400.0


class Clock(NamedTuple):
    """From what counts on a file's own clock to seconds: ``(stamps - origin) * unit``."""

    origin: float
    unit: float

    def seconds(self, stamps: Array) -> Array:
        """Stamps in seconds, shape (T,)."""
        return (stamps - self.origin) * self.unit


@dataclass(frozen=True)
class ClockColumns:
    """The column of a clock, and the one of its nanoseconds if it has one."""

    whole: str
    nanoseconds: str | None = None


def find_clock(names: Sequence[str]) -> ClockColumns | None:
    """The first column that is called as a clock, else a pair of whole seconds and nanoseconds, else whole seconds."""
    single = next((name for name in names if TIME_NAME.fullmatch(name)), None)
    if single is not None:
        return ClockColumns(single)
    whole = next((name for name in names if name.lower() in ("sec", "secs", "seconds")), None)
    return find_pair(names) or (None if whole is None else ClockColumns(whole))


def find_pair(names: Sequence[str]) -> ClockColumns | None:
    """The first pair of columns such as ``secs`` and ``nsecs``, or ``stamp.sec`` and ``stamp.nanosec``."""
    by_name = {name.lower(): name for name in reversed(names)}
    for name in names:
        if whole := _WHOLE.fullmatch(name):
            parts = (by_name.get((whole[1] + part).lower()) for part in _PARTS)
            if found := next(filter(None, parts), None):
                return ClockColumns(name, found)
    return None


def find_clock_of(stamps: Array, name: str, unit: str | None = None) -> Clock:
    """What a clock counts: as told, else as its name says (``t_ms``, ``time[ns]``), else by the size of its numbers."""
    known = stamps[np.isfinite(stamps)]
    if not known.size:
        return Clock(0.0, 1.0)
    typical = float(np.median(known))
    length = UNITS[unit] if unit else _unit_of(typical, unit_in_name(name))
    return Clock(float(known[0]) if typical * length > SINCE_1970 else 0.0, length)


def usual(intervals: Array) -> float:
    """The median step forward, 0 if there is none."""
    forward = intervals[intervals > 0]
    return float(np.median(forward)) if forward.size else 0.0


def unit_in_name(name: str) -> str | None:
    """The unit of time at the end of a name, None where there is none."""
    found = _UNIT_IN_NAME.search(name)
    return unit_of_word(found[1]) if found else None


def unit_of_word(word: str) -> str | None:
    """The unit of time that a word stands for: ``"Seconds"`` is ``"s"``; None if it is none."""
    for unit, words in _WORDS_OF_UNITS.items():
        if re.fullmatch(words, word.strip("[]() "), re.IGNORECASE):
            return unit
    return None


def read_words(words: Sequence[str]) -> Array | None:
    """Time stamps in words as seconds, shape (T,): ISO 8601, or the time of day; None where they are neither."""
    given = [word.strip() for word in words]
    if not any(given):
        return None
    if all(not word or _OF_DAY.fullmatch(word) for word in given):
        return _times_of_day(given)
    plain = [_DATE.sub(r"\1-\2-\3", _ZONE.sub("", word).replace(",", ".")) or "NaT" for word in given]
    if not all(re.match(r"\d{4}-\d\d-\d\d|NaT", word) for word in plain):
        return None
    try:
        stamps = np.array(plain, dtype="datetime64[ns]")
    except ValueError:
        return None
    known = stamps[~np.isnat(stamps)]
    elapsed = (stamps - known[:1].sum()) if not known.size else (stamps - known[0])
    return np.where(np.isnat(elapsed), np.nan, elapsed.astype(np.int64) * UNITS["ns"])


def _unit_of(typical: float, said: str | None) -> float:
    if said is not None and typical * UNITS[said] < LONGEST:
        return UNITS[said]
    return next((unit for magnitude, unit in CLOCKS if typical > magnitude), 1.0)


def _times_of_day(words: Sequence[str]) -> Array:
    """Seconds since midnight of the first day; past midnight they go on."""
    stamps = np.array([_since_midnight(_OF_DAY.fullmatch(word)) for word in words])
    known = np.flatnonzero(np.isfinite(stamps))
    stamps[known] += _DAY * np.cumsum(np.diff(stamps[known], prepend=stamps[known[:1]]) < -_DAY / 2)
    return stamps


def _since_midnight(match: re.Match[str] | None) -> float:
    if match is None:
        return np.nan
    hours, minutes, rest = match.groups()
    return 3600.0 * float(hours or 0) + 60.0 * float(minutes) + float(rest.replace(",", "."))

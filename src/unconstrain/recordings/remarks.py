"""What is worth saying about a recording."""

from typing import NamedTuple

from ..base.files import stem

WARNINGS = (
    "angle-wrap",
    "angle-unused",
    "quaternion-flip",
    "rotation-vector-flip",
    "seam",
    "glitch",
    "clock-unit",
    "clock-differs",
    "clock-gap",
    "empty-cells",
    "clock-untold",
    "stale",
    "missing",
    "targets-as-velocities",
    "not-velocities",
    "mixed-units",
    "unit-differs",
    "columns-differ",
    "same-recording",
    "rolled-out",
    "pause",
    "reversed",
    "at-rest",
    "refused",
    "all-zero",
    "few-demonstrations",
    "several-in-one",
    "row-order",
    "explains-nothing",
    "other-topic",
    "dropped-column",
)
"""Codes of remarks that warn; all others tell how a file was read."""


class Remark(NamedTuple):
    """One thing to know about a recording.

    ``code`` is a word for programs, ``message`` a sentence for people; ``column``, ``row`` (from 0), and for people
    ``place`` say where, ``spans`` the half-open rows of each place of several; ``cured`` is whether that was repaired.
    """

    code: str
    message: str
    column: str | None = None
    row: int | None = None
    place: str = ""
    cured: bool = False
    spans: tuple[tuple[int, int], ...] = ()

    @property
    def warns(self) -> bool:
        """Whether the recording may not be what it seems, rather than how it was read."""
        return self.code in WARNINGS

    def about(self, title: str = "") -> str:
        """One line on a recording of some title, or on several: the code, the place, and the message."""
        row = "" if self.row is None else self.place or f"row {self.row}"
        column = "" if self.column is None else f"column {self.column!r}"
        return ": ".join(filter(None, (self.code, ", ".join(filter(None, (title, row, column))), self.message)))


def titled(name: str, file: str = "") -> str:
    """A recording by its name, and by its file where it is not called as that."""
    return f"'{name}'" if name.startswith(stem(file)) else f"'{name}' of {file}"

"""What a reader is told about the files, beyond where they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ...base.errors import SettingError
from .clocks import UNITS

MOST_EPISODES = 10_000_000
"""A range of more demonstrations than this is a mistake."""

_RANGE = re.compile(r"(\d+)-(\d+)")
_LAST_NUMBER = re.compile(r"(\d+)\D*$")


@dataclass(frozen=True)
class Reading:
    """How to read files: what :func:`~unconstrain.read` takes by name, with the same meaning.

    Raises
    ------
    SettingError
        If one column is to be both group and time, or a value is out of its range.
    """

    group: str | None = None
    time: str | None = None
    time_unit: str | None = None
    columns: Sequence[str] | None = None
    topic: str | None = None
    episodes: Sequence[str] | None = None
    task: str | None = None

    def __post_init__(self) -> None:
        if self.group is not None and self.group == self.time:
            raise SettingError(f"got {self.group!r} for both group and time, expected two different columns.")
        if self.time_unit is not None and self.time_unit not in UNITS:
            raise SettingError(f"time_unit: got {self.time_unit!r}, expected one of {', '.join(UNITS)}.")
        for name in ("columns", "episodes"):
            object.__setattr__(self, name, _listed(getattr(self, name)))
        if self.columns and len(set(self.columns)) < len(self.columns):
            raise SettingError(f"columns: got {', '.join(self.columns)}, expected each name once.")

    @property
    def arguments(self) -> dict[str, Any]:
        """What :func:`~unconstrain.read` takes by name."""
        return asdict(self)

    @property
    def roles(self) -> dict[str, Any]:
        """What holds for other files of the same kind too."""
        return {name: value for name, value in asdict(self).items() if name not in ("episodes", "task")}

    def takes(self, name: str, labels: Sequence[str] = (), task: object = None) -> bool:
        """Whether a demonstration of this name, in these lists and of this task is to be read."""
        if self.task is not None and str(task) != self.task:
            return False
        if self.episodes is None or not {name, name.rpartition("/")[2], *labels}.isdisjoint(self.episodes):
            return True
        number = _LAST_NUMBER.search(name)
        return number is not None and int(number[1]) in _numbers(self.episodes)


def _numbers(episodes: Sequence[str]) -> set[int]:
    ranges = [match for episode in episodes if (match := _RANGE.fullmatch(episode))]
    single = {int(episode) for episode in episodes if episode.isdecimal()}
    return single.union(*(_range(int(match[1]), int(match[2])) for match in ranges))


def _range(first: int, last: int) -> range:
    if not first <= last < first + MOST_EPISODES:
        raise SettingError(f"episodes: got {first}-{last}, expected a range such as 0-9.")
    return range(first, last + 1)


def _listed(names: Any) -> tuple[str, ...] | None:
    if names is None or isinstance(names, str):
        return (names,) if names else None
    if not isinstance(names, Iterable):
        return (str(names),)
    return tuple(map(str, names)) or None

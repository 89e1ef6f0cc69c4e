"""Finished trials in a file, so that an interrupted experiment goes on where it stopped."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

from ...base import files

VERSION = 2
"""To be raised when trials change."""


class DataClass(Protocol):
    """Any instance of a dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


@dataclass(frozen=True)
class Journal:
    """Finished trials in a file, a line each, under the settings that they belong to.

    Parameters
    ----------
    path : Path
    settings : dataclass
        Trials that were run under others are not taken up again.
    """

    path: Path
    settings: DataClass

    def begin(self) -> dict[int, Any]:
        """Results that are there already, by index; starts a new file where the settings differ."""
        head = json.dumps({"version": VERSION, **asdict(self.settings)}, sort_keys=True)
        lines = self.path.read_text("utf-8", "replace").split("\n") if self.path.exists() else []
        # What follows the last line break was being written when the run was interrupted.
        try:
            done = dict(json.loads(line) for line in lines[1:-1]) if lines[:1] == [head] else {}
        except (TypeError, ValueError):  # a damaged line: none of the others is to be trusted
            done = {}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        kept = [head, *(json.dumps([index, result]) for index, result in done.items()), ""]
        files.write(self.path, "\n".join(kept))
        return done

    def add(self, index: int, result: Any) -> None:
        """Keep a result; it must survive a way through JSON."""
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps([index, result]) + "\n")

    def finish(self) -> None:
        """Forget the trials: the result has been written."""
        self.path.unlink(missing_ok=True)

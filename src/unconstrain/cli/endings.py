"""How a command that fails ends: one sentence, and an exit code that says whose fault it was."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..base.errors import UnconstrainError

REFUSED, FAULT, NOT_GUARANTEED, INTERRUPTED = 2, 1, 3, 130
"""Exit codes: what was asked cannot be done; a fault of this program; ``certify`` says no; as shells say of Ctrl-C."""

_NOTHING = "What is not named above was not written, and nothing is half written."

_PACKAGE = Path(__file__).parents[1]

TRACE = "UNCONSTRAIN_TRACEBACK"
"""Variable of the environment with which faults are shown in full."""


def ending(error: BaseException) -> tuple[str, int]:
    """The sentence and the exit code of an error."""
    said, code = next((said, code) for kind, said, code in _ENDINGS if isinstance(error, kind))
    return said(error), code


def _of_the_system(error: OSError) -> str:
    return f"{os.fsdecode(error.filename)}: {error.strerror}." if error.filename and error.strerror else str(error)


def _of_memory(error: MemoryError) -> str:
    detail = f" ({error})" if str(error) else ""
    return (
        f"not enough memory{detail}. Take fewer columns or demonstrations, or --learner hybrid, which keeps no samples."
    )


def _fault(error: Exception) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    last = next((frame for frame in reversed(frames) if Path(frame.filename).is_relative_to(_PACKAGE)), frames[-1])
    place = f"{Path(last.filename).name}, line {last.lineno}"
    if os.environ.get(TRACE):
        return "".join(traceback.format_exception(error))
    return (
        f"a fault of unconstrain, not of your data: {type(error).__name__}: {error} ({place}). Please report it to the "
        f"authors with the command and what it prints with {TRACE}=1; what was there before is as it was."
    )


_ENDINGS: tuple[tuple[type[BaseException], Callable[[Any], str], int], ...] = (
    (UnconstrainError, str, REFUSED),
    (KeyboardInterrupt, lambda error: f"interrupted. {error if error.args else _NOTHING}", INTERRUPTED),
    (MemoryError, _of_memory, REFUSED),
    (RecursionError, lambda _: "something that was read is nested too deeply.", REFUSED),
    (OSError, _of_the_system, REFUSED),
    (BaseException, _fault, FAULT),
)

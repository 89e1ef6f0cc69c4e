"""The paper's experiments and a benchmark beyond them, each a module with ``Settings`` and ``run(settings)``.

Examples
--------
>>> uc.experiments.NAMES[:3]
('table1', 'figure4', 'figure5')
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from ...base.errors import SettingError

__all__ = ["NAMES", "find"]

NAMES = ("table1", "figure4", "figure5", "table2", "washing", "regimes", "recorded", "constraints", "arrival")
"""What can be reproduced."""

JOURNALED = ("table1", "figure5", "table2", "regimes", "recorded", "constraints", "arrival")
"""Those whose trials are kept as they finish, so that an interrupted run goes on."""

BESIDE = {"recorded": "regimes"}
"""Whose result is shown again with that of another, where it lies in the same folder: together they judge a learner."""


def find(name: str) -> ModuleType:
    """Import an experiment by name.

    Raises
    ------
    SettingError
        If there is none of that name; the message lists those there are.
    """
    if name not in NAMES:
        raise SettingError(f"experiment: got {name!r}, expected one of {', '.join(NAMES)}.")
    return import_module(f".{name}", __name__)

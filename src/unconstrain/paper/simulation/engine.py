"""The physics engine, and what it can draw with when there is no screen."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from types import ModuleType

from ...base.arrays import require_extra

BACKENDS = {"egl": "libegl1", "osmesa": "libosmesa6"}
"""What draws without a screen, and the Debian package that brings it."""

_PROBE = "import mujoco; mujoco.Renderer(mujoco.MjModel.from_xml_string('<mujoco/>'), 16, 16).render()"


def engine() -> ModuleType:
    """Import MuJoCo.

    Raises
    ------
    MissingExtraError
        If the extra ``sim`` is not installed.
    """
    return require_extra("mujoco", "sim")


@cache
def backend() -> str | None:
    """The first of :data:`BACKENDS` that works here, tried in a process of its own; None if none does.

    Elsewhere than on Linux the system brings its own: an empty name.
    """
    if sys.platform != "linux":
        return ""
    return next((name for name in BACKENDS if _works(name)), None)


def _works(name: str) -> bool:
    try:
        tried = subprocess.run(
            [sys.executable, "-P", "-c", _PROBE],
            env=os.environ | {"MUJOCO_GL": name},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return tried.returncode == 0

"""Pictures of the scenes, rendered without a screen.

Rendering happens in a process of its own: the graphics library below is
chosen when the engine is imported, and it may crash.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

import unconstrain as uc

from ...base.arrays import Array, require_extra
from ...base.errors import InvalidDataError, UnconstrainError
from ..systems.wiping import Plate
from .engine import backend, engine
from .reproduction import Wipe
from .scene import Scene, arm_scene, hand_scene

FRAMES_A_SECOND = 12.5

_TRAIL = (0.86, 0.2, 0.45, 1.0)
_SCENES = {"arm": arm_scene, "hand": hand_scene}
_PATIENCE_S = 300


def film(wipe: Wipe, seconds: float = 4.0, width: int = 480, height: int = 360) -> list[Array]:
    """Frames of the arm's last seconds on its plate, :data:`FRAMES_A_SECOND`.

    Raises
    ------
    UnconstrainError
        If nothing can be drawn here.
    """
    interval = float(wipe.times[1] - wipe.times[0])
    every = max(1, round(1.0 / (FRAMES_A_SECOND * interval)))
    rows = np.arange(max(0, len(wipe.times) - round(seconds / interval)), len(wipe.times), every)
    trails = [wipe.positions[rows[0] : row + 1 : 4] for row in rows]
    return _shots("arm", wipe.plate, wipe.postures[rows], trails, width, height)


def animation(frames: Sequence[Array]) -> bytes:
    """Frames as a WebP that repeats."""
    pictures = [require_extra("PIL.Image", "sim").fromarray(frame) for frame in frames]
    stream, each = io.BytesIO(), round(1000 / FRAMES_A_SECOND)
    one_key = {"kmin": len(pictures), "kmax": len(pictures) + 1}  # all others are what changed: half the bytes
    look = {"duration": each, "loop": 0, "quality": 50, "method": 5} | one_key
    pictures[0].save(stream, "WEBP", save_all=True, append_images=pictures[1:], **look)
    return stream.getvalue()


def strip(demonstration: uc.Demonstration, wipe: Wipe, count: int = 4, width: int = 400, height: int = 300) -> bytes:
    """A hand that demonstrates above, the arm that reproduces below: one turn of each, as a WebP (figure 6).

    Parameters
    ----------
    demonstration : Demonstration
        On the same plate, with times.
    wipe : Wipe
    count, width, height : int
        Pictures in a row, and their pixels.

    Raises
    ------
    UnconstrainError
        If nothing can be drawn here.
    """
    if demonstration.times is None:
        raise InvalidDataError(f"'{demonstration.name}' has no times, expected them: a turn is told by its length.")
    image = require_extra("PIL.Image", "sim")
    turn = 1.0 / wipe.measures()["frequency"]
    hand = hand_scene(wipe.plate)
    engine().mj_forward(hand.model, hand.data)
    rows = []
    for name, track, postures, times in (
        ("hand", demonstration.states, demonstration.states - hand.face, demonstration.times),
        ("arm", wipe.positions, wipe.postures, wipe.times),
    ):
        length = min(round(turn / float(np.median(np.diff(times)))), len(track) - 1)
        first = len(track) - 1 - length
        chosen = np.linspace(first + length // count, len(track) - 1, count).astype(int)
        trails = [track[first : row + 1 : max(1, length // 40)] for row in chosen]
        rows.append(np.concatenate(_shots(name, wipe.plate, postures[chosen], trails, width, height), axis=1))
    stream = io.BytesIO()
    image.fromarray(np.concatenate(rows)).save(stream, "WEBP", quality=60)
    return stream.getvalue()


def _shots(name: str, plate: Plate, postures: Array, trails: Sequence[Array], width: int, height: int) -> list[Array]:
    """Render a scene at several postures in a process of its own."""
    chosen = backend()
    if chosen is None:
        raise UnconstrainError("the scene cannot be drawn here: neither EGL nor OSMesa works.")
    job = io.BytesIO()
    np.savez(
        job, name=name, plate=[plate.tilt_x, plate.tilt_y, *plate.centre], postures=postures, size=[width, height],
        lengths=[len(trail) for trail in trails], trails=np.concatenate(trails),
    )  # fmt: skip
    command = [sys.executable, "-P", "-c", f"from {__name__} import _render; _render()"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    if chosen:
        environment["MUJOCO_GL"] = chosen
    try:
        done = subprocess.run(
            command, input=job.getvalue(), env=environment, capture_output=True, timeout=_PATIENCE_S, check=True
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise UnconstrainError(f"the scene cannot be drawn here: {error}.") from error
    return list(np.load(io.BytesIO(done.stdout), allow_pickle=False))


def _render() -> None:
    """Read a job from stdin and write its frames to stdout."""
    job = np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False)
    tilt_x, tilt_y, *centre = map(float, job["plate"])
    scene = _SCENES[str(job["name"])](Plate(tilt_x, tilt_y, (centre[0], centre[1], centre[2])))
    width, height = map(int, job["size"])
    trails = np.split(job["trails"], np.cumsum(job["lengths"])[:-1])
    frames = io.BytesIO()
    with engine().Renderer(scene.model, height, width) as renderer:
        shots = [_shot(scene, renderer, posture, trail) for posture, trail in zip(job["postures"], trails, strict=True)]
    np.save(frames, np.stack(shots))
    sys.stdout.buffer.write(frames.getvalue())


def _shot(scene: Scene, renderer: Any, posture: Array, trail: Array) -> Array:
    """Pixels (height, width, 3) at joint positions, with a line along (K, 3) positions relative to the plate."""
    scene.data.qpos[: len(posture)] = posture
    engine().mj_forward(scene.model, scene.data)
    renderer.update_scene(scene.data, "view")
    points = trail + scene.plate.centre + 0.003 * scene.plate.rotation[:, 2]
    for start, end in pairwise(points):
        _add_line(renderer.scene, start, end)
    return np.asarray(renderer.render()).copy()


def _add_line(drawn: Any, start: Array, end: Array) -> None:
    mujoco = engine()
    if drawn.ngeom >= drawn.maxgeom:
        return
    geom = drawn.geoms[drawn.ngeom]
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    mujoco.mjv_initGeom(geom, capsule, np.zeros(3), np.zeros(3), np.zeros(9), np.array(_TRAIL, np.float32))
    mujoco.mjv_connector(geom, capsule, 0.004, start, end)
    drawn.ngeom += 1

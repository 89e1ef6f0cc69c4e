"""A scene in the browser with a policy that runs; needs the extra ``live``."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from io import StringIO
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Array, require_extra
from ..base.errors import InvalidDataError
from ..constraints import Plane
from ..evaluation import verdicts
from ..models import SUPPORTED
from ..recordings import Demonstration
from .scene import LIGHT, PATCH, Scene, rgb_of, step_of

STEPS, FRAME_S, DASH = 400, 1 / 30, 6
"""Of a movement; seconds that each is shown; how many are a dash, and the gap after it."""

INK, GREY = (29, 33, 38), (150, 155, 162)


def serve(scene: Scene, robot: str | None, told: Callable[[str], object], port: int | None = None) -> None:
    """Show a scene to browsers on this machine until Ctrl-C.

    Parameters
    ----------
    scene : Scene
    robot : str, optional
        URDF of the scene's arm, to be drawn.
    told : callable
        Gets the address.
    port : int, optional
        Where to listen, or at the first above it that is free.

    Raises
    ------
    MissingExtraError
        If viser is not installed.
    """
    viser = require_extra("viser", "live")
    with redirect_stdout(StringIO()):
        at = {} if port is None else {"port": port}
        server = viser.ViserServer(host="127.0.0.1", label="unconstrain", verbose=False, **at)
    try:
        shown = Live(server, scene, robot)
        with suppress(KeyboardInterrupt):
            told(f"http://127.0.0.1:{server.get_port()}")
            shown.run()
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


class Live:
    """What is on the page, and how far the movement is."""

    def __init__(self, server: Any, scene: Scene, robot: str | None) -> None:
        self._server, self._scene, self._stale = server, scene, True
        low, high = scene.bounds
        self._extent, middle = float((high - low).max()) or 1.0, (low + high) / 2
        extras: Any = require_extra("viser.extras", "live")
        self._robot = None if robot is None else extras.ViserUrdf(server, Path(robot), root_node_name="/robot")
        server.scene.set_up_direction("+z")
        server.initial_camera.look_at = middle
        server.initial_camera.position = middle + self._extent * np.array([0.6, -1.0, 0.7])
        for number, (colour, demo) in enumerate(zip(cycle(LIGHT), scene.demonstrations, strict=False)):
            colours = np.full((len(demo), 3), rgb_of(colour))
            self._draw(f"/demonstrations/{number}", scene.places(demo.states), colours, 0.004)
        self._draw_patches()
        self._make_controls(scene.moves and scene.arm is None and len(scene.columns) == 3)
        self._pose(scene.demonstrations[0].states[0])

    def run(self) -> None:
        """Let the policy move, over and over, from where the controls say."""
        row, track = 0, self._demo().states[:1]
        while True:
            if self._stale and self._scene.moves:
                self._stale, row, track = False, 0, self._follow()
            self._dot.position = self._scene.places(track[row : row + 1])[0]
            self._pose(track[row])
            row = (row + 1) % len(track)
            time.sleep(FRAME_S)

    def _make_controls(self, positions: bool) -> None:
        """Where it begins; of positions, also by a handle, and a plane to stay on."""
        gui, space = self._server.gui, self._server.scene
        self._says = gui.add_markdown("")
        self._named = {f"{k}: {demo.name}": demo for k, demo in enumerate(self._scene.demonstrations, start=1)}
        self._begin = gui.add_dropdown("Start of", list(self._named))
        self._held = gui.add_checkbox("On a plane", False, visible=positions)
        self._tilt = gui.add_slider("Tilt, °", -90, 90, 1, 0, visible=positions)
        self._turn = gui.add_slider("Turned by, °", 0, 360, 1, 0, visible=positions)
        self._dot = space.add_icosphere("/now", 0.015 * self._extent, INK, visible=self._scene.moves)
        size = 0.15 * self._extent
        self._grip = space.add_transform_controls("/start", size, disable_rotations=True, visible=positions)
        self._begin_anew(None)
        self._begin.on_update(self._begin_anew)
        for one in (self._held, self._tilt, self._turn, self._grip):
            one.on_update(self._restart)

    def _restart(self, _: Any) -> None:
        self._stale = True

    def _begin_anew(self, _: Any) -> None:
        self._grip.position = self._scene.places(self._demo().states[:1])[0]
        self._stale = True

    def _demo(self) -> Demonstration:
        """That from whose start it moves."""
        return self._named[self._begin.value]

    def _follow(self) -> Array:
        """Roll out anew, and draw it, grey and dashed where it is far from all data; returns the states."""
        demo, plane = self._demo(), Plane(self._normal()) if self._held.value else None
        start = np.array(self._grip.position) if self._grip.visible else demo.states[0]
        try:
            track, near = self._scene.follow(start, STEPS, step_of(demo) * len(demo) / STEPS, plane)
        except InvalidDataError as error:  # it leaves the finite numbers
            self._says.content = str(error)
            return start[None]
        self._says.content = "" if near is None else verdicts.of_support(near, track.times).said
        far = np.zeros(len(track), bool) if near is None else near < SUPPORTED
        kept = ~far[:-1] | (np.arange(len(far) - 1) // DASH % 2 == 0)
        self._draw("/movement", self._scene.places(track.states), np.where(far[:, None], GREY, INK), 0.008, kept)
        return track.states

    def _normal(self) -> Array:
        """The last axis, tilted, then turned about it."""
        tilt, turn = np.radians([self._tilt.value, self._turn.value])
        return np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])

    def _pose(self, state: Array) -> None:
        """Put the joints of the arm where the states say, all others at rest."""
        if self._robot is not None:
            angles = dict(zip(self._scene.arm.names, state, strict=True))
            names = self._robot.get_actuated_joint_names()
            self._robot.update_cfg(np.array([angles.get(name, 0.0) for name in names]))

    def _draw_patches(self) -> None:
        if (patches := self._scene.patches()) is not None:
            pieces = patches.pieces(self._scene, PATCH * self._extent)
            self._lines("/constraint", pieces, np.full((len(pieces), 2, 3), rgb_of(LIGHT[0])), 0.002)

    def _draw(self, name: str, places: Array, colours: Array, thick: float, kept: Any = slice(None)) -> None:
        points, shades = (np.stack([each[:-1], each[1:]], axis=1)[kept] for each in (places, colours))
        self._lines(name, points, shades, thick)

    def _lines(self, name: str, points: Array, colours: Array, thick: float) -> None:
        self._server.scene.add_line_segments(name, points, colours.astype(np.uint8), thickness=thick * self._extent)

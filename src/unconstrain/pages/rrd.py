"""A scene as a recording for the viewer rerun; needs the extra ``rerun``."""

from __future__ import annotations

from contextlib import suppress
from itertools import cycle
from typing import Any

import numpy as np

from ..base.arrays import require_extra
from ..base.errors import InvalidDataError
from ..recordings import Demonstration
from .scene import LIGHT, PATCH, Scene, rgb_of, step_of

INK = "#1d2126"


def recorded(scene: Scene) -> bytes:
    """Record demonstrations, what the policy makes of each, and what the constraint leaves free.

    Each has its way in space, a point that runs along it, and its states and actions over time: below
    ``demonstrations/NAME``, ``policy/NAME`` and ``constraint``. Bytes of a file that ends in ``.rrd``; a
    MissingExtraError where rerun is not installed.

    Parameters
    ----------
    scene : Scene
    """
    rr = require_extra("rerun", "rerun")
    stream = rr.RecordingStream("unconstrain")
    kept = stream.binary_stream()
    patches = scene.patches()
    for colour, demo in zip(cycle(LIGHT), scene.demonstrations, strict=False):
        _send(rr, stream, f"demonstrations/{rr.escape_entity_path_part(demo.name)}", scene, demo, colour)
    for demo in scene.demonstrations if scene.moves else ():
        with suppress(InvalidDataError):  # a movement that leaves the finite numbers
            _roll_out(rr, stream, scene, demo)
    if patches is not None:
        pieces = patches.pieces(scene, PATCH * float(np.subtract(*scene.bounds[::-1]).max()))
        stream.log("constraint", rr.LineStrips3D(pieces, colors=rgb_of(LIGHT[0])), static=True)
    return bytes(kept.read())


def _send(rr: Any, stream: Any, path: str, scene: Scene, demo: Demonstration, colour: str) -> None:
    places, clock = scene.places(demo.states), _clock(rr, demo)
    rgb = rgb_of(colour)
    stream.log(f"{path}/way", rr.LineStrips3D([places], colors=rgb), static=True)
    stream.send_columns(path, [clock], rr.Points3D.columns(positions=places, colors=[rgb] * len(places)))
    named = [*zip(scene.columns, demo.states.T, strict=True), *zip(scene.directions, demo.actions.T, strict=True)]
    for name, values in named:
        part = rr.escape_entity_path_part(name)
        stream.send_columns(f"{path}/{part}", [clock], rr.Scalars.columns(scalars=values))


def _roll_out(rr: Any, stream: Any, scene: Scene, demo: Demonstration) -> None:
    track, near = scene.follow(demo.states[0], len(demo), step_of(demo))
    path = f"policy/{rr.escape_entity_path_part(demo.name)}"
    _send(rr, stream, path, scene, track, INK)
    if near is not None:
        stream.send_columns(f"{path}/support", [_clock(rr, track)], rr.Scalars.columns(scalars=near))


def _clock(rr: Any, demo: Demonstration) -> Any:
    """Seconds from the first sample, or numbers of samples where no times are known."""
    if demo.times is None:
        return rr.TimeColumn("sample", sequence=np.arange(len(demo)))
    return rr.TimeColumn("time", duration=demo.times - demo.times[0])

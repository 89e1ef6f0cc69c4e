"""Surfaces that are wiped: by a simulated hand, or as recorded."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ... import simulation
from ...datasets import load_rim_wiping
from ...systems import wiping
from ...systems.wiping import HELD_OUT, PLATES, Plate, Strokes

if TYPE_CHECKING:
    from . import Settings


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface that was wiped.

    Parameters
    ----------
    name : str
    demonstrations : tuple of Demonstration
    normals : tuple of dict
        For each demonstration, unit normals by where they come from: "plane", and "tool" where it is known.
    """

    name: str
    demonstrations: tuple[uc.Demonstration, ...]
    normals: tuple[dict[str, Array], ...]


def has_physics() -> bool:
    """Whether the physics engine and its inverse kinematics are installed."""
    return all(find_spec(name) is not None for name in ("mujoco", "mink"))


def strokes(settings: Settings) -> Strokes:
    """How simulated plates are wiped."""
    return Strokes(
        count=settings.strokes, duration=settings.duration, rate=settings.rate,
        noise=settings.noise, dropped=settings.dropped,
    )  # fmt: skip


def simulated_split(settings: Settings, seed: np.random.SeedSequence) -> tuple[list[Surface], list[Surface]]:
    """Plates to learn from, and plates to be tested on."""
    how = strokes(settings)
    demonstrate = simulation.demonstrate if settings.contact else wiping.demonstrate
    extra = () if settings.extra is None else (settings.extra,)
    wiped = {
        plate: demonstrate(plate, np.random.default_rng(child), strokes=how)
        for plate, child in zip((*PLATES, *extra), seed.spawn(len(PLATES) + len(extra)), strict=True)
    }
    return (
        [_surface(plate, wiped[plate]) for plate in PLATES if plate not in HELD_OUT],
        [_surface(plate, wiped[plate]) for plate in (*HELD_OUT, *extra)],
    )


def recorded_splits(settings: Settings) -> list[tuple[list[Surface], list[Surface]]]:
    """The recorded bouts, with each tilt in turn held out."""
    bouts = load_rim_wiping(download=settings.download, rate=settings.rate, centre=True)
    surfaces = []
    for group in dict.fromkeys(bout.tilt for bout in bouts):
        of_group = [bout for bout in bouts if bout.tilt == group]
        normals = tuple({"plane": bout.plane_normal, "tool": bout.tool_normal} for bout in of_group)
        surfaces.append(Surface(group, tuple(bout.demonstration for bout in of_group), normals))
    return [([s for s in surfaces if s is not out], [out]) for out in surfaces]


def _surface(plate: Plate, demonstration: uc.Demonstration) -> Surface:
    return Surface(plate.name, (demonstration,), ({"plane": plate.rotation[:, 2]},))

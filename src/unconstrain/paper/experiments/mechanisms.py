"""Simulated mechanisms: is the kind found, are parameters inside their intervals, is the confidence deserved.

Movements are strokes at minimum jerk with pauses, of 50 to 2000 samples, on mechanisms anywhere in space: lines and
patches of 0.1 to 0.8 m, arcs of 30 to 300 degrees with radii from 0.05 to 1 m, screws of a quarter to three turns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import unconstrain as uc

from ...base.arrays import Array
from .trials import Progress, run_trials

NOISE = 2e-3
"""On each coordinate, m."""

TURN_NOISE = np.radians(0.5)
"""On orientations about each axis, where they are recorded."""

LIKELY = 20.0
"""Odds from which a verdict counts as confident."""


class Shape(NamedTuple):
    """A movement in the frame of its mechanism, whose axis is z: positions (N, 3), m, and how far the tool turned."""

    positions: Array
    turned: Array
    radius: float = 0.0
    pitch: float = 0.0


class Simulated(NamedTuple):
    """A recording, and what is true of it.

    Parameters
    ----------
    positions : ndarray, shape (N, D)
    orientations : ndarray, shape (N, 4), or None
    axis, point : ndarray, shape (D,)
        The axis and a point of it.
    radius, pitch : float
    """

    positions: Array
    orientations: Array | None
    axis: Array
    point: Array
    radius: float
    pitch: float


def strokes(rng: np.random.Generator, samples: int, dimensions: int) -> Array:
    """Between places of [-1, 1] in each dimension, both ends among them, at minimum jerk with pauses."""
    count = int(rng.integers(4, 10) if dimensions > 1 else rng.integers(1, 5))
    places = rng.uniform(-1, 1, (count + 1, dimensions))
    for dimension in range(dimensions):
        places[rng.permutation(count + 1)[:2], dimension] = -1, 1
    begin = np.cumsum(rng.uniform(0, 0.4, count) + np.append(0.0, rng.uniform(0.5, 1.5, count - 1)))
    lasting = np.append(np.diff(begin), 1.0) * rng.uniform(0.6, 1.0, count)
    clock = np.linspace(0, begin[-1] + lasting[-1] + rng.uniform(0, 0.4), samples)
    way = np.clip((clock[:, None] - begin) / lasting, 0, 1)
    return places[0] + (way**3 * (10 - 15 * way + 6 * way**2)) @ np.diff(places, axis=0)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _columns(*columns: Array | float) -> Array:
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def _point(_: np.random.Generator, samples: int, __: float) -> Shape:
    return Shape(np.zeros((samples, 3)), np.zeros(samples))


def _line(rng: np.random.Generator, samples: int, _: float) -> Shape:
    along = rng.uniform(0.05, 0.4) * strokes(rng, samples, 1)[:, 0]
    return Shape(_columns(0.0, 0.0, along), np.zeros(samples))


def _plane(rng: np.random.Generator, samples: int, _: float) -> Shape:
    first, second = (rng.uniform(0.05, 0.3, 2) * strokes(rng, samples, 2)).T
    return Shape(_columns(first, second, 0.0), np.zeros(samples))


def _circle(rng: np.random.Generator, samples: int, arc: float) -> Shape:
    radius, angle = _between(rng, 0.1, 1.0), arc / 2 * strokes(rng, samples, 1)[:, 0]
    return Shape(radius * _columns(np.cos(angle), np.sin(angle), 0.0), angle, radius)


def _sphere(rng: np.random.Generator, samples: int, arc: float) -> Shape:
    radius, wide = _between(rng, 0.1, 0.6), np.array([arc / 2, np.radians(rng.uniform(15, 60))])
    east, north = (wide * strokes(rng, samples, 2)).T
    positions = _columns(np.cos(east) * np.cos(north), np.sin(east) * np.cos(north), np.sin(north))
    return Shape(radius * positions, np.zeros(samples), radius)


def _cylinder(rng: np.random.Generator, samples: int, arc: float) -> Shape:
    radius, wide = _between(rng, 0.05, 0.5), np.array([arc / 2, rng.uniform(0.05, 0.25)])
    angle, height = (wide * strokes(rng, samples, 2)).T
    return Shape(_columns(radius * np.cos(angle), radius * np.sin(angle), height), np.zeros(samples), radius)


def _screw(rng: np.random.Generator, samples: int, _: float) -> Shape:
    radius, pitch = _between(rng, 0.02, 0.3), rng.choice([-1, 1]) * _between(rng, 0.02, 0.2) / (2 * np.pi)
    angle = rng.uniform(np.pi / 4, 3 * np.pi) * strokes(rng, samples, 1)[:, 0]
    return Shape(_columns(radius * np.cos(angle), radius * np.sin(angle), pitch * angle), angle, radius, pitch)


def _free(rng: np.random.Generator, samples: int, _: float) -> Shape:
    return Shape(rng.uniform(0.05, 0.3, 3) * strokes(rng, samples, 3), np.zeros(samples))


class Kind(NamedTuple):
    """A row of the table: its shape, what it ought to be called, and what of it is recorded."""

    shape: Callable[[np.random.Generator, int, float], Shape]
    name: str
    flat: bool = False
    poses: bool = False


KINDS = {
    "point": Kind(_point, "point"),
    "line": Kind(_line, "line"),
    "plane": Kind(_plane, "plane"),
    "circle": Kind(_circle, "circle"),
    "sphere": Kind(_sphere, "sphere"),
    "cylinder": Kind(_cylinder, "cylinder"),
    "screw": Kind(_screw, "screw"),
    "line in a plane": Kind(_line, "line", flat=True),
    "circle in a plane": Kind(_circle, "circle", flat=True),
    "slider, with poses": Kind(_line, "slider", poses=True),
    "hinge, with poses": Kind(_circle, "hinge", poses=True),
    "screw, with poses": Kind(_screw, "screw", poses=True),
}
"""What is simulated."""

FREE = Kind(_free, "free")
"""Nothing is held: not among the mechanisms, but what a verdict must not mistake for one."""


def simulate(rng: np.random.Generator, kind: Kind, arc: tuple[float, float] = (30.0, 300.0)) -> Simulated:
    """Draw a recording of a mechanism, the arc in degrees from an interval."""
    samples = int(_between(rng, 50, 2000))
    shape = kind.shape(rng, samples, float(np.radians(rng.uniform(*arc))))
    place = rng.uniform(-1, 1, 3)
    pose, tool = (Rotation.from_quat(quaternion) for quaternion in rng.standard_normal((2, 4)))
    wobble = Rotation.from_rotvec(TURN_NOISE * rng.standard_normal((samples, 3)))
    turned = Rotation.from_rotvec(_columns(0.0, 0.0, shape.turned))
    orientations = (wobble * pose * turned * tool).as_quat() * rng.choice([-1.0, 1.0], (samples, 1))
    positions, axis = pose.apply(shape.positions), pose.as_matrix()[:, 2]
    if kind.flat:  # seen along the axis of a circle, or across a line
        shown = [2, 0] if shape.radius == 0.0 else [0, 1]
        positions, place = shape.positions[:, shown], place[:2]
        axis = np.eye(3)[2, shown]
    positions = place + positions + NOISE * rng.standard_normal(positions.shape)
    return Simulated(positions, orientations if kind.poses else None, axis, place, shape.radius, shape.pitch)


def inside(found: Any, true: Simulated) -> Iterator[bool]:
    """Whether each parameter is inside its 95 % interval: lengths and angles of the mechanism's chart."""
    margins, covariance = found.margins, found.covariance
    axis = true.axis if "tilt" in margins else found.axis
    along = axis @ found.axis
    gap = true.point - found.centre
    across = found.frame[1:] @ (gap - axis * (gap @ found.axis) / along)
    if "pitch" in margins:  # heights on a screw are a matter of where angles begin
        directions = found.frame[1:] @ covariance[:3, :3] @ found.frame[1:].T
        margins = {**margins, "centre": found.quantile * np.sqrt(np.diag(directions))}
    off = {
        "centre": across if "pitch" in margins else gap,
        "across": across,
        "along": gap @ axis / along,
        "tilt": found.frame[1:] @ axis / along,
        "radius": found.radius - true.radius,
        "pitch": found.pitch - true.pitch,
    }
    for name, margin in margins.items():
        if name in off:
            yield from np.atleast_1d(np.abs(off[name]) <= margin).tolist()


def trial(name: str, seed: int, index: int) -> dict[str, Any]:
    """One mechanism: what was found, with which odds, and which parameters are inside their intervals."""
    kind = KINDS[name]
    simulated = simulate(np.random.default_rng([seed, index]), kind)
    found = uc.constraints.identify(simulated.positions, simulated.orientations, unit="m")
    right = found.kind == kind.name
    kept = list(inside(found.mechanism, simulated)) if right else []
    return {
        "kind": name,
        "samples": len(simulated.positions),
        "found": found.kind,
        "right": right,
        "odds": found.odds,
        "inside": sum(kept),
        "parameters": len(kept),
    }


def mechanisms(
    trials: int = 200, seed: int = 0, workers: int = 1, progress: Progress | None = None
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Simulate mechanisms of all kinds in turn.

    Returns
    -------
    rows : list of dict
        One for each kind and one for all: share whose kind is right, share of parameters inside their 95 % intervals,
        how many verdicts were confident and how many of these were wrong.
    single : list of dict
        Each mechanism.
    """
    names = list(KINDS)
    single = run_trials(trial, [(names[i % len(names)], seed, i) for i in range(trials)], workers, progress)
    groups = {name: [one for one in single if one["kind"] == name] for name in names}
    return [_row(name, group) for name, group in {**groups, "all": single}.items() if group], single


def normals(rate: float = 20.0) -> list[dict[str, Any]]:
    """The plane nearest to each bout of wiping the car rim, against the tool's axis, which shares nothing with it.

    Parameters
    ----------
    rate : float
        Samples per second.

    Returns
    -------
    list of dict
        For each bout the likeliest kind; the angle between both normals and its 95 % interval, degrees; the distance
        from the plane, m, root mean square: where it is millimetres, the surface is no plane. Beside it the same angle
        and distance of the quadratic surface nearest to the positions, at its mean normal.
    """
    rows = []
    for bout in uc.datasets.load_rim_wiping(rate=rate):
        found = uc.constraints.identify(bout.demonstration.states, unit="m")
        plane = next(one for one in found.candidates if one.kind == "plane")
        curved, off_curved = mean_normal(bout.demonstration.states, plane.mechanisms[0].axis)
        rows.append(
            {
                "bout": bout.name,
                "likeliest": found.kind,
                "angle": _angle(plane.mechanisms[0].axis, bout.tool_normal),
                "margin": float(np.degrees(plane.mechanisms[0].margins["tilt"].max())),
                "off_plane": plane.noise,
                "angle_curved": _angle(curved, bout.tool_normal),
                "off_curved": off_curved,
            }
        )
    return rows


def _angle(one: Array, other: Array) -> float:
    """Between two unit normals, whichever way they point, degrees."""
    return float(np.degrees(np.arccos(min(abs(float(one @ other)), 1.0))))


def mean_normal(positions: Array, normal: Array) -> tuple[Array, float]:
    """Mean normal of the quadratic surface nearest to positions along a normal, and their distance from it, rms."""
    frame = np.linalg.svd(normal[None])[2]  # the normal, and two directions across it
    height, *across = frame @ (positions - positions.mean(axis=0)).T
    surface = uc.Polynomial(2).place(np.stack(across, axis=1))
    design = surface(np.stack(across, axis=1))
    weights = np.linalg.lstsq(design, height, rcond=None)[0]
    step = 1e-6 * np.eye(2)
    slopes = [(surface(np.stack(across, axis=1) + one) - design).mean(axis=0) @ weights / 1e-6 for one in step]
    mean = np.array([1.0, *(-slope for slope in slopes)]) @ frame
    return mean / np.linalg.norm(mean), float(np.sqrt(np.mean((height - design @ weights) ** 2)))


def _row(name: str, group: Sequence[dict[str, Any]]) -> dict[str, Any]:
    confident = [one for one in group if one["odds"] >= LIKELY]
    parameters = sum(one["parameters"] for one in group)
    return {
        "kind": name,
        "mechanisms": len(group),
        "right": sum(one["right"] for one in group) / len(group),
        "inside": sum(one["inside"] for one in group) / max(parameters, 1),
        "parameters": parameters,
        "confident": len(confident),
        "confident_and_wrong": sum(not one["right"] for one in confident),
    }

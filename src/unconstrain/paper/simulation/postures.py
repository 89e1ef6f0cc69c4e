"""Inverse kinematics: postures that hold a sponge flat on a plate, or the reason why there are none."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from ...base.arrays import Array
from ...base.errors import SettingError
from ..systems.arm import LWR3, Arm
from ..systems.wiping import Plate
from .scene import TOOL

__all__ = ["MARGIN", "TILT_WEIGHT", "follow", "in_plane", "postures_along"]

MARGIN = np.radians(3.0)
"""Postures stay this far from the joint limits, rad."""

CLOSE = 1e-3
"""A point is reached to this, m."""

UPRIGHT = 0.15
"""The sponge may stand askew by this where a joint is at its limit, rad."""

TILT_WEIGHT = 0.2
"""What being askew by a radian counts, against being a metre away."""

_TRIES = 64
_CANDIDATES = 8
_STEPS = 150


def in_plane(normal: Array) -> Array:
    """Two unit vectors that span the plane, as rows, shape (2, 3)."""
    return np.linalg.svd(normal[None, :])[2][1:]


def follow(points: Array, plate: Plate, start: Array, arm: Arm = LWR3) -> Array:
    """Postures that put the sponge on each of several points in turn, each near the one before it.

    Parameters
    ----------
    points : ndarray, shape (T, 3)
        Relative to the plate's centre, m.
    plate : Plate
    start : ndarray, shape (n,)
        Where to search from, rad.
    arm : Arm

    Returns
    -------
    ndarray, shape (T, n)
        rad.

    Raises
    ------
    SettingError
        If a point is out of reach, with how far, and which joint stops it.
    """
    postures = np.empty((len(points), arm.joints))
    for at, point in enumerate(points):
        found, off, tilted = _solved(start[None, :], point, plate, arm)
        if off[0] > CLOSE or tilted[0] > UPRIGHT:
            raise SettingError(_reason(point, plate, found[0], float(off[0]), float(tilted[0]), arm))
        start = postures[at] = found[0]
    return postures


def postures_along(points: Array, plate: Plate, arm: Arm = LWR3) -> tuple[Array, Array]:
    """A resting posture, and postures that reach each of several points from it.

    Of those that put the sponge on the plate's centre, the most comfortable
    one (far from the joints' limits, with the links above plate and floor)
    from which the arm gets everywhere.

    Parameters
    ----------
    points : ndarray, shape (T, 3)
        Relative to the plate's centre, m.
    plate : Plate
    arm : Arm

    Returns
    -------
    rest : ndarray, shape (n,)
        rad.
    postures : ndarray, shape (T, n)
        rad.

    Raises
    ------
    SettingError
        If there is none, with how far a point is out of reach, and which joint stops the arm.
    """
    tries = np.random.default_rng(0).uniform(0.5 * arm.lower, 0.5 * arm.upper, (_TRIES, arm.joints))
    found, off, tilted = _solved(tries, np.zeros(3), plate, arm)
    reached = found[(off < CLOSE) & (tilted < UPRIGHT)]
    if not len(reached):
        best = int(np.argmin(off + 0.1 * tilted))
        raise SettingError(_reason(np.zeros(3), plate, found[best], float(off[best]), float(tilted[best]), arm))
    candidates = reached[np.argsort(-_comfort(reached, plate, arm))[:_CANDIDATES]]
    for candidate in candidates[:-1]:
        with suppress(SettingError):
            return candidate, follow(points, plate, candidate, arm)
    return candidates[-1], follow(points, plate, candidates[-1], arm)


def _comfort(postures: Array, plate: Plate, arm: Arm) -> Array:
    """Room to the nearest limit as a share of its joint's range, and some for height, shape (K,)."""
    room = np.minimum(postures - arm.lower, arm.upper - postures) / (arm.upper - arm.lower)
    _, positions = arm.frames(postures)
    links = positions[2:-1]
    above = np.einsum("jit,i->jt", links - np.array(plate.centre)[:, None], plate.rotation[:, 2]).min(axis=0)
    return room.min(axis=1) + np.minimum(above, 0.15) + np.minimum(links[:, 2].min(axis=0), 0.15)


def _solved(postures: Array, point: Array, plate: Plate, arm: Arm) -> tuple[Array, Array, Array]:
    """Damped least squares from several postures at once; what is left of distance (m) and tilt (rad)."""
    normal = plate.rotation[:, 2]
    across = in_plane(normal)
    for step in range(_STEPS + 1):
        rotations, positions = arm.frames(postures)
        axis = rotations[-1][:, 2].T
        error = plate.centre + point - (positions[-1].T + TOOL * axis)
        turn = np.cross(axis, -normal)
        turn[(axis @ normal > 0) & (np.linalg.norm(turn, axis=1) < 0.5)] = across[0]  # upside down: any way round
        off = np.linalg.norm(error, axis=1)
        tilted = np.arccos(np.clip(-(axis @ normal), -1.0, 1.0))
        if step == _STEPS or (max(off.max() / CLOSE, tilted.max() / 0.02) < 0.1):
            break
        jacobian = arm.jacobian(postures)
        spins = jacobian[:, 3:]
        velocity = jacobian[:, :3] + TOOL * np.cross(spins, axis[:, :, None], axis=1)
        tasks = np.concatenate(
            [velocity, TILT_WEIGHT * across @ spins], axis=1
        )  # not turning about the tool's own axis
        wanted = np.column_stack([np.clip(error, -0.1, 0.1), TILT_WEIGHT * np.clip(turn, -0.3, 0.3) @ across.T])
        square = tasks @ np.swapaxes(tasks, 1, 2) + 1e-5 * np.eye(5)
        change = np.swapaxes(tasks, 1, 2) @ np.linalg.solve(square, wanted[..., None])
        postures = np.clip(postures + change[..., 0], arm.lower + MARGIN, arm.upper - MARGIN)
    return postures, off, tilted


def _reason(point: Array, plate: Plate, posture: Array, off: float, tilted: float, arm: Arm) -> str:
    where = ", ".join(f"{value:.2f}" for value in plate.centre + point)
    stuck = (posture <= arm.lower + 1.01 * MARGIN) | (posture >= arm.upper - 1.01 * MARGIN)
    joints = [name for name, at in zip(arm.names, stuck, strict=True) if at]
    because = f"with {' and '.join(joints)} at the limit" if joints else "with the arm stretched out"
    missing = [f"{100 * off:.1f} cm away"] if off > CLOSE else []
    missing += [f"{np.degrees(tilted):.0f}° askew"] if tilted > UPRIGHT else []
    return (
        f"plate {plate.name}: out of the arm's reach. At ({where}) m the sponge stays {' and '.join(missing)}, "
        f"{because}. Tilt the plate less or put it elsewhere."
    )

"""A learnt policy on the arm: wiping a plate in contact, and what can be measured of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import unconstrain as uc

from ...base.arrays import LARGEST, Array
from ...base.errors import InvalidDataError, SettingError
from ..systems.arm import LWR3
from ..systems.wiping import Plate
from .control import Controller, Gains
from .engine import engine
from .postures import postures_along
from .scene import HALF_PLATE, TIME_STEP, Scene, arm_scene

RECORD_EVERY = 5
"""The sponge is recorded every so many steps of the physics: 100 times a second."""

SETTLING_S = 0.5
"""Time to put the sponge down before the policy takes over."""


@dataclass(frozen=True, eq=False)
class Wipe:
    """What the arm did.

    Parameters
    ----------
    plate : Plate
    times : ndarray, shape (T,)
        s.
    positions : ndarray, shape (T, 3)
        Of the sponge's face relative to the plate's centre, m.
    forces : ndarray, shape (T,)
        Normal force on the plate, N.
    postures : ndarray, shape (T, n)
        rad.
    planned : ndarray, shape (T, 3)
        Where the policy, under the plate's constraint and with nothing else to mind, would have been, m.
    torque_share : float
        Largest torque as a share of what its joint can.
    speed : float
        Simulated time over computing time.
    """

    plate: Plate
    times: Array
    positions: Array
    forces: Array
    postures: Array
    planned: Array
    torque_share: float
    speed: float

    def measures(self) -> dict[str, float]:
        """Contact, force, frequency and drift.

        Returns
        -------
        dict
            ``contact_share`` of the time; ``force_mean`` and ``force_sd`` (N);
            ``frequency`` (turns per second); ``spread_m``, the rms distance
            from the middle of the cycle; ``drift_m`` from the middle of the
            second cycle, as the first swings in, to that of the last;
            ``path_error_m``, the rms distance from the planned path.
        """
        steps = np.diff(self.times)[:, None]
        motion = uc.Demonstration(self.positions[:-1], np.diff(self.positions, axis=0) / steps)
        middles = centres(self.positions, self.plate)
        return {
            "contact_share": float((self.forces > 0).mean()),
            "force_mean": float(self.forces.mean()),
            "force_sd": float(self.forces.std()),
            "frequency": abs(turning(motion, self.plate.rotation[:, 2])),
            "spread_m": _spread(self.positions),
            "drift_m": float(np.linalg.norm(middles[-1] - middles[:2][-1])),
            "path_error_m": _distance(self.positions, self.planned),
            "cycles": float(len(middles)),
        }


def wipe(
    policy: Callable[[Array], Array], plate: Plate, start: Array, duration: float, gains: Gains | None = None
) -> Wipe:
    """Let the arm follow a policy on a plate; needs the extra ``sim``.

    Parameters
    ----------
    policy : callable
        Positions (N, 3) relative to the plate's centre, m, to velocities (N, 3), m/s.
    plate : Plate
    start : ndarray, shape (3,)
        Where the sponge is put down, relative to the plate's centre, m.
    duration : float
        s.
    gains : Gains, optional

    Returns
    -------
    Wipe

    Raises
    ------
    SettingError
        If the policy leaves the plate, or the arm's reach: with the reason.
    """
    chosen = gains or Gains()
    on_plate = start - plate.rotation[:, 2] * (plate.rotation[:, 2] @ start)
    planned = _plan(policy, plate, on_plate, duration)
    rest, along = postures_along(np.vstack([on_plate, planned[:: max(1, len(planned) // 100)]]), plate)
    scene = arm_scene(plate)
    scene.data.qpos[: LWR3.joints] = along[0]
    steadying = Controller(lambda states: 5.0 * (on_plate - states), scene, rest, chosen)
    _run(scene, steadying, round(SETTLING_S / (RECORD_EVERY * TIME_STEP)))
    began = time.perf_counter()
    positions, forces, postures, torques = _run(scene, Controller(policy, scene, rest, chosen), len(planned))
    speed = duration / (time.perf_counter() - began)
    times = RECORD_EVERY * TIME_STEP * np.arange(len(planned), dtype=np.float64)
    return Wipe(plate, times, positions, forces, postures, planned, torques, speed)


def turning(movement: uc.Demonstration, normal: Array) -> float:
    """Turns per second about the middle of a movement on a plane: its angular momentum over its moment of inertia."""
    lever = movement.states - movement.states.mean(axis=0)
    momentum = np.cross(lever, movement.actions) @ normal
    return float(momentum.sum() / (lever**2).sum() / (2.0 * np.pi))


def centres(positions: Array, plate: Plate) -> Array:
    """The middle of each full turn of a movement on a plate, shape (turns, 3).

    Raises
    ------
    InvalidDataError
        If it does not turn once.
    """
    flat = (positions - positions.mean(axis=0)) @ plate.rotation[:, :2]
    turns = np.unwrap(np.arctan2(flat[:, 1], flat[:, 0])) / (2.0 * np.pi)
    turns = np.abs(turns - turns[0])
    full = int(turns.max())
    if full < 1:
        raise InvalidDataError(f"the movement: got {turns.max():.1f} turns, expected at least one.")
    ends = np.searchsorted(np.maximum.accumulate(turns), np.arange(full + 1))
    # Averaged along the path: a turn's middle must not depend on where the sponge is slow.
    steps = np.diff(positions, axis=0)
    lengths, middles = np.linalg.norm(steps, axis=1, keepdims=True), positions[:-1] + 0.5 * steps
    return np.stack(
        [
            (lengths[a:b] * middles[a:b]).sum(axis=0) / lengths[a:b].sum()
            for a, b in pairwise(np.minimum(ends, len(steps)))
        ]
    )


def _plan(policy: Callable[[Array], Array], plate: Plate, start: Array, duration: float) -> Array:
    """The policy's own path under the plate's constraint, recorded as the arm's is."""
    every = RECORD_EVERY * TIME_STEP
    samples = round(duration / every)
    try:
        path = uc.rollout(policy, start, samples, every, plate.constraint).states
    except InvalidDataError:
        path = np.full((samples, 3), LARGEST)
    outside = np.abs(path @ plate.rotation[:, :2]).max(axis=1) > HALF_PLATE
    if outside.any():
        raise SettingError(
            f"plate {plate.name}: the policy leaves it (it reaches {HALF_PLATE} m to each side) "
            f"after {every * outside.argmax():.1f} s."
        )
    return path


def _run(scene: Scene, controller: Controller, samples: int) -> tuple[Array, Array, Array, float]:
    """Positions, forces, postures, and the largest share of a torque."""
    mujoco = engine()
    model, data = scene.model, scene.data
    positions, forces, postures = np.empty((samples, 3)), np.empty(samples), np.empty((samples, LWR3.joints))
    largest = 0.0
    for step in range(samples * RECORD_EVERY):
        mujoco.mj_step1(model, data)
        if step % RECORD_EVERY == 0:
            at = step // RECORD_EVERY
            positions[at], forces[at], postures[at] = scene.face, scene.force, data.qpos[: LWR3.joints]
        data.ctrl[:] = controller.torques()
        largest = max(largest, float((np.abs(data.ctrl) / model.actuator_ctrlrange[:, 1]).max()))
        mujoco.mj_step2(model, data)
    return positions, forces, postures, largest


def _spread(positions: Array) -> float:
    return float(np.sqrt(((positions - positions.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _distance(path: Array, other: Array) -> float:
    """Root mean square distance of a path's points from the other path."""
    from scipy.spatial import KDTree

    nearest, _ = KDTree(other).query(path)
    return float(np.sqrt((nearest**2).mean()))

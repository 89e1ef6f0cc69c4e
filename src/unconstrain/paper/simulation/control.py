"""A torque controller that lets an arm follow a policy along a plate with a steady force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Array
from ..systems.arm import LWR3, Arm
from .engine import engine
from .postures import MARGIN, TILT_WEIGHT, in_plane
from .scene import Scene

__all__ = ["Controller", "Gains", "joint_velocity"]


@dataclass(frozen=True)
class Gains:
    """What the arm does beside following the policy.

    Parameters
    ----------
    force : float
        To press with, N.
    yielding : float
        Admittance: velocity along the normal for each newton of force error, m/s/N.
    upright : float
        How fast the tool turns to stand on the plate, 1/s.
    posture : float
        How fast the arm returns to its resting posture where the tasks leave it free, 1/s.
    stiffness : float
        Of the velocity loop of the joints, 1/s.
    every : int
        The policy is asked anew after so many steps of the controller.
    """

    force: float = 15.0
    yielding: float = 0.004
    upright: float = 8.0
    posture: float = 1.0
    stiffness: float = 150.0
    every: int = 2


class Controller:
    """Torques for one step after another.

    The policy's velocity is projected onto the plate. Along the normal the
    arm yields until the sponge presses as it should. Both, and standing on the
    plate, become joint velocities by damped least squares; what these tasks
    leave free returns to a resting posture; joints stop before their limits.
    An inverse-dynamics velocity loop makes torques of them.

    Parameters
    ----------
    policy : callable
        Positions (1, 3) relative to the plate's centre, m, to velocities (1, 3), m/s.
    scene : Scene
        With the arm.
    rest : ndarray, shape (n,)
        The resting posture, rad.
    gains : Gains, optional
    arm : Arm
    """

    def __init__(
        self, policy: Callable[[Array], Array], scene: Scene, rest: Array, gains: Gains | None = None, arm: Arm = LWR3
    ) -> None:
        self.gains = gains or Gains()
        self._policy, self._scene, self._rest, self._arm = policy, scene, rest, arm
        self._normal = scene.plate.rotation[:, 2]
        self._tangent = np.eye(3) - np.outer(self._normal, self._normal)
        self._across = in_plane(self._normal)
        self._mujoco = engine()
        self._jacobian = np.zeros((6, scene.model.nv))
        self._inertia = np.zeros((scene.model.nv, scene.model.nv))
        self._face = scene.model.site("face").id
        self._velocity, self._step = np.zeros(3), 0

    def torques(self) -> Array:
        """Torques for the scene as it is, shape (n,), N m."""
        model, data, gains, joints = self._scene.model, self._scene.data, self.gains, self._arm.joints
        if self._step % gains.every == 0:
            self._velocity = self._tangent @ self._policy(self._scene.face[None])[0]
        self._step += 1
        self._mujoco.mj_jacSite(model, data, self._jacobian[:3], self._jacobian[3:], self._face)
        jacobian = self._jacobian[:, :joints]
        tool = data.site_xmat[self._face].reshape(3, 3)[:, 2]
        tasks = np.vstack([jacobian[:3], TILT_WEIGHT * self._across @ jacobian[3:]])
        along = gains.yielding * (self._scene.force - gains.force)
        upright = TILT_WEIGHT * self._across @ np.cross(tool, -self._normal)
        wanted = np.concatenate([self._velocity + along * self._normal, gains.upright * upright])
        posture = data.qpos[:joints]
        velocity = joint_velocity(tasks, wanted, gains.posture * (self._rest - posture), posture, self._arm)
        self._mujoco.mj_fullM(model, data, self._inertia)
        pull = gains.stiffness * (velocity - data.qvel[:joints])
        pressed = jacobian[:3].T @ (gains.force * self._normal)  # what the plate is about to push back with
        held = data.qfrc_bias[:joints] - data.qfrc_passive[:joints]  # weight and joint friction
        return self._inertia[:joints, :joints] @ pull + held - pressed


def joint_velocity(
    tasks: Array, wanted: Array, rest: Array, posture: Array, arm: Arm, *, damping: float = 1e-4, within: float = 0.1
) -> Array:
    """Joint velocities for a task, with what it leaves free for another, inside the joint limits.

    A joint that would come nearer to a limit than it may within the next
    moment is slowed down, and the others make up for it.

    Parameters
    ----------
    tasks : ndarray, shape (k, n)
    wanted : ndarray, shape (k,)
    rest : ndarray, shape (n,)
        Velocity for what the task leaves free, rad/s.
    posture : ndarray, shape (n,)
        rad.
    arm : Arm
    damping : float
        Of the least squares, near singular postures.
    within : float
        The moment, s.

    Returns
    -------
    ndarray, shape (n,)
        rad/s.
    """
    lowest, highest = ((limit - posture) / within for limit in (arm.lower + MARGIN, arm.upper - MARGIN))
    free, velocity = np.ones(len(posture), bool), np.zeros(len(posture))
    while True:
        moving = tasks[:, free]
        solve = np.linalg.solve(moving @ moving.T + damping * np.eye(len(tasks)), np.eye(len(tasks)))
        missing = wanted - tasks[:, ~free] @ velocity[~free] - moving @ rest[free]
        velocity[free] = rest[free] + moving.T @ (solve @ missing)
        beyond = np.maximum(velocity - highest, lowest - velocity)
        worst = int(np.where(free, beyond, -np.inf).argmax())
        if not free[worst] or beyond[worst] <= 1e-12:
            return velocity
        velocity[worst] = np.clip(velocity[worst], lowest[worst], highest[worst])
        free[worst] = False
        if not free.any():
            return velocity

"""A torque controller that lets an arm follow a policy along a plate with a steady force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Array
from ..systems.arm import LWR3
from .engine import engine
from .postures import Reach
from .scene import Scene

MOMENT = 0.1
"""The controller looks ahead by this: a joint may not go so fast that it would be at its limit sooner, s."""


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
        How fast the tool turns to stand on the plate, 1/s; at most 10.
    posture : float
        How fast the arm returns to its resting posture where the tasks leave it free, 1/s; at most 10.
    stiffness : float
        Of the velocity loop of the joints, 1/s.
    every : int
        The policy is asked, and joint velocities are found, anew after so many steps of the torque loop.
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
    arm yields until the sponge presses as it should. :class:`Reach` makes
    joint velocities of both, and an inverse-dynamics velocity loop makes
    torques of these.

    Parameters
    ----------
    policy : callable
        Positions (1, 3) relative to the plate's centre, m, to velocities (1, 3), m/s; one that can, is told of the
        plate, see :func:`unconstrain.rollout`.
    scene : Scene
        With the arm.
    rest : ndarray, shape (n,)
        The resting posture, rad.
    gains : Gains, optional
    """

    def __init__(self, policy: Callable[[Array], Array], scene: Scene, rest: Array, gains: Gains | None = None) -> None:
        self.gains = gains or Gains()
        self._scene = scene
        self._reach = Reach(scene.plate, rest, MOMENT * self.gains.upright, MOMENT * self.gains.posture)
        self._normal = scene.plate.rotation[:, 2]
        self._tangent = np.eye(3) - np.outer(self._normal, self._normal)
        under = getattr(policy, "under", None)
        self._policy = policy if under is None else lambda places: under(places, self._tangent[None])
        self._mujoco = engine()
        self._jacobian = np.zeros((3, scene.model.nv))
        self._inertia = np.zeros((scene.model.nv, scene.model.nv))
        self._face = scene.model.site("face").id
        self._velocity, self._step = np.zeros(LWR3.joints), 0

    def torques(self) -> Array:
        """Torques for the scene as it is, shape (n,), N m."""
        model, data, joints = self._scene.model, self._scene.data, LWR3.joints
        if self._step % self.gains.every == 0:
            self._velocity = self._joint_velocity()
        self._step += 1
        self._mujoco.mj_fullM(model, data, self._inertia)
        pull = self.gains.stiffness * (self._velocity - data.qvel[:joints])
        self._mujoco.mj_jacSite(model, data, self._jacobian, None, self._face)
        # What the plate is about to push back with.
        pressed = self._jacobian[:, :joints].T @ (self.gains.force * self._normal)
        held = data.qfrc_bias[:joints] - data.qfrc_passive[:joints]  # weight and joint friction
        return self._inertia[:joints, :joints] @ pull + held - pressed

    def _joint_velocity(self) -> Array:
        """The policy's velocity along the plate and the yielding across it as joint velocities, rad/s, shape (n,)."""
        along = self._tangent @ self._policy(self._scene.face[None])[0]
        across = self.gains.yielding * (self._scene.force - self.gains.force) * self._normal
        self._reach.arm.update(self._scene.data.qpos[: LWR3.joints])
        return self._reach.change(MOMENT * (along + across)) / MOMENT

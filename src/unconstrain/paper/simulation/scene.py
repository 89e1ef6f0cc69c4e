"""Plates, a sponge, a hand and the arm, as the physics engine sees them.

Lengths in m, masses in kg, forces in N. The arm has the kinematics of
:data:`~unconstrain.paper.systems.arm.LWR3`; its links are plain shapes with masses
and torques of about the real arm's size (14 kg in all).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...base.arrays import Array
from ..systems.arm import LWR3, Arm
from ..systems.wiping import Plate
from .engine import engine

TIME_STEP = 0.002
"""Of the physics and of the torque controller, s."""

HALF_PLATE = 0.2
SPONGE_RADIUS = 0.035
SPONGE_STIFFNESS = 1500.0
SPONGE_DAMPING = 60.0
SPONGE_MASS = 0.1
FRICTION = 0.03
"""Of a wet sponge on paint."""

HOLDER = 0.05
TOOL = HOLDER + SPONGE_RADIUS
"""From the arm's flange to the face of the sponge at rest, m."""

LINK_MASSES = (2.7, 2.7, 2.7, 2.7, 1.7, 1.6, 0.3)
TORQUES = (176.0, 176.0, 100.0, 100.0, 100.0, 38.0, 38.0)
"""Largest joint torques, N m."""

HAND_MASS = 0.5

_CAMERA, _LOOKED_AT = (1.6, -1.25, 1.2), (0.33, 0.0, 0.36)
_ORANGE, _GREY, _DARK = (0.93, 0.47, 0.16, 1), (0.75, 0.76, 0.78, 1), (0.22, 0.24, 0.28, 1)
_BLUE, _YELLOW, _SKIN = (0.36, 0.55, 0.75, 1), (0.97, 0.82, 0.28, 1), (0.86, 0.67, 0.55, 1)


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled scene and its state.

    Parameters
    ----------
    model, data
        The engine's ``MjModel`` and ``MjData``.
    plate : Plate
    """

    model: Any
    data: Any
    plate: Plate

    @property
    def face(self) -> Array:
        """Middle of the sponge's face relative to the middle of the plate, shape (3,)."""
        return self.data.site("face").xpos - self.plate.centre

    @property
    def force(self) -> float:
        """Normal force between sponge and plate, N."""
        return float(self.data.sensor("pressure").data[0])


def hand_scene(plate: Plate) -> Scene:
    """A hand that holds the sponge flat on a plate and moves freely in three directions."""
    mujoco = engine()
    spec = _room(mujoco, plate)
    hand = spec.worldbody.add_body(name="hand", pos=plate.centre, quat=_facing(plate), gravcomp=1.0)
    for axis, name in enumerate("xyz"):
        # Slides along the world's axes, told in the hand's own frame.
        hand.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=_rotation(plate).inv().apply(np.eye(3)[axis]))
    hand.add_geom(
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=[0.05, 0.035, 0.02], pos=[0, 0, -0.03], rgba=_SKIN, mass=HAND_MASS,
        contype=0, conaffinity=0,
    )  # fmt: skip
    hand.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[-0.04, 0, -0.04, -0.28, 0, -0.16], size=[0.028, 0, 0], rgba=_SKIN,
        mass=0, contype=0, conaffinity=0,
    )  # fmt: skip
    _sponge(mujoco, spec, hand, 0.0)
    return _compiled(mujoco, spec, plate)


def arm_scene(plate: Plate, arm: Arm = LWR3) -> Scene:
    """The arm with the sponge at its flange, on a pedestal before the plate; a torque for each joint."""
    mujoco = engine()
    spec = _room(mujoco, plate)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=[0, 0, 0, 0, 0, 0.06], size=[0.09, 0, 0], rgba=_DARK,
        contype=0, conaffinity=0,
    )  # fmt: skip
    _arm(mujoco, spec, arm)
    return _compiled(mujoco, spec, plate)


def arm_alone(arm: Arm = LWR3) -> Any:
    """The arm with a sponge that does not give, and nothing around it: the engine's model, for kinematics."""
    mujoco = engine()
    spec = _radians(mujoco)
    _arm(mujoco, spec, arm)
    spec.delete(spec.joint("sponge"))
    return spec.compile()


def _room(mujoco: Any, plate: Plate) -> Any:
    """Floor, light, camera and the plate on a post."""
    spec = _radians(mujoco)
    spec.option.timestep = TIME_STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 960
    spec.visual.map.shadowclip, spec.visual.quality.shadowsize = 2.5, 4096
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.visual.headlight.diffuse = [0.3, 0.3, 0.3]
    spec.stat.center, spec.stat.extent = [0.35, 0.0, 0.4], 1.2
    spec.add_texture(
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[1.0, 1.0, 1.0], rgb2=[0.86, 0.89, 0.93], width=64, height=384,
    )  # fmt: skip
    world = spec.worldbody
    world.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=[0, 0, 2.5], dir=[0.2, 0.35, -0.9], diffuse=[0.5, 0.5, 0.5],
        specular=[0.1, 0.1, 0.1],
    )  # fmt: skip
    world.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1], rgba=[0.93, 0.94, 0.95, 1], contype=0, conaffinity=0
    )
    held = world.add_body(name="plate", pos=plate.centre, quat=_quaternion(plate.rotation))
    held.add_geom(
        name="plate", type=mujoco.mjtGeom.mjGEOM_BOX, size=[HALF_PLATE, HALF_PLATE, 0.008], pos=[0, 0, -0.008],
        rgba=_BLUE, friction=[FRICTION, 0.0, 0.0], contype=1, conaffinity=1,
    )  # fmt: skip
    world.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.02, 0, 0],
        fromto=[*plate.centre[:2], 0, *(plate.centre - 0.02 * plate.rotation[:, 2])],
        rgba=_DARK, contype=0, conaffinity=0,
    )  # fmt: skip
    world.add_camera(name="view", pos=_CAMERA, fovy=33, xyaxes=_look())
    return spec


def _radians(mujoco: Any) -> Any:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    return spec


def _arm(mujoco: Any, spec: Any, arm: Arm) -> None:
    """Links, flange and sponge."""
    body = spec.worldbody
    for joint in range(arm.joints):
        body = _link(mujoco, spec, body, arm, joint)
    flange = arm.origins[-1]
    tool = body.add_body(name="flange", pos=flange[:3, 3], quat=_quaternion(flange[:3, :3]))
    tool.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=[0, 0, 0, 0, 0, HOLDER - 0.015], size=[0.02, 0, 0], rgba=_DARK,
        mass=0.2, contype=0, conaffinity=0,
    )  # fmt: skip
    _sponge(mujoco, spec, tool, HOLDER)


def _link(mujoco: Any, spec: Any, parent: Any, arm: Arm, joint: int) -> Any:
    """One joint and the link that it moves."""
    origin, to = arm.origins[joint], arm.origins[joint + 1][:3, 3]
    name = arm.names[joint]
    body = parent.add_body(name=name, pos=origin[:3, 3], quat=_quaternion(origin[:3, :3]))
    body.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=arm.axes[joint],
        range=[arm.lower[joint], arm.upper[joint]], armature=0.05, damping=0.5,
    )  # fmt: skip
    shell = {"rgba": _ORANGE if joint % 2 else _GREY, "contype": 0, "conaffinity": 0}
    long = bool(np.linalg.norm(to) > 0.01)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.065 - 0.004 * joint, 0, 0],
        mass=LINK_MASSES[joint] * (0.4 if long else 1.0), **shell,
    )  # fmt: skip
    if long:
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, *to], size=[0.055 - 0.004 * joint, 0, 0],
            mass=LINK_MASSES[joint] * 0.6, **shell,
        )  # fmt: skip
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.ctrllimited, motor.ctrlrange = True, [-TORQUES[joint], TORQUES[joint]]
    return body


def _sponge(mujoco: Any, spec: Any, parent: Any, at: float) -> None:
    """A round pad on a damped spring: it gives by a millimetre for each 1.5 N."""
    pad = parent.add_body(name="sponge", pos=[0, 0, at])
    pad.add_joint(
        name="sponge", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], range=[-0.03, 0.01],
        stiffness=SPONGE_STIFFNESS, damping=SPONGE_DAMPING,
    )  # fmt: skip
    pad.add_geom(
        name="sponge", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[SPONGE_RADIUS, 0, 0], mass=SPONGE_MASS,
        friction=[FRICTION, 0.0, 0.0], rgba=(0, 0, 0, 0), contype=1, conaffinity=1,
    )  # fmt: skip
    pad.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.05, 0.035, 0.0125], pos=[0, 0, SPONGE_RADIUS - 0.0125], rgba=_YELLOW,
        mass=0, contype=0, conaffinity=0,
    )  # fmt: skip
    pad.add_site(name="face", pos=[0, 0, SPONGE_RADIUS], size=[0.001, 0, 0], rgba=(0, 0, 0, 0))
    pad.add_site(name="skin", size=[1.2 * SPONGE_RADIUS, 0, 0], rgba=(0, 0, 0, 0))
    spec.add_sensor(
        name="pressure", type=mujoco.mjtSensor.mjSENS_TOUCH, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="skin"
    )


def _compiled(mujoco: Any, spec: Any, plate: Plate) -> Scene:
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Scene(model, data, plate)


def _rotation(plate: Plate) -> Rotation:
    """Of a tool whose z points into the plate."""
    return Rotation.from_matrix(plate.rotation @ np.diag([1.0, -1.0, -1.0]))


def _facing(plate: Plate) -> Array:
    return _quaternion(_rotation(plate).as_matrix())


def _quaternion(rotation: Array) -> Array:
    """(w, x, y, z)."""
    return np.asarray(Rotation.from_matrix(rotation).as_quat(scalar_first=True))


def _look() -> Array:
    """The camera's right and up, looking at the plate from the side."""
    back = np.array(_CAMERA) - np.array(_LOOKED_AT)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back / np.linalg.norm(back), right)
    return np.concatenate([right, up])

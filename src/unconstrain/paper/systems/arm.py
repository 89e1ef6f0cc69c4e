"""Serial arms, and the joint-limit avoidance of section IV-B.

Kinematics for a batch of postures at a time: the only loop is over joints.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...base.arrays import Array, as_vector, require_extra
from ...base.errors import ReadError, SettingError
from ...base.foreign import ours_alone

_HINGES = {"revolute": False, "continuous": False, "prismatic": True}


@dataclass(frozen=True, eq=False)
class Arm:
    """A chain of joints, from the base to a tip.

    Each joint has a frame that is fixed to the link before it, and turns
    about (or slides along) an axis of that frame.

    Parameters
    ----------
    origins : ndarray, shape (n + 1, 4, 4)
        Each joint's frame in that of the joint before it, at rest; the last
        one is the tip in the last joint's frame. Lengths in m.
    axes : ndarray, shape (n, 3)
        Unit axes, each in its joint's frame.
    lower, upper : ndarray, shape (n,)
        Joint limits, rad (or m); infinite where there are none.
    names : tuple of str
        Of the joints.
    slides : ndarray of bool, shape (n,), optional
        Which joints slide instead of turning.

    Examples
    --------
    >>> uc.systems.arm.Arm.from_dh(a=[1.0, 0.5], alpha=[0.0, 0.0], d=[0.0, 0.0], limits=[3.1, 3.1]).joints
    2
    """

    origins: Array
    axes: Array
    lower: Array
    upper: Array
    names: tuple[str, ...]
    slides: NDArray[np.bool_] | None = None

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.axes)

    @classmethod
    def from_dh(cls, a: ArrayLike, alpha: ArrayLike, d: ArrayLike, limits: ArrayLike) -> Arm:
        """Make an arm from standard Denavit-Hartenberg parameters.

        Each joint turns about z; then follow d along z, a along x and alpha about x.

        Parameters
        ----------
        a, alpha, d : array_like, shape (n,)
            m, rad, m.
        limits : array_like, shape (n,)
            Largest angle to either side, rad.
        """
        joints = np.size(d)
        lengths, twists, offsets, reach = (
            as_vector(values, name, joints)
            for values, name in ((a, "a"), (alpha, "alpha"), (d, "d"), (limits, "limits"))
        )
        links = np.tile(np.eye(4), (joints + 1, 1, 1))  # joint j's link stands in the origin of joint j + 1
        cosine, sine = np.cos(twists), np.sin(twists)
        links[1:, 1, 1], links[1:, 1, 2] = cosine, -sine
        links[1:, 2, 1], links[1:, 2, 2] = sine, cosine
        links[1:, 0, 3], links[1:, 2, 3] = lengths, offsets
        axes = np.tile([0.0, 0.0, 1.0], (joints, 1))
        return cls(links, axes, -reach, reach, tuple(f"joint{j + 1}" for j in range(joints)))

    @classmethod
    def from_urdf(cls, path: str | os.PathLike[str], tip: str, base: str | None = None) -> Arm:
        """Read the chain from a base to a tip from a URDF file; needs the extra ``arm``.

        Parameters
        ----------
        path : path
            The URDF; meshes are not needed.
        tip : str
            Name of the link at the end.
        base : str, optional
            Name of the link at the start, by default the root.

        Raises
        ------
        ReadError
            If the file is no URDF, or a joint on the way has no axis to move along.
        SettingError
            If a link does not exist, the base is not on the way to the tip, a
            joint on the way floats or moves in a plane, or one of them mimics another.
        """
        links, joints = _urdf(path)
        for link in (tip, base):
            if link is not None and link not in links:
                raise SettingError(f"{path}: has no link {link!r}; it has {', '.join(sorted(links))}.")
        into = {joint.child: joint for joint in joints}
        chain: list[_Joint] = []
        link = tip
        while link != base and link in into:
            chain.append(into[link])
            link = into[link].parent
            if len(chain) > len(into):
                raise ReadError(f"{path}: the joints that lead to {tip!r} make a ring, expected a tree.")
        if base is not None and link != base:
            raise SettingError(f"{path}: {base!r} is not on the way from the root to {tip!r}, but on another branch.")
        return _from_joints(chain[::-1], path, tip)

    def frames(self, postures: Array) -> tuple[Array, Array]:
        """Where the joints and the tip are.

        Parameters
        ----------
        postures : ndarray, shape (T, n)
            Joint angles, rad.

        Returns
        -------
        rotations : ndarray, shape (n + 1, 3, 3, T)
            Of each joint's frame before it moves, and of the tip.
        positions : ndarray, shape (n + 1, 3, T)
            m.

        Raises
        ------
        SettingError
            If the postures have another number of joints.
        """
        if np.ndim(postures) != 2 or postures.shape[1] != self.joints:
            raise SettingError(f"postures: got shape {np.shape(postures)}, expected (samples, {self.joints} joints).")
        rotations = np.empty((self.joints + 1, 3, 3, len(postures)))
        positions = np.empty((self.joints + 1, 3, len(postures)))
        rotation = np.broadcast_to(np.eye(3)[..., None], rotations.shape[1:])
        position = np.zeros(positions.shape[1:])
        slides = self.slides if self.slides is not None else np.zeros(self.joints, bool)
        for j, origin in enumerate(self.origins):
            position = position + _times(rotation, origin[:3, 3])[:, 0]
            rotation = _times(rotation, origin[:3, :3])
            rotations[j], positions[j] = rotation, position
            if j == self.joints:
                break
            if slides[j]:
                position = position + _times(rotation, self.axes[j])[:, 0] * postures[:, j]
            else:
                rotation = _turned(rotation, self.axes[j], postures[:, j])
        return rotations, positions

    def jacobian(self, postures: Array) -> Array:
        """Geometric Jacobian of the tip in the base's frame.

        Parameters
        ----------
        postures : ndarray, shape (T, n)
            Joint angles, rad.

        Returns
        -------
        ndarray, shape (T, 6, n)
            Rows 0 to 2: velocity of the tip for each joint's rate; rows 3 to 5: its angular velocity.
        """
        rotations, positions = self.frames(postures)
        axes = np.einsum("jikt,jk->jit", rotations[:-1], self.axes)
        lever = positions[-1] - positions[:-1]
        rows = np.empty((len(postures), 6, self.joints))
        velocity = (axes[:, [1, 2, 0]] * lever[:, [2, 0, 1]]) - (axes[:, [2, 0, 1]] * lever[:, [1, 2, 0]])
        rows[:, :3] = np.moveaxis(velocity, -1, 0).swapaxes(1, 2)
        rows[:, 3:] = np.moveaxis(axes, -1, 0).swapaxes(1, 2)
        if self.slides is not None and self.slides.any():
            rows[:, :3, self.slides] = rows[:, 3:, self.slides]
            rows[:, 3:, self.slides] = 0.0
        return rows


@dataclass(frozen=True)
class JointLimitAvoidance:
    """``π(x) = −gain ∇Φ`` with ``Φ = Σ |x_i|^power`` (section IV-B).

    Parameters
    ----------
    gain, power : float

    Examples
    --------
    >>> uc.systems.arm.JointLimitAvoidance(gain=0.05, power=2.0)(np.array([[1.0, -2.0]]))
    array([[-0.1,  0.2]])
    """

    gain: float = 0.05
    power: float = 1.8

    def __call__(self, states: Array) -> Array:
        """Joint velocities (N, n) at postures (N, n)."""
        return -self.gain * self.power * np.sign(states) * np.abs(states) ** (self.power - 1.0)


def _times(rotations: Array, right: Array) -> Array:
    """Products of rotations (3, 3, T) with one matrix (3, k) or vector (3,), shape (3, k, T)."""
    return np.matmul(np.reshape(right, (3, -1)).T, rotations)


def _turned(rotations: Array, axis: Array, angles: Array) -> Array:
    """Rotations (3, 3, T) followed by a turn about an axis of theirs: Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    across = _times(rotations, cross)
    return rotations + np.sin(angles) * across + (1.0 - np.cos(angles)) * _times(across, cross)


@dataclass(frozen=True)
class _Joint:
    """A joint as a URDF tells it."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float
    upper: float
    mimics: bool

    @property
    def is_told(self) -> bool:
        """Whether its place and axis are numbers, and its limits are not none."""
        of_place = np.isfinite(self.origin).all() and np.isfinite(self.axis).all()
        return bool(of_place and not np.isnan([self.lower, self.upper]).any())


def _urdf(path: str | os.PathLike[str]) -> tuple[set[str], list[_Joint]]:
    """Links and joints of a file."""
    reader = require_extra("yourdfpy", "arm")
    # What is no number does harm only on the way.
    with ours_alone(path, "a URDF", said="is no URDF that can be read", kinds=True), np.errstate(all="ignore"):
        robot = reader.URDF.load(os.fspath(path), load_meshes=False, build_scene_graph=False).robot
        return {str(link.name) for link in robot.links}, [_joint(one) for one in robot.joints]


def _joint(one: Any) -> _Joint:
    ends = (-np.inf, np.inf)
    if one.limit is not None and one.type != "continuous":
        ends = (float(one.limit.lower or 0.0), float(one.limit.upper or 0.0))
    axis = np.array([1.0, 0.0, 0.0] if one.axis is None else one.axis, dtype=np.float64).reshape(3)
    origin = np.array(np.eye(4) if one.origin is None else one.origin, dtype=np.float64).reshape(4, 4)
    return _Joint(str(one.name), str(one.type), one.parent, one.child, origin, axis, *ends, one.mimic is not None)


def _from_joints(chain: list[_Joint], path: str | os.PathLike[str], tip: str) -> Arm:
    """Arm of a chain; fixed joints become part of the next one's origin."""
    origins, moving, origin = [], [], np.eye(4)
    for joint in chain:
        if not joint.is_told:
            raise ReadError(f"{path}: joint {joint.name!r} on the way to {tip!r} holds a number that is none.")
        origin = origin @ joint.origin
        if joint.kind == "fixed":
            continue
        if joint.kind not in _HINGES:
            raise SettingError(
                f"{path}: joint {joint.name!r} on the way to {tip!r} is {joint.kind}; "
                f"expected only fixed, {', '.join(_HINGES)}."
            )
        if joint.mimics:
            raise SettingError(
                f"{path}: joint {joint.name!r} on the way to {tip!r} mimics another one: a serial chain cannot."
            )
        if not np.linalg.norm(joint.axis) > 0.0:
            raise ReadError(
                f"{path}: joint {joint.name!r} on the way to {tip!r} has the axis {joint.axis.tolist()}, "
                "expected one that is not zero."
            )
        origins.append(origin)
        moving.append(joint)
        origin = np.eye(4)
    if not moving:
        raise SettingError(f"{path}: no joint moves between the base and {tip!r}.")
    return Arm(
        np.stack([*origins, origin]),
        np.stack([joint.axis / np.linalg.norm(joint.axis) for joint in moving]),
        np.array([joint.lower for joint in moving]),
        np.array([joint.upper for joint in moving]),
        tuple(joint.name for joint in moving),
        np.array([_HINGES[joint.kind] for joint in moving]),
    )


LWR3 = Arm.from_dh(
    a=np.zeros(7),
    alpha=np.pi / 2 * np.array([1, -1, -1, 1, 1, -1, 0]),
    d=[0.3105, 0, 0.40, 0, 0.39, 0, 0.078],
    limits=np.radians([170, 120, 170, 120, 170, 120, 170]),
)
"""The DLR/KUKA light-weight robot III."""

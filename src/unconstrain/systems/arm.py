"""Serial arms, and the joint-limit avoidance of section IV-B.

Kinematics by standard Denavit-Hartenberg parameters, for a batch of postures
at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, as_vector
from ..errors import SettingError

__all__ = ["LWR3", "Arm", "JointLimitAvoidance"]


@dataclass(frozen=True, eq=False)
class Arm:
    """A chain of revolute joints with standard Denavit-Hartenberg parameters.

    Each joint turns about z, moves along z by ``d``, then along x by ``a`` and
    turns about x by ``alpha``.

    Parameters
    ----------
    a, alpha, d, offset : array_like, shape (n,)
        m, rad, m, rad; the offset is added to the joint's angle.
    limits : array_like, shape (n,)
        Largest angle of each joint to either side, rad.
    """

    a: Array
    alpha: Array
    d: Array
    limits: Array
    offset: Array | float = 0.0

    def __post_init__(self) -> None:
        joints = np.size(self.d)
        for name in ("a", "alpha", "d", "limits"):
            object.__setattr__(self, name, as_vector(getattr(self, name), name, joints))
        object.__setattr__(self, "offset", as_vector(np.broadcast_to(self.offset, (joints,)), "offset"))

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.d)

    def frames(self, postures: Array) -> tuple[Array, Array]:
        """Where the frames of all joints are.

        Parameters
        ----------
        postures : ndarray, shape (T, n)
            Joint angles, rad.

        Returns
        -------
        rotations : ndarray, shape (n + 1, T, 3, 3)
            Of the base and after each joint; the last is the tip's.
        positions : ndarray, shape (n + 1, T, 3)
            m.

        Raises
        ------
        SettingError
            If the postures have another number of joints.
        """
        samples, joints = postures.shape
        if joints != self.joints:
            raise SettingError(f"postures: got {joints} joints, expected {self.joints}.")
        angles = (postures + self.offset).T  # (n, T)
        cosine, sine = np.cos(angles), np.sin(angles)
        tilted, sheer = np.cos(self.alpha), np.sin(self.alpha)
        rotations = np.empty((joints + 1, samples, 3, 3))
        positions = np.empty((joints + 1, samples, 3))
        rotations[0], positions[0] = np.eye(3), 0.0
        for j in range(joints):
            x, y, z = np.moveaxis(rotations[j], -1, 0)
            c, s = cosine[j][:, None], sine[j][:, None]
            ahead, across = c * x + s * y, c * y - s * x
            rotations[j + 1, :, :, 0] = ahead
            rotations[j + 1, :, :, 1] = tilted[j] * across + sheer[j] * z
            rotations[j + 1, :, :, 2] = tilted[j] * z - sheer[j] * across
            positions[j + 1] = positions[j] + self.d[j] * z + self.a[j] * ahead
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
            Rows 0 to 2: velocity, m/rad; rows 3 to 5: angular velocity, rad/rad.
        """
        rotations, positions = self.frames(postures)
        axes = rotations[:-1, :, :, 2]  # (n, T, 3)
        levers = positions[-1] - positions[:-1]
        rows = np.concatenate([np.cross(axes, levers), axes], axis=2)  # (n, T, 6)
        return np.moveaxis(rows, 0, -1)


def _lwr3() -> Arm:
    quarter = np.pi / 2
    return Arm(
        a=np.zeros(7),
        alpha=quarter * np.array([1, -1, -1, 1, 1, -1, 0]),
        d=np.array([0.3105, 0, 0.40, 0, 0.39, 0, 0.078]),
        limits=np.radians([170, 120, 170, 120, 170, 120, 170]),
    )


LWR3 = _lwr3()
"""The DLR/KUKA light-weight robot III."""


@dataclass(frozen=True)
class JointLimitAvoidance:
    """``π(x) = −gain ∇Φ`` with ``Φ = Σ |x_i|^power`` (section IV-B).

    Parameters
    ----------
    gain, power : float
    """

    gain: float = 0.05
    power: float = 1.8

    def __call__(self, states: Array) -> Array:
        """Joint velocities (N, n) at postures (N, n)."""
        return -self.gain * self.power * np.sign(states) * np.abs(states) ** (self.power - 1.0)

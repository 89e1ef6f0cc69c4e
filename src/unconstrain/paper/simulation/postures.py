"""Inverse kinematics, by mink: postures that hold a sponge flat on a plate, or the reason why there are none."""

from __future__ import annotations

import numpy as np

from ...base.arrays import Array, require_extra
from ...base.errors import SettingError
from ..systems.arm import LWR3
from ..systems.wiping import Plate
from .scene import arm_alone

READY = np.radians([0.0, -30.0, 0.0, 80.0, 0.0, -75.0, 0.0])
"""Elbow up and hand down, far from the joint limits: where the search begins, rad."""

MARGIN = np.radians(3.0)
"""Postures stay this far from the joint limits, rad."""

CLOSE = 1e-3
"""A point is reached to this, m."""

UPRIGHT = 0.15
"""The sponge may stand askew by this where a joint is at its limit, rad."""

TILT_WEIGHT = 0.2
"""What being askew by a radian counts, against being a metre away."""

REST_WEIGHT = 1e-3
"""What a joint's radian away from rest counts: little, so that it decides only what the sponge leaves free."""

_LONGEST = 0.1  # step of the search along one axis, m: the Jacobian holds nearby
_STEPS = 100
_SETTLED = 1e-5


class Reach:
    """The arm's differential inverse kinematics, as tasks of a quadratic programme.

    The sponge's face goes where it should and turns towards the plate. What
    that leaves free returns to a resting posture. Joints stop before their
    limits, and the others make up for it.

    Parameters
    ----------
    plate : Plate
    rest : ndarray, shape (n,)
        The resting posture, where the arm also begins, rad.
    turning, returning : float
        Shares, at most 1, of the sponge's tilt and of the way to rest that one change of posture takes back.
    """

    def __init__(self, plate: Plate, rest: Array, turning: float = 1.0, returning: float = 1.0) -> None:
        self._mink = mink = require_extra("mink", "sim")
        self._centre, self._normal = np.array(plate.centre), plate.rotation[:, 2]
        model = arm_alone()
        self.arm = mink.Configuration(model, rest)
        self._place = mink.FrameTask("face", "site", position_cost=1.0, orientation_cost=0.0)
        upright = mink.AxisAlignTask("face", "site", cost=TILT_WEIGHT, gain=turning)
        upright.set_target(-self._normal)
        resting = mink.PostureTask(model, cost=REST_WEIGHT, gain=returning)
        resting.set_target(rest)
        self._tasks = [self._place, upright, resting]
        self._limits = [mink.ConfigurationLimit(model, gain=1.0, min_distance_from_limits=MARGIN)]

    def change(self, shift: Array) -> Array:
        """Change of the posture, (n,) in rad, that moves the sponge's face by (3,) in m."""
        pose = self.arm.get_transform_frame_to_world("face", "site")
        self._place.set_target(self._mink.SE3.from_translation(shift) @ pose)
        return np.asarray(self._mink.solve_ik(self.arm, self._tasks, 1.0, "daqp", limits=self._limits))

    def search(self, point: Array) -> tuple[Array, float, float]:
        """Go to a point relative to the plate's centre: posture (rad), what is left of distance (m) and tilt (rad)."""
        for _ in range(_STEPS):
            change = self.change(np.clip(self._missing(point), -_LONGEST, _LONGEST))
            self.arm.integrate_inplace(change, 1.0)
            if np.abs(change).max() < _SETTLED:
                break
        tool = self.arm.data.site("face").xmat.reshape(3, 3)[:, 2]
        tilt = np.arccos(np.clip(-(tool @ self._normal), -1.0, 1.0))
        return self.arm.q, float(np.linalg.norm(self._missing(point))), float(tilt)

    def _missing(self, point: Array) -> Array:
        return self._centre + point - self.arm.data.site("face").xpos


def postures_along(points: Array, plate: Plate) -> tuple[Array, Array]:
    """A resting posture, and postures that put the sponge on each of several points in turn; needs the extra ``sim``.

    At rest the sponge is on the plate's centre, and the arm near :data:`READY`.

    Parameters
    ----------
    points : ndarray, shape (T, 3)
        Relative to the plate's centre, m.
    plate : Plate

    Returns
    -------
    rest : ndarray, shape (n,)
        rad.
    postures : ndarray, shape (T, n)
        rad.

    Raises
    ------
    SettingError
        If a point is out of reach, with how far, and which joint stops the arm.
    """
    rest = _reached(Reach(plate, READY), np.zeros(3), plate)
    reach = Reach(plate, rest)
    return rest, np.stack([_reached(reach, point, plate) for point in points])


def _reached(reach: Reach, point: Array, plate: Plate) -> Array:
    posture, off, tilt = reach.search(point)
    if off > CLOSE or tilt > UPRIGHT:
        raise SettingError(_reason(point, plate, posture, off, tilt))
    return posture


def _reason(point: Array, plate: Plate, posture: Array, off: float, tilt: float) -> str:
    where = ", ".join(f"{value:.2f}" for value in plate.centre + point)
    stuck = (posture <= LWR3.lower + 1.01 * MARGIN) | (posture >= LWR3.upper - 1.01 * MARGIN)
    joints = [name for name, at in zip(LWR3.names, stuck, strict=True) if at]
    because = f"with {' and '.join(joints)} at the limit" if joints else "with the arm stretched out"
    missing = [f"{100 * off:.1f} cm away"] if off > CLOSE else []
    missing += [f"{np.degrees(tilt):.0f}° askew"] if tilt > UPRIGHT else []
    return (
        f"plate {plate.name}: out of the arm's reach. At ({where}) m the sponge stays {' and '.join(missing)}, "
        f"{because}. Tilt the plate less or put it elsewhere."
    )

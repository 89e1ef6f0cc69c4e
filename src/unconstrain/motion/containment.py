"""Keeping a learnt policy near its data."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_matrix, check_at_least
from ..models import spaces


class Contained:
    """A policy that is kept near the demonstrations: a robot must not follow it where nobody has been.

    Nothing is changed within ``reach`` of a demonstrated state. Beyond, what
    leads away from the nearest one is taken out, and the way back is added. On a steady cycle that is needed:
    there a deviation and its rate of change are uncorrelated, so that
    recordings cannot tell whether the cycle attracts.

    Where several are equally near, the way back goes to one of them, and to
    none between: midway between two strands there is no state to rest at.

    Parameters
    ----------
    policy : callable
        States (N, n) to velocities (N, n). A fitted one says by its ``space_`` which states are angles, and any may.
    states : array_like, shape (N, n)
        Where the demonstrations were.
    reach : float
        In units of the state.
    gain : float
        How fast the way back is taken, 1/s.
    speed : float, optional
        The way back is no faster than this, in units of the state per second;
        by default than the policy is anywhere at the demonstrated states.

    Examples
    --------
    >>> safe = uc.Contained(lambda x: np.ones_like(x), states=[[0.0, 0.0]], reach=0.1)
    >>> safe(np.array([[0.0, 0.0], [1.0, 1.0]])).round(2)
    array([[ 1.,  1.],
           [-1., -1.]])
    """

    def __init__(
        self,
        policy: Callable[[Array], Array],
        states: ArrayLike,
        reach: float,
        gain: float = 3.0,
        speed: float | None = None,
    ) -> None:
        from scipy.spatial import KDTree

        check_at_least("reach", reach, 0.0, strict=True)
        check_at_least("gain", gain, 0.0)
        if speed is not None:
            check_at_least("speed", speed, 0.0, strict=True)
        shown = as_matrix(states, "states")
        self.space_ = getattr(policy, "space_", spaces.Euclidean()).over(shown.shape[1])
        self._policy, self._reach, self._gain = policy, reach, gain
        fastest = float(np.linalg.norm(policy(shown), axis=1).max()) if speed is None else float(speed)
        self._speed = fastest or gain * reach  # of a policy that is at rest wherever anybody was
        self._shown, self._near = shown, KDTree(self.space_.coordinates(shown))

    def __call__(self, states: Array) -> Array:
        """Velocities (N, n)."""
        states = as_matrix(states, "states")
        distance, nearest = self._near.query(self.space_.coordinates(states))
        beyond = np.clip(distance / self._reach - 1.0, 0.0, 1.0)
        # Up to the reach, where none of this counts, the direction is allowed to vanish with the distance.
        away = self.space_.difference(states, self._shown[nearest]) / np.maximum(distance, self._reach)[:, None]
        wanted = self._policy(states)
        outwards = np.maximum((wanted * away).sum(axis=1), 0.0)
        back = np.minimum(self._gain * distance, self._speed)
        return wanted - (beyond * (outwards + back))[:, None] * away

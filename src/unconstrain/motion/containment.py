"""Keeping a learnt policy near its data."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_matrix, check_at_least
from ..models import cover


class Contained:
    """A policy that is kept near the demonstrations: a robot must not follow it where nobody has been.

    Nothing is changed within ``reach`` of a demonstrated state. Beyond, the
    way back is added. On a steady cycle that is needed: there a deviation and
    its rate of change are uncorrelated, so that recordings cannot tell
    whether the cycle attracts.

    Parameters
    ----------
    policy : callable
        States (N, n) to velocities (N, n).
    states : array_like, shape (N, n)
        Where the demonstrations were.
    reach : float
        In units of the state.
    gain : float
        How fast the way back is taken, 1/s.
    """

    def __init__(self, policy: Callable[[Array], Array], states: ArrayLike, reach: float, gain: float = 3.0) -> None:
        check_at_least("reach", reach, 0.0, strict=True)
        check_at_least("gain", gain, 0.0)
        self._policy, self._reach, self._gain = policy, reach, gain
        # Fields that cover the states to half the reach, and blend over it.
        self._fields = cover(as_matrix(states, "states"), variance=(reach / 2.0) ** 2, at_least=float(np.exp(-0.5)))

    def __call__(self, states: Array) -> Array:
        """Velocities (N, n)."""
        away = states - self._fields.shares(states) @ self._fields.centres
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        beyond = np.clip(distance / self._reach - 1.0, 0.0, 1.0)
        return self._policy(states) - self._gain * beyond * away

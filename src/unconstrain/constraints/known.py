"""Constraint matrices ``A(x, t)``, with ``A u = 0`` (eqs 2, 19 and 20).

A constraint is any callable that maps states (T, n) and times (T,) to matrices (T, k, d). Rows may be zero, and so
where there are fewer constraints. Times are in seconds; one that does not read them holds at demonstrations without
times too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array, as_matrix, as_vector, check_at_least
from ..base.errors import InvalidDataError, SettingError
from ..risks import unit_actions

Constraint = Callable[[Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Plane:
    """No motion along one direction: ``A = n̂ᵀ`` (section IV-C).

    Parameters
    ----------
    normal : array_like, shape (d,)
        Of any length but zero.

    Raises
    ------
    SettingError
        If the normal is zero.
    """

    normal: Array

    def __post_init__(self) -> None:
        direction, length = unit_actions(as_vector(self.normal, "normal"))
        if length == 0.0:
            raise SettingError(f"normal: got {np.ravel(self.normal).tolist()}, expected a vector that is not zero.")
        object.__setattr__(self, "normal", direction)

    def __call__(self, states: Array, times: Array) -> Array:
        """Return A, shape (T, 1, d)."""
        return np.broadcast_to(self.normal, (len(states), 1, len(self.normal)))


@dataclass(frozen=True, eq=False)
class SwitchingLine:
    """One direction at a time is blocked, another one from each switch on: ``A = α(t)`` (eq. 19).

    Parameters
    ----------
    directions : array_like, shape (S, d)
        The α of each stretch.
    switches : array_like, shape (S - 1,)
        Times at which the next one begins, seconds, ascending.
    """

    directions: Array
    switches: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "directions", as_matrix(self.directions, "directions"))
        object.__setattr__(self, "switches", as_vector(self.switches, "switches", len(self.directions) - 1))
        if (np.diff(self.switches) < 0).any():
            raise SettingError(f"switches: got {self.switches.tolist()}, expected ascending times.")

    def __call__(self, states: Array, times: Array) -> Array:
        """Return A, shape (T, 1, d); InvalidDataError if a time is NaN."""
        # A switch is due when the clock reads it to rounding: times are sums of steps.
        stretch = np.searchsorted(self.switches, _clock(times) + 1e-9, side="right")
        return self.directions[stretch][:, None, :]

    @classmethod
    def random(cls, rng: np.random.Generator, duration: float, switches: int = 2, dimensions: int = 2) -> SwitchingLine:
        """Draw every α from a standard normal, switching at regular intervals (section IV-A)."""
        directions = rng.standard_normal((switches + 1, dimensions))
        return cls(directions, duration * np.arange(1, switches + 1) / (switches + 1))


@dataclass(frozen=True, eq=False)
class PolicyAligned:
    """Motion only along the policy turned by an angle: ``A = I − α̂ α̂ᵀ``, ``α = R(θ) π(x)`` (eq. 20).

    Parameters
    ----------
    policy : callable
        States (T, 2) to actions (T, 2).
    angles : array_like, shape (S,)
        θ of each time step, radians. The last one stays.
    dt : float
        Length of a time step, seconds.
    """

    policy: Callable[[Array], Array]
    angles: Array
    dt: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "angles", as_vector(self.angles, "angles"))
        check_at_least("dt", self.dt, 0.0, strict=True)

    def __call__(self, states: Array, times: Array) -> Array:
        """Return A, shape (T, 2, 2); InvalidDataError if a time is NaN."""
        steps = np.clip(np.rint(_clock(times) / self.dt), 0, len(self.angles) - 1)
        theta = self.angles[steps.astype(np.intp)]
        cosine, sine = np.cos(theta), np.sin(theta)
        turn = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
        direction, _ = unit_actions(np.einsum("tij,tj->ti", turn, self.policy(states)))
        return np.eye(2) - direction[:, :, None] * direction[:, None, :]

    @classmethod
    def random(
        cls, rng: np.random.Generator, policy: Callable[[Array], Array], widest: float, steps: int, dt: float
    ) -> PolicyAligned:
        """Draw every θ uniformly from [−widest, widest]."""
        return cls(policy, rng.uniform(-widest, widest, steps), dt)


@dataclass(frozen=True, eq=False)
class JacobianRows:
    """Some task coordinates are held: A is made of these rows of a Jacobian (section IV-B).

    Parameters
    ----------
    jacobian : callable
        States (T, n) to Jacobians (T, 6, n).
    rows : tuple of int
        Which of its rows, from 0.
    """

    jacobian: Callable[[Array], Array]
    rows: tuple[int, ...]

    def __call__(self, states: Array, times: Array) -> Array:
        """Return A, shape (T, len(rows), n)."""
        jacobian = np.asarray(self.jacobian(states))
        if any(not 0 <= row < jacobian.shape[1] for row in self.rows):
            raise SettingError(f"rows: got {self.rows}, expected rows of the Jacobian, 0 to {jacobian.shape[1] - 1}.")
        return jacobian[:, list(self.rows), :]


def _clock(times: Array) -> Array:
    clock = np.asarray(times, dtype=np.float64)
    if np.isnan(clock).any():
        row = int(np.isnan(clock).argmax())
        raise InvalidDataError(f"times: found nan at row {row}, and the constraint depends on them: expected seconds.")
    return clock

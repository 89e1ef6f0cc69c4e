"""Obstacles that a movement goes round: a velocity is turned away from their surface, within what a constraint leaves.

An obstacle is a callable: states (K, n) to values g (K,) and their gradients (K, n). g is convex, negative inside,
zero on the surface, and about one where the obstacle is hardly felt any more. Of velocities ``u = N π`` the part along
``m = N ∇g``, the steepest way off it that the constraint leaves, and the parts across it are scaled,

    ``u ← (1 ∓ λ) m mᵀu / ‖m‖² + (1 + λ) (u − m mᵀu / ‖m‖²),   λ = 1 / (1 + g)²``,

the first by 1 − λ where it comes nearer, and left as it is where it does not. So it is the modulation of Khansari-Zadeh
and Billard (*Autonomous Robots* 32, 2012), inside the null space: nothing leaves that, and ``∇gᵀu = mᵀu`` is zero on
the surface. As g is convex, ``g(x + Δt u) ≥ g(x) + Δt ∇gᵀu``: steps are shortened so that this stays positive.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_matrix, as_vector, check_at_least
from ..base.errors import SettingError
from ..risks import project, unit_actions

Obstacle = Callable[[Array], tuple[Array, Array]]

MOST = 0.9
"""A step uses up at most so much of the way to a surface."""

ROUNDING = 1e-14
"""What comes nearer by less than this share of a step goes along the surface."""


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Inside is ``‖R⁻¹ Qᵀ (x − c)‖ < 1``; g is that norm less one.

    Parameters
    ----------
    centre : array_like, shape (n,)
    radii : float or array_like, shape (n,)
        R, above zero; one of a ball. Those of the robot are to be added.
    axes : array_like, shape (n, n), optional
        Q, orthogonal, with an axis in each column; those of the state by default.

    Examples
    --------
    >>> uc.motion.obstacles.Ellipsoid([0.0, 0.0], 2.0)(np.array([[4.0, 0.0]]))
    (array([1.]), array([[0.5, 0. ]]))
    """

    centre: Array
    radii: ArrayLike
    axes: ArrayLike | None = None
    _round: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        centre = as_vector(self.centre, "centre")
        n = len(centre)
        radii = as_vector(np.broadcast_to(self.radii, n) if np.ndim(self.radii) == 0 else self.radii, "radii", n)
        check_at_least("radii", float(radii.min()), 0.0, strict=True)
        axes = np.eye(n) if self.axes is None else as_matrix(self.axes, "axes")
        if axes.shape != (n, n) or not np.allclose(axes.T @ axes, np.eye(n)):
            raise SettingError(f"axes: got {axes.tolist()}, expected unit vectors at right angles in its columns.")
        object.__setattr__(self, "centre", centre)
        object.__setattr__(self, "_round", axes / radii)

    def __call__(self, states: Array) -> tuple[Array, Array]:
        """Values (K,) and gradients (K, n) of g."""
        directions, lengths = unit_actions(_away(states, self.centre) @ self._round)
        return lengths - 1.0, directions @ self._round.T


@dataclass(frozen=True, eq=False)
class Wall:
    """Behind it is ``n̂ᵀ(x − p) < 0``; g is the distance in front of it as a share of its reach.

    Parameters
    ----------
    point : array_like, shape (n,)
        p, anywhere on it.
    normal : array_like, shape (n,)
        Away from it, of any length but zero.
    reach : float
        From how far off it is felt, in units of the state.

    Examples
    --------
    >>> uc.motion.obstacles.Wall([0.0, 0.0], [0.0, 1.0], reach=0.5)(np.array([[3.0, 0.5]]))
    (array([1.]), array([[0., 2.]]))
    """

    point: Array
    normal: Array
    reach: float

    def __post_init__(self) -> None:
        check_at_least("reach", self.reach, 0.0, strict=True)
        object.__setattr__(self, "point", as_vector(self.point, "point"))
        normal, length = unit_actions(as_vector(self.normal, "normal", len(self.point)))
        if length == 0.0:
            raise SettingError("normal: got zeros, expected a vector that is not zero.")
        object.__setattr__(self, "normal", normal)

    def __call__(self, states: Array) -> tuple[Array, Array]:
        """Values (K,) and gradients (K, n) of g."""
        slope = self.normal / self.reach
        return _away(states, self.point) @ slope, np.broadcast_to(slope, states.shape)


def avoided(
    obstacles: Sequence[Obstacle],
    states: Array,
    velocities: Array,
    projections: Array | None = None,
    dt: float | None = None,
) -> Array:
    """Velocities (K, n) that lead round obstacles.

    Parameters
    ----------
    obstacles : sequence of callables
    states, velocities : ndarray, shape (K, n)
        Outside of all; what is wanted there, in the null space.
    projections : ndarray, shape (K, n, n), optional
        N; all is free by default.
    dt : float, optional
        Seconds of an Euler step with which none is entered. By default of none: the velocities of continuous time.

    Examples
    --------
    >>> ball = uc.motion.obstacles.Ellipsoid([0.0, 0.0], 1.0)
    >>> uc.motion.obstacles.avoided([ball], np.array([[-1.0, 0.0]]), np.array([[1.0, 1.0]]))
    array([[0., 2.]])
    """
    near = [obstacle(states) for obstacle in obstacles]
    for k, (value, slope) in enumerate(near):
        others = [other for place, (other, _) in enumerate(near) if place != k]
        off = slope if projections is None else project(projections, slope)
        velocities = _turned(velocities, _unit(off, slope), _alone(value, others) / (1.0 + value) ** 2)
    return velocities if dt is None else shortened(near, dt * velocities) / dt


def stopped(near: Sequence[tuple[Array, Array]], velocities: Array, projections: Array, dt: float) -> Array:
    """Velocities (K, n) less what would enter within dt seconds, as in an inelastic impact inside the null space."""
    for value, slope in near:
        off = project(projections, slope)
        missing = -np.vecdot(slope, velocities) - MOST * np.maximum(value, 0.0) / dt
        size = np.vecdot(off, off)
        held = (missing <= 0.0) | (size <= 1e-18 * np.vecdot(slope, slope))
        velocities = velocities + np.where(held, 0.0, missing / np.where(held, 1.0, size))[:, None] * off
    return shortened(near, dt * velocities) / dt


@dataclass
class Once:
    """An obstacle that is asked once for the same states, however often they are looked at one after the other."""

    obstacle: Obstacle
    states: Array | None = None
    found: tuple[Array, Array] = field(init=False)

    def __call__(self, states: Array) -> tuple[Array, Array]:
        """Values (K,) and gradients (K, n) of g."""
        if self.states is None or not np.array_equal(self.states, states):
            self.states, self.found = states, self.obstacle(states)
        return self.found


def shortened(near: Sequence[tuple[Array, Array]], ways: Array) -> Array:
    """Ways (K, n), as much of each as does not enter, with g and its gradient of each obstacle where they begin."""
    for value, slope in near:
        falls, most = -np.vecdot(slope, ways), MOST * np.maximum(value, 0.0)
        rounding = ROUNDING * np.linalg.norm(slope, axis=1) * np.linalg.norm(ways, axis=1)
        enters = falls > most + rounding
        ways = np.where(enters, most / np.where(enters, falls, 1.0), 1.0)[:, None] * ways
    return ways


def _turned(velocities: Array, off: Array, share: Array) -> Array:
    along = np.vecdot(off, velocities)
    kept = np.where(along < 0.0, 1.0 - share, 1.0) * along
    return (1.0 + share)[:, None] * (velocities - along[:, None] * off) + kept[:, None] * off


def _unit(off: Array, slope: Array) -> Array:
    """Unit vectors; none where a constraint leaves no way off, up to rounding."""
    directions, lengths = unit_actions(off)
    return np.where((lengths > 1e-9 * np.linalg.norm(slope, axis=1))[:, None], directions, 0.0)


def _alone(value: Array, others: Sequence[Array]) -> Array:
    """How much one obstacle counts beside others, (K,): all at its own surface, nothing at that of another."""
    share = np.ones_like(value)
    for other in others:
        both = value + other
        share *= np.where(both > 0.0, other / np.where(both > 0.0, both, 1.0), 1.0)
    return share


def _away(states: Array, place: Array) -> Array:
    if states.shape[1] != len(place):
        raise SettingError(f"obstacle: got a place of {len(place)} numbers for states of {states.shape[1]}.")
    return states - place

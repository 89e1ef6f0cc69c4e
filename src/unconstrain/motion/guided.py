"""A policy that arrives: free and under any constraint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_matrix, as_vector, check_at_least
from ..base.display import Shown
from ..base.errors import InvalidDataError, SettingError
from ..models import spaces
from ..recordings import Demonstration, stack
from ..risks import project
from .potential import PACE, descended, radius

_AT_REST = 0.3
"""A demonstration ends at rest, or nearly, below this share of its fastest motion."""

_TOGETHER = 0.1
"""Demonstrations end in one place within this share of their extent."""


class Guided(Shown):
    """A policy that arrives at a goal, from anywhere and under any constraint, by construction.

    Along every movement a convex potential V falls (:class:`~unconstrain.motion.potential.Potential`), which is learnt
    from the demonstrations so that the policy descends it by itself where it was shown. Elsewhere the velocity is
    corrected. With ``m = ½ N ∇V`` those velocities are allowed that are in the null space and in a ball,

        ``‖u + m‖ ≤ r = max(‖m‖ − s, ½ ‖m‖)``,   so that   ``−∇Vᵀu ≥ ‖u‖² + ‖m‖² − r²``:

    V falls with every such velocity, and with every Euler step of at most ``dt_``, except where ``N ∇V = 0``. On flat
    constraints that is the place, and the only one, where V has its minimum under the constraint: nothing better can be
    reached. Without a constraint it is the goal. The pace s bounds how slowly. A velocity ``N π`` in the ball is not
    changed. One outside is mirrored at the ball's surface, to its centre at most, so that V falls about as fast as the
    policy let it rise:

        ``u = N (π + c) = −m + (Nπ + m) min(1, (2r / ‖Nπ + m‖ − 1)₊)``.

    It is continuous in the state. A constraint that moves, or a task with a drift, may lift V.

    Parameters
    ----------
    policy : callable
        States (N, n) to velocities (N, n).
    goal : array_like, shape (n,), optional
        By default where the demonstrations end at rest.
    demonstrations : Demonstration or sequence of Demonstration, optional
        Movements that are likely, on which the correction is to be small. By default those that the policy has kept.
    dt : float, optional
        Let V fall with Euler steps of this length, in seconds; longer ones cost more correction.

    Attributes
    ----------
    goal_ : ndarray, shape (n,)
    potential_ : Potential
    pace_ : float
        The s above, in units of the state per second.
    dt_ : float
        Seconds.

    Raises
    ------
    SettingError
        If the policy gives no velocities of flat states, no demonstration is known, or no goal.

    Examples
    --------
    >>> def around(x):
    ...     return np.column_stack([-x[:, 1], x[:, 0]]) - 0.1 * x
    >>> shown = uc.rollout(around, [1.0, 0.0], 40, 0.1)
    >>> guided = uc.Guided(around, goal=[0.0, 0.0], demonstrations=shown)
    >>> bool(np.linalg.norm(uc.rollout(guided, [3.0, -2.0], 2000, 0.02).states[-1]) < 0.01)
    True
    """

    def __init__(
        self,
        policy: Callable[[Array], Array],
        goal: ArrayLike | None = None,
        *,
        demonstrations: Demonstration | Sequence[Demonstration] | None = None,
        dt: float | None = None,
    ) -> None:
        if dt is not None:
            check_at_least("dt", dt, 0.0, strict=True)
        shown = _kept(policy) if demonstrations is None else demonstrations
        demos = [shown] if isinstance(shown, Demonstration) else list(shown)
        states = stack(demos).states
        self.policy = policy
        self.goal_ = _found(demos) if goal is None else as_vector(goal, "goal", states.shape[1])
        wanted = _velocities(policy, states)
        self.pace_ = PACE * float(np.sqrt((wanted**2).sum(axis=1).mean()))
        self.potential_ = descended(states, wanted, self.goal_, np.inf if dt is None else 2.0 / dt)

    @property
    def dt_(self) -> float:
        """The longest Euler step with which V is sure to fall."""
        return 2.0 / self.potential_.curvature

    def __call__(self, states: ArrayLike) -> Array:
        """Velocities (N, n) where nothing constrains."""
        table = as_matrix(states, "states")
        return self._guided(np.asarray(self.policy(table)), 0.5 * self.potential_.gradient(table))

    predict = __call__

    def under(self, states: ArrayLike, projections: Array) -> Array:
        """``π + c`` (N, n) under constraints with projections N (N, n, n): what :func:`rollout` follows."""
        table = as_matrix(states, "states")
        wanted = np.asarray(self.policy(table))
        held = project(projections, wanted)
        return wanted - held + self._guided(held, project(projections, 0.5 * self.potential_.gradient(table)))

    def correction(self, states: ArrayLike) -> Array:
        """What is added to the policy's velocities where nothing constrains, (N, n)."""
        return self(states) - np.asarray(self.policy(as_matrix(states, "states")))

    def step(self, x: ArrayLike, out: Array | None = None) -> Array:
        """Velocity at one state (n,), without overhead: for control loops; see :meth:`~unconstrain.Policy.step`."""
        return self._step(x, out)

    def _guided(self, wanted: Array, half: Array) -> Array:
        """Velocities (N, n) that the ball around ``−half`` allows."""
        away = wanted + half
        distance, depth = (np.linalg.norm(each, axis=1) for each in (away, half))
        allowed = radius(depth, self.pace_)
        inside = distance <= allowed
        share = np.maximum(2.0 * allowed / np.where(inside, 1.0, distance) - 1.0, 0.0)
        return np.where(inside[:, None], wanted, share[:, None] * away - half)

    @cached_property
    def _step(self) -> Callable[[ArrayLike, Array | None], Array]:
        one, potential, pace = self.policy, self.potential_, self.pace_
        plain: Callable[..., Array] = getattr(one, "step", None) or (
            lambda x, out: np.concatenate(one(np.asarray([x], np.float64)), out=out)
        )
        directions, halved = potential.directions, 0.5 * potential.weights[:, None] * potential.directions
        begin = directions @ potential.goal + potential.offsets
        along, maximum, zeros = directions.dot, np.maximum, np.zeros(len(begin))

        def step(x: ArrayLike, out: Array | None = None) -> Array:
            wanted, beyond = plain(x, out), along(x)
            beyond -= begin
            half = maximum(beyond, zeros).dot(halved)
            away = wanted + half
            distance, depth = sqrt(away.dot(away)), sqrt(half.dot(half))
            allowed = max(depth - pace, 0.5 * depth)
            if distance > allowed:
                np.subtract(max(2.0 * allowed / distance - 1.0, 0.0) * away, half, out=wanted)
            return wanted

        return step

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what is prepared for single steps."""
        return {name: value for name, value in vars(self).items() if name != "_step"}

    def _summary(self) -> tuple[str, ...]:
        goal = ", ".join(f"{each:.4g}" for each in self.goal_)
        return type(self.policy).__name__, f"goal=({goal})", f"dt_={self.dt_:.3g}"


def _velocities(policy: Callable[[Array], Array], states: Array) -> Array:
    """What a policy wants, (N, n)."""
    if not isinstance(getattr(policy, "space_", spaces.Euclidean()), spaces.Euclidean):
        raise SettingError(
            "policy: its states hold angles or orientations, where no potential is convex all around. Guided expects "
            "flat states."
        )
    wanted = np.asarray(policy(states))
    if wanted.shape != states.shape:
        raise SettingError(
            f"policy: got actions of shape {wanted.shape} for states of shape {states.shape}; Guided expects actions "
            "that are velocities of the state."
        )
    return wanted


def _kept(policy: Any) -> list[Demonstration]:
    """The demonstrations that a fitted policy has kept."""
    training = getattr(policy, "training_", None)
    if training is None or training.kept is None:
        raise SettingError(
            "demonstrations: got none, and the policy has not kept its own (a learner such as Robust keeps them, a "
            "stored policy does not). Pass demonstrations=."
        )
    kept, scale = training.samples, policy.scale_
    states, actions = kept.states, training.action_unit * kept.actions
    if scale is not None:
        states, actions = states * scale.states, scale.given(actions)
    ends = np.flatnonzero(np.diff(kept.groups)) + 1
    return [Demonstration(*pair) for pair in zip(np.split(states, ends), np.split(actions, ends), strict=True)]


def _found(demos: Sequence[Demonstration]) -> Array:
    """Where demonstrations end at rest, (n,)."""
    speeds = [np.linalg.norm(demo.actions, axis=1) for demo in demos]
    ends = [demo.states[-1] for demo, speed in zip(demos, speeds, strict=True) if speed[-1] <= _AT_REST * speed.max()]
    if not ends:
        raise SettingError("goal: no demonstration ends at rest, so that none is found. Pass goal=.")
    extent = np.linalg.norm(np.ptp(stack(demos).states, axis=0))
    goal = np.mean(ends, axis=0)
    apart = max(float(np.linalg.norm(end - goal)) for end in ends)
    if apart > _TOGETHER * extent:
        raise InvalidDataError(
            f"goal: demonstrations end at rest in places up to {apart:.3g} from their mean, {apart / extent:.0%} of "
            "their extent; expected one place. Pass goal=."
        )
    return np.asarray(goal)

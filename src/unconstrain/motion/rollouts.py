"""Follow a policy under constraints: makes demonstrations, and reproduces what was learnt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import LARGEST, Array, as_table, check_at_least
from ..base.errors import InvalidDataError, SettingError
from ..constraints import Constraint, constraint_matrices
from ..models import spaces
from ..recordings import Demonstration, Truth
from ..risks import null_space_projection, project

Task = Callable[[Array, Array], Array]
"""States (K, n) and times (K,) to the b of ``A u = b``, shape (K, k)."""

Method: TypeAlias = Literal["euler", "rk4", "adaptive"]
"""Of integration, see :func:`rollout`."""

TOLERANCE = 1e-6
"""Error of an adaptive step, as a share of the way that it goes."""

HALVINGS = 12
"""An adaptive step is halved no more often."""


@overload
def rollout(
    policy: Callable[[Array], Array],
    start: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]],
    steps: int = ...,
    dt: float = ...,
    constraint: Constraint | None = ...,
    *,
    task: Task | None = ...,
    name: str = ...,
    space: spaces.Space | None = ...,
    method: Method = ...,
) -> Demonstration: ...


@overload
def rollout(
    policy: Callable[[Array], Array],
    start: Sequence[Sequence[float]] | np.ndarray[tuple[int, int], np.dtype[np.float64]],
    steps: int = ...,
    dt: float = ...,
    constraint: Constraint | Sequence[Constraint] | None = ...,
    *,
    task: Task | None = ...,
    name: str = ...,
    space: spaces.Space | None = ...,
    method: Method = ...,
) -> list[Demonstration]: ...


def rollout(
    policy: Callable[[Array], Array],
    start: ArrayLike,
    steps: int = 200,
    dt: float = 0.02,
    constraint: Constraint | Sequence[Constraint] | None = None,
    *,
    task: Task | None = None,
    name: str = "rollout",
    space: spaces.Space | None = None,
    method: Method = "euler",
) -> Demonstration | list[Demonstration]:
    """Follow ``u = N(x, t) π(x)``, or ``u = A⁺b + N π`` under a task, by default with Euler steps ``x ← x + dt u``.

    Steps are in the state space.

    Parameters
    ----------
    policy : callable
        States (K, n) to actions (K, n), or as many as directions in the state space; a fitted policy is one. Where it
        has a method ``under``, that is called in its place, with states and the projections N (K, n, n), as
        :class:`~unconstrain.Guided` has.
    start : array_like, shape (n,) or (K, n)
        Where to start; several starts run side by side.
    steps : int
        Number of samples.
    dt : float
        Seconds between samples.
    constraint : callable or sequence of K callables, optional
        A(x, t), for all or one for each start. None leaves the policy free.
    task : callable, optional
        b(x, t) of ``A u = b``: states (K, n) and times (K,) to values (K, k), one for each row of A. Zero by default.
    name : str
        Of the demonstrations; several are numbered.
    space : Space, optional
        Which states are angles or orientations (:mod:`unconstrain.spaces`); by default as a fitted policy knows.
    method : {"euler", "rk4", "adaptive"}
        How a step from one sample to the next is made: Euler's, as a control loop does; Runge and Kutta's of fourth
        order (on orientations of a lower one); or that, halved until halving it once more changes it by less than a
        millionth of the way it goes.

    Returns
    -------
    Demonstration or list of Demonstration
        With their truth: the policy and the projections that were applied.

    Raises
    ------
    SettingError
        If the policy's actions do not fit the states, or a setting is out of range.
    InvalidDataError
        If the movement leaves the finite numbers.

    Examples
    --------
    >>> plane = uc.constraints.Plane(normal=[0, 0, 1])
    >>> movement = uc.rollout(lambda x: -x, start=[1.0, 1.0, 1.0], steps=3, dt=0.5, constraint=plane)
    >>> movement.states
    array([[1.  , 1.  , 1.  ],
           [0.5 , 0.5 , 1.  ],
           [0.25, 0.25, 1.  ]])
    """
    check_at_least("steps", steps, 1, whole=True)
    check_at_least("dt", dt, 0.0, strict=True)
    table, single = as_table(start, "start")
    state = table.reshape(1, -1) if single else table
    runs, n = state.shape
    told: spaces.Space = space if space is not None else getattr(policy, "space_", spaces.Euclidean())
    within = told.over(n)
    d = within.sizes[2]
    if constraint is not None and not callable(constraint) and len(constraint) != runs:
        raise SettingError(f"constraint: got {len(constraint)} constraints for {runs} starts, expected one for each.")
    if method not in _STEPS:
        raise SettingError(f"method: got {method!r}, expected one of {', '.join(_STEPS)}.")
    flow = _Flow(policy, constraint, task, within, dt)
    shape = (runs, steps, d)
    states, actions, wanted, projections = (np.empty(s) for s in ((runs, steps, n), shape, shape, (*shape, d)))
    times = dt * np.arange(steps, dtype=np.float64)
    for step in range(steps):
        states[:, step] = state
        actions[:, step], wanted[:, step], projections[:, step] = flow.at(state, times[step])
        state = _STEPS[method](flow, state, times[step], dt, actions[:, step])
    names = [name] if single else [f"{name} {k + 1}" for k in range(runs)]
    demos = [
        Demonstration(states[k], actions[k], times, Truth(wanted[k], projections[k]), names[k], within)
        for k in range(runs)
    ]
    return demos[0] if single else demos


@dataclass(frozen=True)
class _Flow:
    """What moves the states of K runs."""

    policy: Callable[[Array], Array]
    constraint: Constraint | Sequence[Constraint] | None
    task: Task | None
    space: spaces.Space
    dt: float

    def at(self, state: Array, time: float) -> tuple[Array, Array, Array]:
        """``A⁺b + N π`` (K, d), π (K, d) and N (K, d, d)."""
        matrices = _matrices(self.constraint, state, time, self.space.sizes[2])
        projections = null_space_projection(matrices)
        wanted = _action(self.policy, state, projections)
        drift = 0.0 if self.task is None else _drift(matrices, self.task(state, np.full(len(state), time)))
        return _without_rounding(project(projections, wanted), wanted) + drift, wanted, projections

    def moved(self, states: Array, ways: Array, time: float) -> Array:
        """States after ways (K, d)."""
        with np.errstate(over="ignore", invalid="ignore"):
            moved = self.space.step(states, ways)
        if not (np.abs(moved) <= LARGEST).all():
            raise InvalidDataError(
                f"the movement left the finite numbers at step {int(time / self.dt + 1e-6)}: start nearer to the data, "
                "take a smaller dt, or guide the policy (uc.Guided)."
            )
        return moved


def _euler(flow: _Flow, state: Array, time: float, dt: float, action: Array) -> Array:
    return flow.moved(state, dt * action, time)


def _rk4(flow: _Flow, state: Array, time: float, dt: float, action: Array) -> Array:
    slopes = [action]
    for share in (0.5, 0.5, 1.0):
        between = flow.moved(state, share * dt * slopes[-1], time)
        slopes.append(flow.at(between, time + share * dt)[0])
    return flow.moved(state, dt / 6.0 * (slopes[0] + 2.0 * slopes[1] + 2.0 * slopes[2] + slopes[3]), time)


def _adaptive(flow: _Flow, state: Array, time: float, dt: float, action: Array, left: int = HALVINGS) -> Array:
    half = 0.5 * dt
    whole, middle = _rk4(flow, state, time, dt, action), _rk4(flow, state, time, half, action)
    again = flow.at(middle, time + half)[0]
    end = _rk4(flow, middle, time + half, half, again)
    error, way = (np.abs(flow.space.difference(end, other)).max(axis=1) for other in (whole, state))
    if left == 0 or (error <= TOLERANCE * way).all():
        return end
    middle = _adaptive(flow, state, time, half, action, left - 1)
    return _adaptive(flow, middle, time + half, half, flow.at(middle, time + half)[0], left - 1)


_STEPS = {"euler": _euler, "rk4": _rk4, "adaptive": _adaptive}


def _matrices(constraint: Constraint | Sequence[Constraint] | None, states: Array, time: float, d: int) -> Array:
    """A of the constraint, or of that of each run, shape (K, k, d); no row where nothing holds."""
    runs = len(states)
    if constraint is None:
        return np.zeros((runs, 0, d))
    now = np.full(runs, time)
    if callable(constraint):
        return constraint_matrices(constraint, states, now, d)
    rows = [constraint_matrices(one, states[k : k + 1], now[k : k + 1], d) for k, one in enumerate(constraint)]
    return np.concatenate(rows)


def _drift(matrices: Array, target: Array) -> Array:
    """``A⁺ b``, shape (K, n)."""
    wanted = np.asarray(target, np.float64)
    if wanted.shape != matrices.shape[:2]:
        raise SettingError(
            f"task: got b of shape {wanted.shape} for A of shape {matrices.shape}, expected {matrices.shape[:2]}, one "
            "value for each row of the constraint."
        )
    return np.einsum("knr,kr->kn", np.linalg.pinv(matrices, rcond=1e-9), wanted)


def _without_rounding(actions: Array, wanted: Array) -> Array:
    """Exactly no motion where the constraint takes all of it: rounding has a direction, rest has none."""
    rounding = np.abs(actions).max(axis=1, keepdims=True) <= 1e-12 * np.abs(wanted).max(axis=1, keepdims=True)
    return np.where(rounding, 0.0, actions)


def _action(policy: Callable[[Array], Array], state: Array, projections: Array) -> Array:
    """What the policy wants, (K, d); one that can, is told what the constraint leaves."""
    under, d = getattr(policy, "under", None), projections.shape[2]
    action = np.asarray(policy(state) if under is None else under(state, projections))
    if action.shape != (len(state), d):
        raise SettingError(
            f"policy: got actions of shape {action.shape} for states of shape {state.shape}; a rollout expects "
            f"actions that are velocities of the state{'' if d == state.shape[1] else f', {d} in their space'}."
        )
    return action

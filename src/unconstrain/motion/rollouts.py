"""Follow a policy under constraints: makes demonstrations, and reproduces what was learnt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Self, overload
from warnings import warn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.arrays import Array, as_table, check_at_least
from ..base.errors import DivergedError, SettingError, SupportEndsWarning
from ..constraints import Constraint
from ..models import SUPPORTED, spaces
from ..recordings import Demonstration, Truth
from .flow import FLOWS, STEPS, Flow, Method, Task
from .obstacles import Obstacle, Once


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
    order: Literal[1, 2] = ...,
    obstacles: Sequence[Obstacle] = ...,
    least_support: float = ...,
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
    order: Literal[1, 2] = ...,
    obstacles: Sequence[Obstacle] = ...,
    least_support: float = ...,
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
    method: Method = "rk4",
    order: Literal[1, 2] = 1,
    obstacles: Sequence[Obstacle] = (),
    least_support: float = SUPPORTED,
) -> Demonstration | list[Demonstration]:
    """Follow ``u = N(x, t) π(x)``, or ``u = A⁺b + N π`` under a task, by default with Runge-Kutta steps.

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
        Of steps between samples: Euler's, as a control loop does, from which circles grow; Runge and Kutta's of fourth
        order (lower on orientations); or that, halved until that changes it by less than a millionth of its way.
    order : {1, 2}
        2: states are positions and velocities, actions accelerations; constraint and task hold the velocities, and are
        given the positions (:class:`.flow.SecondOrder`).
    obstacles : sequence of callables
        To go round, such as :class:`.obstacles.Ellipsoid`; actions are then not N π. With order 2 they stop velocities.
    least_support : float
        Stop before states with less, once there was more; 0 goes on. As a fitted policy knows, see
        :meth:`~unconstrain.Policy.support`.

    Returns
    -------
    Demonstration or list of Demonstration
        With their truth: the policy and the projections that were applied.

    Warns
    -----
    SupportEndsWarning
        Where it stops for want of support, or has none from the start, and is extrapolated.

    Raises
    ------
    SettingError
        If the policy's actions do not fit the states, or a setting is out of range.
    InvalidDataError
        If a start is in an obstacle; as DivergedError, if the movement leaves the finite numbers.

    Examples
    --------
    >>> plane = uc.constraints.Plane(normal=[0, 0, 1])
    >>> uc.rollout(lambda x: -x, start=[1.0, 1.0, 1.0], steps=3, dt=0.5, constraint=plane, method="euler").states
    array([[1.  , 1.  , 1.  ],
           [0.5 , 0.5 , 1.  ],
           [0.25, 0.25, 1.  ]])
    """
    check_at_least("steps", steps, 1, whole=True)
    check_at_least("dt", dt, 0.0, strict=True)
    for given, known, value in (("method", STEPS, method), ("order", FLOWS, order)):
        if value not in known:
            raise SettingError(f"{given}: got {value!r}, expected one of {', '.join(map(str, known))}.")
    table, single = as_table(start, "start")
    state = table.reshape(1, -1) if single else table
    told: spaces.Space = space if space is not None else getattr(policy, "space_", spaces.Euclidean())
    flow = FLOWS[order](policy, constraint, task, told.over(state.shape[1]), dt, tuple(map(Once, obstacles)))
    flow.check(state)
    tracks = _Tracks.empty(flow, state, steps)
    names = [name] if single else [f"{name} {k + 1}" for k in range(len(state))]
    try:
        tracks.follow(state, method, _near(policy, state, least_support))
    except DivergedError as error:
        error.part = tracks.runs(names, single) if tracks.done > 1 else None
        raise
    tracks.warn(names, least_support)
    return tracks.runs(names, single)


@dataclass
class _Tracks:
    """K runs of T samples, the first so many of which are done, each until its own end."""

    flow: Flow
    states: Array
    actions: Array
    wanted: Array
    projections: Array
    ends: NDArray[np.intp]
    done: int = 0

    @classmethod
    def empty(cls, flow: Flow, state: Array, steps: int) -> Self:
        """Nothing done."""
        runs, n = state.shape
        states, shape = np.empty((runs, steps, n)), (runs, steps, flow.d)
        return cls(flow, states, np.empty(shape), np.empty(shape), np.empty((*shape, flow.d)), np.full(runs, steps))

    def follow(self, state: Array, method: Method, near: Callable[[Array], NDArray[np.bool_]]) -> None:
        """Go on to all ends; a run that comes from near to far has ended, and stays at the last state near."""
        steps, was_near = self.states.shape[1], np.zeros(len(state), np.bool_)
        for step in range(steps):
            time = self.flow.dt * step
            state = self.flow.settled(state, time)
            is_near = near(state)
            left = was_near & ~is_near & (self.ends == steps)
            self.ends[left], was_near = step, was_near | is_near
            if (self.ends < steps).all():
                return
            state = np.where(left[:, None], self.states[:, step - 1], state)
            found = self.flow.at(state, time)
            self.states[:, step] = state
            self.actions[:, step], self.wanted[:, step], self.projections[:, step] = found
            moved = STEPS[method](self.flow, state, time, self.flow.dt, self.flow.slopes(state, found[0]))
            state = np.where((self.ends == steps)[:, None], moved, state)
            self.done = step + 1

    def runs(self, names: Sequence[str], single: bool) -> Demonstration | list[Demonstration]:
        """What is done."""
        demos = [self._run(k, name) for k, name in enumerate(names)]
        return demos[0] if single else demos

    def _run(self, k: int, name: str) -> Demonstration:
        rows = slice(min(int(self.ends[k]), self.done))
        truth = Truth(self.wanted[k, rows], self.projections[k, rows])
        times = self.flow.dt * np.arange(rows.stop, dtype=np.float64)
        return Demonstration(self.states[k, rows], self.actions[k, rows], times, truth, name, self.flow.space)

    def warn(self, names: Sequence[str], least: float) -> None:
        """Say which runs have ended early, when, where and why."""
        early = np.flatnonzero(self.ends < self.states.shape[1])
        if not len(early):
            return
        k = int(early[self.ends[early].argmin()])
        last = int(self.ends[k]) - 1
        where = ", ".join(f"{each:.4g}" for each in self.states[k, last])
        many = f"{len(early)} of {len(names)} roll-outs stop, the first, " if len(names) > 1 else ""
        warn(
            f"{many}{names[k]}{',' if many else ' stops'} after {last * self.flow.dt:.4g} s at ({where}): a step on "
            f"nothing was demonstrated (support below {least:g}). Demonstrate there, guide the policy (uc.Guided), or "
            "go on with least_support=0.",
            SupportEndsWarning,
            stacklevel=3,
        )


def _near(policy: Callable[[Array], Array], state: Array, least: float) -> Callable[[Array], NDArray[np.bool_]]:
    """Whether states (K, n) are where something was demonstrated; all are, of policies that do not know."""
    support: Callable[[Array], Array] | None = getattr(policy, "support", None)
    try:
        if least > 0.0 and support is not None:
            _warn_of_starts(state, support(state), least)
            return lambda states: support(states) >= least
    except SettingError:  # affine and polynomial policies
        pass
    return lambda states: np.ones(len(states), np.bool_)


def _warn_of_starts(starts: Array, support: Array, least: float) -> None:
    """Say that movements begin where nothing was demonstrated, and at which support."""
    if not (away := np.flatnonzero(~(support >= least))).size:
        return
    where = ", ".join(f"{each:.4g}" for each in starts[away[0]])
    many = f" {away.size} of {len(starts)} starts, the first" if len(starts) > 1 else ""
    said = f"nothing was demonstrated near{many} ({where}) (support {support[away[0]]:.2g}): what follows is a guess. "
    warn(said + "Start nearer, or guide the policy (uc.Guided); least_support=0 does not warn.", SupportEndsWarning, 4)

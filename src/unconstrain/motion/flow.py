"""What moves states: a policy under constraints, at velocities or at accelerations, and the steps that follow it."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from ..base.arrays import LARGEST, Array
from ..base.errors import DivergedError, InvalidDataError, SettingError
from ..constraints import Constraint, constraint_matrices
from ..models import spaces
from ..risks import null_space_projection, project
from .obstacles import Obstacle, avoided, shortened, stopped

Task = Callable[[Array, Array], Array]
"""States (K, n) and times (K,) to the b of ``A u = b``, shape (K, k)."""

Method: TypeAlias = Literal["euler", "rk4", "adaptive"]
"""Of integration, see :func:`.rollout`."""

TOLERANCE = 1e-6
"""Error of an adaptive step, as a share of the way that it goes."""

HALVINGS = 12
"""An adaptive step is halved no more often."""

SHORT = 1e-3
"""Share of a step over which constraints are differentiated."""


@dataclass(frozen=True)
class Flow:
    """Velocities ``u = A⁺b + N π`` of K states, turned away from obstacles."""

    policy: Callable[[Array], Array]
    constraint: Constraint | Sequence[Constraint] | None
    task: Task | None
    space: spaces.Space
    dt: float
    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        if self.obstacles and not isinstance(self.space, spaces.Euclidean):
            raise SettingError("obstacles: states hold angles or orientations; expected flat states.")

    @property
    def d(self) -> int:
        """Number of actions."""
        return self.space.sizes[2]

    def check(self, state: Array) -> None:
        """Refuse constraints that are not as many as states, and states inside obstacles."""
        if self.constraint is not None and not callable(self.constraint) and len(self.constraint) != len(state):
            raise SettingError(
                f"constraint: got {len(self.constraint)} constraints for {len(state)} starts, expected one for each."
            )
        for k, obstacle in enumerate(self.obstacles):
            inside = obstacle(self.places(state))[0] < 0.0
            if inside.any():
                raise InvalidDataError(
                    f"start: {'' if len(state) == 1 else f'row {int(inside.argmax())} '}is inside obstacle {k + 1} of "
                    f"{len(self.obstacles)}; expected a start outside of all."
                )

    def at(self, state: Array, time: float) -> tuple[Array, Array, Array]:
        """``A⁺b + N π`` (K, d), π (K, d) and N (K, d, d)."""
        with self.told(state, time):
            matrices = self.matrices(state, time)
            projections = _projections(np.asarray(matrices, np.float64).tobytes(), matrices.shape).copy()
            wanted = self._wanted(state, projections)
        actions = _without_rounding(project(projections, wanted), wanted)
        actions = self.turned(state, actions, projections) + self.drift(matrices, state, time)
        if not (np.abs(actions) <= LARGEST).all():
            raise self._diverged(state, time)
        return actions, wanted, projections

    def slopes(self, state: Array, actions: Array) -> Array:
        """What the state changes by per second, (K, t)."""
        return actions

    def settled(self, state: Array, time: float) -> Array:
        """States that the constraint allows: here all of them."""
        return state

    def places(self, state: Array) -> Array:
        """Where obstacles may be, (K, m): here states."""
        return state

    def turned(self, state: Array, actions: Array, projections: Array) -> Array:
        """Actions (K, d) turned away from obstacles."""
        return avoided(self.obstacles, state, actions, projections, self.dt) if self.obstacles else actions

    def shortened(self, states: Array, ways: Array) -> Array:
        """As much of ways (K, t) as no obstacle is in."""
        return shortened([obstacle(states) for obstacle in self.obstacles], ways)

    def matrices(self, state: Array, time: float) -> Array:
        """A (K, k, d), that of each run; no row where nothing holds."""
        runs = len(state)
        if self.constraint is None:
            return np.zeros((runs, 0, self.d))
        now = np.full(runs, time)
        if callable(self.constraint):
            return constraint_matrices(self.constraint, state, now, self.d)
        each = enumerate(self.constraint)
        return np.concatenate([constraint_matrices(one, state[k : k + 1], now[k : k + 1], self.d) for k, one in each])

    def target(self, matrices: Array, state: Array, time: float) -> Array:
        """The b of the task, (K, k)."""
        if self.task is None:
            return np.zeros(matrices.shape[:2])
        target = np.asarray(self.task(state, np.full(len(state), time)), np.float64)
        if target.shape != matrices.shape[:2]:
            raise SettingError(
                f"task: got b of shape {target.shape} for A of shape {matrices.shape}, expected {matrices.shape[:2]}, "
                "one value for each row of the constraint."
            )
        return target

    def drift(self, matrices: Array, state: Array, time: float) -> Array:
        """``A⁺ b`` (K, d)."""
        return _least(matrices, self.target(matrices, state, time))

    def moved(self, states: Array, ways: Array, time: float) -> Array:
        """States after ways (K, t), as far as no obstacle is in them."""
        if self.obstacles:
            ways = self.shortened(states, ways)
        with np.errstate(over="ignore", invalid="ignore"):
            moved = self.space.step(states, ways)
        if not (np.abs(moved) <= LARGEST).all():
            raise self._diverged(states, time)
        return moved

    def clear(self, states: Array, ways: Array, others: Array) -> Array:
        """Ways, or others where an obstacle is in them."""
        if not self.obstacles:
            return ways
        short = self.shortened(states, ways)
        return np.where((short == ways).all(axis=1, keepdims=True), ways, others)

    @contextmanager
    def told(self, state: Array, time: float) -> Iterator[None]:
        """Say of what cannot be computed, but at the start, that it is because of where the movement went."""
        try:
            yield
        except InvalidDataError as error:
            if time == 0.0:
                raise
            raise self._diverged(state, time) from error

    def _wanted(self, state: Array, projections: Array) -> Array:
        """What the policy wants, (K, d); one that can, is told what the constraint leaves."""
        under = getattr(self.policy, "under", None)
        action = np.asarray(self.policy(state) if under is None else under(state, projections))
        if action.shape != (len(state), self.d):
            raise SettingError(
                f"policy: got actions of shape {action.shape} for states of shape {state.shape}; order=2 follows "
                "accelerations at positions and velocities, otherwise a rollout expects actions that are velocities of "
                f"the state{'' if self.d == state.shape[1] else f', {self.d} in their space'}."
            )
        return action

    def _diverged(self, states: Array, time: float) -> DivergedError:
        far = states[int(np.abs(states).max(axis=1).argmax())]
        return DivergedError(
            f"after {time:.4g} s, at ({', '.join(f'{each:.4g}' for each in far)}), the movement left the finite "
            f"numbers at step {int(time / self.dt + 1e-6)}: start nearer to the data, take a smaller dt, or guide the "
            "policy (uc.Guided)."
        )


class SecondOrder(Flow):
    """Accelerations of positions and velocities, ``x = (q, v)``, where a constraint holds these: ``A(q, t) v = b``.

    Differentiated, ``A a = ḃ − Ȧ v``, so that ``a = N π + A⁺(ḃ − Ȧ v)``; for constant constraints ``N π``. Velocities
    that a constraint does not allow, of a start, of what it has switched to, or of rounding, are lost as in an
    inelastic impact: ``v ← N v + A⁺b``. So is what would enter an obstacle within a step.
    """

    def __post_init__(self) -> None:
        ways = self.space.sizes[2]
        if ways % 2:
            raise SettingError(f"order: got 2 for states of {ways} directions, expected positions and velocities.")
        super().__post_init__()

    @property
    def d(self) -> int:
        """Half the directions: those of positions."""
        return self.space.sizes[2] // 2

    def slopes(self, state: Array, actions: Array) -> Array:
        """Velocities, then accelerations."""
        return np.concatenate([state[:, -self.d :], actions], axis=1)

    def settled(self, state: Array, time: float) -> Array:
        """With velocities ``N v + A⁺b``."""
        with self.told(state, time):
            matrices = self.matrices(state, time)
            velocities = state[:, -self.d :] + _least(matrices, self._missing(state, time))
        if self.obstacles:
            near = [obstacle(self.places(state)) for obstacle in self.obstacles]
            velocities = stopped(near, velocities, null_space_projection(matrices), self.dt)
        return np.concatenate([state[:, : -self.d], velocities], axis=1)

    def places(self, state: Array) -> Array:
        """Positions."""
        return state[:, : -self.d]

    def turned(self, state: Array, actions: Array, projections: Array) -> Array:
        """Accelerations as they are: obstacles stop velocities."""
        return actions

    def shortened(self, states: Array, ways: Array) -> Array:
        """With the ways of positions, (K, d), as far as no obstacle is in them."""
        return np.concatenate([super().shortened(self.places(states), ways[:, : self.d]), ways[:, self.d :]], axis=1)

    def matrices(self, state: Array, time: float) -> Array:
        """A at the positions."""
        return super().matrices(state[:, : -self.d], time)

    def target(self, matrices: Array, state: Array, time: float) -> Array:
        """``ḃ − Ȧ v``: the slope of b − A v where v stays, by differences ahead, where no switch is yet."""
        h = SHORT * self.dt
        way = h * self.slopes(state, np.zeros((len(state), self.d)))
        now, then, later = (self._missing(self.space.step(state, k * way), time + k * h) for k in range(3))
        return (4.0 * then - 3.0 * now - later) / (2.0 * h)

    def _missing(self, state: Array, time: float) -> Array:
        """``b − A v``, (K, k)."""
        matrices = self.matrices(state, time)
        return super().target(matrices, state[:, : -self.d], time) - project(matrices, state[:, -self.d :])


FLOWS = {1: Flow, 2: SecondOrder}


def _euler(flow: Flow, state: Array, time: float, dt: float, slope: Array) -> Array:
    return flow.moved(state, dt * slope, time)


def _rk4(flow: Flow, state: Array, time: float, dt: float, slope: Array) -> Array:
    slopes = [slope]
    for share in (0.5, 0.5, 1.0):
        between = flow.moved(state, share * dt * slopes[-1], time)
        slopes.append(_slope(flow, between, time + share * dt))
    way = dt / 6.0 * (slopes[0] + 2.0 * slopes[1] + 2.0 * slopes[2] + slopes[3])
    return flow.moved(state, flow.clear(state, way, dt * slope), time)


def _adaptive(flow: Flow, state: Array, time: float, dt: float, slope: Array, left: int = HALVINGS) -> Array:
    half = 0.5 * dt
    whole, middle = _rk4(flow, state, time, dt, slope), _rk4(flow, state, time, half, slope)
    end = _rk4(flow, middle, time + half, half, _slope(flow, middle, time + half))
    error, way = (np.abs(flow.space.difference(end, other)).max(axis=1) for other in (whole, state))
    if left == 0 or (error <= TOLERANCE * way).all():
        return end
    middle = _adaptive(flow, state, time, half, slope, left - 1)
    return _adaptive(flow, middle, time + half, half, _slope(flow, middle, time + half), left - 1)


STEPS = {"euler": _euler, "rk4": _rk4, "adaptive": _adaptive}


@lru_cache(maxsize=1)
def _projections(matrices: bytes, shape: tuple[int, ...]) -> Array:
    """N (K, d, d) of A; those of the last step are kept, since most constraints do not vary."""
    return null_space_projection(np.frombuffer(matrices).reshape(shape))


def _slope(flow: Flow, state: Array, time: float) -> Array:
    return flow.slopes(state, flow.at(state, time)[0])


def _least(matrices: Array, target: Array) -> Array:
    """``A⁺ b``, (K, d)."""
    if not target.any():
        return np.zeros((len(matrices), matrices.shape[2]))
    return np.einsum("knr,kr->kn", np.linalg.pinv(matrices, rcond=1e-9), target)


def _without_rounding(actions: Array, wanted: Array) -> Array:
    """Exactly no motion where the constraint takes all of it: rounding has a direction, rest has none."""
    rounding = np.abs(actions).max(axis=1, keepdims=True) <= 1e-12 * np.abs(wanted).max(axis=1, keepdims=True)
    return np.where(rounding, 0.0, actions)

"""A policy that arrives: free and under any constraint that it is told of."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.arrays import Array, as_matrix, as_vector, check_at_least
from ..base.display import Shown
from ..base.errors import InvalidDataError, SettingError
from ..deployment import Exportable
from ..models import ClosedForm, spaces
from ..recordings import Demonstration, stack
from ..risks import project
from .descent import Descent
from .orbit import Orbit, encircled, turns
from .potential import PACE, Potential, descended

_AT_REST = 0.3
"""A demonstration ends at rest, or nearly, below this share of its fastest motion if all end in one place, as any of
thirty shapes of handwriting does; else if its last tenth is below this share of its usual speed: half rounds end at 0.5
of it or faster though one began at four times that, movements to a goal that plates held off it at 0.2 at most."""

_LATE, _SLOWED = (0.93, 0.97), 0.6
"""Who comes to a goal is slower, in the last part of the way, than the second share of a usual speed; on a cycle many
stop at once."""

_ENDING = 0.1
"""Who ends faster than this share of a usual speed had not arrived, where most end elsewhere."""

_STILL = 0.02
"""A policy rests where it wants less than this share of its fastest motion, or twice as much as where it rests most."""

_TOGETHER = 0.1
"""Demonstrations end in one place within this share of their extent."""

_ROUND, _HALF = 0.9, 0.5
"""Demonstrations of a cycle turn by so much of it, in their mean; parts of one by less, but what ends at rest and turns
by less than half is none."""

_SEVERAL = 3
"""So many that end at rest in as many places show no goal but one to which a policy leads from them."""

_MOST, _TOLD = 0.75, 0.2
"""From the first share of the ends a policy comes to its rest, told to the second share of the extent: of 18 sets of
movements to a goal that plates held off it, it rested at most 3.3 cm from there in the eight so told, else 2 to 13."""


@dataclass(frozen=True, eq=False)
class Moved:
    """A policy (callable) elsewhere: as it is at states shifted back by (n,)."""

    policy: Callable[[Array], Array]
    by: Array

    def __call__(self, states: Array) -> Array:
        """Velocities (N, n)."""
        return self.policy(states - self.by)

    def closed_form(self) -> ClosedForm:
        """The formula elsewhere."""
        form = formula_of(self.policy)
        return replace(form, origin=form.origin + self.by)

    def describe(self, form: ClosedForm, notes: Mapping[str, Any] | None = None) -> Any:
        """What is said of it."""
        return self.policy.describe(form, notes)  # type: ignore[attr-defined]  # what has a formula says of it

    def step(self, x: ArrayLike, out: Array | None = None) -> Array:
        """Velocity at one state (n,)."""
        return _single(self.policy)(np.asarray(x) - self.by, out)


class Guided(Exportable, Shown):
    """A policy that arrives at a goal or on a cycle, from anywhere and under any constraint it is told of.

    A constraint that holds the robot has to be told, by :meth:`under`, as :func:`rollout` does; :meth:`step` is free,
    and movements that something holds unbeknown to it need not arrive.

    **At a goal.** Along every movement a convex potential V falls (:class:`~unconstrain.motion.potential.Potential`),
    which is learnt from the demonstrations so that the policy descends it by itself where it was shown. Elsewhere the
    velocity is corrected. With ``m = ½ N ∇V`` those velocities are allowed that are in the null space and in a ball,

        ``‖u + m‖ ≤ r = max(‖m‖ − s, ½ ‖m‖)``,   so that   ``−∇Vᵀu ≥ ‖u‖² + ‖m‖² − r²``:

    V falls with every such velocity, and with every Euler step of at most ``dt_``, except where ``N ∇V = 0``. On flat
    constraints that is the place, and the only one, where V has its minimum under the constraint: nothing better can be
    reached. Without a constraint it is the goal. The pace s bounds how slowly. A velocity ``N π`` in the ball is not
    changed. One outside goes to the nearest in it, and where it leads up V, further towards the centre:

        ``u = N (π + c) = −m + (Nπ + m) (r − κ² (‖Nπ + m‖ − r))₊ / ‖Nπ + m‖``,   ``κ = (mᵀNπ)₊ / ‖m‖ √(‖Nπ‖² + s²)``.

    **On a cycle.** A closed convex surface attracts that the demonstrated cycle is on, and which every plane through
    its inside cuts in one closed curve; the pace along it is the demonstrated one (:class:`.Orbit`).

    Both are continuous in the state. A constraint that moves, a task with a drift, or an obstacle may lift V.

    Parameters
    ----------
    policy : callable
        States (N, n) to velocities (N, n).
    goal : array_like, shape (n,), optional
        By default where the demonstrations come to rest, if most do or they do not go round: those that end where the
        policy rests, too, if there are any, as constraints stopped the others. If the ends of those that come to rest
        scatter about the place where the policy rests, by more than its standard error, or are in no one place but the
        policy leads from most to one, told to a fifth of the extent, it is that place.
    orbit : array_like, shape (T, n), or "shown", optional
        States on the cycle, all around it; "shown" are those of the demonstrations, from which it is found by default
        where they go round and most do not come to rest; if they stop at once on the cycle, they do not.
    demonstrations : Demonstration or sequence of Demonstration, optional
        Movements that are likely, on which the correction is to be small. By default those that the policy has kept.
    dt : float, optional
        Let V fall with Euler steps of this length, in seconds; longer ones cost more correction.

    Attributes
    ----------
    aim_ : Descent or Orbit
        What does it, as functions of velocities.
    goal_ : ndarray, shape (n,)
        Or the middle of the cycle.
    potential_ : Potential
    dt_ : float
        Seconds. With Euler steps of this length V falls, or cycles are wider than told by a few per cent of their size;
        a delay counts as twice such a step.

    Raises
    ------
    SettingError
        If the policy gives no velocities of flat states, no demonstration is known, or neither goal nor cycle.

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
        orbit: ArrayLike | Literal["shown"] | None = None,
        *,
        demonstrations: Demonstration | Sequence[Demonstration] | None = None,
        dt: float | None = None,
    ) -> None:
        if dt is not None:
            check_at_least("dt", dt, 0.0, strict=True)
        if goal is not None and orbit is not None:
            raise SettingError("orbit: got one beside a goal; expected one of the two.")
        self.policy = policy
        if orbit is not None and not isinstance(orbit, str):
            given = as_matrix(orbit, "orbit")
            self.aim_: Descent | Orbit = encircled([Demonstration(given, _velocities(policy, given))], policy)
            return
        shown = _kept(policy) if demonstrations is None else demonstrations
        demos = [shown] if isinstance(shown, Demonstration) else list(shown)
        wanted, around = _velocities(policy, stack(demos).states), self.goes_round(demos, goal, orbit)
        self.aim_ = _encircled(demos, policy) if around else _descent(demos, policy, wanted, goal, dt)

    @staticmethod
    def goes_round(
        demos: Sequence[Demonstration], goal: ArrayLike | None = None, orbit: str | None = None, policy: Any = None
    ) -> bool:
        """Whether they show a cycle; an error if neither that nor a goal, with a policy also if it is not one place."""
        if goal is not None:
            as_vector(goal, "goal", demos[0].states.shape[1])
            return False
        rests, around = _resting(demos), _around(demos)
        if orbit is not None and around < _HALF and 2 * sum(rests) > len(demos):
            raise _no_cycle(demos)
        if orbit is not None or (around >= _ROUND and 2 * sum(rests & _slowing(demos)) <= len(demos)):
            return True
        if not any(rests):
            where = "" if _apart(demos) <= _TOGETHER else ", nor where another does"
            raise SettingError(
                f"goal: no demonstration ends at rest{where}, and they make {around:.2f} turns in the mean: neither a "
                "goal nor a full round was shown. Record movements to their end, or all around; or pass goal=, or "
                "orbit='shown' for a cycle."
            )
        if policy is not None:
            _found(demos, policy, _velocities(policy, stack(demos).states))
        return False

    @property
    def potential_(self) -> Potential:
        """V."""
        return self.aim_.potential

    @property
    def goal_(self) -> Array:
        """Where V is zero, shape (n,)."""
        return self.potential_.goal

    @property
    def dt_(self) -> float:
        """Seconds; see above."""
        return self.aim_.dt

    def __call__(self, states: ArrayLike) -> Array:
        """Velocities (N, n) where nothing constrains."""
        table = as_matrix(states, "states")
        return self.aim_.guided(table, np.asarray(self.policy(table)))

    predict = __call__

    def under(self, states: ArrayLike, projections: Array) -> Array:
        """``π + c`` (N, n) under constraints with projections N (N, n, n): what :func:`rollout` follows."""
        table = as_matrix(states, "states")
        wanted = np.asarray(self.policy(table))
        held = project(projections, wanted)
        return wanted - held + self.aim_.guided(table, held, projections)

    def correction(self, states: ArrayLike) -> Array:
        """What is added to the policy's velocities where nothing constrains, (N, n)."""
        return self(states) - np.asarray(self.policy(as_matrix(states, "states")))

    def moved(self, by: ArrayLike) -> Guided:
        """The same motion elsewhere: everything that was learnt, shifted by (n,), as for a plate that was moved."""
        way, other = as_vector(by, "by", len(self.goal_)), copy(self)
        other.__dict__.pop("_step", None)
        other.policy = Moved(self.policy, way)
        other.aim_ = replace(self.aim_, potential=replace(self.potential_, goal=self.goal_ + way))
        return other

    def closed_form(self, scaler: Any = None) -> ClosedForm:
        """The policy in it as one formula, and the correction; see :meth:`~unconstrain.Policy.closed_form`.

        Raises
        ------
        SettingError
            If the policy in it has no formula, or a scaler is given.
        """
        if scaler is not None:
            raise SettingError("scaler: a guided policy is guided in the units of its own states. Export without one.")
        return replace(formula_of(self.policy), correction=self.aim_.correction())

    def describe(self, form: ClosedForm, notes: Mapping[str, Any] | None = None) -> Any:
        """What is said of the formula where it is used."""
        return self.policy.describe(form, notes)  # type: ignore[attr-defined]  # what has a formula says of it

    def step(self, x: ArrayLike, out: Array | None = None) -> Array:
        """Velocity at one state (n,), without overhead: for control loops; see :meth:`~unconstrain.Policy.step`."""
        plain, guide = self._step
        wanted = plain(x, out)
        guide(x, wanted)
        return wanted

    @cached_property
    def _step(self) -> tuple[Callable[..., Array], Callable[[ArrayLike, Array], None]]:
        return _single(self.policy), self.aim_.single()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what is prepared for single steps."""
        return {name: value for name, value in vars(self).items() if name != "_step"}

    def _summary(self) -> tuple[str, ...]:
        return type(self.policy).__name__, str(self.aim_)


def formula_of(policy: Any) -> ClosedForm:
    """Closed form of the policy that is guided."""
    if not hasattr(policy, "closed_form"):
        raise SettingError(
            f"policy: got {policy!r}, which has no formula to export. Guide a fitted policy of this package."
        )
    return cast(ClosedForm, policy.closed_form())


def _single(policy: Callable[[Array], Array]) -> Callable[..., Array]:
    """A policy as a function of one state (n,) and of where to put the velocity, or None."""
    step: Callable[..., Array] | None = getattr(policy, "step", None)
    return step or (lambda x, out: np.concatenate(policy(np.asarray([x], np.float64)), out=out))


def _encircled(demos: Sequence[Demonstration], policy: Callable[[Array], Array]) -> Orbit:
    """The cycle that was shown; strokes that do not go round, but straight on, show none."""
    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            return replace(encircled(demos, policy), whole=len(_rounds(demos)[0]) / len(demos))
    except InvalidDataError as error:
        raise _no_cycle(demos) from error


def _no_cycle(demos: Sequence[Demonstration]) -> SettingError:
    alone = f", or {advice}" if (advice := _rounds(demos)[1]) else ""
    return SettingError(
        f"orbit: demonstrations make {_around(demos):.2f} turns in the mean, and no cycle is near them. At least "
        f"{_HALF:g} is needed, and {_ROUND:g} to be sure: record whole rounds{alone}; or guide it to a goal, "
        "or not at all."
    )


def _around(demos: Sequence[Demonstration]) -> float:
    """Turns in the mean, whichever way round."""
    return float(abs(turns(demos).mean()))


def _rounds(demos: Sequence[Demonstration]) -> tuple[list[str], str]:
    """Which demonstrations go all the way round, and advice to learn from these alone, if only some do."""
    names = [one.name or str(k + 1) for k, one in enumerate(demos) if abs(turns(demos)[k]) >= _ROUND]
    alone = f"learn from the {len(names)} alone that make a cycle (episodes={(*names,)})"
    return names, alone * (0 < len(names) < len(demos))


def _given(demos: Sequence[Demonstration]) -> str:
    """What says where to, where demonstrations do not."""
    names, alone = _rounds(demos)
    cycle = "pass goal=, or orbit='shown' for a cycle" if names or _around(demos) >= _HALF else "give it with goal="
    return ", or ".join(filter(None, (alone, cycle) if 2 * len(names) >= len(demos) else (cycle, alone)))


def _descent(
    demos: Sequence[Demonstration], policy: Any, wanted: Array, goal: ArrayLike | None, dt: float | None
) -> Descent:
    """To the goal, or to where demonstrations end at rest."""
    states = stack(demos).states
    place = _found(demos, policy, wanted) if goal is None else as_vector(goal, "goal", states.shape[1])
    potential = descended(states, wanted, place, np.inf if dt is None else 2.0 / dt)
    return Descent(potential, PACE * float(np.sqrt((wanted**2).sum(axis=1).mean())))


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
            "stored policy does not). Pass demonstrations=, what it learnt from, as uc.prepare makes them."
        )
    kept, scale = training.samples, policy.scale_
    states, actions = kept.states, training.action_unit * kept.actions
    if scale is not None:
        states, actions = states * scale.states, scale.given(actions)
    ends = np.flatnonzero(np.diff(kept.groups)) + 1
    return [Demonstration(*pair) for pair in zip(np.split(states, ends), np.split(actions, ends), strict=True)]


def _apart(demos: Sequence[Demonstration], places: Array | None = None) -> float:
    """How far places, by default their ends, are from their mean, at most, as a share of demonstrations' extent."""
    places = np.array([demo.states[-1] for demo in demos]) if places is None else places
    far = np.linalg.norm(places - places.mean(axis=0), axis=1).max()
    return float(far / (np.linalg.norm(np.ptp(stack(demos).states, axis=0)) or 1.0))


def _resting(demos: Sequence[Demonstration]) -> NDArray[np.bool_]:
    """Which demonstrations end at rest, (K,)."""
    speeds = [np.linalg.norm(demo.actions, axis=1) for demo in demos]
    if len(demos) > 1 and _apart(demos) <= _TOGETHER:
        return np.array([speed[-1] <= _AT_REST * speed.max() for speed in speeds])
    return np.array([np.median(one[-max(3, len(one) // 10) :]) <= _AT_REST * _usual(np.sort(one)) for one in speeds])


def _slowing(demos: Sequence[Demonstration]) -> NDArray[np.bool_]:
    """Which slow down before their end, (K,), by their way, to which standing adds little; to one place all do."""
    found = np.full(len(demos), len(demos) > 1 and _apart(demos) <= _TOGETHER)
    for row, speeds in enumerate(np.linalg.norm(demo.actions, axis=1) for demo in demos):
        first, last = np.searchsorted(speeds.cumsum(), np.multiply(_LATE, speeds.sum()))
        found[row] |= np.median(speeds[first : last + 1]) <= _SLOWED * _usual(np.sort(speeds))
    return found


def _usual(speeds: Array) -> float:
    """Of sorted speeds that beyond which half of the way was made: neither a rest nor a fast start changes it much."""
    return float(speeds[np.searchsorted(speeds.cumsum(), speeds.sum() / 2.0)])


def _found(demos: Sequence[Demonstration], policy: Any, wanted: Array) -> Array:
    """Where demonstrations end at rest, (n,); those that end where the policy rests, too, if any do, were not held."""
    last = np.cumsum([len(demo) for demo in demos]) - 1
    left = np.linalg.norm(wanted[last], axis=1) / max(float(np.linalg.norm(wanted, axis=1).max()), 1e-300)
    rests = _resting(demos)
    slow = rests & (left <= max(_STILL, 2.0 * float(left[rests].min(initial=1.0)))) & (left <= _AT_REST)
    all_ends, ends = (stack(demos).states[last[some]] for some in (rests, slow if slow.any() else rests))
    extent = float(np.linalg.norm(np.ptp(stack(demos).states, axis=0)))
    gaps = np.linalg.norm(all_ends[:, None] - all_ends, axis=2)[np.triu_indices(len(all_ends), 1)]
    if _apart(demos, ends) > _TOGETHER or (len(all_ends) >= _SEVERAL and gaps.min() > _TOGETHER * extent):
        rest = _rest_of(policy, all_ends, demos, wanted)
        if rest is not None and rest[1] < _TOLD * extent:
            return rest[0]  # constraints held them off it, each elsewhere
        told = (
            f" The policy's own rest is told to within {rest[1]:.2g} only: record more, held in other ways."
            if rest
            else ""
        )
        mean = ", ".join(f"{value:.4g}" for value in all_ends.mean(axis=0))
        raise InvalidDataError(
            f"goal: demonstrations end at rest in places up to {_apart(demos, all_ends):.0%} of their extent from the "
            f"mean of these; expected one place; {_given(demos)} (the mean of their ends is goal=({mean})).{told}"
        )
    place, rest = ends.mean(axis=0), _rest_of(policy, ends, demos, wanted)
    scatter = np.linalg.norm(all_ends - place, axis=1).max()
    if rest is not None and max(rest[1], np.linalg.norm(rest[0] - place)) < scatter:
        place = rest[0]
    _doubt_goal(demos, place)
    if not slow.any():
        warnings.warn(
            f"goal: where demonstrations end at rest the policy goes on, at {left[rests].min():.0%} of its fastest: "
            "something may have stopped them there. Give the goal with goal=.",
            UserWarning,
            stacklevel=3,
        )
    return np.asarray(place)


def _doubt_goal(demos: Sequence[Demonstration], place: Array) -> None:
    """Warn of a goal that most demonstrations end far from, and the others were still moving at."""
    states, last = stack(demos).states, np.array([one.states[-1] for one in demos])
    near = np.linalg.norm(last - place, axis=1) <= _TOGETHER * np.linalg.norm(np.ptp(states, axis=0))
    speeds = [np.linalg.norm(one.actions, axis=1) for one in demos]
    left = np.array([one[-1] / (_usual(np.sort(one)) or 1.0) for one in speeds])[near]
    if 2 * near.sum() < len(demos) and len(left) and np.median(left) > _ENDING:
        spread = ", ".join(f"{one:.2g}" for one in last.std(axis=0))
        warnings.warn(
            f"goal: {near.sum()} of {len(demos)} demonstrations end near it, still at {np.median(left):.0%} of their "
            f"usual speed, and all ends scatter by ({spread}): they show no goal. Record movements to their end, or "
            "give the goal with goal=.",
            UserWarning,
            stacklevel=4,
        )


def _rest_of(policy: Any, ends: Array, demos: Sequence[Demonstration], wanted: Array) -> tuple[Array, float] | None:
    """The one place in what was shown to which a policy comes, and its standard error; sought from the ends (K, n).

    The error is by what noise and demonstrations leave open of the policy there.
    """
    from scipy.optimize import least_squares  # takes long to import

    states, usual = stack(demos).states, float(np.sqrt((wanted**2).sum(axis=1).mean()))
    low, high = states.min(axis=0), states.max(axis=0)
    if not hasattr(policy, "covariances") or usual == 0.0 or (low == high).any():
        return None
    every = [least_squares(lambda x: policy(x[None])[0] / usual, end, bounds=(low, high)) for end in ends]
    # elsewhere it does not rest, or nothing comes there
    found = [one for one in every if one.cost <= _STILL**2 / 2.0 and np.linalg.eigvals(one.jac).real.max() < 0.0]
    if not found or len(found) < _MOST * len(ends) or _apart(demos, np.array([one.x for one in found])) > _STILL:
        return None
    places, slope = np.array([one.x for one in found]), usual * found[0].jac
    with suppress(SettingError, np.linalg.LinAlgError):
        back = np.linalg.inv(slope)
        return places[0], float(np.sqrt(np.trace(back @ policy.covariances(places[:1])[0] @ back.T)))
    return None


STORED = (Descent, Guided, Moved, Orbit, Potential)
"""What guided policies are made of, for their file."""

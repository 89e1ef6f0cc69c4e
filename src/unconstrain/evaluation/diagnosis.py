"""Diagnosis of a robust fit in figures: noise, undetermined states, free demonstrations, and what to record next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, on_host
from ..base.display import innermost
from ..base.errors import InvalidDataError, MissingBeliefError
from ..base.files import stem
from ..learners import Solution, robust
from ..models import Scale, choose_variance, cover
from ..recordings import Demonstration, stack
from .marks import ENOUGH as ENOUGH
from .marks import PARTLY
from .marks import SMALL as SMALL
from .metrics import along_motion
from .sentences import CONSTRAINED as CONSTRAINED
from .sentences import COUNTED as COUNTED
from .sentences import FREE as FREE
from .sentences import KEPT, looks
from .sentences import LOOKS as LOOKS
from .sentences import about_choice as about_choice
from .sentences import about_freedom as about_freedom
from .sentences import about_suspects as about_suspects
from .sentences import in_words as in_words
from .sentences import models_of as models_of
from .sentences import needs_more as needs_more
from .sentences import nowhere as nowhere
from .sentences import sentences as sentences
from .sentences import to_record as to_record
from .shown import FLAT as FLAT
from .shown import ONE as ONE
from .shown import about_recordings as about_recordings
from .shown import crossed, names_of
from .shown import flat as flat
from .shown import named as named
from .shown import planes_of as planes_of

if TYPE_CHECKING:
    from ..policies import Policy


class Place(NamedTuple):
    """Where a sample is: its demonstration, its number in it, counted from one, and its time in seconds, if known.

    Of one that was recorded the file, and the row of its recording, from 0 as in all remarks about recordings.
    """

    demonstration: str
    sample: int
    time: float | None
    file: str = ""
    row: int | None = None

    def __str__(self) -> str:
        time = "" if self.time is None else f" ({self.time:.4g} s)"
        if self.row is None:
            return f"{self.demonstration} sample {self.sample}{time}"
        named = not self.file or stem(self.file) != self.demonstration
        place = [self.file, f"'{self.demonstration}'" if named else "", f"row {self.row}"]
        return f"{' '.join(filter(None, place))}{time}"


def places_of(rows: NDArray[np.intp], demonstrations: Iterable[tuple[str, Demonstration]]) -> list[Place]:
    """Where some samples of named demonstrations, or blocks of them, laid end to end are, rows ascending."""
    found: list[Place] = []
    start, before = 0, Counter[str]()
    for name, demo in demonstrations:
        inside = rows[(start <= rows) & (rows < start + len(demo))] - start
        times = [None] * len(inside) if demo.times is None else demo.times[inside].tolist()
        samples = (before[name] + inside + 1).tolist()
        known = demo.source
        rows_of = [None] * len(inside) if known is None else known.rows[inside].tolist()
        places = zip(samples, times, rows_of, strict=True)
        found += [Place(name, sample, time, known.file if known else "", row) for sample, time, row in places]
        start, before[name] = start + len(demo), before[name] + len(demo)
    return found


@dataclass(frozen=True)
class Region:
    """A region of state space, and the state in it of largest spread, of those that all leave open if there are any.

    Parameters
    ----------
    centre : tuple of float
        Of the receptive field, in units of the state.
    samples : int
        Number of samples whose nearest field this is.
    determined, together : float
        Share of these samples at which the policy is determined by whichever demonstrations are but two, and by all.
    spread : float
        Root-mean-square undetermined standard deviation over them, any two left out, as a share of the typical action.
    state : tuple of float
        That recorded state.
    demonstration : str
        Demonstration of that state.
    direction : tuple of float
        Unit vector of actions along which it is largest there.
    along : float
        Undetermined standard deviation along it, as a share of the typical action.
    shown_by : tuple of str
        Demonstrations that moved along it in this region, by more than the noise.
    """

    centre: tuple[float, ...]
    samples: int
    determined: float
    together: float
    spread: float
    state: tuple[float, ...]
    demonstration: str
    direction: tuple[float, ...]
    along: float
    shown_by: tuple[str, ...]


@dataclass(frozen=True)
class Movement:
    """One demonstration: its name, samples, mean probability of a free sample (None if unknown), and as in Region.

    It ``looks`` free, constrained, unsure, flat or line if it keeps to such a one that others leave, round if to such
    a surface about which it winds, untold; or None.
    """

    name: str
    samples: int
    free: float | None
    determined: float
    spread: float
    looks: str | None


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where the policy is determined by the data, and where it is not.

    Parameters
    ----------
    method : str
        Which candidate :class:`~unconstrain.Robust` took.
    candidates : dict
        Estimated squared error of each candidate, as a share of the mean squared action, by name.
    noise : float
        Standard deviation of the noise on each action coordinate, misfit of the model included; units of the action.
    noise_share : float
        Noise of all coordinates together, as a share of the typical action.
    jitter : float
        Noise by differences in time, independent of the model; infinite where demonstrations are too short, and biased
        upwards where constraints change at every sample.
    typical : float
        Root mean square length of the recorded actions.
    directions : int
        Weight directions, of all models together.
    directions_determined : float
        Share of them in which the data has more than half of the posterior precision.
    states_determined : float
        Share of the recorded states at which the undetermined spread is at most a tenth of the typical action, or below
        that from noise, where this is below the typical action: lengths over coordinates of ``policy.uncertainty``.
    told_together : float
        That, or if more the share at which all demonstrations together determine it, and one or two may be needed.
    free_share : float
        Estimated share of samples that nothing constrained; none on a plane that others cross.
    undecided_share : float
        Estimated share of samples that were free or always held in the same way: the data cannot tell, nor there.
    regions : tuple of Region
        First those that all demonstrations leave open; of these, and of others, by decreasing spread ``along``.
    movements : tuple of Movement
        Each demonstration.
    suspects : tuple of Place
        Samples that look wrong beside their neighbours in time, and were left out; none where the policy was fitted to
        others.
    planes : int
        How many :func:`planes_of` finds.
    told : ndarray of int, shape (N,)
        At each recorded state 2 if three or more tell the policy, 1 if it hangs on one or two demonstrations, else 0.
    undetermined, from_noise : ndarray, shape (N,)
        Length of the standard deviations at each recorded state, as a share of the typical action.
    free : ndarray, shape (N,), optional
        Probability that each sample was free; None where the policy was fitted to others.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> demos = [uc.Demonstration(states[k::3], -states[k::3]) for k in range(3)]
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit_demonstrations(demos)
    >>> uc.evaluation.diagnose(policy, demos).undetermined.shape
    (60,)
    """

    method: str
    candidates: dict[str, float]
    noise: float
    noise_share: float
    jitter: float
    typical: float
    directions: int
    directions_determined: float
    states_determined: float
    told_together: float
    free_share: float
    undecided_share: float
    regions: tuple[Region, ...]
    movements: tuple[Movement, ...]
    suspects: tuple[Place, ...]
    planes: int
    told: NDArray[np.int_]
    undetermined: Array
    from_noise: Array
    free: Array | None

    def to_json(self) -> dict[str, Any]:
        """All fields but those with one value a sample; None for what is not finite."""
        plain = {one.name: getattr(self, one.name) for one in fields(self)}
        kept = {name: one for name, one in plain.items() if name not in ("told", "undetermined", "from_noise", "free")}
        kept["jitter"] = self.jitter if np.isfinite(self.jitter) else None
        named = {name: [vars(one) for one in plain[name]] for name in ("regions", "movements")}
        return kept | named | {"suspects": [one._asdict() for one in self.suspects]}


def diagnose(policy: Policy, demonstrations: Sequence[Demonstration]) -> Diagnosis:
    """Diagnose a policy fitted with :class:`~unconstrain.Robust` at the states of some demonstrations.

    Parameters
    ----------
    policy : Policy
    demonstrations : sequence of Demonstration
        Those it was fitted to, in the same order, or others.

    Raises
    ------
    SettingError
        If the learner does not use the samples.
    InvalidDataError
        If there is one action column only, no motion, or too little data to hold anything out.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> demos = [uc.Demonstration(states[k::3], -states[k::3]) for k in range(3)]
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit_demonstrations(demos)
    >>> len(uc.evaluation.diagnose(policy, demos).movements)
    3
    """
    if policy.scale_ is None:
        return _diagnosed(policy, list(demonstrations))
    scale = policy.scale_
    own = [replace(one, states=scale.state(one.states), actions=scale.action(one.actions)) for one in demonstrations]
    found = _diagnosed(policy.in_own_units(), own)
    return replace(found, regions=tuple(_in_units(region, scale) for region in found.regions))


def _in_units(region: Region, scale: Scale) -> Region:
    """A region in the units of the data."""
    direction = scale.given(np.array(region.direction))
    return replace(
        region,
        centre=_numbers(np.array(region.centre) * scale.states),
        state=_numbers(np.array(region.state) * scale.states),
        direction=_numbers(direction / np.linalg.norm(direction)),
    )


def _diagnosed(policy: Policy, demos: list[Demonstration]) -> Diagnosis:
    solution = policy.solution_
    states, actions, groups = stack(demos)
    spread, belief = policy.uncertainty(states), solution.believed  # raises where the learner has none
    typical = _typical(actions, solution)
    undetermined, from_noise = (
        np.linalg.norm(one, axis=1) / typical for one in (spread.undetermined, spread.from_noise)
    )
    known = untold_at(policy, states, typical) <= SMALL
    models, d, _ = solution.weights.shape
    free = solution.free if len(solution.free) == len(states) else None
    known &= free is None or len({one.states.tobytes() for one in demos}) >= ENOUGH  # a copy tells nothing more
    together = belief.together if free is not None and len(belief.together) == len(states) else known
    jitter = float(np.sqrt(robust.noise_by_differences(actions, groups)))
    movements = _movements(demos, undetermined, known, free, max(jitter, 0.1 * SMALL * typical))
    others = [one for one in movements if one.looks not in KEPT]
    seem = sum(one.samples * (one.free or 0.0) for one in others) / len(states) if others != [*movements] else 1.0
    free_share = min(solution.free_share, seem)  # what keeps to something is not told
    return Diagnosis(
        method=solution.method,
        candidates={name: one.risk for name, one in belief.candidates.items()},
        noise=solution.noise,
        noise_share=float(np.sqrt(d)) * solution.noise / typical,
        jitter=jitter,
        typical=typical,
        directions=models * solution.directions,
        directions_determined=solution.determined_share,
        states_determined=float(known.mean()),
        told_together=max(float(known.mean()), 0.0 if free is None else belief.told_together),
        free_share=free_share,
        undecided_share=solution.free_share + belief.undecided_share - free_share,
        regions=_regions(policy, demos, undetermined, known, typical, known | together),
        movements=movements,
        suspects=() if free is None else tuple(places_of(belief.suspects, zip(names_of(demos), demos, strict=True))),
        planes=len(planes_of(demos)),
        told=known.astype(int) + (known | together),
        undetermined=undetermined,
        from_noise=from_noise,
        free=free,
    )


def untold(policy: Policy, movement: Demonstration) -> Array | None:
    """:func:`untold_at` along a roll-out, in the directions that its constraint left, shape (T,).

    None where the policy does not know, or does nothing.
    """
    if movement.truth is None or not movement.truth.policy.any():
        return None
    typical = float(np.sqrt((movement.truth.policy**2).sum(axis=1).mean()))
    try:
        return untold_at(policy, movement.states, typical, movement.truth.projections)
    except MissingBeliefError:
        return None


def untold_at(policy: Policy, states: Array, typical: float, left: Array | None = None) -> Array:
    """What no recording tells of the policy at N states, shape (N,).

    A standard deviation, as a share of the typical length of actions, in all directions or in those that projections
    ``left`` (N, d, d) leave; zero where noise is more, but less than a typical action. Above :data:`SMALL` no recording
    tells the policy there.
    """
    spread = policy.uncertainty(states)
    noise, open_ = (np.linalg.norm(one, axis=1) for one in (spread.from_noise, spread.undetermined))
    if left is not None:
        variances = np.trace(left @ policy.covariances(states) @ left, axis1=1, axis2=2)
        open_ = np.sqrt(np.maximum(variances, 0.0))
    told: Array = np.where((open_ < noise) & (noise < typical), 0.0, open_) / typical
    return told


def states_told(policy: Policy) -> float | None:
    """:attr:`Diagnosis.told_together` of a policy that has just learnt; None where not known."""
    kept, belief = policy.training_.kept, policy.solution_.belief
    if kept is None or belief is None or policy.n_outputs_ == 1 or not kept.whole.actions.any():
        return None
    states, actions = map(on_host, kept.whole[:2])
    typical = float(np.sqrt((actions**2).sum(axis=1).mean()))
    told = max(float((untold_at(policy.in_own_units(), states, typical) <= SMALL).mean()), belief.told_together)
    return min(told, 1.0)  # a sum of shares may be more by rounding


def lost_by_guiding(moving: Any, demonstrations: Sequence[Demonstration]) -> float | None:
    """Share of the motion of demonstrations that a policy explains less as it is guided; None where it is not."""
    policy = innermost(moving)
    if policy is moving:
        return None
    (guided, motion), (alone, _) = (along_motion(one, demonstrations) for one in (moving, policy))
    return max(guided - alone, 0.0) / motion if motion > 0 else 0.0


def _typical(actions: Array, solution: Solution) -> float:
    """Root-mean-square length of the actions; raises where nothing can be diagnosed."""
    typical = float(np.sqrt((actions**2).sum(axis=1).mean()))
    if actions.shape[1] == 1:
        raise InvalidDataError(
            "got one action column, expected at least two: in one dimension a constraint removes all of the action "
            "or nothing."
        )
    if typical == 0.0:
        raise InvalidDataError("all actions are zero, expected some motion.")
    if np.isnan(solution.believed.held_out_score):
        raise InvalidDataError(
            "too little could be held out, expected at least two different samples or demonstrations in motion."
        )
    return typical


def _regions(
    policy: Policy, demos: list[Demonstration], undetermined: Array, known: Any, typical: float, together: Any
) -> tuple[Region, ...]:
    states, actions, groups = stack(demos)
    embedding = policy.training_.model.embedding
    seen = embedding(states)
    fields = policy.fields_ if hasattr(policy, "fields_") else cover(seen, choose_variance(seen))
    nearest = fields.weights(seen).argmax(axis=1)
    centres = enumerate(embedding.states(fields.centres))
    found = [(centre, rows) for index, centre in centres if len(rows := np.flatnonzero(nearest == index))]
    worst = [int(rows[np.lexsort((undetermined[rows], ~together[rows]))[-1]]) for _, rows in found]
    directions, along = _least_determined(policy, states[worst])
    names, noise = names_of(demos), policy.solution_.noise
    every = (
        Region(
            _numbers(centre),
            len(rows),
            float(known[rows].mean()),
            float(together[rows].mean()),
            float(np.sqrt((undetermined[rows] ** 2).mean())),
            _numbers(states[row]),
            names[groups[row]],
            _numbers(direction),
            float(size) / typical,
            tuple(names[one] for one in _moved(actions[rows] @ direction, groups[rows], max(noise, SMALL * typical))),
        )
        for (centre, rows), row, direction, size in zip(found, worst, directions, along, strict=True)
    )
    return tuple(sorted(every, key=lambda one: (one.together >= PARTLY, -one.along)))


def places(regions: Sequence[Region]) -> list[Region]:
    """Regions without those within a tenth of the extents of one before, and 45° of its direction: one tells both."""
    near, kept = np.ptp([one.state for one in regions], axis=0) * 0.1 + 1e-300, list[Region]()
    for one in regions:
        by = [each for each in kept if (np.abs(np.subtract(each.state, one.state)) <= near).all()]
        kept += [] if any(abs(np.dot(each.direction, one.direction)) >= 0.7 for each in by) else [one]
    return kept


def _moved(speeds: Array, groups: NDArray[np.intp], least: float) -> list[int]:
    """Demonstrations whose root-mean-square speed is above some speed."""
    return [int(one) for one in np.unique(groups) if np.sqrt((speeds[groups == one] ** 2).mean()) > least]


def _least_determined(policy: Policy, states: Array) -> tuple[Array, Array]:
    """Principal axes (K, d) of the undetermined covariance, towards the prediction, and the spreads along them (K,)."""
    values, vectors = np.linalg.eigh(policy.covariances(states))
    directions = vectors[:, :, -1]
    ahead = (directions * policy(states)).sum(axis=1) >= 0
    return np.where(ahead[:, None], directions, -directions), np.sqrt(np.maximum(values[:, -1], 0.0))


def _movements(
    demos: list[Demonstration], undetermined: Array, known: NDArray[np.bool_], free: Array | None, noise: float
) -> tuple[Movement, ...]:
    groups, found = stack(demos).groups, list[Movement]()
    for index, (name, kept) in enumerate(zip(names_of(demos), crossed(demos, noise), strict=True)):
        part = groups == index
        mean, told = None if free is None else float(free[part].mean()), float(known[part].mean())
        how = None if mean is None else looks(mean, told, kept)
        spread = float(np.sqrt((undetermined[part] ** 2).mean()))
        found.append(Movement(name, int(part.sum()), mean, told, spread, how))
    return tuple(found)


def _numbers(values: Array) -> tuple[float, ...]:
    return tuple(map(float, values))

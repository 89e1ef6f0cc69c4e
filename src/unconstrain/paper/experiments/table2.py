"""Table II: an arm of seven joints whose hand is held in one to six coordinates (section IV-B)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

import unconstrain as uc

from ..systems.arm import LWR3, JointLimitAvoidance
from . import toy
from .journal import Journal
from .trials import Progress, Result, errors, errors_of, row, run_trials

CONSTRAINTS = ("1", "1-2", "1-2-3", "1-...-4", "1-...-5", "1-...-6")
"""Which coordinates of the hand are held; rows of the Jacobian."""

PAPER: dict[str, tuple[tuple[float, float, float, float], ...]] = {
    "direct": (
        (26.94, 3.02, 3.63, 0.54),
        (70.51, 2.22, 5.72, 0.66),
        (80.70, 1.59, 4.09, 0.33),
        (86.63, 1.36, 4.66, 0.44),
        (91.47, 0.91, 3.59, 0.39),
        (96.78, 0.78, 1.85, 0.27),
    ),
    "inconsistency": (
        (18.30, 5.46, 14.53, 5.08),
        (6.53, 2.90, 1.04, 0.37),
        (6.93, 2.79, 0.50, 0.11),
        (4.57, 2.49, 0.27, 0.02),
        (5.28, 3.40, 0.16, 0.02),
        (233.37, 136.97, 0.04, 0.01),
    ),
    "hybrid": (
        (10.54, 4.56, 6.98, 3.90),
        (5.85, 1.94, 1.00, 0.30),
        (18.17, 8.00, 0.55, 0.14),
        (8.04, 4.16, 0.28, 0.03),
        (8.98, 5.25, 0.18, 0.03),
        (41.30, 3.93, 0.05, 0.01),
    ),
}
"""The printed table, × 10⁻²: nUPE mean and s.d., nCPE mean and s.d., by number of coordinates held."""


@dataclass(frozen=True)
class Reading:
    """A reading of what the paper says of its data and learners; each learns with all three methods.

    Parameters
    ----------
    demonstrations : int
        Trajectories, as a multiple of those of the settings.
    limit : float, optional
        The largest angle of every joint, degrees, by half of which start postures are bounded; by default the arm's.
    fresh : bool
        Test on further trajectories, instead of on a share of the samples of those that are learnt from.
    weighted : bool
        Weight samples by speed, and soften the hybrid.
    """

    demonstrations: int = 1
    limit: float | None = None
    fresh: bool = False
    weighted: bool = False


READINGS = {
    "": Reading(),
    ", twice as many": Reading(demonstrations=2),
    ", all joints 170°": Reading(limit=170.0),
    ", fresh": Reading(fresh=True),
    ", fresh, weighted": Reading(fresh=True, weighted=True),
}
"""By what is added to the name of the method. The first is the paper's text, word for word.

Its inconsistency is worse than the printed one at two to five coordinates held. That depends on how densely states
are seen: two further readings see more, with more trajectories, and with the one limit that the paper names for all.
"""

METHODS = ("direct", "inconsistency", "hybrid")
JACOBIAN = "Jacobian known"
"""The default learner with the arm's Jacobian, though not which rows of it are held; on fresh trajectories."""


@dataclass(frozen=True)
class Settings:
    """Settings of Table II.

    Parameters
    ----------
    trials : int
        Data sets for each constraint.
    seed : int
        Of everything random.
    demonstrations, steps : int
        Trajectories, and points of each.
    gain, power : float
        Of the joint-limit avoidance.
    variance, at_least : float
        σ² of the receptive fields, rad², and the weight that every sample has in one.
    dt : float
        Step size; the paper is silent on it.
    test_share : float
        Share of the samples, drawn at random from all trajectories, that is held out for testing.
    test_demonstrations : int
        Further trajectories under the same constraint, to be tested on where they are fresh.
    folds : int
        Of whole trajectories, on which thresholds are chosen.
    alpha : float
        See :class:`~unconstrain.Hybrid`.
    speed_power, weighted_alpha, softness : float
        Where samples are weighted: by this power of their speed, and by which hybrid.
    jacobian_trials : int
        Of the data sets, so many are learnt with the Jacobian known too, which takes ten times as long.
    """

    trials: int = 50
    seed: int = 0
    demonstrations: int = 100
    steps: int = 100
    gain: float = 0.05
    power: float = 1.8
    variance: float = 3.0
    at_least: float = 0.7
    # ---- the paper is silent on these; chosen on other seeds than the reported ones
    dt: float = 0.5
    test_share: float = 0.2
    test_demonstrations: int = 100
    folds: int = 10
    alpha: float = 1e-4
    speed_power: float = 0.5
    weighted_alpha: float = 1e-5
    softness: float = 6e-5
    jacobian_trials: int = 10


def run(
    settings: Settings | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    journal: Journal | None = None,
) -> Result:
    """Reproduce Table II; parameters as in :func:`unconstrain.paper.experiments.table1.run`.

    Returns
    -------
    Result
        Rows of each reading, the paper's first; ``tables["jacobian_known"]`` has those of the learner that knows the
        Jacobian, over the first data sets, beside the hybrid of the same data.
    """
    chosen = settings or Settings()
    seeds = np.random.SeedSequence(chosen.seed).spawn(chosen.trials)
    # All constraints of one data set follow each other: an interrupted run has whole data sets.
    calls = [
        (chosen, held, seed, place < chosen.jacobian_trials)
        for place, seed in enumerate(seeds)
        for held in range(1, len(CONSTRAINTS) + 1)
    ]
    found = run_trials(trial, calls, workers, progress, journal)
    rows = _rows(found, [method + reading for reading in READINGS for method in METHODS])
    first = found[: len(CONSTRAINTS) * chosen.jacobian_trials]
    beside = _rows(first, ["hybrid, fresh", JACOBIAN]) if first else []
    return Result("table2", chosen, rows, tables={"jacobian_known": beside})


def _rows(found: Sequence[dict[str, tuple[float, ...]]], methods: Sequence[str]) -> list[dict[str, Any]]:
    return [
        row(method, [one[method] for one in found[index :: len(CONSTRAINTS)]], constraint=constraint)
        | _printed(method, index)
        for method in methods
        for index, constraint in enumerate(CONSTRAINTS)
    ]


def agreement(rows: Sequence[dict[str, Any]]) -> tuple[int, int]:
    """How many printed values some rows are as near to as the printed s.d. or a tenth of the value, and of how many."""
    near = [
        abs(one[f"{metric}_mean"] - one[f"paper_{metric}_mean"])
        <= max(one[f"paper_{metric}_sd"], 0.1 * one[f"paper_{metric}_mean"])
        for one in rows
        for metric in ("nupe", "ncpe")
    ]
    return sum(near), len(near)


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """How many of the printed values are found, read as the paper words it."""
    verdicts = uc.evaluation.verdicts
    near, count = agreement([one for one in result.rows if one["method"] in METHODS])
    mark, word = verdicts.Mark.DOUBTFUL, "in part"
    if near >= verdicts.GOOD * count or near < count / 2:
        mark, word = (verdicts.Mark.GOOD, "yes") if near >= count / 2 else (verdicts.Mark.BAD, "no")
    return verdicts.Verdict(
        mark,
        f"Reproduced: {word}. {near} of {count} printed values within one printed s.d. or 10 %.",
        "The order of the methods, and the values that are near.",
        "" if word == "yes" else "Single values: the paper leaves weights, α and the kind of test samples open.",
        "Compare the readings below; test samples and fresh trajectories stand apart.",
    )


def headlines(result: Result) -> list[str]:
    """What agrees with the paper; the hybrid beside it, in a sentence for each constraint; and what knows more."""
    said = []
    for reading in READINGS:
        rows = [one for one in result.rows if one["method"] in [method + reading for method in METHODS]]
        near, count = agreement(rows)
        said.append(
            f"{near} of the {count} printed values within one printed s.d. or 10 %: the paper's reading{reading}"
        )
    mean = {(one["method"], one["constraint"]): one for one in result.rows}
    for constraint in CONSTRAINTS:
        ours = mean["hybrid", constraint]
        other = min(mean[method, constraint]["nupe_mean"] for method in ("direct", "inconsistency"))
        said.append(
            f"{constraint}: hybrid nUPE {100 * ours['nupe_mean']:.2f}e-2, median {100 * ours['nupe_median']:.2f}e-2 "
            f"(paper {100 * ours['paper_nupe_mean']:.2f} ± {100 * ours['paper_nupe_sd']:.2f}), "
            f"{ours['nupe_mean'] / other:.2f} times the better of the other two; "
            f"nCPE {100 * ours['ncpe_mean']:.3f}e-2 (paper {100 * ours['paper_ncpe_mean']:.2f})"
        )
    said += [
        f"{one['constraint']}: {JACOBIAN}, fresh: nUPE {100 * one['nupe_mean']:.2f}e-2, "
        f"median {100 * one['nupe_median']:.2f}e-2"
        for one in result.tables["jacobian_known"]
        if one["method"] == JACOBIAN
    ]
    return said


def learners(settings: Settings, reading: Reading) -> dict[str, uc.Learner]:
    """The three methods."""
    softened = uc.Hybrid(settings.weighted_alpha, softness=settings.softness)
    hybrid = softened if reading.weighted else uc.Hybrid(settings.alpha)
    return {"direct": uc.Direct(), "inconsistency": uc.Inconsistency(), "hybrid": hybrid}


def demonstrate(
    settings: Settings, held: int, count: int, rng: np.random.Generator, limit: float | None = None
) -> list[uc.Demonstration]:
    """Record the arm while the first ``held`` coordinates of its hand are kept still; see :class:`Reading`."""
    largest = LWR3.upper if limit is None else np.radians(limit)
    starts = rng.uniform(-0.5, 0.5, (count, LWR3.joints)) * largest
    constraint = uc.constraints.JacobianRows(LWR3.jacobian, tuple(range(held)))
    policy = JointLimitAvoidance(settings.gain, settings.power)
    name = f"arm {CONSTRAINTS[held - 1]}"
    return cast(
        "list[uc.Demonstration]",
        uc.rollout(policy, starts, settings.steps, settings.dt, constraint, name=name, method="euler"),
    )


def data_set(
    settings: Settings, held: int, reading: Reading, seed: np.random.SeedSequence
) -> tuple[list[uc.Demonstration], list[uc.Demonstration]]:
    """Demonstrations to learn from and to be tested on; of one seed, all readings begin with the same draws."""
    rng = np.random.default_rng([held, *seed.generate_state(4)])
    demos = demonstrate(settings, held, reading.demonstrations * settings.demonstrations, rng, reading.limit)
    if reading.fresh:
        return demos, demonstrate(settings, held, settings.test_demonstrations, rng, reading.limit)
    return toy.split(demos, settings.test_share, rng)


def trial(
    settings: Settings, held: int, seed: np.random.SeedSequence, jacobian: bool = False
) -> dict[str, tuple[float, ...]]:
    """Learn from one data set; the errors of each method and reading, and of the learner that knows the Jacobian."""
    found: dict[str, tuple[float, ...]] = {}
    for name, reading in READINGS.items():
        training, test = data_set(settings, held, reading, seed)
        policy = _fitted(settings, training, settings.speed_power if reading.weighted else 0.0)
        of_reading = errors(policy, learners(settings, reading), test)
        found |= {method + name: values for method, values in of_reading.items()}
    if jacobian:
        found[JACOBIAN] = knowing(settings, held, seed)
    return found


def knowing(settings: Settings, held: int, seed: np.random.SeedSequence) -> tuple[float, ...]:
    """The errors of the learner that knows the Jacobian."""
    training, test = data_set(settings, held, READINGS[", fresh"], seed)
    return errors_of(_fitted(settings, training, 0.0, uc.Robust(jacobian=LWR3.jacobian)), test)


def _fitted(
    settings: Settings, training: Sequence[uc.Demonstration], speed_power: float, learner: uc.Learner | None = None
) -> uc.Policy:
    states, actions, groups = uc.stack(training)
    weights = np.linalg.norm(actions, axis=1) ** speed_power
    fields = (settings.variance, settings.at_least)
    policy = uc.LocallyLinearPolicy(*fields, None, learner or uc.Direct(), uc.Folds(settings.folds))
    return policy.fit(states, actions, sample_weight=weights, groups=groups)


def _printed(method: str, index: int) -> dict[str, Any]:
    printed = PAPER.get(method.partition(",")[0])
    if printed is None:
        return {}
    names = ("paper_nupe_mean", "paper_nupe_sd", "paper_ncpe_mean", "paper_ncpe_sd")
    return {name: value / 100 for name, value in zip(names, printed[index], strict=True)}

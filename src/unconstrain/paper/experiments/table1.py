"""Table I: three methods on free and on randomly constrained data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import unconstrain as uc

from . import toy
from .journal import Journal
from .trials import CLOSE, FAILS, LABELS, Progress, Result, errors, reproduced, row, run_trials

PAPER: dict[tuple[str, str], dict[str, tuple[float, float]]] = {
    ("direct", "none"): {"nupe": (0.034, 0.044), "ncpe": (0.034, 0.044), "ninc": (0.026, 0.039)},
    ("direct", "random"): {"nupe": (58.338, 9.556), "ncpe": (8.596, 2.813), "ninc": (8.596, 2.813)},
    ("inconsistency", "none"): {"nupe": (26.640, 52.737), "ncpe": (26.640, 52.737), "ninc": (0.014, 0.031)},
    ("inconsistency", "random"): {"nupe": (0.118, 0.162), "ncpe": (0.007, 0.010), "ninc": (0.007, 0.010)},
    ("hybrid", "none"): {"nupe": (0.065, 0.268), "ncpe": (0.065, 0.268), "ninc": (0.042, 0.143)},
    ("hybrid", "random"): {"nupe": (0.373, 1.109), "ncpe": (0.011, 0.017), "ninc": (0.011, 0.017)},
}
"""The printed table: mean and s.d., × 10⁻²."""

CONSTRAINTS = {"none": toy.free, "random": toy.random_lines}

CUT = "truncated"
"""The inconsistency alone without its eigenvalues below a millionth of the largest.

On free data the inconsistency determines next to nothing, and its error is decided by which eigenvalues are taken for
zero. The paper does not say which; :class:`~unconstrain.Inconsistency` leaves out rounding errors alone.
"""


@dataclass(frozen=True)
class Settings(toy.ToySettings):
    """Settings of Table I; see :class:`~unconstrain.paper.experiments.toy.ToySettings`.

    Parameters
    ----------
    trials : int
        Data sets.
    seed : int
        Of everything random.
    """

    trials: int = 100
    seed: int = 0


def run(
    settings: Settings | None = None, workers: int = 1, progress: Progress | None = None, journal: Journal | None = None
) -> Result:
    """Reproduce Table I.

    Parameters
    ----------
    settings : Settings, optional
    workers : int
        Processes; the numbers do not depend on it.
    progress : callable, optional
        Called with (done, of) after each trial.
    journal : Journal, optional
        Keeps finished trials; see :func:`~unconstrain.paper.experiments.trials.run_trials`.

    Returns
    -------
    Result
        Rows in plain units, with the paper's values beside them.
    """
    chosen = settings or Settings()
    seeds = np.random.SeedSequence(chosen.seed).spawn(chosen.trials)
    calls = [(chosen, constraint, seed) for constraint in CONSTRAINTS for seed in seeds]
    found = run_trials(trial, calls, workers, progress, journal)
    by_constraint = {
        constraint: found[index * chosen.trials : (index + 1) * chosen.trials]
        for index, constraint in enumerate(CONSTRAINTS)
    }
    rows = [
        row(method, [one[method] for one in by_constraint[constraint]], constraint=constraint)
        | printed(method, constraint)
        for method in learners(chosen)
        for constraint in CONSTRAINTS
    ]
    return Result("table1", chosen, rows)


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether each method is good and fails where the paper says, by medians: the tails depend on the seed."""
    error = {(row["method"], row["constraint"]): row["nupe_median"] for row in result.rows}
    free, held = (error["hybrid", constraint] for constraint in ("none", "random"))
    return reproduced(
        {
            "on free data the hybrid is as good as direct learning": free <= CLOSE * error["direct", "none"],
            "inconsistency alone fails there": error["inconsistency", "none"] >= FAILS * free,
            "on constrained data the hybrid is as good as inconsistency": held
            <= CLOSE * error["inconsistency", "random"],
            "direct learning fails there": error["direct", "random"] >= FAILS * held,
        },
        "Medians and ratios between the methods.",
        "Means of the constrained rows depend on the seed by a factor of five: compare the medians, on the page.",
    )


def headlines(result: Result) -> list[str]:
    """What the table says, in a sentence for each claim."""
    mean = {(row["method"], row["constraint"]): row for row in result.rows}

    def compare(metric: str, constraint: str, other: str) -> str:
        ours, theirs = (mean[method, constraint][f"{metric}_mean"] for method in ("hybrid", other))
        paper, median = (mean["hybrid", constraint][name] for name in (f"paper_{metric}_mean", f"{metric}_median"))
        return (
            f"hybrid, {constraint}: {LABELS[metric]} {100 * ours:.4f}e-2, {ours / theirs:.2f} times that of {other} "
            f"(paper's hybrid {100 * paper:.3f}e-2); median {100 * median:.4f}e-2"
        )

    return [
        compare("nupe", "none", "direct"),
        compare("nupe", "random", "inconsistency"),
        compare("ncpe", "random", "inconsistency"),
        (
            f"direct, random: nUPE {100 * mean['direct', 'random']['nupe_mean']:.1f}e-2; "
            f"inconsistency, none: nUPE {100 * mean['inconsistency', 'none']['nupe_mean']:.0f}e-2, without eigenvalues "
            f"below a millionth of the largest {100 * mean[CUT, 'none']['nupe_mean']:.1f}e-2 (paper "
            f"{100 * mean['inconsistency', 'none']['paper_nupe_mean']:.1f}e-2)"
        ),
    ]


def trial(settings: toy.ToySettings, constraint: str, seed: np.random.SeedSequence) -> dict[str, tuple[float, ...]]:
    """Learn from one data set; the errors of each method."""
    rng = np.random.default_rng(seed)
    demos = toy.demonstrate(settings, rng, CONSTRAINTS[constraint])
    training, test = toy.split(demos, settings.test_share, rng)
    return errors(toy.policy(settings).fit_demonstrations(training), learners(settings), test)


def learners(settings: toy.ToySettings) -> dict[str, uc.Learner]:
    """The three methods, and the second with fewer eigenvalues."""
    return toy.learners(settings) | {CUT: uc.Inconsistency(threshold=1e-6)}


def printed(method: str, constraint: str) -> dict[str, Any]:
    """The paper's values for a row, in plain units."""
    return {
        f"paper_{metric}_{what}": value / 100
        for metric, pair in PAPER["inconsistency" if method == CUT else method, constraint].items()
        for what, value in zip(("mean", "sd"), pair, strict=True)
    }

"""Figure 5: errors against how much the constraints vary (eq. 20)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import unconstrain as uc

from . import toy
from .journal import Journal
from .trials import CLOSE, LABELS, Progress, Result, errors, reproduced, row, run_trials

DRAWN: dict[str, int | None] = {"step": None, "trajectory": 1}
"""How many angles a trajectory has: one for each step, or one. The paper does not say; the first is reported."""


@dataclass(frozen=True)
class Settings(toy.ToySettings):
    """Settings of figure 5; see :class:`~unconstrain.paper.experiments.toy.ToySettings`.

    Parameters
    ----------
    widest : tuple of float
        The values of θmax, radians.
    trials : int
        Data sets for each.
    seed : int
        Of everything random.
    """

    widest: tuple[float, ...] = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.25, 1.5)
    trials: int = 50
    seed: int = 0


def run(
    settings: Settings | None = None, workers: int = 1, progress: Progress | None = None, journal: Journal | None = None
) -> Result:
    """Reproduce figure 5; parameters as in :func:`unconstrain.paper.experiments.table1.run`.

    Returns
    -------
    Result
        Rows with an angle for each step; ``tables["per_trajectory"]`` has the same with one for each trajectory.
    """
    chosen = settings or Settings()
    seeds = np.random.SeedSequence(chosen.seed).spawn(chosen.trials)
    calls = [(chosen, widest, seed, angles) for angles in DRAWN.values() for widest in chosen.widest for seed in seeds]
    found = run_trials(trial, calls, workers, progress, journal)
    half = len(found) // len(DRAWN)
    per_step, per_trajectory = (_rows(chosen, part) for part in (found[:half], found[half:]))
    return Result("figure5", chosen, per_step, tables={"per_trajectory": per_trajectory})


def _rows(settings: Settings, found: Sequence[dict[str, tuple[float, ...]]]) -> list[dict[str, Any]]:
    return [
        row(method, [one[method] for one in found[start : start + settings.trials]], theta_max=widest)
        for method in toy.learners(settings)
        for widest, start in zip(settings.widest, range(0, len(found), settings.trials), strict=True)
    ]


def ratios(rows: Sequence[dict[str, Any]], metric: str) -> dict[float, float]:
    """Mean error of the hybrid over that of the better of the other two, by θmax."""
    mean = {(row["method"], row["theta_max"]): row[f"{metric}_mean"] for row in rows}
    widest = dict.fromkeys(row["theta_max"] for row in rows)
    return {w: mean["hybrid", w] / min(mean["direct", w], mean["inconsistency", w]) for w in widest}


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether the hybrid follows the better of the other two along the whole axis."""
    by_angle = ratios(result.rows, "nupe")
    worst = max(by_angle, key=by_angle.__getitem__)
    claim = (
        f"the hybrid follows the better of the two: nUPE at worst {by_angle[worst]:.2f} times, at θmax {worst:g} rad"
    )
    return reproduced({claim: by_angle[worst] <= CLOSE}, "Ratios of means over the data sets.")


def headlines(result: Result) -> list[str]:
    """What the figure says, in a sentence for each claim."""
    said = []
    for drawn, rows in (("", result.rows), (", one angle for each trajectory", result.tables["per_trajectory"])):
        for metric in ("nupe", "ncpe"):
            by_angle = ratios(rows, metric)
            worst = max(by_angle, key=by_angle.__getitem__)
            said.append(
                f"hybrid against the better of the other two{drawn}, {LABELS[metric]}: at worst {by_angle[worst]:.2f} "
                f"times, at θmax = {worst:g} rad"
            )
    return said


def trial(
    settings: toy.ToySettings, widest: float, seed: np.random.SeedSequence, angles: int | None = None
) -> dict[str, tuple[float, ...]]:
    """Learn from one data set with so many angles in each trajectory, by default one a step; errors of each method."""
    rng = np.random.default_rng(seed)
    demos = toy.demonstrate(settings, rng, toy.policy_aligned(widest, angles))
    training, test = toy.split(demos, settings.test_share, rng)
    return errors(toy.policy(settings).fit_demonstrations(training), toy.learners(settings), test)

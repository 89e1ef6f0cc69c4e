"""Figure 5: errors against how much the constraints vary (eq. 20)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import toy
from .journal import Journal
from .trials import LABELS, Progress, Result, errors, row, run_trials


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
    """Reproduce figure 5; parameters and result as in :func:`unconstrain.paper.experiments.table1.run`."""
    chosen = settings or Settings()
    seeds = np.random.SeedSequence(chosen.seed).spawn(chosen.trials)
    calls = [(chosen, widest, seed) for widest in chosen.widest for seed in seeds]
    found = run_trials(trial, calls, workers, progress, journal)
    rows = [
        row(method, [one[method] for one in found[start : start + chosen.trials]], theta_max=widest)
        for method in toy.learners(chosen)
        for widest, start in zip(chosen.widest, range(0, len(found), chosen.trials), strict=True)
    ]
    return Result("figure5", chosen, rows)


def ratios(result: Result, metric: str) -> dict[float, float]:
    """Mean error of the hybrid over that of the better of the other two, by θmax."""
    mean = {(row["method"], row["theta_max"]): row[f"{metric}_mean"] for row in result.rows}
    widest = dict.fromkeys(row["theta_max"] for row in result.rows)
    return {w: mean["hybrid", w] / min(mean["direct", w], mean["inconsistency", w]) for w in widest}


def headlines(result: Result) -> list[str]:
    """What the figure says, in a sentence for each claim."""
    said = []
    for metric in ("nupe", "ncpe"):
        by_angle = ratios(result, metric)
        worst = max(by_angle, key=by_angle.__getitem__)
        said.append(
            f"hybrid against the better of the other two, {LABELS[metric]}: at worst {by_angle[worst]:.2f} times, "
            f"at θmax = {worst:g} rad"
        )
    return said


def trial(settings: toy.ToySettings, widest: float, seed: np.random.SeedSequence) -> dict[str, tuple[float, ...]]:
    """Learn from one data set; the errors of each method."""
    rng = np.random.default_rng(seed)
    demos = toy.demonstrate(settings, rng, toy.policy_aligned(widest))
    training, test = toy.split(demos, settings.test_share, rng)
    return errors(toy.policy(settings).fit_demonstrations(training), toy.learners(settings), test)

"""Figure 5: errors against how much the constraints vary (eq. 20)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import toy
from .trials import Progress, Result, errors, row, run_trials

__all__ = ["Settings", "run"]


@dataclass(frozen=True)
class Settings(toy.ToySettings):
    """Settings of figure 5; see :class:`~unconstrain.experiments.toy.ToySettings`.

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


def run(settings: Settings | None = None, workers: int = 1, progress: Progress | None = None) -> Result:
    """Reproduce figure 5; parameters and result as in :func:`unconstrain.experiments.table1.run`."""
    chosen = settings or Settings()
    seeds = np.random.SeedSequence(chosen.seed).spawn(chosen.trials)
    calls = [(chosen, widest, seed) for widest in chosen.widest for seed in seeds]
    found = run_trials(trial, calls, workers, progress)
    rows = [
        row(method, [one[method] for one in found[start : start + chosen.trials]], theta_max=widest)
        for method in toy.learners(chosen)
        for widest, start in zip(chosen.widest, range(0, len(found), chosen.trials), strict=True)
    ]
    return Result("figure5", chosen, rows)


def trial(
    settings: toy.ToySettings, widest: float, seed: np.random.SeedSequence
) -> dict[str, tuple[float, ...]]:
    """Learn from one data set; the errors of each method."""
    rng = np.random.default_rng(seed)
    demos = toy.demonstrate(settings, rng, toy.policy_aligned(widest))
    training, test = toy.split(demos, settings.test_share, rng)
    return errors(toy.policy(settings).fit_demonstrations(training), toy.learners(settings), test)

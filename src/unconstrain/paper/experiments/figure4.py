"""Figure 4: what each method learns from one data set, as vector fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import toy
from .table1 import CONSTRAINTS
from .trials import Progress, Result, errors, row


@dataclass(frozen=True)
class Settings(toy.ToySettings):
    """Settings of figure 4; see :class:`~unconstrain.paper.experiments.toy.ToySettings`.

    Parameters
    ----------
    arrows : int
        The fields are drawn on a grid of ``arrows × arrows`` states.
    seed : int
        Of everything random.
    """

    arrows: int = 15
    seed: int = 0


def run(
    settings: Settings | None = None,
    workers: int = 1,  # noqa: ARG001 - every experiment is called alike, and this is a single trial
    progress: Progress | None = None,
) -> Result:
    """Reproduce figure 4, with the hybrid method beside the paper's two.

    Returns
    -------
    Result
        Rows with the errors on this one data set; ``details`` holds "grid"
        (A, 2), "policy" (A, 2) and, for each constraint, "demonstrations"
        and "fields": actions (A, 2) for each method.
    """
    chosen = settings or Settings()
    axis = np.linspace(-chosen.reach, chosen.reach, chosen.arrows)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    details: dict[str, Any] = {"grid": grid, "policy": chosen.system(grid)}
    rows = []
    for done, (constraint, draw) in enumerate(CONSTRAINTS.items(), start=1):
        rng = np.random.default_rng(np.random.SeedSequence(chosen.seed))
        demos = toy.demonstrate(chosen, rng, draw)
        training, test = toy.split(demos, chosen.test_share, rng)
        base = toy.policy(chosen).fit_demonstrations(training)
        methods = toy.learners(chosen)
        fields = {name: base.with_learner(learner)(grid) for name, learner in methods.items()}
        details[constraint] = {"demonstrations": demos, "fields": fields}
        found = errors(base, methods, test)
        rows += [row(name, [values], constraint=constraint) for name, values in found.items()]
        if progress is not None:
            progress(done, len(CONSTRAINTS))
    return Result("figure4", chosen, rows, details)


def headlines(result: Result) -> list[str]:
    """What the figure says, in a sentence for each panel."""
    return [
        f"{constraint}: nUPE "
        + ", ".join(
            f"{r['method']} {100 * r['nupe_mean']:.4f}e-2" for r in result.rows if r["constraint"] == constraint
        )
        for constraint in CONSTRAINTS
    ]

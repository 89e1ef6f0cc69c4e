"""Figure 4: what each method learns from one data set, as vector fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import unconstrain as uc

from . import toy
from .table1 import CONSTRAINTS
from .trials import FAILS, Progress, Result, errors, reproduced, row


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


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether the hybrid is the one that is right on both data sets."""
    error = {(row["method"], row["constraint"]): row["nupe_mean"] for row in result.rows}
    return reproduced(
        {
            "the hybrid finds the policy from constrained data": FAILS * error["hybrid", "random"]
            <= error["direct", "random"],
            "and from free data, where inconsistency alone fails": FAILS * error["hybrid", "none"]
            <= error["inconsistency", "none"],
        },
        "What the arrows show of this one data set.",
        "'unconstrain reproduce table1' does it a hundred times.",
    )


def headlines(result: Result) -> list[str]:
    """What the figure says, in a sentence for each panel."""
    return [
        f"{constraint}: nUPE "
        + ", ".join(
            f"{r['method']} {100 * r['nupe_mean']:.4f}e-2" for r in result.rows if r["constraint"] == constraint
        )
        for constraint in CONSTRAINTS
    ]

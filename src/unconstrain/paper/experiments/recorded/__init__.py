"""Every learner on movements of people under constraints that are drawn, and in situations that ``regimes`` lacks."""

from __future__ import annotations

from dataclasses import dataclass

import unconstrain as uc

from ....base.errors import ReadError
from ...datasets.files import DATA_VARIABLE
from ..journal import Journal
from ..trials import CLOSE, Progress, Result, reproduced, run_trials
from .judging import DEFAULT, policies, trial
from .movements import missing
from .sets import DataSet as DataSet
from .sets import data_sets as data_sets
from .sets import draw as draw
from .sets import listed as listed
from .summary import by_kind, sentences

WHERE = f"Set {DATA_VARIABLE} to a folder that holds copies; unconstrain.datasets says which can be downloaded."


@dataclass(frozen=True)
class Settings:
    """Settings of the benchmark.

    Parameters
    ----------
    trials : int
        Data sets of each kind at most; recorded movements are of 27 classes with seed 0, and of 26 with others.
    seed : int
        0 takes the half of the recorded movements that is reported; all others the half that learners may be
        developed on.
    only : tuple of str
        Kinds to which to keep, such as "curved hood"; all if empty. Data sets do not depend on it.
    """

    trials: int = 20
    seed: int = 0
    only: tuple[str, ...] = ()


def run(
    settings: Settings | None = None, workers: int = 1, progress: Progress | None = None, journal: Journal | None = None
) -> Result:
    """Run the benchmark; parameters and result as in :func:`unconstrain.paper.experiments.table1.run`.

    Rows are one for each kind of data and policy, in geometric means over the data sets. ``tables["kinds"]`` has every
    figure of each, and ``tables["sets"]`` those of single data sets, see :func:`.judging.judged`.
    """
    chosen = settings or Settings()
    calls = [
        (kind, name, policy, chosen.seed)
        for kind, name in listed(chosen.seed, chosen.only, chosen.trials)
        for policy in policies(kind)
    ]
    absent = missing()
    if not calls:
        raise ReadError(f"no recorded movement is on this machine: {', '.join(absent)}. {WHERE}")
    sets = run_trials(trial, calls, workers, progress, journal)
    kinds = by_kind(sets)
    tables = {"kinds": kinds, "sets": sets, "missing": [{"source": source} for source in absent]}
    return Result("recorded", chosen, [_shown(one) for one in kinds], tables=tables)


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether the default learner costs nobody anything, beside the better of two that look for nothing in the data."""
    kinds = [one for one in result.tables["kinds"] if one["to_safe"] is not None]
    worst = max(kinds, key=lambda one: one["to_safe"])
    claim = (
        f"{DEFAULT} is near the better of direct and softened hybrid, kind by kind: at worst {worst['to_safe']:.2f} "
    )
    claim += f"times, {worst['kind']}"
    return reproduced({claim: worst["to_safe"] <= CLOSE}, "Geometric means over the data sets of each kind.")


def headlines(result: Result) -> list[str]:
    """What one asks first, in sentences; and which recordings were not there."""
    absent = [one["source"] for one in result.tables["missing"]]
    left_out = [f"left out, for the recordings are not on this machine: {', '.join(absent)}. {WHERE}"] if absent else []
    return sentences(result.tables["kinds"], result.tables["sets"]) + left_out


def _shown(one: dict[str, object]) -> dict[str, object]:
    """What fits a terminal."""
    shown = ("kind", "policy", "sets", "robust", "best", "floor", "to_safe", "worst_to_safe", "behind", "to_best")
    return {name: one[name] for name in (*shown, "held")}

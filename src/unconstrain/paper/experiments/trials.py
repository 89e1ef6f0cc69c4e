"""Many trials of one experiment: the same numbers whatever the number of workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

import unconstrain as uc

from .journal import DataClass, Journal

METRICS = ("nupe", "ncpe", "ninc")
"""Normalised unconstrained and constrained policy error, and inconsistency."""

LABELS = {"nupe": "nUPE", "ncpe": "nCPE", "ninc": "normalised inconsistency"}
"""What people call them."""


Progress = Callable[[int, int], None]
"""Called with how many trials are done, and of how many."""


@dataclass(frozen=True, eq=False)
class Result:
    """What an experiment found.

    Parameters
    ----------
    name : str
    settings : dataclass
        Everything that the numbers depend on.
    rows : list of dict
        One for each method and setting, in plain units.
    details : dict
        What pictures need and tables do not.
    tables : dict
        Further rows, by name.
    """

    name: str
    settings: DataClass
    rows: list[dict[str, Any]]
    details: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, list[dict[str, Any]]] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Settings and rows as plain values."""
        return {"name": self.name, "settings": asdict(self.settings), "rows": self.rows, **self.tables}

    @classmethod
    def from_json(cls, values: Mapping[str, Any], settings: Callable[..., DataClass]) -> Result:
        """What :meth:`to_json` gave, without the details; ``settings`` is the type of the experiment's."""
        tables = {name: table for name, table in values.items() if name not in ("name", "settings", "rows")}
        return cls(values["name"], settings(**values["settings"]), values["rows"], tables=tables)


def run_trials(
    trial: Callable[..., Any],
    arguments: Iterable[Sequence[Any]],
    workers: int = 1,
    progress: Progress | None = None,
    journal: Journal | None = None,
) -> list[Any]:
    """Run independent trials, in order, on some processes.

    Linear algebra runs on one thread in each: it does not pay at these sizes,
    and the order of its additions must not depend on the machine.

    Parameters
    ----------
    trial : callable
        Of the module's top level, so that it can be sent to a process.
    arguments : iterable of sequences
        Of each call.
    workers : int
        Processes; -1 for one on each core.
    progress : callable, optional
        See :data:`Progress`.
    journal : Journal, optional
        Keeps what is finished, so that an interrupted run goes on where it stopped.
    """
    calls = list(arguments)
    found: dict[int, Any] = journal.begin() if journal is not None else {}
    left = [index for index in range(len(calls)) if index not in found]
    with threadpool_limits(1):
        jobs = (delayed(_on_one_thread)(trial, calls[index]) for index in left)
        for index, result in zip(
            left, Parallel(n_jobs=workers, return_as="generator", batch_size=1)(jobs), strict=True
        ):
            found[index] = result
            if journal is not None:
                journal.add(index, result)
            if progress is not None:
                progress(len(found), len(calls))
    return [found[index] for index in range(len(calls))]


def errors(
    policy: uc.Policy, learners: Mapping[str, uc.Learner], demonstrations: Sequence[uc.Demonstration]
) -> dict[str, tuple[float, ...]]:
    """The three normalised errors of each learner, from one set of moments."""
    return {name: errors_of(policy.with_learner(learner), demonstrations) for name, learner in learners.items()}


def errors_of(policy: uc.Policy, demonstrations: Sequence[uc.Demonstration]) -> tuple[float, float, float]:
    """The three normalised errors of a policy, in the order of :data:`METRICS`."""
    return uc.nupe(policy, demonstrations), uc.ncpe(policy, demonstrations), uc.ninconsistency(policy, demonstrations)


def candidate_of(policy: uc.Policy, name: str) -> uc.Policy:
    """What one of the default learner's candidates makes of the samples that a policy was learnt from."""
    own, found = copy(policy), policy.solution_
    own.solution_ = replace(found, weights=found.candidates[name].weights, method=name)
    return own


def row(method: str, values: Sequence[Sequence[float]], **where: Any) -> dict[str, Any]:
    """Mean, standard deviation and median over trials of the three errors, as one row of a table."""
    table = np.asarray(values, dtype=np.float64)
    spread = table.std(axis=0, ddof=1) if len(table) > 1 else np.zeros(table.shape[1])
    result: dict[str, Any] = {"method": method, **where}
    for metric, mean, sd, median in zip(METRICS, table.mean(axis=0), spread, np.median(table, axis=0), strict=True):
        result |= {f"{metric}_mean": float(mean), f"{metric}_sd": float(sd), f"{metric}_median": float(median)}
    return result


def _on_one_thread(trial: Callable[..., Any], call: Sequence[Any]) -> Any:
    with threadpool_limits(1):
        return trial(*call)


CLOSE = 1.25
"""A method follows another whose error it exceeds by no more than a quarter: figures in print show no finer."""

FAILS = 10.0
"""And fails where it has so many times the error of another."""


def reproduced(claims: Mapping[str, bool], trust: str = "", then: str = "") -> uc.evaluation.verdicts.Verdict:
    """Judge whether an experiment shows what the paper says.

    Parameters
    ----------
    claims : mapping
        Claims in words, and whether they hold here.
    trust, then : str
        What the numbers can be trusted in, and what to do next.
    """
    mark = uc.evaluation.verdicts.Mark
    missed = [claim for claim, holds in claims.items() if not holds]
    if not missed:
        told = "; ".join(claims)
        said = f"Reproduced: yes. {told[:1].upper()}{told[1:]}."
        return uc.evaluation.verdicts.Verdict(mark.GOOD, said, trust, next=then)
    held = len(claims) - len(missed)
    word = "in part" if 2 * held >= len(claims) else "no"
    said = f"Reproduced: {word}, {held} of {len(claims)} claims."
    doubt = f"That {'; that '.join(missed)}."
    return uc.evaluation.verdicts.Verdict(mark.DOUBTFUL if word == "in part" else mark.BAD, said, trust, doubt, then)

"""What each learner makes of one data set, by the truth."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc

from ..truths import true_policy, true_projections, was_free
from .sets import RECORDED, DataSet, draw

DEFAULT = "robust"
"""The learner that people are to take who know nothing of their constraints."""

LEARNERS: dict[str, uc.Learner] = {
    "direct": uc.Direct(),
    "inconsistency": uc.Inconsistency(),
    "hybrid": uc.Hybrid(),
    "softened hybrid": uc.Hybrid(threshold=0.0, softness=0.1),
    "noise-corrected": uc.NoiseCorrected(),
    "likelihood": uc.Likelihood(),
    "segments": uc.Segments("groups"),
}
"""What can be taken in the default learner's place. Segments are those of the groups, where there are any."""

SAFE = ("direct", "softened hybrid")
"""The best of these is what the default learner must not fall behind: they look for nothing in the data. Two learn in
the local models that it chooses, and two in the widest, in case it chooses badly."""

WIDEST = "widest fields"

SOFTNESSES = (1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-6, 1e-11)
"""Of the hybrids that are candidates, beside all learners."""

HELD_WITHIN = 1.96
"""Standard deviations on either side in which 95 % of a normal distribution are."""


def policies(kind: str) -> dict[str, uc.Policy | None]:
    """The policies that a kind is learnt with: its own (None), and both defaults where movements were recorded."""
    return {"": None} if kind not in RECORDED else {"": None, "parametric": uc.ParametricPolicy()}


def trial(kind: str, name: str, policy: str, seed: int) -> dict[str, Any]:
    """Draw one data set and learn from it; see :func:`judged`."""
    data, other = draw(kind, name, seed), policies(kind)[policy]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # such as of places, which are what they are
        found = judged(data if other is None else replace(data, policy=other))
    return {"kind": kind, "policy": policy, "name": name, **found}


def judged(data: DataSet) -> dict[str, Any]:
    """Every figure of one data set; None for what there is none of.

    Returns
    -------
    dict
        ``nupe`` by learner, with the default's, and of the safe ones in the widest fields where models are local;
        ``floor``, what the features reach on the free actions; ``best`` and ``best_candidate``; ``cost``, the
        default's nUPE over that of what was not spoiled; and the figures of :func:`knowledge`.
    """
    chosen = data.fit(uc.Robust())
    learnt = {name: chosen.with_learner(learner) for name, learner in _learners(data).items()} | _in_widest_fields(data)
    nupe = {name: uc.nupe(policy, data.test) for name, policy in {**learnt, DEFAULT: chosen}.items()}
    soft = {
        f"softness {s:g}": uc.nupe(chosen.with_learner(uc.Hybrid(threshold=0.0, softness=s)), data.test)
        for s in SOFTNESSES
    }
    candidates = {name: error for name, error in (nupe | soft).items() if name not in (DEFAULT, "hybrid")}
    best = min(candidates, key=lambda name: candidates[name])
    free = floor(data, chosen)
    return {
        "nupe": nupe,
        "floor": uc.nupe(free, data.test),
        "best": candidates[best],
        "best_candidate": best,
        "cost": _cost(data, nupe[DEFAULT]),
        **knowledge(chosen, data, free),
    }


def floor(data: DataSet, chosen: uc.Policy) -> uc.Policy:
    """The same features fitted to the free actions at the states that are learnt from: nothing can do much better."""
    if isinstance(chosen, uc.LocallyLinearPolicy):
        data = replace(data, policy=uc.LocallyLinearPolicy(chosen.variance_))
    return data.fit(uc.Direct(), [replace(demo, actions=true_policy([demo])) for demo in data.demonstrations])


def knowledge(policy: uc.Policy, data: DataSet, free: uc.Policy) -> dict[str, float | None]:
    """What the default learner says that it knows, against the truth.

    Intervals should hold the true policy, and where movements were recorded the mean of what people did freely: what
    the features make of the free actions.

    Returns
    -------
    dict
        ``determined``, the share of the weights' directions; ``known``, that of the predictions; ``held``, how often
        95 % intervals hold the truth there; ``held_hidden``, the same in the coordinates in which nothing ever moved;
        ``said_free`` and ``told_free``, the mean probability of being free of samples that were not, and that were.
    """
    states = uc.stack(data.test).states
    spread = policy.uncertainty(states)
    truth = free(states) if data.recorded else true_policy(data.test)
    held = np.abs(truth - policy(states)) <= HELD_WITHIN * spread.total
    known = spread.undetermined < spread.from_noise
    free_samples = was_free(data.demonstrations)
    moves = true_projections(data.demonstrations).diagonal(axis1=1, axis2=2).max(axis=0) > 1e-9
    return {
        "determined": policy.solution_.determined_share,
        "known": float(known.mean()),
        "held": _mean(held[known]),
        "held_hidden": _mean(held[:, ~moves]),
        "said_free": _mean(policy.solution_.free[~free_samples]),
        "told_free": _mean(policy.solution_.free[free_samples]),
    }


def _learners(data: DataSet) -> dict[str, uc.Learner]:
    return {name: learner for name, learner in LEARNERS.items() if data.grouped or name != "segments"}


def _in_widest_fields(data: DataSet) -> dict[str, uc.Policy]:
    if not isinstance(data.policy, uc.LocallyLinearPolicy):
        return {}
    widest = replace(data, policy=uc.LocallyLinearPolicy(None)).fit(uc.Direct())
    return {f"{name}, {WIDEST}": widest.with_learner(LEARNERS[name]) for name in SAFE}


def _cost(data: DataSet, error: float) -> float | None:
    if data.unspoiled is None:
        return None
    return error / uc.nupe(data.fit(uc.Robust(), data.unspoiled), data.test)


def _mean(values: NDArray[Any]) -> float | None:
    return float(values.mean()) if values.size else None

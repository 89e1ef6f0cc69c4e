"""Many data sets of each kind, in a few figures and sentences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .judging import DEFAULT, LEARNERS, SAFE
from .sets import RECORDED

BEHIND = 1.1
"""A data set in which the default learner has more than this times the error of the safe ones counts against it."""

GROWN = 1.5
"""One in which bad samples make its error grow by more than this, too."""

NEGLIGIBLE = 1e-8
"""An nUPE of less is none: 0.01 % of a typical action is finer than any recording, and ratios are of rounding."""

Row = dict[str, Any]


def to_safe(one: Row) -> float:
    """The default learner's nUPE over the best of the safe ones', in one data set."""
    return float(one["nupe"][DEFAULT] / min(error for name, error in one["nupe"].items() if name.startswith(SAFE)))


def by_kind(sets: Sequence[Row]) -> list[Row]:
    """One row for each kind and policy."""
    keys = dict.fromkeys((one["kind"], one["policy"]) for one in sets)
    return [_kind(kind, policy, [one for one in sets if (one["kind"], one["policy"]) == (kind, policy)])
            for kind, policy in keys]  # fmt: skip


def _kind(kind: str, policy: str, sets: Sequence[Row]) -> Row:
    ratios = [to_safe(one) for one in sets]
    costs = [one["cost"] for one in sets if one["cost"] is not None]
    return {
        "kind": kind,
        "policy": policy,
        "sets": len(sets),
        **{name: geometric(one["nupe"][name] for one in sets if name in one["nupe"]) for name in (*LEARNERS, DEFAULT)},
        "best": geometric(one["best"] for one in sets),
        "floor": geometric(one["floor"] for one in sets),
        "to_safe": geometric(ratios),
        "worst_to_safe": max(ratios),
        "worst": sets[int(np.argmax(ratios))]["name"],
        "behind": float(np.mean([ratio > BEHIND for ratio in ratios])),
        "to_best": geometric(max(one["nupe"][DEFAULT], NEGLIGIBLE) / max(one["best"], NEGLIGIBLE) for one in sets),
        "cost": geometric(costs),
        "worst_cost": max(costs, default=None),
        "grown": float(np.mean([cost > GROWN for cost in costs])) if costs else None,
        **{name: _mean(one[name] for one in sets) for name in KNOWLEDGE},
    }


KNOWLEDGE = ("determined", "known", "held", "held_hidden", "said_free", "told_free")
"""See :func:`~.judging.knowledge`."""


def geometric(values: Iterable[float]) -> float | None:
    """The geometric mean; None of nothing."""
    found = np.fromiter(values, dtype=np.float64)
    return float(np.exp(np.log(found).mean())) if len(found) else None


def sentences(kinds: Sequence[Row], sets: Sequence[Row]) -> list[str]:
    """What one asks first, a line each."""
    own = [one for one in kinds if not one["policy"]]
    found = {one["kind"]: one for one in own}
    said = [
        *_of_recorded(kinds, sets),
        _of_all(own),
        *(_of_errors(found[kind]) for kind in _NAMED if kind in found),
        *(_of_costs(one) for one in own if one["cost"] is not None),
        _of_intervals(own),
    ]
    if "one plane for all" in found:
        said.append(_of_one_plane(found["one plane for all"]))
    return said


_NAMED = ("curved hood", "CaPL, cubic", "CaPL, auto", "CaPL, local", "wide kernels", "coming to rest")


def _of_recorded(kinds: Sequence[Row], sets: Sequence[Row]) -> list[str]:
    """Against the best of the safe learners, for each policy."""
    said = []
    for policy in dict.fromkeys(one["policy"] for one in kinds if one["kind"] in RECORDED):
        mine = [one for one in kinds if one["kind"] in RECORDED and one["policy"] == policy]
        alone = [to_safe(one) for one in sets if one["kind"] in RECORDED and one["policy"] == policy]
        each = ", ".join(f"{one['kind'].removeprefix('recorded, ')} {one['to_safe']:.2f}" for one in mine)
        said.append(
            f"recorded movements{_with(policy)}: {DEFAULT} nUPE against the better of direct and softened hybrid, "
            f"in its models or the widest, geometric means: {each}; above {BEHIND:g} in "
            f"{np.mean([ratio > BEHIND for ratio in alone]):.0%} of {len(alone)} data sets, at worst {max(alone):.2f}"
        )
    return said


def _of_all(own: Sequence[Row]) -> str:
    worst = max(own, key=lambda one: one["to_best"])
    return (
        f"over all {len(own)} kinds: {DEFAULT} nUPE {geometric(one['to_best'] for one in own):.3g} times the best "
        f"candidate's, at worst {worst['to_best']:.3g} times ({worst['kind']}); below {NEGLIGIBLE:g} all are as good"
    )


def _of_errors(one: Row) -> str:
    free = "" if one["said_free"] is None else f"; a constrained sample is called free with {one['said_free']:.1%}"
    return (
        f"{one['kind']}: nUPE {one[DEFAULT]:.2g}, the paper's hybrid {one['hybrid']:.2g}, best candidate "
        f"{one['best']:.2g}, floor {one['floor']:.2g}{free}"
    )


def _of_costs(one: Row) -> str:
    return (
        f"{one['kind']}: the error grows by {one['cost']:.3g} times (geometric mean), at worst "
        f"{one['worst_cost']:.3g} times, and by more than {GROWN:g} times in {one['grown']:.0%} of {one['sets']} sets"
    )


def _of_intervals(own: Sequence[Row]) -> str:
    known = [one for one in own if one["held"] is not None]
    if not known:
        return "nothing was determined in any kind, so no interval was tested"
    least, most = (pick(known, key=lambda one: one["held"]) for pick in (min, max))
    return (
        f"95 % intervals of {DEFAULT} hold the truth where the data determines it: {least['held']:.1%} "
        f"({least['kind']}) to {most['held']:.1%} ({most['kind']}), {_mean(one['held'] for one in known):.1%} in the "
        "mean over the kinds"
    )


def _of_one_plane(one: Row) -> str:
    return (
        f"one plane for all: {12 * one['determined']:.1f} of 12 directions are said to be determined (8 are); "
        f"intervals along the normal hold the truth in {one['held_hidden']:.0%}"
    )


def _with(policy: str) -> str:
    return f" with the {policy} policy" if policy else ""


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None

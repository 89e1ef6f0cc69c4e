"""The page of the benchmark of recorded movements: kind by kind, every learner, and what the default one knows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...pages import html
from ..experiments import recorded
from ..experiments.recorded.judging import DEFAULT, LEARNERS
from ..experiments.recorded.sets import RECORDED, described
from ..experiments.recorded.summary import BEHIND, GROWN, NEGLIGIBLE, to_safe
from ..experiments.trials import Result
from ..figures import charts

TOP = 10.0

Row = dict[str, Any]


def page(result: Result) -> str:
    """What holds where, as cells and as tables."""
    kinds = result.tables["kinds"]
    return html.document(
        "Learners on what people really do",
        recorded.verdict(result),
        html.markup(
            "Movements that people made freely are hidden behind constraints that were drawn, and simulated "
            "demonstrators get into awkward situations: how near does each learner come to what was done, or would "
            "have been done, with nothing in the way? What counts is <b>nUPE</b>, the squared error of the learnt "
            "policy over the variance of the true one; no learner is told anything of the constraints. On recorded "
            "movements the truth is what each person did at that very moment, so that nobody reaches zero: the "
            "<b>floor</b> is what the same features make of the free movements themselves. The <b>best candidate</b> "
            "is that of the learners, and of hybrids of nine softnesses, that the truth would choose for each data set."
        ),
        html.section("What it says", html.bullets(recorded.headlines(result))),
        html.section("Kind by kind", _judgement(kinds), _cells(kinds), _errors(kinds), _meanings(kinds)),
        html.section(f"What {DEFAULT} knows of its data", _knowledge(kinds)),
        *_spoiled(kinds),
        html.section("Every data set", _sets(result.tables["sets"])),
        html.settings_table(result.settings),
    )


def _cells(kinds: Sequence[Row]) -> html.Markup:
    """What each learner has for nUPE over what the best candidate has, kinds by learners."""
    methods = [*LEARNERS, DEFAULT]
    errors = [[one[method] or np.nan for method in methods] for one in kinds]
    values = np.maximum(errors, NEGLIGIBLE) / np.maximum([[one["best"]] for one in kinds], NEGLIGIBLE)
    picture = charts.ratio_table(
        [_name(one) for one in kinds], methods, values, title="nUPE over the best candidate’s",
        scale="ratio", top=TOP,
    )  # fmt: skip
    caption = (
        "Geometric means over the data sets of each kind. White is as good as the best candidate, orange worse; "
        f"colours end at {TOP:g}. Errors below {NEGLIGIBLE:g} count as that: none is felt. "
        "“Parametric” is the policy on 25 normalised kernels; all others are locally linear, "
        "or on the features that belong to the kind. Empty where there are no groups to take for segments."
    )
    return html.picture("kinds", [picture], caption)


def _judgement(kinds: Sequence[Row]) -> html.Markup:
    header = ["kind", "sets", DEFAULT, "best\ncandidate", "floor", f"{DEFAULT} /\nsafe", "worst", f"above\n{BEHIND:g}"]
    header += [f"{DEFAULT} /\nbest"]
    keys = (DEFAULT, "best", "floor", "to_safe", "worst_to_safe")
    rows = [
        [
            _name(one),
            str(one["sets"]),
            *(html.number(one[key]) for key in keys),
            f"{one['behind']:.0%}",
            html.number(one["to_best"]),
        ]
        for one in kinds
    ]
    note = (
        "nUPE in geometric means. Safe is the better of direct and softened hybrid in each data set, in the local "
        f"models that {DEFAULT} chose or in the widest: they look for nothing in the data. Worst is the data set in "
        f"which {DEFAULT} is farthest behind it."
    )
    return html.table(header, rows, note=note, rules=_rules(kinds))


def _errors(kinds: Sequence[Row]) -> html.Markup:
    methods = [*LEARNERS, DEFAULT]
    rows = [[_name(one), *(html.number(one[method]) for method in methods)] for one in kinds]
    return html.folded(
        "nUPE of every learner",
        html.table(
            ["kind", *map(_broken, methods)], rows, note="Geometric means over the data sets.", rules=_rules(kinds)
        ),
    )


def _meanings(kinds: Sequence[Row]) -> html.Markup:
    names = dict.fromkeys(one["kind"] for one in kinds)
    rows = [[name, described(name)] for name in names]
    return html.folded(
        "What each kind is", html.table(["kind", "what happens"], rows, note="Every kind of data, in words.", left=2)
    )


def _knowledge(kinds: Sequence[Row]) -> html.Markup:
    header = ["kind", "directions\ndetermined", "predictions\ndetermined", "95 % intervals\nhold there"]
    header += ["hold where\nnothing moved", "constrained,\ncalled free", "free,\ncalled free"]
    keys = ("determined", "known", "held", "held_hidden", "said_free", "told_free")
    rows = [[_name(one), *(_share(one[key]) for key in keys)] for one in kinds]
    note = (
        "Means over the data sets. A prediction counts as determined where less of its uncertainty is due to what the "
        "data does not determine than to noise. On recorded movements intervals should hold the mean of what people "
        "did freely, which is what the features make of the free movements."
    )
    return html.table(header, rows, note=note, rules=_rules(kinds))


def _spoiled(kinds: Sequence[Row]) -> list[html.Markup]:
    """What it costs that samples are wrong, or in any order; nothing where no such kind was run."""
    spoiled = [one for one in kinds if one["cost"] is not None]
    if not spoiled:
        return []
    header = ["kind", "sets", "error grows by", "at worst", f"by more than {GROWN:g} ×"]
    rows = [
        [_name(one), str(one["sets"]), *(html.number(one[key]) for key in ("cost", "worst_cost")), _share(one["grown"])]
        for one in spoiled
    ]
    note = f"nUPE of {DEFAULT} over its nUPE on the same data before it was spoiled, geometric means."
    return [html.section("What spoiled data costs", html.table(header, rows, note=note))]


def _sets(sets: Sequence[Row]) -> html.Markup:
    methods = [*LEARNERS, DEFAULT]
    header = ["kind", "data set", *map(_broken, methods), "best", "which", "floor", f"{DEFAULT} /\nsafe"]
    note = "nUPE of each data set, and the best candidate of it."
    rows = [
        [
            _name(one),
            one["name"],
            *(html.number(one["nupe"].get(method)) for method in methods),
            html.number(one["best"]),
            one["best_candidate"],
            html.number(one["floor"]),
            html.number(to_safe(one)),
        ]
        for one in sets
    ]
    return html.folded(f"{len(rows)} data sets", html.table(header, rows, note=note, left=2, rules=_rules(sets)))


def _name(one: Row) -> str:
    return f"{one['kind']} ({one['policy']})" if one["policy"] else one["kind"]


def _broken(name: str) -> str:
    """On two lines, for the head of a narrow column."""
    return name.replace("-", "-\n").replace(" ", "\n")


def _rules(rows: Sequence[Row]) -> list[int]:
    """Rows below a kind that is learnt with several policies."""
    kinds = [row["kind"] for row in rows]
    return [at for at in range(1, len(rows)) if kinds[at] != kinds[at - 1] and kinds[at - 1] in RECORDED]


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.1%}"

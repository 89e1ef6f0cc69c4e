"""The page of the benchmark of regimes: every learner under every kind of constraint and noise, beside an oracle."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pages import html
from ..experiments.regimes import DEFAULT, JACOBIAN, KNOWN, ORACLE, PAPER, verdict
from ..experiments.trials import Result
from ..figures import charts
from . import parts

TOP = 10.0


def page(result: Result) -> str:
    """What holds where, as cells, as a summary, and row by row."""
    noises = list(dict.fromkeys(row["noise"] for row in result.rows))
    systems = ", ".join(dict.fromkeys(row["system"] for row in result.rows))
    return html.document(
        "Learners in every regime of constraints and noise",
        verdict(result),
        html.markup(
            "Demonstrators ({systems}) move under constraints of many kinds, from none to some that are drawn at "
            "random, with and without noise on the recorded actions. Every learner sees the same recordings. The "
            "<b>oracle</b> sees the truth as well, and takes with it the best point on the paper’s path between "
            "consistency and risk. With <b>{known}</b>, every sample’s projection is given, and a ridge chosen by the "
            "truth. Noise is added to actions, not to states: no learner here may take differences of states. "
            "What counts is <b>nUPE</b>, how far the learnt policy is from the true one where nothing holds it "
            "back. {said}"
        ).format(systems=systems, known=KNOWN, said=_said(result)),
        html.section("Summary", _summary(result)),
        html.section("Regime by regime", *(_cells(result, noise, index) for index, noise in enumerate(noises))),
        html.section("What they know of their data", _knowledge(result)),
        html.section("With the kinematics known", *_kinematics(result)),
        html.section("All numbers", html.folded(f"{len(result.rows)} rows", _table(result.rows, result))),
        html.settings_table(result.settings),
    )


def _said(result: Result) -> html.Markup:
    """The default learner, at each noise level."""
    ours = [one for one in result.tables["summary"] if one["method"] == DEFAULT]
    parts = [
        f"{one['noise']:.0%} noise {html.number(one['to_paper'])} times the paper’s {PAPER} and "
        f"{html.number(one['to_oracle'])} times the oracle (at worst {html.number(one['worst_to_oracle'])}, "
        f"{one['worst']})"
        for one in ours
    ]
    return html.markup("The nUPE of the learner <b>{}</b>, as a geometric mean over all regimes, is at {}.").format(
        DEFAULT, "; at ".join(parts)
    )


def _summary(result: Result) -> html.Markup:
    summary = {(one["method"], one["noise"]): one for one in result.tables["summary"]}
    methods, noises = (list(dict.fromkeys(key[at] for key in summary)) for at in (0, 1))
    rows: list[list[str]] = []
    rules = []
    for noise in noises:
        rules.append(len(rows))
        for method in methods:
            one = summary[method, noise]
            name = html.markup("<b>{}</b>").format(method) if method == DEFAULT else method
            cells = [html.number(one[key]) for key in ("to_paper", "to_oracle", "worst_to_oracle")]
            rows.append([f"{noise:.0%}", name, one["worst"], *cells])
    count = summary[methods[0], noises[0]]["regimes"]
    header = ["noise", "method", "worst regime", f"nUPE / that of\nthe paper’s {PAPER}", "nUPE /\nthe oracle’s"]
    header.append("the same in the\nworst regime")
    note = (
        f"Geometric means over {count} regimes. Noise is the standard deviation on each action coordinate as a share "
    )
    note += "of the root-mean-square spread of the policy. Lower is better; the oracle cannot be chosen by anybody."
    return html.table(header, rows, left=3, note=note, rules=rules[1:])


def _cells(result: Result, noise: float, index: int) -> html.Markup:
    """What each method has for nUPE over what the oracle has, methods by regimes."""
    mine = [row for row in result.rows if row["noise"] == noise and row["method"] != ORACLE]
    methods = list(dict.fromkeys(row["method"] for row in mine))
    regimes = list(dict.fromkeys((row["system"], row["constraint"]) for row in mine))
    found = {(row["method"], row["system"], row["constraint"]): row["to_oracle"] for row in mine}
    values = np.array([[found[method, *regime] for regime in regimes] for method in methods], dtype=np.float64)
    picture = charts.ratio_table(
        methods,
        [f"{system}, {constraint}" for system, constraint in regimes],
        values,
        title=f"nUPE over the oracle’s, {noise:.0%} noise",
        scale="ratio",
        top=TOP,
    )
    caption = html.markup(
        "Geometric means over the data sets. White is as good as the oracle, orange worse, blue better; colours end at "
        "{:g} and {:g}. Numbers after a system are the θ<sub>max</sub> of eq. 20 (rad) in the plane, and "
        "the coordinates of the hand that are held for the arm; “half” and “quarter free” say how many demonstrations "
        "nothing constrained."
    ).format(TOP, 1 / TOP)
    return html.picture(f"noise-{index + 1}", [picture], caption if index == 0 else "As above.")


def _knowledge(result: Result) -> html.Markup:
    """How well free samples are told, and how often intervals hold the truth."""
    keys = ("auc_mean", "coverage_mean")
    methods = [
        method
        for method in dict.fromkeys(row["method"] for row in result.rows)
        if any(row[key] is not None for row in result.rows if row["method"] == method for key in keys)
    ]
    if not methods:
        return html.paragraph("None of these learners says what it knows.")
    rows = []
    for noise in dict.fromkeys(row["noise"] for row in result.rows):
        for method in methods:
            mine = [row for row in result.rows if (row["method"], row["noise"]) == (method, noise)]
            rows.append([f"{noise:.0%}", method, *(cell for key in keys for cell in _range(mine, key))])
    header = ["noise", "method", "free told apart:\nmean area", "least", "95 % intervals hold\nthe truth: mean"]
    header.append("least")
    note = (
        "The area under the curve is the probability that a free sample is thought freer than a constrained one, over "
        "the regimes that have both; 0.5 is guessing. Intervals are counted where the data determines the policy, over "
        "test states and action coordinates."
    )
    return html.table(header, rows, left=2, note=note, rules=range(len(methods), len(rows), len(methods)))


def _range(rows: list[dict[str, Any]], key: str) -> list[str]:
    """Mean and least over the regimes in which it is known."""
    known = [row[key] for row in rows if row[key] is not None]
    return [html.number(float(np.mean(known))), html.number(min(known))] if known else ["–", "–"]


def _kinematics(result: Result) -> list[html.Markup]:
    """What the default learner makes of the arm's Jacobian."""
    rows = result.tables["jacobian_known"]
    if not rows:
        return [html.paragraph("No arm is among these systems; those in the plane have no kinematics to know.")]
    text = (
        f"“{JACOBIAN}” is the learner “{DEFAULT}” that is told the Jacobian of the arm’s hand, and finds by itself "
        "which rows are held, in which demonstrations. It knows more than all learners above and is compared with none."
    )
    return [html.paragraph(text), _table(rows, result)]


def _table(given: list[dict[str, Any]], result: Result) -> html.Markup:
    """All figures of some rows."""
    header = ["system", "constraint", "noise", "method", "nUPE", "median", "geom.", "/ oracle", "nCPE", "norm. incon."]
    header += ["area", "coverage"]
    rows, rules, before = [], [], None
    for row in given:
        where = (row["system"], row["constraint"], row["noise"])
        if before is not None and where != before:
            rules.append(len(rows))
        before = where
        rows.append(
            [
                row["system"],
                row["constraint"],
                f"{row['noise']:.0%}",
                row["method"],
                parts.mean_sd(row["nupe_mean"], row["nupe_sd"]),
                html.number(100.0 * row["nupe_median"]),
                html.number(100.0 * row["nupe_geometric"]),
                html.number(row["to_oracle"]),
                parts.mean_sd(row["ncpe_mean"], row["ncpe_sd"]),
                parts.mean_sd(row["ninc_mean"], row["ninc_sd"]),
                html.number(row["auc_mean"]),
                html.number(row["coverage_mean"]),
            ]
        )
    note = (
        f"Mean ± standard deviation over {getattr(result.settings, 'trials', 1)} data sets; errors × 10⁻². The median "
    )
    note += "and the geometric mean are of nUPE."
    return html.table(header, rows, left=4, note=note, rules=rules)

"""The page of Table I."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array
from ...pages import figures, html
from ..experiments.table1 import verdict
from ..experiments.trials import METRICS, Result
from ..figures import charts
from . import parts

WORDS = {"none": "free", "random": "constrained"}
TITLES = {"nupe": "nUPE", "ncpe": "nCPE", "ninc": "inconsistency"}

UNDETERMINED = (
    "On free data the inconsistency determines next to nothing, and which of its eigenvalues are taken for zero "
    "decides its error there. The paper does not say which: “inconsistency” leaves out rounding errors alone, "
    "“truncated” also all below a millionth of the largest."
)

Curves = dict[str, tuple[Array, Array]]


def page(result: Result) -> str:
    """Ours beside the paper's, as a table and as dots."""
    return html.document(
        "Table I: free and randomly constrained demonstrations",
        verdict(result),
        html.markup(
            "A point moves in the plane on a limit cycle. It is recorded either <b>free</b> or while a rail that "
            "nobody tells the learner about holds it to one direction, and the rail turns twice on the way. Three "
            "methods learn from these recordings. <b>nUPE</b> says how far the learnt policy is from the true one "
            "where nothing holds it back, and <b>nCPE</b> how far after the rail has taken its share; both are squared "
            "errors as a share of the policy’s variance, so 1 is as bad as always answering the mean. Direct learning "
            "fails on constrained data and inconsistency alone on free data; the hybrid should be good at both."
        ),
        html.section("Errors", table(result.rows, trials(result), 100), html.paragraph(UNDETERMINED)),
        html.section("The same, to compare at a glance", dots(result)),
        html.settings_table(result.settings),
    )


def table(
    given: list[dict[str, Any]], trials: int, trials_of_paper: int, metrics: Sequence[str] = METRICS
) -> html.Markup:
    """Ours beside the paper's, row by row: a table for each error."""
    note = (
        f"{{}}: mean ± standard deviation, and median, over {trials} data sets, × 10⁻². The paper’s are over "
        f"{trials_of_paper}."
    )
    rules = [at for at, row in enumerate(given) if at and row["method"] != given[at - 1]["method"]]
    return html.markup("").join(
        html.table(
            ["method", "data", "ours", "median", "paper"],
            [_cells(row, metric) for row in given],
            left=2,
            note=note.format(TITLES[metric]),
            rules=rules,
        )
        for metric in metrics
    )


def _cells(row: dict[str, Any], metric: str) -> list[str]:
    """The method, the data, and its error beside the paper's."""
    data, median = WORDS.get(row["constraint"], row["constraint"]), html.number(100.0 * row[f"{metric}_median"])
    paper = parts.mean_sd(*_pair(row, f"paper_{metric}"))
    return [parts.label(row["method"]), data, parts.mean_sd(*_pair(row, metric)), median, paper]


def trials(result: Result) -> int:
    """How many data sets there were."""
    return int(getattr(result.settings, "trials", 1))


def dots(result: Result) -> html.Markup:
    """Means of both, method by method, on logarithmic axes."""
    constraints = list(dict.fromkeys(row["constraint"] for row in result.rows))
    found = {(row["method"], row["constraint"]): row for row in result.rows}
    panels = []
    for metric in ("nupe", "ncpe"):
        values = {
            method: [_pair(found[method, one], metric, 100.0) for one in constraints] for method in figures.METHODS
        }
        printed = {
            method: [_pair(found[method, one], f"paper_{metric}", 100.0)[0] for one in constraints]
            for method in figures.METHODS
        }
        title = f"{TITLES[metric]} × 10⁻²"
        groups = [WORDS.get(one, one) for one in constraints]
        panels.append(charts.dots(groups, values, printed, title=title, label=title))
    return html.picture(
        "errors",
        panels,
        "Filled: ours. Open: the paper’s. The axis is logarithmic, so whiskers show one standard deviation "
        "upwards only; downwards it would often pass zero. Lower is better.",
        keys=figures.METHODS,
    )


def curves(rows: list[dict[str, Any]], metric: str) -> Curves:
    """Means and standard deviations of each method, in the order of the rows."""
    of_methods = {method: [row for row in rows if row["method"] == method] for method in figures.METHODS}
    return {
        method: (np.array([row[f"{metric}_mean"] for row in own]), np.array([row[f"{metric}_sd"] for row in own]))
        for method, own in of_methods.items()
    }


def _pair(row: dict[str, Any], metric: str, scale: float = 1.0) -> tuple[float | None, float | None]:
    mean, sd = row.get(f"{metric}_mean"), row.get(f"{metric}_sd")
    return (None if mean is None else scale * mean, None if sd is None else scale * sd)

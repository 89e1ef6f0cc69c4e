"""Scores of the car-washing experiment as tables and bars."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pages import figures, html
from ..experiments.trials import Result

Row = dict[str, Any]
KINDS = {"plane": "normal of the plane", "tool": "axis of the tool"}

ERRORS = {
    "ncpe": "nCPE: squared error along the surface, as a share of the policy’s variance.",
    "nupe": "nUPE: squared error where nothing holds it, as a share of the policy’s variance.",
}
REAL = (
    "nCPE with the {}: squared error along the surface, as a share of the observed motion’s variance; 0 is perfect, "
    "and 1 no better than one constant velocity. The surface’s normal is estimated in two ways that share nothing: "
    "from the plane through the positions, and from the axis of the tool."
)

LEARNERS = (*figures.METHODS, "robust")
"""The paper's methods, and the default learner."""


def scores(result: Result) -> html.Markup:
    """Method by surface, and the mean over those that were held out: a table for each error or kind of normal."""
    rows = result.rows
    if "normal" not in rows[0]:
        return html.markup("").join(_table(rows, what, note) for what, note in ERRORS.items())
    kinds = dict.fromkeys(row["normal"] for row in rows)
    of_kinds = [(KINDS[kind], [row for row in rows if row["normal"] == kind]) for kind in kinds]
    return html.markup("").join(_table(of, "ncpe", REAL.format(normal)) for normal, of in of_kinds)


def bars(result: Result) -> html.Markup:
    """NCPE on each surface."""
    kinds = list(dict.fromkeys(row.get("normal") for row in result.rows))
    panels = []
    for kind in kinds:
        rows = [row for row in result.rows if row.get("normal") == kind]
        surfaces = list(dict.fromkeys(row["surface"] for row in rows))
        unseen = {row["surface"] for row in rows if not row["seen"]}
        # With some surfaces seen and some not, those that count are marked.
        groups = [f"{one}\n(new)" if one in unseen and len(unseen) < len(surfaces) else one for one in surfaces]
        values = {method: [_value(rows, method, one, "ncpe") for one in surfaces] for method in LEARNERS}
        title = f"nCPE with the {KINDS.get(kind, kind)}" if kind else ""
        panels.append(figures.bars(groups, values, title=title, label="nCPE"))
    mark = "" if kinds[0] else " New surfaces were not learnt from."
    return html.picture("scores", panels, f"Error along each surface; lower is better.{mark}", keys=LEARNERS)


def _table(rows: list[Row], what: str, note: str) -> html.Markup:
    surfaces = dict.fromkeys((row["surface"], row["seen"]) for row in rows)
    body = [
        [surface, "yes" if seen else "no", *(html.number(_value(rows, one, surface, what)) for one in LEARNERS)]
        for surface, seen in surfaces
    ]
    unseen = [row for row in rows if not row["seen"]]
    body.append([html.markup("<b>mean of the unseen</b>"), "", *_means(unseen, what)])
    said = html.markup(
        "{} In the last row, in brackets: relative to direct learning. Robust is the default learner of <i>fit</i>, "
        "with nothing set for this job."
    ).format(note)
    rules = (sum(seen for _, seen in surfaces), len(surfaces))
    return html.table(["surface", "learnt from", *LEARNERS], body, left=2, note=said, rules=rules)


def _means(rows: list[Row], what: str) -> list[str]:
    """Mean of each method, with its ratio to direct learning."""
    means = {method: float(np.mean([row[what] for row in rows if row["method"] == method])) for method in LEARNERS}
    relative = html.markup("{}\n<b>(×{})</b>")
    cells = []
    for method, mean in means.items():
        ratio = mean / means["direct"] if means["direct"] > 0 else float("nan")
        cells.append(
            html.number(mean) if method == "direct" else relative.format(html.number(mean), html.number(ratio, 2))
        )
    return cells


def _value(rows: list[Row], method: str, surface: str, what: str) -> float:
    return next(row[what] for row in rows if row["method"] == method and row["surface"] == surface)

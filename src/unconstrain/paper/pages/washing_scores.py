"""Scores of the car-washing experiment as tables and bars."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pages import figures, html
from ..experiments.trials import Result

Row = dict[str, Any]
KINDS = {"plane": "normal of the plane", "tool": "axis of the tool"}


LEARNERS = (*figures.METHODS, "robust")
"""The paper's methods, and the default learner."""


def scores(result: Result) -> html.Markup:
    """Method by surface, and the mean over those that were held out."""
    return _real_scores(result.rows) if "normal" in result.rows[0] else _simulated_scores(result.rows)


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


def _simulated_scores(rows: list[Row]) -> html.Markup:
    header = ["surface", "learnt from"]
    header += [f"{title}\n{method}" for title in ("nCPE", "nUPE") for method in LEARNERS]
    surfaces = list(dict.fromkeys((row["surface"], row["seen"]) for row in rows))
    body = []
    for surface, seen in surfaces:
        values = [_value(rows, method, surface, what) for what in ("ncpe", "nupe") for method in LEARNERS]
        body.append([surface, "yes" if seen else "no", *map(html.number, values)])
    seen_count = sum(seen for _, seen in surfaces)
    unseen = [row for row in rows if not row["seen"]]
    body.append([html.markup("<b>mean of the unseen</b>"), "", *_means(unseen, "ncpe"), *_means(unseen, "nupe")])
    note = html.markup(
        "Squared errors as a share of the policy’s variance. In the last row, in brackets: relative to direct "
        "learning. Robust is the default learner of <i>fit</i>, with nothing set for this job."
    )
    return html.table(header, body, left=2, note=note, rules=(seen_count, len(surfaces)))


def _real_scores(rows: list[Row]) -> html.Markup:
    kinds = list(dict.fromkeys(row["normal"] for row in rows))
    header = ["held-out tilt"]
    header += [f"{method}\n{kind} normal" for kind in kinds for method in LEARNERS]
    surfaces = list(dict.fromkeys(row["surface"] for row in rows))
    of_kind = {kind: [row for row in rows if row["normal"] == kind] for kind in kinds}
    body = [
        [
            surface,
            *(html.number(_value(of_kind[kind], method, surface, "ncpe")) for kind in kinds for method in LEARNERS),
        ]
        for surface in surfaces
    ]
    body.append([html.markup("<b>mean</b>"), *(cell for kind in kinds for cell in _means(of_kind[kind], "ncpe"))])
    note = html.markup(
        "nCPE: squared error along the surface, as a share of the observed motion’s variance; 0 is perfect, and 1 "
        "no better than one constant velocity. The surface’s normal is estimated in two ways that share "
        "nothing: from the plane through the positions, and from the axis of the tool. In the last row, in brackets: "
        "relative to direct learning. Robust is the default learner of <i>fit</i>, with nothing set for this job."
    )
    return html.table(header, body, note=note, rules=(len(surfaces),))


def _means(rows: list[Row], what: str) -> list[str]:
    """Mean of each method, with its ratio to direct learning."""
    means = {method: float(np.mean([row[what] for row in rows if row["method"] == method])) for method in LEARNERS}
    relative = html.markup("{} <b>(×{})</b>")
    cells = []
    for method, mean in means.items():
        ratio = mean / means["direct"] if means["direct"] > 0 else float("nan")
        cells.append(
            html.number(mean) if method == "direct" else relative.format(html.number(mean), html.number(ratio, 2))
        )
    return cells


def _value(rows: list[Row], method: str, surface: str, what: str) -> float:
    return next(row[what] for row in rows if row["method"] == method and row["surface"] == surface)

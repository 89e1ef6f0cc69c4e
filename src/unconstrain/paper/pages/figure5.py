"""The page of figure 5."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...base.arrays import Array
from ...pages import figures, html
from ..experiments import figure5
from ..experiments.trials import LABELS, Result
from ..figures import charts
from . import parts, table1

TITLES = {metric: LABELS[metric] for metric in ("nupe", "ncpe")}
ANGLE = "how far constraints vary, θmax (rad)"


def page(result: Result) -> str:
    """Errors against how much the constraints vary."""
    widest = np.array(sorted({row["theta_max"] for row in result.rows}))
    return html.document(
        "Figure 5: from one constraint to many",
        figure5.verdict(result),
        html.markup(
            "Movement is allowed only along the policy turned by a random angle of at most θ<sub>max</sub>. At 0 the "
            "recordings are the policy itself; to the right the constraint takes away more, and differently at each "
            "sample (the paper does not say how often it draws the angle; at the end of the page it is drawn once for "
            "each trajectory). Direct learning is good at the left and gets worse steadily; inconsistency alone is the "
            "other way round. The hybrid has to follow the lower of the two without being told where on this axis the "
            "data lies. <b>nUPE</b> is the error of the learnt policy where it is free, <b>nCPE</b> after the "
            "constraint has taken its share, both as a share of the policy’s variance."
        ),
        html.section("Errors", _errors(widest, _curves(result.rows))),
        html.section("The hybrid against the better of the other two", _ratio(widest, result)),
        html.section("Numbers", _table(result.rows, result)),
        html.section("Numbers with one angle for each trajectory", _table(result.tables["per_trajectory"], result)),
        html.settings_table(result.settings),
    )


def _curves(rows: list[dict[str, Any]]) -> dict[str, table1.Curves]:
    ordered = sorted(rows, key=lambda row: row["theta_max"])
    return {metric: table1.curves(ordered, metric) for metric in TITLES}


def _errors(widest: Array, curves: dict[str, table1.Curves]) -> html.Markup:
    panels = []
    for metric, title in TITLES.items():
        ours = curves[metric]
        # The inconsistency's nUPE at 0 would flatten everything else.
        top = 1.1 * max(float((mean + sd).max()) for key, (mean, sd) in ours.items() if key != "inconsistency")
        panels.append(charts.bands(widest, ours, title=f"{title}, linear", labels=(ANGLE, title), top=top))
        panels.append(charts.bands(widest, ours, title=f"{title}, logarithmic", labels=(ANGLE, title), log=True))
    return html.picture(
        "errors",
        panels,
        "Lines are means over the data sets, bands one standard deviation (on a logarithmic axis they end at its "
        "lower edge where they reach zero). The linear axes stop where direct learning does; inconsistency alone "
        "leaves the first picture at the left.",
        keys=figures.METHODS,
    )


def _ratio(widest: Array, result: Result) -> html.Markup:
    found = {title: figure5.ratios(result.rows, metric) for metric, title in TITLES.items()}
    made = charts.ratios(
        widest,
        {title: np.array([by_angle[angle] for angle in widest]) for title, by_angle in found.items()},
        labels=(ANGLE, "hybrid / better of the two"),
    )
    return html.picture(
        "ratio",
        [made],
        "At 1 the hybrid is as good as if it had been told which of the two methods to use; below, it beats both. "
        "Ratios of the means over the data sets. Far to the left the nCPE of inconsistency alone is minute because it "
        "fits what was seen and nothing else; its policy is useless there, as its nUPE tells.",
        keys=tuple(TITLES.values()),
        colours=charts.RATIO_COLOURS,
    )


def _table(rows: list[dict[str, Any]], result: Result) -> html.Markup:
    """Means and medians by angle: a table for each error."""
    found = {(row["theta_max"], row["method"]): row for row in rows}
    header: list[str] = [html.markup("θ<sub>max</sub> (rad)")]
    header += figures.METHODS
    trials = getattr(result.settings, "trials", 1)
    made = []
    for metric, title in TITLES.items():
        body = [
            [
                html.number(angle),
                *(_cell(found[angle, method], metric) for method in figures.METHODS),
            ]
            for angle in sorted({angle for angle, _ in found})
        ]
        note = f"{title}: mean ± standard deviation, and below it the median, over {trials} data sets, all × 10⁻²."
        made.append(html.table(header, body, note=note))
    return html.markup("").join(made)


def _cell(row: dict[str, Any], metric: str) -> str:
    mean, sd, median = (row[f"{metric}_{what}"] for what in ("mean", "sd", "median"))
    return f"{parts.mean_sd(mean, sd)}\n{html.number(100.0 * median)}"

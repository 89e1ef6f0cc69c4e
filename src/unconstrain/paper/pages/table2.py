"""The page of Table II."""

from __future__ import annotations

import numpy as np

from ...pages import figures, html
from ..experiments import table2
from ..experiments.trials import Result
from ..figures import charts
from . import table1

HELD = "coordinates of the hand that are held"

READINGS = (
    "These rows take the paper word for word: a fifth of the samples of the trajectories that are learnt from is "
    "held out for testing, samples have no weights, and one α serves all rows. What else the name of a method says is "
    "another reading of the paper, or what it does not have: see the settings."
)


def page(result: Result) -> str:
    """Errors against the number of constraints, and ours beside the paper's."""
    return html.document(
        "Table II: an arm whose hand is held",
        table2.verdict(result),
        html.markup(
            "An arm of seven joints moves away from its joint limits while one to six coordinates of its hand "
            "(position, then orientation) are kept still. Nobody tells the learner that, and it has to find how the "
            "joints would move if the hand were free. <b>nUPE</b> says how far it is from that, <b>nCPE</b> how far "
            "once the hand is held again; both as a share of the policy’s variance. The more is held, the less direct "
            "learning sees; inconsistency alone loses its footing where one direction is left. The hybrid should stay "
            "low everywhere."
        ),
        html.section("Errors against the constraint", _curves(result)),
        html.section("Beside the paper", *_readings(result)),
        html.section("The same, to compare at a glance", table1.dots(result)),
        html.section("With the kinematics known", *_kinematics(result)),
        html.settings_table(result.settings),
    )


def _readings(result: Result) -> list[html.Markup]:
    """The paper's own reading, and others folded away."""
    own = [row for row in result.rows if row["method"] in table2.METHODS]
    others = [row for row in result.rows if row["method"] not in table2.METHODS]
    shown, more = (table1.table(rows, table1.trials(result), 50, ("nupe", "ncpe")) for rows in (own, others))
    return [shown, html.paragraph(READINGS), html.folded("Other readings, and fresh trajectories", more)]


def _kinematics(result: Result) -> list[html.Markup]:
    """The learner that is told the Jacobian, beside the hybrid of the same data sets."""
    rows = result.tables["jacobian_known"]
    count = min(getattr(result.settings, "jacobian_trials", 0), table1.trials(result))
    text = (
        f"“{table2.JACOBIAN}” is the learner “robust” that is told the Jacobian of the hand, and finds by itself which "
        "of its rows are held. It knows more than the methods of the paper. Both are tested on fresh trajectories."
    )
    return [html.paragraph(text), table1.table(rows, count, 50, ("nupe", "ncpe"))] if rows else []


def _curves(result: Result) -> html.Markup:
    held = np.arange(1.0, len(table2.CONSTRAINTS) + 1.0)
    panels = []
    for metric, title in (("nupe", "nUPE"), ("ncpe", "nCPE")):
        curves = table1.curves(result.rows, metric)
        panels.append(charts.bands(held, curves, title=title, labels=(HELD, title), log=True))
    return html.picture(
        "curves",
        panels,
        "Lines are means over the data sets, bands one standard deviation; the axes are logarithmic.",
        keys=figures.METHODS,
    )

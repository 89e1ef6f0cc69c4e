"""The page of motion that arrives: every shape as a small picture, and what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...pages import html
from ..experiments import arrival
from ..experiments.trials import Result
from ..figures import shapes

Row = dict[str, Any]


def page(result: Result) -> str:
    """Shapes, prices, planes and cycles."""
    tables = result.tables
    return html.document(
        "Motion that arrives",
        arrival.verdict(result),
        "A policy that was learnt does what was shown near the demonstrations, and anywhere else it may stop or leave. "
        "Guided, it arrives: a convex function of the state, learnt from the same demonstrations, falls along every "
        "movement, free or held by any plane. Here it is tried on thirty shapes that people drew, and on cycles.",
        html.section("In short", html.bullets(arrival.headlines(result))),
        *([html.section("All shapes", _pictures(result), _shapes(result.rows))] if result.rows else []),
        *([html.section("Beside other ways", *_beside(tables["ways"]))] if result.rows else []),
        *([html.section("What it costs where it was shown", _prices(tables["prices"]))] if result.rows else []),
        *([html.section("On planes", _planes(tables["planes"]))] if result.rows else []),
        *([html.section("Cycles", _cycles(tables["cycles"]))] if tables["cycles"] else []),
        html.settings_table(result.settings),
    )


def _pictures(result: Result) -> html.Markup:
    caption = (
        "Grey: the strokes. Green: guided, from where they begin, and thin from random starts. Orange: what the policy "
        "does by itself from where they begin, until it leaves the picture. Violet: contracting. The dot is the goal. "
        "All in mm."
    )
    return html.picture("shapes", shapes.small_multiples(result.details["drawn"]), caption, least=150)


def _shapes(rows: Sequence[Row]) -> html.Markup:
    header = ["shape", "arrive,\nshown", "unguided", "arrive,\nrandom", "unguided", "area\n(mm²)", "warping\n(mm)"]
    header += ["correction", "energy", "nUPE ×", "step ×"]
    shares = ("shown_guided", "shown_unguided", "random_guided", "random_unguided")
    body = [
        [
            row["shape"],
            *(f"{row[key]:.0%}" for key in shares),
            html.number(row["area"]),
            html.number(row["dtw"]),
            f"{row['correction']:.1%}",
            f"{row['energy']:.2%}",
            html.number(row["nupe_ratio"]),
            html.number(row["step"]),
        ]
        for row in rows
    ]
    note = (
        "Arrived: within 5 % of the largest distance that was shown. Area between the guided path and the stroke, and "
        "their distance after time warping. Correction: share of the motion, and of its energy, at demonstrated "
        "states; nUPE and time of one step are over those of the policy itself."
    )
    return html.table(header, body, note=note)


WAYS = {
    "unguided": "policy by itself",
    "guided": "guided",
    "contracting": "contracting",
    "stable": "LPV-DS (Figueroa and Billard 2018)",
}


def _beside(rows: Sequence[Row]) -> list[html.Markup]:
    means = [
        [
            WAYS[way],
            *(f"{mean[key]:.1%}" for key in ("shown", "random")),
            *(html.number(mean[key]) for key in ("area", "dtw", "step_us")),
        ]
        for way, mean in arrival.by_way(rows).items()
    ]
    header = [
        "means over the shapes",
        "arrive,\nshown",
        "arrive,\nrandom",
        "area\n(mm²)",
        "warping\n(mm)",
        "one step\n(µs)",
    ]
    note = (
        "Contracting: local models learnt under the condition that each contracts towards the goal. LPV-DS: a mixture "
        "of linear systems with one quadratic Lyapunov function, which knows no constraints; for figures only. Areas "
        "and warping are of movements that arrive: a policy by itself is judged by the few that do."
    )
    by_shape = {row["shape"]: dict[str, Row]() for row in rows}
    for row in rows:
        by_shape[row["shape"]][row["way"]] = row
    body = [
        [shape, *(html.number(ways[way]["area"]) for way in WAYS), *(html.number(ways[way]["dtw"]) for way in WAYS)]
        for shape, ways in by_shape.items()
    ]
    short = ["by itself", "guided", "contracting", "LPV-DS"]
    each = html.table(
        ["shape", *(f"area,\n{way}" for way in short), *(f"warping,\n{way}" for way in short)],
        body,
        note="Area (mm²) between path and stroke, and distance after time warping (mm); “–” where none arrives.",
    )
    return [html.table(header, means, note=note), html.folded("Each shape", each)]


def _prices(rows: Sequence[Row]) -> html.Markup:
    steps = [name for name in rows[0] if name != "shape"]
    body = [[row["shape"], *(html.number(row[step]) for step in steps)] for row in rows]
    note = (
        "nUPE guided over nUPE at demonstrated states, for steps of several lengths. V is to fall with each Euler "
        "step, which bounds how sharply it bends. Narrow hairpins, there and back side by side, need it to bend "
        "sharply: they cost little where the control loop is fast."
    )
    return html.table(["shape", *steps], body, note=note)


def _planes(rows: Sequence[Row]) -> html.Markup:
    keys = ("own_planes", "contracting", "falls", "optimum")
    body = [
        [row["shape"], *(f"{row[key]:.0%}" for key in keys), html.number(row["area"]), html.number(row["nupe_ratio"])]
        for row in rows
    ]
    note = (
        "Every stroke is turned onto a plane of its own, which nobody tells the learner. Strokes are followed on their "
        "planes, guided and, in the next column, contracting; from random starts, on planes of any tilt, movements "
        "should end where V is least on the plane."
    )
    header = ["shape", "strokes\narrive", "contracting", "V falls", "ends where V\nis least", "area\n(mm²)", "nUPE ×"]
    return html.table(header, body, note=note)


def _cycles(rows: Sequence[Row]) -> html.Markup:
    header = ["cycle", "turns", "radius shown\n(cm)", "radius", "pace shown\n(Hz)", "pace", "drift\n(mm)", "correction"]
    body = [
        [
            row["cycle"],
            html.number(row["turns"]),
            html.number(100.0 * row["radius_shown"]),
            f"{row['radius_off']:+.1%}",
            html.number(row["pace_shown"]),
            f"{row['pace_off']:+.1%}",
            html.number(row["drift_mm"]),
            f"{row['correction']:.1%}",
        ]
        for row in rows
    ]
    note = (
        "A plate for each simulated cycle, beside the true policy on it; then ten recorded bouts of wiping, each "
        "learnt from alone and followed on its plane, and what all taught on the plane of each. Drift: from the "
        "middle of the second turn to that of the last. Correction: share of the motion at the states beside."
    )
    return html.table(header, body, note=note, rules=[len(rows) - arrival.cycles.BOUTS - 1])

"""The page of the constraints that are learnt."""

from __future__ import annotations

from typing import Any

from ...pages import html
from ...pages.constraint import held_directions
from ..experiments import constraints
from ..experiments.trials import Result


def page(result: Result) -> str:
    """What was found for each task, and the recording with what held it."""
    recorded = [html.section("The recording", _recording(result))] if result.details else []
    return html.document(
        "The constraint, learnt",
        constraints.verdict(result),
        "Nobody says what held these movements: it is learnt from them, in closed form, and then compared with the "
        "truth on fresh trajectories. nPPE is how far the learnt projection is from the true one as the policy sees "
        "it, nPOE how much of the observed motion it would take away. Systems and counts are those of the library CCL.",
        html.section("In short", html.bullets(constraints.headlines(result))),
        html.section("Task by task", _table(result)),
        *recorded,
        html.section("The part that no task moves", _components(result)),
        html.section("Mechanisms with names", _mechanisms(result)),
        *([html.section("A wiped rim", _normals(result))] if "normals" in result.tables else []),
        html.settings_table(result.settings),
    )


def _table(result: Result) -> html.Markup:
    header = ["task", "features", "noise", "nPPE", "worst", "nPOE", "noise found\n/ true", "rank right", "ms"]
    keys = ("nppe", "nppe_worst", "npoe", "noise_found")
    rows = [
        [
            row["task"],
            row["features"],
            f"{row['noise']:.0%}",
            *(html.number(row[key]) for key in keys),
            f"{row['rank_right']:.0%}",
            html.number(row["ms"]),
        ]
        for row in result.rows
    ]
    rules = [place for place, row in enumerate(result.rows) if place and row["task"] != result.rows[place - 1]["task"]]
    note = "Medians over the data sets. “auto” is told nothing; the other features hold the truth, or nearly."
    return html.table(header, rows, left=2, note=note, rules=rules)


def _recording(result: Result) -> html.Markup:
    details: dict[str, Any] = result.details
    rows = [
        [str(row["blocks"]), html.number(row["s_each"]), html.number(row["npoe"])] for row in result.tables["recorded"]
    ]
    table = html.table(["blocks", "s each", "nPOE where held out"], rows, note="One block held out at a time.")
    return html.markup("{}{}").format(held_directions([(details["learnt"], [details["demonstration"]])]), table)


def _components(result: Result) -> html.Markup:
    rows = [[row["way"], html.number(row["error"])] for row in result.tables["component"]]
    note = "Squared error of the null-space component over its variance, medians; the task is drawn at each sample."
    return html.table(["learnt by", "error"], rows, note=note)


def _mechanisms(result: Result) -> html.Markup:
    header = ["kind", "simulated", "kind right", "inside 95 %\nintervals", "confident", "confident\nand wrong"]
    rows = [
        [
            row["kind"],
            str(row["mechanisms"]),
            f"{row['right']:.0%}",
            f"{row['inside']:.1%} of {row['parameters']}",
            str(row["confident"]),
            str(row["confident_and_wrong"]),
        ]
        for row in result.tables["mechanisms"]
    ]
    note = "Noise of 2 mm. A verdict is confident from odds of 20:1; parameters are judged where the kind is right."
    return html.table(header, rows, note=note)


def _normals(result: Result) -> html.Markup:
    header = [
        "bout",
        "likeliest",
        "plane to tool,\ndegrees",
        "off it, mm",
        "curved surface\nto tool, degrees",
        "off it, mm",
    ]
    rows = [
        [
            row["bout"],
            row["likeliest"],
            *(f"{row[angle]:.1f}" if angle.startswith("angle") else f"{1e3 * row[angle]:.1f}" for angle in _OF_NORMALS),
        ]
        for row in result.tables["normals"]
    ]
    note = (
        "Angle between the normal of the surface nearest to the positions and the mean axis of the tool, and the rms "
        "distance of the positions. A1 to A3 are flat, the others tilted and curved: a quadratic surface does not come "
        "nearer to the tool's axis than a plane, so that there the hand held the tool off the normal."
    )
    return html.table(header, rows, left=2, note=note)


_OF_NORMALS = ("angle", "off_plane", "angle_curved", "off_curved")

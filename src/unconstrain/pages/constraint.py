"""The page of a learnt constraint: what was held, where, and what the data does not tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Array
from ..evaluation import npoe, verdicts
from ..recordings import Demonstration, stack
from . import figures, html

if TYPE_CHECKING:
    from ..constraints import LearntConstraint

MOST_NORMALS = 150
MOST_POINTS = 4000

_HELD = "inconsistency"
"""The key that lends its colour to held directions."""


def constraint_page(
    learnt: LearntConstraint,
    demonstrations: Sequence[Demonstration],
    title: str,
    columns: Sequence[str] | None = None,
    mechanism: str | None = None,
    each: Sequence[tuple[str, str]] = (),
) -> str:
    """Make the page of a learnt constraint.

    Parameters
    ----------
    learnt : LearntConstraint
    demonstrations : sequence of Demonstration
        What it was learnt from, or others.
    title : str
        Of the page.
    columns : sequence of str, optional
        Names of the states.
    mechanism : str, optional
        What may have held them, in words.
    each : sequence of pairs of str, optional
        What held each demonstration, with its name, where they differ.

    Returns
    -------
    str
        A whole HTML document.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.
    """
    choice, demos = learnt.choice_, list(demonstrations)
    tiles = [
        (f"{learnt.rank_} of {choice.actions}", "directions held"),
        (choice.name or "own", "features"),
        (html.number(learnt.noise_), "noise and misfit along them"),
        (html.number(npoe(learnt, demos)), "nPOE, the share of the observed motion that it would take"),
    ]
    rows = [[name or "own", html.number(share)] for name, share in choice.candidates.items()]
    note = "Mean square along the held directions, as a share of the mean square action, where held out."
    parts = (
        [html.section("Where it holds", held_directions(learnt, demos, columns))]
        if choice.columns == choice.actions > 1
        else []
    )
    doubts = [html.section("What the data does not tell", html.bullets(choice.doubts))] if choice.doubts else []
    return html.document(
        title,
        verdicts.of_constraint(learnt),
        html.words("constraint_lead"),
        *_named(mechanism, each),
        *parts,
        *doubts,
        html.section("Numbers", html.tiles(tiles)),
        html.section("How its form was chosen", html.table(["features", "missed"], rows, note=note)),
    )


def _named(mechanism: str | None, each: Sequence[tuple[str, str]]) -> list[html.Markup]:
    if mechanism is None:
        return []
    note = "Positions in m, with half of their 95 % intervals."
    table = [html.table(["demonstration", "mechanism"], each, note=note, left=2)] if each else []
    return [html.section("The mechanism", html.paragraph(f"{mechanism[:1].upper()}{mechanism[1:]}."), *table)]


def held_directions(
    learnt: LearntConstraint, demos: Sequence[Demonstration], columns: Sequence[str] | None = None
) -> html.Markup:
    """Held directions through recorded states, over the first two or three columns."""
    states, _, _ = stack(demos)
    labels = list(columns or (f"state {column + 1}" for column in range(states.shape[1])))
    few = states[:: -(-len(states) // MOST_NORMALS)]
    shown = min(states.shape[1], 3)
    reach = float(np.ptp(states[:, :shown], axis=0).max()) / 25
    lines = np.concatenate([_strokes(few, reach * learnt(few)[:, row]) for row in range(learnt.rank_)])[:, :shown]
    every = -(-len(states) // MOST_POINTS)
    tracks = [demo.states[::every, :shown] for demo in demos]
    drawn = [*(("training", track) for track in tracks), (_HELD, lines)]
    panel = (
        figures.movements(drawn, labels=(labels[0], labels[1], labels[2]))
        if shown == 3
        else figures.paths(drawn, labels=(labels[0], labels[1]))
    )
    caption = "Grey lines are the demonstrations. Strokes are directions in which they were held at these states."
    words = {_HELD: "held directions", "training": "demonstrations"}
    return html.picture("held", [panel], caption, keys=(_HELD, "training"), labels=words)


def _strokes(points: Array, half: Array) -> Array:
    """Lines through points to either side, with a row of NaN after each, shape (3 N, n)."""
    return np.stack([points - half, points + half, np.full_like(points, np.nan)], axis=1).reshape(-1, points.shape[1])

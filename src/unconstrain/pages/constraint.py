"""The page of a learnt constraint: what was held, where, and what the data does not tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..evaluation import npoe, verdicts
from ..recordings import Demonstration, stack
from . import figures, html
from .figures.planes import strokes

if TYPE_CHECKING:
    from ..constraints import LearntConstraint

    Part = tuple[LearntConstraint, Sequence[Demonstration]]

MOST_NORMALS = 150
MOST_POINTS = 4000

_HELD = "inconsistency"
"""The key that lends its colour to held directions."""


def constraint_page(
    learnt: Sequence[LearntConstraint],
    demonstrations: Sequence[Demonstration],
    title: str,
    columns: Sequence[str] | None = None,
    mechanism: Sequence[str] = (),
    each: tuple[Sequence[str], Sequence[Sequence[str]]] = ((), ()),
    verdict: verdicts.Verdict | None = None,
) -> str:
    """Make the page of a learnt constraint.

    Parameters
    ----------
    learnt : sequence of LearntConstraint
        One for all demonstrations, or one for each.
    demonstrations : sequence of Demonstration
        What it was learnt from, or others.
    title : str
        Of the page.
    columns : sequence of str, optional
        Names of the states.
    mechanism : sequence of str, optional
        What may have held them, in sentences.
    each : pair of sequences, optional
        Head and rows of a table: what held each demonstration, where they differ.
    verdict : Verdict, optional
        By default on what was learnt alone.
    """
    demos, choice = list(demonstrations), learnt[0].choice_
    parts = (
        [(learnt[0], demos)] if len(learnt) == 1 else [(one, [demo]) for one, demo in zip(learnt, demos, strict=True)]
    )
    doubts = list(dict.fromkeys(doubt for one in learnt for doubt in one.choice_.doubts)) if len(learnt) == 1 else []
    return html.document(
        title,
        verdict or verdicts.of_constraint(*learnt),
        html.words("constraint_lead"),
        *_named(mechanism, each),
        *(
            [html.section("Where it holds", held_directions(parts, columns))]
            if choice.columns == choice.actions > 1
            else []
        ),
        *([html.section("What the data does not tell", html.bullets(doubts))] if doubts else []),
        html.section("Numbers", _numbers(parts)),
        *([_chosen(learnt[0])] if len(learnt) == 1 else []),
    )


def _numbers(parts: Sequence[Part]) -> html.Markup:
    learnt = [one for one, _ in parts]
    ranks = sorted({one.rank_ for one in learnt})
    held = " to ".join(map(str, dict.fromkeys((ranks[0], ranks[-1]))))
    taken = float(np.mean([npoe(one, demos) for one, demos in parts]))
    return html.tiles(
        [
            (f"{held} of {learnt[0].choice_.actions}", "directions held"),
            _form(learnt[0]),
            (html.number(float(np.mean([one.noise_ for one in learnt]))), "noise and misfit along them"),
            (html.number(taken), "nPOE, the share of the observed motion that it would take"),
        ]
    )


def _form(learnt: LearntConstraint) -> tuple[str, str]:
    named = learnt.mechanism_
    return (named.kind, "mechanism") if named else (learnt.choice_.name or "own", "features")


def _chosen(learnt: LearntConstraint) -> html.Markup:
    rows = [[name or "own", html.number(share)] for name, share in learnt.choice_.candidates.items()]
    of = "the directions that velocities show" if learnt.mechanism_ else "the held directions"
    note = f"Mean square along {of}, as a share of the mean square action, where held out."
    return html.section("How its form was chosen", html.table(["features", "missed"], rows, note=note))


def _named(mechanism: Sequence[str], each: tuple[Sequence[str], Sequence[Sequence[str]]]) -> list[html.Markup]:
    head, rows = each
    said = [html.section("The mechanism", *map(html.paragraph, mechanism))] if mechanism else []
    half = ", with half of their 95 % intervals" * any("±" in cell for row in rows for cell in row)
    note = f"Lengths in the unit of the columns{half}." * ("radius" in head)
    return [
        *said,
        *([html.section("Each demonstration", html.table(head, rows, note=note, left=len(head)))] if rows else []),
    ]


def held_directions(parts: Sequence[Part], columns: Sequence[str] | None = None) -> html.Markup:
    """Held directions through recorded states, over the first two or three columns: constraints with what they held."""
    demos = [demo for _, held in parts for demo in held]
    states = np.concatenate([demo.states for demo in demos])
    labels = list(columns or (f"state {column + 1}" for column in range(states.shape[1])))
    shown = min(states.shape[1], 3)
    reach = float(np.ptp(states[:, :shown], axis=0).max()) / 25
    every = -(-len(states) // MOST_NORMALS)
    at = [(one, stack(held)[0][::every]) for one, held in parts]
    rows = [(states, reach * one(states)[:, row]) for one, states in at for row in range(one.rank_)]
    lines = np.concatenate([strokes(*each) for each in rows])[:, :shown]
    thinned = -(-len(states) // MOST_POINTS)
    drawn = [*(("training", demo.states[::thinned, :shown]) for demo in demos), (_HELD, lines)]
    panel = (
        figures.movements(drawn, labels=(labels[0], labels[1], labels[2]))
        if shown == 3
        else figures.paths(drawn, labels=(labels[0], labels[1]))
    )
    caption = "Grey lines are the demonstrations. Strokes are directions in which they were held at these states."
    words = {_HELD: "held directions", "training": "demonstrations"}
    return html.picture("held", [panel], caption, keys=(_HELD, "training"), labels=words)

"""The page of a diagnosis: noise, undetermined states, free demonstrations, and what to record next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.display import percent
from ..base.errors import InvalidDataError
from ..evaluation import Diagnosis, diagnose, diagnosis, verdicts
from ..recordings import Demonstration, stack
from . import figures, html

if TYPE_CHECKING:
    from ..policies import Policy

MOST_POINTS = 2000
MOST_REGIONS = 8
MOST_MOVEMENTS = 60


def diagnosis_page(
    found: Diagnosis,
    demonstrations: Sequence[Demonstration],
    title: str,
    states: Sequence[str],
    actions: Sequence[str],
    verdict: verdicts.Verdict | None = None,
) -> str:
    """Make the page of a diagnosis.

    Parameters
    ----------
    found : Diagnosis
    demonstrations : sequence of Demonstration
        Those that it is of, in the same order.
    title : str
        Of the page.
    states, actions : sequence of str
        Names of the columns.
    verdict : Verdict, optional
        To begin with, where more is known than the diagnosis says.
    """
    demos = list(demonstrations)
    return html.document(
        title,
        verdict or verdicts.of_diagnosis(found, diagnosis.to_record(found, states, actions)),
        html.words("diagnosis_lead"),
        html.section("What to record next", _next(found, states, actions)),
        html.section("Where three demonstrations do not tell", _map(found, demos, states, actions)),
        html.section("In sentences", html.bullets(diagnosis.sentences(found, states, actions))),
        html.section("Free or constrained", _freedom(found)),
        html.section("How the policy was chosen", _chosen(found)),
    )


def unknown(
    policy: Policy, demos: list[Demonstration], states: Sequence[str], actions: Sequence[str]
) -> list[html.Markup]:
    """The map and what to record next, for the page of a fit."""
    try:
        found = diagnose(policy, demos)
    except InvalidDataError as error:
        return [html.paragraph(f"Nothing can be said about that: {error}")]
    said = diagnosis.sentences(found, states, actions)
    if not diagnosis.needs_more(found):
        return [html.bullets([*said, diagnosis.nowhere(found)])]
    told = f"Recordings: {verdicts.shares_told(found)}.", diagnosis.to_record(found, states, actions)
    return [html.bullets([*said, *told]), _map(found, demos, states, actions), _next(found, states, actions)]


def _map(found: Diagnosis, demos: list[Demonstration], states: Sequence[str], actions: Sequence[str]) -> html.Markup:
    """Two state columns, coloured by the undetermined spread; a sentence where three tell the policy at all."""
    if found.told.min() == 2:
        return html.paragraph("Nowhere: three demonstrations or more tell the policy at every recorded state.")
    recorded = stack(demos).states
    regions = diagnosis.places(verdicts.ranked(found))[:MOST_REGIONS]
    worst = np.array([region.state for region in regions])
    if recorded.shape[1] == 1:
        recorded, worst = (np.column_stack([one, np.zeros(len(one))]) for one in (recorded, worst))
        states = [*states, ""]
    shown = sorted(np.argsort(-recorded.var(axis=0), kind="stable")[:2])
    every = -(-len(recorded) // MOST_POINTS)
    least = int(found.undetermined.argmax())
    rows = np.unique([*range(0, len(recorded), every), least])
    same = len(actions) == len(states)
    ways = np.array([region.direction for region in regions])[:, shown] if same else None
    picture = figures.known_map(
        recorded[rows][:, shown],
        found.undetermined[rows],
        worst[:, shown],
        labels=(states[shown[0]], states[shown[1]]),
        scale="undetermined spread / typical action",
        directions=ways,
        top=diagnosis.SMALL,
    )
    caption = html.words("diagnosis_map", typical=html.number(found.typical), directions=same, states=len(states))
    return html.picture("known", [picture], caption)


def _next(found: Diagnosis, states: Sequence[str], actions: Sequence[str]) -> html.Markup:
    if not diagnosis.needs_more(found):
        return html.paragraph(diagnosis.nowhere(found))
    every = diagnosis.places(verdicts.ranked(found))
    shown = every[:MOST_REGIONS]
    rows = [
        [
            str(number),
            ", ".join(map(html.number, one.state)),
            ", ".join(map(html.number, one.direction)),
            one.demonstration,
            f"{one.along:.1%}",
            f"{one.spread:.1%}",
            percent(one.together),
            percent(one.determined),
            {0: "none", 1: f"only {''.join(one.shown_by)}"}.get(len(one.shown_by), str(len(one.shown_by))),
            str(one.samples),
        ]
        for number, one in enumerate(shown, 1)
    ]
    around, along = (", ".join(names) for names in (states, actions))
    header = ["", f"demonstrate around\n({around})", f"with motion left free along\n({along})", "recorded in"]
    header += ["spread\nalong it", "spread in\nthe region", "told\nby all", "by three"]
    header += ["some motion\nalong it by", "samples"]
    note = html.words("diagnosis_next", shown=len(shown), every=len(every), regions=len(found.regions))
    return html.table(header, rows, left=4, note=note)


def _freedom(found: Diagnosis) -> html.Markup:
    if found.free is None:
        return html.paragraph("The policy was fitted to other demonstrations.")
    told = [one for one in found.movements if one.looks in diagnosis.COUNTED]
    if not (shown := told[:MOST_MOVEMENTS]):
        said = "Of no demonstration this can be told by how free its samples look."
        return html.paragraph(f"{said} {diagnosis.about_freedom(found)}")
    free = [one.free or 0.0 for one in shown]
    picture = figures.bars([one.name for one in shown], {"hybrid": free}, title="", label="probability of being free")
    picture.axes[0].set_ylim(0.0, 1.0)
    caption = html.words(
        "diagnosis_freedom",
        free=diagnosis.FREE,
        constrained=diagnosis.CONSTRAINED,
        shown=len(shown),
        every=len(told),
        left=len(found.movements) - len(told),
    )
    return html.picture("free", [picture], caption, labels={"hybrid": "demonstrations"})


def _chosen(found: Diagnosis) -> html.Markup:
    if not found.candidates:
        return html.paragraph(f"Nothing was compared with the policy, which was learnt as {found.method}.")
    rows = [
        [name, html.number(risk), "yes" if name == found.method else "no"]
        for name, risk in sorted(found.candidates.items(), key=lambda one: one[1])
    ]
    note = html.words("diagnosis_chosen")
    return html.table(["candidate", "estimated squared error", "taken"], rows, note=note)

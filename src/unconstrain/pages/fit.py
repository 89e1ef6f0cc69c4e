"""The page of a policy that somebody fitted to demonstrations of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import is_dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Array
from ..base.errors import InvalidDataError, SettingError
from ..evaluation import ncpe, ninconsistency, nupe
from ..learners import named
from ..recordings import Demonstration, stack
from ..risks import action_projection, project
from . import figures, html
from .diagnosis import unknown

if TYPE_CHECKING:
    from ..policies import Policy

MOST_PANELS = 4
MOST_ROWS = 30
MOST_POINTS = 2000
ARROWS = 15


def policy_page(policy: Policy, demonstrations: Sequence[Demonstration], title: str) -> str:
    """Make the page of a fitted policy.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demonstrations : sequence of Demonstration
        What it was fitted to, or others.
    title : str
        Of the page.

    Returns
    -------
    str
        A whole HTML document.

    Raises
    ------
    MissingExtraError
        If plotly or jinja2 is not installed.
    """
    demos = list(demonstrations)
    learner = named(policy.learner)
    parts = [
        _summary(policy, demos),
        html.section("The demonstrations", _movements(policy, demos)),
        html.section("Predicted and observed actions", _actions(policy, demos)),
        html.section("Errors and support", _errors(policy, demos)),
        html.section("What the data determined", _determined(policy)),
    ]
    if policy.solution_.belief is not None:
        parts.append(html.section("Where the policy is not determined", *unknown(policy, demos)))
    if is_dataclass(learner):
        parts.append(html.settings_table(learner))
    return html.document(title, _lead(policy, demos, type(learner).__name__), *parts)


def _lead(policy: Policy, demos: list[Demonstration], learner: str) -> html.Markup:
    n, d = demos[0].states.shape[1], demos[0].actions.shape[1]
    kind = "Locally linear" if hasattr(policy, "fields_") else "Parametric"
    return html.words("fit_lead", kind=kind, learner=learner, states=n, actions=d)


def _summary(policy: Policy, demos: list[Demonstration]) -> html.Markup:
    solution = policy.solution_
    models, d, p = solution.weights.shape
    shape = f"{models} × {p}" if models > 1 else str(p)
    return html.tiles(
        [
            (str(len(demos)), "demonstrations"),
            (f"{sum(map(len, demos)):,}".replace(",", " "), "samples"),
            (shape, "local models × features" if models > 1 else "features"),
            (f"{solution.determined_share:.0%}", f"of {models * d * p} weight directions determined"),
            (html.number(_or_nan(ninconsistency, policy, demos)), "normalised inconsistency"),
        ]
    )


def _movements(policy: Policy, demos: list[Demonstration]) -> html.Markup:
    n, d = demos[0].states.shape[1], demos[0].actions.shape[1]
    tracks = [_thin(demo) for demo in demos]
    if n >= 3:
        panel = figures.movements(
            [("training", escape(demo.name), demo.states[:, :3]) for demo in tracks],
            labels=("state 1", "state 2", "state 3"),
        )
        rest = f" The other {n - 3} columns are not drawn." if n > 3 else ""
        return html.picture("movements", [panel], f"The first three state columns.{rest} Drag to turn, scroll to zoom.")
    if n == 2 and d == 2:
        return html.picture(
            "movements",
            [_field(policy, tracks)],
            "Grey lines are the demonstrations, green arrows the learnt policy, unconstrained. Arrows are "
            "not to the scale of the axes; those longer than the longest observed action are cut to it.",
            keys=("hybrid", "training"),
            labels={"hybrid": "learnt policy", "training": "demonstrations"},
        )
    panel = figures.vector_field(
        np.zeros((1, 2)),
        {},
        longest=1.0,
        scale=1.0,
        trajectories=[demo.states if n == 2 else np.column_stack([_times(demo), demo.states]) for demo in tracks],
        labels=("state 1", "state 2") if n == 2 else (_time_label(demos[0]), "state 1"),
        equal=n == 2,
    )
    return html.picture("movements", [panel], "All demonstrations.")


def _field(policy: Policy, demos: list[Demonstration]) -> object:
    states, actions, _ = stack(demos)
    low, high = states.min(axis=0), states.max(axis=0)
    points = np.stack(np.meshgrid(*np.linspace(low, high, ARROWS).T), axis=-1).reshape(-1, 2)
    longest = max(float(np.linalg.norm(actions, axis=1).max()), 1e-300)
    return figures.vector_field(
        points,
        {"hybrid": policy(points)},
        longest=longest,
        scale=1.3 * float((high - low).max()) / (ARROWS - 1) / longest,
        trajectories=[demo.states for demo in demos],
        labels=("state 1", "state 2"),
        height=560,
    )


def _actions(policy: Policy, demos: list[Demonstration]) -> html.Markup:
    shown = demos[:MOST_PANELS]
    panels = []
    for demo in map(_thin, shown):
        predicted = policy(demo.states)
        along = project(action_projection(demo.actions), predicted)
        names = [f"action {index + 1}" for index in range(demo.actions.shape[1])]
        series = {"hybrid": predicted, "direct": along, "observed": demo.actions}
        panels.append(
            figures.over_time(
                _times(demo), series, names, title=escape(demo.name), time_label=_time_label(demo), row_height=130
            )
        )
    return html.picture(
        "actions",
        panels,
        html.words("fit_actions", shown=len(shown), every=len(demos)),
        keys=("observed", "hybrid", "direct"),
        labels={"observed": "observed", "hybrid": "learnt policy", "direct": "along the observed motion"},
    )


def _errors(policy: Policy, demos: list[Demonstration]) -> html.Markup:
    known = all(demo.truth is not None for demo in demos)
    support = _support(policy, demos)
    header = ["demonstration", "samples", "norm. inconsistency"]
    header += ["nCPE", "nUPE"] if known else []
    header += ["median support", "least support"] if support is not None else []
    metrics = (ninconsistency, ncpe, nupe) if known else (ninconsistency,)

    def cells(name: str, of: list[Demonstration], near: Array | None) -> list[str]:
        row = [name, str(sum(map(len, of))), *(html.number(_or_nan(metric, policy, of)) for metric in metrics)]
        return row if near is None else [*row, html.number(float(np.median(near))), html.number(float(near.min()))]

    shown = demos[:MOST_ROWS]
    rows = [
        cells(demo.name or f"demonstration {index + 1}", [demo], None if support is None else support[index])
        for index, demo in enumerate(shown)
    ]
    rows.append(cells("all", demos, None if support is None else np.concatenate(support)))
    note = html.words("fit_errors", shown=len(shown), every=len(demos), support=support is not None, truth=known)
    return html.table(header, rows, note=note, rules=(len(shown),))


def _determined(policy: Policy) -> html.Markup:
    solution = policy.solution_
    panels = []
    if solution.eigenvalues is not None:
        title = "eigenvalue, share of the largest"
        panels.append(figures.spectra(solution.eigenvalues, title=title))
    if solution.scores is not None:
        chosen = solution.directions - solution.determined
        panels.append(figures.step_scores(solution.scores, chosen, title="held-out score along the threshold"))
    words = html.words("fit_determined", found=solution)
    return html.picture("determined", panels, words) if panels else html.paragraph(words)


def _support(policy: Policy, demos: list[Demonstration]) -> list[Array] | None:
    try:
        return [policy.support(demo.states) for demo in demos]
    except (SettingError, AttributeError):
        return None


def _or_nan(metric: object, policy: Policy, demos: list[Demonstration]) -> float:
    """An error, or NaN where the motion has no variance to normalise by."""
    try:
        return float(metric(policy, demos))  # type: ignore[operator]
    except InvalidDataError:
        return float("nan")


def _thin(demo: Demonstration) -> Demonstration:
    """Thinned to as many samples as a picture can show."""
    return demo[:: -(-len(demo) // MOST_POINTS)]


def _times(demo: Demonstration) -> Array:
    return demo.times if demo.times is not None else np.arange(len(demo), dtype=np.float64)


def _time_label(demo: Demonstration) -> str:
    return "time (s)" if demo.times is not None else "sample"

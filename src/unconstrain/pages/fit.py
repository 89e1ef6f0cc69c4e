"""The page of a policy that somebody fitted to demonstrations of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arrays import Array
from ..base.display import counted_off, innermost, listening, percent
from ..base.errors import InvalidDataError, SettingError
from ..constraints import Plane
from ..evaluation import diagnosis, metrics, ncpe, nupe, verdicts
from ..learners import named
from ..motion import Guided, rollout
from ..recordings import Demonstration, Recipe, stack
from ..risks import action_projection, project
from . import figures, html
from .diagnosis import unknown
from .replays import GUIDES as GUIDES
from .replays import Replay, bounded
from .replays import guides as guides
from .replays import replayed as replayed
from .replays import retraced as retraced

if TYPE_CHECKING:
    from ..policies import Policy

MOST_PANELS = 4
MOST_ROWS = 30
MOST_POINTS = 300
"""Of one line of a picture."""

ARROWS = 15

FOLDS, MOST_REFITTED = 5, 5000
"""Demonstrations are held out in so many parts, where there are no more samples than the second."""

TILT = 20.0
"""Of the new plane against the recorded motion, degrees."""


def policy_page(
    moving: Policy | Guided,
    demonstrations: Sequence[Demonstration],
    title: str,
    recipe: Recipe | None = None,
    units: Mapping[str, str] | None = None,
    verdict: verdicts.Verdict | None = None,
) -> str:
    """Make the page of a fitted policy.

    Parameters
    ----------
    moving : Policy or Guided
        Fitted.
    demonstrations : sequence of Demonstration
        What it was fitted to, or others.
    title : str
        Of the page.
    recipe : Recipe, optional
        That prepared them: it names the columns, and says whether actions are velocities; by default they are.
    units : mapping of str to str, optional
        Of columns whose unit is known.
    verdict : Verdict, optional
        To begin with, where more is known than the page says.
    """
    policy, demos = innermost(moving), list(demonstrations)
    n, d = demos[0].states.shape[1], demos[0].actions.shape[1]
    made, known = recipe or Recipe(), dict(units or {})
    states, actions = made.labels(known)
    xs = list(states or (f"state {index + 1}" for index in range(n)))
    us = list(actions or (f"action {index + 1}" for index in range(d)))
    learner, held_out = named(policy.learner), _held_out(policy, demos)
    lost = diagnosis.lost_by_guiding(moving, demos)
    more: dict[str, Any] = {"lost": lost, "left_out": policy.solution_.left_out}
    found = verdicts.of_explained(policy.held_out_score(), len(demos), diagnosis.states_told(policy), **more)
    judged = retraced(found, moving, demos, made, None, known)
    parts = [
        *([html.section("Guided", html.paragraph(moving.aim_.promise))] if isinstance(moving, Guided) else []),
        *_replays(judged.runs, judged.in_figures, xs),
        html.section("The demonstrations", _movements(moving, demos, xs)),
        *_reproduced(moving, demos, xs),
        html.section("Predicted and observed actions", _actions(policy, demos, us, held_out)),
        html.section("Errors and support", _errors(policy, demos, held_out)),
    ]
    if policy.solution_.belief is not None:
        parts.append(html.section("What the demonstrations do not tell", *unknown(policy, demos, xs, us)))
    parts += [html.section("Numbers", _summary(demos), _determined(policy))]
    if is_dataclass(learner):
        parts.append(html.settings_table(learner))
    return html.document(title, verdict or judged.verdict, _lead(policy, type(learner).__name__, xs, us), *parts)


def _lead(policy: Policy, learner: str, states: Sequence[str], actions: Sequence[str]) -> html.Markup:
    named = {"model": diagnosis.models_of(policy), "learner": learner}
    return html.words("fit_lead", **named, states=", ".join(states), actions=", ".join(actions))


def _held_out(policy: Policy, demos: list[Demonstration]) -> list[Array] | None:
    """What is predicted of each demonstration while it was held out with others; None where that takes too long."""
    count = min(FOLDS, len(demos))
    if count < 2 or sum(map(len, demos)) > MOST_REFITTED:
        return None
    found, again = [demo.actions for demo in demos], copy(policy)
    if hasattr(again, "fields_"):  # as wide as was chosen
        again.variance = again.variance_
    for fold in counted_off(range(count), "report: learning again, each time without some demonstrations:"):
        rest = [demo for index, demo in enumerate(demos) if index % count != fold]
        with listening(lambda *_: None):  # their own steps would look as if the policy were learnt anew
            learnt = again.fit_demonstrations(rest)
        for index in range(fold, len(demos), count):
            found[index] = learnt(demos[index].states)
    return found


def _worst(demos: list[Demonstration], predicted: list[Array]) -> list[int]:
    """Numbers of demonstrations, that of which predictions explain least first; what hardly moves comes last."""
    usual = float(np.sqrt((stack(demos).actions ** 2).sum(axis=1).mean()))
    missed, motion = np.array([_left([one], at, usual) for one, at in zip(demos, predicted, strict=True)]).T
    return np.argsort(-missed / np.maximum(motion, 0.1 * motion.mean() + 1e-300), kind="stable").tolist()


def _summary(demos: list[Demonstration]) -> html.Markup:
    count = f"{sum(map(len, demos)):,}".replace(",", " ")
    return html.tiles([(str(len(demos)), "demonstrations"), (count, "samples")])


def _movements(policy: Policy | Guided, demos: list[Demonstration], names: Sequence[str]) -> html.Markup:
    n, d = demos[0].states.shape[1], demos[0].actions.shape[1]
    tracks = [_thin(demo) for demo in demos]
    if n == 2 and d == 2:
        return html.picture(
            "movements",
            [_field(policy, tracks, names)],
            "Grey lines are the demonstrations, green arrows the learnt policy, unconstrained. Arrows are "
            "not to the scale of the axes; those longer than the longest observed action are cut to it.",
            keys=("hybrid", "training"),
            labels={"hybrid": "learnt policy", "training": "demonstrations"},
        )
    drawn = _drawn([("training", one) for one in tracks], names)
    return html.picture("movements", [drawn], _which(n, names), labels={"training": "demonstrations"})


def _which(n: int, names: Sequence[str]) -> str:
    rest = f" of {', '.join(names[:3])}; the other {n - 3} columns are not drawn" if n > 3 else ""
    return f"All demonstrations{rest}. 'unconstrain look' turns them and plays them."


def _drawn(tracks: list[tuple[str, Demonstration]], names: Sequence[str]) -> object:
    """Keys and movements over two or three states, or one state over time."""
    if len(names) > 1:
        return _lines([(key, demo.states) for key, demo in tracks], names)
    flat = [(key, np.column_stack([_times(demo), demo.states])) for key, demo in tracks]
    return figures.paths(flat, labels=(_time_label(tracks[0][1]), names[0]), equal=False)


def _lines(tracks: list[tuple[str, Array]], names: Sequence[str]) -> object:
    """Keys and states (T, n) over the first two or three of them."""
    if len(names) > 2:
        return figures.movements([(key, one[:, :3]) for key, one in tracks], labels=(names[0], names[1], names[2]))
    return figures.paths(tracks, labels=(names[0], names[1]))


def _replays(runs: Sequence[Replay], said: str, names: Sequence[str]) -> list[html.Markup]:
    """Roll-outs over the demonstrations that they start with, below their sizes and paces."""
    if not runs:
        return []
    keys = ["hybrid" if one.held else "roll-out, free" for one in runs]
    drawn = [("training", one.done) for one in runs] + [(key, one.run) for key, one in zip(keys, runs, strict=True)]
    shares = {"flat": f"{diagnosis.FLAT:.0%}", "one": f"{diagnosis.ONE:.0%}"}
    caption = html.words("fit_replays", held=keys.count("hybrid"), every=len(runs), **shares)
    shown = [key for key in ("training", "hybrid", "roll-out, free") if key in {name for name, _ in drawn}]
    labels = {"training": "demonstrations", "hybrid": "roll-outs, held alike or free alike"}
    picture = html.picture(
        "replays", [_drawn([(key, _thin(demo)) for key, demo in drawn], names)], caption, keys=shown, labels=labels
    )
    figures_ = [html.paragraph(f"Run from the same starts: {said}.")] if said else []
    return [html.section("From where demonstrations start", *figures_, picture)]


def _reproduced(policy: Policy | Guided, demos: list[Demonstration], names: Sequence[str]) -> list[html.Markup]:
    """A roll-out from where a demonstration starts, free and under a constraint that nobody recorded."""
    demo = max(demos, key=len)
    n, d = demo.states.shape[1], demo.actions.shape[1]
    if n != d or n < 2 or demo.times is None or not np.any(demo.actions):
        return []
    _, axes = np.linalg.eigh(demo.actions.T @ demo.actions)
    tilt = np.radians(TILT)
    normal = np.cos(tilt) * axes[:, 0] + np.sin(tilt) * axes[:, -1]
    step = float(np.median(np.diff(demo.times)))
    drawn, away, (moving, near) = [("observed", _thin(demo).states)], [], bounded(policy, stack(demos).states)
    for key, held in (("roll-out, free", None), ("roll-out, new plane", Plane(normal))):
        run = rollout(moving, demo.states[0], len(demo), step, held, least_support=0.0)
        run = run[near(run.states)]
        [support] = _support(innermost(policy), [run]) or [np.ones(len(run))]
        far = support < verdicts.NEARBY
        away.append(percent(far.mean()) if far.any() else "")
        on = far | np.append(far[1:], False)  # lines of both kinds meet
        parts = (key, far), ("extrapolated", ~on)
        drawn += [(name, np.where(off[:, None], np.nan, run.states)) for name, off in parts if not off.all()]
    start, plane = (",".join(f"{float(f'{one:.4g}'):g}" for one in each) for each in (demo.states[0], normal))
    told = {"name": demo.name, "seconds": f"{np.ptp(demo.times):.3g}", "tilt": f"{TILT:g}", "away": away}
    caption = html.words("fit_rollout", **told, start=start, plane=plane, dt=f"{step:.4g}", steps=len(demo))
    keys = tuple(dict.fromkeys(key for key, _ in drawn))
    return [html.section("A new surface", html.picture("rollout", [_lines(drawn, names)], caption, keys=keys))]


def _field(policy: Policy | Guided, demos: list[Demonstration], names: Sequence[str]) -> object:
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
        labels=(names[0], names[1]),
        height=520,
    )


def _actions(policy: Policy, demos: list[Demonstration], names: Sequence[str], held_out: Any) -> html.Markup:
    order = _worst(demos, held_out or [policy(demo.states) for demo in demos]) if len(demos) > MOST_PANELS else [0]
    shown, panels = [demos[index] for index in order[:MOST_PANELS]] if order[1:] else demos, []
    for demo in map(_thin, shown):
        predicted = policy(demo.states)
        along = project(action_projection(demo.actions), predicted)
        series = {"hybrid": predicted, "direct": along, "observed": demo.actions}
        panels.append(figures.over_time(_times(demo), series, names, title=demo.name, time_label=_time_label(demo)))
    return html.picture(
        "actions",
        panels,
        html.words("fit_actions", shown=len(shown), every=len(demos), held_out=held_out is not None),
        keys=("observed", "hybrid", "direct"),
        labels={"observed": "observed", "hybrid": "learnt policy", "direct": "along the observed motion"},
    )


def _errors(policy: Policy, demos: list[Demonstration], held_out: list[Array] | None) -> html.Markup:
    known = all(demo.truth is not None for demo in demos)
    support, learnt = _support(policy, demos), [policy(demo.states) for demo in demos]
    header = [
        "demonstration",
        "samples",
        *["explained, a\nfifth held out"] * (held_out is not None),
        "explained\nlearnt from",
    ]
    header += ["nCPE", "nUPE"] if known else []
    header += ["median\nsupport", "least\nsupport"] if support is not None else []

    def cells(name: str, rows: Sequence[int]) -> list[str]:
        of = [demos[row] for row in rows]
        row = [name, str(sum(map(len, of)))]
        row += [_share(of, np.concatenate([each[k] for k in rows])) for each in (held_out, learnt) if each is not None]
        row += [html.number(_or_nan(metric, policy, of)) for metric in (ncpe, nupe) if known]
        near = None if support is None else np.concatenate([support[k] for k in rows])
        return row if near is None else [*row, html.number(float(np.median(near))), html.number(float(near.min()))]

    every = range(len(demos))
    shown = every if len(demos) <= MOST_ROWS else sorted(_worst(demos, held_out or learnt)[:MOST_ROWS])
    rows = [cells(demos[index].name or f"demonstration {index + 1}", [index]) for index in shown]
    words = {"support": support is not None, "truth": known, "held_out": held_out is not None, "most": MOST_REFITTED}
    note = html.words("fit_errors", shown=len(shown), every=len(demos), samples=sum(map(len, demos)), **words)
    return html.table(header, [*rows, cells("all", every)], note=note, rules=(len(shown),))


def _left(of: list[Demonstration], predicted: Array, usual: float | None = None) -> tuple[float, float]:
    """What predictions leave unexplained along the motion, and that motion."""
    return metrics.along_motion(lambda _: predicted, of, usual)


def _share(of: list[Demonstration], predicted: Array) -> str:
    missed, motion = _left(of, predicted)
    return "–" if motion == 0.0 else f"{1.0 - missed / motion:.1%}" if missed < 2.0 * motion else "none"


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

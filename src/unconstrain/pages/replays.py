"""What a policy makes of demonstrations from their own starts, beside what was done."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..base.arrays import Array
from ..base.display import innermost, listed, unit_of
from ..base.errors import InvalidDataError, SettingError, UnconstrainError
from ..constraints import kept
from ..evaluation import diagnosis, verdicts
from ..models import spaces
from ..motion import Guided, rollout
from ..recordings import Demonstration, stack
from ..risks import null_space_projection, project

if TYPE_CHECKING:
    from ..policies import Policy
    from ..recordings import Recipe

MOST, STEPS, MOST_NAMED = 20, 1000, 4
"""Demonstrations, and steps of each, that are run at most: seconds; and how many a verdict names."""

GUIDES = {
    "auto": "'unconstrain fit --guided auto' keeps it to the goal or the cycle that was shown, from anywhere.",
    "cycle": "'unconstrain fit --guided cycle', if it is to go round, or 'unconstrain fit --guided GOAL' with the "
    "place of its goal, if it is to end there, keeps it to that, from anywhere.",
    "goal": "'unconstrain fit --guided GOAL' with the place of its goal keeps it there, from anywhere.",
    "": "",
}
"""What is said of each of :func:`guides`."""

MODELS = {"auto": "", "Affine": "So may a --model that bends: 'local', or 'auto', which tries several."}
"""What else may cure a policy of some features, by what they are called; of others :data:`ANOTHER`."""
ANOTHER = "So may another --model, such as cubic; 'auto' tries several."

FARTHER, STRAYS = 3.0, 0.05
"""Guided runs stray if they go so many times as far off as unguided ones, and by this share of the whole extent."""

ROUNDS = 1.5
"""Rounds, at least, that have a pace, and of which the last is compared with the first: a bent reach may make one."""

PASSING = 0.2
"""Nearer to the middle than this share of the usual distance from it, noise turns what goes straight."""

FOLLOWED = 0.1
"""What held is known, or that nothing did, if the policy under it misses less than this share of squared actions."""

BETTER = 0.5
"""Who winds about a surface was held if the policy along it misses less than this share of what it misses free."""

SPANNED = 0.4
"""A plane tells that it held what spreads over it by this share of its longest extent, across that, too: what bends
less lies nearly in some plane, whatever held it."""

AWAY = 10.0
"""Farther from the middle of demonstrations than this many times their extent, a run has no size: it ran away."""

DRIFT = 0.2
"""Recorded actions are velocities of the states if, integrated, they miss their ways by less than this share: noise and
a bias of a fifth of the speed do; another unit, order or sign do not."""


class Replay(NamedTuple):
    """One demonstration and a roll-out from its start, for as long as it lasted."""

    extent: float
    """Of the roll-out, root mean square distance from its middle, over that of the demonstration."""
    pace: float
    """Turns of the roll-out over those of the demonstration; NaN where that made fewer than :data:`ROUNDS`."""
    last: float
    """Size of the last round of the roll-out over its first, over the same of the demonstration; NaN without two."""
    apart: float
    """Mean distance of the states of the roll-out to the nearest of the demonstration, unit of the states."""
    held: bool
    """Whether what held the demonstration is known: given, seen as it is flat, or nothing, as the policy says."""
    done: Demonstration
    run: Demonstration
    away: float | None  # seconds until it goes beyond AWAY, where it ends; None where it stays


class Replayed(NamedTuple):
    """A verdict; of known constraints medians, and seconds until some run "away", or None; all runs; figures, words."""

    verdict: verdicts.Verdict
    medians: dict[str, Any] | None
    runs: Sequence[Replay] = ()
    in_figures: str = ""
    in_words: str = ""


def replayed(
    found: verdicts.Verdict,
    policy: Policy | Guided,
    demos: Sequence[Demonstration],
    recipe: Recipe,
    held: Any,
    units: Mapping[str, str],
    free: bool = True,
    starts: str = "the same starts",
) -> Replayed:
    """Add to a verdict how a policy moves from where demonstrations start, under what held them as far as it is known.

    ``held`` is their constraint, or None; ``units`` are those of columns. Those whose constraint is not known are run
    ``free``, or not at all. ``starts`` are those of which demonstrations, in words.
    """
    runs = replays(policy, demos, recipe, held, free)
    known = [one for one in runs if one.held]
    if not known:
        why = "not compared, as what held these recordings is not known" if runs else unlike(demos, recipe)
        why = why and f" Its size and pace over time: {why}."
        return Replayed(found._replace(doubt=(found.doubt + why).strip()), None, runs)
    gone = {one.done.name: one.away for one in known if one.away is not None}
    extents, paces, lasts, apart = np.array([one[:4] for one in known if one.away is None]).reshape(-1, 4).T
    said = f"{np.median(apart) if len(apart) else 0.0:.3g} {unit_of(recipe.labels(units)[0]) or '(unit of the states)'}"
    measured = {"extent": extents, "pace": paces, "last_round": lasts, "apart": apart}
    finite = {name: values[np.isfinite(values)] for name, values in measured.items()}
    told = {name: float(np.median(values)) if len(values) else None for name, values in finite.items()}
    alike = "" if held is not None else " that look flat (on a line, in a plane), round or free"
    ratios, names = (extents, paces, lasts), [one.done.name for one in known if one.away is None]
    (words, strays), of = verdicts.moves(*ratios, names), "of those that stay, " * bool(gone)
    if gone:
        named = listed([f"'{name}' (after {seconds:.2g} s)" for name, seconds in gone.items()], 4)
        away = f"it runs away, to more than {AWAY:g} times the extent of what was recorded, from {named}"
        words, strays = f"{away}{f'; else {words}' * bool(words)}", ["way", *strays]
    if len(known) < len(demos):
        some = f"{len(known)} of {len(demos)} demonstrations"
        why = "; what held the others, if anything, they do not tell well enough" * (held is None and len(runs) < MOST)
        words, of = f"{words}, as far as compared ({some}{why})", f"for {some}{alike}, {of}"
    short, long = _held_on(policy, known, demos, recipe) if held is None else ("", "")
    figures = verdicts.size_and_pace(*ratios, of=of, apart=said, names=names)
    figures += long * bool(figures)
    judged = _advised(verdicts.of_replays(found, words and words + short, strays, starts), found, policy, demos)
    return Replayed(judged, told | {"away": gone}, runs, figures, words)


def _held_on(policy: Any, runs: Sequence[Replay], demos: Sequence[Demonstration], recipe: Recipe) -> Sequence[str]:
    """Where runs that turn in no plane were held, so may have been free, and with names; empty if free ones do so."""
    n, far = demos[0].states.shape[1], STRAYS * float(np.linalg.norm(np.ptp(stack(demos).states, axis=0)))
    short = [(one.done, diagnosis.flat(one.done.states)[0].any(axis=1).sum()) for one in runs if one.pace != one.pace]
    held = [one for one, tied in short if tied]
    free = replays(policy, held, recipe, partial(_same, np.zeros((n, n)))) if held else []
    if not (off := sorted((away, one.done.name) for one in free if (away := _farthest(one)) > far)):
        return "", ""
    kinds = [({1: "line", 2: "plane"}.get(n - tied, "flat"), repr(one.name)) for one, tied in short if tied]
    names = {kind: [name for each, name in kinds if each == kind] for kind, _ in kinds}
    most = sorted(names, key=lambda kind: -len(names[kind]))
    few, every = (" or ".join(f"{kind} ({how(names[kind])})" for kind in most) for how in (len, listed))
    few, looks = every if len(held) <= MOST_NAMED else few, dict[str, str | None]()
    with suppress(UnconstrainError):  # where recordings are others than it was learnt from nothing is known
        looks = {one.name: one.looks for one in diagnosis.diagnose(innermost(policy), demos).movements}
    said = [": all that would go elsewhere if run free look held"] * 2
    if open_ := [repr(name) for _, name in off[::-1] if looks.get(name) != "constrained"]:
        if_free = f"{'they were free strokes' if open_[1:] else 'it was a free stroke'}, which recordings do not tell"
        then = f" would go elsewhere if run free, so the policy is wrong there if {if_free}"
        said = [f"; {listed(open_, most)}{then}" for most in (3, 30)]
    return [f"; each held to the {kind} that it lies in{one}" for kind, one in zip((few, every), said, strict=True)]


def _farthest(one: Replay) -> float:
    return float(cKDTree(one.done.states).query(one.run.states)[0].max())


def retraced(found: verdicts.Verdict, policy: Policy | Guided, *of: Any) -> Replayed:
    """:func:`replayed` on what was learnt from: a guided policy, fitted to that, is judged no better than by itself."""
    guided, alone = replayed(found, policy, *of), innermost(policy)
    if alone is policy:
        return guided
    plain = replayed(found, alone, *of)
    plain = plain._replace(**{name: getattr(plain, name).partition("; each held")[0] for name in plain._fields[3:]})
    order = [*verdicts.Mark].index
    judged = max(guided.verdict, plain.verdict, key=lambda one: order(one.mark))  # the first, where both are as good
    if judged is plain.verdict and guided.in_words:
        judged = judged._replace(said=f"{found.said} Run from the same starts, {guided.in_words}.")
    but = "But unguided" if judged.mark is not guided.verdict.mark else "Unguided"
    more = f" {but}, {plain.in_words}." if plain.in_words else ""
    worse = order(guided.verdict.mark) > order(plain.verdict.mark)
    then = verdicts.UNGUIDED if worse else judged.next.partition(" 'unconstrain fit --guided")[0]  # it is
    judged = judged._replace(said=judged.said + more, next=then)
    if strays := _strays(guided.runs, plain.runs, *of):
        guided = guided._replace(in_words=f"{strays}{f'; else {guided.in_words}' * bool(guided.in_words)}")
        swing = " Where demonstrations swing in to the cycle, leave that out (--trim 1,0: of each the first second)."
        then = verdicts.UNGUIDED + swing * hasattr(policy.aim_, "turn")
        judged = verdicts.doubted(judged, f"guided, {strays}")._replace(next=then)
    both = ["; unguided ".join(filter(None, one)) for one in zip(guided[3:], plain[3:], strict=True)]
    return Replayed(judged, *guided[1:3], *both)


def _strays(guided: Any, plain: Any, demos: Any, recipe: Recipe, _: Any, units: Mapping[str, str], *__: Any) -> str:
    """How far guided runs go from recorded paths, the rest of a sentence; empty where unguided ones do nearly so."""
    most = max((_farthest(one) for one in guided if one.held), default=0.0)
    least = max((_farthest(one) for one in plain if one.held), default=np.inf)
    if most <= max(FARTHER * least, STRAYS * float(np.linalg.norm(np.ptp(stack(demos).states, axis=0)))):
        return ""
    unit = unit_of(recipe.labels(units)[0]) or "(unit of the states)"
    return f"it strays up to {most:.3g} {unit} from the recorded paths, unguided {least:.3g} at most"


def _advised(judged: verdicts.Verdict, before: verdicts.Verdict, policy: Any, demos: Any) -> verdicts.Verdict:
    """With what cures a policy that strays, unless it was tried."""
    if judged.next == before.next:
        return judged
    features = getattr(innermost(policy), "features", None)
    model = MODELS.get(features if isinstance(features, str) else type(features).__name__, ANOTHER)
    to = GUIDES[guides(policy, demos)] if innermost(policy) is policy else ""
    more = judged.next, model, _seem_free(innermost(policy), demos), to
    return judged._replace(next=" ".join(filter(None, more)))


def _seem_free(policy: Any, demos: Sequence[Demonstration]) -> str:
    """What to try where a few demonstrations look free among others that were held: a curved wall looks so, too."""
    belief, ends = getattr(getattr(policy, "solution_", None), "belief", None), np.cumsum([len(one) for one in demos])
    parts = np.split(belief.free, ends[:-1]) if belief is not None and len(belief.free) == ends[-1] else []
    learnt = getattr(getattr(getattr(policy, "training_", None), "split", None), "fold_of", {})
    if learnt and {one.name for one in demos} != {str(one).partition("/")[2] or str(one) for one in learnt}:
        return ""  # these are others
    names = [one.name for one, free in zip(demos, parts, strict=False) if free.mean() > diagnosis.FREE]
    if not 0 < 2 * len(names) < len(demos):
        return ""
    look, them = ("looks", "it") if len(names) == 1 else ("look", "them")
    looks = f"{listed([*map(repr, names)], 4)} {look} free, as what a curved wall held may, and then misleads"
    return f"{looks}: compare without {them} (--leave-out {shlex.quote(','.join(names))})."


def guides(policy: Policy | Guided, demos: Sequence[Demonstration]) -> str:
    """What ``--guided`` takes: auto, as demonstrations show goal or cycle; cycle; goal, to be given; or nothing."""
    n = demos[0].states.shape[1]
    if demos[0].space != spaces.Euclidean(n) or demos[0].actions.shape[1] != n:
        return ""
    with warnings.catch_warnings(action="always", record=True) as doubts:
        try:
            Guided.goes_round(demos, policy=policy)
        except (SettingError, InvalidDataError) as error:
            with suppress(SettingError, InvalidDataError):
                if "orbit=" in str(error):
                    Guided(policy, orbit="shown", demonstrations=demos)
                    return "cycle"
            return "goal"
    return "goal" if any(str(one.message).startswith("goal: ") for one in doubts) else "auto"


def replays(
    policy: Policy | Guided, demos: Sequence[Demonstration], recipe: Recipe, held: Any = None, free: bool = True
) -> list[Replay]:
    """Compare at most twenty demonstrations; none where :func:`unlike` says why not."""
    chosen = [] if unlike(demos, recipe) else _moving(demos)
    if not free and held is None:
        chosen = [one for one in chosen if _way(policy, one, _shape(policy, one))[1]]
    if not chosen:
        return []
    chosen = [chosen[k] for k in np.linspace(0, len(chosen) - 1, min(len(chosen), MOST)).astype(int)]
    clocks = [np.asarray(one.times, np.float64) for one in chosen]
    lasted = [float(times[-1] - times[0]) for times in clocks]
    dt = max(float(np.median(np.diff(clocks[0]))), max(lasted) / STEPS)
    shapes = [_shape(policy, one) for one in chosen]
    task = held.target if getattr(held, "task", False) else None
    starts, steps = np.array([one.states[0] for one in chosen]), round(max(lasted) / dt) + 1
    own, known = held, [True] * len(chosen)
    if held is None:
        ways = [_way(policy, *each) for each in zip(chosen, shapes, strict=True)]
        own, known = [way for way, _ in ways], [how for _, how in ways]
    moving, near = bounded(policy, stack(demos).states)
    runs = rollout(moving, starts, steps, dt, own, task=task, least_support=0.0)
    cut = [run[: round(seconds / dt) + 1] for run, seconds in zip(runs, lasted, strict=True)]
    every = zip(chosen, cut, shapes, known, strict=True)
    return [_compared(one, run, along, how, near(run.states)) for one, run, (_, along), how in every]


def _shape(policy: Any, demo: Demonstration) -> tuple[Array, Array]:
    """:func:`diagnosis.flat`, to a hundredth where a demonstration moves as the policy does freely."""
    freely = _followed(demo, policy(demo.states))
    return diagnosis.flat(demo.states, 0.1 * diagnosis.FLAT if freely else diagnosis.FLAT)


def _way(policy: Any, demo: Demonstration, shape: tuple[Array, Array]) -> tuple[Any, bool]:
    """What its run is held to, a surface about which it winds, plane or line, and whether it tells that it was."""
    surface = kept(demo.states, wound=True) if demo.states.shape[1] == 3 else None
    if surface is not None:
        freely = policy(demo.states)
        along = project(null_space_projection(surface.rows(demo.states)), freely)
        if _missed(demo, along) < BETTER * _missed(demo, freely):
            return partial(_on, surface), True
    known = _told(policy, demo)
    return partial(_same, shape[0] * known), known


def _on(surface: Any, states: Array, times: Array) -> Array:
    """Its rows, and zeros, so that there are as many as for others."""
    rows = surface(states, times)
    return np.pad(rows, ((0, 0), (0, rows.shape[2] - rows.shape[1]), (0, 0)))


def _followed(demo: Demonstration, actions: Array) -> bool:
    """Whether a demonstration moved as these actions say."""
    return _missed(demo, actions) < FOLLOWED


def _missed(demo: Demonstration, actions: Array) -> float:
    """Share of a demonstration's squared actions by which these are off."""
    return float(((demo.actions - actions) ** 2).sum() / max(float((demo.actions**2).sum()), 1e-300))


def _told(policy: Any, demo: Demonstration) -> bool:
    """Whether a demonstration tells what held it: it is straight, spans a plane, or is as the policy says."""
    rows, across, bent = (diagnosis.flat(demo.states, share)[0] for share in (diagnosis.FLAT, diagnosis.ONE, SPANNED))
    actions = policy(demo.states)
    followed = _followed(demo, actions - actions @ rows.T @ rows)
    return bool(followed or (across.any() and (across == bent).all()))


def bounded(policy: Any, states: Array) -> tuple[Any, Callable[[Array], NDArray[np.bool_]]]:
    """A policy that rests beyond :data:`AWAY` of states (N, n), and whether states (T, n) are nearer, (T,)."""
    low, high = states.min(axis=0), states.max(axis=0)

    def near(at: Array) -> NDArray[np.bool_]:
        return np.asarray(np.linalg.norm(at - 0.5 * (low + high), axis=1) <= AWAY * np.linalg.norm(high - low))

    def moving(at: Array, *under: Array) -> Array:
        inside, own = near(at)[:, None], policy.under if under else policy
        return np.where(inside, own(np.where(inside, at, 0.5 * (low + high)), *under), 0.0)

    moving.under = moving if hasattr(policy, "under") else None  # type: ignore[attr-defined]
    return moving, near


def unlike(demos: Sequence[Demonstration], recipe: Recipe) -> str:
    """Why a policy cannot be run from the starts of demonstrations, the rest of a sentence; empty where it can."""
    n, d, chosen = demos[0].states.shape[1], demos[0].actions.shape[1], _moving(demos)
    if demos[0].space != spaces.Euclidean(n):
        why = "states hold angles or orientations"
    elif n != d:
        why = f"{d} actions are not the velocities of {n} states"
    elif not chosen:
        why = "nothing tells the time of what moves"
    elif recipe.actions is not None and _strayed(chosen) > DRIFT:
        why = "the actions are not the velocities of the states, as far as these tell"
    else:
        return ""
    return f"not run from the same starts, as {why}"


def _moving(demos: Sequence[Demonstration]) -> list[Demonstration]:
    return [one for one in demos if one.times is not None and len(one) > 2 and np.ptp(one.states, axis=0).any()]


def _strayed(demos: Sequence[Demonstration]) -> float:
    """How much recorded actions, integrated over tenths of demonstrations, miss the ways of the states, as a share."""
    missed, moved = 0.0, 0.0
    for one in demos:
        over = min(max(len(one) // 10, 4), len(one) - 1)
        steps = 0.5 * np.diff(np.asarray(one.times))[:, None] * (one.actions[1:] + one.actions[:-1])
        path = np.vstack([np.zeros(one.actions.shape[1]), steps.cumsum(axis=0)])
        ways, led = (each[over:] - each[:-over] for each in (one.states, path))
        missed, moved = missed + float(((ways - led) ** 2).sum()), moved + float((ways**2).sum())
    return float(np.sqrt(missed / (moved or 1.0)))


def _same(rows: Array, states: Array, _times: Array) -> Array:
    """A constraint of the same rows everywhere."""
    return np.broadcast_to(rows, (len(states), *rows.shape))


def _compared(done: Demonstration, run: Demonstration, plane: Array, held: bool, near: NDArray[np.bool_]) -> Replay:
    """As seen along two directions in rows, (2, n); it ends where it is not ``near``."""
    away, run = None if near.all() else float(np.asarray(run.times)[near.argmin()]), run[near]
    both = done.states, run.states
    size = [float(np.sqrt(one.var(axis=0).sum())) for one in both]
    turns = [_turns((one - one.mean(axis=0)) @ plane.T) for one in both]
    pace = turns[1][-1] / turns[0][-1] if abs(turns[0][-1]) >= ROUNDS else np.nan
    lasting = [_lasting(one, done) for one, done in zip(both, turns, strict=True)]
    apart = cKDTree(done.states).query(run.states)[0].mean()
    return Replay(size[1] / size[0], float(pace), lasting[1] / lasting[0], float(apart), held, done, run, away)


def _turns(points: Array) -> Array:
    """How often points (T, 2) have gone round the origin, (T,); what is nearer than :data:`PASSING` turns nothing."""
    if points.shape[1] < 2:
        return np.zeros(len(points))
    away = np.linalg.norm(points, axis=1)
    far = np.flatnonzero(away >= PASSING * np.sqrt((away**2).mean()))
    angles = np.unwrap(np.arctan2(*points[far, ::-1].T))
    return np.interp(np.arange(len(points)), far, (angles - angles[0]) / (2 * np.pi))


def _lasting(states: Array, turns: Array) -> float:
    """Size of the last round over that of the first; NaN where there are too few."""
    if abs(turns[-1]) < ROUNDS:
        return np.nan
    first, last = states[np.abs(turns) <= 1], states[np.abs(turns[-1] - turns) <= 1]
    return float(np.sqrt(last.var(axis=0).sum() / first.var(axis=0).sum()))

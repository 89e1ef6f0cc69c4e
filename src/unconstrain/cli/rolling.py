"""``unconstrain rollout``: a policy in motion, as far as demonstrations support it."""

from __future__ import annotations

import csv
import io
import json
import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import click

import unconstrain as uc

from ..base.display import counted, innermost, unit_of
from ..base.errors import DivergedError, InvalidDataError, SettingError, SupportEndsWarning
from ..base.files import write
from .constraining import hand_of, held_of, options_for_held
from .informing import TOLD, WHERE, doubted
from .printing import doubt_degrees, of_option, option_for_json, say_verdict, say_written, show_warning
from .reading import fitted_policy, numbers, of_words, to_copy
from .scoring import support_of
from .speaking import as_typed
from .writing import check_outputs, option_for_force


@click.command(epilog="\b\nExample:\n  unconstrain rollout wipe.npz --start 0.1,0,0 --plane 0,0.3,1 -o path.csv")
@click.argument("policy", type=click.Path())
@click.option("--start", type=numbers, required=True, help="Initial state, one number for each state column.")
@click.option("--steps", type=click.IntRange(1), default=200, help="Number of samples.")
@click.option("--dt", type=float, default=0.02, help="Seconds between samples.")
@options_for_held("to stay on")
@click.option(
    "--obstacle",
    "obstacles",
    type=numbers,
    multiple=True,
    help="Centre of a ball to go round, and its radius; or of an ellipsoid, and its radii. More than once for several.",
)
@of_words(
    "--method", "euler rk4 adaptive", "How: Runge-Kutta by default, or by euler as the loop of a controller does."
)
@click.option(
    "--order",
    type=click.IntRange(1, 2),
    default=1,
    help="2 where states are positions, then velocities, and actions accelerations.",
)
@click.option(
    "--least-support",
    type=click.FloatRange(0.0, 1.0),
    default=lambda: uc.models.SUPPORTED,
    show_default="0.001",
    help="Stop where demonstrations support less, 1 near and 0 far from them; 0 goes on.",
)
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False, allow_dash=True), default="-", help="CSV file; - prints."
)
@option_for_force
@option_for_json
def rollout(
    policy: str,
    start: tuple[float, ...],
    plane: tuple[float, ...] | None,
    constraint: str | None,
    obstacles: tuple[tuple[float, ...], ...],
    output: str,
    force: bool,
    as_json: bool,
    **how: Any,
) -> None:
    """Roll POLICY out, freely or under a constraint, to a CSV.

    It stops where demonstrations no longer support it (--least-support); a start there is refused, unless the policy is
    guided. Where "no demonstration passes near" is not as far: farther than nearly all recorded states, but followed.
    """
    check_outputs(() if output == "-" else (output,), (policy, constraint, how["jacobian"]), force)
    moving, notes = fitted_policy(policy), uc.storage.load_notes(policy)
    learnt, recipe = innermost(moving), uc.Recipe.from_dict(notes.get("recipe", {}))
    _check_start(moving, recipe, start, how["least_support"])
    places = learnt.n_outputs_ if how["order"] == 2 else len(start)  # what a constraint is a function of
    at = replace(recipe, states=recipe.states and recipe.states[:places])
    arm = hand_of(how.pop("jacobian"), how.pop("tip"))
    held = held_of(plane, constraint, arm, at, [start[:places]], learnt.n_outputs_)
    task = held.target if isinstance(held, uc.LearntConstraint) and held.task else None
    round_ = [_obstacle(given, len(start)) for given in obstacles]
    path, why, trouble = _as_far_as_it_goes(moving, list(start), constraint=held, task=task, obstacles=round_, **how)
    named = recipe if recipe.states else uc.Recipe(tuple(f"x{i + 1}" for i in range(len(start))))
    kept = f"the plane{' that its hand keeps to' * bool(arm)}" if plane is not None else getattr(held, "title", "")
    by = (kept, *_off_held(held, constraint, start, path))
    verdict = to_copy(_supported(moving, path, why, round_, by, notes), policy, notes)
    accelerations = named.actions or tuple(f"a{name}" for name in (named.states or ())[:places])
    columns = ["t", *sum(replace(named, actions=accelerations if how["order"] == 2 else None).labels({}), ())]
    if output != "-":
        write(output, _csv(columns, path))
    elif not as_json:
        click.echo(_csv(columns, path), nl=False)
    if as_json:
        rows = None if output != "-" else _rows(path).tolist()
        click.echo(json.dumps({"columns": columns, "rows": rows, "output": output, "verdict": verdict.to_json()}))
    elif trouble is None:
        say_verdict(verdict, err=output == "-")
    if trouble is not None:
        raise trouble
    if output != "-" and not as_json:
        say_written({"movement": output}, None)


def _obstacle(given: tuple[float, ...], n: int) -> uc.motion.obstacles.Ellipsoid:
    import numpy as np

    if len(given) not in {n + 1, 2 * n}:
        said = f"--obstacle: got {len(given)} numbers, expected {n} of a centre, then a radius or {n} radii."
        raise SettingError(said)
    with of_option("--obstacle"):
        return uc.motion.obstacles.Ellipsoid(np.array(given[:n]), given[n:] if len(given) > n + 1 else given[n])


def _check_start(policy: uc.Policy | uc.Guided, recipe: uc.Recipe, start: tuple[float, ...], least: float) -> None:
    """Note angles that look like degrees; refuse to begin where nothing was demonstrated, unless it is guided."""
    if len(start) != (count := innermost(policy).n_features_in_):
        raise SettingError(f"--start: got {len(start)} numbers, expected {count}, one for each state.")
    doubt_degrees("--start", start, recipe)
    if innermost(policy) is not policy:
        return
    support = float(support_of(policy, [start])[0])
    if support < least:
        raise InvalidDataError(
            f"--start: nothing was demonstrated near {', '.join(f'{one:.4g}' for one in start)} (support "
            f"{support:.2g}). Start nearer, demonstrate there, or go on in spite of it with --least-support 0."
        )


def _as_far_as_it_goes(policy: uc.Policy, start: list[float], **how: Any) -> tuple[Any, str, DivergedError | None]:
    """A movement; why it stops early, or nothing; and what went wrong, where it is only the part before."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            path = uc.rollout(policy, start, **{name: given for name, given in how.items() if given is not None})
        except DivergedError as error:
            if error.part is None:
                raise
            return error.part, "", error
    for one in said:
        if one.category is not SupportEndsWarning:
            show_warning(one.message)
    return path, as_typed(" ".join(str(one.message) for one in said if one.category is SupportEndsWarning)), None


def _supported(
    moving: uc.Policy | uc.Guided, path: Any, why: str, obstacles: Sequence[Any], by: Sequence[str], notes: Any
) -> uc.evaluation.verdicts.Verdict:
    """How near data is along a movement, whether it tells the policy, ``by`` what it was held, what ``fit`` doubted."""
    verdicts, policy, told, (held, *off) = uc.evaluation.verdicts, innermost(moving), notes.get(TOLD) or 0.0, by
    untold = None if told >= verdicts.MOSTLY else uc.evaluation.diagnosis.untold(policy, path)
    found = verdicts.of_support(support_of(policy, path.states), path.times, untold)
    found = verdicts.of_early_end(found, why) if why else found
    unit = unit_of(uc.Recipe.from_dict(notes.get("recipe", {})).labels(notes.get("units", {}))[0])
    passes = f" {held[:1].upper()}{held[1:]} passes through the start." * bool(held and not off)
    passes += _off_goal(moving, path, held, unit or "(unit of the states)")
    found = found._replace(said=f"{found.said}{passes}")
    found = verdicts.doubted(found, off[0])._replace(next=off[1]) if off else found
    found = verdicts.of_fit(found, doubted(moving, notes))
    if not obstacles:
        return found
    nearest = min((float(one(path.states)[0].min()), number) for number, one in enumerate(obstacles, start=1))
    clear = f"It keeps clear of {counted(len(obstacles), 'obstacle')}, at the nearest of number {nearest[1]} by "
    return found._replace(said=f"{found.said} {clear}{nearest[0]:.0%} of its radius.")


def _off_held(held: Any, file: Any, start: Sequence[float], path: Any, near: float = 0.01) -> Sequence[str]:
    """That a start is off the mechanism that holds it, beyond ``near`` of how far that was recorded, and the cure."""
    import numpy as np

    if file is None or not isinstance(held, uc.constraints.mechanisms.Mechanism) or held.form.ties:
        return ()
    notes, places, group = uc.storage.load_notes(file), len(held.centre), np.zeros(1, dtype=np.intp)
    at = first = np.array([start[:places]])
    for _ in range(3):  # a thread bends on the way
        rows, track = held.rows(at), uc.constraints.mechanisms.track.Track(at, group, np.empty((1, 0)))
        at = at - np.einsum("nk,nkd->nd", held.residuals(track), rows)
    far, wide = np.linalg.norm(at - first), np.ptp(notes.get(WHERE) or path.states[:, :places], axis=0)
    if far <= near * np.linalg.norm(wide):
        return ()
    said = f"the start is {far:.3g} {held.unit or '(unit of the states)'} off the {held.title[2:]} of {file}"
    onto = ",".join(f"{one:.6g}" for one in (*at[0], *start[places:]))
    return f"{said}, and the run stays so, parallel to it", f"Start on it, at the nearest place:\n--start {onto}"


def _off_goal(moving: Any, path: uc.Demonstration, held: str, unit: str, near: float = 0.02) -> str:
    """A sentence on where off its goal a guided movement ends, by more than ``near`` of how far it was, and why."""
    if not isinstance(getattr(moving, "aim_", None), uc.motion.descent.Descent):
        return ""
    far, speeds = ((each**2).sum(axis=1) ** 0.5 for each in (path.states - moving.goal_, path.actions))
    back = 1 + len(far) // 20
    shrinks = math.log(max(far[-1 - back], 1e-300) / max(far[-1], 1e-300)) / back if len(far) > back else 0.0
    more = math.log(max(far[-1] / (near * far.max() or 1.0), 1.0)) / max(shrinks, 1e-300)
    rests = (slow := speeds[-1] <= near * speeds.max()) and more > 10 * len(far)  # it comes no nearer
    slows = f"it slows down towards it; about {math.ceil(min(more, 1e9))} more --steps bring it within {near:.0%}"
    why = "it rests there" if rests else slows if slow else "it is still on its way (--steps)"
    why += f", {'as' if rests else 'and may come to rest where'} {held} holds it off" if held else ""
    return f" It ends {far[-1]:.3g} {unit} from the goal: {why}." if far[-1] > near * far.max() else ""


def _csv(header: Sequence[str], path: uc.Demonstration) -> str:
    text = io.StringIO()
    rows = ([f"{value:.9g}" for value in row] for row in _rows(path))
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    return text.getvalue()


def _rows(path: uc.Demonstration) -> Any:
    import numpy as np

    return np.column_stack([*([] if path.times is None else [path.times]), path.states, path.actions])

"""The command line: parse, call, print."""

from __future__ import annotations

import csv
import io
import json
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Literal

import click

import unconstrain as uc

from ..base.display import counted, innermost
from ..base.errors import (
    NOTHING_LEFT,
    DivergedError,
    InvalidDataError,
    ReadError,
    SettingError,
    SupportEndsWarning,
    UnconstrainError,
)
from ..base.files import write
from ..paper import experiments
from .certifying import certify
from .constraining import constraint, held_of, options_for_held
from .converting import convert, example
from .diagnosing import diagnose
from .exporting import export
from .fitting import alpha_of, default_learner, guide_of, guided, learn, learner_of, options_for_model, policy_of
from .informing import MARK, RAN, TOLD, info, learnt_from, provenance
from .looking import look, play
from .printing import (
    OTHER_UNITS,
    Group,
    Judged,
    explained,
    judge_fit,
    keep_codes,
    of_option,
    option_for_json,
    print_table,
    refuse_warnings,
    say_fit,
    say_surveys,
    say_verdict,
    say_written,
    show_warning,
)
from .progress import shown
from .reading import (
    fitted_policy,
    left_in,
    likely_states,
    next_command,
    numbers,
    of_files,
    options_for_reading,
    prepared,
    reading_of,
    recipe_of,
    recordings_of,
    said_recipe,
    stream_of,
)
from .speaking import as_typed
from .writing import check_name, check_outputs, option_for_force

LEARNERS = ("robust", "hybrid", "inconsistency", "direct")

SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100, "show_default": True}


@click.group(cls=Group, context_settings=SETTINGS)
@click.version_option(package_name="unconstrain")
def main() -> None:
    """Learn the policy behind movements that were recorded under unknown, changing constraints.

    \b
    unconstrain play                              draw, and see what this is about
    unconstrain demo                              wash a car, with a report
    unconstrain example wiping                    recordings to begin with
    unconstrain inspect *.csv                     what is in your recordings
    unconstrain look *.csv                        see them, in space and in time
    unconstrain diagnose *.csv                    noise, and what to record next
    unconstrain fit *.csv -o policy.npz           learn from them
    unconstrain score policy.npz new.csv          how good that is on others
    unconstrain rollout policy.npz --start 0.1,0  move as was learnt
    unconstrain export policy.npz -o policy.c     take it to a robot
    unconstrain constraint *.csv -o held.npz      learn what held them
    unconstrain info policy.npz                   what it is, and of what

    Completion by the tab key, here for bash (or zsh, fish):

    \b
    eval "$(_UNCONSTRAIN_COMPLETE=bash_source unconstrain)"
    """  # noqa: D301 - click's mark for lines that stay as they are


@main.command(epilog="\b\nExample:\n  unconstrain inspect wipe_*.csv --state x,y,z")
@options_for_reading
@option_for_json
def inspect(files: Sequence[str], as_json: bool, **reading: Any) -> None:
    """Describe each FILE: columns, rate, gaps, zero actions."""
    recipe, first = recipe_of(**reading), list[uc.Recording]()

    def recordings() -> Iterator[uc.Recording]:
        paths, how = uc.readers.expand(files), reading_of(**reading)
        every = (one for path in paths for one in uc.readers.read_blocks(path, how, whole=True))
        for recording in left_in(every, reading["leave_out"]):
            first[:] = first or [recording]
            yield recording

    with shown("reading"):
        surveys = uc.preparation.survey_set(recordings(), recipe)
    if not first:
        raise ReadError(NOTHING_LEFT)
    own = [found.name for found in surveys]
    units = {found.name for found in surveys if OTHER_UNITS & {one.code for one in found.warnings}}
    differ = [name for name in own if name in units and own.count(name) == 1] if len(units) < len({*own}) else []
    names = uc.readers.unique_names(own)
    surveys = [replace(found, name=name) for found, name in zip(surveys, names, strict=True)]
    keep_codes(remark.code for found in surveys for remark in found.warnings)
    if as_json:
        plain = [
            asdict(found)
            | {
                kind: [one._replace(message=as_typed(one.message))._asdict() for one in getattr(found, kind)]
                for kind in ("warnings", "notes")
            }
            for found in surveys
        ]
        click.echo(json.dumps(plain, indent=2))
    else:
        used, needed, lacking = _used(recipe, first[0], surveys)
        left_out = [*reading["leave_out"], *dict.fromkeys([*differ, *lacking])] if differ or lacking else []
        say_surveys(surveys, needed, _to_fit(recipe, first[0], bool(needed and not lacking), left_out))
        click.echo(used, nl=False)
    refuse_warnings(reading["strict"])


def _used(recipe: uc.Recipe, first: uc.Recording, surveys: Sequence[Any]) -> tuple[str, str, list[str]]:
    """What ``fit`` uses, a line; what it has to know, a sentence; and the recordings that lack a column of it."""
    try:
        decided = uc.preparation.decide(recipe, first)[0]
    except UnconstrainError as error:
        return "", as_typed(str(error)), []
    wanted = [*(decided.states or ()), *(decided.actions or ())]
    lacking = {one.name: sorted({*wanted} - {*one.columns}, key=wanted.index) for one in surveys}
    without = [name for name, missing in lacking.items() if missing]
    needed = ""
    if without:
        has = next(one.columns for one in surveys if one.name == without[0])
        needed = f"'{without[0]}' has no column {', '.join(lacking[without[0]])}; it has {', '.join(has)}."
    return f"fit uses {said_recipe(decided, first)}.\n", needed, without


def _to_fit(recipe: uc.Recipe, first: uc.Recording, guess: bool, left_out: Sequence[str]) -> str:
    """The command that comes next; with what may be meant, where columns are not named or not there."""
    states, actions = (not guess or _are_there(names, first) for names in (recipe.states, recipe.actions))
    more = [] if states else ["--state", ",".join(likely_states(first.columns))]
    more += [] if actions or recipe.differentiate else ["--differentiate"]
    more += ["--leave-out", ",".join(left_out)] if left_out else []
    wrong = [name for name, right in (("state", states), ("action", actions), ("leave_out", not left_out)) if not right]
    return next_command("fit", *more, "-o", "policy.npz", without=wrong)


def _are_there(names: Sequence[str] | None, recording: uc.Recording) -> bool:
    with suppress(UnconstrainError):
        return names is not None and recording.select(recording.resolve(names)) is not None
    return False


@main.command(epilog="\b\nExample:\n  unconstrain fit wipe_*.csv --state x,y,z --differentiate -o wipe.npz")
@options_for_reading
@click.option("-o", "--output", required=True, type=click.Path(dir_okay=False), help="File for the policy (.npz).")
@options_for_model
@click.option("--learner", type=click.Choice(LEARNERS), help="Learner; by default robust.")
@click.option(
    "--alpha",
    type=alpha_of,
    metavar="FLOAT|AUTO",
    help="Hybrid: weight of the standard risk in choosing the threshold, 0.1 by default; auto softens in its place.",
)
@click.option(
    "--softness",
    type=float,
    help="Hybrid: soften the split between what is consistent and what is near, such as 0.1; for noisy recordings.",
)
@click.option(
    "--speed-power",
    type=float,
    default=0.0,
    help="Weight samples by this power of their speed; 2 for noisy recordings.",
)
@click.option("--folds", type=click.IntRange(2), default=10, help="Folds to choose the threshold on.")
@click.option(
    "--hold-out",
    type=click.Choice(["auto", "demonstration", "sample"]),
    default="auto",
    help="What a fold holds out together; auto: demonstrations, or samples of a single one.",
)
@click.option(
    "--guided",
    "to",
    type=guide_of,
    metavar="AUTO|CYCLE|A,B,...",
    help="Keep it to a goal, its states here, or to the cycle, from anywhere; auto takes what was shown.",
)
@click.option("--report", type=click.Path(dir_okay=False), help="Also write an HTML report there.")
@option_for_force
@click.option("--scheduler", metavar="ADDRESS", help="Compute on the dask cluster of this scheduler.")
@click.option("-v", "--verbose", is_flag=True, help="Also print every candidate.")
@option_for_json
def fit(
    files: Sequence[str],
    output: str,
    model: str,
    learner: str | None,
    variance: float | None,
    centres: int | None,
    scale: Any,
    alpha: float | Literal["auto"] | None,
    softness: float | None,
    speed_power: float,
    folds: int,
    hold_out: Any,
    to: Any,
    report: str | None,
    force: bool,
    scheduler: str | None,
    verbose: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Learn a policy from the demonstrations in each FILE.

    Data larger than memory is read twice, one file or block at a time.
    """
    paths = uc.readers.expand(files)
    check_outputs((output, report), paths, force)
    check_name(output)
    learner = learner or default_learner(scheduler, alpha, softness, speed_power)
    chosen = {"learner": learner_of(learner, alpha, softness, speed_power), "validation": uc.Folds(folds, hold_out)}
    fitted = policy_of(model, variance, centres, scale, **chosen)
    with shown("reading, placing, learning") as progress:
        stream = stream_of(paths, speed_power, progress, **reading)
        with of_files(recordings_of(stream)):
            learn(fitted, stream, scheduler, to)
            moving = guided(fitted, to, stream)
            judged = judge_fit(moving, stream, told := uc.evaluation.diagnosis.states_told(fitted), scheduler)
    if not as_json:
        say_fit(moving, stream, judged, learner, verbose)
    refuse_warnings(reading["strict"])
    notes = provenance(paths, stream.recipe, stream.first, **reading)
    uc.save(moving, output, notes | {TOLD: told, RAN: judged.ran or None, MARK: judged.verdict.mark.name.lower()})
    written = {"policy": output} | _reported(moving, stream, report, Path(output).stem, judged)
    say_written(written, judged.to_json() if as_json else None)


def _reported(
    policy: uc.Policy | uc.Guided, stream: uc.Stream, report: str | None, title: str, judged: Judged
) -> dict[str, str]:
    """Write the page of a fit, if there is to be one; what and where."""
    if report is None:
        return {}
    from ..pages.fit import policy_page

    with shown("report: drawing"):
        demos, units = stream.beginning(), stream.first.units
        write(report, policy_page(policy, demos, title, stream.recipe, units, judged.verdict))
    return {"report": report}


@main.command(epilog="\b\nExample:\n  unconstrain score wipe.npz other.csv --plane 0,0.3,1 --json")
@click.argument("policy", type=click.Path())
@options_for_reading
@options_for_held("that held these recordings, to score under it, too")
@option_for_json
def score(
    policy: str,
    files: Sequence[str],
    plane: tuple[float, ...] | None,
    constraint: str | None,
    as_json: bool,
    **reading: Any,
) -> None:
    """Score how well POLICY explains recordings.

    The demonstrations in each FILE are read and prepared as the training data of the policy was, but for what options
    say.
    """
    from ..pages.fit import replayed

    moving, notes, verdicts = fitted_policy(policy), uc.storage.load_notes(policy), uc.evaluation.verdicts
    learnt = innermost(moving)
    with shown("reading"):
        demonstrations, recipe, recordings = prepared(files, reading, notes)
    refuse_warnings(reading["strict"])
    states = uc.stack(demonstrations).states
    held = held_of(plane, constraint, recipe, states, learnt.n_outputs_, "one for each action")
    if 2 * (_support(learnt, states) < uc.models.SUPPORTED).sum() > len(states):
        click.echo(f"Note: {policy}: learnt far from most of these states: are they of another task?", err=True)
    with shown("scoring"):
        rows = [_scores(moving, held, [demo], demo.name) for demo in demonstrations]
        whole = _scores(moving, held, demonstrations, "all")
    known, under = learnt_from(learnt, notes, recordings), None if held is None else 1.0 - whole["ncpe"]
    more = under, None if known is None else len(known), notes.get(TOLD)
    judged = verdicts.of_score(explained(moving, demonstrations), len(demonstrations), *more)
    judged = verdicts.of_worst(judged, {demo.name: explained(moving, [demo]) for demo in demonstrations})
    with shown("running it from the same starts"):
        found = replayed(judged, moving, demonstrations, recipe, held, recordings[0].units)
    verdict = verdicts.of_unit(verdicts.of_forbidden(found.verdict, whole.get("npoe", 0.0)), _times(learnt, states))
    if as_json:
        told = {"policy": policy, "rows": rows, "all": whole, "learnt_from": known}
        click.echo(json.dumps({**told, "replayed": found.medians, "verdict": verdict.to_json()}, indent=2))
        return
    say_verdict(verdict)
    head = ["demonstration", "samples", "normalised inconsistency", "nPOE", "nCPE"][: len(whole)]
    cells = [[f"{v:.4g}" if isinstance(v, float) else str(v) for v in one.values()] for one in (*rows, whole)]
    print_table(head, cells)


@main.command(epilog="\b\nExample:\n  unconstrain rollout wipe.npz --start 0.1,0,0 --plane 0,0.3,1 -o path.csv")
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
@click.option(
    "--method",
    type=click.Choice(["euler", "rk4", "adaptive"]),
    help="How a step is taken: Runge-Kutta by default, or by euler as the loop of a controller does.",
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

    It stops where demonstrations no longer support it, and says so; where they do not support the start, it is refused.
    """
    check_outputs(() if output == "-" else (output,), (policy, constraint), force)
    moving, notes = fitted_policy(policy), uc.storage.load_notes(policy)
    learnt, recipe = innermost(moving), uc.Recipe.from_dict(notes.get("recipe", {}))
    if len(start) != learnt.n_features_in_:
        raise SettingError(f"--start: got {len(start)} numbers, expected {learnt.n_features_in_}, one for each state.")
    _check_start(moving, start, how["least_support"])
    places = learnt.n_outputs_ if how["order"] == 2 else len(start)  # what a constraint is a function of
    at = replace(recipe, states=recipe.states and recipe.states[:places])
    held = held_of(plane, constraint, at, [start[:places]], learnt.n_outputs_, "one for each action")
    task = held.target if isinstance(held, uc.LearntConstraint) and held.task else None
    round_ = [_obstacle(given, len(start)) for given in obstacles]
    path, why, trouble = _as_far_as_it_goes(moving, list(start), constraint=held, task=task, obstacles=round_, **how)
    named = recipe if recipe.states else uc.Recipe(tuple(f"x{i + 1}" for i in range(len(start))))
    kept = "the plane" if plane is not None else getattr(held, "title", "")
    verdict = _supported(learnt, path, why, round_, kept, notes.get(TOLD))
    accelerations = named.actions or tuple(f"a{name}" for name in (named.states or ())[:places])
    columns = ["t", *(named.states or ()), *(accelerations if how["order"] == 2 else named.directions)]
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


@main.command(epilog="\b\nExample:\n  unconstrain reproduce table1 --trials 100 --out results")
@click.argument("experiment", type=click.Choice(experiments.NAMES))
@click.option("--trials", type=click.IntRange(1), help="Data sets; the paper's number by default.")
@click.option("--seed", type=click.IntRange(0), default=0, help="Seed of all random numbers.")
@click.option(
    "--only",
    multiple=True,
    help="Of regimes: a system, a constraint, or both, such as 'limit cycle, half'. Of recorded: a kind of data.",
)
@click.option(
    "--workers", type=int, default=-1, help="Processes; -1 is one for each core. The numbers do not depend on it."
)
@click.option("--out", type=click.Path(file_okay=False), default="results", help="Folder for NAME.json and NAME.html.")
@option_for_json
def reproduce(experiment: str, out: str, **settings: Any) -> None:
    """Run one of the paper's experiments, beside its printed values.

    An interrupted run continues where it stopped.
    """
    from ..paper import commands

    commands.reproduce(experiment, out, print_table, shown, **settings)


@main.command(epilog="\b\nExample:\n  unconstrain demo --real --download --out wiping")
@click.option("--real", is_flag=True, help="Learn from recorded wiping of a car rim, leaving one tilt out at a time.")
@click.option("--download", is_flag=True, help="Fetch those recordings (3 MB) if they are not there.")
@click.option("--plate", type=numbers, help="TILT_X,TILT_Y of a further plate to wipe, degrees.")
@click.option("--seed", type=click.IntRange(0), default=0, help="Seed of the simulation.")
@click.option("--out", type=click.Path(file_okay=False), default="demo", help="Folder for the report.")
@option_for_json
def demo(out: str, **settings: Any) -> None:
    """Wash a car: learn on some surfaces, test on others.

    Writes a report (HTML).
    """
    from ..paper import commands

    commands.demo(out, print_table, shown, **settings)


@main.command(epilog="\b\nExample:\n  unconstrain doctor --json")
@option_for_json
def doctor(as_json: bool) -> None:
    """List what is missing, and how to install it."""
    from .doctor import examine

    found = examine()
    if as_json:
        click.echo(json.dumps([one._asdict() for one in found], indent=2))
        return
    missing = [one for one in found if one.fix]
    sign = "! " if missing else "✔ "
    said = f"{len(missing)} of {len(found)} are missing something." if missing else "Everything is there."
    click.echo(f"{sign}{said}\n")
    print_table(["what", "for", "found"], [[one.what, one.serves, one.found] for one in found])
    if missing:
        click.echo("\nTo install what is missing, paste:")
    for command in dict.fromkeys(one.fix for one in missing):
        click.echo(f"  {command}")


main.add_command(certify)
main.add_command(constraint)
main.add_command(convert)
main.add_command(diagnose)
main.add_command(example)
main.add_command(export)
main.add_command(info)
main.add_command(look)
main.add_command(play)


def _scores(moving: Any, held: Any, of: Sequence[uc.Demonstration], name: str) -> dict[str, Any]:
    found = {"demonstration": name, "samples": sum(map(len, of)), "ninc": uc.ninconsistency(moving, of)}
    return found if held is None else found | {"npoe": uc.npoe(held, of), "ncpe": uc.ncpe(moving, of, held)}


def _obstacle(given: tuple[float, ...], n: int) -> uc.motion.obstacles.Ellipsoid:
    import numpy as np

    if len(given) not in {n + 1, 2 * n}:
        raise SettingError(
            f"--obstacle: got {len(given)} numbers, expected {n} of a centre, then a radius or {n} radii."
        )
    with of_option("--obstacle"):
        return uc.motion.obstacles.Ellipsoid(np.array(given[:n]), given[n:] if len(given) > n + 1 else given[n])


def _check_start(policy: uc.Policy | uc.Guided, start: tuple[float, ...], least: float) -> None:
    """Refuse to begin where nothing was demonstrated, unless the policy is guided from anywhere."""
    if innermost(policy) is not policy:
        return
    support = float(_support(policy, [start])[0])
    if support < least:
        raise InvalidDataError(
            f"--start: nothing was demonstrated near {', '.join(f'{one:.4g}' for one in start)} (support "
            f"{support:.2g}). Start nearer, demonstrate there, or go on in spite of it with --least-support 0."
        )


def _support(policy: uc.Policy, states: Any) -> Any:
    """How near data is to states (N, n), (N,); of a policy without kernels 1 within six standard deviations, else 0."""
    import numpy as np

    with suppress(SettingError):
        return policy.support(states)
    form = policy.closed_form()
    return (np.abs(form.embedding(np.array(states)) - form.origin) <= form.within).all(axis=1) * 1.0


def _times(policy: uc.Policy, states: Any) -> float:
    """How many times as large states (N, n) are as what a policy learnt from, in the middle; 1 where not known."""
    import numpy as np

    try:
        form = policy.closed_form()
    except SettingError:
        return 1.0
    own = form.embedding(np.array(states))
    extents = np.log(np.ptp(own, axis=0) / (2 * form.reach) + 1e-300)
    sizes = np.log(np.abs(own).max(axis=0) / (np.abs(form.origin) + form.reach) + 1e-300)
    return float(np.exp(np.median(np.where(np.abs(sizes) < np.abs(extents), sizes, extents))))


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
    return path, " ".join(str(one.message) for one in said if one.category is SupportEndsWarning), None


def _supported(
    policy: uc.Policy, path: Any, why: str, obstacles: Sequence[Any], held: str, told: float | None
) -> uc.evaluation.verdicts.Verdict:
    """How near data is along a movement, and whether it tells the policy, if not everywhere; and what ``held`` it."""
    verdicts = uc.evaluation.verdicts
    untold = None if (told or 0.0) >= verdicts.MOSTLY else uc.evaluation.diagnosis.untold(policy, path)
    found = verdicts.of_support(_support(policy, path.states), path.times, untold)
    found = verdicts.of_early_end(found, why) if why else found
    passes = f" {held[:1].upper()}{held[1:]} passes through the start." if held else ""
    found = found._replace(said=f"{found.said}{passes}")
    if not obstacles:
        return found
    nearest = min((float(one(path.states)[0].min()), number) for number, one in enumerate(obstacles, start=1))
    return found._replace(
        said=f"{found.said} It keeps clear of {counted(len(obstacles), 'obstacle')}, at the nearest of number "
        f"{nearest[1]} by {nearest[0]:.0%} of its radius."
    )


def _csv(header: Sequence[str], path: uc.Demonstration) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([f"{value:.9g}" for value in row] for row in _rows(path))
    return text.getvalue()


def _rows(path: uc.Demonstration) -> Any:
    import numpy as np

    return np.column_stack([*([] if path.times is None else [path.times]), path.states, path.actions])

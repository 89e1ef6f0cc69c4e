"""The command line: parse, call, print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Literal

import click

import unconstrain as uc

from ..base.display import has_no_column, listed
from ..base.errors import NOTHING_LEFT, ReadError, UnconstrainError
from ..base.files import write
from ..paper import experiments
from .certifying import certify
from .constraining import constraint, jacobian_of, options_for_arm
from .converting import convert, example
from .diagnosing import diagnose
from .exporting import export
from .fitting import alpha_of, default_learner, guide_of, guided, learn, learner_of, options_for_model, policy_of
from .informing import GUIDE, LOST, MARK, MOVES, NOISE, RAN, TOLD, info, provenance
from .looking import look, play
from .printing import (
    SPOILING,
    Group,
    Judged,
    judge_fit,
    keep_codes,
    option_for_json,
    print_table,
    refuse_warnings,
    say_fit,
    say_judged,
    say_surveys,
    say_written,
)
from .progress import shown
from .reading import (
    left_in,
    likely_states,
    next_command,
    numbers,
    of_files,
    of_words,
    options_for_reading,
    reading_of,
    recipe_of,
    recordings_of,
    said_recipe,
    stream_of,
)
from .rolling import rollout
from .scoring import score
from .speaking import as_typed, options_in
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

    Exit codes: 0 done, whatever the verdict says (scripts read verdict.mark of --json); 1 a fault of this program; 2 it
    cannot be done, or --strict and recordings are not as they seem; 3 certify guarantees nothing; 130 interrupted.

    Completion by the tab key, here for bash (or zsh, fish):

    \b
    eval "$(_UNCONSTRAIN_COMPLETE=bash_source unconstrain)"
    """  # noqa: D301 - click's mark for lines that stay as they are


@main.command(epilog="\b\nExample:\n  unconstrain inspect wipe_*.csv --state x,y,z")
@options_for_reading
@option_for_json
def inspect(files: Sequence[str], as_json: bool, **reading: Any) -> None:
    """Describe each FILE: columns, rate, gaps, zero actions."""
    recipe, first, labels = recipe_of(**reading), list[uc.Recording](), list[dict[str, float]]()

    def recordings() -> Iterator[uc.Recording]:
        paths, how = uc.readers.expand(files), reading_of(**reading)
        every = (one for path in paths for one in uc.readers.read_blocks(path, how, whole=True))
        for recording in left_in(every, reading["leave_out"], recipe):
            first[:] = first or [recording]
            held = (recording.values == recording.values[:1].round()).all(axis=0)  # as is the number of a trial
            head = zip(recording.columns, held, recording.values[0] if len(recording) else held, strict=True)
            labels.append({name: value for name, kept, value in head if kept})
            yield recording

    with shown("reading"):
        surveys = uc.preparation.survey_set(recordings(), recipe)
    if not first:
        raise ReadError(NOTHING_LEFT)
    own = [found.name for found in surveys]
    spoil = {found.name for found in surveys if SPOILING & {one.code for one in found.warnings}}
    differ = [name for name in own if name in spoil and own.count(name) == 1] if len(spoil) < len({*own}) else []
    names = uc.readers.unique_names(own)
    surveys = [replace(found, name=name) for found, name in zip(surveys, names, strict=True)]
    keep_codes(remark.code for found in surveys for remark in found.warnings)
    used, needed, lacking = _used(recipe, first[0], surveys)
    left_out = [*reading["leave_out"], *dict.fromkeys([*differ, *lacking])] if differ or lacking else []
    then = _to_fit(recipe, first[0], surveys, bool(needed and not lacking), left_out, labels)
    apart = next_command("inspect", "--group", without=["group"])
    verdict = uc.evaluation.verdicts.of_surveys(surveys, needed, then, apart)
    plain = [
        asdict(found) | {kind: [*map(_plain, getattr(found, kind))] for kind in ("warnings", "notes")}
        for found in surveys
    ]
    say_judged(verdict, {}, as_json, demonstrations=plain)
    if not as_json:
        say_surveys(surveys)
        click.echo(used, nl=False)
    refuse_warnings(reading["strict"])


def _plain(one: Any) -> dict[str, Any]:
    return {name: getattr(one, name) for name in ("code", "column", "row", "spans")} | {
        "message": as_typed(one.message)
    }


def _used(recipe: uc.Recipe, first: uc.Recording, surveys: Sequence[Any]) -> tuple[str, str, list[str]]:
    """What ``fit`` uses, a line; what it has to know, a sentence; and the recordings that lack a column of it."""
    try:
        decided = uc.preparation.decide(recipe, first)[0]
    except UnconstrainError as error:
        return "", as_typed(str(error)), []
    wanted = [*(decided.states or ()), *(decided.actions or ())]
    lacking = [(one, sorted({*wanted} - {*one.columns}, key=wanted.index)) for one in surveys]
    said = {one.name: has_no_column(one.name, names, one.columns, one.words) for one, names in lacking if names}
    needed, left_out = as_typed(next(iter(said.values()), "")), list(said)
    if recipe.states is None and 2 * len(said) >= len(surveys):
        other = next(one for one in surveys if one.name in said)
        needed = f"'{surveys[0].name}' has columns {listed(first.columns, 8)}, '{other.name}' "
        needed += f"{listed(other.columns, 8)}, and which are right cannot be told: name with --state what all have, "
        needed += "or rename those that are wrong."
        left_out = []
    elif decided.actions is None and decided.rate is None and first.times is None:
        needed = "Nothing tells the time, which velocities take: name its column with --time, or give --rate."
    return f"fit uses {said_recipe(decided, first)}.\n", needed, left_out


def _to_fit(
    recipe: uc.Recipe, first: uc.Recording, surveys: Sequence[Any], guess: bool, left_out: Sequence[str], labels: Any
) -> str:
    """The command that comes next; with what may be meant where columns are not named, by ``labels`` of recordings."""
    states, actions = (not guess or _are_there(names, first) for names in (recipe.states, recipe.actions))
    clock = [one.column for one in surveys[0].warnings if one.code == "clock-untold" and one.column]
    states = states and not {*clock} & {*(recipe.states or ())}
    common = [name for name in first.columns if name not in clock and all(name in one.columns for one in surveys)]
    still = [name for name in labels[0] if all(name in one for one in labels)]
    common = [name for name in common if name not in still]
    split = guess and any(note.code == "split" for one in surveys for note in one.notes)
    counts = [name for name in still if split and len({one[name] for one in labels}) == len(labels)]
    more = [] if states else ["--state", ",".join(likely_states(common or first.columns))]
    more += ["--group", counts[0]] if counts else []
    timeless = guess and first.times is None and not recipe.rate and not recipe.actions
    more += ["--rate", "HZ"] * (timeless and not clock)
    cures = _cures(surveys)
    more += [word for option_and_value in cures.items() for word in option_and_value if word]
    more += [] if actions or recipe.differentiate or "--by" in cures else ["--differentiate"]
    more += ["--leave-out", ",".join(left_out)] if left_out else []
    wrong = {"state": not states, "action": not actions or "--by" in cures, "leave_out": bool(left_out)}
    wrong |= {option[2:].replace("-", "_"): True for option in cures}
    return next_command("fit", *more, "-o", "policy.npz", without=[name for name in wrong if wrong[name]])


def _cures(surveys: Sequence[Any]) -> dict[str, str]:
    """Options, with their values, that warnings name, and notes on degrees; of angles all."""
    found: dict[str, str] = {}
    for remark in (one for each in surveys for one in (*each.warnings, *each.notes)):
        cures = (remark.warns and not remark.cured and remark.code != "pause") or remark.code == "degrees"
        for option, value in options_in(remark.message).items() if cures else ():
            names = (*found.get(option, value).split(","), *value.split(",") * (option in ("--angle", "--degrees")))
            found[option] = ",".join(dict.fromkeys(names))
    if "--angle" in found:  # which has no scale
        found.pop("--scale", None)
    if len(surveys) == 1 and "pause" in [one.code for one in surveys[0].warnings]:
        found["--pauses"] = "cut"
    found.pop("--action-is", None)  # which takes the actions for what they are
    if all("reversed" in [one.code for one in each.warnings] for each in surveys):
        found["--by"] = "savgol"  # the sign of all actions is turned
    return dict(sorted(found.items()))


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
@options_for_arm
@click.option("--folds", type=click.IntRange(2), default=10, help="Folds to choose the threshold on.")
@of_words(
    "--hold-out",
    "auto demonstration sample",
    "What a fold holds out together; auto: demonstrations, or samples of a single one.",
    "auto",
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
    taught = learner_of(learner, alpha, softness, speed_power, jacobian_of(reading.pop("jacobian"), reading.pop("tip")))
    fitted = policy_of(model, variance, centres, scale, learner=taught, validation=uc.Folds(folds, hold_out))
    with shown("reading, placing, learning") as progress:
        stream = stream_of(paths, speed_power, progress, **reading)
        with of_files(recordings_of(stream, recipe_of(**reading))):
            fitted = learn(fitted, stream, scheduler, to)
            moving = guided(fitted, to, stream)
            judged = judge_fit(moving, stream, told := uc.evaluation.diagnosis.states_told(fitted), scheduler)
    if not as_json:
        say_fit(moving, stream, judged, learner, verbose)
    refuse_warnings(reading["strict"])
    found = {TOLD: told, LOST: judged.lost, NOISE: judged.noise_alone, MARK: judged.verdict.mark.name.lower()}
    found |= {RAN: judged.ran or None, MOVES: judged.moves or None} | ({GUIDE: judged.guides} if to is None else {})
    uc.save(moving, output, provenance(paths, stream.recipe, stream.first, contents=stream.contents, **reading) | found)
    say_written(_reported(moving, stream, report, output, judged), judged.to_json() if as_json else None)


def _reported(
    policy: uc.Policy | uc.Guided, stream: uc.Stream, report: str | None, output: str, judged: Judged
) -> dict[str, str]:
    """Write the page of a fit, if there is to be one; what is written, and where."""
    if report is None:
        return {"policy": output}
    from ..pages.fit import policy_page

    with shown("report: drawing"):
        demos, units, title = stream.beginning(), stream.first.units, f"The policy {Path(output).stem}"
        write(report, policy_page(policy, demos, title, stream.recipe, units, judged.verdict))
    return {"policy": output, "report": report}


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
@option_for_force
@option_for_json
def reproduce(experiment: str, out: str, force: bool, **settings: Any) -> None:
    """Run one of the paper's experiments, beside its printed values.

    An interrupted run continues where it stopped.
    """
    from ..paper import commands

    check_outputs(commands.written(experiment, out), (), force)
    commands.reproduce(experiment, out, print_table, shown, **settings)


@main.command(epilog="\b\nExample:\n  unconstrain demo --real --download --out wiping")
@click.option("--real", is_flag=True, help="Learn from recorded wiping of a car rim, leaving one tilt out at a time.")
@click.option("--download", is_flag=True, help="Fetch those recordings (3 MB) if they are not there.")
@click.option("--plate", type=numbers, help="TILT_X,TILT_Y of a further plate to wipe, degrees.")
@click.option("--seed", type=click.IntRange(0), default=0, help="Seed of the simulation.")
@click.option("--out", type=click.Path(file_okay=False), default="demo", help="Folder for the report.")
@option_for_force
@option_for_json
def demo(out: str, force: bool, **settings: Any) -> None:
    """Wash a car: learn on some surfaces, test on others.

    Writes a report (HTML).
    """
    from ..paper import commands

    check_outputs(commands.written("washing", out), (), force)
    commands.demo(out, print_table, shown, **settings)


@main.command(epilog="\b\nExample:\n  unconstrain doctor --json")
@option_for_json
def doctor(as_json: bool) -> None:
    """List what is missing, and how to install it."""
    from .doctor import examine

    found = examine()
    verdicts, fixes = uc.evaluation.verdicts, [one.fix for one in found if one.fix]
    verdict = verdicts.Verdict(verdicts.Mark.GOOD, "Everything is there.")
    if fixes:
        then = "\n".join(["To install what is missing, paste:", *dict.fromkeys(fixes)])
        said = f"{len(fixes)} of {len(found)} are missing something."
        verdict = verdicts.Verdict(verdicts.Mark.DOUBTFUL, said, next=then)
    say_judged(verdict, {}, as_json, found=[one._asdict() for one in found])
    if not as_json:
        print_table(["what", "for", "found"], [[one.what, one.serves, one.found] for one in found])


for _command in (certify, constraint, convert, diagnose, example, export, info, look, play, rollout, score):
    main.add_command(_command)

"""Options for reading files: columns and preparation."""

from __future__ import annotations

import math
import re
import shlex
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, fields, replace
from functools import reduce, wraps
from pathlib import Path
from typing import Any, NamedTuple

import click

import unconstrain as uc

from ..base.display import bare, counted, innermost, listed
from ..base.errors import NOTHING_LEFT, InvalidDataError, ModelFileError, ReadError, SettingError, UnconstrainError
from ..base.files import stem
from .progress import Progress

MOST_GUESSED = 3
"""Columns, at most, that are proposed as states where their names say nothing, not even by numbers."""


def names(text: str) -> tuple[str, ...]:
    """Names separated by commas."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def groups_of_names(texts: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Names separated by commas, several times."""
    return tuple(map(names, texts))


def numbers(text: str) -> tuple[float, ...]:
    """Finite numbers separated by commas."""
    try:
        values = tuple(map(float, text.split(",")))
    except ValueError:
        values = ()
    if not values or not all(map(math.isfinite, values)):
        raise click.BadParameter(f"got {text!r}, expected finite numbers separated by commas, such as 0.1,0,-2.")
    return values


def with_options(*options: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add options to a command, the first first."""
    return lambda command: reduce(lambda done, option: option(done), reversed(options), command)


def of_words(name: str, words: str, told: str, default: str | None = None) -> Callable[[Callable[..., Any]], Any]:
    """An option that is one of some words."""
    return click.option(name, type=click.Choice(words.split()), default=default, help=told)


CURES = (
    click.option("--angle", type=names, help="State columns that are angles, such as roll,yaw."),
    click.option(
        "--degrees", type=names, help="Columns in degrees; by default if a unit, or jumps of --angle, say it."
    ),
    click.option(
        "--quaternion",
        "quaternions",
        multiple=True,
        help="Four state columns of a quaternion, such as qw,qx,qy,qz; again for another.",
    ),
    click.option(
        "--rotation-vector",
        "rotation_vectors",
        multiple=True,
        help="Three state columns of a rotation vector, such as rx,ry,rz; again for another.",
    ),
    of_words(
        "--action-is",
        "auto velocity target delta",
        "What action columns hold: velocities, states to come, or changes to the next sample.",
        "auto",
    ),
    of_words(
        "--pauses",
        "drop keep cut",
        "Rows that stand still in the middle or at the ends; cut: apart there, too.",
        "drop",
    ),
    of_words(
        "--glitches", "auto keep repair drop", "Samples far off: repair puts a line there, auto only of few.", "auto"
    ),
    of_words("--seams", "keep cut", "Jumps to another place: cut smooths nothing across.", "keep"),
    click.option(
        "--max-gap",
        type=float,
        help="Longest interval between samples that is no gap, seconds; by default five usual ones.",
    ),
    click.option("--sort", is_flag=True, help="Put the rows in the order of time."),
    click.option(
        "--leave-out",
        type=names,
        default="",
        show_default=False,
        help="Names of demonstrations, or of files that cannot be read, to leave out, such as wipe_3,wipe_7.",
    ),
    click.option("--strict", is_flag=True, help="End with exit code 2 where something is not as it seems."),
)
"""Options for what is not what it seems."""


READING = (
    click.argument("files", nargs=-1, required=True, metavar="FILE..."),
    click.option("--state", type=names, help="Columns that make the state, such as x,y,z or j1..j7."),
    click.option("--action", type=names, help="Columns that make the action, such as vx,vy,vz."),
    click.option("--differentiate", is_flag=True, help="Take the velocity of the state as the action."),
    of_words("--by", "savgol kalman central", "How to differentiate, savgol by default; implies --differentiate."),
    click.option("--window", type=float, help="Smoothing window of savgol, seconds; 0.25 by default."),
    click.option("--order", type=click.IntRange(2, 3), default=3, help="Degree of the polynomial of savgol."),
    click.option("--still", type=float, help="Trim what is slower than this at start and end, unit of the actions."),
    click.option("--trim", type=numbers, metavar="A,B", help="Seconds to leave out at the start and at the end."),
    click.option("--rate", type=float, help="Resample to this many samples a second; without time stamps, their rate."),
    click.option("--centre", is_flag=True, help="States relative to the mean of each demonstration."),
    *CURES,
    click.option("--group", help="Column that tells demonstrations apart; none: each file is one."),
    click.option("--time", help="Column with the time stamps; by default one called t, time or so."),
    of_words("--time-unit", "s ms us ns", "Unit of the time stamps; by default as their name or size says."),
    click.option("--columns", type=names, help="Names of the columns, in order, for files without a header."),
    click.option("--topic", help="ROS: topic to read. Excel: sheet."),
    click.option("--episodes", type=names, help="Demonstrations to read, such as 0-9,12 or train."),
    click.option("--task", help="Read only demonstrations of this task."),
)
"""Options for reading and preparing files."""


def options_for_reading(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for reading and preparing files."""
    return with_options(*READING)(_without_broken(command))


def _without_broken(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command that leaves out whole files by their names, where they cannot be read."""

    @wraps(command)
    def begun(*args: Any, files: Sequence[str], leave_out: tuple[str, ...], **given: Any) -> Any:
        stems = {path: stem(path) for path in (uc.readers.expand(files) if leave_out else ())}
        how = reading_of(**given)
        broken = {one for path, one in stems.items() if one in leave_out and not is_recording(path, how)}
        files = [str(path) for path, one in stems.items() if one not in broken] if broken else files
        leave_out = tuple(name for name in leave_out if name not in broken)
        return command(*args, files=files, leave_out=leave_out, **given)

    return begun


AS_CALLED = ("order", "trim", "sort", "glitches", "seams", "pauses", "action_is")
"""Settings of a recipe whose options are called as they are, and take what they take."""

OPTIONS = {"states": "state", "actions": "action", "differentiate": "by", "window_s": "window", "max_gap_s": "max-gap"}
OPTIONS |= {"angles": "angle", "quaternions": "quaternion", "rotation_vectors": "rotation-vector"}
"""Those whose options are called otherwise."""


def recipe_of(
    state: tuple[str, ...] | None = None,
    action: tuple[str, ...] | None = None,
    differentiate: bool = False,
    by: str | None = None,
    window: float | None = None,
    rate: float | None = None,
    centre: bool = False,
    still: float | None = None,
    angle: tuple[str, ...] | None = None,
    degrees: tuple[str, ...] | None = None,
    quaternions: Sequence[str] = (),
    rotation_vectors: Sequence[str] = (),
    max_gap: float | None = None,
    **others: Any,
) -> uc.Recipe:
    """The recipe of the options."""
    if differentiate or by:
        if action is not None:
            raise SettingError("--action: got columns, and --differentiate or --by too; give one or the other.")
        by = by or "savgol"
    recipe = uc.Recipe(
        state,
        action,
        by,
        rate=rate,
        centre=centre,
        still=still,
        angles=angle or (),
        degrees=() if degrees == ("none",) else degrees,
        quaternions=groups_of_names(quaternions),
        rotation_vectors=groups_of_names(rotation_vectors),
        max_gap_s=max_gap,
        **{name: others[name] for name in AS_CALLED if name in others},
    )
    return recipe if window is None else replace(recipe, window_s=window)


def fitted_policy(path: str) -> Any:
    """The policy in a file, guided or not.

    Raises
    ------
    ModelFileError
        Also if it is not fitted.
    """
    policy = loaded(path, uc.Policy | uc.Guided)
    if not hasattr(innermost(policy), "solution_"):
        raise ModelFileError(f"{path}: holds a policy that is not fitted. Fit it before saving.")
    return policy


def loaded(path: str, kind: Any) -> Any:
    """What a file holds; a ModelFileError where it is of another kind, which says so of recordings."""
    try:
        return uc.load(path, kind)
    except ModelFileError as error:
        if not is_recording(Path(path)):
            raise
        context = click.get_current_context()
        files = context.params.get("files", ())
        then = "'unconstrain inspect' says what is in it, 'unconstrain fit' and 'unconstrain constraint' learn from it."
        for saved in (one for one in files if zipfile.is_zipfile(one) and not is_recording(one)):
            typed = shlex.join([saved, path, *(file for file in files if file != saved)])
            then = f"The policy comes first: unconstrain {context.info_name} {typed}"
        wanted = "policy" if issubclass(uc.Policy, kind) else "learnt constraint"
        raise ModelFileError(f"{path}: is a recording, not a {wanted}. {then}") from error


def is_recording(path: Path | str, how: uc.readers.Reading | None = None) -> bool:
    """Whether a file can be read, to its end."""
    with suppress(UnconstrainError):
        return sum(len(block) for block in uc.readers.read_blocks(path, how)) > 0
    return False


def said_recipe(recipe: uc.Recipe, recording: uc.Recording) -> str:
    """A recipe in words, with the smoothing window that it makes of a recording."""
    states = ", ".join(f"{name}{' (an angle)' if name in recipe.angles else ''}" for name in recipe.states or ())
    states += "".join(f" ({', '.join(group)} are an orientation)" for group in recipe.quaternions)
    window = uc.preparation.window_used(recipe, recording)
    ways = {"savgol": f"savgol, {window:.3g} s", "kalman": "Kalman smoother"}
    smoothed = ways.get(recipe.differentiate or "", "central differences")
    actions = f"their velocity ({smoothed})" if recipe.actions is None else f"{', '.join(recipe.actions)} as actions"
    radians = f", {', '.join(recipe.degrees)} in radians" if recipe.degrees else ""
    units = recipe.units(recording.units)
    if left := [name for name in (*(recipe.states or ()), *(recipe.actions or ())) if units.get(name, "")[:3] == "deg"]:
        radians += f", {listed(left, 3)} left in degrees (--degrees takes them in radians)"
    return f"{states} as states and {actions}{'' if recipe.actions else ' as actions'}{radians}"


def say_left(demonstrations: Sequence[uc.Demonstration], recipe: uc.Recipe) -> None:
    """Print how much of all demonstrations ``--still`` left, and with ``--verbose`` of each."""
    if recipe.still is not None:
        click.echo(f"Note: --still left {_left_of(demonstrations)}.", err=True)
        for one in demonstrations if click.get_current_context().params.get("verbose") else ():
            click.echo(f"  {one.name}: {_left_of([one])}", err=True)


def _left_of(demonstrations: Sequence[uc.Demonstration]) -> str:
    import numpy as np

    left, of = [*map(len, demonstrations)], [(one.source and one.source.whole) or len(one) for one in demonstrations]
    steps = [np.ptp(one.times) / (len(one) - 1) for one in demonstrations if one.times is not None and len(one) > 1]
    known = len(steps) == len(left)
    seconds = f" ({np.dot(left, steps):.3g} of {np.dot(of, steps):.3g} s)" if known else ""
    return f"{sum(left)} of {sum(of)} samples{seconds}"


def reading_of(**options: Any) -> uc.readers.Reading:
    """How to read the files, as the options say."""
    known = [field.name for field in fields(uc.readers.Reading)]
    return uc.readers.Reading(**{name: value for name, value in options.items() if name in known})


@contextmanager
def of_files(recordings: Iterable[uc.Recording]) -> Iterator[None]:
    """Let what is wrong with a recording begin with its file; they are looked through where something is."""
    try:
        yield
    except (InvalidDataError, SettingError) as error:
        with suppress(UnconstrainError):
            came = {(one.name, one.file): one.remarks for one in recordings}
            told = [one for remarks in came.values() for one in remarks if one.code == "several-in-one"]
            named = max((name for name, _ in came if str(error).startswith(f"'{name}'")), key=len, default="")
            if named and (files := {file: None for name, file in came if name == named and file}):
                own = any(stem(file) == named for file in files)
                title = " or ".join(files) if own else f"'{named}' of {' or '.join(files)}"
                left_out = ",".join([*click.get_current_context().params["leave_out"], named])
                leave = f" Or leave it out: --leave-out {shlex.quote(left_out)}" * (len(came) > len(files))
                first = f"Column {told[0].column!r} {told[0].message} As it is: " if told else ""
                said = f"{first}{title}{str(error)[len(named) + 2 :]}{getattr(error, 'cure', leave)}"
                error.args = (said, *error.args[1:])
        raise


def recordings_of(stream: uc.Stream, recipe: uc.Recipe) -> Iterator[uc.Recording]:
    """Read a stream's files once more, cut as a recipe says."""
    every = (one for path in stream.paths for one in uc.readers.read_blocks(path, stream.reading, whole=True))
    return (piece for one in every for piece in uc.preparation.pieces(one, recipe))


def next_command(name: str, *more: str, without: Sequence[str] = ()) -> str:
    """Another command, to copy: of the files and options of this one, as far as it has them."""
    context = click.get_current_context()
    known = {one.name for one in context.find_root().command.commands[name].params}  # type: ignore[attr-defined]
    known -= set() if "jacobian" in known else {"tip"}  # which there belongs to another option
    others = [one.name or "" for one in context.command.params if one.name not in known]
    told = typed("files", "output", "report", "force", "verbose", "as_json", "strict", *others, *without)
    return f"unconstrain {name} {as_pattern(context.params['files'])} {shlex.join([*told, *more])}".rstrip()


def to_copy(
    verdict: Any,
    policy: str,
    notes: Mapping[str, Any] | None = None,
    states: Sequence[str] = (),
    of: Sequence[str] = (),
) -> Any:
    """A verdict with the commands that its Next names whole, on these files or, in capitals, such as a model notes.

    ``states`` are their names with units, where a goal may have to be given, and ``of`` are files to look at.
    """
    lines, known = verdict.next.split("\n"), notes or {}
    recipe = uc.Recipe.from_dict(known.get("recipe", {}))
    read = ["RECORDINGS.csv", *as_options(recipe, reading_of(**known))]
    states = states or recipe.labels(known.get("units", {}))[0]
    for name, to in re.findall(r"'unconstrain (\w+)(?: --guided ([\w.,]+))?", verdict.next):
        if to == "GOAL":
            lines[0] += f" GOAL: {counted(len(states), 'number')}, of {', '.join(states)}." if states else ""
        more = ["--guided", to] * bool(to) + ["-o", "guided.npz" if to else "policy.npz"]
        more = {"fit": more, "look": [policy]}.get(name, [])
        left = ["to", *["group"] * ("--group" in verdict.next)]  # another one is asked for
        own = next_command(name, *more, without=left) if notes is None and name != "score" else ""
        files = [policy, "NEW.csv"] if name == "score" else [*of, *read[1:]] if of and name == "look" else read
        lines.append(own or shlex.join(["unconstrain", name, *files, *more]))
    return verdict._replace(next="\n".join(dict.fromkeys(lines)))


def as_options(recipe: uc.Recipe, how: uc.readers.Reading, without: Sequence[str] = ()) -> list[str]:
    """Options that read and prepare files as these say, but for some; what is so by default needs none."""
    settings, plain, told = vars(recipe) | how.roles, vars(uc.Recipe()) | uc.readers.Reading().roles, list[str]()
    if not recipe.angles and not re.search("deg|[°º]", ",".join([*(recipe.states or ()), *(recipe.actions or ())])):
        settings["degrees"] = recipe.degrees or None  # nothing looks like degrees
    for name in [name for name, value in settings.items() if value != plain[name]]:
        option, value = f"--{OPTIONS.get(name, name).replace('_', '-')}", settings[name]
        for one in value if name in ("quaternions", "rotation_vectors") else [value]:
            text = ",".join(map(str, one)) or "none" if isinstance(one, tuple) else str(one).removesuffix(".0")
            given = ["--differentiate"] if (option, text) == ("--by", "savgol") else [option, text][: 2 - (one is True)]
            told += [] if option in without else given
    return told


def as_pattern(files: Sequence[str | Path]) -> str:
    """Files as they were typed; many by a pattern that stands for just these."""
    folder, pattern = Path(files[0]).parent, f"*{Path(files[0]).suffix}"
    if len(files) > 3 and sorted(map(Path, files)) == sorted(folder.glob(pattern)):
        return shlex.quote(str(folder / pattern))
    return shlex.join(map(str, files))


def likely_states(columns: Sequence[str]) -> tuple[str, ...]:
    """Columns that may be the states, where none are called so: the first x, y, z beside each other, or the first."""
    ends = "".join(bare(name).strip(" \"'").casefold()[-1:] or " " for name in columns)
    for axes in ("xyz", "xy"):
        if axes in ends:
            return tuple(columns[ends.index(axes) :][: len(axes)])
    heads = [re.sub(r"\d+", "#", bare(name)) for name in columns]
    numbered = next((head for head in heads if heads.count(head) > 1 and head not in ("#", "column#")), None)
    family = tuple(name for name, head in zip(columns, heads, strict=True) if head == numbered)
    return family or tuple(columns[:MOST_GUESSED])


def typed(*without: str) -> list[str]:
    """The options of this command as they were typed, but for some."""
    context, told = click.get_current_context(), list[str]()
    for option in context.command.params:
        name = option.name or ""
        if name in without or context.get_parameter_source(name) != click.core.ParameterSource.COMMANDLINE:
            continue
        value = context.params[name]
        for one in value if getattr(option, "multiple", False) else [value]:
            plain = ",".join(map(str, one)) if isinstance(one, tuple) else str(one)
            told += [option.opts[0]] if one is True else [option.opts[0], plain]
    return told


def stream_of(
    paths: Sequence[str | Path], speed_power: float, progress: Progress | None = None, **options: Any
) -> uc.Stream:
    """Files as batches to learn from, as the options say."""
    left_out = options.get("leave_out") or ()
    return uc.Stream(
        paths,
        recipe_of(**options),
        reading=reading_of(**options),
        speed_power=speed_power,
        leave_out=left_out,
        progress=progress,
    )


class Prepared(NamedTuple):
    """Demonstrations, the recipe that made them, and the recordings that they were."""

    demonstrations: list[uc.Demonstration]
    recipe: uc.Recipe
    recordings: list[uc.Recording]


def prepared(paths: Sequence[Any], reading: dict[str, Any], notes: Mapping[str, Any] | None = None) -> Prepared:
    """Read and prepare files as what a model with such notes was learnt from, but for what the options say."""
    known = notes or {}
    asked = _but(uc.Recipe.from_dict(known.get("recipe", {})), recipe_of(**reading))
    how = _but(uc.readers.Reading(**reading_of(**known).roles), reading_of(**reading))
    recordings = list(left_in(uc.read(paths, **how.arguments), reading["leave_out"], asked))
    if not recordings:
        raise ReadError(NOTHING_LEFT)
    with of_files(recordings):
        found = Prepared(uc.prepare(recordings, asked), uc.preparation.decide(asked, recordings[0])[0], recordings)
    say_left(found.demonstrations, found.recipe)
    return found


def check_enough(demonstrations: Sequence[uc.Demonstration]) -> None:
    """Refuse fewer samples than tell any policy: the simplest takes one more than there are states."""
    count, n = uc.stack(demonstrations).states.shape
    if count <= n:
        raise InvalidDataError(
            f"got {counted(count, 'sample')} in all, expected at least {n + 1}, one more than there are states: fewer "
            "tell no policy. Record longer, or give more files."
        )


def _but(kept: Any, asked: Any) -> Any:
    """Settings, but for those that are asked for, which are not as they are by themselves."""
    plain = asdict(type(asked)())
    return replace(kept, **{name: value for name, value in vars(asked).items() if value != plain[name]})


def left_in(recordings: Iterable[uc.Recording], names: Sequence[str], recipe: uc.Recipe) -> Iterator[uc.Recording]:
    """Recordings, cut as a recipe says, but those that are left out by name; a SettingError where a name is of none."""
    came: dict[str, None] = {}
    for recording in (piece for one in recordings for piece in uc.preparation.pieces(one, recipe)):
        came[recording.name] = None
        if recording.name not in names:
            yield recording
    uc.readers.check_left_out(names, came)

"""``unconstrain look`` and ``play``: pages that run by themselves."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

import unconstrain as uc

from ..base.display import counted
from ..base.errors import ModelFileError, ReadError
from ..base.files import write
from .printing import refuse_warnings
from .reading import left_in, options_for_reading, reading_of, recipe_of
from .writing import check_outputs, option_for_force


@click.command(epilog="\b\nExample:\n  unconstrain play -o play.html")
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False), default="play.html", show_default=True, help="HTML file."
)
@option_for_force
def play(output: str, force: bool) -> None:
    """Write a page to draw on, to see what it is about.

    Strokes on a plate, a rail that takes away what points into it, and three learners beside each other.
    """
    from ..pages.play import play_page

    check_outputs((output,), (), force)
    write(output, play_page())
    click.echo(f"page: {output}")


@click.command(epilog="\b\nExample:\n  unconstrain look wipe_*.csv wipe.npz --state x,y,z -o look.html")
@options_for_reading
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False), default="look.html", show_default=True, help="HTML file."
)
@option_for_force
def look(files: Sequence[str], output: str, force: bool, **reading: Any) -> None:
    """Write a page that shows demonstrations.

    Those in each FILE are seen in space and in time. A FILE may also be a policy (.npz), which is rolled out there, or
    a learnt constraint (.npz), which is drawn. Recordings are then prepared as those of the policy were.
    """
    from ..pages.look import look_page, marks_of

    paths = uc.readers.expand(files)
    check_outputs((output,), paths, force)
    models = {path: found for path in paths if (found := _model(path)) is not None}
    recorded = [path for path in paths if path not in models]
    if not recorded:
        raise ReadError(f"{', '.join(map(str, paths))}: holds no recording to look at.")
    policies = [one for one in models.values() if isinstance(one, uc.Policy)]
    constraints = [one for one in models.values() if isinstance(one, uc.LearntConstraint)]
    asked, how = _as_learnt(next(iter(models), None), reading)
    recordings = list(left_in(uc.read(recorded, **how), reading["leave_out"]))
    demonstrations = uc.prepare(recordings, asked)
    recipe, _ = uc.preparation.decide(asked, recordings[0])
    refuse_warnings(reading["strict"])
    surveys = uc.preparation.survey_set(recordings, recipe)
    page = look_page(
        demonstrations,
        recipe.states or (),
        _title(recorded),
        units=recordings[0].units,
        marks=[marks_of(*each) for each in zip(recordings, surveys, demonstrations, strict=True)],
        command=_to_fit(recorded, recipe),
        policy=policies[0] if policies else None,
        constraint=constraints[0] if constraints else None,
    )
    write(output, page)
    samples = sum(map(len, demonstrations))
    click.echo(f"{counted(len(demonstrations), 'demonstration')}, {counted(samples, 'sample')}")
    click.echo(f"page: {output}")


def _title(paths: Sequence[str | Path]) -> str:
    """What is looked at."""
    more = len(paths) - 1
    return f"A look at {Path(paths[0]).name}{f' and {more} more' if more else ''}"


def _model(path: str | Path) -> Any:
    """The policy or constraint in a file; None where it holds a recording."""
    for kind in (uc.Policy, uc.LearntConstraint) if Path(path).suffix.lower() == ".npz" else ():
        try:
            return uc.load(path, kind)
        except ModelFileError:
            continue
    return None


def _as_learnt(model: str | Path | None, reading: dict[str, Any]) -> tuple[uc.Recipe, dict[str, Any]]:
    """The recipe and the way of reading: of the options, or of what the model was learnt from."""
    notes = {} if model is None else uc.storage.load_notes(model)
    if "recipe" not in notes:
        return recipe_of(**reading), reading_of(**reading).arguments
    return uc.Recipe.from_dict(notes["recipe"]), reading_of(**notes).roles


def _to_fit(paths: Sequence[str | Path], recipe: uc.Recipe) -> tuple[str, str]:
    """What to type to learn from these files as they were read, before and after what is left out."""
    context = click.get_current_context()
    told = ["unconstrain", "fit", *map(str, paths)]
    if not context.params["state"]:
        told += ["--state", ",".join(recipe.states or ())]
        told += (
            ["--by", recipe.differentiate or ""] if recipe.actions is None else ["--action", ",".join(recipe.actions)]
        )
    for option in context.command.params:
        name = option.name or ""
        given = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if given and name not in ("files", "output", "force", "leave_out"):
            value = context.params[name]
            for one in value if getattr(option, "multiple", False) else [value]:
                told += _option(option.opts[0], one)
    return shlex.join(told), "-o policy.npz"


def _option(name: str, value: Any) -> list[str]:
    """One option as it is typed."""
    if value is True:
        return [name]
    if isinstance(value, tuple):
        return [name, ",".join(map(str, value))]
    return [name, str(value)]

"""``unconstrain constraint``: what held the recordings; and where the other commands take it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

import unconstrain as uc

from ..base.errors import InvalidDataError, SettingError
from ..base.files import write
from .informing import provenance
from .printing import of_option, option_for_json, print_table, refuse_warnings, say_verdict, say_written
from .progress import shown
from .reading import numbers, options_for_reading, prepared, said_recipe
from .writing import check_name, check_outputs, option_for_force

MOST_POSITIONS = 4000
"""Positions, at most, by which a mechanism is named; more are thinned evenly."""

FEATURES = ("auto", "constant", "affine", "quadratic", "rbf")


@click.command(epilog="\b\nExample:\n  unconstrain constraint wipe_*.csv --state x,y,z --differentiate -o plate.npz")
@options_for_reading
@click.option("-o", "--output", required=True, type=click.Path(dir_okay=False), help="File for the constraint (.npz).")
@click.option("--features", type=click.Choice(FEATURES), default="auto", show_default=True, help="How A may vary.")
@click.option("--jacobian", metavar="URDF", help="States are joint angles of this robot: what is held is its hand.")
@click.option("--tip", help="With --jacobian: the link that is its hand.")
@click.option("--with-task", is_flag=True, help="Along what is held it moves, as a function of the state.")
@click.option("--surface", is_flag=True, help="Learn from the positions alone: they lie on a surface.")
@click.option("--report", type=click.Path(dir_okay=False), help="Also write an HTML page there.")
@option_for_force
@option_for_json
def constraint(
    files: Sequence[str],
    output: str,
    features: str,
    jacobian: str | None,
    tip: str | None,
    with_task: bool,
    surface: bool,
    report: str | None,
    force: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Learn what held the demonstrations in each FILE.

    Says its rank, form and noise, and what the data does not tell.
    """
    paths = uc.readers.expand(files)
    check_outputs((output, report), (*paths, jacobian), force)
    check_name(output)
    _check_asked(jacobian, tip, surface, with_task)
    with shown("reading, learning"):
        demonstrations, recipe, (first, *_) = prepared(paths, reading)
        states, actions, groups = uc.stack(demonstrations)
        arm = None if jacobian is None else arm_of(jacobian, tip).jacobian
        learnt = uc.LearntConstraint(features, arm, task=with_task)
        learnt.fit(states, None if surface else actions, groups=groups)
    refuse_warnings(reading["strict"])
    if recipe.angles:
        click.echo(f"Note: {', '.join(recipe.angles)} as unwrapped: a turn more is another state to it.", err=True)
    verdict = uc.evaluation.verdicts.of_constraint(learnt)
    named = mechanism_of(demonstrations) if jacobian is None and _are_positions(recipe) else None
    if not as_json:
        say_verdict(verdict)
        click.echo(f"Learnt from {said_recipe(recipe, first)}.")
        _say(learnt, "distance from it" if surface else "action", named)
    uc.save(learnt, output, provenance(paths, recipe, first, **reading))
    if report is not None:
        from ..pages.constraint import constraint_page

        names = recipe.labels(first.units)[0]
        write(report, constraint_page(learnt, demonstrations, Path(report).stem, names, *(named or ())))
    written = {"constraint": output} | ({} if report is None else {"report": report})
    say_written(written, _told(learnt, verdict, named) if as_json else None)


def _check_asked(jacobian: str | None, tip: str | None, surface: bool, with_task: bool) -> None:
    if (jacobian is None) != (tip is None):
        raise SettingError("--jacobian and --tip belong together: a URDF file, and the link that is held.")
    if surface and (with_task or jacobian is not None):
        raise SettingError("--surface: got --with-task or --jacobian too; positions alone show neither.")


def _told(learnt: uc.LearntConstraint, verdict: uc.evaluation.verdicts.Verdict, named: Named | None) -> dict[str, Any]:
    choice = learnt.choice_
    return {
        "rank": learnt.rank_,
        "noise": learnt.noise_,
        "held_out": choice.held_out,
        "features": choice.name,
        "candidates": dict(choice.candidates),
        "doubts": list(choice.doubts),
        "mechanism": None if named is None else named.summary,
        "mechanisms": {} if named is None else dict(named.each),
        "verdict": verdict.to_json(),
    }


def options_for_held(what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the options that name a constraint."""
    plane = click.option("--plane", type=numbers, help=f"Normal of a plane {what}.")
    learnt = click.option("--constraint", type=click.Path(), help=f"Learnt constraint {what} (.npz).")
    return lambda command: plane(learnt(command))


def held_of(
    plane: tuple[float, ...] | None, path: str | None, recipe: uc.Recipe, states: int, actions: int, meaning: str
) -> uc.constraints.Constraint | None:
    """The constraint of the options: a plane, or a learnt one from a file, of the states that a recipe prepares."""
    import numpy as np

    if plane is not None and path is not None:
        raise SettingError("--plane: got --constraint too, expected one of them.")
    if plane is not None:
        if len(plane) != actions:
            raise SettingError(f"--plane: got {len(plane)} numbers, expected {actions}, {meaning}.")
        with of_option("--plane"):
            return uc.constraints.Plane(np.array(plane))
    if path is None:
        return None
    known_arms()
    learnt = uc.load(path, uc.LearntConstraint)
    found = learnt.choice_.columns, learnt.choice_.actions
    if found != (states, actions):
        raise SettingError(f"{path}: holds {found[1]} actions at {found[0]} states, expected {actions} at {states}.")
    own = uc.Recipe.from_dict(uc.storage.load_notes(path).get("recipe", {}))
    if own.states and recipe.states and (own.states, own.centre) != (recipe.states, recipe.centre):
        raise SettingError(f"{path}: is of {_said_states(own)}, expected {_said_states(recipe)}, as the policy.")
    return learnt


def _said_states(recipe: uc.Recipe) -> str:
    return f"{', '.join(recipe.states or ())}{', centred' if recipe.centre else ''}"


def arm_of(urdf: str, tip: str | None) -> Any:
    """The chain of a robot up to a link."""
    return known_arms().from_urdf(urdf, tip)


def known_arms() -> Any:
    """The class of arms; a learnt constraint that knows one can then be loaded."""
    from ..paper.systems.arm import Arm

    uc.storage.register(Arm)
    return Arm


class Named(NamedTuple):
    """What may have held some demonstrations, in words; and what each, with its name, where they differ."""

    summary: str
    each: list[tuple[str, str]]


def mechanism_of(demonstrations: Sequence[uc.Demonstration]) -> Named | None:
    """Which mechanism may have held positions; None where too little was recorded."""
    positions, _, groups = uc.stack(demonstrations)
    every = -(-len(positions) // MOST_POSITIONS)
    try:
        found = uc.constraints.identify(positions[::every], groups=groups[::every])
    except InvalidDataError as error:
        click.echo(f"Note: no mechanism is named: {error}", err=True)
        return None
    names = [demonstrations[number].name for number in dict.fromkeys(groups[::every].tolist())]
    held = found.candidates[0].mechanisms
    each = [] if len(held) == 1 else [(name, one.sentence) for name, one in zip(names, held, strict=True)]
    return Named(found.summary, each)


def _are_positions(recipe: uc.Recipe) -> bool:
    """Whether two or three states may be positions: their velocity is what is learnt from."""
    count = len(recipe.states or ())
    return recipe.actions is None and count in (2, 3) and recipe.space == uc.spaces.Euclidean(count)


def _say(learnt: uc.LearntConstraint, what: str, named: Named | None) -> None:
    choice = learnt.choice_
    smooth = f", smoothed with {choice.smoothness:g}" if choice.smoothness else ""
    click.echo(f"{learnt.rank_} of {choice.actions} directions held, by {choice.name} features{smooth}.")
    click.echo(
        f"Noise and misfit along them are about {learnt.noise_:.3g} of {what}, and where held out "
        f"{choice.held_out:.3g} of its mean square."
    )
    rows = [[name, f"{share:.3g}"] for name, share in choice.candidates.items()]
    print_table(["features", "missed where held out"], rows)
    for doubt in choice.doubts:
        click.echo(f"Note: {doubt}", err=True)
    if named is not None:
        click.echo(f"Mechanism, if these are positions in m: {named.summary}.")
    if named is not None and named.each:
        print_table(["demonstration", "mechanism"], named.each)

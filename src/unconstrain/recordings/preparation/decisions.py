"""What a recipe leaves open is decided by a look at the first recording, and said where it changes what is learnt."""

import re
from dataclasses import replace

import numpy as np

from ...base.arrays import Array
from ...base.display import bare, listed
from ...base.errors import SettingError
from ..demonstration import Recording
from ..remarks import Remark
from ..signals.orientations import TURNS, in_degrees, wraps
from .guesses import siblings
from .plausibility.checks import STEADY, targets
from .plausibility.subject import LEAST_ROWS, Subject
from .recipes import Recipe, complete_recipe, stamps

DEGREES = re.compile(r"\s*(deg|degs|degrees?|[°º])\s*((/|per |\*|·)?\s*s(ec|econds?)?(\^?-1|⁻¹)?)?\s*", re.IGNORECASE)
"""How people write degrees, and degrees a second."""

JOINT = re.compile(
    r"(.*[._/ ])?(q|j(?=[._ ]?\d)|qpos|theta|joints?|shoulder|elbow|wrist|hip|knee|ankle)"
    r"([._ ]?(left|right|[lr]|pan|lift|roll|pitch|yaw|flex|flexion|rotation|angle|joint|pos|position|\d+|\[\d+\]))*",
    re.IGNORECASE,
)
"""How people call a joint: markers at one, such as ``wrist_x``, are positions."""

ANGLE = re.compile(
    r"(.*[._/ ])?(yaw|pitch|roll|heading|theta|phi|psi|\w*angle)([._ ]?(deg|degrees|rad|radians|\d+))*", re.IGNORECASE
)
"""How people call an angle."""

FARTHEST, STILL = 2.0, 0.05
"""Turns from end to end that joints of arms have at most; and a position that moves by less than this share of those
beside it stands still, but for noise."""


def decide(recipe: Recipe, recording: Recording) -> tuple[Recipe, tuple[Remark, ...]]:
    """Complete a recipe: the columns by their names, what the actions are by their numbers.

    Changes to the next sample are left as they are: at a steady rate they have the directions of velocities.

    Returns
    -------
    recipe : Recipe
        As :func:`~.recipes.complete_recipe` completes it, with columns in degrees by their units, and without actions
        that are the states to come.
    remarks : tuple of Remark
        What was decided against what a name says.

    Raises
    ------
    SettingError, InvalidDataError
        As :func:`~.recipes.complete_recipe`.
    """
    completed = in_radians(complete_recipe(recipe, recording), recording)
    said = (*_about_degrees(recipe, completed, recording), *unused(recipe, completed, recording))
    if completed.actions is None or not (found := targets(Subject(recording, completed))):
        return _of_used_columns(completed), said
    if stamps(recording, completed) is None:  # nothing to differentiate by
        return _of_used_columns(completed), (*said, found)
    message = "are the states to come, so the velocity of the states is learnt; action_is='velocity' forbids it."
    decided = complete_recipe(replace(completed, action_is="target"), recording)
    return _of_used_columns(decided), (*said, found._replace(message=message))


def in_radians(recipe: Recipe, recording: Recording) -> Recipe:
    """A recipe with the columns in degrees: those that it tells, or whose unit or, of angles, whose numbers say so."""
    if recipe.degrees is not None:
        told = recording.resolve(recipe.degrees)
        return replace(recipe, degrees=tuple(one for one in told if not _says_radians(recording, one)))
    used = _used(recipe)
    units = {name: recording.units.get(name, "") for name in used}
    shown = {name for name in used if name in recipe.angles and not units[name]}
    shown = {name for name in shown if in_degrees(recording.select([name])[:, 0])}
    return replace(recipe, degrees=tuple(name for name in used if name in shown or DEGREES.fullmatch(units[name])))


def _of_used_columns(recipe: Recipe) -> Recipe:
    """Without degrees of columns that are not used, such as actions that are states to come."""
    return replace(recipe, degrees=tuple(name for name in recipe.degrees or () if name in _used(recipe)))


def _says_radians(recording: Recording, name: str) -> bool:
    return recording.units.get(name, "").startswith("rad")


def _used(recipe: Recipe) -> tuple[str, ...]:
    return (*(recipe.states or ()), *(recipe.actions or ()))


def unused(asked: Recipe, decided: Recipe, recording: Recording) -> tuple[Remark, ...]:
    """Remarks on columns that move and are no states: beside guessed ones, on angles how to take them in; else on z."""
    columns, used = zip(recording.columns, recording.values.T, strict=True), _used(decided)
    if asked.states is not None or not decided.states:
        return _siblings(decided.states, dict(columns), used) if decided.states else ()
    moving = {name: column for name, column in columns if name not in used and _moves(column)}
    angles = [name for name in moving if ANGLE.fullmatch(bare(name)) or wraps(moving[name])]
    angles = [] if decided.actions else angles  # which have no velocity then
    large = [name for name in angles if np.nanmax(np.abs(moving[name])) > TURNS[0]]
    degrees = [*(decided.degrees or ()), *(one for one in large if not _says_radians(recording, one))]
    cure = f"angles={(*decided.angles, *angles)}" + f" and degrees={tuple(degrees)}" * bool(degrees)
    told = f"looks like an angle, and is left out; take it in with {cure}."
    others = listed([name for name in moving if name not in angles], 8)
    more = len({*recording.columns} - {*used, *moving})
    others += f" and {more} more, at rest or counts," * bool(others and more)
    note = Remark("unused", f"{others} left out; name with states= what makes the state.")
    return (*(Remark("angle-unused", told, one) for one in angles[:1]), *[note] * bool(others))


def _siblings(states: tuple[str, ...], columns: dict[str, Array], used: tuple[str, ...]) -> tuple[Remark, ...]:
    known = {name: columns[name][np.isfinite(columns[name])] for name in siblings((*columns,), states)}
    far = {name: float(np.ptp(values)) for name, values in known.items() if len(values)}
    least = STILL * max((far[name] for name in far if name in states), default=0.0)
    left = [name for name in far if name not in used and far[name] > least and _moves(columns[name])]
    said = f"too, and is not taken: states={(*states, *left)} if the task depends on it."
    return tuple(Remark("unused", f"moves by {far[name]:.3g} {said}", name) for name in left[:1])


def _moves(column: Array) -> bool:
    """Whether a column (T,) takes many values, and does not rise steadily as clocks and counts do."""
    values = column[np.isfinite(column)][:: max(1, len(column) // 200)]
    steps, many = np.diff(values), len(np.unique(values)) > LEAST_ROWS
    return many and not ((steps > 0).all() and np.quantile(np.abs(steps / np.median(steps) - 1.0), 0.9) <= STEADY)


def _about_degrees(asked: Recipe, decided: Recipe, recording: Recording) -> tuple[Remark, ...]:
    degrees, used = decided.degrees or (), _used(decided)
    if others := set(degrees) - {*used, *recording.resolve(asked.actions or ())}:
        raise SettingError(f"degrees: got {', '.join(sorted(others))}, expected some of {', '.join(used)}.")
    if told := [name for name in recording.resolve(asked.degrees or ()) if name not in degrees]:
        return (Remark("degrees", f"{', '.join(told)} is in radians, as its unit says, and is left so."),)
    if asked.degrees is not None or not degrees:
        return may_be_degrees(asked, decided, recording)
    return (Remark("degrees", f"{', '.join(degrees)} is taken in radians; degrees=() forbids it."),)


def may_be_degrees(asked: Recipe, decided: Recipe, recording: Recording) -> tuple[Remark, ...]:
    """The remark on joints that go farther than they do in radians, where nothing says their unit."""
    joints = [name for name in decided.states or () if JOINT.fullmatch(name) and not recording.units.get(name)]
    far = float(np.ptp(recording.select(joints), axis=0).max(initial=0.0)) if len(recording) else 0.0
    if asked.degrees is not None or decided.degrees or not far > FARTHEST * TURNS[0]:
        return ()
    said = f"joints go through {far:.3g}, which looks like degrees, and are taken for radians; if they are degrees, "
    return (Remark("degrees", f"{said}say degrees={tuple(joints)}.", joints[0]),)

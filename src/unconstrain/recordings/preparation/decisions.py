"""What a recipe leaves open is decided by a look at the first recording, and said where it changes what is learnt."""

import re
from dataclasses import replace

from ...base.errors import SettingError
from ..demonstration import Recording
from ..remarks import Remark
from ..signals.orientations import in_degrees
from .plausibility.checks import targets
from .plausibility.subject import Subject
from .recipes import Recipe, complete_recipe

DEGREES = re.compile(r"\s*(deg|degs|degrees?|[°º])\s*((/|per |\*|·)?\s*s(ec|econds?)?(\^?-1|⁻¹)?)?\s*", re.IGNORECASE)
"""How people write degrees, and degrees a second."""


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
    said = _about_degrees(recipe, completed)
    if completed.actions is None or not (found := targets(Subject(recording, completed))):
        return completed, said
    message = "are the states to come, so the velocity of the states is learnt; --action-is velocity forbids it."
    decided = complete_recipe(replace(completed, action_is="target"), recording)
    return decided, (*said, found._replace(message=message))


def in_radians(recipe: Recipe, recording: Recording) -> Recipe:
    """A recipe with the columns in degrees: those that it tells, or whose unit or, of angles, whose numbers say so."""
    if recipe.degrees is not None:
        return replace(recipe, degrees=recording.resolve(recipe.degrees))
    used = (*(recipe.states or ()), *(recipe.actions or ()))
    units = {name: recording.units.get(name, "") for name in used}
    shown = {name for name in used if name in recipe.angles and not units[name]}
    shown = {name for name in shown if in_degrees(recording.select([name])[:, 0])}
    return replace(recipe, degrees=tuple(name for name in used if name in shown or DEGREES.fullmatch(units[name])))


def _about_degrees(asked: Recipe, decided: Recipe) -> tuple[Remark, ...]:
    degrees, used = decided.degrees or (), (*(decided.states or ()), *(decided.actions or ()))
    if others := set(degrees) - set(used):
        raise SettingError(f"degrees: got {', '.join(sorted(others))}, expected some of {', '.join(used)}.")
    if not degrees or asked.degrees is not None:
        return ()
    return (Remark("degrees", f"{', '.join(degrees)} is taken in radians; --degrees none forbids it."),)

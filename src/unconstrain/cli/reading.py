"""Options for reading files: columns and preparation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

import unconstrain as uc

from ..base.errors import SettingError


def names(text: str) -> tuple[str, ...]:
    """Names separated by commas."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def numbers(text: str) -> tuple[float, ...]:
    """Finite numbers separated by commas."""
    try:
        values = tuple(map(float, text.split(",")))
    except ValueError:
        values = ()
    if not values or not all(map(math.isfinite, values)):
        raise click.BadParameter(f"got {text!r}, expected finite numbers separated by commas, such as 0.1,0,-2.")
    return values


def options_for_reading(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for reading and preparing files."""
    for option in reversed(
        [
            click.argument("files", nargs=-1, required=True, metavar="FILE..."),
            click.option("--state", type=names, help="Columns that make the state, such as x,y,z."),
            click.option("--action", type=names, help="Columns that make the action, such as vx,vy,vz."),
            click.option("--differentiate", is_flag=True, help="Take the velocity of the state as the action."),
            click.option(
                "--by",
                type=click.Choice(["savgol", "central"]),
                help="How to differentiate, savgol by default; implies --differentiate.",
            ),
            click.option("--window", type=float, help="Smoothing window of savgol, seconds."),
            click.option("--still", type=float, help="Trim what is slower than this at start and end."),
            click.option("--rate", type=float, help="Resample to this many samples a second."),
            click.option("--centre", is_flag=True, help="States relative to the mean of each demonstration."),
            click.option("--group", help="Column that names the demonstration."),
            click.option("--time", help="Column with the time in seconds."),
        ]
    ):
        command = option(command)
    return command


def recipe_of(
    state: tuple[str, ...] | None = None,
    action: tuple[str, ...] | None = None,
    differentiate: bool = False,
    by: str | None = None,
    window: float | None = None,
    rate: float | None = None,
    centre: bool = False,
    still: float | None = None,
    **_: Any,
) -> uc.Recipe:
    """The recipe of the options."""
    if differentiate or by:
        if action is not None:
            raise SettingError("--action: got columns, and --differentiate or --by too; give one or the other.")
        by = by or "savgol"
    recipe = uc.Recipe(state, action, by, rate=rate, centre=centre, still=still)
    return recipe if window is None else replace(recipe, window_s=window)


def complete(recipe: uc.Recipe, recording: uc.Recording) -> uc.Recipe:
    """Guess what was not said; what was said has to be there."""
    recording.select([*(recipe.states or ()), *(recipe.actions or ())])
    return uc.preparation.complete_recipe(recipe, recording)


def said_recipe(recipe: uc.Recipe) -> str:
    """A recipe in words."""
    states = ", ".join(recipe.states or ())
    smoothed = f"savgol, {recipe.window_s:g} s" if recipe.differentiate == "savgol" else "central differences"
    actions = f"their velocity ({smoothed})" if recipe.actions is None else f"{', '.join(recipe.actions)} as actions"
    return f"{states} as states and {actions}" + ("" if recipe.actions else " as actions")


def roles_of(group: str | None = None, time: str | None = None, **_: Any) -> dict[str, Any]:
    """The columns that name the demonstration and hold the time, as the options say."""
    return {"group": group, "time": time}


def stream_of(paths: Sequence[str | Path], speed_power: float, **reading: Any) -> uc.Stream:
    """Files as batches to learn from, as the options say."""
    roles, asked = roles_of(**reading), recipe_of(**reading)
    return uc.Stream(paths, complete(asked, uc.Stream(paths, asked, **roles).first), speed_power=speed_power, **roles)

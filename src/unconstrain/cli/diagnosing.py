"""``unconstrain diagnose``: what recordings determine, and what to record next."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

import unconstrain as uc

from ..base.files import write
from .fitting import options_for_model, policy_of
from .printing import print_table, refuse_warnings, say
from .reading import options_for_reading, reading_of, recipe_of, said_recipe
from .writing import check_outputs, option_for_force

MOST_ROWS = 8


@click.command(epilog="\b\nExample:\n  unconstrain diagnose wipe_*.csv --state x,y,z --by savgol -o a.html")
@options_for_reading
@options_for_model
@click.option("-o", "--report", type=click.Path(dir_okay=False), help="Also write an HTML page there.")
@option_for_force
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def diagnose(
    files: Sequence[str],
    model: str,
    variance: float | None,
    centres: int | None,
    report: str | None,
    force: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Report noise, undetermined states, and what to record next.

    Learns from each FILE, and also reports where constraints vary too little and which demonstrations look free.
    """
    paths = uc.readers.expand(files)
    check_outputs((report,), paths, force)
    every = uc.read(paths, **reading_of(**reading).arguments)
    recordings = [one for one in every if one.name not in reading["leave_out"]]
    asked = recipe_of(**reading)
    demonstrations = uc.prepare(recordings, asked)
    recipe, _ = uc.preparation.decide(asked, recordings[0])
    policy = policy_of(model, variance, centres, learner=uc.Robust()).fit_demonstrations(demonstrations)
    found = uc.evaluation.diagnose(policy, demonstrations)
    missed = 1.0 - policy.score(*uc.stack(demonstrations)[:2])
    say(uc.preparation.doubts(len(demonstrations), missed), "diagnose")
    refuse_warnings(reading["strict"])
    states = recipe.states or ()
    actions = recipe.actions or recipe.directions
    if as_json:
        click.echo(json.dumps(found.to_json() | {"states": states, "actions": actions}, indent=2))
    else:
        used = said_recipe(recipe, recordings[0])
        click.echo(f"{len(demonstrations)} demonstrations, {len(found.undetermined)} samples; {used}.")
        _say(found, states, actions)
    if report is not None:
        from ..pages.diagnosis import diagnosis_page

        write(report, diagnosis_page(found, demonstrations, Path(report).stem, states, actions))
        click.echo(f"report: {report}", err=as_json)


def _say(found: uc.evaluation.Diagnosis, states: Sequence[str], actions: Sequence[str]) -> None:
    named = uc.evaluation.diagnosis.named
    for line in uc.evaluation.diagnosis.sentences(found, states, actions):
        click.echo(line)
    shown = found.regions[:MOST_ROWS]
    click.echo(f"\nThe {len(shown)} regions of largest undetermined spread, of {len(found.regions)}, largest first:")
    head = ["demonstrate around", "in", "samples", "determined", "spread", "leave free"]
    rows = [
        [named(one.state, states), one.demonstration, str(one.samples), f"{one.determined:.0%}", f"{one.along:.1%}",
         named(one.direction, actions)]
        for one in shown
    ]  # fmt: skip
    print_table(head, rows)
    free = sorted(found.movements, key=lambda one: -(one.free or 0.0))
    click.echo("\nMean probability that a sample was free, of the freest and the most constrained demonstrations:")
    ends = free if len(free) <= MOST_ROWS else [*free[: MOST_ROWS // 2], *free[-MOST_ROWS // 2 :]]
    print_table(
        ["demonstration", "samples", "free", "determined"],
        [[one.name, str(one.samples), f"{one.free or 0.0:.0%}", f"{one.determined:.0%}"] for one in ends],
    )

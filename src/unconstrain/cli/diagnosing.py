"""``unconstrain diagnose``: what recordings determine, and what to record next."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import click

import unconstrain as uc

from ..base.display import counted, percent, unit_of
from ..base.files import write
from .fitting import options_for_model, policy_of
from .printing import as_noted, explained, option_for_json, print_table, refuse_warnings, say, say_scale, say_verdict
from .progress import shown
from .reading import check_enough, options_for_reading, prepared, said_recipe
from .writing import check_outputs, option_for_force

MOST_ROWS, MOST_LISTED = 8, 16
"""Places and demonstrations that are listed without -v."""

LEGEND = {
    "told by all": "share of samples there at which all recordings leave open a tenth of an action, or below noise.",
    "told by three": "the same whichever two are left out; of each state 'told' of uc.evaluation.diagnose says it.",
    "may be off by": "of a typical action, any two left out, misfit apart; if large, yet told by all, it hangs on few.",
    "moved by": "how many moved along 'leave free' there, by more than noise; others, elsewhere, may tell it, too.",
}


@click.command(epilog="\b\nExample:\n  unconstrain diagnose wipe_*.csv --state x,y,z --by savgol -o a.html")
@options_for_reading
@options_for_model
@click.option("-o", "--report", type=click.Path(dir_okay=False), help="Also write an HTML page there.")
@option_for_force
@click.option("-v", "--verbose", is_flag=True, help="Print all regions and demonstrations.")
@option_for_json
def diagnose(
    files: Sequence[str],
    model: str,
    variance: float | None,
    centres: int | None,
    scale: Any,
    report: str | None,
    force: bool,
    verbose: bool,
    as_json: bool,
    **reading: Any,
) -> None:
    """Report noise, undetermined states, and what to record next.

    Learns from each FILE, and also reports where constraints vary too little and which demonstrations look free.
    """
    paths = uc.readers.expand(files)
    check_outputs((report,), paths, force)
    with shown("reading, placing, learning"):
        policy = policy_of(model, variance, centres, scale, learner=uc.Robust())
        demonstrations, recipe, (first, *_) = prepared(paths, reading)
        check_enough(demonstrations)
        policy.fit_demonstrations(demonstrations)
        found = uc.evaluation.diagnose(policy, demonstrations)
    say(uc.preparation.doubts(len(demonstrations), 1.0 - explained(policy, demonstrations)))
    refuse_warnings(reading["strict"])
    states, actions = recipe.states or (), recipe.actions or recipe.directions
    judged = uc.evaluation.verdicts.of_diagnosis(found, uc.evaluation.diagnosis.to_record(found, states, actions))
    judged = uc.evaluation.diagnosis.about_recordings(judged, demonstrations, recipe, policy)
    verdict = as_noted(judged, len(demonstrations))
    if as_json:
        named = {"states": states, "actions": actions, "verdict": verdict.to_json()}
        click.echo(json.dumps(found.to_json() | named, indent=2))
    else:
        say_verdict(verdict)
        counts = counted(len(demonstrations), "demonstration"), counted(len(found.undetermined), "sample")
        click.echo(f"{', '.join(counts)}; {said_recipe(recipe, first)}.")
        say_scale(policy, recipe)
        _say(found, states, actions, "" if policy.scale_ else unit_of(recipe.labels(first.units)[1]), verbose)
    if report is not None:
        from ..pages.diagnosis import diagnosis_page

        title = f"Diagnosis of {paths[0].name}{f' and {len(paths) - 1} more' * (len(paths) > 1)}"
        write(report, diagnosis_page(found, demonstrations, title, *recipe.labels(first.units), verdict))
        click.echo(f"report: {report}", err=as_json)


def _say(found: uc.evaluation.Diagnosis, states: Sequence[str], actions: Sequence[str], unit: str, all_: bool) -> None:
    for line in uc.evaluation.diagnosis.sentences(found, states, actions, unit):
        click.echo(line)
    if all_ or uc.evaluation.diagnosis.needs_more(found):
        _say_places(found, states, actions, all_)
    else:
        click.echo(f"\n{uc.evaluation.diagnosis.nowhere(found, ' (-v lists all)')}")
    about, kinds = uc.evaluation.diagnosis, {one.looks for one in found.movements}
    others = kinds - {*about.COUNTED}
    if None in kinds or (kinds == others and len(others) == 1):
        return
    free = sorted(found.movements, key=lambda one: -(one.free or 0.0))
    said = f"Mean probability that a sample was free; above {percent(about.FREE)} a demonstration looks free, below "
    said += f"{percent(about.CONSTRAINED)} constrained, and a policy is learnt from both"
    said += "; on a plane, on a line, winding and undecided it tells nothing" * bool(others)
    half = len(free) if all_ else MOST_LISTED // 2
    ends, left = [*free[:half], *free[half:][-half:]], max(len(free) - 2 * half, 0)
    rows = [[one.name, str(one.samples), about.LOOKS[str(one.looks)].partition(" that ")[0].partition(" (")[0],
             percent(one.free or 0.0), percent(one.determined)] for one in ends]  # fmt: skip
    click.echo(f"\n{said}{f' (-v lists {left} more, between)' * bool(left)}:")
    print_table(["demonstration", "samples", "looks", "free", "told by three"], rows)


def _say_places(found: uc.evaluation.Diagnosis, states: Sequence[str], actions: Sequence[str], all_: bool) -> None:
    ranked = uc.evaluation.verdicts.ranked(found)
    every = uc.evaluation.diagnosis.places(ranked)
    shown = ranked if all_ else every[:MOST_ROWS]
    count = f"{len(every)} ({len(found.regions)} regions)"
    first = "what all leave open first, but where a stroke that looks free passed, last of it; largest first"
    click.echo(f"\nThe {len(shown)} places where least is known, of {count}; {first}:")
    around, along = (" ".join(name.partition(" [")[0] for name in names) for names in (states, actions))
    head = [f"demonstrate around\n({around})", "recorded\nin", "told\nby all", "told by\nthree", "may be\noff by",
            f"leave free\n({along})", "moved\nby"]  # fmt: skip
    rows = [
        [" ".join(f"{float(f'{value:.3g}'):g}" for value in one.state), one.demonstration, percent(one.together),
         percent(one.determined), percent(one.along), " ".join(f"{value:.2f}" for value in one.direction),
         str(len(one.shown_by))]
        for one in shown
    ]  # fmt: skip
    print_table(head, rows)
    for name, meant in LEGEND.items():
        click.echo(click.wrap_text(f"{name}: {meant}", 80, subsequent_indent="  "))

"""``unconstrain info``: what one file says of itself; and what ``fit`` and ``constraint`` write down for it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from hashlib import blake2b
from pathlib import Path
from typing import Any

import click

import unconstrain as uc

from ..base.display import innermost, percent, unit_of
from .printing import print_table, say_verdict
from .reading import loaded, reading_of, to_copy

TOLD, NOISE = "determined share of states", "missed for noise alone"
"""Notes of shares: of the recorded states at which recordings tell the policy in every direction, and of what noise of
the actions lets a policy miss of a typical one."""

LOST = "explained less by guiding"
"""Note of the share of what a policy learnt from that it explains less as it is guided."""

RAN = "from the same starts"
"""Note of size and pace of the policy's own movements over those of the demonstrations, in figures."""

MOVES = "run from the same starts"
"""Note of what is wrong with these movements in words, or that they keep size and pace."""

GUIDE = "can be guided to"
"""Note of what ``--guided`` takes: auto, cycle or goal; empty where there is none, as of angles."""

MARK = "verdict"
"""Note of how ``fit`` judged it."""

OF, SHOWN, WHERE, PASSING = "of", "shown by positions", "least and largest states", "let pass"
"""Notes of a constraint: of which demonstrations; if a mechanism is sure; where; how much of it does not hold."""

CONTENTS, ENDS = "contents", 2**16
"""Note of what each demonstration is known again by, and bytes at either end of a file by which that is."""


def constraints() -> Any:
    """What a robot can be held by that files hold: what was learnt, or a mechanism that was saved by itself."""
    return uc.LearntConstraint | uc.constraints.mechanisms.Mechanism


def provenance(paths: Iterable[str | Path], recipe: uc.Recipe, first: uc.Recording, **reading: Any) -> dict[str, Any]:
    """What goes into the file of a policy or constraint beside it: recipe, roles, units, sources, date."""
    sources = [*map(Path, paths)]
    return {
        "recipe": recipe.to_dict(),
        **reading_of(**reading).roles,
        "units": recipe.units(first.units),
        "sources": [Path(path).name for path in sources],
        "digests": [*map(digest_of, sources)],
        CONTENTS: reading.get(CONTENTS, []),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "made with": f"unconstrain {uc.__version__}",
    }


def digest_of(path: Path) -> str:
    """By what a file is known again under another name: its size and its ends; empty for a folder."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        size, head = path.stat().st_size, file.read(ENDS)
        file.seek(max(size - ENDS, 0))
        return f"{size}-{blake2b(head + file.read(ENDS), digest_size=8).hexdigest()}"


def learnt_from(
    policy: uc.Policy | uc.Guided, notes: Mapping[str, Any], recordings: Sequence[uc.Recording], recipe: uc.Recipe
) -> list[str] | None:
    """Which recordings, of columns of a recipe, a policy learnt from, by content or file and name; None if unknown."""
    sources, contents = notes.get("digests"), notes.get(CONTENTS)
    learnt = [str(name).partition("/") for name in innermost(policy).training_.split.fold_of]
    if not contents and not (sources and learnt):
        return None
    known = {(sources[int(number)], name) for number, _, name in learnt if number.isdecimal()} if sources else ()
    digests = {file: digest_of(Path(file)) for file in {one.file for one in recordings}}
    same = {one.name for one in recordings if contents and one.content(recipe).hexdigest() in contents}
    return [one.name for one in recordings if one.name in same or (digests[one.file], one.name) in known]


@click.command(epilog="\b\nExample:\n  unconstrain info wipe.npz --json")
@click.argument("file", type=click.Path())
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def info(file: str, as_json: bool) -> None:
    """Say what is in FILE, and where it comes from.

    A policy, guided or not, or a constraint.
    """
    held, notes = loaded(file, uc.Policy | uc.Guided | constraints()), uc.storage.load_notes(file)
    inner = ("recipe", "units", "digests", CONTENTS, GUIDE, MARK, NOISE, MOVES, SHOWN, WHERE, PASSING)
    rest = {name: value for name, value in notes.items() if name not in inner}
    verdict = to_copy(verdict_of(held, notes), file, notes)
    told = {"file": Path(file).name, "holds": type(held).__name__, **_columns(notes), **_of(held, notes), **rest}
    if as_json:
        click.echo(json.dumps(told | {"verdict": verdict.to_json()}, indent=2))
        return
    say_verdict(verdict)
    other = "a mechanism" if (by := _held_by(held)) is held else "a policy"
    kind = {uc.LearntConstraint: "a learnt constraint", uc.Guided: "a guided policy"}.get(type(held), other)
    kind += f": {by.title}" if by else ""
    told["holds"] = f"{kind}: {told.pop('model')}" if "model" in told else kind
    if told.get("noise") and isinstance(innermost(held), uc.Policy) and not innermost(held).scale_:
        told["noise"] = f"{told['noise']:.4g} {unit_of(told.get('actions', ()))}".rstrip()
    told |= {TOLD: f"{percent(told[TOLD])}, by all recordings together"} if told.get(TOLD) is not None else {}
    rows = [[name, _said(value)] for name, value in told.items() if value not in (None, [], {}, "")]
    print_table(["", ""], rows, uc.evaluation.verdicts.WIDTH)


def _columns(notes: Mapping[str, Any]) -> dict[str, Any]:
    """Names with units, and what they are relative to."""
    recipe, units = uc.Recipe.from_dict(notes.get("recipe", {})), notes.get("units", {})
    states, actions = recipe.labels(units)
    return {
        "states": list(states),
        "actions": list(actions),
        "recorded in degrees": list(recipe.degrees or ()),
        "centring": "states relative to the mean of each demonstration" if recipe.centre else "none",
        "actions are": "columns" if recipe.actions else f"velocities of the states ({recipe.differentiate})",
        "rate_hz": recipe.rate,
    } if states else {"states": None}  # fmt: skip


def _of(held: Any, notes: Mapping[str, Any]) -> dict[str, Any]:
    """What was learnt, and how; a guided policy is told by the one in it, less what guiding takes."""
    if by := _held_by(held):
        told = {"held": f"{by.rank} of {len(by.centre)} directions", "mechanism": by.sentence}
        return told | ({} if held is by else {"noise": held.noise_})
    if isinstance(held, uc.LearntConstraint):
        told = {"held": f"{held.rank_} of {held.choice_.actions} directions", "features": held.choice_.name}
        return told | {"noise": held.noise_}
    policy, lost = innermost(held), notes.get(LOST) or 0.0
    solution = getattr(policy, "solution_", None)
    if solution is None:
        return {"fitted": False}
    share, alone = policy.held_out_score() - lost, 1.0 - solution.left_out - lost if solution.left_out else None
    return {
        "demonstrations": len(policy.training_.split.fold_of) or None,  # None where nobody told them apart
        "learnt from": sorted(str(name).partition("/")[2] or str(name) for name in policy.training_.split.fold_of),
        "learner": one if isinstance(one := policy.learner, str) else type(uc.learners.named(one)).__name__,
        "learnt as": solution.method,
        "learnt as, in words": uc.evaluation.diagnosis.in_words(solution.method) or None,
        "model": uc.evaluation.diagnosis.models_of(policy),
        "explained held out": None if share != share else round(share if alone is None else alone, 4),
        "explained if one model holds for all": None if alone is None else round(share, 4),
        "noise": None if solution.belief is None else solution.noise,
        "guided": held.aim_.promise if isinstance(held, uc.Guided) else None,
    }


def _held_by(held: Any) -> Any:
    """The mechanism that a constraint holds to; None if there is none, and of a policy."""
    return held if isinstance(held, uc.constraints.mechanisms.Mechanism) else getattr(held, "mechanism_", None)


def verdict_of(held: Any, notes: Mapping[str, Any]) -> uc.evaluation.verdicts.Verdict:
    """Judge a policy, constraint or guided policy by what it explained where held out, and what ``fit`` wrote down."""
    if (by := _held_by(held)) is held:
        said = f"{by.sentence[0].upper()}{by.sentence[1:]}. How sure that is was not saved with it."
        return uc.evaluation.verdicts.Verdict(uc.evaluation.verdicts.Mark.DOUBTFUL, said)
    if isinstance(held, uc.LearntConstraint):
        verdicts, shown = uc.evaluation.verdicts, notes.get(SHOWN)
        passing = notes.get(PASSING) or (0.0, "")
        passing = passing if isinstance(passing, list | tuple) else (passing, "a mechanism")  # as files once had it
        found = verdicts.of_passing(verdicts.of_constraint(held, shown=shown), *passing)
        found = verdicts.of_mechanism(found, held.choice_.fields.rank, by, shown is True) if by else found
        return verdicts.of_files(found, held) if SHOWN in notes else found
    if not hasattr(innermost(held), "solution_"):
        mark = uc.evaluation.verdicts.Mark.BAD
        return uc.evaluation.verdicts.Verdict(mark, "Not fitted: it cannot predict.", next="'unconstrain fit'")
    found = explained_by(held, notes)
    if found.mark is uc.evaluation.verdicts.Mark.GOOD and notes.get(MARK) == "doubtful":
        doubt = f"Its movement over time. {found.doubt}"
        return uc.evaluation.verdicts.doubted(found, _doubt(notes))._replace(doubt=doubt)
    unrun = "" if MARK in notes else " Its movement over time: not run from its starts yet; 'unconstrain score' does."
    ran = f" Run from the same starts, {notes[MOVES]}." if notes.get(MOVES) else ""
    return found._replace(said=found.said + ran, doubt=found.doubt + unrun)


def _doubt(notes: Mapping[str, Any]) -> str:
    """What ``fit`` doubted of a policy that explains enough: how it moves, or else what it noted of recordings."""
    moves = notes.get(MOVES) or "it moves otherwise than was demonstrated"
    kept = all(one.startswith(("it keeps", "it nearly keeps")) for one in moves.split("; unguided "))
    return "its recordings are not all as they should be" if kept else f"run from the same starts, {moves}"


def explained_by(held: uc.Policy | uc.Guided, notes: Mapping[str, Any]) -> uc.evaluation.verdicts.Verdict:
    """How much a policy explains where held out, and whether recordings tell it."""
    policy = innermost(held)
    count = len(policy.training_.split.fold_of) or uc.evaluation.diagnosis.ENOUGH
    shown = notes[TOLD] if isinstance(notes.get(TOLD), float) else None
    more = {"lost": notes.get(LOST), "noise": notes.get(NOISE) or 0.0, "left_out": policy.solution_.left_out}
    return uc.evaluation.verdicts.of_explained(policy.held_out_score(), count, shown, **more)


def doubted(policy: uc.Policy | uc.Guided, notes: Mapping[str, Any]) -> str:
    """What ``fit`` doubted of a policy, as the rest of a sentence; empty where it did not, or nobody noted it."""
    if notes.get(MARK) not in ("doubtful", "bad"):
        return ""
    if (found := explained_by(policy, notes)).mark is not uc.evaluation.verdicts.Mark.GOOD:
        return found.said[0].lower() + found.said[1:].rstrip(".").partition(". ")[0]
    return _doubt(notes)


def _said(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)

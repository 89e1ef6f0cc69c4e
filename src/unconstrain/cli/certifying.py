"""``unconstrain certify``: what is guaranteed of a policy's motion."""

from __future__ import annotations

import shlex
from typing import Any

import click

import unconstrain as uc

from ..base.display import percent, unit_of
from ..base.errors import ModelFileError
from .endings import NOT_GUARANTEED
from .informing import GUIDE, LOST, MOVES, explained_by
from .printing import option_for_json, say_judged
from .reading import loaded, to_copy


@click.command(epilog="\b\nExample:\n  unconstrain certify guided.npz")
@click.argument("policy", type=click.Path())
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the starts and planes that are tried."
)
@option_for_json
def certify(policy: str, seed: int, as_json: bool) -> None:
    """Say what is guaranteed of the motion of POLICY.

    By what margin, where and under which constraints. Where nothing is, the exit code is 3, with a start, and a
    plane, from which it does not arrive.
    """
    import numpy as np

    stored: Any = loaded(policy, object)
    if isinstance(stored, uc.Guided):
        around = stored.goal_ + np.vstack([np.eye(len(stored.goal_)), -np.eye(len(stored.goal_))])
    elif isinstance(stored, uc.Policy) and hasattr(stored, "solution_"):
        around = _learnt_at(stored)
    else:
        raise ModelFileError(f"{policy}: holds no policy that is fitted or guided. Learn one with 'unconstrain fit'.")
    found = uc.certify(stored, around, seed)
    start, normal = (None if one is None else one.tolist() for one in (found.start, found.normal))
    judged = to_copy(_judged(policy, stored, found), policy, uc.storage.load_notes(policy))
    say_judged(judged, {}, as_json, holds=found.holds, start=start, normal=normal)
    if not found.holds:
        raise SystemExit(NOT_GUARANTEED)


def _judged(policy: str, stored: Any, found: uc.motion.certificate.Certificate) -> uc.evaluation.verdicts.Verdict:
    """What is guaranteed, in which units, and what may go against it; or what was found against it."""
    from ..pages.fit import GUIDES

    notes, verdicts = uc.storage.load_notes(policy), uc.evaluation.verdicts
    unit = unit_of(uc.Recipe.from_dict(notes.get("recipe", {})).labels(notes.get("units", {}))[0])
    unit = f"Lengths are in {unit or 'the unit of the states'}, and all rates per second."
    if not found.holds:
        then = GUIDES[notes.get(GUIDE, "cycle")]  # where it is not known, whatever it may be
        then = f"{then} Then certify that." if then else "Its states, such as angles, allow no guide: score it."
        said = f"{policy}: {found.said.replace(' (see uc.Guided)', '')} {unit}"
        return verdicts.Verdict(verdicts.Mark.BAD, said, next=then)
    promise, away, checked = found.said.partition("A constraint that moves or is not told")
    far = "'unconstrain score' says how near it keeps to recordings."
    far = far if notes.get(LOST) is None else explained_by(stored, notes).said
    far = f"That it moves as demonstrated is not guaranteed: {far[0].lower()}{far[1:]}"
    doubt = f"{away}{checked.partition(' Checked at')[0]} {far}".lstrip()
    then, aim = f"unconstrain export {shlex.quote(policy)} -o policy.c", getattr(stored, "aim_", None)
    then = f"To run free (under a new constraint, compare it with one without --guided):\n{then}" if aim else then
    said = f"{policy}: guaranteed is where movements end up, not how they move. {unit}"
    judged = verdicts.Verdict(verdicts.Mark.GOOD, said, promise.strip(), doubt, then)
    guided = (notes.get(MOVES) or "it keeps").partition("; unguided ")[0]
    if aim and not guided.startswith(("it keeps", "it nearly keeps")):
        judged = judged._replace(next=verdicts.UNGUIDED)
        judged = verdicts.doubted(judged, f"run from the starts of demonstrations, {guided}")
    whole = getattr(aim, "whole", 1.0)
    said = f"only {percent(whole)} of the demonstrations that its cycle was drawn from go all the way round"
    return judged if whole > 0.5 else verdicts.doubted(judged, said)


def _learnt_at(policy: Any) -> Any:
    """Places of the states that a policy was learnt from, as far as it says: centres of fields, or of kernels."""
    import numpy as np

    n = policy.n_features_in_
    held = getattr(policy, "fields_", None) or policy.features_
    centres = getattr(held, "centres", None)
    places = np.vstack([np.eye(n), -np.eye(n)]) if centres is None else policy.space_.states(np.asarray(centres))
    return places if policy.scale_ is None else places * policy.scale_.states

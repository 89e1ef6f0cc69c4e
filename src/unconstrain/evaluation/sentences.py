"""A diagnosis in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.display import counted, percent, percents
from ..learners import robust
from .marks import ENOUGH, MISFIT, PARTLY, SMALL
from .shown import named
from .verdicts import misfit, ranked

if TYPE_CHECKING:
    from .diagnosis import Diagnosis, Place

LITTLE = 0.01
"""Shares of samples below this are not worth a sentence."""

FREE, CONSTRAINED = 0.5, 0.1
"""A demonstration looks free above the first, and constrained below the second mean probability of free samples."""

COUNTED = {"free": "free", "constrained": "constrained", "unsure": "either"}
LOOKS = COUNTED | {"flat": "on a plane that others cross (held to it, or short free strokes)"}
LOOKS["line"] = "on a line that others leave (held to it, as by a rail, or straight free strokes)"
LOOKS["round"] = "winding about a surface (held to it, as by a pot, or free strokes that circle)"
LOOKS["untold"] = "undecided (too little else was seen there, or all was held the same way)"
"""How demonstrations look, and how that is said; those of the first three are compared by probability."""

KEPT = ("flat", "line", "round")
"""How those look that keep to something: whether they wanted to is not told."""

MOST_NAMED = 8
"""So many samples that look wrong are named."""


def sentences(found: Diagnosis, states: Sequence[str], actions: Sequence[str], unit: str = "") -> list[str]:
    """The diagnosis in sentences, with the names of the columns, and the unit of the actions if they have one."""
    return [
        _about_noise(found, f" {unit}".rstrip()),
        about_choice(found.method, found.candidates),
        _about_regions(found, states, actions),
        about_freedom(found),
        *about_suspects(found.suspects),
    ]


def about_suspects(places: Sequence[Place]) -> list[str]:
    """Samples that look wrong, in a sentence, if there are any."""
    if not places:
        return []
    number = "1 sample looks" if len(places) == 1 else f"{len(places)} samples look"
    named = ", ".join(map(str, places[:MOST_NAMED])) + ", ..." * (len(places) > MOST_NAMED)
    return [f"{number} wrong beside the neighbours in time, and counted nothing: {named}."]


def _about_noise(found: Diagnosis, unit: str) -> str:
    verdict = "little" if found.noise_share < SMALL else "some" if found.noise_share < 3 * SMALL else "much"
    too_much = found.noise_share > robust.SPHERE_HIDDEN_BY_NOISE
    hidden = " So much noise makes the following unreliable." if too_much else ""
    each = unit or " (unit of the actions)"
    said = f"Noise and misfit: {verdict}, {found.noise:.3g}{each} on each action coordinate, "
    said += f"{percent(found.noise_share)} of a typical action ({found.typical:.3g}{unit}) on all together.{hidden}"
    if found.noise_share < 0.5 * SMALL or found.noise < MISFIT * found.jitter:
        return said
    rest = "the rest is what the model does not follow, fast parts that --window smooths, or people who vary."
    share = percent(found.noise_share * found.jitter / found.noise)
    return f"{said} Only {found.jitter:.3g}{unit} of it ({share}) changes from sample to sample; {rest}"


_WAYS = {
    "direct": "ordinary regression, as constraints do not show",
    "softened hybrid": "consistent with the actions, and near to them",
    "noise-corrected": "consistent with the actions, with the noise taken out",
    "hard noise-corrected": "consistent with the actions, with the noise taken out, and little else supposed",
    "segments": "with one constraint for each demonstration",
    "curved segments": "with one constraint for each demonstration, which turns with the state",
    "likelihood": "each sample free, or held in directions none of which need stay held over a stretch",
    "hybrid": "consistent with the actions, and as near to them as that allows",
    "rows of the Jacobian": "with so many directions of the task held, in each kind of demonstration",
    "own rows of the Jacobian": "with directions of the task held, by each demonstration its own",
}


def in_words(method: str) -> str:
    """What is told of a way of learning, by its name with or without a softness after a comma; empty of others."""
    return _WAYS.get(method.partition(", ")[0].partition(" (")[0], "")


def models_of(policy: Any) -> str:
    """Number and width of a fitted policy's local models, or the one for all states; of others their features."""
    if hasattr(policy, "fields_") and policy.variance_ in (np.inf, "cubic"):
        return f"one {'cubic' if policy.variance_ == 'cubic' else 'affine'} model for all states"
    if (variance := policy.training_.model.fields.variance) == np.inf:
        return str(policy.features_)
    return f"{counted(len(policy.solution_.weights), 'local model')} of σ² {variance:.4g}"


def about_choice(method: str, candidates: Mapping[str, float]) -> str:
    """Which candidate was taken, and the estimated squared errors of the others over its, in two sentences."""
    way, _, softness = method.partition(", ")
    said = f"Learnt as {way}{f' (softness {softness})' * bool(softness)}: {in_words(way) or 'as asked for'}."
    if len(candidates) < 2:
        return f"{said} Nothing was compared with it."
    least, own = {way: ""}, max(candidates[method], 1e-300)
    for name, risk in sorted(candidates.items(), key=lambda one: one[1]):
        least.setdefault(name.partition(", ")[0], f"{risk / own:.3g}" if risk <= 1000 * own else "over 1,000")
    others = ", ".join(f"{name} {many}" for name, many in least.items() if many)
    said += " Estimated squared error of other ways to learn, as times that of this (more is worse):"
    return f"{said} {others} ('fit -v' lists all)."


def _about_regions(found: Diagnosis, states: Sequence[str], actions: Sequence[str]) -> str:
    if all(one.determined == 1.0 for one in found.regions):
        worst = max(one.along for one in found.regions)
        off = f", though {percent(worst)} of a typical action may be off there" * bool(worst > SMALL)
        return f"Every recorded state is determined, as far as noise lets it be told{off}."
    region = ranked(found)[0]
    where, along = f"Near {named(region.state, states)}", f"along {named(region.direction, actions)}"
    if len(region.shown_by) >= ENOUGH:
        return f"{where} what was seen {along} is too little, or does not agree."
    but = f" but {' and '.join(map(repr, region.shown_by))}, with a part of the motion" * bool(region.shown_by)
    more = ("three", "two", "one")[len(region.shown_by)]
    return f"{where} nobody moved {along} by more than noise{but}: record {more} more there."


def nowhere(found: Diagnosis, more: str = "") -> str:
    """That no place needs another demonstration, and what none cures; ``more`` is said of the places."""
    model = f"; none cures that the model misses {percent(misfit(found))} of a typical action" * bool(misfit(found))
    return f"No place needs another demonstration: three or more tell the policy at each{more}{model}."


def needs_more(found: Diagnosis) -> bool:
    """Whether some recorded place needs another demonstration."""
    return found.states_determined < 1.0 or found.regions[0].along > SMALL


def to_record(found: Diagnosis, states: Sequence[str], actions: Sequence[str]) -> str:
    """Where another demonstration would help most, and how to hold it."""
    worst = ranked(found)[0]
    advice = f"Demonstrate around {named(worst.state, states)} with motion along {named(worst.direction, actions)} "
    return f"{advice}left free: tilt what holds it, such as the plate, another way, or take another."


def looks(free: float, told: float, kept: str) -> str:
    """How one looks by its mean probability of a free sample, the share that three tell, and what it ``kept`` to."""
    if told < PARTLY or kept:
        return "constrained" if told >= PARTLY and free < CONSTRAINED else kept or "untold"
    return "constrained" if free < CONSTRAINED else "free" if free > FREE else "unsure"


def about_freedom(found: Diagnosis) -> str:
    """What looks free, and how demonstrations look."""
    many = Counter(one.looks for one in found.movements)
    look = ", ".join(f"{many[how]} {words}" for how, words in LOOKS.items() if many[how])
    look = f"How {counted(len(found.movements), 'demonstration')} look: {look}."
    if sum(many[how] for how in KEPT) == len(found.movements):
        said = "No sample is said to be free: each demonstration looks held, by a plane, a line or another surface"
        return f"{said}; free strokes that are short, or circle, may, too. {look}"
    unsure = found.undecided_share * (found.undecided_share >= LITTLE)
    much, held, open_ = percents((found.free_share, 1.0 - found.free_share - unsure, unsure))
    said = f"Of the samples {much} look free (nothing that shows above the noise held them), {held} held"
    if unsure:
        said += f", and of {open_} recordings cannot tell: they were free or always held in the same way, which "
        said += "looks alike; demonstrations held in another way would tell"
    if found.free is None:
        return f"{said}. That is of the samples that the policy was fitted to."
    return f"{said}. {look}"

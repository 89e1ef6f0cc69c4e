"""To look at demonstrations: in space, in time, and what a policy makes of them; as a page, for rerun, or live."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Array
from ..base.display import innermost
from ..base.errors import MissingBeliefError, SettingError
from ..evaluation import diagnosis, verdicts
from ..recordings import Demonstration, Recording, stack
from .alone import assembled, literal
from .live import serve as serve
from .rrd import recorded as recorded
from .scene import Scene as Scene
from .scene import patches_of

if TYPE_CHECKING:
    from ..constraints import LearntConstraint
    from ..motion import Guided
    from ..policies import Policy

MOST_SAMPLES = 40_000
"""Of all demonstrations; more are thinned evenly."""

MOST_QUERIES = 4_000_000
"""Samples times demonstrations, beyond which only some samples are asked who else comes near."""

NEAR = 0.05
"""Within this share of the largest extent of the states is the same region."""

MOST_NUMBERS = 50_000
"""Of the covariances of a policy's weights; of more the page does not say where recordings tell the policy."""

_NEXT = "Leave out what should not be learnt from, and copy the command that learns from the rest."
_MOVED = "Begin at the next start, to see where the policy goes; then score it on new recordings."
_TILTED = f"Tilt the plane, and b{_MOVED[1:]}"


class Mark(NamedTuple):
    """What is seen on the time line, ``start`` and ``length`` in seconds from its begin, and told unless empty."""

    code: str
    message: str
    start: float | None = None
    length: float = 0.0


def look_page(
    demonstrations: Sequence[Demonstration],
    columns: Sequence[str],
    title: str,
    *,
    units: Mapping[str, str] | None = None,
    marks: Sequence[Sequence[Mark]] = (),
    command: Sequence[str] = ("", ""),
    policy: Policy | Guided | None = None,
    constraint: LearntConstraint | None = None,
    held: Sequence[Demonstration] | None = None,
    free: Array | None = None,
    verdict: verdicts.Verdict | None = None,
) -> str:
    """Make the page, a whole HTML document that needs nothing else.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
    columns : sequence of str
        Names of the states.
    title : str
        Of the page.
    units : mapping of str to str, optional
        Of columns whose unit is known.
    marks : sequence of sequences of Mark
        What there is to say about each demonstration.
    command : pair of str
        What to type to learn from them, before and after the option that leaves some out.
    policy : Policy or Guided, optional
        Fitted, of as many states.
    constraint : LearntConstraint, optional
        Fitted, of as many states.
    held : sequence of Demonstration, optional
        Those that the constraint is of; by default all.
    free : ndarray, shape (N,), optional
        Probability that each of all samples was free, by a quick look; a policy that learnt from them knows better.
    verdict : Verdict, optional
        On all of it, which the page begins with.
    """
    demos = list(demonstrations)
    every = max(1, -(-sum(map(len, demos)) // MOST_SAMPLES))
    thinned = [demo[np.unique([*range(0, len(demo), every), len(demo) - 1])] for demo in demos]
    learnt = _free(innermost(policy), demos)
    known = free if learnt is None else learnt
    described = None if policy is None else _described(policy, len(columns))
    runs = described is not None and not described["trouble"]
    then = (_TILTED if len(columns) <= 3 else _MOVED) if runs else _NEXT if command[0] else ""
    data = {
        "columns": list(columns),
        "units": [(units or {}).get(name, "") for name in columns],
        "timed": all(demo.times is not None for demo in demos),
        "demonstrations": list(_packed(thinned, _thinned(known, demos, every))),
        "quick": learnt is None,
        "marks": [[mark._asdict() for mark in each] for each in marks],
        "command": list(command),
        "patches": list(_patches(constraint, stack(held or thinned).states)),
        "samples": sum(map(len, demos)),
        "policy": described,
        "planes": (planes := diagnosis.planes_of(demos))[: len(planes) == 1].tolist(),
        "verdict": "" if verdict is None else f"{verdict.mark.value} {verdict.said}",
        "rest": [] if verdict is None else verdict._replace(next=then).rest(),
    }
    script = policy.javascript() if policy is not None and runs else "null"
    told = _told(innermost(policy)) if policy is not None and runs else "null"
    return assembled("look.html", title=escape(title), data=literal(data), policy=script, told=told)


def marks_of(recording: Recording, survey: Any, demonstration: Demonstration) -> list[Mark]:
    """Warnings, rest, gaps and pauses that a survey found, in seconds from the first sample of what was made of it."""
    stamps, kept = recording.times, demonstration.times
    begin = 0.0 if kept is None or not len(kept) else float(kept[0])
    first = 0.0 if stamps is None else float(stamps[np.isfinite(stamps)][:1].sum())
    said = "" if any(remark.code == "clock-gap" for remark in survey.warnings) else "{:.3g} s without samples"
    marks = [Mark("gap", said.format(gap.length), first + gap.start - begin, gap.length) for gap in survey.gaps]
    for remark in (*survey.warnings, *(note for note in survey.notes if note.code == "rest")):
        row = None if remark.code == "clock-gap" else remark.row
        start = None if stamps is None or row is None else float(stamps[row]) - begin
        where = "" if remark.column is None else f" (column {remark.column})"
        spans = (
            [] if stamps is None or kept is None else [(stamps[one], stamps[last - 1]) for one, last in remark.spans]
        )
        left = [0.0 if ((kept > one) & (kept < last)).any() else float(last - one) for one, last in spans] or [0.0]
        marks.append(Mark(remark.code, f"{remark.message}{where}", start, left[0]))
        marks += [Mark(remark.code, "", float(spans[at][0]) - begin, left[at]) for at in range(1, len(spans))]
    return marks


def _packed(demos: Sequence[Demonstration], free: Sequence[Array] | None) -> Iterator[dict[str, Any]]:
    """Each demonstration as numbers of 16 bits, with what it can be coloured by."""
    regions = _regions(demos)
    for index, demo in enumerate(demos):
        times = np.arange(len(demo), dtype=np.float64) if demo.times is None else demo.times - demo.times[0]
        yield {
            "name": demo.name,
            "times": _quantised(times),
            "states": [_quantised(column) for column in demo.states.T],
            "speed": _quantised(np.linalg.norm(demo.actions, axis=1)),
            "regions": _quantised(regions[index]),
            "free": None if free is None else _quantised(free[index]),
        }


def _quantised(values: Array) -> dict[str, Any]:
    """Values to a 65535th of their range."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    shares = (values - low) / (high - low) if high > low else np.zeros(len(values))
    return {
        "low": low,
        "high": high,
        "bits": base64.b64encode(np.rint(65535 * shares).astype("<u2").tobytes()).decode(),
    }


def _regions(demos: Sequence[Demonstration]) -> list[Array]:
    """How many demonstrations come near each sample."""
    states = stack(demos).states
    reach = NEAR * float(np.ptp(states, axis=0).max(initial=0.0)) + 1e-300
    every = -(-len(states) * len(demos) // MOST_QUERIES)
    trees = [cKDTree(demo.states) for demo in demos]
    counts = []
    for demo in demos:
        asked = demo.states[::every]
        near = sum((tree.query(asked, distance_upper_bound=reach)[0] < np.inf).astype(np.float64) for tree in trees)
        counts.append(np.repeat(near, every)[: len(demo)])
    return counts


def _free(policy: Policy | None, demos: Sequence[Demonstration]) -> Array | None:
    """Probability that each sample was free, of a policy that learnt from these."""
    try:
        known = None if policy is None else policy.solution_.free
    except MissingBeliefError:
        return None
    return None if known is None or len(known) != sum(map(len, demos)) else known


def _thinned(known: Array | None, demos: Sequence[Demonstration], every: int) -> list[Array] | None:
    """What is known of each sample, of those that are shown, by demonstration."""
    if known is None:
        return None
    parts = np.split(known, np.cumsum([len(demo) for demo in demos])[:-1])
    return [part[np.unique([*range(0, len(part), every), len(part) - 1])] for part in parts]


def _described(policy: Policy | Guided, columns: int) -> dict[str, Any]:
    """What the page has to know of a policy beside its formula; ``trouble`` says why it cannot be rolled out."""
    learnt = innermost(policy)
    n, d, trouble = learnt.n_features_in_, learnt.n_outputs_, ""
    if n != columns:
        trouble = f"The policy is of {n} states, these are {columns}."
    elif n != d:
        trouble = f"The policy has {d} actions for {n} states, so that no movement follows from it here."
    else:
        try:
            policy.closed_form()
        except SettingError as error:
            trouble = str(error)
    belief, untold = learnt.solution_.belief, "whether recordings tell the policy there is not known here"
    if belief is not None:  # too large for a page
        untold = f"but {verdicts.of_untold(1.0 - belief.told_together)}, and 'unconstrain rollout' says where"
    return {"method": learnt.solution_.method, "trouble": trouble, "untold": untold}


def _told(policy: Policy) -> str:
    """JavaScript object with what is not told of a policy's weights, and their features; true if all is; or null."""
    belief, centring = policy.solution_.belief, policy.training_.model.centring
    models, d, p = policy.solution_.weights.shape
    if belief is not None and belief.told_together >= verdicts.MOSTLY:
        return "true"
    if belief is None or policy.scale_ is not None or belief.undetermined.size > MOST_NUMBERS:
        return "null"
    of_features = copy(policy)
    over = np.eye(p)[None] if centring is None else centring
    of_features.solution_ = replace(policy.solution_, weights=over)
    own = belief.from_noise.reshape(models, over.shape[1], d, over.shape[1], d)
    noise = np.einsum("miaja->maij", own)
    numbers = {
        "actions": d,
        "models": models,
        "small": verdicts.SMALL,
        "misfit": belief.misfit,
        "undetermined": _singles(belief.undetermined),
        "noise": _singles(noise),
    }
    return f"{{...{literal(numbers)}, features: {of_features.javascript()}}}"


def _singles(values: Array) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()


def _patches(constraint: LearntConstraint | None, states: Array) -> Iterator[dict[str, Any]]:
    """What a constraint leaves free at some of the states."""
    found = None if constraint is None else patches_of(constraint, states)
    for state, free in zip(*(found or ((), ())), strict=True):
        yield {"at": state.tolist(), "free": free.tolist()}

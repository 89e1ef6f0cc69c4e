"""The page to look at demonstrations: in space, in time, and what a policy makes of them."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Array
from ..base.errors import MissingBeliefError, SettingError
from ..recordings import Demonstration, Recording, stack
from .alone import assembled, literal

if TYPE_CHECKING:
    from ..constraints import LearntConstraint
    from ..policies import Policy

MOST_SAMPLES = 40_000
"""Of all demonstrations; more are thinned evenly."""

MOST_QUERIES = 4_000_000
"""Samples times demonstrations, beyond which only some samples are asked who else comes near."""

MOST_PATCHES = 250
"""Pieces of a learnt constraint that are drawn."""

NEAR = 0.05
"""Within this share of the largest extent of the states is the same region."""

PAUSE = 5.0
"""So many usual intervals between samples that follow each other are a pause that was left out."""


class Mark(NamedTuple):
    """What is to be seen on the time line: ``start`` and ``length`` in seconds from the first stamp."""

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
    policy: Policy | None = None,
    constraint: LearntConstraint | None = None,
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
    policy : Policy, optional
        Fitted, of as many states.
    constraint : LearntConstraint, optional
        Fitted, of as many states.
    """
    demos = list(demonstrations)
    every = max(1, -(-sum(map(len, demos)) // MOST_SAMPLES))
    thinned = [demo[np.unique([*range(0, len(demo), every), len(demo) - 1])] for demo in demos]
    states = stack(thinned).states
    described = None if policy is None else _described(policy, len(columns))
    data = {
        "columns": list(columns),
        "units": [(units or {}).get(name, "") for name in columns],
        "timed": all(demo.times is not None for demo in demos),
        "demonstrations": list(_packed(thinned, _free(policy, demos, every))),
        "marks": [[mark._asdict() for mark in each] for each in marks],
        "command": list(command),
        "patches": [] if constraint is None else _patches(constraint, states),
        "samples": sum(map(len, demos)),
        "policy": described,
    }
    script = "null" if policy is None or described is None or described["trouble"] else policy.javascript()
    return assembled("look.html", title=escape(title), data=literal(data), policy=script)


def marks_of(recording: Recording, survey: Any, demonstration: Demonstration) -> list[Mark]:
    """Warnings, gaps and pauses of one demonstration, in seconds from its first sample.

    Parameters
    ----------
    recording : Recording
    survey : Survey
        What :func:`unconstrain.preparation.survey_set` found in it.
    demonstration : Demonstration
        What was made of it.
    """
    stamps, kept = recording.times, demonstration.times
    begin = 0.0 if kept is None or not len(kept) else float(kept[0])
    marks = [Mark("gap", f"{gap.length:.3g} s without samples", gap.start - begin, gap.length) for gap in survey.gaps]
    for remark in survey.warnings:
        start = None if stamps is None or remark.row is None else float(stamps[remark.row]) - begin
        where = "" if remark.column is None else f" (column {remark.column})"
        marks.append(Mark(remark.code, f"{remark.message}{where}", start))
    return [*marks, *_pauses(kept, begin, marks)]


def _pauses(times: Array | None, begin: float, gaps: Sequence[Mark]) -> Iterator[Mark]:
    """Intervals that are no gaps of the recording, and so were left out of the demonstration."""
    intervals = np.empty(0) if times is None else np.diff(times)
    if times is None or len(intervals) < 2:
        return
    known = [gap.start for gap in gaps if gap.code == "gap" and gap.start is not None]
    usual = float(np.median(intervals))
    for row in np.flatnonzero(intervals > PAUSE * usual):
        start = float(times[row]) - begin
        if not any(abs(start - gap) < 2 * usual for gap in known):
            length = float(intervals[row])
            yield Mark("pause", f"stands still for {length:.3g} s, left out", start, length)


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


def _free(policy: Policy | None, demos: Sequence[Demonstration], every: int) -> list[Array] | None:
    """Probability that each sample was free, of a policy that learnt from these."""
    try:
        known = None if policy is None else policy.solution_.free
    except MissingBeliefError:
        return None
    if known is None or len(known) != sum(map(len, demos)):
        return None
    parts = np.split(known, np.cumsum([len(demo) for demo in demos])[:-1])
    return [part[np.unique([*range(0, len(part), every), len(part) - 1])] for part in parts]


def _described(policy: Policy, columns: int) -> dict[str, Any]:
    """What the page has to know of a policy beside its formula; ``trouble`` says why it cannot be rolled out."""
    n, d, trouble = policy.n_features_in_, policy.n_outputs_, ""
    if n != columns:
        trouble = f"The policy is of {n} states, these are {columns}."
    elif n != d:
        trouble = f"The policy has {d} actions for {n} states, so that no movement follows from it here."
    else:
        try:
            policy.closed_form()
        except SettingError as error:
            trouble = str(error)
    return {"method": policy.solution_.method, "trouble": trouble}


def _patches(constraint: LearntConstraint, states: Array) -> list[dict[str, Any]]:
    """What a constraint leaves free at some of the states: two directions are a piece of a surface, one is a line."""
    chosen = states[_spread(states, MOST_PATCHES)]
    rows = constraint(chosen)
    if rows.shape[2] != states.shape[1]:
        return []
    patches = []
    for state, held in zip(chosen, rows, strict=True):
        _, singular, axes = np.linalg.svd(held)
        free = axes[int((singular > 0.5).sum()) :]
        patches.append({"at": state.tolist(), "free": free.tolist()})
    return patches


def _spread(states: Array, most: int) -> Array:
    """Indices of states far from each other: one of each cell of the finest grid that has at most so many."""
    low, extent = states.min(axis=0), max(float(np.ptp(states, axis=0).max()), 1e-300)
    found = np.array([0])
    for cells in range(2, 200):
        corners = np.floor((states - low) * (cells / extent)).astype(np.int64)
        first = np.unique(corners, axis=0, return_index=True)[1]
        if len(first) > most:
            break
        found = first
    return found

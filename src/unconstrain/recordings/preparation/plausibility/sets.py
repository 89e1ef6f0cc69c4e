"""Checks of demonstrations against each other; each looks at a few numbers of every one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....base.arrays import Array
from ...remarks import Remark
from ...signals.stillness import is_noise, noise_share
from .directions import turned_round
from .outlines import Outline
from .subject import Subject

FEWEST = 3
"""Demonstrations that it takes to hold one out and learn from two."""

MOST_MISSED = 0.5
"""A policy that misses more than this share of what it learnt from explains nothing."""

POINTS = 40
"""Of each demonstration this many places with directions are compared."""

UNLIKE = 25.0
"""Columns whose sizes differ by this factor are not in comparable units."""

OTHER_UNIT, LEAST = 30.0, 8.0
"""A demonstration larger or smaller than the others by the first factor in the median column, and by the second in all,
is in other units."""

STILL = 0.01
"""A demonstration that covers less than this share of what the others cover is at rest."""

APART = 2.0
"""Demonstrations are at different places where they are so many times as far apart as they are wide."""

PUSHED = 0.85
"""A movement that ends farther from its beginning than this share of its extent goes from end to end.

Ten bouts of wiping end at 0.13 to 0.72."""

TOGETHER = 15
"""So many demonstrations are compared at once."""


def outline(subject: Subject) -> Outline | None:
    """Outline of a recording, None where its columns do not tell the states or it is too short."""
    if not subject.moves:
        return None
    states = subject.clean
    span = max(1, len(states) // POINTS)
    at = np.arange(0, len(states) - span, span)
    return Outline(
        subject.recipe.states or (),
        np.ptp(states, axis=0),
        np.maximum(states.max(axis=0), -states.min(axis=0)),
        noise_share(states) > 0.3,
        (states[at] + states[at + span]) / 2,
        np.zeros((0, states.shape[1])) if is_noise(states) else states[at + span] - states[at],
    )


def compare(outlines: Sequence[Outline | None]) -> list[tuple[Remark, ...]]:
    """Remarks about each demonstration beside the others, in their order.

    Parameters
    ----------
    outlines : sequence of Outline
        None for a demonstration that shows no movement.
    """
    known = [(index, one) for index, one in enumerate(outlines) if one is not None]
    remarks: list[list[Remark]] = [[] for _ in outlines]
    if known:
        several = [one for _, one in known]
        remarks[known[0][0]] += [*mixed_units(several), *different_places(several)]
        for check in (unit_differs, smaller_than_others, reversed_among_others):
            for place, remark in check(several):
                remarks[known[place][0]].append(remark)
    return [tuple(each) for each in remarks]


def too_few(demonstrations: int) -> tuple[Remark, ...]:
    """The remark on fewer demonstrations than can be learnt from and checked; none where there are enough."""
    found = f"{demonstrations} demonstration{'s' * (demonstrations != 1)}"
    message = f"{found}, where {FEWEST} or more under different constraints are needed: record more, or tell those in "
    message += "one file apart with group=."
    return (Remark("few-demonstrations", message),) if demonstrations < FEWEST else ()


def doubts(demonstrations: int, missed: float) -> tuple[Remark, ...]:
    """Remarks on what was learnt from some demonstrations, by the share of their motion that it misses."""
    return (*too_few(demonstrations), *_explains_nothing(missed))


def _explains_nothing(missed: float) -> tuple[Remark, ...]:
    """The remark on a policy that misses most of the motion that it learnt from, as a share; none where it does not."""
    message = (
        f"misses {min(missed, 1):.0%} of the motion that it learnt from; the actions may be no function of the state, "
        "as where a movement goes out and back or stands still. Look at the warnings of a survey, and at states=."
    )
    return (Remark("explains-nothing", message),) if missed > MOST_MISSED else ()


def mixed_units(outlines: Sequence[Outline]) -> list[Remark]:
    """Columns both of whose extent and size are far below those of others."""
    extent = np.max([one.extent for one in outlines], axis=0)
    size = np.max([one.size for one in outlines], axis=0)
    moving = (extent > 0) & ~np.all([one.noisy for one in outlines], axis=0)
    if moving.sum() < 2:
        return []
    scale = np.where(moving, np.sqrt(extent * size), np.nan)
    ratio = float(np.nanmax(scale) / np.nanmin(scale))
    small, large = int(np.nanargmin(scale)), int(np.nanargmax(scale))
    if ratio < UNLIKE or extent[large] < UNLIKE / 3 * extent[small]:
        return []
    names = outlines[0].names
    message = f"is {ratio:.0f} times smaller than {names[large]!r}, which outweighs it; scale='auto' levels them."
    return [Remark("mixed-units", message, names[small])]


def different_places(outlines: Sequence[Outline]) -> list[Remark]:
    """Demonstrations farther from each other than each of them is wide."""
    if len(outlines) < FEWEST or unit_differs(outlines):
        return []
    middles = np.array([one.places.mean(axis=0) for one in outlines])
    wide = float(np.median([np.linalg.norm(one.extent) for one in outlines]))
    apart = np.linalg.norm(middles[:, None] - middles, axis=2)[np.triu_indices(len(outlines), 1)]
    if not 0.0 < APART * wide < np.median(apart):
        return []
    if np.median([one.push for one in outlines]) < PUSHED:
        cure = "if where they are does not matter, take each from its own centre with centre=True"
    else:
        cure = "they move on from end to end, so no mean tells their places (centre=True would hide a constant push)"
    return [Remark("places", f"demonstrations are farther apart than each is wide; {cure}.")]


def unit_differs(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations that are larger or smaller than the others by the factor of a unit, in place and in extent."""
    if len(outlines) < FEWEST:
        return []
    found = []
    for place, factors in enumerate(_ratios(outlines)):
        logs = np.log(factors)
        if np.median(np.abs(logs)) > np.log(OTHER_UNIT) and np.abs(logs).min() > np.log(LEAST) and _one_sign(logs):
            factor = float(np.exp(np.abs(logs).mean()))
            message = (
                f"is {factor:.3g} times {'larger' if logs[0] > 0 else 'smaller'} than the others, as in another unit; "
                "convert it, or leave it out with leave_out=."
            )
            found.append((place, Remark("unit-differs", message, outlines[place].names[0])))
    return found


def _one_sign(values: Array) -> bool:
    return bool((values > 0).all() or (values < 0).all())


def _ratios(outlines: Sequence[Outline]) -> Array:
    """Extent and size of each demonstration beside the median one, whichever is closer to 1, shape (D, n)."""
    extents = _beside_median(np.array([one.extent for one in outlines]))
    sizes = _beside_median(np.array([one.size for one in outlines]))
    agree = (extents > 1) == (sizes > 1)
    closer = np.where(np.abs(np.log(extents)) < np.abs(np.log(sizes)), extents, sizes)
    return np.where(agree, closer, 1.0)


def _beside_median(values: Array) -> Array:
    usual = np.median(values, axis=0)
    known = (usual > 0) & (values > 0)
    return np.divide(values, usual, out=np.ones_like(values), where=known)


def smaller_than_others(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations that stay where others move."""
    if len(outlines) < FEWEST:
        return []
    extents = np.array([one.extent for one in outlines])
    usual = np.median(extents, axis=0)
    moving = usual > 0
    if not moving.any():
        return []
    covered = (extents[:, moving] / usual[moving]).max(axis=1)
    near = np.median([one.size for one in outlines], axis=0)[moving] < 20 * np.array([o.size[moving] for o in outlines])
    message = "hardly moves beside the others; leave it out with leave_out=."
    still = np.flatnonzero((covered < STILL) & near.any(axis=1))
    return [(int(place), Remark("at-rest", message)) for place in still]


def reversed_among_others(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations that move against what all others say at their places."""
    strange = {place for place, _ in unit_differs(outlines)}
    moving = [place for place, one in enumerate(outlines) if len(one.steps) and place not in strange]
    together = [moving[first : first + TOGETHER] for first in range(0, len(moving), TOGETHER)]
    message = "moves against the others at the same places; leave it out with leave_out=, or turn it round."
    return [
        (places[index], Remark("reversed", message))
        for places in together
        for index in turned_round([outlines[place] for place in places])
    ]

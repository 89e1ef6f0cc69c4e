"""Checks of demonstrations against each other; each looks at a few numbers of every one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence

import numpy as np

from ....base.arrays import Array
from ....base.display import listed, percent, speed_of
from ...demonstration import Recording
from ...remarks import Remark
from ...signals.stillness import is_noise, noise_share
from .actions import actions_differ
from .checks import FASTEST, SLOWEST
from .directions import turned_round
from .exchanged import exchanged
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
"""Demonstrations larger or smaller than the others by the first factor in the median column, and by the second in all,
are in other units."""

TENFOLD, ABOUT = 10.0, 1.5
"""So are several that are in the middle larger or smaller by the first factor, to within the second, and by half
of it in all columns; and one alone that is so by half of it beside each of more than :data:`FEWEST` others."""

MOST_NAMED = 4
"""Others that are named in a remark."""

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
    states, recipe = subject.clean, subject.recipe
    span = max(1, len(states) // POINTS)
    at = np.arange(0, len(states) - span, span)
    intervals = np.diff(np.arange(len(states)) if subject.stamps is None else subject.stamps)
    acts = subject.actions if recipe.action_is == "auto" else subject.actions[:, :0]
    made = np.cumsum((acts[1:] + acts[:-1]) / 2 * intervals[:, None], axis=0)
    return Outline(
        subject.recording.title,
        np.nan if subject.stamps is None else float(np.median(intervals)),
        recipe.states or (),
        np.ptp(states, axis=0),
        np.maximum(states.max(axis=0), -states.min(axis=0)),
        noise_share(states) > 0.3,
        (states[at] + states[at + span]) / 2,
        np.zeros((0, states.shape[1])) if is_noise(states) else states[at + span] - states[at],
        frozenset({*recipe.angles, *map(subject.name, subject.wraps)}.union(*recipe.quaternions)),
        recipe.actions or (),
        made[at + span - 1] - np.where(at[:, None] > 0, made[at - 1], 0.0),
        _is_computed(subject.recording),
    )


def _is_computed(recording: Recording) -> bool:
    """Whether columns are states and their velocities alone, which agree better than recorded ones can."""
    names, n, times = recording.columns, len(recording.columns) // 2, recording.times
    if times is None or len(times) < FEWEST or names[n:] != tuple(map(speed_of, names[:n])):
        return False
    x, v = recording.values[:, :n], recording.values[:, n:]
    whole = x[2:] - x[:-2]
    off = whole - np.diff(times)[1:, None] / 3 * (v[:-2] + 4 * v[1:-1] + v[2:])
    return bool(np.median(np.abs(off).sum(axis=1)) < 1e-4 * np.median(np.abs(whole).sum(axis=1)))


def rolled_out(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations that were computed, as ``rollout`` does, among others that were recorded."""
    said = "velocities agree exactly with the states, as where 'unconstrain rollout' wrote them, unlike the others': "
    remark = Remark("rolled-out", f"{said}leave it out with leave_out=.")
    every = [place for place, one in enumerate(outlines) if one.exact]
    return [(place, remark) for place in every if len(every) < len(outlines)]


def compare(outlines: Sequence[Outline | None]) -> list[tuple[Remark, ...]]:
    """Remarks about each demonstration beside the others; none where it does not move (None) or has other columns."""
    most = Counter(one.names for one in outlines if one is not None).most_common(1)
    known = [(index, one) for index, one in enumerate(outlines) if one is not None and one.names == most[0][0]]
    remarks: list[list[Remark]] = [[] for _ in outlines]
    if known:
        several = [one for _, one in known]
        remarks[known[0][0]] += [*mixed_units(several), *different_places(several)]
        units = unit_differs(several)
        columns = columns_differ(several, {place for place, _ in units})
        against = reversed_among_others(several, {place for place, _ in (*units, *columns)})
        each = [*clock_differs(several), *actions_differ(several), *units, *smaller_than_others(several)]
        each += [*columns, *against, *same(several), *rolled_out(several)]
        for place, remark in each:
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
    said = f"misses {percent(min(missed, 1))} of the motion it learnt from; actions may be no function of the state, "
    said += "as where a movement goes out and back or stands still. Look at the warnings of a survey, and at states=."
    nothing = (Remark("explains-nothing", said),) if missed > MOST_MISSED else ()
    return (*too_few(demonstrations), *nothing)


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
    turning = any(one.turning for one in outlines)
    cure = "angles have no scale: give positions in metres" if turning else "scale='auto' levels them"
    message = f"is {ratio:.0f} times smaller than {names[large]!r}, which outweighs it; {cure}."
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
    said = f"demonstrations are in different places, each farther from others than it is long; {cure}."
    return [Remark("places", said)]


def same(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations that are the same in each number as another one, whose name is shorter or comes first."""
    places: dict[bytes, list[int]] = {}
    for place, one in enumerate(outlines):
        places.setdefault(one.places.tobytes() + one.steps.tobytes(), []).append(place)
    several = [each for each in places.values() if each[1:]]
    alike = ", ".join(" and ".join(outlines[place].title for place in each) for each in several)
    said = f"{alike} hold the same recording, which counts more than once, and tests nothing where its like is learnt "
    remark = Remark("same-recording", f"{said}from; leave all but one out with leave_out=.")
    copies = (sorted(each, key=lambda place: len(outlines[place].title))[1:] for each in several)
    return [(place, remark) for each in copies for place in each]


def clock_differs(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations with too few or too many samples a second for a movement, where others have as many as usual."""
    rates = 1.0 / np.array([one.interval or np.nan for one in outlines])
    odd = (rates <= SLOWEST) | (rates >= FASTEST)
    usual = float(np.median(rates[~odd & np.isfinite(rates)])) if (~odd & np.isfinite(rates)).any() else np.nan
    found = np.flatnonzero(odd & np.isfinite(usual)).tolist()
    if 0 < len(found) == len(outlines) - len(found):
        few, most = ([outlines[place].title for place in np.flatnonzero(odd == of).tolist()] for of in (True, False))
        said = f"{listed(few, MOST_NAMED)} have {np.median(rates[odd]):.3g} samples a second, "
        said += f"{listed(most, MOST_NAMED)} {usual:.3g}, as in another unit of time, and as many: "
        said += "convert the stamps that are wrong."
        return [(place, Remark("clock-differs", said)) for place in range(len(outlines))]
    said = f"samples a second, and others have {usual:.3g}: the stamps are in another unit than theirs; convert them, "
    said += "or leave it out with leave_out=."
    return [(place, Remark("clock-differs", f"{rates[place]:.3g} {said}")) for place in found]


def unit_differs(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations that are larger or smaller than more others by the factor of a unit, in place and in extent.

    Where these are as many, all are named. Of 40,066 pairs of recorded movements of one kind none is so.
    """
    if len(outlines) < 2:
        return []
    few, most = _two_groups(outlines)
    others = [outlines[place] for place in most]
    logs = np.array([_beside(outlines[place], others) for place in few])
    are = _are_of_a_unit(logs)
    if not are and (len(few) > 1 or len(most) <= FEWEST or np.isnan(logs).all()):
        return []
    factor, size = float(np.exp(np.nanmedian(np.abs(logs)))), "larger" if np.nanmedian(logs) > 0 else "smaller"
    if not are:
        nearest, factor = _beside(outlines[few[0]], others, np.max if size == "larger" else np.min), TENFOLD
        if not _are_of_a_unit(nearest[None], TENFOLD / 2, TENFOLD / 2):
            return []
    named = [listed([outlines[place].title for place in places], MOST_NAMED) for places in (few, most)]
    many = "about 1000 (metres and millimetres)" if abs(np.log(factor / 1e3)) < np.log(ABOUT) else f"{factor:.3g}"
    than = f"{many} times {size} than {named[1]}, as in another unit"
    if len(few) == len(most):
        said = f"{named[0]} {'are' if few[1:] else 'is'} {than}, and as many: convert those that are wrong."
        places = sorted([*few, *most])
    else:
        said, places = f"is {than}; convert it, or leave it out with leave_out=.", few
    rest = unit_differs([outlines[place] for place in most]) if len(few) < len(most) else []
    found = [(place, Remark("unit-differs", said, outlines[place].names[0])) for place in places]
    return found + [(most[place], remark) for place, remark in rest]


def _two_groups(outlines: Sequence[Outline]) -> list[list[int]]:
    """Demonstrations on either side of the widest gap between their sizes, the fewer first, or the larger."""
    sizes = np.array([np.median(np.sqrt(one.extent * one.size)) for one in outlines])
    logs = np.log(np.where(sizes > 0, sizes, np.median(sizes) or 1.0))
    order = np.argsort(logs, kind="stable")
    at = int(np.diff(logs[order]).argmax()) + 1
    return sorted([sorted(order[at:].tolist()), sorted(order[:at].tolist())], key=len)


def _beside(one: Outline, others: Sequence[Outline], middle: Callable[..., Array] = np.median) -> Array:
    """Logarithms (n,) of extent or size over those of others, the smaller, 0 if they disagree, NaN where all rest."""
    usual = [middle([getattr(other, name) for other in others], axis=0) for name in ("extent", "size")]
    known = (one.extent > 0) & (usual[0] > 0)
    tables = zip((one.extent, one.size), usual, strict=True)
    extents, sizes = (np.log(np.divide(own, its, out=np.ones_like(own), where=known)) for own, its in tables)
    smaller = np.where(np.abs(extents) < np.abs(sizes), extents, sizes)
    return np.where(known, np.where(extents * sizes > 0, smaller, 0.0), np.nan)


def _are_of_a_unit(logs: Array, other: float = OTHER_UNIT, all_by: float = LEAST) -> bool:
    """Whether some demonstrations, beside others (K, n), are of another size as by a unit."""
    if np.isnan(logs).all(axis=1).any() or not (np.nanmin(logs) > 0 or np.nanmax(logs) < 0):
        return False
    middle, least = np.nanmedian(np.abs(logs), axis=1), np.nanmin(np.abs(logs))
    if len(logs) > 1 and abs(np.median(middle) - np.log(TENFOLD)) < np.log(ABOUT) and least > np.log(TENFOLD / 2):
        return True
    return bool(middle.min() > np.log(other) and least > np.log(all_by))


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


def columns_differ(outlines: Sequence[Outline], strange: Collection[int]) -> list[tuple[int, Remark]]:
    """Demonstrations that are like the others, but for ``strange`` ones, with columns exchanged or a sign turned."""
    found = []
    for places in _together(outlines, strange):
        if told := exchanged([outlines[place] for place in places]):
            pairs = [[outlines[0].names[column] for column in pair] for pair in told[1]]
            ways = [f"the sign of {a!r} turned" if a == b else f"{a!r} and {b!r} exchanged" for a, b in pairs]
            said = f"is like the others only with {' or '.join(ways)}; correct that, or leave it out with leave_out=."
            found.append((places[told[0]], Remark("columns-differ", said, pairs[0][0])))
    return found


def reversed_among_others(outlines: Sequence[Outline], strange: Collection[int]) -> list[tuple[int, Remark]]:
    """Demonstrations that move against what all others, but for ``strange`` ones, say at their places."""
    message = "moves against the others at the same places. If it should not, leave it out with leave_out=, or turn it "
    message += "round; if a column has another sign in it, or two are exchanged, correct that."
    return [
        (places[index], Remark("reversed", message))
        for places in _together(outlines, strange)
        for index in turned_round([outlines[place] for place in places])
    ]


def _together(outlines: Sequence[Outline], without: Collection[int]) -> list[list[int]]:
    """Demonstrations in motion that are compared at once, but for some."""
    moving = [place for place, one in enumerate(outlines) if len(one.steps) and place not in without]
    return [moving[first : first + TOGETHER] for first in range(0, len(moving), TOGETHER)]

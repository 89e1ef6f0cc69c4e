"""Checks of one recording; each is one function from a subject to a remark, or None."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from ....base.arrays import Array
from ....base.display import counted, listed
from ...readers.clocks import UNITS, find_clock, usual
from ...remarks import Remark
from ...signals.orientations import TURNS, wraps
from ...signals.stillness import is_noise, noise_share, rest_at_ends
from ..meaning import are_backwards, are_targets
from .subject import FLIPS, GAP_INTERVALS, LEAST_ROWS, Subject

SLOWEST, FASTEST = 2.0, 2e4
"""Samples per second that a movement is recorded with; others are a clock in another unit."""

IRREGULAR = 0.01
"""Intervals that differ from the median by more than this share are no uniform sampling."""

STEADY = 0.05
"""Steps of a clock, nine of ten, are within this share of the median one: those of 226 of 237 recorded clocks, and of
none of 1781 recorded columns that are no clock."""


def examine(subject: Subject) -> tuple[Remark, ...]:
    """What is worth saying about one recording, at most once for each code, but for what its recipe cures."""
    found = [*subject.recording.remarks, *(remark for check in CHECKS if (remark := check(subject)) is not None)]
    place = subject.recording.place
    return once(one if one.row is None else one._replace(place=place(one.row)) for one in found)


def once(remarks: Iterable[Remark]) -> tuple[Remark, ...]:
    """The first remark of each code."""
    first: dict[str, Remark] = {}
    for remark in remarks:
        first.setdefault(remark.code, remark)
    return tuple(first.values())


def clock_unit(subject: Subject) -> Remark | None:
    """Stamps that make an absurd rate, by the median interval and by the mean one."""
    times = subject.recording.times
    if times is None or len(subject.rows) < LEAST_ROWS:
        return None
    stamps = np.sort(times[np.isfinite(times)])
    intervals = np.diff(stamps)
    typical = usual(intervals)
    if not typical:
        return None
    rates = 1.0 / typical, float(len(intervals) / (stamps[-1] - stamps[0]))
    if max(rates) > SLOWEST and min(rates) < FASTEST:
        return None
    if typical == 1.0 and (stamps == np.round(stamps)).all() and (other := find_clock(subject.recording.columns)):
        said = "the column of time counts rows, one by one, so it tells no time; name one that does with time="
        return Remark("clock-unit", f"{said}{other.whole!r}.")
    unit = next((unit for unit, seconds in UNITS.items() if seconds / max(rates) < 1.0 / SLOWEST), "ns")
    cure = f"such as time_unit={unit!r}" if max(rates) <= SLOWEST else "time_unit=, or the right column with time="
    said = f"{rates[0]:.3g} samples a second; if all are so, say the unit of the time stamps, {cure}."
    return Remark("clock-unit", said)


def clock_gap(subject: Subject) -> Remark | None:
    """Time without samples in the middle of a recording."""
    stamps = subject.stamps
    if stamps is None or len(stamps) < LEAST_ROWS or not subject.is_in_order:
        return None
    intervals = np.diff(stamps)
    rows = np.flatnonzero(intervals > (subject.recipe.max_gap_s or GAP_INTERVALS * usual(intervals))) + 1
    if not rows.size:
        return None
    worst = int(rows[np.argmax(intervals[rows - 1])])
    said = f"{rows.size} gap{'s' * (rows.size > 1)} in the time stamps, the longest {intervals[worst - 1]:.3g} s after "
    said += f"{stamps[worst - 1] - stamps[0]:.6g} s; nothing is smoothed or interpolated across (max_gap_s=)."
    return Remark("clock-gap", said, row=subject.row(rows[0]))


def empty_cells(subject: Subject) -> Remark | None:
    """Rows without numbers, where the clock shows that they are missing."""
    if not subject.skips:
        return None
    rows, used = np.flatnonzero(~subject.filled), {*(subject.recipe.states or ()), *(subject.recipe.actions or ())}
    names = sorted(one for one in used if not np.isfinite(subject.recording.select((one,))).all())
    said = f"{counted(len(rows), 'row')} without numbers in {listed(names, 8)}, empty or NaN, left out; "
    return Remark("empty-cells", f"{said}longer gaps are cut (max_gap_s=).", row=int(rows[0]), cured=True)


def clock_untold(subject: Subject) -> Remark | None:
    """A first column that rises as a clock does, where none is known."""
    recording = subject.recording
    name, steps = recording.columns[0], np.diff(recording.values[:, 0])
    used = name in (subject.recipe.states or (name,))
    titled = "no-header" not in [one.code for one in recording.remarks]
    meant = (titled and subject.recipe.actions) if used else subject.recipe.rate
    if (
        meant
        or recording.times is not None
        or len(recording.columns) < 2
        or len(steps) < LEAST_ROWS
        or not (steps > 0).all()
    ):
        return None
    if np.quantile(np.abs(steps / np.median(steps) - 1.0), 0.9) > STEADY:
        return None
    said = f"rises steadily, as a clock: if it is one, say time={name!r}; no clock and no count of rows is a state."
    return Remark("clock-untold", said, name)


def stale(subject: Subject) -> Remark | None:
    """Values that are repeated at regular steps, so of a sensor that is slower than the clock."""
    changes = np.zeros(max(len(subject.rows) - 1, 0), dtype=bool)
    for column in subject.states.T if subject.moves and subject.recipe.differentiate != "kalman" else ():
        changes |= column[1:] != column[:-1]
    steps = np.diff(np.flatnonzero(changes))
    every = float(np.median(steps)) if len(steps) >= LEAST_ROWS else 1.0
    if every < 2 or (np.abs(steps - every) > every / 3).mean() > STEADY:
        return None
    said = f"changes every {every:.0f} rows only, as where a sensor is slower than the clock: velocities are those of "
    said += "stairs. Record at the rate of the sensor, or keep only the rows that change"
    return Remark("stale", said + ("." if subject.recipe.actions else ", or smooth them with differentiate='kalman'."))


def irregular(subject: Subject) -> Remark | None:
    """Stamps that have to be made uniform before they are differentiated."""
    recipe = subject.recipe
    if subject.stamps is None or (subject.times is not None and not np.isfinite(subject.times).all()):
        return None
    intervals = np.diff(np.sort(subject.stamps) if recipe.sort else subject.stamps)
    intervals = intervals[intervals != 0.0]
    typical = float(np.median(intervals)) if recipe.differentiate == "savgol" and intervals.size else 0.0
    steady = intervals[intervals <= (recipe.max_gap_s or GAP_INTERVALS * typical)]
    asked = recipe.rate is not None and abs(recipe.rate * typical - 1.0) <= IRREGULAR
    unknown = not typical or not SLOWEST < 1.0 / typical < FASTEST  # a clock in another unit, whose steps are rounded
    if unknown or asked or (intervals < 0.0).any() or not is_irregular(steady, typical):
        return None
    to = f"so it is resampled to its median rate of {1 / typical:.4g} Hz."
    if rows := rows_missing(steady, typical):
        said = f"{'1 row is' if rows == 1 else f'{rows} rows are'} missing between the gaps"
        return Remark("rows-missing", f"{said}, as the time stamps show, {to}")
    return Remark("irregular", f"time stamps are irregular, {to}") if steady.std() > 2 * STEADY * typical else None


def rows_missing(intervals: Array, typical: float) -> int:
    """How many rows are missing where all intervals are whole numbers of the typical one; 0 where they are not."""
    steps = np.round(intervals / typical) if typical else np.zeros(0)
    regular = bool(steps.size and (steps >= 1).all() and (np.abs(intervals - steps * typical) <= 0.05 * typical).all())
    return int((steps - 1).sum()) if regular else 0


def is_irregular(intervals: Array, typical: float | None = None) -> bool:
    """Whether intervals differ from a typical one, by default the median."""
    if not intervals.size:
        return False
    expected = float(np.median(intervals)) if typical is None else typical
    return bool((np.abs(intervals - expected) > IRREGULAR * expected).any())


def row_order(subject: Subject) -> Remark | None:
    """Rows that are not in the order of time, or in none where there are no stamps."""
    if subject.stamps is not None:
        back = np.flatnonzero(np.diff(subject.stamps) < 0) + 1
        if not back.size or subject.recipe.sort or back.size == len(subject.stamps) - 1:
            return None
        message = f"time runs backwards at {back.size} row{'s' * (back.size > 1)}; put them in order with sort=True."
        return Remark("row-order", message, row=subject.row(int(back[0])))
    states = subject.states
    if len(states) < 2 * LEAST_ROWS or not states.shape[1] or not (noise_share(states) > 0.5).all() or _rests(subject):
        return None
    return Remark(
        "row-order", "neighbouring rows have nothing in common; name the column of time with time=, and sort=True."
    )


def reversed_in_time(subject: Subject) -> Remark | None:
    """Stamps that count down, or recorded velocities against the movement."""
    stamps = subject.stamps
    if stamps is not None and len(stamps) >= LEAST_ROWS and (np.diff(stamps) < 0).all() and not subject.recipe.sort:
        return Remark("reversed", "the time stamps count down; put the rows in order with sort=True.")
    if subject.moves and are_backwards(subject.clean, subject.actions):
        said = "moves against its own actions; leave it out with leave_out=, or turn it round; where all do, take the "
        return Remark("reversed", f"{said}velocity of the states, differentiate=, or turn the sign of the actions.")
    return None


def angle_wrap(subject: Subject) -> Remark | None:
    """Angles that jump by a whole turn."""
    if not subject.wraps:
        return None
    column, wrap = min(subject.wraps.items(), key=lambda one: one[1].rows[0])
    turns, recipe = {subject.name(one): found.turn for one, found in subject.wraps.items()}, subject.recipe
    degrees = [name for name, turn in turns.items() if turn == TURNS[1]]
    cure = f"angles={(*recipe.angles, *turns)}" + f" and degrees={(*(recipe.degrees or ()), *degrees)}" * bool(degrees)
    said = f"jumps by a turn of {wrap.turn:.4g}, {len(wrap.rows)} in all, and is taken for a plain number, so that "
    said += f"each jump counts as motion; for an angle, say {cure}."
    return Remark("angle-wrap", said, subject.name(column), subject.row(wrap.rows[0]))


def degrees_untold(subject: Subject) -> Remark | None:
    """An angle that is taken for radians, and jumps as one in degrees."""
    degrees = subject.recipe.degrees or ()
    for name in (one for one in subject.recipe.angles if one not in degrees):
        wrap = wraps(subject.recording.select([name])[subject.rows, 0])
        if wrap is not None and wrap.turn == TURNS[1]:
            said = "jumps by 360, as an angle in degrees does, and is taken for radians; if it is in degrees, say "
            return Remark("degrees", f"{said}degrees={(*degrees, name)}.", name, subject.row(wrap.rows[0]))
    return None


def turned_sign(code: str, subject: Subject) -> Remark | None:
    """Columns of one kind of orientation (:data:`~.subject.FLIPS`) whose numbers turn their sign."""
    for start, flip in subject.flips.items():
        if flip.code == code:
            names = [subject.name(column) for column in range(start, start + flip.width)]
            times = f"{len(flip.found)} time{'s' * (len(flip.found) > 1)}"
            message = f"turns its sign {times}; it is made continuous with {flip.setting}={tuple(names)}."
            return Remark(code, message, names[0], subject.row(flip.found[0]))
    return None


def glitch(subject: Subject) -> Remark | None:
    """Samples far off their neighbours."""
    if not subject.glitches or subject.recipe.glitches not in ("auto", "keep"):
        return None
    left = sorted({*subject.glitches} - {*subject.isolated}, key=lambda one: one.start)
    many, kept = (len({row for one in each for row in range(one.start, one.stop)}) for each in (subject.glitches, left))
    cure = "; glitches='repair' or glitches='drop'."
    if not left:
        cure = ", repaired by a straight line; glitches='keep' takes what was recorded, glitches='drop' leaves it out."
    elif subject.recipe.glitches == "auto":
        cure = f", {'all' * (kept == many) or kept} too many in a row to repair: kept; glitches='drop' leaves them out."
    first = (left or subject.glitches)[0]
    shown = subject.states[first.start : first.stop]
    lost = " They repeat one value, as where a tracker lost sight." * bool(len(shown) > 1 and (shown == shown[0]).all())
    said = f"{'1 sample far off its' if many == 1 else f'{many} samples far off their'} neighbours{cure}{lost}"
    return Remark("glitch", said, subject.name(first.column), subject.row(first.start), cured=not left)


def seam(subject: Subject) -> Remark | None:
    """Jumps to another place, as between demonstrations under one another in one table."""
    if subject.recipe.seams == "cut" or not subject.seams:
        return None
    said = f"{len(subject.seams)} jump{'s' * (len(subject.seams) > 1)} to another place, as between demonstrations; "
    said += "tell them apart with group=, or cut there with seams='cut'."
    return Remark("seam", said, row=subject.row(subject.seams[0]))


def other_topic(subject: Subject) -> Remark | None:
    """Rows that alternate between two movements in two places."""
    if subject.topic is None:
        return None
    said = "rows alternate between two places, as where two topics share a table; take them apart by the column that "
    said += "names them (group=), or read one (topic= of a ROS recording)."
    return Remark("other-topic", said, row=subject.row(subject.topic))


def targets(subject: Subject) -> Remark | None:
    """Actions that are the states to come."""
    recipe = subject.recipe
    if not subject.moves or recipe.action_is != "auto" or not are_targets(subject.clean, subject.actions):
        return None
    message = "are the states to come, not velocities; action_is='target' learns these (rate= without a clock)."
    return Remark("targets-as-velocities", message, (recipe.actions or ("",))[0])


def pause(subject: Subject) -> Remark | None:
    """Standing still in the middle."""
    if not (found := subject.stands):
        return None
    rows, stamps = sum(stop - start for start, stop in found), subject.stamps
    done = {"drop": "left out (pauses='keep')", "keep": "kept (pauses='drop')", "cut": "left out"}
    message = f"stands still for {subject.lasting(rows)} in the middle; they are {done[subject.recipe.pauses]}"
    at = [] if stamps is None else [(stamps[row] - stamps[0], subject.interval * (last - row)) for row, last in found]
    message += f": at {listed([f'{begin:.3g} s for {lasting:.2g} s' for begin, lasting in at], 3)}" * bool(at)
    spans = tuple((subject.row(row), subject.row(last - 1) + 1) for row, last in found)
    message += ". If demonstrations are between, cut it there: pauses='cut'."
    return Remark("pause", message, row=spans[0][0], spans=spans)


def rest(subject: Subject) -> Remark | None:
    """Standing still before the start, and after an end that is sudden."""
    if subject.recipe.still or not subject.moves:
        return None
    dropped, ends = subject.recipe.pauses != "keep", rest_at_ends(subject.clean, subject.interval)
    lasting = [
        f"{subject.lasting(rows)} {at}"
        for rows, at in zip(ends, ("before it starts", "at its end"), strict=True)
        if rows
    ]
    goal = " where that is its goal" if ends[1] else ""
    done = f"left out (pauses='keep'{goal})" if dropped else "learnt as rest there"
    return Remark("rest", f"stands still for {' and '.join(lasting)}, {done}.", cured=dropped) if lasting else None


def at_rest(subject: Subject) -> Remark | None:
    """States that change no more than noise does, all the time."""
    if not subject.moves or subject.topic is not None or not _rests(subject):
        return None
    return Remark("at-rest", "moves hardly more than its noise, if at all; leave it out with leave_out=.")


def _rests(subject: Subject) -> bool:
    """Whether states are constant, or noise about a place that is far from nought beside it."""
    states = subject.clean
    extent = np.ptp(states, axis=0).max(initial=0.0)
    is_small = bool(extent <= 0.05 * max(states.max(initial=0.0), -states.min(initial=0.0)))
    differentiated = subject.stamps is not None and not subject.actions.size
    return is_noise(states) and (differentiated or is_small)


def all_zero(subject: Subject) -> Remark | None:
    """Action columns without any action."""
    if not subject.actions.size or subject.actions.any():
        return None
    message = "all actions are zero; name others with actions=, or take the states' velocity: differentiate='savgol'."
    return Remark("all-zero", message, (subject.recipe.actions or ("",))[0])


CHECKS: tuple[Callable[[Subject], Remark | None], ...] = (
    clock_unit,
    clock_gap,
    empty_cells,
    clock_untold,
    stale,
    irregular,
    row_order,
    reversed_in_time,
    other_topic,
    angle_wrap,
    degrees_untold,
    *(partial(turned_sign, flip.code) for flip in FLIPS),
    glitch,
    seam,
    targets,
    pause,
    rest,
    at_rest,
    all_zero,
)

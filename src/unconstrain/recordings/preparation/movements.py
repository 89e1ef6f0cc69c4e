"""Movements from time stamps and positions: gaps, uniform sampling, velocities.

Nothing here smooths or interpolates across a gap: a recording is cut there, its
pieces are treated one by one, and only then laid end to end again.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array, as_matrix, as_vector, check_at_least
from ...base.display import counted
from ...base.errors import InvalidDataError, LackingError, SettingError
from ..demonstration import Demonstration, Recording, Source
from ..readers.clocks import usual
from ..remarks import Remark
from ..signals.jumps import glitches, repaired, seams
from ..signals.smoothing import LEAST, kalman_velocities, white_noise
from ..signals.stillness import rest_at_ends, stands
from .continuity import continuous
from .cutting import between_stands
from .decisions import decide, unused
from .plausibility.checks import examine, is_irregular
from .plausibility.sets import PUSHED, compare, outline
from .plausibility.subject import GAP_INTERVALS, Subject
from .recipes import Recipe, select, stamps

MOST_SAMPLES = 1e8
"""More than this is no rate but a mistake, and would fill the memory."""


class PreparationWarning(UserWarning):
    """Something about a recording, or all, that its owner should know: not what it seems, or repaired on the way.

    ``remark`` says what, ``title`` of which; ``code`` names the kind of what is not as it seems, and is empty for what
    was repaired.
    """

    def __init__(self, remark: Remark, title: str = "") -> None:
        super().__init__(remark.about(title))
        self.remark, self.title = remark, title
        self.code = remark.code if remark.warns else ""


class Gap(NamedTuple):
    """Where samples are missing: time of the last one before, and seconds to the next."""

    start: float
    length: float


class _Piece(NamedTuple):
    """A stretch without gaps; ``actions`` is None until they are known, and ``noise`` (d,) where it is not known."""

    times: Array
    states: Array
    actions: Array | None = None
    noise: Array | None = None

    def at(self, rows: slice | NDArray[np.bool_]) -> _Piece:
        actions = None if self.actions is None else self.actions[rows]
        return self._replace(times=self.times[rows], states=self.states[rows], actions=actions)


def prepare(recordings: Recording | Sequence[Recording], recipe: Recipe | None = None) -> list[Demonstration]:
    """Turn recordings into demonstrations.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
    recipe : Recipe, optional
        What it leaves open about the columns is guessed from the first recording.

    Returns
    -------
    list of Demonstration
        One for each recording, or with ``pauses="cut"`` for each piece of it, in the same order.

    Warns
    -----
    PreparationWarning
        For what is not what it seems, with its code; for irregular stamps that had to be resampled before they could
        be differentiated, for a smoothing window that holds too few samples, for stamps that occur twice (the first
        row is kept), for rows without numbers, left out where there are times, and for pieces between gaps that are
        too short for the smoothing window.

    Raises
    ------
    InvalidDataError
        If a stamp is not finite, or without times a selected cell, stamps run backwards, or nothing is left.
    SettingError
        If the columns do not tell what is what, or times are needed and missing.

    Examples
    --------
    >>> t = np.linspace(0, 1, 51)
    >>> recording = uc.Recording(("x",), np.sin(t)[:, None], t, name="wipe")
    >>> [demonstration] = uc.prepare(recording, uc.Recipe(states=("x",), differentiate="savgol"))
    >>> bool(np.allclose(demonstration.actions[:, 0], np.cos(t), atol=1e-3))
    True
    """
    every = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not every:
        raise InvalidDataError("got no recording, expected at least one.")
    whole, remarks = decide(recipe or Recipe(), every[0])
    warn(every[0].title, remarks, stacklevel=3)
    for one in every[1:]:  # what stands still in the first may move in another
        warn(one.title, unused(whole, whole, one), stacklevel=3)
    subjects = [Subject(one, whole) for recording in every for one in between_stands(Subject(recording, whole))]
    demonstrations = [prepare_one(subject, stacklevel=4) for subject in subjects]
    for subject, remarks in zip(subjects, compare([outline(subject) for subject in subjects]), strict=True):
        warn(subject.recording.title, remarks, stacklevel=3)
    return demonstrations


def prepare_one(subject: Subject, stacklevel: int = 2) -> Demonstration:
    """Turn one recording into a demonstration, by a recipe that names its columns; as :func:`prepare`."""
    title = subject.recording.title
    warn(title, examine(subject), stacklevel + 1)
    demonstration, notes = _prepare(subject)
    warn(title, notes, stacklevel + 1)
    return demonstration


def warn(title: str, remarks: Sequence[Remark], stacklevel: int = 2) -> None:
    """Say what there is to say about a recording of some title."""
    for remark in remarks:
        warnings.warn(PreparationWarning(remark, title), stacklevel=stacklevel)


def differentiate(
    times: Array, positions: Array, method: str = "savgol", window_s: float = 0.25, order: int = 3
) -> Array:
    """Velocities of positions.

    Parameters
    ----------
    times : array_like, shape (T,)
        Seconds, increasing; uniform for ``"savgol"``.
    positions : array_like, shape (T, n)
        No gaps.
    method, window_s, order
        As ``differentiate``, ``window_s`` and ``order`` of a :class:`Recipe`; stamps may be at any distance but for
        ``"savgol"``, whose window has at least the samples that the polynomial needs.

    Returns
    -------
    ndarray, shape (T, n)
        In units of the positions per second.

    Raises
    ------
    InvalidDataError
        If stamps do not increase, are not uniform (``"savgol"``), or too few.
    SettingError
        If the method does not exist or the window is not positive.
    """
    positions = as_matrix(positions, "positions")
    times = as_vector(times, "times", len(positions))
    recipe = Recipe(differentiate=method, window_s=window_s, order=order)
    intervals = np.diff(times)
    if (intervals <= 0).any():
        row = int(np.argmax(intervals <= 0)) + 1
        raise InvalidDataError(
            f"times: got {times[row]} after {times[row - 1]} at row {row}, expected them to increase."
        )
    needed = _samples_needed(recipe, _typical(times))
    if len(times) < needed:
        raise InvalidDataError(
            f"positions: got {len(times)} samples, expected at least {needed} to differentiate them."
        )
    if method == "savgol" and is_irregular(intervals):
        raise InvalidDataError(
            "times: got irregular stamps, expected uniform ones. Use resample() before, or 'kalman', or 'central'."
        )
    return _velocities(_Piece(times, positions), recipe, needed).velocities


def resample(times: Array, values: Array, rate: float) -> tuple[Array, Array]:
    """Linear interpolation at a uniform rate, from the first stamp to the last.

    Parameters
    ----------
    times : ndarray, shape (T,)
        Seconds, increasing.
    values : ndarray, shape (T, k)
    rate : float
        Samples per second.

    Returns
    -------
    times : ndarray, shape (S,)
    values : ndarray, shape (S, k)
        The same as given where the stamps already are at this rate.

    Raises
    ------
    InvalidDataError
        If there are no samples, or not as many stamps as values.
    SettingError
        If the rate is not positive, or makes more samples than any memory holds.
    """
    values = as_matrix(values, "values")
    times = as_vector(times, "times", len(values))
    check_at_least("rate", rate, 0, strict=True)
    # A hair more than the duration: rounding must not lose the last sample.
    duration = (times[-1] - times[0]) * rate + 1e-6
    if duration > MOST_SAMPLES:
        raise SettingError(
            f"rate: got {rate:.6g} Hz for {times[-1] - times[0]:.6g} s, that is {duration:.3g} samples. Take less."
        )
    steps = int(duration) + 1
    grid = times[0] + np.arange(steps) / rate
    if steps == len(times) and np.allclose(grid, times, rtol=0, atol=1e-6 / rate):
        return times, values
    return grid, np.column_stack([np.interp(grid, times, column) for column in values.T])


def trim(
    demonstration: Demonstration, start_s: float = 0.0, end_s: float = 0.0, still: float | None = None
) -> Demonstration:
    """Leave out the start and the end.

    Parameters
    ----------
    demonstration : Demonstration
    start_s, end_s : float
        Seconds to leave out.
    still : float, optional
        Then leave out what is slower than this before the first and after the last faster action.

    Raises
    ------
    InvalidDataError
        If nothing is left.
    SettingError
        If seconds are given and the demonstration has no times.
    """
    keep = np.ones(len(demonstration), dtype=bool)
    if start_s or end_s:
        if demonstration.times is None:
            raise LackingError(f"'{demonstration.name}' has no times to trim by: give a time column, or a rate.")
        since = demonstration.times - demonstration.times[0]
        keep = (since >= start_s - 1e-9) & (since <= since[-1] - end_s + 1e-9)
    if still is not None:
        keep &= np.linalg.norm(demonstration.actions, axis=1) >= still
    rows = np.flatnonzero(keep)
    if not rows.size:
        ends = f"{start_s:g} s at the start and {end_s:g} s at the end" if start_s or end_s else ""
        said = " and ".join(filter(None, (ends, "" if still is None else f"all that is slower than {still:g}")))
        raise InvalidDataError(
            f"'{demonstration.name}': nothing is left after trimming {said}. Trim less, or compare units."
        )
    return demonstration[rows[0] : rows[-1] + 1]


def find_gaps(times: Array, max_gap_s: float | None = None) -> tuple[Gap, ...]:
    """Intervals between stamps that are longer than they should be.

    Parameters
    ----------
    times : ndarray, shape (T,)
        Seconds.
    max_gap_s : float, optional
        Five median intervals by default.
    """
    intervals = np.diff(times)
    rows = np.flatnonzero(intervals > _longest(times, max_gap_s))
    return tuple(Gap(float(times[row]), float(intervals[row])) for row in rows)


def _prepare(subject: Subject) -> tuple[Demonstration, list[Remark]]:
    recording, recipe = subject.recording, subject.recipe
    if not len(recording):
        raise InvalidDataError(f"'{recording.name}' has no samples, expected at least one.")
    kept = np.flatnonzero(subject.filled) if subject.skips else slice(None)
    states = _finite(recording, recipe.states or (), recipe, kept)
    if subject.isolated:
        states[(np.cumsum(subject.filled) - 1)[subject.rows]] = repaired(subject.states, subject.isolated)
    actions = None if recipe.actions is None else _finite(recording, recipe.actions, recipe, kept)
    times = stamps(recording, recipe)
    _check_finite(recording, np.empty((0, 0)) if times is None else times[:, None], ("time",))
    notes: list[Remark] = []
    noise = None
    if times is None:
        at, states, actions = _in_rows(states, actions, recipe)
    else:
        stamped = times = times[kept]
        piece, notes = _without_repeats(_Piece(*_sorted(times, states, actions, recipe)), recording)
        pieces = _split(_without_glitches(piece._replace(states=continuous(piece.states, recipe)), recipe), recipe)
        (times, states, actions, noise), more = _repair(pieces, recipe, recording.name)
        notes += more
        at = np.arange(len(recording))[kept][_nearest(stamped, times)]
    if actions is None:
        raise LackingError(
            f"'{recording.name}' has no times, which are needed to differentiate: "
            "name the time column with time=, or give its rate in samples per second with rate=."
        )
    source = Source(recording.file, at, len(at))
    demonstration = Demonstration(states, actions, times, None, recording.name, recipe.space, noise, source)
    if recipe.trim is not None or recipe.still is not None:
        demonstration = trim(demonstration, *(recipe.trim or (0.0, 0.0)), still=recipe.still)
    if recipe.centre:
        space, states = demonstration.space, demonstration.states
        notes += _about_centre(states)
        demonstration = replace(demonstration, states=space.relative(states, space.mean(states)))
    return demonstration, notes


def _about_centre(states: Array) -> list[Remark]:
    """A word where a mean is no place: on a movement that goes on, it depends on when the recording began and ended."""
    on = float(np.linalg.norm(states[-1] - states[0]))
    if on <= PUSHED * float(np.linalg.norm(np.ptp(states, axis=0))):
        return []
    said = "is centred by the mean of a movement from end to end, which hides a constant push; leave centre=True off."
    return [Remark("centred", said)]


def _finite(recording: Recording, names: Sequence[str], recipe: Recipe, rows: slice | NDArray[np.intp]) -> Array:
    return _check_finite(recording, select(recording, names, recipe)[rows], names)


def _check_finite(recording: Recording, values: Array, names: Sequence[str]) -> Array:
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column = bad[0].tolist()
        raise InvalidDataError(
            f"'{recording.name}', {recording.place(row)}, column {names[column]!r}: "
            f"found {values[row, column]} ({counted(len(bad), 'such cell')} in the selected columns), "
            "expected finite numbers. Remove or repair these rows first."
        )
    return values


def _without_repeats(piece: _Piece, of: Recording) -> tuple[_Piece, list[Remark]]:
    times = as_vector(piece.times, f"times of '{of.name}'", len(piece.states))
    piece = piece._replace(times=times)
    intervals = np.diff(times)
    if (intervals < 0).any():
        row = int(np.argmax(intervals < 0)) + 1
        raise InvalidDataError(
            f"'{of.name}', {of.place(row)}: got time {times[row]:.6g} s after {times[row - 1]:.6g} s, "
            "expected later ones. Sort the rows (sort=True), or split the file where a new recording begins."
        )
    fresh = np.append(True, intervals > 0)
    if fresh.all():
        return piece, []
    said = f"{(~fresh).sum()} rows repeat the time stamp of the row before and were left out."
    return piece.at(fresh), [Remark("repeated", said)]


def _sorted(times: Array, states: Array, actions: Array | None, recipe: Recipe) -> tuple[Array, Array, Array | None]:
    if not recipe.sort:
        return times, states, actions
    order = np.argsort(times, kind="stable")
    return times[order], states[order], None if actions is None else actions[order]


def _nearest(stamps: Array, times: Array) -> NDArray[np.intp]:
    """Rows (S,) of the stamps (T,), in any order, that are nearest to some times (S,)."""
    order = np.argsort(stamps, kind="stable")
    inner = stamps[order]
    after = np.clip(np.searchsorted(inner, times), 1, len(inner) - 1)
    return order[after - (times - inner[after - 1] < inner[after] - times)]


def _in_rows(states: Array, actions: Array | None, recipe: Recipe) -> tuple[NDArray[np.intp], Array, Array | None]:
    """Rows, states and actions without times: continuous, without glitches and pauses."""
    piece = _Piece(np.arange(len(states), dtype=np.float64), continuous(states, recipe), actions)
    pieces = _split(_without_glitches(piece, recipe), recipe)
    joined = _joined(pieces)
    return joined.times.astype(np.intp), joined.states, joined.actions


def _without_glitches(piece: _Piece, recipe: Recipe) -> _Piece:
    if recipe.glitches == "repair":
        return piece._replace(states=repaired(piece.states, glitches(piece.states)))
    if recipe.glitches != "drop":
        return piece
    keep = np.ones(len(piece.times), dtype=bool)
    for one in glitches(piece.states):
        keep[one.start : one.stop] = False
    return piece.at(keep)


def _repair(pieces: list[_Piece], recipe: Recipe, name: str) -> tuple[_Piece, list[Remark]]:
    """Differentiate and resample the pieces, and join them."""
    notes: list[Remark] = []
    if recipe.differentiate is not None:
        interval = _typical(np.concatenate([piece.times for piece in pieces]))
        if recipe.differentiate == "savgol" and any(is_irregular(np.diff(piece.times), interval) for piece in pieces):
            pieces = [_resampled(piece, 1 / interval) for piece in pieces]
        needed = _samples_needed(recipe, interval)
        notes += _about_window(recipe, needed, interval)
        pieces, more = _long_enough(pieces, needed, name)
        notes += more
        straight = [piece._replace(states=recipe.space.unrolled(piece.states)) for piece in pieces]
        found = [_velocities(piece, recipe, needed) for piece in straight]
        pieces = [
            piece._replace(actions=one.velocities, noise=one.deviations)
            for piece, one in zip(pieces, found, strict=True)
        ]
    if recipe.action_is == "delta":
        pieces = [
            one._replace(actions=None if one.actions is None else one.actions / _typical(one.times)) for one in pieces
        ]
    if recipe.rate is not None:
        pieces = [_resampled(piece, recipe.rate) for piece in pieces]
    return _joined(pieces), notes


def _about_window(recipe: Recipe, needed: int, interval: float) -> list[Remark]:
    used = needed * interval
    if recipe.differentiate != "savgol" or not used > 1.5 * recipe.window_s:
        return []
    said = f"the smoothing window of {recipe.window_s:g} s was widened to {used:.3g} s, the {needed} samples it needs."
    return [Remark("window", said)]


def _long_enough(pieces: list[_Piece], needed: int, name: str) -> tuple[list[_Piece], list[Remark]]:
    kept = [piece for piece in pieces if len(piece.times) >= needed]
    if not kept:
        raise InvalidDataError(
            f"'{name}': got at most {max(len(piece.times) for piece in pieces)} samples in a row, expected at least "
            f"{needed} to differentiate them. Record longer, or give a shorter smoothing window."
        )
    lost = len(pieces) - len(kept)
    said = f"{lost} of {len(pieces)} pieces between gaps have fewer than {needed} samples and were left out."
    return kept, [Remark("short-pieces", said)] if lost else []


def _split(piece: _Piece, recipe: Recipe) -> list[_Piece]:
    """Cut at gaps, at seams and around pauses, as the recipe says; without pauses and rest at its ends."""
    cuts = set((np.flatnonzero(np.diff(piece.times) > _longest(piece.times, recipe.max_gap_s)) + 1).tolist())
    if recipe.seams == "cut":
        cuts |= set(seams(piece.states))
    drop = recipe.pauses != "keep"
    first, last = rest_at_ends(piece.states, _typical(piece.times)) if drop else (0, 0)
    rows = len(piece.times)
    still = [(0, first), (rows - last, rows), *stands(piece.states, _typical(piece.times))] if drop else []
    bounds = sorted(cuts | {0, len(piece.times)} | {row for pause in still for row in pause})
    return [
        piece.at(slice(start, stop))
        for start, stop in pairwise(bounds)
        if not any(first <= start and stop <= last for first, last in still)
    ]


def _resampled(piece: _Piece, rate: float) -> _Piece:
    times, states = resample(piece.times, piece.states, rate)
    actions = None if piece.actions is None else resample(piece.times, piece.actions, rate)[1]
    return _Piece(times, states, actions, piece.noise)


class _Moving(NamedTuple):
    """Velocities (T, n), and the standard deviation of their noise (n,) where it is known."""

    velocities: Array
    deviations: Array | None = None


def _velocities(piece: _Piece, recipe: Recipe, samples: int) -> _Moving:
    times, positions = piece.times, piece.states
    if recipe.differentiate == "kalman":
        return _Moving(*kalman_velocities(times, positions))
    interval, white = float(np.mean(np.diff(times))), white_noise(positions)
    if recipe.differentiate == "central":
        return _Moving(np.asarray(np.gradient(positions, times, axis=0, edge_order=2)), white * np.sqrt(0.5) / interval)
    from scipy.signal import savgol_coeffs, savgol_filter  # takes half a second to import

    gain = np.linalg.norm(savgol_coeffs(samples, recipe.order, deriv=1, delta=interval))
    found = savgol_filter(positions, samples, recipe.order, deriv=1, delta=interval, axis=0)
    return _Moving(np.asarray(found), white * float(gain))


def _joined(pieces: Sequence[_Piece]) -> _Piece:
    times, states, actions, noises = zip(*pieces, strict=True)
    noise = None
    if noises[0] is not None:
        shares = np.array([len(one) for one in times]) / sum(map(len, times))
        noise = np.sqrt(shares @ np.square(noises))
    joined = None if actions[0] is None else np.concatenate(actions)
    return _Piece(np.concatenate(times), np.concatenate(states), joined, noise)


def _typical(times: Array) -> float:
    """Median interval between stamps, NaN if there is none."""
    return usual(np.diff(times)) or float("nan")


def _longest(times: Array, max_gap_s: float | None) -> float:
    return GAP_INTERVALS * _typical(times) if max_gap_s is None else max_gap_s


def window_used(recipe: Recipe, recording: Recording) -> float:
    """Seconds of the smoothing window that a recording is differentiated with; as asked for where it has no times."""
    times = stamps(recording, recipe)
    interval = float("nan") if times is None else _typical(np.sort(times[np.isfinite(times)]))
    return recipe.window_s if np.isnan(interval) else _samples_needed(recipe, interval) * interval


def _samples_needed(recipe: Recipe, interval: float) -> int:
    """Length of the window: odd, and enough for the polynomial; what others need."""
    if recipe.differentiate != "savgol":
        return LEAST if recipe.differentiate == "kalman" else 3
    asked = 0 if np.isnan(interval) else round(min(recipe.window_s / interval, MOST_SAMPLES))
    return max(asked, recipe.order + 1) | 1

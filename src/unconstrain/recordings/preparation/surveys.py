"""What is in a recording, before anything is done to it."""

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Array
from ...base.display import counted, listed
from ...base.errors import InvalidDataError, UnconstrainError
from ..demonstration import Recording
from ..remarks import Remark, titled
from .cutting import between_stands
from .decisions import in_radians, may_be_degrees, unused
from .movements import Gap, find_gaps, prepare_one, window_used
from .plausibility.checks import examine, once, rows_missing
from .plausibility.sets import compare, outline, too_few
from .plausibility.subject import Subject
from .recipes import Recipe, complete_recipe, stamps


@dataclass(frozen=True)
class Survey:
    """What a look at a recording finds.

    Parameters
    ----------
    name : str
    columns : tuple of str
    samples : int
    duration_s : float, optional
        From the first stamp to the last; None without times, as all that follows from them.
    rate_hz : float, optional
        One over the median interval.
    jitter : float, optional
        Standard deviation of the intervals that are no gaps, as a share of the median one.
    gaps : tuple of Gap
        Where samples are missing, from the first stamp.
    non_increasing : tuple of int
        Rows whose stamp is not later than that of the row before, from 0.
    missing : mapping of str to int
        How many cells of a column are empty or not finite, for the columns that have such.
    zero_actions : int, optional
        Samples whose action is zero; None where the actions are not columns.
    warnings : tuple of Remark
        What is not as it seems, at most one for each code.
    notes : tuple of Remark
        How the file is read and prepared, where that is worth a word: columns without names, demonstrations taken
        apart, stamps made uniform.
    file : str
        Path of the file; empty where it came from none.
    words : tuple of str
        Columns that hold no numbers.
    left : int, optional
        Samples that ``trim`` and ``still`` of the recipe leave; None where nothing is trimmed.
    """

    name: str
    columns: tuple[str, ...]
    samples: int
    duration_s: float | None
    rate_hz: float | None
    jitter: float | None
    gaps: tuple[Gap, ...]
    non_increasing: tuple[int, ...]
    missing: Mapping[str, int]
    zero_actions: int | None
    warnings: tuple[Remark, ...]
    notes: tuple[Remark, ...] = ()
    file: str = ""
    words: tuple[str, ...] = ()
    left: int | None = None

    @property
    def title(self) -> str:
        """What the recording is called in messages."""
        return titled(self.name, self.file)


def survey(recording: Recording, recipe: Recipe | None = None) -> Survey:
    """Look at a recording without changing or refusing anything.

    Parameters
    ----------
    recording : Recording
    recipe : Recipe, optional
        Says which columns are actions, the rate where there are no times, and
        from where on an interval is a gap. What it leaves open is guessed where possible.
    """
    asked = recipe or Recipe()
    return _survey(subject_of(recording, asked), asked)


def survey_set(recordings: Iterable[Recording], recipe: Recipe | None = None) -> list[Survey]:
    """Look at recordings one by one, and at each beside the others; parameters as of :func:`survey`."""
    asked = recipe or Recipe()
    surveys, outlines, degrees = list[Survey](), [], tuple[str, ...]()
    for recording in (piece for one in recordings for piece in pieces(one, asked)):
        known = tuple(name for name in degrees if name in recording.columns)  # as of the first, which decides for a fit
        subject = subject_of(recording, replace(asked, degrees=known) if surveys else asked)
        degrees = degrees if surveys else subject.recipe.degrees or ()
        surveys.append(_survey(subject, asked))
        outlines.append(outline(subject))
    more = compare(outlines)
    if surveys:
        more[0] = (*too_few(len(surveys)), *more[0])
    return [_with(each, added) for each, added in zip(surveys, more, strict=True)]


def _with(each: Survey, added: tuple[Remark, ...]) -> Survey:
    notes = tuple(remark for remark in added if not remark.warns)
    told = [remark for remark in added if remark.warns]
    more = {"clock-differs": "clock-unit", "not-velocities": "reversed"}  # what each tells more of
    known = [more.get(remark.code) for remark in told]
    own = [remark for remark in each.warnings if remark.code not in known]
    return replace(each, warnings=once([*own, *told]), notes=each.notes + notes)


def _survey(subject: Subject, asked: Recipe) -> Survey:
    recording, acts = subject.recording, subject.recipe.actions
    times = stamps(recording, asked)
    known = np.empty(0) if times is None else times[np.isfinite(times)]
    gaps = find_gaps((known if subject.stamps is None else subject.stamps) - known[:1].sum(), asked.max_gap_s)
    left, refused = _prepared(subject)
    guessed = (*may_be_degrees(asked, subject.recipe, recording), *unused(asked, subject.recipe, recording))
    remarks = (*examine(subject), *guessed, *refused)
    steady = _steady_intervals(known, gaps)
    typical = float(np.median(steady)) if steady.size else None
    bad_cells = len(recording) - np.count_nonzero(np.isfinite(recording.values), axis=0)
    return Survey(
        name=recording.name,
        columns=recording.columns,
        samples=len(recording),
        duration_s=float(known[-1] - known[0]) if known.size else None,
        rate_hz=1 / typical if typical else None,
        jitter=float(steady.std() / typical) if typical else None,
        gaps=gaps,
        non_increasing=() if times is None else tuple((np.flatnonzero(~(np.diff(times) > 0)) + 1).tolist()),
        missing={name: count for name, count in zip(recording.columns, bad_cells.tolist(), strict=True) if count},
        zero_actions=None if acts is None else int((recording.select(acts) == 0).all(axis=1).sum()),
        warnings=tuple(remark for remark in remarks if remark.warns),
        notes=tuple(remark for remark in remarks if not remark.warns),
        file=recording.file,
        words=recording.words,
        left=left,
    )


def _prepared(subject: Subject) -> tuple[int | None, tuple[Remark, ...]]:
    """How many samples are left where it is trimmed, and why it is refused; what is long is prepared for no other."""
    recording, recipe = subject.recording, subject.recipe
    used, trimmed = (*(recipe.states or ()), *(recipe.actions or ())), (recipe.trim, recipe.still) != (None, None)
    missing = ~np.isfinite(recording.select(used)) & (not subject.skips)
    if subject.times is not None:
        missing = np.column_stack([missing, ~np.isfinite(subject.times)])
    if rows := np.flatnonzero(missing.any(axis=1)).tolist():
        lacking = listed([name for name, cells in zip((*used, "time"), missing.T, strict=False) if cells.any()], 8)
        said = f"{counted(len(rows), 'row')} without numbers in {lacking}, empty or NaN, cannot be learnt from: remove "
        said += "or repair them, or leave it out with leave_out=."
        return None, (Remark("missing", said, row=rows[0], place=recording.place(rows[0])),)
    stamps = subject.stamps
    long = stamps is None or (len(stamps) > 0 and np.ptp(stamps) >= window_used(recipe, recording))
    if not used or (long and not trimmed):
        return None, ()
    try:
        with warnings.catch_warnings(action="ignore"):
            left = len(prepare_one(subject))
        return left if trimmed else None, ()
    except InvalidDataError as error:
        said = f"cannot be learnt from: {str(error).partition(': ')[2]} Or leave it out with leave_out=."
        return 0 if trimmed else None, (Remark("refused", said),)
    except UnconstrainError:  # what the options lack is said elsewhere
        return None, ()


def pieces(recording: Recording, recipe: Recipe) -> list[Recording]:
    """What a recipe with ``pauses="cut"`` makes of a recording before it is prepared; with others the recording."""
    return between_stands(subject_of(recording, recipe)) if recipe.pauses == "cut" else [recording]


def subject_of(recording: Recording, recipe: Recipe) -> Subject:
    """What checks look at, as far as the columns tell: only the clock where they do not tell the states."""
    nothing = replace(recipe, states=None, actions=None, angles=(), quaternions=(), rotation_vectors=())
    for known in (_completed(recipe, recording), replace(recipe, actions=None)):
        if known.states and {*known.states, *(known.actions or ())} <= set(recording.columns):
            return Subject(recording, in_radians(known, recording))
    return Subject(recording, nothing)


def _completed(recipe: Recipe, recording: Recording) -> Recipe:
    try:
        return complete_recipe(recipe, recording)
    except UnconstrainError:
        return recipe


def _steady_intervals(times: Array, gaps: tuple[Gap, ...]) -> Array:
    intervals = np.diff(times)
    shortest_gap = min((gap.length for gap in gaps), default=np.inf)
    steady = intervals[(intervals > 0) & (intervals < shortest_gap)]
    typical = float(np.median(steady)) if steady.size else 0.0
    return steady[steady < 1.5 * typical] if rows_missing(steady, typical) else steady

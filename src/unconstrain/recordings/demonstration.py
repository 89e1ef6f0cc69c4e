"""What was recorded, what was demonstrated, and what was true behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import blake2b
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, as_matrix, as_numbers, as_seconds, as_vector
from ..base.display import Shown, counted, has_no_column, listed, shortened
from ..base.errors import InvalidDataError, LackingError
from ..models import spaces
from .columns import resolve
from .remarks import Remark, titled


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Shown):
    """Columns of numbers as a file holds them, before anyone says what they mean.

    Parameters
    ----------
    columns : tuple of str
        A name for each column.
    values : array_like, shape (T, c)
        May hold NaN where the file has an empty cell; a table of pandas is one.
    times : array_like, shape (T,), optional
        Seconds; of dates those from the first on.
    name : str
        Which demonstration this is, for messages and groups.
    remarks : tuple of Remark
        What the reader noticed: columns left out, demonstrations taken apart.
    units : mapping of str to str
        Unit of a column, as the file says it (``"mm"``, ``"deg"``), for the columns of which it says one.
    attributes : mapping of str to object
        What the file says of the whole recording: its task, the version of its environment, its rate.
    file : str
        Path of the file, for messages; empty where it came from none.
    words : tuple of str
        Columns of the file that hold no numbers, by which it may be taken apart.
    lines : ndarray, shape (T,), optional
        Line of the file that each row is in, from 1, where its format has lines.

    Raises
    ------
    InvalidDataError
        If values or times are no numbers, or there are other numbers of them than of names or rows.

    Examples
    --------
    >>> recording = uc.Recording(("t", "x"), np.array([[0.0, 1.0], [0.1, 2.0]]), name="wipe")
    >>> recording.select(["x"])
    array([[1.],
           [2.]])
    """

    columns: tuple[str, ...]
    values: Array
    times: Array | None = None
    name: str = ""
    remarks: tuple[Remark, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    attributes: Mapping[str, Any] = field(default_factory=dict)
    file: str = ""
    words: tuple[str, ...] = ()
    lines: NDArray[np.integer] | None = None

    def __post_init__(self) -> None:
        of = f" of '{self.name}'" if self.name else ""
        columns, values = tuple(self.columns), as_numbers(self.values, f"values{of}", convert=False)
        times = None if self.times is None else as_seconds(self.times, f"times{of}")
        if values.shape[1:] != (len(columns),) or (times is not None and times.shape != values.shape[:1]):
            stamps = "" if times is None else f", times of shape {times.shape}"
            raise InvalidDataError(
                f"recording{of}: got values of shape {values.shape}{stamps} and {counted(len(columns), 'name')} of "
                f"columns ({listed(columns)}), expected a name for each column and a time for each row."
            )
        vars(self).update(columns=columns, values=values, times=times)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def title(self) -> str:
        """What it is called in messages."""
        return titled(self.name, self.file)

    def place(self, row: int) -> str:
        """Where a row, from 0, is, for people: with its line, from 1, where the format of its file has lines."""
        return f"row {row}" if self.lines is None or row >= len(self.lines) else f"row {row} (line {self.lines[row]})"

    def select(self, names: Sequence[str]) -> Array:
        """Pick columns by name, shape (T, len(names)).

        Raises
        ------
        InvalidDataError
            If a column does not exist; the message lists those that do.
        """
        missing = [name for name in names if name not in self._places]
        if missing:
            said = has_no_column(self.name, missing, self.columns, self.words)
            others = len(missing) == len(names) <= len(self.columns) and not said.endswith(("?", "convert it."))
            cure = " Name those of this file with states= and actions=, or all of its columns with columns=."
            raise LackingError(said + cure * others)
        return self.values[:, [self._places[name] for name in names]]

    def content(self, recipe: Any, begun: blake2b | None = None) -> blake2b:
        """A digest of the states and actions of a recipe, to be known by; it goes on with ``begun``, of rows before."""
        values = self.select((*(recipe.states or ()), *(recipe.actions or ()))) + 0.0  # no zero has a sign
        (found := begun or blake2b(digest_size=8)).update(values.tobytes())
        return found

    def resolve(self, names: Sequence[str]) -> tuple[str, ...]:
        """Columns that names, patterns (``joint_?``), ranges (``q1..q7``) and stems (``position``) mean, in order."""
        return resolve(names, self.columns)

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {name: place for place, name in reversed(list(enumerate(self.columns)))}

    def _summary(self) -> tuple[str, ...]:
        sizes = counted(len(self), "row"), counted(len(self.columns), "column")
        return shortened(self.name), *sizes, *_time(self.times)


@dataclass(frozen=True, eq=False, repr=False)
class Truth(Shown):
    """What a simulated demonstrator knows and a learner must not see.

    Parameters
    ----------
    policy : ndarray, shape (T, d)
        The unconstrained policy at each state.
    projections : ndarray, shape (T, d, d)
        The projection N that the constraint applied, so that ``u = N π``.

    Examples
    --------
    >>> held = uc.null_space_projection(np.array([[[0.0, 1.0]]]))
    >>> truth = uc.Truth(policy=np.array([[1.0, 2.0]]), projections=held)
    >>> uc.project(truth.projections, truth.policy)
    array([[1., 0.]])
    """

    policy: Array
    projections: Array

    def _summary(self) -> tuple[str, ...]:
        return counted(len(self.policy), "sample"), counted(self.policy.shape[1], "action")


class Source(NamedTuple):
    """Where samples were recorded: the file, and rows (T,) of its recording, from 0, that each is at or nearest to.

    Before both ends were trimmed there were ``whole`` samples, if known.
    """

    file: str
    rows: NDArray[np.intp]
    whole: int | None = None

    def at(self, rows: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Source:
        """Of some of the samples."""
        return self._replace(rows=self.rows[rows])


@dataclass(frozen=True, eq=False, repr=False)
class Demonstration(Shown):
    """One recorded movement.

    Parameters
    ----------
    states : array_like, shape (T, n)
    actions : array_like, shape (T, d)
    times : array_like, shape (T,), optional
        Seconds, increasing.
    truth : Truth, optional
        Where the movement was simulated.
    name : str
        Used in messages and reports.
    space : Space
        Which states are angles or orientations (:mod:`unconstrain.spaces`); policies that learn from it take it.
    noise : float or array_like, shape (d,), optional
        Standard deviation of the noise on the actions, on each or on all; None where it is not known.
    source : Source, optional
        File and rows that the samples came from, for messages.

    Raises
    ------
    InvalidDataError
        If a table is ragged, empty or not finite, the lengths differ, or the space is not one of such states.

    Examples
    --------
    >>> uc.Demonstration(states=[[0, 0], [1, 0]], actions=[[1, 0], [1, 0]], times=[0, 1], name="wipe")
    Demonstration('wipe', 2 samples, 2 states, 2 actions, 1 s)
    """

    states: Array
    actions: Array
    times: Array | None = None
    truth: Truth | None = None
    name: str = ""
    space: spaces.Space = field(default_factory=spaces.Euclidean)
    noise: Array | None = None
    source: Source | None = None

    def __post_init__(self) -> None:
        of = f" of '{self.name}'" if self.name else ""
        object.__setattr__(self, "states", as_matrix(self.states, f"states{of}"))
        object.__setattr__(self, "actions", as_matrix(self.actions, f"actions{of}"))
        object.__setattr__(self, "space", self.space.over(self.states.shape[1]))
        if len(self.states) != len(self.actions):
            raise InvalidDataError(
                f"demonstration{of}: got {len(self.states)} states and {len(self.actions)} actions, "
                "expected one action for each state."
            )
        if self.times is not None:
            object.__setattr__(self, "times", as_vector(self.times, f"times{of}", len(self.states)))
        if self.truth is not None:
            self._check_truth(self.truth, of)
        if self.noise is not None:
            object.__setattr__(self, "noise", self._each(self.noise, of))

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, rows: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Demonstration:
        """Take some of the samples, with their times and truth."""
        return replace(
            self,
            states=self.states[rows],
            actions=self.actions[rows],
            times=None if self.times is None else self.times[rows],
            truth=None if self.truth is None else Truth(self.truth.policy[rows], self.truth.projections[rows]),
            source=None if self.source is None else self.source.at(rows),
        )

    def _each(self, noise: Any, of: str) -> Array:
        d = self.actions.shape[1]
        each = as_vector(np.broadcast_to(noise, (d,)) if np.ndim(noise) == 0 else noise, f"noise{of}", d)
        if (each < 0).any():
            raise InvalidDataError(f"noise{of}: got {noise!r}, expected standard deviations, none below zero.")
        return each

    def _check_truth(self, truth: Truth, of: str) -> None:
        steps, d = self.actions.shape
        for what, array, shape in (
            ("policy", truth.policy, (steps, d)),
            ("projections", truth.projections, (steps, d, d)),
        ):
            if np.shape(array) != shape:
                raise InvalidDataError(f"truth{of}: got {what} of shape {np.shape(array)}, expected {shape}.")

    def _summary(self) -> tuple[str, ...]:
        sizes = counted(self.states.shape[1], "state"), counted(self.actions.shape[1], "action")
        return shortened(self.name), counted(len(self), "sample"), *sizes, *_time(self.times)


class Stack(NamedTuple):
    """Demonstrations laid end to end: what estimators take.

    ``states`` (N, n), ``actions`` (N, d), and ``groups`` (N,), the index of
    the demonstration that each sample came from.
    """

    states: Array
    actions: Array
    groups: NDArray[np.intp]


def stack(demonstrations: Demonstration | Sequence[Demonstration]) -> Stack:
    """Lay demonstrations end to end.

    Raises
    ------
    InvalidDataError
        If there is none, or they differ in the number of columns or in their space.

    Examples
    --------
    >>> one = uc.Demonstration([[0.0], [1.0]], [[1.0], [1.0]])
    >>> uc.stack([one, one]).groups
    array([0, 0, 1, 1])
    """
    demos = [demonstrations] if isinstance(demonstrations, Demonstration) else list(demonstrations)
    if not demos:
        raise InvalidDataError("got no demonstration, expected at least one.")
    shape = demos[0].states.shape[1], demos[0].actions.shape[1]
    for index, demo in enumerate(demos):
        if (demo.states.shape[1], demo.actions.shape[1]) != shape:
            raise InvalidDataError(
                f"demonstration {index} ('{demo.name}') has {demo.states.shape[1]} state and "
                f"{demo.actions.shape[1]} action columns, expected {shape[0]} and {shape[1]} as in the first."
            )
        if demo.space != demos[0].space:
            raise InvalidDataError(
                f"demonstration {index} ('{demo.name}') is in the space {demo.space}, expected {demos[0].space} as the "
                "first. Prepare all by one recipe."
            )
    return Stack(
        np.concatenate([demo.states for demo in demos]),
        np.concatenate([demo.actions for demo in demos]),
        np.repeat(np.arange(len(demos)), [len(demo) for demo in demos]),
    )


def times_of(demonstrations: Sequence[Demonstration]) -> Array | None:
    """Times of demonstrations laid end to end, shape (N,), seconds; None where one has none."""
    times = [demo.times for demo in demonstrations if demo.times is not None]
    return np.concatenate(times) if len(times) == len(demonstrations) else None


def noise_of(demonstrations: Sequence[Demonstration]) -> Array | None:
    """Standard deviations of the noise of demonstrations laid end to end, (N, d); None where one is not known."""
    known = [np.broadcast_to(demo.noise, demo.actions.shape) for demo in demonstrations if demo.noise is not None]
    return np.concatenate(known) if len(known) == len(demonstrations) else None


def _time(times: Array | None) -> tuple[str, ...]:
    """How long a movement takes."""
    return () if times is None or not len(times) else (f"{float(times[-1] - times[0]):.4g} s",)

"""What to make of the columns of a recording."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import reduce
from operator import mul
from typing import Any, NoReturn

import numpy as np

from ...base.arrays import Array, check_at_least
from ...base.display import listed, speed_of, unit_of, with_unit
from ...base.errors import SettingError, UntoldError
from ...models import spaces
from ..demonstration import Recording
from .guesses import guess_actions, guess_states, positions_in

METHODS = ("savgol", "kalman", "central")
"""Ways to differentiate: Savitzky-Golay smoothing, a Kalman smoother, central differences."""

ORDERS = (2, 3)

CHOICES = {
    "centre": (False, True),
    "sort": (False, True),
    "glitches": ("auto", "keep", "repair", "drop"),
    "seams": ("keep", "cut"),
    "pauses": ("drop", "keep", "cut"),
    "action_is": ("auto", "velocity", "target", "delta"),
}
"""What the settings of few values may be."""


@dataclass(frozen=True)
class Recipe:
    """How recordings become demonstrations.

    Parameters
    ----------
    states : tuple of str, optional
        Columns that make the state; guessed if None.
    actions : tuple of str, optional
        Columns that make the action. Guessed if neither these nor ``differentiate`` are given.
    differentiate : {"savgol", "kalman", "central"}, optional
        Take the velocity of the states as actions: by a Savitzky-Golay filter; by a Kalman smoother, which finds how
        much noise there is; or by central differences. Demonstrations keep the noise of these velocities.
    window_s : float
        Length of the smoothing window of ``"savgol"`` in seconds; short beside one turn of the movement.
    order : {2, 3}
        Degree of the polynomial that ``"savgol"`` fits in each window.
    rate : float, optional
        Samples per second to resample to. For recordings without times, their own rate.
    trim : (float, float), optional
        Seconds to leave out at the start and at the end.
    still : float, optional
        Leave out what is slower than this at the start and at the end (length of the action).
    centre : bool
        Subtract from the states their mean in each demonstration: for when the place of the surface does not matter.
    max_gap_s : float, optional
        Longer intervals between stamps are gaps; five median intervals by default.
    sort : bool
        Put the rows in the order of their time stamps.
    angles : tuple of str
        State columns that are angles, wrapped or not: a turn more is the same state, for policies, too (``space``).
    degrees : tuple of str, optional
        State and action columns in degrees, which are taken in radians; by default those whose unit says so, and angles
        that jump by 360.
    quaternions : tuple of tuple of str
        Four state columns each, side by side, that are a unit quaternion, in the order w, x, y, z unless their last
        letters say another: q and −q are the same state. Its velocity is the angular velocity in the frame of the body.
    rotation_vectors : tuple of tuple of str
        Three state columns each that are a rotation vector: of the numbers for the same orientation those closest to
        the row before are taken.
    glitches : {"auto", "keep", "repair", "drop"}
        What becomes of samples far off their neighbours: a straight line in their place, or their rows are left out.
        ``"auto"`` repairs at most three in a row, says so, and keeps more.
    seams : {"keep", "cut"}
        Whether nothing is smoothed across jumps to another place, as between demonstrations in one table.
    pauses : {"drop", "keep", "cut"}
        What becomes of rows in which nothing moves, in the middle of a demonstration, before it starts (who follows a
        policy of the state and rests never starts) or after a sudden end. Time stamps stay as they are. ``"cut"``
        makes a demonstration of what moves between any two stands, ``NAME.1``, ``NAME.2``, ...
    action_is : {"auto", "velocity", "target", "delta"}
        What the action columns are: velocities; states to come, so that the velocity of the states is learnt; changes
        to the next sample, so that they are divided by the interval. ``"auto"`` takes them for velocities unless the
        first recording shows states to come, and then says so.

    Raises
    ------
    SettingError
        If a value is out of its range, or both ``actions`` and ``differentiate`` are given.

    Examples
    --------
    >>> recipe = uc.Recipe(states=("x", "y"), differentiate="savgol", rate=50.0)
    >>> recipe.directions
    ('vx', 'vy')
    """

    states: tuple[str, ...] | None = None
    actions: tuple[str, ...] | None = None
    differentiate: str | None = None
    window_s: float = 0.25
    order: int = 3
    rate: float | None = None
    trim: tuple[float, float] | None = None
    still: float | None = None
    centre: bool = False
    max_gap_s: float | None = None
    sort: bool = False
    angles: tuple[str, ...] = ()
    degrees: tuple[str, ...] | None = None
    quaternions: tuple[tuple[str, ...], ...] = ()
    rotation_vectors: tuple[tuple[str, ...], ...] = ()
    glitches: str = "auto"
    seams: str = "keep"
    pauses: str = "drop"
    action_is: str = "auto"

    def __post_init__(self) -> None:
        for name in ("states", "actions"):
            object.__setattr__(self, name, _names(name, getattr(self, name)))
        object.__setattr__(self, "trim", _two_ends(self.trim))
        for name in ("window_s", "rate", "max_gap_s"):
            if getattr(self, name) is not None or name == "window_s":
                check_at_least(name, getattr(self, name), 0, strict=True)
        if self.still is not None:
            check_at_least("still", self.still, 0)
        _check_choice("order", self.order, ORDERS)
        object.__setattr__(self, "order", int(self.order))
        for name, choices in CHOICES.items():
            _check_choice(name, getattr(self, name), choices)
        object.__setattr__(self, "angles", _names("angles", self.angles) if self.angles else ())
        if self.degrees is not None:
            object.__setattr__(self, "degrees", _names("degrees", self.degrees) if self.degrees else ())
        for name, width in (("quaternions", 4), ("rotation_vectors", 3)):
            object.__setattr__(self, name, _groups(name, getattr(self, name), width))
        if self.differentiate is not None:
            _check_choice("differentiate", self.differentiate, METHODS)
        if self.actions is not None and self.differentiate is not None:
            raise SettingError(
                f"got actions {', '.join(self.actions)} and differentiate={self.differentiate!r}, expected one: "
                "either the actions are columns, or they are the velocity of the states."
            )

    @property
    def is_row_by_row(self) -> bool:
        """Whether each row is prepared without looking at others, so that recordings may be cut anywhere."""
        whole = (self.rate, self.trim, self.still)
        defaults = Recipe()
        others = ("centre", "sort", "angles", "quaternions", "rotation_vectors", "glitches", "seams")
        return (
            self.actions is not None
            and self.action_is in ("auto", "velocity")
            and self.pauses != "cut"
            and all(setting is None for setting in whole)
            and all(getattr(self, name) == getattr(defaults, name) for name in others)
        )

    @property
    def space(self) -> spaces.Space:
        """State space of the demonstrations, of a recipe that names its states.

        Raises
        ------
        SettingError
            If an angle or part of a quaternion is none of the states, or a quaternion is not side by side.
        """
        names = self.states or ()
        starts: dict[str, spaces.Space] = {name: spaces.Circle() for name in self.angles}
        starts |= {ordered[0]: sphere for ordered, sphere in self._orientations}
        every, column = list[spaces.Space](), 0
        while column < len(names):
            every.append(starts.pop(names[column], spaces.Euclidean()))
            column += every[-1].sizes[0]
        if starts:
            _refuse_state(next(iter(starts)), names)
        return reduce(mul, every) if every else spaces.Euclidean()

    @property
    def directions(self) -> tuple[str, ...]:
        """Names for the velocities of the states: ``vx`` of x, ``wqx`` about the axis of qx."""
        scalars = {ordered[sphere.order.index("w")] for ordered, sphere in self._orientations}
        turning = {name for group in self.quaternions for name in group}
        moving = [name for name in self.states or () if name not in scalars]
        return tuple(f"w{name}" if name in turning else speed_of(name) for name in moving)

    def labels(self, units: Mapping[str, str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of states and actions with the units of their columns: ``x (mm)``, ``vx (mm/s)``."""
        known = self.units(units)
        named = (self.states or (), self.actions or self.directions)
        states, actions = (tuple(with_unit(name, known.get(name)) for name in names) for names in named)
        return states, actions

    def units(self, recorded: Mapping[str, str]) -> dict[str, str]:
        """Units of what is learnt, by those of columns or their names: rad of angles, and of what is in degrees."""
        told = {name: unit for name in self.states or () if (unit := unit_of([name]))}
        told |= dict.fromkeys(self.angles, "rad") | {name: unit for name, unit in recorded.items() if unit}
        for name in self.degrees or ():
            unit = recorded.get(name) or ("deg/s" if name in (self.actions or ()) else "deg")
            told[name] = re.sub(r"deg(ree)?s?|[°º]", "rad", unit, flags=re.IGNORECASE)
        moving = () if self.actions else self.states or ()
        return told | {speed_of(name): f"{told[name]}/s" for name in moving if name in told}

    @property
    def _orientations(self) -> list[tuple[tuple[str, ...], spaces.Sphere]]:
        """State columns of each quaternion, in their order, and its space."""
        return [_in_states(group, self.states or ()) for group in self.quaternions]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values, ready for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Recipe:
        """Undo :meth:`to_dict`, also after a way through JSON.

        Raises
        ------
        SettingError
            If a name is unknown or a value out of its range.
        """
        if not isinstance(values, Mapping):
            raise SettingError(f"recipe: got {values!r}, expected a mapping of names to values.")
        known = [field.name for field in fields(cls)]
        unknown = [name for name in values if name not in known]
        if unknown:
            raise SettingError(f"recipe: got {', '.join(map(repr, unknown))}, expected only {', '.join(known)}.")
        return cls(**{name: value for name, value in values.items() if (name, value) != ("action_is", None)})


def complete_recipe(recipe: Recipe, recording: Recording) -> Recipe:
    """Fill in what a recipe leaves open about states and actions by the names of the columns.

    Patterns, ranges and stems become the columns that they mean (:func:`~.guesses.resolve`). What is not said is
    guessed, in this order: columns with a velocity beside them (``vx``, ``dx``, ``x_dot``, ``dot_x``, ...); ``x1..xn``
    with ``u1..ud``; numbered columns with their velocities (``q0..`` and ``qd0..``, ``position0..`` and
    ``velocity0..``); positions (``x, y, z``, ``pose_x...``, ``joint_0...``), to be differentiated.

    Raises
    ------
    SettingError
        If the columns do not tell.
    InvalidDataError
        If a column that is named does not exist; the message lists those that do.
    """
    completed = _with_columns(recipe, recording)
    if completed.actions is not None and completed.action_is == "target":
        return replace(completed, actions=None, differentiate="savgol")
    return completed


def stamps(recording: Recording, recipe: Recipe) -> Array | None:
    """Times of a recording; from the rate of the recipe where the recording has none."""
    if recording.times is None and recipe.rate is not None:
        return np.arange(len(recording)) / recipe.rate
    return recording.times


def select(recording: Recording, names: Sequence[str], recipe: Recipe) -> Array:
    """Columns of a recording by name, those in degrees in radians, shape (T, len(names))."""
    values = recording.select(names)
    for column, name in enumerate(names):
        if name in (recipe.degrees or ()):
            values[:, column] *= np.pi / 180.0
    return values


def _with_columns(recipe: Recipe, recording: Recording) -> Recipe:
    columns = recording.columns
    states = recipe.states and recording.resolve(recipe.states)
    told = replace(recipe, states=states, actions=recipe.actions and recording.resolve(recipe.actions))
    told = replace(told, angles=recording.resolve(recipe.angles))
    states = states or _with_turning(told, guess_states(columns))
    replace(recording, values=recording.values[:0], times=None).select([*(states or ()), *(told.actions or ())])
    if states and (told.actions or told.differentiate):
        return replace(told, states=states)
    actions = states and guess_actions(columns, states)
    if actions:
        return replace(told, states=states, actions=actions)
    if states and {*states} <= {*(_with_turning(told, positions_in(columns)) or ())}:
        return replace(told, states=states, differentiate="savgol")
    raise UntoldError(
        f"'{recording.name}': cannot tell {'the actions' if states else 'states and actions'} from its columns "
        f"{listed(columns)}. Say which with states= and actions=, or take the velocity "
        "of the states with differentiate='savgol'."
    )


def _with_turning(recipe: Recipe, states: tuple[str, ...] | None) -> tuple[str, ...] | None:
    """States as guessed, and what the recipe says is an angle or part of an orientation: its columns are states."""
    groups = (recipe.angles, *recipe.quaternions, *recipe.rotation_vectors)
    return tuple(dict.fromkeys((*(states or ()), *(name for group in groups for name in group)))) or None


def _names(what: str, names: Any) -> tuple[str, ...] | None:
    if names is None:
        return None
    named = re.split(r"\s*,\s*", names) if isinstance(names, str) else names
    listed = tuple(named) if isinstance(named, Iterable) else ()
    if not listed or not all(isinstance(name, str) for name in listed) or len(set(listed)) < len(listed):
        raise SettingError(f"{what}: got {names!r}, expected names of columns, at least one and each once.")
    return listed


def _groups(what: str, groups: Any, width: int) -> tuple[tuple[str, ...], ...]:
    """Names of columns, ``width`` together; one group needs no tuple around it."""
    several = (groups,) if groups and all(isinstance(name, str) for name in groups) else tuple(groups)
    named = tuple(_names(what, group) or () for group in several)
    for group in named:
        if len(group) != width:
            raise SettingError(f"{what}: got {', '.join(group)}, expected {width} columns together.")
    return named


def _in_states(group: Sequence[str], states: Sequence[str]) -> tuple[tuple[str, ...], spaces.Sphere]:
    for name in group:
        if name not in states:
            _refuse_state(name, states)
    first = min(states.index(name) for name in group)
    ordered = tuple(states[first : first + 4])
    letters = "".join(name[-1:].lower() for name in ordered)
    if set(ordered) != set(group) or (letters not in spaces.ORDERS and ordered != tuple(group)):
        raise SettingError(
            f"quaternions: got {', '.join(group)} and the states {', '.join(states)}, expected the four columns side "
            "by side, in the order w, x, y, z or x, y, z, w. Give the states in such an order (states=)."
        )
    return ordered, spaces.Sphere(letters if letters in spaces.ORDERS else spaces.ORDERS[0])


def _refuse_state(name: str, states: Sequence[str]) -> NoReturn:
    raise SettingError(f"got {name!r} as an angle, expected one of the states {', '.join(states)}; add it to them.")


def _two_ends(ends: Any) -> tuple[float, float] | None:
    if ends is None:
        return None
    if not isinstance(ends, Sequence) or len(ends) != 2:
        raise SettingError(f"trim: got {ends!r}, expected two numbers, seconds at the start and at the end.")
    for seconds in ends:
        check_at_least("trim", seconds, 0)
    return float(ends[0]), float(ends[1])


def _check_choice(name: str, value: Any, choices: Sequence[Any]) -> None:
    if value not in choices:
        raise SettingError(f"{name}: got {value!r}, expected one of {', '.join(map(str, choices))}.")

"""What to make of the columns of a recording."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from ...base.arrays import check_at_least
from ...base.errors import SettingError
from ..demonstration import Recording

METHODS = ("savgol", "central")
"""Ways to differentiate: Savitzky-Golay smoothing, central differences."""

ORDERS = (2, 3)

VELOCITY_NAMES = ("v{}", "d{}", "{}_dot", "dot_{}", "{}dot")
"""How people call the velocity of a column."""

POSITIONS = (("x", "y", "z"), ("x", "y"))
"""Columns that are positions, to be differentiated, where nothing else is said."""


@dataclass(frozen=True)
class Recipe:
    """How recordings become demonstrations.

    Parameters
    ----------
    states : tuple of str, optional
        Columns that make the state; guessed if None.
    actions : tuple of str, optional
        Columns that make the action. Guessed if neither these nor ``differentiate`` are given.
    differentiate : {"savgol", "central"}, optional
        Take the velocity of the states as actions: by a Savitzky-Golay filter, or by central differences.
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

    Raises
    ------
    SettingError
        If a value is out of its range, or both ``actions`` and ``differentiate`` are given.
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
        _check_choice("centre", self.centre, (False, True))
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
        return self.actions is not None and not self.centre and all(setting is None for setting in whole)

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
        return cls(**values)


def complete_recipe(recipe: Recipe, recording: Recording) -> Recipe:
    """Fill in what a recipe leaves open about states and actions by the names of the columns.

    In this order: columns with a velocity beside them (``vx``, ``dx``, ``x_dot``, ``dot_x`` or
    ``xdot``); ``x1..xn`` with ``u1..ud``; positions ``x, y, z`` or ``x, y``, to be differentiated.

    Raises
    ------
    SettingError
        If the columns do not tell.
    """
    states = recipe.states or _guess_states(recording.columns)
    if states and (recipe.actions or recipe.differentiate):
        return replace(recipe, states=states)
    actions = states and _guess_actions(recording.columns, states)
    if actions:
        return replace(recipe, states=states, actions=actions)
    if states in POSITIONS:
        return replace(recipe, states=states, differentiate="savgol")
    raise SettingError(
        f"'{recording.name}': cannot tell {'the actions' if states else 'states and actions'} from its columns "
        f"{', '.join(recording.columns)}. Say which with states and actions (--state, --action), "
        "or take the velocity of the states with differentiate='savgol' (--state, --differentiate)."
    )


def _guess_states(columns: Sequence[str]) -> tuple[str, ...] | None:
    moving = max((_with_velocity(columns, style) for style in VELOCITY_NAMES), key=len)
    if moving:
        return moving
    numbered = _numbered(columns, "x")
    if numbered:
        return numbered
    return next((names for names in POSITIONS if set(names) <= set(columns)), None)


def _guess_actions(columns: Sequence[str], states: Sequence[str]) -> tuple[str, ...] | None:
    for style in VELOCITY_NAMES:
        velocities = tuple(style.format(name) for name in states)
        if set(velocities) <= set(columns):
            return velocities
    return _numbered(columns, "u") if tuple(states) == _numbered(columns, "x") else None


def _with_velocity(columns: Sequence[str], style: str) -> tuple[str, ...]:
    velocities = {style.format(name) for name in columns}
    # Beside x, dx, ddx only x is a state: dx is its velocity.
    return tuple(name for name in columns if style.format(name) in columns and name not in velocities)


def _numbered(columns: Sequence[str], letter: str) -> tuple[str, ...] | None:
    return tuple(name for name in columns if re.fullmatch(rf"{letter}\d+", name)) or None


def _names(what: str, names: Any) -> tuple[str, ...] | None:
    if names is None:
        return None
    listed = (names,) if isinstance(names, str) else tuple(names) if isinstance(names, Iterable) else ()
    if not listed or not all(isinstance(name, str) for name in listed) or len(set(listed)) < len(listed):
        raise SettingError(f"{what}: got {names!r}, expected names of columns, at least one and each once.")
    return listed


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

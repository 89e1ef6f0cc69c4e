"""Which columns are states and which are actions, by how people call them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, wraps

VELOCITY_NAMES = ("v{}", "d{}", "{}_dot", "dot_{}", "{}dot", "{}_vel", "{}_velocity", "vel_{}")
"""How people call the velocity of a column."""

AXES = ("xyz", "xy")
"""Columns that end so are positions, where nothing else is said."""

FAMILY_OF_VELOCITY = (
    ("qpos", "qvel"),
    ("positions", "velocities"),
    ("position", "velocity"),
    ("pose", "speed"),
    ("pose", "twist"),
    ("pos", "vel"),
    ("q", "qd"),
    ("q", "dq"),
    ("joint", "joint_vel"),
    ("joint", "joint_velocity"),
    ("observation.state", "action"),
    ("observations", "actions"),
    ("observation", "action"),
    ("observation", "actions"),
    ("obs", "actions"),
    ("obs", "action"),
    *(("x", velocity) for velocity in ("xd", "dx", "xdot", "x_dot", "v")),
)
"""Words for several numbered columns, and for their velocities or the actions in their place."""

FAMILY_OF_ACTIONS = (*FAMILY_OF_VELOCITY, ("states", "actions"), ("state", "action"))
"""The same where the states are told: by themselves ``states`` may be those of a simulator."""

PLACES = re.compile(
    r"^p_\w+$|(^|[._/ ])(pose|pos|position|translation|tcp|ee|eef|tool|hand|point|p)(_?(pos|position|pose))?$"
)
"""An axis of such a thing is a position."""

JOINTS = re.compile(r"(^|[._/ ])(actual_)?(q|j|qpos|joints?|joint_?(pos|positions?|angles?)|positions?|tcp_pose|pos)$")
"""Numbered columns of such a name are positions."""

_NUMBERED = re.compile(r"(.*?)[_. \[]?(\d+)\]?")
_OF_AXIS = re.compile(r"(.*?)(?:[_. /]|(?<=[a-z])(?=[XYZ]))?([xyzXYZ])")

_UNIT = re.compile(r"[_ ]?[\[(](?=\D)[^\[\]()]{0,12}[\])]$|_(mm|cm|m)$")
"""A unit at the end of a name, in brackets, or of length after an underscore."""

Guess = Callable[..., tuple[str, ...] | None]


def _without_units(guess: Guess) -> Guess:
    """A guess by names without units, unless two would be the same then."""

    @lru_cache(8)  # of many demonstrations of the same columns
    @wraps(guess)
    def guessed(columns: Sequence[str], *states: Sequence[str]) -> tuple[str, ...] | None:
        plain = {name: _UNIT.sub("", name) for name in columns}
        if len(set(plain.values())) < len(columns):
            return guess(columns, *states)
        found = guess(tuple(plain.values()), *(tuple(plain.get(name, name) for name in one) for one in states))
        named = {short: name for name, short in plain.items()}
        return None if found is None else tuple(named[short] for short in found)

    return guessed


@_without_units
def guess_states(columns: Sequence[str]) -> tuple[str, ...] | None:
    """Columns that look as states: with a velocity, numbered x, several with their velocities, positions."""
    moving = max((_with_velocity(columns, style) for style in VELOCITY_NAMES), key=len)
    if moving:
        return moving
    if numbered := numbered_as("x", columns):
        return numbered
    families = _families(columns)
    paired = next((names for head, names in families.items() if _counterpart(head, families)), None)
    return paired or positions_in(columns)


@_without_units
def guess_actions(columns: Sequence[str], states: Sequence[str]) -> tuple[str, ...] | None:
    """Columns that look as the velocities of these states, or as the actions in them."""
    for style in VELOCITY_NAMES:
        velocities = tuple(style.format(name) for name in states)
        if set(velocities) <= set(columns):
            return velocities
    families = _families(columns)
    heads = (head for head, names in families.items() if names == tuple(states))
    paired = next(filter(None, (_counterpart(head, families, FAMILY_OF_ACTIONS) for head in heads)), None)
    if paired is not None:
        return families[paired]
    return numbered_as("u", columns) if tuple(states) == numbered_as("x", columns) else None


@_without_units
def positions_in(columns: Sequence[str]) -> tuple[str, ...] | None:
    """Columns that look as positions, to be differentiated; None where there are none, or several to choose from."""
    places = _places(columns)
    called = {head: names for head, names in places.items() if not head or PLACES.search(head.lower())}
    if "" in places:
        return places[""]
    for one in (called, places):
        if len(one) == 1:
            return next(iter(one.values()))
    joints = {head: names for head, names in _families(columns).items() if JOINTS.search(head.lower())}
    if places or not joints:
        return None
    head, names = next(iter(joints.items()))
    # The pose of a tool is three coordinates and a rotation, which is no vector to differentiate.
    return names[:3] if head.lower().endswith("pose") and len(names) > 3 else names


def siblings(columns: Sequence[str], states: Sequence[str]) -> tuple[str, ...]:
    """Positions of which some, but not all, are states, those that are with them; none where there are none."""
    plain = {_UNIT.sub("", name): name for name in columns}
    places = [{plain[name] for name in names} for names in _places((*plain,)).values()]
    return tuple(name for names in places if names & {*states} and not names <= {*states} for name in sorted(names))


def numbered_as(letter: str, columns: Sequence[str]) -> tuple[str, ...] | None:
    """Columns of one letter and a number, None if there is none."""
    return tuple(filter(re.compile(rf"{letter}\d+").fullmatch, columns)) or None


def _with_velocity(columns: Sequence[str], style: str) -> tuple[str, ...]:
    velocities, known = {style.format(name): name for name in columns}, set(columns)
    # Beside x, dx, ddx only x is a state: dx is its velocity.
    return tuple(name for velocity, name in velocities.items() if velocity in known and name not in velocities)


def _families(columns: Sequence[str]) -> Mapping[str, tuple[str, ...]]:
    """Columns that differ in a number, or in what follows the last point, by what they have in common."""
    numbered: dict[str, list[str]] = defaultdict(list)
    dotted: dict[str, list[str]] = defaultdict(list)
    for name in columns:
        if found := _NUMBERED.fullmatch(name):
            numbered[found[1]].append(name)
        dotted[name.rpartition(".")[0]].append(name)
    families = [*numbered.items(), *((head, names) for head, names in dotted.items() if head not in numbered)]
    return {head: tuple(names) for head, names in families if head and len(names) > 1}


def _counterpart(
    head: str, families: Mapping[str, tuple[str, ...]], words: Sequence[tuple[str, str]] = FAMILY_OF_VELOCITY
) -> str | None:
    """The family of the velocities of a family: called as it, but for one word."""
    for place, speed in words:
        stem = re.fullmatch(rf"(.*?[._/ ])?{re.escape(place)}", head, re.IGNORECASE)
        wanted = "" if stem is None else f"{stem[1] or ''}{speed}".lower()
        other = next((each for each in families if each.lower() == wanted), None)
        # A velocity has as many entries as what moves; an action may have fewer than an observation.
        if other is not None and (speed.startswith("action") or len(families[other]) == len(families[head])):
            return other
    return None


def _places(columns: Sequence[str]) -> Mapping[str, tuple[str, ...]]:
    """Columns that differ in the axis, by what they have in common; orientations, with a w beside them, left out."""
    axes: dict[str, dict[str, str]] = defaultdict(dict)
    for name in columns:
        if found := _OF_AXIS.fullmatch(name):
            axes[found[1]].setdefault(found[2].lower(), name)
    ends = {name.lower() for name in columns}
    turning = {head for head in axes if any(f"{head.lower()}{mark}w" in ends for mark in ("", "_", ".", " "))}
    places = {}
    for head, names in axes.items():
        letters = next((each for each in AXES if set(each) == set(names)), None)
        is_place = head not in turning and not _NOT_PLACES.search(head.lower())
        if letters and (head == "" or is_place or (head == "t" and "q" in turning and "f" not in axes)):
            places[head] = tuple(names[letter] for letter in letters)
    return places


_NOT_PLACES = re.compile(
    r"^(?!p_)(?:.*[._/ ])?(force|torque|wrench|moment|linear|angular|vel|velocity|speed|acc|acceleration|gyro|mag"
    r"|orientation|rot|rotation|quat|quaternion|euler|twist|f|t|r|n|w|v|d|a|q)$"
)

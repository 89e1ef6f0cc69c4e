"""What is to be seen in space, whatever shows it: demonstrations, what a policy makes of them, what held them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..base.arrays import Array
from ..base.display import innermost
from ..base.errors import SettingError
from ..models import SUPPORTED
from ..motion import rollout
from ..recordings import Demonstration

if TYPE_CHECKING:
    from ..constraints import Constraint, LearntConstraint
    from ..motion import Guided
    from ..policies import Policy

MOST_PATCHES = 250
"""Pieces of a learnt constraint that are drawn."""

PATCH = 0.04
"""Half the length of such a piece, as a share of the extent."""

BEYOND = 0.25
"""How far a movement is followed beyond the data, as a share of the extent of the states."""

LIGHT: tuple[str, ...] = ("#0072b2", "#c2570c", "#007d5f", "#a3508a", "#8a6d00", "#3a4cc0", "#b3261e", "#4d7a1e")
LIGHT += ("#7a4f33", "#0b8a9e", "#d6339a", "#4a4f57")
"""Colours of demonstrations in turn, as on the page."""


class Patches(NamedTuple):
    """What a constraint leaves free at some states: ``at`` (K, n), and at each the directions ``free`` (f, n)."""

    at: Array
    free: list[Array]

    def pieces(self, scene: Scene, reach: float) -> Array:
        """Ends in space (K, 2, 3) of lines through the states along two free directions of each, at most."""
        ways = [(at, way) for at, free in zip(*self, strict=True) for way in free[:2]]
        ends = [scene.places(np.stack([at - reach * way, at + reach * way])) for at, way in ways]
        return np.array(ends).reshape(-1, 2, 3)


class Movement(NamedTuple):
    """What a policy does, and how near data is along it, (T,); None of a policy that has no support."""

    track: Demonstration
    support: Array | None


class Scene(NamedTuple):
    """What there is.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
    columns, directions : sequence of str
        Names of states and actions.
    policy : Policy or Guided, optional
        Fitted, of as many states.
    constraint : LearntConstraint, optional
        Fitted, of as many states.
    arm : optional
        Whose joint angles the states are: with ``frames``, ``names`` and ``joints``, as :mod:`unconstrain.systems` has.
    """

    demonstrations: Sequence[Demonstration]
    columns: Sequence[str]
    directions: Sequence[str]
    policy: Policy | Guided | None = None
    constraint: LearntConstraint | None = None
    arm: Any = None

    def places(self, states: Array) -> Array:
        """Points in space (T, 3): the first three states, or where the hand of the arm is."""
        shown = states[:, :3] if self.arm is None else self.arm.frames(states)[1][-1].T
        return np.pad(shown, ((0, 0), (0, 3 - shown.shape[1])))

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest coordinates in space of all demonstrations, and of the arm, from its base on."""
        states = np.vstack([demo.states for demo in self.demonstrations])
        places = self.places(states)
        if self.arm is not None:
            joints = np.moveaxis(self.arm.frames(states)[1], 1, 2).reshape(-1, 3)
            places = np.vstack([places, joints, np.zeros(3)])
        return places.min(axis=0), places.max(axis=0)

    @property
    def moves(self) -> bool:
        """Whether a movement follows from the policy: it has an action for each state."""
        learnt = innermost(self.policy)
        return learnt is not None and learnt.n_features_in_ == learnt.n_outputs_ == len(self.columns)

    def follow(self, start: Array, steps: int, dt: float, held: Constraint | None = None) -> Movement:
        """Roll the policy out, at most as far beyond the data as a quarter of the extent of the states.

        Raises
        ------
        InvalidDataError
            If the movement leaves the finite numbers.
        """
        policy: Any = self.policy
        track = rollout(policy, start, steps, dt, held, least_support=0.0)
        try:
            support = innermost(policy).support(track.states)
        except SettingError:  # of a policy that has none
            return Movement(track, None)
        ways = np.linalg.norm(np.diff(track.states, axis=0, prepend=track.states[:1]), axis=1)
        beyond = np.cumsum(ways * (support < SUPPORTED))
        extent = np.ptp(np.vstack([demo.states for demo in self.demonstrations]), axis=0).max()
        near = beyond <= BEYOND * extent
        return Movement(track[near], support[near])

    def patches(self) -> Patches | None:
        """What the constraint leaves free, if there is one of these states."""
        if self.constraint is None:
            return None
        return patches_of(self.constraint, np.vstack([demo.states for demo in self.demonstrations]))


def rgb_of(colour: str) -> tuple[int, ...]:
    """A colour as three numbers up to 255."""
    return tuple(bytes.fromhex(colour[1:]))


def step_of(demo: Demonstration) -> float:
    """Usual seconds between samples; 0.02 where no times are known."""
    return 0.02 if demo.times is None or len(demo) < 2 else float(np.median(np.diff(demo.times)))


def patches_of(constraint: LearntConstraint, states: Array) -> Patches | None:
    """What a constraint leaves free at some of the states: two directions are a piece of a surface, one is a line."""
    chosen = states[_spread(states, MOST_PATCHES)]
    rows = constraint(chosen)
    if rows.shape[2] != states.shape[1]:
        return None
    return Patches(chosen, [_free(held) for held in rows])


def _free(held: Array) -> Array:
    _, singular, axes = np.linalg.svd(held)
    return axes[int((singular > 0.5).sum()) :]


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

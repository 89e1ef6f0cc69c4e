"""State spaces: straight axes, angles that close, orientations, and products of these.

A space gives each state *coordinates*, a point of a Euclidean space: an angle its point on a circle, an orientation
its rotation matrix. Equal states are equal points there (a turn more, or the opposite quaternion, is the same state),
and the chord between two points is to first order the angle between them. Features, fields and folds look at
coordinates; Gaussian kernels of chords are kernels, those of angles are none (Feragen, Lauze and Hauberg, *CVPR* 2015).

Actions are velocities: along a straight axis and of an angle their rates of change, of an orientation the angular
velocity in the frame of the body, three components in rad/s. An orientation has four state columns and three actions.

Examples
--------
>>> circle = uc.spaces.Circle()
>>> bool(np.isclose(circle.difference(np.array([[3.1]]), np.array([[-3.1]]))[0, 0], 6.2 - 2 * np.pi))
True
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import reduce
from math import pi
from operator import mul
from typing import Self

import numpy as np

from ..base.arrays import Array, beside, check_at_least, namespace, on_host
from ..base.errors import InvalidDataError, SettingError

ORDERS = ("wxyz", "xyzw")
"""Orders of the components of a quaternion: the scalar first or last."""

PAIRS = np.array([(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
"""Products of the components (w, x, y, z) of a quaternion that a rotation matrix consists of, shape (10, 2)."""

ROTATION = np.array(
    [
        [1, 1, -1, -1, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 0, -2, 2, 0, 0],
        [0, 0, 0, 0, 0, 2, 0, 0, 2, 0],
        [0, 0, 0, 0, 0, 0, 2, 2, 0, 0],
        [1, -1, 1, -1, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, -2, 0, 0, 0, 0, 2],
        [0, 0, 0, 0, 0, -2, 0, 0, 2, 0],
        [0, 0, 0, 0, 2, 0, 0, 0, 0, 2],
        [1, -1, -1, 1, 0, 0, 0, 0, 0, 0],
    ]
) / np.sqrt(2.0)
"""Rotation matrix by rows, over √2, from those products, shape (9, 10): with it chords are angles to first order."""

_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


class Space(ABC):
    """How states are compared, moved and averaged. ``a * b`` is the product: the columns of a, then those of b."""

    @property
    @abstractmethod
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of state columns n, of coordinates m, and of directions t in which a state can move."""

    @property
    def factors(self) -> tuple[Space, ...]:
        """Spaces that this is the product of; itself if it is none."""
        return (self,)

    def __mul__(self, other: Space) -> Space:
        """Product of two spaces."""
        (*before, last), (first, *after) = self.factors, other.factors
        between: tuple[Space, ...] = (last, first)
        if isinstance(last, Euclidean) and isinstance(first, Euclidean):
            between = (Euclidean(last.columns + first.columns),)
        parts = (*before, *between, *after)
        return Product(parts) if len(parts) > 1 else parts[0]

    def over(self, columns: int) -> Space:
        """Return the space of so many state columns: itself, or as often as it fits.

        Raises
        ------
        InvalidDataError
            If it does not fit.
        """
        own = self.sizes[0]
        if columns == own:
            return self
        if len(self.factors) > 1 or columns % own:
            raise InvalidDataError(
                f"states: got {columns} columns, expected {own} as the space {self} has. Name the space of every "
                "column, such as Euclidean(2) * Circle()."
            )
        return reduce(mul, (self,) * (columns // own))

    @abstractmethod
    def coordinates(self, states: Array) -> Array:
        """Coordinates (N, m) of states (N, n), which may be an array of any library."""

    @abstractmethod
    def states(self, coordinates: Array) -> Array:
        """States (N, n) nearest to some points (N, m)."""

    @abstractmethod
    def axes(self, coordinates: Array) -> Array:
        """Axes J (M, k, m) of local models at points z_m (M, m), which are linear in ``J (z − z_m)``.

        The first are tangents, along which that is the difference to first order. A circle keeps the axis across it,
        so that local models hold sines exactly, for one weight more; of a rotation matrix there would be six more.
        """

    def frame(self, coordinates: Array) -> Array | None:
        """Orthogonal matrix (m, m) that takes a point (m,) to where all begin; None where nothing is turned."""
        return None

    def relative(self, states: Array, origin: Array) -> Array:
        """States (N, n) as seen from other states."""
        return states - origin

    @abstractmethod
    def difference(self, states: Array, origin: Array) -> Array:
        """Shortest ways (N, t) from some states to others (the logarithm): what an action over one second takes."""

    @abstractmethod
    def step(self, states: Array, differences: Array) -> Array:
        """States (N, n) after ways (N, t) from others (the exponential)."""

    def mean(self, states: Array) -> Array:
        """State (1, n) nearest to the mean of the coordinates of states (N, n)."""
        return self.states(self.coordinates(states).mean(axis=0, keepdims=True))

    def unrolled(self, states: Array) -> Array:
        """Path (T, t) whose steps are the differences of successive states (T, n): what to smooth and differentiate."""
        steps = self.difference(states[1:], states[:-1])
        return np.concatenate([np.zeros_like(steps, shape=(1, steps.shape[1])), np.cumsum(steps, axis=0)])


@dataclass(frozen=True)
class Euclidean(Space):
    """Straight axes, which are their own coordinates.

    Parameters
    ----------
    columns : int
        Number of axes in a product; alone, it is the space of any number.
    """

    columns: int = 1

    def __post_init__(self) -> None:
        check_at_least("columns", self.columns, 0, whole=True)

    @property
    def sizes(self) -> tuple[int, int, int]:
        """All are the number of axes."""
        return (self.columns,) * 3

    def over(self, columns: int) -> Space:
        """So many axes."""
        return replace(self, columns=columns)

    def coordinates(self, states: Array) -> Array:
        """The states."""
        return states

    def states(self, coordinates: Array) -> Array:
        """The coordinates."""
        return coordinates

    def axes(self, coordinates: Array) -> Array:
        """Identities (M, n, n)."""
        return np.tile(np.eye(coordinates.shape[1]), (len(coordinates), 1, 1))

    difference = Space.relative

    def step(self, states: Array, differences: Array) -> Array:
        """Add."""
        return states + differences

    def unrolled(self, states: Array) -> Array:
        """The states."""
        return states


@dataclass(frozen=True)
class Circle(Space):
    """Angles: a turn more or less is the same state.

    Parameters
    ----------
    turn : float
        One turn in the unit of the states, 2 π or 360; actions are in the same unit per second.
    """

    turn: float = 2 * pi

    def __post_init__(self) -> None:
        check_at_least("turn", self.turn, 0.0, strict=True)

    @property
    def sizes(self) -> tuple[int, int, int]:
        """An angle, two coordinates, one direction."""
        return 1, 2, 1

    @property
    def radius(self) -> float:
        """Of the circle on which arcs are angles in the unit of the states."""
        return self.turn / (2 * pi)

    def coordinates(self, states: Array) -> Array:
        """Points (N, 2) on the circle."""
        xp, angles = namespace(states), states / self.radius
        return self.radius * xp.concat([xp.cos(angles), xp.sin(angles)], axis=1)

    def states(self, coordinates: Array) -> Array:
        """Angles (N, 1), from above minus half a turn to half a turn."""
        return self.radius * np.arctan2(coordinates[:, 1:], coordinates[:, :1])

    def axes(self, coordinates: Array) -> Array:
        """Tangent and normal (M, 2, 2): at an angle δ there is ``sin δ`` along and ``cos δ − 1`` across, in radii."""
        across = coordinates / np.linalg.norm(coordinates, axis=1, keepdims=True)
        return np.stack([across[:, ::-1] * [-1.0, 1.0], across], axis=1)

    def frame(self, coordinates: Array) -> Array:
        """Turn a point to the angle zero."""
        length = float(np.linalg.norm(coordinates))
        cosine, sine = coordinates / length if length > 0.0 else (1.0, 0.0)
        return np.array([[cosine, sine], [-sine, cosine]])

    def difference(self, states: Array, origin: Array) -> Array:
        """Angles (N, 1) of at most half a turn."""
        return self._wrapped(states - origin)

    def step(self, states: Array, differences: Array) -> Array:
        """Add, and wrap to above minus half a turn, up to half a turn."""
        return self._wrapped(states + differences)

    def unrolled(self, states: Array) -> Array:
        """Angles (T, 1) without jumps."""
        return np.asarray(np.unwrap(states, period=self.turn, axis=0))

    def _wrapped(self, angles: Array) -> Array:
        return np.asarray(angles - self.turn * np.ceil(angles / self.turn - 0.5))


@dataclass(frozen=True)
class Sphere(Space):
    """Orientations as unit quaternions, which take vectors from the body to the world; q and −q are the same.

    Parameters
    ----------
    order : {"wxyz", "xyzw"}
        Whether the scalar is first or last.

    Raises
    ------
    SettingError
        For another order.
    """

    order: str = "wxyz"

    def __post_init__(self) -> None:
        if self.order not in ORDERS:
            raise SettingError(f"order: got {self.order!r}, expected one of {', '.join(ORDERS)}.")

    @property
    def sizes(self) -> tuple[int, int, int]:
        """A quaternion, a matrix, three axes to turn about."""
        return 4, 9, 3

    @property
    def places(self) -> list[int]:
        """Columns of w, x, y and z."""
        return [self.order.index(component) for component in "wxyz"]

    def coordinates(self, states: Array) -> Array:
        """Rotation matrices, by rows, over √2, (N, 9).

        Raises
        ------
        InvalidDataError
            If the length of a quaternion is off one by more than a tenth.
        """
        xp = namespace(states)
        first, second = (beside(np.array(self.places)[column], states) for column in PAIRS.T)
        products = xp.take(states, first, axis=1) * xp.take(states, second, axis=1)
        squared = xp.sum(states * states, axis=1)
        if not xp.all(xp.abs(squared - 1.0) <= 0.2):  # NaN is none either
            self._refuse(np.sqrt(on_host(squared)))
        return (products @ beside(ROTATION.T, states)) / squared[:, None]

    def states(self, coordinates: Array) -> Array:
        """Quaternions (N, 4) whose scalar is not negative: the largest eigenvectors of Davenport's matrix (1968)."""
        weights = coordinates @ ROTATION
        matrices = np.zeros((len(coordinates), 4, 4))
        matrices[:, PAIRS[:, 1], PAIRS[:, 0]] = np.where(PAIRS[:, 0] == PAIRS[:, 1], 1.0, 0.5) * weights
        found = np.linalg.eigh(matrices)[1][:, :, -1]
        found *= np.where(found[:, :1] < 0.0, -1.0, 1.0)
        return self._joined(found[:, :1], found[:, 1:])

    def axes(self, coordinates: Array) -> Array:
        """Tangents (M, 3, 9): after a turn by δ about the unit vector a of the body there is ``sin δ a`` along them."""
        rotations = coordinates.reshape(-1, 3, 3)
        return -np.einsum("ijk,mlj->milk", _LEVI_CIVITA, rotations).reshape(-1, 3, 9)

    def frame(self, coordinates: Array) -> Array:
        """Turn an orientation to that of the world."""
        nearest = np.sqrt(2.0) * self.coordinates(self.states(coordinates[None])).reshape(3, 3)
        return np.kron(nearest.T, np.eye(3))

    def relative(self, states: Array, origin: Array) -> Array:
        """Orientations (N, 4) in the frame of others."""
        (w, v), (c, a) = self._parts(states), self._parts(origin)
        return self._joined(c * w + (a * v).sum(axis=1, keepdims=True), c * v - w * a - np.cross(a, v))

    def difference(self, states: Array, origin: Array) -> Array:
        """Rotation vectors (N, 3) in the frame of the body, of at most half a turn."""
        w, v = self._parts(self.relative(states, origin))
        w, v = np.abs(w), np.where(w < 0.0, -v, v)
        length = np.linalg.norm(v, axis=1, keepdims=True)
        turned = np.where(length > 0.0, 2.0 * np.arctan2(length, w) / np.where(length > 0.0, length, 1.0), 2.0)
        return np.asarray(turned * v)

    def step(self, states: Array, differences: Array) -> Array:
        """Unit quaternions after rotations about axes of the body."""
        half = 0.5 * np.linalg.norm(differences, axis=1, keepdims=True)
        c, a = np.cos(half), 0.5 * np.sinc(half / pi) * differences
        w, v = self._parts(states)
        moved = self._joined(w * c - (v * a).sum(axis=1, keepdims=True), w * a + c * v + np.cross(v, a))
        return moved / np.linalg.norm(moved, axis=1, keepdims=True)

    def _parts(self, states: Array) -> tuple[Array, Array]:
        """Scalars (N, 1) and vectors (N, 3)."""
        w, *v = self.places
        return states[:, [w]], states[:, v]

    def _joined(self, scalars: Array, vectors: Array) -> Array:
        return np.concatenate([scalars, vectors] if self.order == "wxyz" else [vectors, scalars], axis=1)

    def _refuse(self, lengths: Array) -> None:
        row = int(np.argmax(~(np.abs(lengths**2 - 1.0) <= 0.2)))
        raise InvalidDataError(
            f"states: got a quaternion of length {lengths[row]:.3g} at row {row}, expected unit quaternions. Name the "
            "four columns of the quaternion, or divide by its length."
        )


@dataclass(frozen=True)
class Product(Space):
    """Several spaces side by side, each with its columns, its coordinates and its actions.

    Parameters
    ----------
    parts : tuple of Space
        In the order of the state columns. ``Euclidean(2) * Circle()`` makes one.
    """

    parts: tuple[Space, ...]

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Sums of those of the parts."""
        columns, coordinates, directions = map(sum, zip(*(part.sizes for part in self.parts), strict=True))
        return columns, coordinates, directions

    @property
    def factors(self) -> tuple[Space, ...]:
        """The parts."""
        return self.parts

    def coordinates(self, states: Array) -> Array:
        """Coordinates of each part, side by side."""
        return namespace(states).concat(self._each("coordinates", (states, 0)), axis=1)

    def states(self, coordinates: Array) -> Array:
        """States of each part, side by side."""
        return np.concatenate(self._each("states", (coordinates, 1)), axis=1)

    def axes(self, coordinates: Array) -> Array:
        """Axes of each part, as blocks on the diagonal."""
        each = zip(*self._each("axes", (coordinates, 1)), strict=True)
        return np.stack([_block_diagonal(*blocks) for blocks in each])

    def frame(self, coordinates: Array) -> Array:
        """Matrix of the frames of the parts."""
        parts = zip(self.parts, self._cut(coordinates[None], 1), strict=True)
        frames = [(part.frame(own[0]), part.sizes[1]) for part, own in parts]
        return _block_diagonal(*(np.eye(size) if frame is None else frame for frame, size in frames))

    def relative(self, states: Array, origin: Array) -> Array:
        """States of each part as seen from others."""
        return np.concatenate(self._each("relative", (states, 0), (origin, 0)), axis=1)

    def difference(self, states: Array, origin: Array) -> Array:
        """Differences of each part, side by side."""
        return np.concatenate(self._each("difference", (states, 0), (origin, 0)), axis=1)

    def step(self, states: Array, differences: Array) -> Array:
        """Steps of each part, side by side."""
        return np.concatenate(self._each("step", (states, 0), (differences, 2)), axis=1)

    def unrolled(self, states: Array) -> Array:
        """Paths of each part, side by side."""
        return np.concatenate(self._each("unrolled", (states, 0)), axis=1)

    def _each(self, what: str, *tables: tuple[Array, int]) -> list[Array]:
        """What each part makes of its columns of some tables, which are of kinds as in :meth:`_cut`."""
        cut = zip(*(self._cut(table, kind) for table, kind in tables), strict=True)
        return [getattr(part, what)(*own) for part, own in zip(self.parts, cut, strict=True)]

    def _cut(self, table: Array, kind: int) -> list[Array]:
        """The columns of each part, of states, coordinates or directions: 0, 1, 2."""
        sizes = [part.sizes[kind] for part in self.parts]
        return [table[:, stop - size : stop] for size, stop in zip(sizes, np.cumsum(sizes).tolist(), strict=True)]


@dataclass(frozen=True, eq=False)
class Embedding:
    """Coordinates of a space, turned so that they do not depend on where its angles begin.

    Parameters
    ----------
    space : Space
    frame : ndarray, shape (m, m), optional
        Orthogonal; it turns the space's own coordinates. None where they are the states.
    """

    space: Space = Euclidean()
    frame: Array | None = None

    def __post_init__(self) -> None:
        columns, coordinates, _ = self.space.sizes
        if self.frame is None and columns != coordinates:
            object.__setattr__(self, "frame", np.eye(coordinates))

    def __call__(self, states: Array) -> Array:
        """Coordinates (N, m) of states (N, n); straight axes are their own."""
        return self.turned(self.space.coordinates(states))

    def turned(self, points: Array) -> Array:
        """Points (N, m), or one (m,), of the space's own coordinates in these."""
        return points if self.frame is None else points @ beside(self.frame.T, points)

    def states(self, coordinates: Array) -> Array:
        """States (N, n) nearest to some points (N, m)."""
        return self.space.states(coordinates if self.frame is None else coordinates @ self.frame)

    def axes(self, coordinates: Array) -> Array:
        """Axes (M, k, m) of local models at some points (M, m); see :meth:`Space.axes`."""
        if self.frame is None:
            return self.space.axes(coordinates)
        return np.asarray(self.space.axes(coordinates @ self.frame) @ self.frame.T)

    def seen_from(self, mean: Array) -> Self:
        """The same, turned so that a point (m,) of the space's own coordinates is where all begin."""
        return replace(self, frame=self.space.frame(mean))


def _block_diagonal(*blocks: Array) -> Array:
    from scipy.linalg import block_diag  # takes a fifth of a second to import

    return np.asarray(block_diag(*blocks))

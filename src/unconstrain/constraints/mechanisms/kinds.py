"""Mechanisms that hold positions: point, line, plane, circle, sphere, cylinder, screw.

Each says which rows its constraint matrix has, how far a recording is from it, in which coordinates it moves freely,
and where fits begin. What is round begins at the algebraic fit, that of ``‖x‖² = 2 cᵀx + b``, which is linear (Kåsa
1976), and at the curvature of the best line or plane, which is better for short arcs.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from ...base.arrays import Array
from ...risks import unit_actions
from .mechanism import Form, M, Mechanism, frame_of
from .track import Track, principal

MOST_STARTS = 3
"""Axes from which a fit begins, of those tried: the ones of the least algebraic residual."""

LEAST_CURVATURE = 1e-6
"""With which a fit begins, in units of the extent."""


class Flat(Mechanism):
    """Some rows of the frame are held, and the others are free."""

    held: ClassVar[slice]
    main: ClassVar[int] = 0
    """Which principal direction is the axis."""

    def rows(self, positions: Array) -> Array:
        """The same everywhere."""
        rows = self.frame[self.held] if self.form.chart else np.zeros((1, len(self.centre)))
        return np.broadcast_to(rows, (len(positions), *rows.shape))

    def residuals(self, track: Track) -> Array:
        """Along each row."""
        return (track.positions - self.centre) @ self.frame[self.held].T

    def travel(self, track: Track) -> Array:
        """Along the rest of the frame."""
        return (track.positions - self.centre) @ np.delete(self.frame, self.held, axis=0).T

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """The principal directions, which are the optimum."""
        centre, directions = principal(track.positions)
        return [cls(centre=centre, frame=frame_of(directions[cls.main]))]


class Free(Flat):
    """Nothing is held."""

    form, held = Form("free", "a movement that nothing holds", (), ()), slice(0)


class Point(Flat):
    """Held at one point."""

    form, held = Form("point", "a point at {centre}", ("centre",), (3,)), slice(None)


class Line(Flat):
    """Free along one line, its axis."""

    form = Form("line", "a line through {centre} along {axis}", ("across", "tilt"), (2,))
    held = slice(1, None)


class Plane(Flat):
    """Free in one plane; the axis is its normal."""

    form = Form("plane", "a plane through {centre} with the normal {axis}", ("along", "tilt"), (1,))
    held, main = slice(1), -1


class Sphere(Mechanism):
    """At one distance from a centre."""

    form = Form(
        "sphere", "a sphere about {centre}, radius {radius}", ("centre", "radius"), (1,), Plane, ("towards the centre",)
    )

    def rows(self, positions: Array) -> Array:
        """Towards the centre."""
        return unit_actions(positions - self.centre)[0][:, None, :]

    def residuals(self, track: Track) -> Array:
        """Distance from the centre."""
        return np.linalg.norm(track.positions - self.centre, axis=1, keepdims=True) - self.radius

    def travel(self, track: Track) -> Array:
        """Longitude and sine of latitude, an equal-area map, about the pole from which the recording keeps away."""
        outwards = unit_actions(track.positions - self.centre)[0]
        first, second, sine = np.linalg.svd(outwards, full_matrices=False)[2] @ outwards.T
        return self.radius * np.column_stack([_arc(np.arctan2(second, first)), sine])

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """The algebraic one, and that of the mean curvature over the flat directions."""
        centre, radius, _ = _algebraic_circle(track.positions)
        middle, flat, normals, curvature = _osculating(track, track.dimensions - 1)
        bend = _bent(np.trace(curvature[:, :, 0]) / len(flat))
        start = cls(centre=centre, radius=radius, frame=np.eye(track.dimensions))
        return [start, replace(start, centre=middle + normals[0] / bend, radius=abs(1 / bend))]


class FlatCircle(Sphere):
    """At one distance from a centre in a plane: a hinge."""

    form = Sphere.form._replace(kind="circle", phrase="a circle (hinge) about {centre}, radius {radius}", straight=Line)

    def travel(self, track: Track) -> Array:
        """Along the arc."""
        first, second = (track.positions - self.centre).T
        return self.radius * _arc(np.arctan2(second, first))[:, None]


class Circle(Mechanism):
    """About an axis at one distance and one height: a hinge."""

    form = Form(
        "circle",
        "a circle (hinge) about {centre}, axis {axis}, radius {radius}",
        ("centre", "tilt", "radius"),
        (2,),
        Line,
        ("along the axis", "towards the axis"),
    )

    def rows(self, positions: Array) -> Array:
        """The axis, and away from it."""
        outwards = self.cylindrical(positions)[1]
        return np.stack([np.broadcast_to(self.axis, outwards.shape), outwards], axis=1)

    def residuals(self, track: Track) -> Array:
        """Height and distance."""
        along, _, distance = self.cylindrical(track.positions)
        return np.column_stack([along, distance - self.radius])

    def travel(self, track: Track) -> Array:
        """Along the arc."""
        return self.radius * _arc(angle(self, track))[:, None]

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """The algebraic one in the principal plane, and that of the curvature over the line."""
        centre, directions = principal(track.positions)
        middle, flat, normals, curvature = _osculating(track, 1)
        inwards, curved = unit_actions(curvature[0, 0] @ normals)
        bend = _bent(float(curved))
        start, _ = _about(cls, track, centre, frame_of(directions[-1]))
        bent = cls(centre=middle + inwards / bend, frame=frame_of(np.cross(flat[0], inwards)), radius=1 / bend)
        return [start, bent]


class Cylinder(Mechanism):
    """About an axis at one distance."""

    form = Form(
        "cylinder",
        "a cylinder about {centre}, axis {axis}, radius {radius}",
        ("across", "tilt", "radius"),
        (1,),
        Plane,
        ("towards the axis",),
    )

    def rows(self, positions: Array) -> Array:
        """Away from the axis."""
        return self.cylindrical(positions)[1][:, None, :]

    def residuals(self, track: Track) -> Array:
        """Distance from the axis."""
        return self.cylindrical(track.positions)[2][:, None] - self.radius

    def travel(self, track: Track) -> Array:
        """Height, and along the arc."""
        return np.column_stack([(track.positions - self.centre) @ self.axis, self.radius * _arc(angle(self, track))])

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """Algebraic ones, and that of the greatest curvature over the plane."""
        middle, flat, normals, curvature = _osculating(track, 2)
        bends, ways = np.linalg.eigh(curvature[:, :, 0])
        most = int(abs(bends).argmax())
        frame, bend = frame_of(ways[:, 1 - most] @ flat), _bent(bends[most])
        bent = cls(centre=middle + normals[0] / bend, frame=frame, radius=abs(1 / bend))
        return [*_about_each_axis(cls, track), bent]


class Screw(Mechanism):
    """About an axis at one distance, and along it in step with the angle: a helix."""

    form = Form(
        "screw",
        "a screw about {centre}, axis {axis}, radius {radius}, advance in a turn {pitch}",
        ("centre", "tilt", "radius", "pitch"),
        (2,),
        Circle,
        ("towards the axis", "across the thread"),
    )

    def rows(self, positions: Array) -> Array:
        """Away from the axis, and across the thread."""
        _, outwards, distance = self.cylindrical(positions)
        rising = distance[:, None] * self.axis - self.pitch * np.cross(self.axis, outwards)
        return np.stack([outwards, unit_actions(rising)[0]], axis=1)

    def residuals(self, track: Track) -> Array:
        """Distance from the axis, and from the thread."""
        along, _, distance = self.cylindrical(track.positions)
        above = along - self.pitch * self._angle(track, along)
        return np.column_stack([distance - self.radius, above * np.cos(np.arctan2(self.pitch, self.radius))])

    def travel(self, track: Track) -> Array:
        """Along the thread."""
        along = (track.positions - self.centre) @ self.axis
        aside = self.radius**2 * self._angle(track, along) + self.pitch * along
        return aside[:, None] / max(np.hypot(self.radius, self.pitch), 1e-12)

    def _angle(self, track: Track, along: Array) -> Array:
        return in_step(angle(self, track), along, self.pitch, track)

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """Circles, with the pitch of a regression."""
        return [_rising(start, track) for start in _about_each_axis(cls, track)]


KINDS: tuple[type[Mechanism], ...] = (Free, Point, Line, Plane, Circle, Sphere, Cylinder, Screw)
FLAT_KINDS: tuple[type[Mechanism], ...] = (Free, Point, Line, FlatCircle)
"""Those of positions in a plane."""


def angle(mechanism: Mechanism, track: Track) -> Array:
    """Angle about the axis from the frame's second row (N,), unwrapped within each demonstration."""
    first, second = mechanism.frame[1:] @ (track.positions - mechanism.centre).T
    return track.unwrapped(np.arctan2(second, first))


def _arc(angles: Array) -> Array:
    """Angles (N,) within one turn that begins behind their widest gap."""
    within = np.sort(angles % (2 * np.pi))
    gaps = np.diff(within, append=within[0] + 2 * np.pi)
    begin = within[(int(gaps.argmax()) + 1) % len(within)]
    return (angles - begin + 1e-9) % (2 * np.pi)


def in_step(turned: Array, along: Array, pitch: float, track: Track) -> Array:
    """Angles (N,) with whole turns added to each demonstration: those that heights along an axis tell."""
    for group in np.unique(track.groups) if pitch else ():
        rows = track.groups == group
        turns = np.round(float((along[rows] / pitch - turned[rows]).mean()) / (2 * np.pi))
        turned = np.where(rows, turned + 2 * np.pi * turns, turned)
    return turned


def _algebraic_circle(positions: Array) -> tuple[Array, float, float]:
    """Centre (D,), radius and mean squared residual of the linear fit."""
    middle = positions.mean(axis=0)
    offset = positions - middle
    design = np.column_stack([2 * offset, np.ones(len(offset))])
    solution = np.linalg.lstsq(design, (offset**2).sum(axis=1), rcond=1e-9)[0]
    radius = float(np.sqrt(solution[-1] + solution[:-1] @ solution[:-1]))
    missed = np.linalg.norm(offset - solution[:-1], axis=1) - radius
    return middle + solution[:-1], radius, float((missed**2).mean())


def _bent(curvature: float) -> float:
    """Not quite straight."""
    return float(np.copysign(max(abs(curvature), LEAST_CURVATURE), curvature))


def _osculating(track: Track, free: int) -> tuple[Array, Array, Array, Array]:
    """Best point, line or plane and how the recording bends away from it.

    Returns
    -------
    middle : ndarray, shape (D,)
    flat, normals : ndarray, shapes (free, D) and (D - free, D)
    curvature : ndarray, shape (free, free, D - free)
        Second derivatives, by regression.
    """
    middle, directions = principal(track.positions)
    flat, normals = directions[:free], directions[free:]
    along = (track.positions - middle) @ flat.T
    pairs = [(i, j) for i in range(free) for j in range(i, free)]
    squares = [along[:, i] * along[:, j] / (2 if i == j else 1) for i, j in pairs]
    found = np.linalg.lstsq(np.column_stack([np.ones(len(along)), along, *squares]), track.positions - middle)[0]
    curvature = np.empty((free, free, len(normals)))
    for (i, j), second in zip(pairs, found[1 + free :] @ normals.T, strict=True):
        curvature[i, j] = curvature[j, i] = second
    return middle, flat, normals, curvature


def _about(cls: type[M], track: Track, middle: Array, frame: Array) -> tuple[M, float]:
    """The circle about one axis, and its mean squared residual."""
    flat, radius, missed = _algebraic_circle((track.positions - middle) @ frame[1:].T)
    return cls(centre=middle + flat @ frame[1:], frame=frame, radius=radius), missed


def _about_each_axis(cls: type[M], track: Track) -> list[M]:
    """Circles about the axes that fit best among the 13 of a cube, laid into the principal directions."""
    middle, directions = principal(track.positions)
    cube = np.stack(np.meshgrid(*3 * [[-1.0, 0.0, 1.0]]), axis=-1).reshape(-1, 3)[14:]
    found = [_about(cls, track, middle, frame_of(axis @ directions)) for axis in cube]
    return [start for start, _ in sorted(found, key=lambda each: each[1])[:MOST_STARTS]]


def _rising(start: M, track: Track) -> M:
    """With the pitch and the height of the regression of heights on angles, both within demonstrations."""
    along, turned = (track.positions - start.centre) @ start.axis, angle(start, track)
    groups = np.unique(track.groups, return_inverse=True)[1]
    counts = np.bincount(groups)
    height, mean = (np.bincount(groups, values) / counts for values in (along, turned))
    around = turned - mean[groups]
    pitch = float(around @ along / ((around @ around) or 1.0))
    return replace(start, pitch=pitch, centre=start.centre + (height[0] - pitch * mean[0]) * start.axis)

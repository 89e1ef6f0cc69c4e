"""Mechanisms that hold the orientation, too: slider, hinge, and screw, whose tools turn as they move.

A rotation about an axis a by ψ makes of q₀ the quaternion ``cos(ψ/2) q₀ + sin(ψ/2) a q₀``, so that whatever turns about
one axis lies in a plane through the origin of R⁴: the axis is a closed form, whatever the signs of the quaternions. A
point of it is at ``c + p ψ a + r e(ψ)``, linear in c, p and r once a and ψ are known.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np

from ...base.arrays import Array
from .kinds import Circle, Line, Screw, in_step
from .mechanism import Form, M, Mechanism, frame_of
from .quaternions import inverse, mean_orientation, product, rotation, turns_from
from .track import Track


class Slider(Line):
    """Free along one line, without turning."""

    form = Form("slider", "a slider through {centre} along {axis}", ("across", "tilt", "turn"), (2, 3), ties=True)

    def residuals(self, track: Track) -> Array:
        """Across the line (N, 2), rotation vectors (N, 3)."""
        return np.column_stack([super().residuals(track), turns_from(self.orientation, track.quaternions)])

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """The principal direction, the mean orientation."""
        return [replace(start, orientation=mean_orientation(track.quaternions)) for start in super().starts(track)]


class _Turning(Mechanism):
    """About an axis, the tool turning with it."""

    def residuals(self, track: Track) -> Array:
        """Height and distance (N, 2), how far ahead along the way (N, 1), tilts of the tool (N, 2)."""
        angle, tilts = _turned(self, track)
        along, first, second = self.frame @ (track.positions - self.centre).T
        outwards, ahead = np.cos(angle) * first + np.sin(angle) * second, np.cos(angle) * second - np.sin(angle) * first
        return np.column_stack([along - self.pitch * angle, outwards - self.radius, ahead, tilts])

    def travel(self, track: Track) -> Array:
        """Angle of the tool."""
        return _turned(self, track)[0][:, None]


class Hinge(_Turning, Circle):
    """About an axis, the tool turning with it."""

    form = Circle.form._replace(
        kind="hinge",
        phrase="a hinge about {centre}, axis {axis}, radius {radius}",
        chart=(*Circle.form.chart, "turn"),
        blocks=(2, 1, 2),
        straight=None,
        ties=True,
    )

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """The plane of the quaternions, then a regression."""
        return [replace(_turning(cls, track), pitch=0.0)]


class TurningScrew(_Turning, Screw):
    """About an axis and along it in step, the tool turning with it."""

    form = Screw.form._replace(chart=(*Screw.form.chart, "turn"), blocks=(2, 1, 2), straight=Hinge, ties=True)

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """As of a hinge."""
        return [_turning(cls, track)]


TIED_KINDS: tuple[type[Mechanism], ...] = (Slider, Hinge, TurningScrew)


def _turned(mechanism: Mechanism, track: Track) -> tuple[Array, Array]:
    """Angle about the axis (N,), and what else the tool has turned: rotations across the axis (N, 2)."""
    turned = product(track.quaternions, inverse(mechanism.orientation))
    (about, first, second), scalar = mechanism.frame @ turned[:, :3].T, turned[:, 3]
    length = np.maximum(np.hypot(about, scalar), 1e-12)
    sine, cosine = about / length, scalar / length
    tilts = 2 * np.column_stack([cosine * first - sine * second, cosine * second + sine * first])
    along = (track.positions - mechanism.centre) @ mechanism.axis
    return in_step(track.unwrapped(2 * np.arctan2(sine, cosine)), along, mechanism.pitch, track), tilts


def _turning(cls: type[M], track: Track) -> M:
    """Axis and angles from the plane of the quaternions; place, radius and pitch by regression on them."""
    one, other = np.linalg.svd(track.quaternions, full_matrices=False)[2][:2]
    start = cls(centre=np.zeros(3), frame=frame_of(product(other, inverse(one))[:3]), orientation=one)
    angle, constant = _turned(start, track)[0], np.ones(len(track.positions))
    along, first, second = start.frame @ track.positions.T
    pitch, height = np.linalg.lstsq(np.column_stack([angle, constant]), along)[0]
    arm, middle = np.linalg.lstsq(np.column_stack([np.exp(1j * angle), constant]), first + 1j * second)[0]
    behind = float(np.angle(arm))
    return replace(
        start,
        centre=np.array([height - pitch * behind, middle.real, middle.imag]) @ start.frame,
        radius=float(abs(arm)),
        pitch=float(pitch),
        orientation=product(rotation(-behind * start.axis), one),
    )

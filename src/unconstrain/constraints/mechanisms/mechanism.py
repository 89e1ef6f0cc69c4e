"""What all mechanisms have in common: place, changes in a fit, units.

A mechanism has a centre, a frame whose first row is its axis (a plane's normal, a line's direction) and, where it needs
them, a radius, a pitch and an orientation. Its *chart* lists what a fit may change, by small steps from where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import ClassVar, NamedTuple, Self, TypeVar

import numpy as np

from ...base.arrays import Array
from ...base.display import Shown
from ...risks import unit_actions
from .quaternions import IDENTITY, product, rotation
from .track import Track

ANGLES = ("tilt", "turn")
"""Entries of a chart that are radians; all others are lengths."""


class Form(NamedTuple):
    """What makes a kind; ``phrase`` has places for ``centre``, ``axis``, ``radius`` and ``pitch``."""

    kind: str
    phrase: str
    chart: tuple[str, ...]
    blocks: tuple[int, ...]
    """Columns of residuals that have one noise level: of the positions, then of what ties orientations to them."""
    straight: type[Mechanism] | None = None
    """The kind that it is where it does not bend."""
    directions: tuple[str, ...] = ()
    """Names of the rows of A, where these turn with the movement."""
    ties: bool = False
    """Whether orientations are held, too."""


M = TypeVar("M", bound="Mechanism")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Mechanism(Shown):
    """A kind of constraint on positions. Called as constraints are, it returns A(x).

    Parameters
    ----------
    centre : ndarray, shape (D,)
        The centre, or the point of an axis or a plane that is near the recording.
    frame : ndarray, shape (D, D)
        Orthonormal rows, right-handed, the axis first.
    radius : float
    pitch : float
        Advance along the axis for each radian.
    orientation : ndarray, shape (4,)
        That of the tool where the angle about the axis is zero, for kinds that tie it.
    covariance : ndarray, shape (k, k), or None
        Of the changes that the chart lists.
    quantile : float
        Standard errors in half of a 95 % interval.
    unit : str
        Of lengths; empty where it is not known.
    """

    form: ClassVar[Form]

    centre: Array
    frame: Array
    radius: float = 0.0
    pitch: float = 0.0
    orientation: Array = field(default_factory=lambda: IDENTITY)
    covariance: Array | None = None
    quantile: float = 1.96
    unit: str = ""

    def __call__(self, states: Array, times: Array | None = None) -> Array:
        """Return A, shape (T, k, D): orthonormal rows, of zeros where nothing is held."""
        return self.rows(np.asarray(states, dtype=np.float64))

    def rows(self, positions: Array) -> Array:
        """A at positions (N, D), shape (N, k, D)."""
        raise NotImplementedError

    def residuals(self, track: Track) -> Array:
        """Geometric distances along the rows of A, then those of what ties orientations, (N, c)."""
        raise NotImplementedError

    def travel(self, track: Track) -> Array:
        """Coordinates in which it moves freely, (N, m): lengths, or angles where orientations are tied to them."""
        raise NotImplementedError

    @classmethod
    def starts(cls, track: Track) -> list[Self]:
        """Where fits begin: closed forms."""
        raise NotImplementedError

    @property
    def kind(self) -> str:
        """Name of the kind."""
        return self.form.kind

    @property
    def axis(self) -> Array:
        """Direction or normal, shape (D,)."""
        return self.frame[0]

    @property
    def sizes(self) -> list[int]:
        """How many numbers each entry of the chart has."""
        d = len(self.centre)
        sizes = {"centre": d, "across": d - 1, "along": 1, "tilt": d - 1, "radius": 1, "pitch": 1, "turn": 3}
        return [sizes[name] for name in self.form.chart]

    @property
    def count(self) -> int:
        """How many numbers the chart has, k."""
        return sum(self.sizes)

    @property
    def margins(self) -> dict[str, Array]:
        """Half of the 95 % interval, of a radius by its curvature, of each entry of the chart: lengths, or radians."""
        found = {} if self.covariance is None else self._named(self.quantile * np.sqrt(np.diag(self.covariance)))
        if found and self.form.straight is not None:
            left = abs(self.radius) - float(found["radius"].item())
            wider = abs(self.radius) / left if left > 0 else np.inf
            found |= {name: found[name] * wider for name in ("centre", "across", "radius") if name in found}
        return found

    @property
    def vague(self) -> bool:
        """Whether the radius is not known to half of itself: a whole family of curves does as well."""
        return bool(self.margins.get("radius", np.zeros(1)).item() > abs(self.radius) / 2)

    @property
    def sentence(self) -> str:
        """What it is, with 95 % intervals."""
        sure = {name: float(np.max(values)) for name, values in self.margins.items()}
        if self.vague and self.form.straight is not None:
            return f"{self.title} of a radius that the recording does not tell"
        near = max(sure.get("centre", 0.0), sure.get("across", 0.0), sure.get("along", 0.0))
        tilt = f" ± {np.degrees(sure['tilt']):.2g}°" if "tilt" in sure else ""
        return self.form.phrase.format(
            centre=_with_unit(_vector(self.centre, near), near, self.unit),
            axis=_vector(self.axis, sure.get("tilt", 0.0)) + tilt,
            radius=_length(self.radius, sure.get("radius", 0.0), self.unit),
            pitch=_length(2 * np.pi * self.pitch, 2 * np.pi * sure.get("pitch", 0.0), self.unit),
        )

    @property
    def rank(self) -> int:
        """How many directions it holds."""
        return int(self.rows((self.centre + self.frame[-1])[None])[0].any(axis=1).sum())

    @property
    def title(self) -> str:
        """What it is, without where: ``a circle (hinge)``."""
        return self.form.phrase.partition(" {")[0].rpartition(" ")[0] or self.form.phrase

    def moved(self, step: Array) -> Self:
        """Changed by small numbers (k,) of the chart: lengths, and rotations in radians."""
        change = self._named(step)
        ahead, aside = change.get("along", np.zeros(1)), change.get("across", np.zeros(len(self.centre) - 1))
        return replace(
            self,
            centre=self.centre + change.get("centre", 0.0) + np.concatenate([ahead, aside]) @ self.frame,
            frame=_tilted(self.frame, change["tilt"]) if "tilt" in change else self.frame,
            radius=self.radius + change.get("radius", np.zeros(1)).item(),
            pitch=self.pitch + change.get("pitch", np.zeros(1)).item(),
            orientation=product(rotation(change["turn"]), self.orientation) if "turn" in change else self.orientation,
        )

    def facing(self, way: Array) -> Self:
        """The same, its axis turned to the side of a direction (D,)."""
        if self.axis @ way >= 0.0:
            return self
        turned = self.frame.copy()
        turned[[0, -1]] *= -1.0
        return replace(self, frame=turned)

    def placed(self, scale: float, origin: Array, unit: str) -> Self:
        """In other units and about another origin: ``scale`` of theirs are one of these."""
        units = self.units(scale)
        return replace(
            self,
            centre=origin + scale * self.centre,
            radius=scale * self.radius,
            pitch=scale * self.pitch,
            unit=unit,
            covariance=None if self.covariance is None else units[:, None] * self.covariance * units,
        )

    def parallel(self, other: Mechanism) -> bool:
        """Whether the other is of the same kind, and has the same axis, to within half more than both intervals."""
        within = 1.5 * sum(one.margins["tilt"].max() for one in (self, other) if "tilt" in one.margins)
        return bool(self.kind == other.kind and np.arccos(min(abs(float(self.axis @ other.axis)), 1.0)) <= within)

    def units(self, scale: float) -> Array:
        """That of each number of the chart (k,), where lengths are in units of ``scale``."""
        return np.repeat([1.0 if name in ANGLES else scale for name in self.form.chart], self.sizes)

    def cylindrical(self, positions: Array) -> tuple[Array, Array, Array]:
        """Along the axis (N,), the unit vector away from it (N, D), the distance from it (N,)."""
        offset = positions - self.centre
        along = offset @ self.axis
        outwards, distance = unit_actions(offset - along[:, None] * self.axis)
        return along, outwards, distance

    def _summary(self) -> tuple[str, ...]:
        return (self.sentence,)

    def _named(self, numbers: Array) -> dict[str, Array]:
        sizes = self.sizes
        parts = zip(self.form.chart, sizes, accumulate(sizes), strict=True)
        return {name: numbers[end - size : end] for name, size, end in parts}


def on_one_side(mechanisms: Sequence[M]) -> list[M]:
    """The same, their axes on one side: that of their principal direction, whose largest entry is positive."""
    way = np.linalg.svd(np.array([one.axis for one in mechanisms]))[2][0]
    return [one.facing(way * np.sign(way[np.abs(way).argmax()])) for one in mechanisms]


def frame_of(axis: Array) -> Array:
    """Orthonormal rows (D, D), right-handed, the first along the axis (D,)."""
    d = len(axis)
    frame = np.linalg.qr(np.column_stack([axis, np.eye(d)]))[0].T
    frame[0] *= np.sign(frame[0] @ axis)
    frame[-1] *= np.sign(np.linalg.det(frame))
    return frame


def _vector(values: Array, margin: float) -> str:
    return "(" + ", ".join(f"{value:z.{_digits(margin)}f}" for value in values) + ")"


def _length(value: float, margin: float, unit: str) -> str:
    return _with_unit(f"{value:z.{_digits(margin)}f}", margin, unit)


def _with_unit(said: str, margin: float, unit: str) -> str:
    return f"{said} {unit}".rstrip() + f" ± {small_length(margin, unit)}" * bool(margin)


def small_length(value: float, unit: str) -> str:
    """Such as a margin, to two digits: of metres, millimetres."""
    factor, name = (1e3, "mm") if unit == "m" and value < 1.0 else (1.0, unit)
    return f"{float(f'{factor * value:.2g}'):.15g} {name}".rstrip()


def _digits(margin: float) -> int:
    """Decimals of two digits of a margin: what is rounded away is far less than that."""
    return int(np.clip(1 - np.floor(np.log10(margin)), 0, 6)) if margin else 6


def _tilted(frame: Array, tilt: Array) -> Array:
    """The axis turned by small angles (D - 1,) towards the other rows, by a Cayley transform: it stays orthonormal."""
    skew = np.zeros_like(frame)
    skew[0, 1:], skew[1:, 0] = tilt / 2, -tilt / 2
    one = np.eye(len(frame))
    return np.asarray(np.linalg.solve(one - skew, (one + skew) @ frame), dtype=np.float64)

"""Wiping a tilted plate: the policy, the plates, and a kinematic stand-in for the demonstrations of section IV-C.

One policy in three dimensions wipes in a circle, returns to the height it
likes and presses down; the plate takes away what points into it. A camera
watches the sponge at 20 frames a second and misses it by millimetres, and
velocities are found from its positions, as on a real recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import unconstrain as uc

from ...base.arrays import Array
from ...risks import null_space_projection


@dataclass(frozen=True)
class WipingPolicy:
    """Circle, come back to height, press: velocities at positions relative to the plate's centre.

    Parameters
    ----------
    radius : float
        Of the circle, m.
    frequency : float
        Turns per second.
    grip : float
        How fast the sponge returns to the circle and to its height, 1/s.
    press : float
        Downward velocity, m/s.
    lift : float
        How much the sponge rises and falls with the circle, 1/s.
    """

    radius: float = 0.1
    frequency: float = 0.5
    grip: float = 1.2
    press: float = 0.02
    lift: float = 0.5

    def __call__(self, states: Array) -> Array:
        """Velocity (N, 3) in m/s at positions (N, 3) in m."""
        x, y, z = states.T
        middle = (0.1 * self.radius) ** 2  # rounded off: there no direction leads to the circle
        inward = self.grip * (np.sqrt((self.radius**2 + middle) / (x**2 + y**2 + middle)) - 1.0)
        turn = 2.0 * np.pi * self.frequency
        return np.column_stack(
            [inward * x - turn * y, inward * y + turn * x, self.lift * x - self.grip * z - self.press]
        )


@dataclass(frozen=True)
class Plate:
    """A plate that can be tilted and put anywhere.

    Parameters
    ----------
    tilt_x, tilt_y : float
        About the x-axis (pointing ahead), then the y-axis (pointing left), degrees.
    centre : (float, float, float)
        Where its middle is, before the foot of whoever wipes it, m.
    """

    tilt_x: float
    tilt_y: float
    centre: tuple[float, float, float] = (0.56, 0.0, 0.4)

    @property
    def name(self) -> str:
        """Such as ``"+16° about x"``."""
        tilts = [(self.tilt_x, "x"), (self.tilt_y, "y")]
        return ", ".join(f"{tilt:+g}° about {axis}" for tilt, axis in tilts if tilt) or "flat"

    @property
    def rotation(self) -> Array:
        """The plate's axes in the world, as columns: two in the plane, then the normal, shape (3, 3)."""
        a, b = np.radians([self.tilt_x, self.tilt_y])
        about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        return about_y @ about_x

    @property
    def constraint(self) -> uc.constraints.Plane:
        """No motion along the normal."""
        return uc.constraints.Plane(self.rotation[:, 2])


PLATES = tuple(Plate(*tilts) for tilts in ((0, 0), (16, 0), (-16, 0), (27, 0), (-27, 0), (0, 16), (0, -16)))
"""The paper's seven surfaces."""

HELD_OUT = PLATES[5:]
"""The two that are tilted about y: nobody learns from them."""


@dataclass(frozen=True)
class Strokes:
    """How a plate is wiped, and how it is watched.

    Each stroke is put down somewhere on the plate and swings in to the
    circle. Without that nobody could tell that the circle attracts: on a
    steady cycle, the distance to it and its rate of change are uncorrelated.

    Parameters
    ----------
    count : int
        How often the sponge is put down.
    duration : float
        Of all strokes together, s.
    reach : float
        It is put down anywhere within this many radii of the circle.
    unsteadiness : float
        Standard deviation of the hand's slow departure from the policy, m/s.
    rate : float
        Frames per second of the camera.
    noise : float
        Standard deviation of the tracked position, m in each coordinate.
    dropped : float
        Share of the frames in which the camera loses the sponge.
    window_s : float
        Of the filter that finds the velocity, s.
    """

    count: int = 10
    duration: float = 20.0
    reach: float = 1.6
    unsteadiness: float = 0.02
    rate: float = 20.0
    noise: float = 0.002
    dropped: float = 0.01
    window_s: float = 0.25

    @property
    def samples(self) -> int:
        """Frames of one stroke."""
        return round(self.duration * self.rate / self.count)

    def settled(self, demonstration: uc.Demonstration) -> list[uc.Demonstration]:
        """The last quarter of every stroke, when it has swung in."""
        rows = np.array_split(np.arange(len(demonstration)), self.count)
        return [demonstration[one[3 * len(one) // 4] : one[-1] + 1] for one in rows]

    def put_down(self, plate: Plate, wipe: WipingPolicy, rng: np.random.Generator) -> Array:
        """Draw where a stroke starts, relative to the plate's centre, shape (3,)."""
        angle, radius = rng.uniform(0.0, 2.0 * np.pi), self.reach * wipe.radius * np.sqrt(rng.uniform(0.01, 1.0))
        return plate.rotation[:, :2] @ (radius * np.array([np.cos(angle), np.sin(angle)]))

    def watched(self, positions: Array, name: str, rng: np.random.Generator) -> uc.Recording:
        """What the camera makes of positions (T, 3) at its frames."""
        seen = positions + self.noise * rng.standard_normal(positions.shape)
        kept = rng.uniform(size=len(seen)) >= self.dropped
        kept[[0, -1]] = True
        return uc.Recording(("x", "y", "z"), seen[kept], np.flatnonzero(kept) / self.rate, name)


def demonstrate(
    plate: Plate, rng: np.random.Generator, policy: WipingPolicy | None = None, strokes: Strokes | None = None
) -> uc.Demonstration:
    """Wipe a plate in a few strokes, and be watched doing it.

    Kinematics alone: the sponge does exactly what the hand wants, projected
    onto the plate. :func:`unconstrain.paper.simulation.demonstrate` leaves that to contact.

    Parameters
    ----------
    plate : Plate
    rng : numpy.random.Generator
    policy : WipingPolicy, optional
    strokes : Strokes, optional

    Returns
    -------
    Demonstration
        Positions relative to the plate's centre and velocities estimated from
        them, with the policy and the plate's projection at those positions.
    """
    wipe, how = policy or WipingPolicy(), strokes or Strokes()
    return observed(plate, wipe, [_stroke(plate, wipe, how, rng) for _ in range(how.count)], how)


def observed(plate: Plate, wipe: WipingPolicy, recordings: Sequence[uc.Recording], how: Strokes) -> uc.Demonstration:
    """Turn what the camera saw of a plate's strokes into one demonstration, with its truth."""
    recipe = uc.Recipe(states=("x", "y", "z"), differentiate="savgol", window_s=how.window_s, rate=how.rate)
    states, actions, _ = uc.stack(uc.prepare(recordings, recipe))
    projection = null_space_projection(plate.constraint(states[:1], np.zeros(1)))
    truth = uc.Truth(wipe(states), np.repeat(projection, len(states), axis=0))
    return uc.Demonstration(states, actions, np.arange(len(states)) / how.rate, truth, plate.name)


def slow_noise(rng: np.random.Generator, steps: int, dt: float, memory: float = 0.5) -> Array:
    """Ornstein-Uhlenbeck noise of unit variance that forgets in ``memory`` seconds, shape (steps, 3)."""
    from scipy.signal import lfilter

    keep = np.exp(-dt / memory)
    return np.asarray(lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal((steps, 3)), axis=0))


def _stroke(plate: Plate, wipe: WipingPolicy, how: Strokes, rng: np.random.Generator) -> uc.Recording:
    """Put the sponge down somewhere and wipe: what the camera sees."""
    substeps = 10
    dt = 1.0 / (how.rate * substeps)
    drift = iter(how.unsteadiness * slow_noise(rng, how.samples * substeps, dt))

    def hand(states: Array) -> Array:
        return wipe(states) + next(drift)

    start = how.put_down(plate, wipe, rng)
    track = uc.rollout(hand, start, how.samples * substeps, dt, plate.constraint, method="euler")
    return how.watched(track.states[::substeps], plate.name, rng)

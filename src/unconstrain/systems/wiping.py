"""Wiping a tilted plate: a kinematic stand-in for the demonstrations of section IV-C.

One policy in three dimensions wipes in a circle, returns to the height it
likes and presses down; the plate takes away what points into it. A camera
watches the sponge at 20 frames a second and misses it by millimetres, and
velocities are found from its positions, as on a real recording.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..constraints import Plane
from ..demonstration import Demonstration, Recording, Truth, stack
from ..preparation import Recipe, prepare
from ..projection import null_space_projection
from ..rollouts import rollout

__all__ = ["HELD_OUT", "PLATES", "Plate", "WipingPolicy", "demonstrate"]


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

    radius: float = 0.3
    frequency: float = 0.5
    grip: float = 1.5
    press: float = 0.05
    lift: float = 1.0

    def __call__(self, states: Array) -> Array:
        """Velocity (N, 3) in m/s at positions (N, 3) in m."""
        x, y, z = states.T
        inward = self.grip * (1.0 - (x**2 + y**2) / self.radius**2)
        turn = 2.0 * np.pi * self.frequency
        return np.column_stack(
            [inward * x - turn * y, inward * y + turn * x, self.lift * x - self.grip * z - self.press]
        )


@dataclass(frozen=True)
class Plate:
    """A plate tilted about the x-axis (pointing ahead) and the y-axis (pointing left), degrees."""

    tilt_x: float
    tilt_y: float

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
    def constraint(self) -> Plane:
        """No motion along the normal."""
        return Plane(self.rotation[:, 2])


PLATES = tuple(Plate(*tilts) for tilts in ((0, 0), (16, 0), (-16, 0), (27, 0), (-27, 0), (0, 16), (0, -16)))
"""The paper's seven surfaces."""

HELD_OUT = PLATES[5:]
"""The two that are tilted about y: nobody learns from them."""


def demonstrate(
    plate: Plate,
    rng: np.random.Generator,
    policy: WipingPolicy | None = None,
    *,
    duration: float = 20.0,
    strokes: int = 5,
    reach: float = 2.0,
    rate: float = 20.0,
    noise: float = 0.002,
    unsteadiness: float = 0.03,
) -> Demonstration:
    """Wipe a plate in a few strokes, and be watched doing it.

    Each stroke is put down somewhere on the plate and swings in to the
    circle. Without that nobody could tell that the circle attracts: on a
    steady cycle, the distance to it and its rate of change are uncorrelated.

    Parameters
    ----------
    plate : Plate
    rng : numpy.random.Generator
    policy : WipingPolicy, optional
    duration : float
        Of all strokes together, s.
    strokes : int
        How often the sponge is put down.
    reach : float
        It is put down anywhere within this many radii of the circle.
    rate : float
        Frames per second.
    noise : float
        Standard deviation of the tracked position, m in each coordinate.
    unsteadiness : float
        Standard deviation of the hand's slow departure from the policy, m/s.

    Returns
    -------
    Demonstration
        Positions relative to the plate's centre and velocities estimated from
        them, with the policy and the plate's projection at those positions.
    """
    wipe = policy or WipingPolicy()
    recordings = [
        _stroke(plate, wipe, rng, duration / strokes, rate, noise, unsteadiness, reach) for _ in range(strokes)
    ]
    pieces = prepare(recordings, Recipe(states=("x", "y", "z"), differentiate="savgol", window_s=0.25))
    states, actions, _ = stack(pieces)
    projection = null_space_projection(plate.constraint(states[:1], np.zeros(1)))
    truth = Truth(wipe(states), np.repeat(projection, len(states), axis=0))
    return Demonstration(states, actions, np.arange(len(states)) / rate, truth, plate.name)


def _stroke(
    plate: Plate,
    wipe: WipingPolicy,
    rng: np.random.Generator,
    duration: float,
    rate: float,
    noise: float,
    unsteadiness: float,
    reach: float,
) -> Recording:
    """Put the sponge down somewhere and wipe: what the camera sees."""
    substeps = 10
    dt = 1.0 / (rate * substeps)
    steps = round(duration * rate) * substeps
    drift = iter(unsteadiness * _slow_noise(rng, steps, dt))

    def hand(states: Array) -> Array:
        return wipe(states) + next(drift)

    angle, radius = rng.uniform(0.0, 2.0 * np.pi), reach * wipe.radius * np.sqrt(rng.uniform(0.01, 1.0))
    start = plate.rotation[:, :2] @ (radius * np.array([np.cos(angle), np.sin(angle)]))
    track = rollout(hand, start, steps, dt, plate.constraint)
    seen = track.states[::substeps] + noise * rng.standard_normal((steps // substeps, 3))
    return Recording(("x", "y", "z"), seen, np.arange(len(seen)) / rate, plate.name)


def _slow_noise(rng: np.random.Generator, steps: int, dt: float, memory: float = 0.5) -> Array:
    """Ornstein-Uhlenbeck noise of unit variance that forgets in ``memory`` seconds, shape (steps, 3)."""
    from scipy.signal import lfilter

    keep = np.exp(-dt / memory)
    return np.asarray(lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal((steps, 3)), axis=0))

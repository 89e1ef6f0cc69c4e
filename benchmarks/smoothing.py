"""Which way to differentiate is best: errors of velocities, with noise of known size and kind on known movements.

Movements are swings of several frequencies, corners, and, of the folder named by ``UNCONSTRAIN_DATA``, strokes of
handwriting and tracks of hands.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline
from table import Row, row, script

import unconstrain as uc
from unconstrain.base.arrays import Array

RATES = (30.0, 100.0, 250.0)
LEVELS = (1e-4, 1e-3, 5e-3, 2e-2)
"""Standard deviations of the noise, as shares of the extent."""

SEEDS = range(1, 7)

Movement = tuple[Array, Array, Array]
"""Times (T,), positions (T, 2) and velocities (T, 2)."""


def swings(rng: np.random.Generator, rate: float) -> Movement:
    """Sums of three swings."""
    times = np.arange(0.0, 5.0, 1.0 / rate)[:, None]
    sizes, speeds, phases = rng.normal(size=(3, 2)), rng.uniform(0.5, 5.0, (3, 1)), rng.uniform(0.0, 6.0, (3, 2))
    parts = [
        (a * np.sin(w * times + p), a * w * np.cos(w * times + p))
        for a, w, p in zip(sizes, speeds, phases, strict=True)
    ]
    return times[:, 0], sum(p for p, _ in parts), sum(v for _, v in parts)


def corners(rng: np.random.Generator, rate: float) -> Movement:
    """Straight from point to point, a second each."""
    times, points = np.arange(0.0, 6.0, 1.0 / rate), rng.uniform(-1.0, 1.0, (7, 2))
    leg = np.minimum(times.astype(int), 5)
    velocities = np.diff(points, axis=0)[leg]
    return times, points[leg] + (times - leg)[:, None] * velocities, velocities


def _resampled(times: Array, curve: Callable[..., Array], rate: float) -> Movement:
    at = np.arange(times[0], times[-1], 1.0 / rate)
    return at, curve(at), curve(at, 1)


def strokes(rng: np.random.Generator, rate: float) -> Movement:
    """A stroke of handwriting."""
    paths = sorted((Path(os.environ["UNCONSTRAIN_DATA"]) / "lasa_handwriting").glob("*.mat"))
    one = rng.choice(uc.read(paths[rng.integers(len(paths))]))
    times, first = np.unique(one.times, return_index=True)
    return _resampled(times, CubicSpline(times, one.values[first, :2]), rate)


def tracks(rng: np.random.Generator, rate: float) -> Movement:
    """A smooth curve along the track of a hand."""
    table = np.loadtxt(Path(os.environ["UNCONSTRAIN_DATA"]) / "libras_hand" / "movement_libras.csv", delimiter=",")
    times, track = 7.0 / 45 * np.arange(45), table[rng.integers(len(table)), :90].reshape(45, 2)
    splines = [make_smoothing_spline(times, column) for column in track.T]
    return _resampled(times, lambda *at: np.column_stack([spline(*at) for spline in splines]), rate)


def white(rng: np.random.Generator, positions: Array, size: float) -> Array:
    """Another error at each sample."""
    return positions + size * rng.standard_normal(positions.shape)


def rounded(_: np.random.Generator, positions: Array, size: float) -> Array:
    """Whole steps, as of an encoder or of digits in a file."""
    step = size * np.sqrt(12.0)
    return np.round(positions / step) * step


def correlated(rng: np.random.Generator, positions: Array, size: float) -> Array:
    """Errors that last for some samples, as of a tracker that filters."""
    errors = rng.standard_normal(positions.shape)
    for before in range(len(errors) - 1):
        errors[before + 1] = 0.8 * errors[before] + 0.6 * errors[before + 1]
    return positions + size * errors


def ratios(make: Callable[..., Movement], noise: Callable[..., Array]) -> Iterator[float]:
    """Error by the Kalman smoother over that by Savgol."""
    for seed in SEEDS:
        for rate in RATES:
            for level in LEVELS:
                rng = np.random.default_rng([seed, int(rate)])
                times, positions, velocities = make(rng, rate)
                seen = noise(rng, positions, level * np.ptp(positions, axis=0).max())
                ways = (uc.preparation.differentiate(times, seen, way) for way in ("kalman", "savgol"))
                kalman, savgol = (((found - velocities) ** 2).sum() for found in ways)
                yield float(np.sqrt(kalman / savgol))


def main() -> list[Row]:
    """Rows of all."""
    recorded = (strokes, tracks) if os.environ.get("UNCONSTRAIN_DATA") else ()
    rows = []
    for noise in (white, rounded, correlated):
        for make in (swings, corners, *recorded):
            found = np.array(list(ratios(make, noise)))
            what = f"error of kalman against savgol, {noise.__name__} noise on {make.__name__}"
            rows += [row(f"{what}: median", np.median(found), "×"), row(f"{what}: worst", found.max(), "×")]
    return rows


if __name__ == "__main__":
    script(main)

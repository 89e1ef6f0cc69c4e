"""What was recorded of a mechanism, in units of its own extent."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import autocorrelations, unit_actions
from .quaternions import mean_orientation, turns_from

PARTS, LEAST_STEP = (12, 17), 0.05
"""Mean steps of so many parts, or of so many, tell how a stroke turns, if longer than this share of the longest; as
many parts as rounds seem to turn nowhere."""

ROUND = 1.5
"""Free strokes turn less than so often: thirty shapes drawn by hand turn 0.1 to 1.4 times, and wiping 3 times."""


@dataclass(frozen=True, eq=False)
class Track:
    """Positions about their mean, of mean square 1, and orientations, demonstration after demonstration.

    Parameters
    ----------
    positions : ndarray, shape (N, D)
    groups : ndarray of int, shape (N,)
        Ascending.
    quaternions : ndarray, shape (N, 4)
        Of unit length, of either sign; (N, 0) where none were recorded.
    """

    positions: Array
    groups: NDArray[np.intp]
    quaternions: Array

    @property
    def dimensions(self) -> int:
        """D."""
        return self.positions.shape[1]

    @property
    def poses(self) -> bool:
        """Whether orientations were recorded."""
        return self.quaternions.size > 0

    @property
    def demonstrations(self) -> list[Track]:
        """Each as a track of its own."""
        return [self.rows(self.groups == group) for group in np.unique(self.groups)]

    @property
    def turns(self) -> Array:
        """Rotations from the mean orientation, (N, 3)."""
        return turns_from(mean_orientation(self.quaternions), self.quaternions)

    @property
    def extent(self) -> float:
        """Of the positions, in their widest principal direction."""
        return float(np.ptp(self.positions @ principal(self.positions)[1].T, axis=0).max())

    def rows(self, chosen: NDArray[np.generic] | slice) -> Track:
        """Part of the samples."""
        return Track(self.positions[chosen], self.groups[chosen], self.quaternions[chosen])

    def thinned(self, most: int) -> Track:
        """At most so many samples, evenly."""
        return self.rows(slice(None, None, -(-len(self.groups) // most)))

    def unwrapped(self, angles: Array) -> Array:
        """Angles (N,) without jumps of a turn within each demonstration."""
        parts = [np.unwrap(angles[self.groups == group]) for group in np.unique(self.groups)]
        return np.concatenate(parts)


def winding(steps: Iterable[Array]) -> bool:
    """Whether demonstrations turn more on their way, to either side, than free ones, by their steps (T, D) in order."""
    return bool(np.median([turned_by(each) for each in steps]) >= ROUND)


def turned_by(vectors: Array) -> float:
    """How often vectors (T, D) in order turn, to either side."""
    found = []
    for parts in PARTS:
        means = np.array([part.mean(axis=0) for part in np.array_split(vectors, min(parts, len(vectors)))])
        ways, lengths = unit_actions(means)
        ways = ways[lengths > LEAST_STEP * lengths.max()]
        found.append(np.arccos(np.clip(np.vecdot(ways[1:], ways[:-1]), -1.0, 1.0)).sum() / (2 * np.pi))
    return float(max(found))


def principal(positions: Array) -> tuple[Array, Array]:
    """Mean (D,), and the directions in rows (D, D) in which positions (N, D) spread most to least."""
    centre = positions.mean(axis=0)
    return centre, np.linalg.svd(positions - centre, full_matrices=False)[2]


def correlation_time(residuals: Array, groups: NDArray[np.intp], fitted: int = 0) -> float:
    """Integrated autocorrelation time ``1 + 2 Σ_k r_k`` of residuals (N, c), in samples, at least 1.

    N samples are worth N over this number. The sum ends at the first autocorrelation that could as well be zero. A
    fit of some parameters takes from each autocorrelation what as many means would, and that is given back.
    """
    count, columns = residuals.shape
    longest, insignificant = max(count // 2 - 1, 0), 1.0 / np.sqrt(residuals.size)
    found = list(takewhile(lambda each: each > insignificant, autocorrelations(residuals, groups, longest)))
    lag = min(len(found) + 1, longest)
    return (1.0 + 2.0 * sum(found)) / max(1.0 - (2 * lag - 1) * fitted / columns / count, 1 / 3)


def noise_by_differences(values: Array, groups: NDArray[np.intp]) -> float:
    """Standard deviation of what is white in each column of values (N, c), from fourth differences in time."""
    steps = [np.diff(values[groups == group], n=4, axis=0).ravel() for group in np.unique(groups)]
    lengths = np.abs(np.concatenate(steps))
    return float(np.median(lengths)) / (0.6745 * np.sqrt(70.0)) if len(lengths) else 0.0

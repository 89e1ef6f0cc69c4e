"""How far a path is from the stroke that it should be."""

from __future__ import annotations

import numpy as np

from ....base.arrays import Array


def resampled(path: Array, count: int) -> Array:
    """So many points of a path (T, n), equally far apart along it."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(at, along, each) for each in path.T])


def swept_area(path: Array, stroke: Array) -> float:
    """Area between a path (T, 2) and a stroke (S, 2), both at S points equally far apart along them.

    The tetragons of Khansari-Zadeh and Billard (2014), each as two triangles.
    """
    a, b = (resampled(each, len(stroke)) for each in (path, stroke))
    return float(sum(_triangles(p, q, r).sum() for p, q, r in ((a[:-1], a[1:], b[1:]), (a[:-1], b[1:], b[:-1]))))


def warped(path: Array, stroke: Array) -> float:
    """Dynamic time warping: least sum of distances of matched points, for each point of the stroke."""
    distances = np.linalg.norm(resampled(path, len(stroke))[:, None] - stroke, axis=2)
    sums = np.full((len(stroke) + 1, len(stroke) + 1), np.inf)
    sums[0, 0] = 0.0
    for i, j in np.ndindex(distances.shape):
        sums[i + 1, j + 1] = distances[i, j] + min(sums[i, j], sums[i, j + 1], sums[i + 1, j])
    return float(sums[-1, -1]) / len(stroke)


def _triangles(p: Array, q: Array, r: Array) -> Array:
    (x, y), (u, v) = (q - p).T, (r - p).T
    return 0.5 * np.abs(x * v - y * u)

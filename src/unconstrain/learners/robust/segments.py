"""Constraints that stay the same for a while show themselves in what was done meanwhile.

Within a segment under one constant constraint all actions lie in the range
of one projection N. Its directions are the singular vectors of the
segment's actions that are larger than their noise; with them the
constrained error ``Σ w ‖u − N π̃‖²`` can be minimised, as if the constraint
were known. It knows more than the inconsistency: that nothing but N u was
possible, in all its directions at once and without each sample's noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import Quadratic
from ...training import Samples

_CLEAR = 3.0
"""A direction is real if the actions' rms along it is more than so many times the noise."""

_FEWEST = 4
"""Samples of a segment found automatically, at least."""


def projection_of(actions: Array, noise: float) -> Array:
    """The projection whose range the actions of one segment lie in.

    Parameters
    ----------
    actions : ndarray, shape (T, d)
    noise : float
        Standard deviation of the noise on each coordinate.

    Returns
    -------
    ndarray, shape (d, d)
        Of rank 0 where there is nothing but noise.
    """
    _, singular, rows = np.linalg.svd(actions, full_matrices=False)
    size = singular / np.sqrt(len(actions))
    largest = size[0] if len(size) else 0.0
    kept = rows[size > max(_CLEAR * noise, 1e-9 * largest)] if largest > 0 else rows[:0]
    return np.asarray(kept.T @ kept)


def change_points(actions: Array, noise: float) -> NDArray[np.intp]:
    """Where a constraint changes along one demonstration: segments that no smaller subspace than their own explains.

    Dynamic programming over all cuts. A segment of rank k costs twice its
    negative log-likelihood, with normal actions as wide as the
    demonstration's along its subspace and as the noise off it, and, as in
    the Bayesian information criterion, each parameter of the subspace and
    the cut the logarithm of the number of samples.

    Parameters
    ----------
    actions : ndarray, shape (T, d)
    noise : float
        Standard deviation of the noise on each coordinate.

    Returns
    -------
    ndarray of int
        First samples of the segments but the first, ascending.
    """
    count, d = actions.shape
    sums = np.concatenate([np.zeros((1, d, d)), np.cumsum(actions[:, :, None] * actions[:, None, :], axis=0)])
    spread = float(np.trace(sums[-1])) / (count * d)
    variance = max(noise**2, 1e-12 * spread, 1e-300)
    ranks = np.arange(d + 1)
    penalty = (ranks * (d - ranks) + 1) * np.log(count)
    along = ranks * (1.0 + np.log(max(spread / variance, 1.0)))
    best, before = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=np.intp)
    best[0] = 0.0
    for stop in range(min(_FEWEST, count), count + 1):
        starts = np.flatnonzero(np.isfinite(best[: max(stop - _FEWEST, 0) + 1]))
        off = np.cumsum(np.maximum(np.linalg.eigvalsh(sums[stop] - sums[starts]), 0.0), axis=1)
        missed = np.concatenate([off[:, ::-1], np.zeros((len(starts), 1))], axis=1)  # by rank: d - k smallest are off
        cost = best[starts] + (missed / variance + (stop - starts)[:, None] * along + penalty).min(axis=1)
        place = int(cost.argmin())
        best[stop], before[stop] = cost[place], starts[place]
    cuts = []
    stop = count
    while stop > 0:
        stop = int(before[stop])
        cuts.append(stop)
    return np.array(sorted(cuts)[1:], dtype=np.intp)


def found_segments(actions: Array, groups: NDArray[np.intp], noise: float) -> NDArray[np.intp]:
    """Number of the segment each sample is in, (N,); segments never go from one demonstration to the next."""
    starts = np.zeros(len(actions), dtype=bool)
    edges = np.flatnonzero(np.diff(groups, prepend=groups[0] - 1))
    for first, last in zip(edges, [*edges[1:], len(actions)], strict=True):
        starts[first] = True
        starts[first + change_points(actions[first:last], noise)] = True
    return np.cumsum(starts) - 1


def constrained_error(samples: Samples, labels: NDArray[np.intp], noise: float) -> Quadratic:
    """``Σ w ‖N̂ u − N̂ π̃‖²`` with the projection of each segment from its own actions."""
    d, p = samples.actions.shape[1], samples.features.shape[1]
    models = samples.memberships.shape[1]
    whole = Quadratic(np.zeros((models, p * d, p * d)), np.zeros((models, p * d)), np.zeros(models))
    for label in np.unique(labels):
        segment = samples[labels == label]
        projection = projection_of(segment.actions, noise)
        risk = segment.risk(segment.actions @ projection, np.ones(len(segment)))
        blocks = risk.hessian.reshape(models, p, d, p, d)
        hessian = np.einsum("miajb,bc->miajc", blocks, projection).reshape(models, p * d, p * d)
        whole = whole + Quadratic(hessian, risk.linear, risk.constant)
    return whole

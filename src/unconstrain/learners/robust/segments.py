"""Segments of constant constraint: change-point detection and the constrained error.

Under a constant constraint all actions lie in the range of one projection N,
estimated by the singular vectors of the segment's actions whose singular
values exceed the noise. With it the constrained error ``Σ w ‖u − N π̃‖²`` is
minimised as if the constraint were known. It uses more than the
inconsistency: all directions of the range, from all samples of the segment.

The direction that a curved surface holds turns with the state. To first order
it is affine, ``b(x) = B [1; x]``, and exactly so on planes, spheres, cylinders
and all other surfaces of second order, whose gradient it is. Along a
demonstration ``b(x)ᵀu = 0``, so that vec B is an eigenvector of
``Σ (u ⊗ [1; x]) (u ⊗ [1; x])ᵀ`` with an eigenvalue within the noise. Short,
smooth movements have such eigenvectors by chance: those count that, learnt
without a stretch of the demonstration, hold there too. And actions that are
themselves affine in the state have them free or held, ``b = S u`` with any
skew-symmetric S: they show nothing. Where states are the positions whose
velocities the actions are, what is round that these keep to is held.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...constraints import kept
from ...risks import null_space_projection, project, unit_actions
from .constants import (
    HELD_VARIANCES,
    LEAST_OF_CURVED,
    LEAST_SEGMENT,
    SEGMENT_SIGNAL_TO_NOISE,
    SHARE_ALONG_HELD,
    STRETCHES,
    VARIANCES_OF_CURVED,
)


def projection_of(actions: Array, noise: float) -> Array:
    """Projection onto the subspace spanned by the actions of one segment, by a singular value decomposition.

    Shape (d, d), and of rank 0 where all singular values are within the noise.

    Parameters
    ----------
    actions : ndarray, shape (T, d)
    noise : float
        Standard deviation of the noise on each coordinate.
    """
    _, singular, rows = np.linalg.svd(actions, full_matrices=False)
    size = singular / np.sqrt(len(actions))
    largest = size[0] if len(size) else 0.0
    kept = rows[size > max(SEGMENT_SIGNAL_TO_NOISE * noise, 1e-9 * largest)] if largest > 0 else rows[:0]
    return np.asarray(kept.T @ kept)


def change_points(actions: Array, noise: float) -> NDArray[np.intp]:
    """Change points of the constraint along one demonstration, by the Bayesian information criterion.

    First sample of each segment but the first, ascending, by dynamic
    programming over all segmentations. The cost of a segment of rank
    k is −2 times its log-likelihood plus ``(k (d − k) + 1) log T``: k (d − k)
    parameters of the subspace and one of the cut (BIC; Schwarz, *Annals of
    Statistics* 6(2), 1978). Actions are normal, with the demonstration's
    variance along the subspace and the noise's across it.

    Parameters
    ----------
    actions : ndarray, shape (T, d)
    noise : float
        Standard deviation of the noise on each coordinate.
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
    for stop in range(min(LEAST_SEGMENT, count), count + 1):
        starts = np.flatnonzero(np.isfinite(best[: max(stop - LEAST_SEGMENT, 0) + 1]))
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
    """Index of each sample's segment, (N,), by change points within each demonstration."""
    starts = np.zeros(len(actions), dtype=bool)
    edges = np.flatnonzero(np.diff(groups, prepend=groups[0] - 1))
    for first, last in zip(edges, [*edges[1:], len(actions)], strict=True):
        starts[first] = True
        starts[first + change_points(actions[first:last], noise)] = True
    return np.cumsum(starts) - 1


def projections_of(actions: Array, labels: NDArray[np.intp], noise: Array) -> Array:
    """The projection N̂ of each sample's segment, (N, d, d), estimated from the segment's actions.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    labels : ndarray of int, shape (N,)
        Segment of each sample.
    noise : ndarray, shape (N,)
        Variance of the noise on each action coordinate, one number for each segment.
    """
    found = np.empty((len(actions), actions.shape[1], actions.shape[1]))
    for label in np.unique(labels):
        rows = labels == label
        found[rows] = projection_of(actions[rows], float(np.sqrt(noise[rows][0])))
    return found


def curved_projections(states: Array, actions: Array, labels: NDArray[np.intp], flat: Array, noise: Array) -> Array:
    """N̂ of each sample (N, d, d), where segments also held directions that turn with the state; else the flat one.

    By their actions, or by their states where these are positions in the order of time, in the actions' frame and unit
    of length.

    Parameters
    ----------
    states : ndarray, shape (N, n)
    actions : ndarray, shape (N, d)
    labels : ndarray of int, shape (N,)
        Segment of each sample.
    flat : ndarray, shape (N, d, d)
        From :func:`projections_of`.
    noise : ndarray, shape (N,)
        Variance of the noise on each action coordinate.
    """
    found, positions = flat.copy(), states.shape == actions.shape and states.shape[1] in (2, 3)
    for label in np.unique(labels):
        rows = labels == label
        values, axes = np.linalg.eigh(flat[rows][0])
        axes, variance = axes[:, values > 0.5], float(noise[rows].mean())
        found[rows] = _curved(states[rows], actions[rows], axes, variance)
        if positions and axes.shape[1] > 1 and np.allclose(found[rows], flat[rows]):
            found[rows] = _kept(states[rows], actions[rows], flat[rows], variance)
    return found


def _kept(positions: Array, actions: Array, flat: Array, variance: float) -> Array:
    """N̂ (T, d, d) of what is round that a demonstration keeps to, by its positions and by its motion; or flat."""
    mechanism = kept(positions)
    if mechanism is None or mechanism.rank < actions.shape[1] - round(np.trace(flat[0])):
        return flat
    N = null_space_projection(mechanism.rows(positions), 1e-3)
    leak = float(((actions - project(N, actions)) ** 2).sum()) / (mechanism.rank * len(actions))
    return N if leak < VARIANCES_OF_CURVED * variance else flat


def _curved(states: Array, actions: Array, axes: Array, variance: float) -> Array:
    """N̂ (T, d, d) of a demonstration that moved along orthonormal axes (d, r): onto these, or what a surface left."""
    moved, (count, rank) = actions @ axes, (len(actions), axes.shape[1])
    regressors, most = _affine(states), VARIANCES_OF_CURVED * variance
    flat, size = np.tile(axes @ axes.T, (count, 1, 1)), regressors.shape[1] * rank
    if count < LEAST_OF_CURVED * size or rank < 2:
        return flat
    rest = moved - regressors @ np.linalg.lstsq(regressors, moved)[0]
    if (np.linalg.eigvalsh(rest.T @ rest / count) < most).sum() > 1:
        return flat
    each = (regressors[:, :, None] * moved[:, None, :]).reshape(count, size)
    values, normals = np.linalg.eigh(each.T @ each / count)
    if values[0] >= most:
        return flat
    stretch = regressors[:, -1].argsort(kind="stable").argsort() * STRETCHES // count
    others = [np.linalg.eigh(each[stretch != part].T @ each[stretch != part])[1] for part in range(STRETCHES)]

    def left(by: Array, rows: Any) -> Array:
        turned = np.einsum("np,prk->nkr", regressors[rows], by.reshape(-1, rank, by.shape[1]))
        return null_space_projection(turned, 1e-3)

    for held in range(min(int((values < most).sum()), rank - 1), 0, -1):
        N = np.empty((count, rank, rank))
        for part, by in enumerate(others):
            N[stretch == part] = left(by[:, :held], stretch == part)
        if ((moved - project(N, moved)) ** 2).sum() < most * held * count:
            return axes @ left(normals[:, :held], slice(None)) @ axes.T
    return flat


def _affine(states: Array) -> Array:
    """A constant and the principal components of the states, each coordinate in its own unit, of mean square one."""
    centred = states - states.mean(axis=0)
    spread, size = np.sqrt((centred**2).mean(axis=0)), np.abs(states).max(axis=0)
    moved = spread > 1e-9 * size
    scaled = centred[:, moved] / spread[moved]
    values, axes = np.linalg.eigh(scaled.T @ scaled / len(states))
    kept = values > 1e-6
    return np.column_stack([np.ones(len(states)), scaled @ axes[:, kept] / np.sqrt(values[kept])])


def held_throughout(actions: Array, labels: NDArray[np.intp], noise: Array) -> tuple[NDArray[np.bool_], Array]:
    """Which samples are of segments that were clearly held in the same directions all the time, and where they moved.

    That is where noise explains the motion along some directions, there was much along all others, and other segments
    moved along more: what nobody moved along says nothing.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    labels : ndarray of int, shape (N,)
        Segment of each sample.
    noise : ndarray, shape (N,)
        Variance of the noise on each action coordinate.

    Returns
    -------
    held : ndarray of bool, shape (N,)
    moved : ndarray, shape (N, d, d)
        Projection onto all directions in which the segment moved, or onto the sample's own where it was not held.
    """
    directions, _ = unit_actions(actions)
    held, moved = np.zeros(len(actions), dtype=bool), directions[:, :, None] * directions[:, None, :]
    whole = np.linalg.eigvalsh(actions.T @ actions / len(actions)) > HELD_VARIANCES * noise.mean()
    for label in np.unique(labels):
        rows = labels == label
        squares, axes = np.linalg.eigh(actions[rows].T @ actions[rows] / rows.sum())
        still = squares < SEGMENT_SIGNAL_TO_NOISE**2 * noise[rows].mean()
        much = squares > SHARE_ALONG_HELD * squares.sum()
        if much.sum() < whole.sum() and (still != much).all():
            held[rows], moved[rows] = True, axes[:, much] @ axes[:, much].T
    return held, moved

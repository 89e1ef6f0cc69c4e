"""What the robust learners hold out together: demonstrations under like constraints, or stretches of a recording.

A policy that is wrong under a new constraint still looks consistent on a demonstration that is held out, as long as
others under the same constraint stay. So demonstrations that were held in like directions are in one fold. Where
demonstrations are not told apart, neighbours are: they say nearly the same. A heap of rows is held out in two ways, as
neither of them tells demonstrations for sure.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import unit_actions
from ...training import Samples
from .constants import BLOCKS_IN_A_FOLD, LEAST_CONSTRAINTS, LIKE_CONSTRAINTS, LINES_TO_STATES, SHARE_ALONG_HELD


def held_out_together(samples: Samples) -> Samples:
    """With other folds, as many as there were at most."""
    count = min(int(samples.folds.max()) + 1, len(samples))
    if samples.groups.max() == 0:
        blocks = min(BLOCKS_IN_A_FOLD * count, len(samples))
        return replace(samples, folds=np.arange(len(samples)) * blocks // len(samples) % count)
    like = like_constraints(samples.actions, samples.groups)
    few = like.max() + 1 < LEAST_CONSTRAINTS
    return samples if few else replace(samples, folds=_dealt(like, count)[samples.groups])


def held_out_otherwise(samples: Samples) -> Samples | None:
    """With folds of what lies near and may have been held alike, where one heap of rows came in no order; else None.

    A demonstration in such a heap stays on both sides of a short stretch that is held out. Here folds are blocks of a
    path of short steps through states and lines of action together.
    """
    if samples.groups.max() > 0 or not samples.reconstructed:
        return None
    along, _ = unit_actions(samples.actions)
    lines = LINES_TO_STATES * (along[:, :, None] * along[:, None, :]).reshape(len(samples), -1)
    folds = np.empty(len(samples), dtype=np.intp)
    folds[samples.path(lines)] = np.arange(len(samples)) * (int(samples.folds.max()) + 1) // len(samples)
    return replace(samples, folds=folds)


def like_constraints(actions: Array, groups: NDArray[np.intp]) -> NDArray[np.intp]:
    """Which demonstrations were held in like directions, by the angles between the directions of least motion.

    Those that moved along all directions, free or under constraints that changed, are like none other.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    groups : ndarray of int, shape (N,)
        Which of G demonstrations each sample is from.

    Returns
    -------
    ndarray of int, shape (G,)
        Numbers of the clusters, in which no two directions are farther apart than :data:`~.constants.LIKE_CONSTRAINTS`.
    """
    from scipy.cluster.hierarchy import fcluster, linkage  # takes long to import

    found = [np.linalg.eigh(part.T @ part) for group in range(groups.max() + 1) for part in [actions[groups == group]]]
    held = np.array([energy[0] < SHARE_ALONG_HELD * energy.sum() for energy, _ in found])
    least = np.array([axes[:, 0] for _, axes in found])
    angles = np.arccos(np.clip(np.abs(least @ least.T), 0.0, 1.0))
    angles[~held] = angles[:, ~held] = 0.5 * np.pi
    pairs = angles[np.triu_indices(len(angles), 1)]
    return np.asarray(fcluster(linkage(pairs, "complete"), LIKE_CONSTRAINTS, "distance") - 1, dtype=np.intp)


def _dealt(clusters: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Fold of each demonstration: clusters in folds of about equal size, the largest first."""
    sizes = np.bincount(clusters)
    folds, filled = np.empty(len(sizes), dtype=np.intp), np.zeros(min(len(sizes), count))
    for cluster in np.argsort(-sizes, kind="stable"):
        folds[cluster] = int(filled.argmin())
        filled[folds[cluster]] += sizes[cluster]
    return folds[clusters]

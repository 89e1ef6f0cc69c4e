"""Candidates that know the Jacobian of the constraints, but not which of its rows were held."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.errors import InvalidDataError
from ...risks import Quadratic, inconsistency
from ...training import Samples
from .candidate import Candidate
from .consistent import least_error
from .constants import FREE_OF_KINDS, MISFITS_OF_JACOBIAN, ROUNDS_OF_KINDS
from .held_rows import UNKNOWN, HeldRows, Kinds
from .noise import corrected

KNOWING = -1.0
"""Softness of those who know more of the constraints than actions tell."""

OF_POSITION = 3
"""Of a hand's Jacobian the first three rows are of its position: six fit a short movement by chance."""

Jacobian = Callable[[Array], Array]
"""States (N, n) to Jacobians (N, r, d)."""


def with_jacobian(samples: Samples, jacobian: Jacobian, noise: float) -> Iterator[Candidate]:
    """A candidate for each way in which demonstrations fall into kinds that held the same rows of a Jacobian.

    And those for which each held rows of its own, of all or of the hand's position.

    Parameters
    ----------
    samples : Samples
    jacobian : callable
    noise : float
        Variance σ² on each action coordinate.

    Raises
    ------
    InvalidDataError
        If the Jacobian is not finite, or has another shape than (N, r, d).
    """
    jacobians = _evaluated(jacobian, samples)
    shown, tried = HeldRows(samples.actions, jacobians, samples.groups, noise), set()
    for misfit in MISFITS_OF_JACOBIAN:
        kinds = shown.kinds(misfit)
        like = (kinds.labels.tobytes(), *(len(rows) for rows in kinds.rows))
        if kinds.rows and like not in tried:
            tried.add(like)
            held = " and ".join(f"{len(rows)}" for rows in kinds.rows)
            yield _candidate(
                f"rows of the Jacobian (within {misfit:.1%}) held: {held}", samples, kinds, jacobians, noise
            )
    for some in [jacobians, jacobians[:, :OF_POSITION]] if jacobians.shape[1] > OF_POSITION else [jacobians]:
        part = shown if some is jacobians else HeldRows(samples.actions, some, samples.groups, noise)
        if (kinds := part.alone()).rows:
            yield _candidate(f"own rows of the Jacobian (of {some.shape[1]})", samples, kinds, some, noise)


def _evaluated(jacobian: Jacobian, samples: Samples) -> Array:
    found = np.asarray(jacobian(samples.states), dtype=np.float64)
    count, d = samples.actions.shape
    if found.ndim != 3 or (found.shape[0], found.shape[2]) != (count, d) or not found.shape[1]:
        raise InvalidDataError(f"jacobian: got an array of shape {found.shape}, expected ({count}, rows, {d}).")
    if not np.isfinite(found).all():
        raise InvalidDataError("jacobian: found NaN or infinity, expected finite numbers.")
    return found


def _candidate(name: str, samples: Samples, kinds: Kinds, jacobians: Array, noise: float) -> Candidate:
    """The policy of least constrained error under these kinds.

    Of demonstrations of no kind, those that turn out as near to the policy as the others were free; the rest show
    their own direction.
    """
    projections = kinds.projections(jacobians, samples.groups)
    ranks, known = np.trace(projections, axis1=1, axis2=2), (kinds.labels != UNKNOWN)[samples.groups]
    held, d = samples[known], samples.actions.shape[1]  # of ‖π‖² constraints leave the share of their rank
    size = np.full(len(samples), held.energy * d / max(held.mean(ranks[known]), 1.0))
    free = np.zeros_like(known)
    folds = [samples.folds == fold for fold in range(int(samples.folds.max()) + 1)]
    for _ in range(ROUNDS_OF_KINDS):
        used = known | free
        errors = [_error(samples[rows], used[rows], projections[rows], size[rows], noise) for rows in folds]
        found = least_error(name, samples, errors, _odds(samples, np.where(used, ranks, 1.0)))
        policy, before = samples.predict(found.weights), free
        size, free = np.vecdot(policy, policy), ~known & _as_near(samples, policy, projections, known)
        if (free == before).all():
            break
    return replace(found, softness=KNOWING)


def _error(samples: Samples, used: NDArray[np.bool_], projections: Array, size: Array, noise: float) -> Quadratic:
    """Constrained error of samples whose projection is used; noise-corrected inconsistency over ‖π‖² of the others."""
    some, rest = samples[used], samples[~used]
    squares = np.vecdot(rest.actions, rest.actions)
    share = 1.0 / np.maximum(np.maximum(size[~used], squares), 1e-300)
    weighted, plain = (rest.moments(rest.actions, by) for by in (share * squares, share))
    return some.constrained(projections[used]) + inconsistency(corrected(weighted, plain, noise))


def _odds(samples: Samples, ranks: Array) -> float:
    """Coordinates that the constraints hide over those that they leave, on average."""
    d, left = samples.actions.shape[1], samples.mean(ranks)
    return (d - left) / left if 0.0 < left < d else 1.0


def _as_near(samples: Samples, policy: Array, projections: Array, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether a sample's demonstration misses the policy, per coordinate, about as little as those of a kind do."""
    off = samples.actions - policy
    left = np.einsum("nab,nb->na", projections, off)[known]
    usual = float(np.vecdot(left, left).sum() / np.trace(projections[known], axis1=1, axis2=2).sum())
    missed, sizes = (np.bincount(samples.groups, one) for one in (np.vecdot(off, off), np.ones(len(samples))))
    return np.asarray((missed < FREE_OF_KINDS * off.shape[1] * usual * sizes)[samples.groups])

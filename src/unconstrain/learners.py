"""Learners: from moments to a solution.

Each is a list of objectives in order of importance: :class:`Direct` has the
standard risk, :class:`Inconsistency` the inconsistency, and :class:`Hybrid`
the inconsistency first and then the standard risk in the directions that the
first leaves undetermined. What counts as undetermined is chosen on held-out
data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .arrays import Array, check_at_least
from .moments import Moments
from .objectives import inconsistency, standard_risk, unvec
from .quadratic import SECONDARY_NOISE, Path, Quadratic, lexicographic_path, minimum
from .validation import FoldedMoments

__all__ = ["Direct", "Hybrid", "Inconsistency", "Learner", "Solution"]


@dataclass(frozen=True, eq=False)
class Solution:
    """What a learner found, for each of M models.

    Parameters
    ----------
    weights : ndarray, shape (M, d, p)
        The policy's weights W.
    determined : ndarray of int, shape (M,)
        How many of the ``directions`` the first objective determined.
    directions : int
        Dimension of the weight space, ``P = d p``.
    threshold : ndarray, shape (M,)
        The λ_t used, as a share of the largest eigenvalue.
    eigenvalues : ndarray, shape (M, P), optional
        Of the inconsistency's Hessian, ascending, where it was factored.
    scores : ndarray, shape (M, P + 1), optional
        Held-out ``E_i + α E_2`` for every number of undetermined directions,
        where the threshold was chosen by it.
    """

    weights: Array
    determined: NDArray[np.intp]
    directions: int
    threshold: Array
    eigenvalues: Array | None = None
    scores: Array | None = None

    @property
    def determined_share(self) -> float:
        """Share of all weight directions that the first objective determined, 0 to 1."""
        return float(self.determined.sum() / (self.directions * len(self.determined)))


class Learner(Protocol):
    """Anything that turns folded moments into a solution."""

    def solve(self, folds: FoldedMoments) -> Solution:
        """Learn from the whole, choosing settings on the folds."""
        ...


@dataclass(frozen=True)
class Direct:
    """Minimise the standard risk alone: ordinary regression on what was observed (eq. 5)."""

    def solve(self, folds: FoldedMoments) -> Solution:
        """Learn from the whole; nothing is left to choose."""
        whole = folds.whole
        models, d, p = whole.cross.shape
        spectrum = np.linalg.eigvalsh(whole.gram)
        rank = (spectrum > SECONDARY_NOISE * spectrum[:, -1:]).sum(axis=1)
        weights = unvec(minimum(standard_risk(whole)), d)
        return Solution(weights, d * rank, d * p, np.zeros(models))


@dataclass(frozen=True)
class Inconsistency:
    """Minimise the inconsistency alone (eqs 4, 7 and 14, 15).

    Parameters
    ----------
    threshold : float, optional
        Eigenvalues up to this share of the largest are left out and their
        directions stay zero. 0 leaves out rounding noise only. None chooses
        by the inconsistency on held-out data.
    standard_errors : float
        See :class:`Hybrid`.
    """

    threshold: float | None = 0.0
    standard_errors: float = 0.0

    def __post_init__(self) -> None:
        _check(self.threshold, self.standard_errors)

    def solve(self, folds: FoldedMoments) -> Solution:
        """Learn from the whole, at a threshold chosen on the folds."""
        return _solve(folds, _inconsistency_path, inconsistency, self.threshold, self.standard_errors)


@dataclass(frozen=True)
class Hybrid:
    """Minimise the inconsistency, then the standard risk where that leaves room (eqs 6 to 17).

    Parameters
    ----------
    alpha : float
        Weight of the standard risk in the score ``E_i + α E_2`` that picks
        the threshold on held-out data. Small for constraints that vary a lot
        from sample to sample, large for data that is nearly free.
    standard_errors : float
        Among the thresholds whose score is within this many standard errors
        (over the folds) of the best, take the one that leaves most to the
        standard risk. 0 takes the best, as the paper does.
    threshold : float, optional
        Use this λ_t, as a share of the largest eigenvalue, instead of
        choosing. 0 leaves out rounding noise only.
    softness : float
        Soften "subject to being consistent" (eq. 6): the first objective is
        ``E_i + softness E_2``. The paper splits hard, at 0. On noisy
        recordings a tenth and ``threshold=0`` do better: every direction then
        goes over from one objective to the other by degrees.
    """

    alpha: float = 1e-2
    standard_errors: float = 0.0
    threshold: float | None = None
    softness: float = 0.0

    def __post_init__(self) -> None:
        check_at_least("alpha", self.alpha, 0.0)
        check_at_least("softness", self.softness, 0.0)
        _check(self.threshold, self.standard_errors)

    def solve(self, folds: FoldedMoments) -> Solution:
        """Learn from the whole, at a threshold chosen on the folds."""
        return _solve(folds, self._path, self._score, self.threshold, self.standard_errors)

    def _path(self, moments: Moments) -> Path:
        consistent, risk = inconsistency(moments), standard_risk(moments)
        return lexicographic_path(consistent + self.softness * risk, risk)

    def _score(self, moments: Moments) -> Quadratic:
        return inconsistency(moments) + self.alpha * standard_risk(moments)


def _inconsistency_path(moments: Moments) -> Path:
    return lexicographic_path(inconsistency(moments))


def _solve(
    folds: FoldedMoments,
    path_of: Callable[[Moments], Path],
    score_of: Callable[[Moments], Quadratic],
    threshold: float | None,
    standard_errors: float,
) -> Solution:
    whole = folds.whole
    path = path_of(whole)
    scores = None
    if threshold is not None:
        splits = path.split(threshold)
    else:
        # With nothing to hold out, the data has to judge itself.
        rounds = folds.rounds() or [(whole, whole)]
        of_folds = np.stack([score_of(held_out)(path_of(training).weights) for training, held_out in rounds])
        scores = of_folds.sum(axis=0)
        splits = np.maximum(_choose(of_folds, standard_errors), path.lowest)
    directions = path.eigenvalues.shape[1]
    weights = unvec(path.at(splits), whole.cross.shape[1])
    return Solution(weights, directions - splits, directions, path.threshold(splits), path.eigenvalues, scores)


def _choose(scores: Array, standard_errors: float) -> NDArray[np.intp]:
    """Pick a split for each model from scores (folds, M, P + 1).

    The largest split whose total is not worse than the best by more than
    ``standard_errors`` standard errors of the difference.
    """
    count, _, splits = scores.shape
    totals = scores.sum(axis=0)
    best = totals.argmin(axis=1)[:, None]
    finite = np.where(np.isfinite(scores), scores, 0.0)
    difference = finite - np.take_along_axis(finite, best[None], axis=2)
    error = np.sqrt(count) * difference.std(axis=0, ddof=1) if count > 1 else np.zeros(totals.shape)
    allowed = np.take_along_axis(totals, best, axis=1) + standard_errors * error
    good = totals <= allowed
    return splits - 1 - good[:, ::-1].argmax(axis=1)


def _check(threshold: float | None, standard_errors: float) -> None:
    check_at_least("standard_errors", standard_errors, 0.0)
    if threshold is not None:
        check_at_least("threshold", threshold, 0.0)

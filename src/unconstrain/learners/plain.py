"""Learners: from moments to a solution.

Each is a list of objectives in order of importance: :class:`Direct` has the
standard risk, :class:`Inconsistency` the inconsistency, and :class:`Hybrid`
the inconsistency first and then the standard risk in the directions that the
first leaves undetermined. What counts as undetermined is chosen on held-out
data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, check_at_least
from ..base.errors import SettingError
from ..base.threads import workers
from ..risks import (
    SECONDARY_NOISE,
    Moments,
    Path,
    Quadratic,
    eigensystem,
    inconsistency,
    lexicographic_path,
    minimum,
    softened_minima,
    standard_risk,
    unvec,
    vec,
)
from ..training import FoldedMoments

__all__ = ["Direct", "Hybrid", "Inconsistency", "Learner", "Solution"]

Averaging = Literal["geometric", "arithmetic"]

AT_REST = 1e-3
"""A demonstration whose mean square action is below this share of the largest has nothing to say of softness."""

SOFTNESSES = (1e-11, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0)
"""What ``Hybrid(alpha="auto")`` tries."""


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
        Held-out ``E_i + α E_2`` per unit of weight, averaged over the folds,
        for every number of undetermined directions, where the threshold was
        chosen by it.
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
        spectrum, _ = eigensystem(whole.gram)
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
    averaging
        See :class:`Hybrid`.
    """

    threshold: float | None = 0.0
    averaging: Averaging = "geometric"

    def __post_init__(self) -> None:
        _check(self)

    def solve(self, folds: FoldedMoments) -> Solution:
        """Learn from the whole, at a threshold chosen on the folds."""
        return _solve(self, folds, _inconsistency_path, inconsistency)


@dataclass(frozen=True)
class Hybrid:
    """Minimise the inconsistency, then the standard risk where that leaves room (eqs 6 to 17).

    Parameters
    ----------
    alpha : float or "auto"
        Weight of the standard risk in the score ``E_i + α E_2`` that picks
        the threshold on held-out data. Small for constraints that vary a lot
        from sample to sample, large for data that is nearly free. "auto"
        chooses a softness instead, the largest whose inconsistency on
        held-out data is within one standard error of the best.
    threshold : float, optional
        Use this λ_t, as a share of the largest eigenvalue, instead of
        choosing. 0 leaves out rounding noise only.
    softness : float
        Soften "subject to being consistent" (eq. 6): the first objective is
        ``E_i + softness E_2``. The paper splits hard, at 0. On noisy
        recordings a tenth and ``threshold=0`` do better: every direction then
        goes over from one objective to the other by degrees.
    """

    alpha: float | Literal["auto"] = 0.1
    threshold: float | None = None
    softness: float = 0.0
    averaging: Averaging = "geometric"

    def __post_init__(self) -> None:
        if self.alpha != "auto":
            check_at_least("alpha", self.alpha, 0.0)
        elif self.threshold is not None or self.softness:
            raise SettingError('alpha: "auto" chooses a softness, and needs no threshold and no softness beside it.')
        check_at_least("softness", self.softness, 0.0)
        _check(self)

    def solve(self, folds: FoldedMoments) -> Solution:
        """Learn from the whole, at a threshold chosen on the folds."""
        if self.alpha == "auto":
            softened = Hybrid(threshold=0.0, softness=self.chosen_softness(folds), averaging=self.averaging)
            return softened.solve(folds)
        return _solve(self, folds, self._path, self._score)

    @staticmethod
    def chosen_softness(folds: FoldedMoments) -> float:
        """The softness that ``alpha="auto"`` chooses, the same for all models."""
        rounds = folds.rounds()
        if not rounds:
            return SOFTNESSES[0]
        speeds = [held_out.energy.sum() / max(held_out.weight.sum(), 1e-300) for _, held_out in rounds]
        missed = []
        for (training, held_out), speed in zip(rounds, speeds, strict=True):
            if speed < AT_REST * max(speeds):
                continue  # all noise: as a share of its motion it would outvote the others
            candidates = softened_minima(inconsistency(training), standard_risk(training), SOFTNESSES)
            # Each round as a share of its own motion: a fast demonstration says no more than a slow one.
            missed.append(inconsistency(held_out)(candidates).sum(axis=0) / max(held_out.energy.sum(), 1e-300))
        return SOFTNESSES[within_errors(np.stack(missed)).max()]

    def _path(self, moments: Moments) -> Path:
        consistent, risk = inconsistency(moments), standard_risk(moments)
        return lexicographic_path(consistent + self.softness * risk if self.softness else consistent, risk)

    def _score(self, moments: Moments) -> Quadratic:
        assert self.alpha != "auto"
        return inconsistency(moments) + self.alpha * standard_risk(moments)


def within_errors(missed: Array, times: float = 1.0) -> NDArray[np.intp]:
    """Candidates whose loss is within a standard error, or so many times one, of the best.

    Parameters
    ----------
    missed : ndarray, shape (R, K)
        Held-out loss of each candidate in each round. Errors are of the difference to the best, round by round.
    """
    best = int(missed.mean(axis=0).argmin())
    if len(missed) < 2:  # and so no standard error
        return np.array([best], dtype=np.intp)
    gap = missed - missed[:, [best]]
    return np.flatnonzero(gap.mean(axis=0) <= times * gap.std(axis=0, ddof=1) / np.sqrt(len(missed)))


def _inconsistency_path(moments: Moments) -> Path:
    return lexicographic_path(inconsistency(moments))


def _solve(
    learner: Inconsistency | Hybrid,
    folds: FoldedMoments,
    path_of: Callable[[Moments], Path],
    score_of: Callable[[Moments], Quadratic],
) -> Solution:
    def judge(training: Moments, held_out: Moments) -> Array:
        return score_of(held_out)(path_of(training).weights)

    whole = folds.whole
    # With nothing to hold out, the data has to judge itself.
    rounds = folds.rounds() or [(whole, whole)] if learner.threshold is None else []
    calls: list[Callable[[], Any]] = [partial(path_of, whole), *(partial(judge, *pair) for pair in rounds)]
    models, size = vec(whole.cross).shape
    with workers() as threads:
        path, *judged = threads.run(calls, len(calls) * models * size**3)
    scores = None
    if learner.threshold is not None:
        splits = path.split(learner.threshold)
    else:
        scores = _average(np.stack(judged), [held_out for _, held_out in rounds], learner.averaging)
        splits = np.maximum(_last_best(scores), path.lowest)
    directions = path.eigenvalues.shape[1]
    weights = unvec(path.at(splits), whole.cross.shape[1])
    return Solution(weights, directions - splits, directions, path.threshold(splits), path.eigenvalues, scores)


def _average(judged: Array, parts: Sequence[Moments], averaging: Averaging) -> Array:
    """Average scores (folds, M, P + 1) over the folds, each per unit of its weight and counted by it."""
    weight = np.stack([part.weight for part in parts])[..., None]
    counts = np.where(weight > 0, weight, 1.0)  # a fold that a field does not see scores 0 with weight 0
    scores = judged / counts
    if averaging == "geometric":
        # Of a perfect fit, or of a demonstration at rest, rounding is left, and its logarithm must not decide.
        energy = np.stack([part.energy for part in parts])[..., None].sum(axis=0)
        floor = 1e-9 * energy / np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
        scores = np.log(np.maximum(scores + floor, np.finfo(float).tiny))
    total = np.where(weight > 0, weight * scores, 0.0).sum(axis=0)
    mean = total / np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
    return np.exp(mean) if averaging == "geometric" else mean


def _last_best(scores: Array) -> NDArray[np.intp]:
    """The largest split with the lowest score: what does not matter is left to the standard risk."""
    good = scores == scores.min(axis=1, keepdims=True)
    return scores.shape[1] - 1 - good[:, ::-1].argmax(axis=1)


def _check(learner: Inconsistency | Hybrid) -> None:
    if learner.threshold is not None:
        check_at_least("threshold", learner.threshold, 0.0)
    if learner.averaging not in ("arithmetic", "geometric"):
        raise SettingError(f"averaging: got {learner.averaging!r}, expected 'geometric' or 'arithmetic'.")

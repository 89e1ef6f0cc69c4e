"""Split of the eigenvectors into determined and undetermined ones, by cross-validation (section III-C)."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, check_at_least
from ..base.display import tell
from ..base.errors import SettingError
from ..base.threads import workers
from ..risks import FoldedMoments, Moments, Path, Quadratic, unvec, vec
from .solution import Solution

Averaging = Literal["geometric", "arithmetic"]


def check_settings(threshold: float | None, averaging: str) -> None:
    """Check the settings that the learners of the paper share.

    Raises
    ------
    SettingError
    """
    if threshold is not None:
        check_at_least("threshold", threshold, 0.0)
    if averaging not in ("arithmetic", "geometric"):
        raise SettingError(f"averaging: got {averaging!r}, expected 'geometric' or 'arithmetic'.")


def solve_at_threshold(
    folds: FoldedMoments,
    path_of: Callable[[Moments], Path],
    score_of: Callable[[Moments], Quadratic],
    threshold: float | None,
    averaging: Averaging,
    method: str,
) -> Solution:
    """Solve on all folds, at a threshold that is given or else chosen by cross-validation.

    Parameters
    ----------
    folds : FoldedMoments
    path_of : callable
        From moments to the solutions at every split.
    score_of : callable
        From held-out moments to the loss.
    threshold : float, optional
        λ_t as a share of the largest eigenvalue.
    averaging : {"geometric", "arithmetic"}
        Of the scores over the folds.
    method : str
        Name of the learner.
    """

    def judge(number: int) -> Array:
        tell(f"{method}: fold", number + 1, len(rounds))
        training, held_out = rounds[number]
        return judged(score_of(held_out), path_of(training).weights)

    whole = folds.whole
    # With nothing to hold out, the loss on the training data has to do.
    rounds = folds.rounds() or [(whole, whole)] if threshold is None else []
    calls: list[Callable[[], Any]] = [partial(path_of, whole), *(partial(judge, k) for k in range(len(rounds)))]
    models, size = vec(whole.cross).shape
    with workers() as threads:
        path, *scored = threads.run(calls, len(calls) * models * size**3)
    scores = None
    if threshold is not None:
        splits = path.split(threshold)
    else:
        scores = _average(np.stack(scored), [held_out for _, held_out in rounds], averaging)
        splits = np.maximum(_last_best(scores), path.lowest)
    directions = path.eigenvalues.shape[1]
    weights = unvec(path.at(splits), whole.cross.shape[1])
    return Solution(weights, directions - splits, directions, path.threshold(splits), path.eigenvalues, scores, method)


def judged(objective: Quadratic, weights: Array) -> Array:
    """Loss of each candidate: the objective's values, at least zero, infinite where they are not finite."""
    values = objective(weights)
    return np.where(np.isfinite(values), np.clip(values, 0.0, None), np.inf)


def within_errors(losses: Array, times: float = 1.0) -> NDArray[np.intp]:
    """Candidates whose loss is within some standard errors of the least.

    The one-standard-error rule (Breiman, Friedman, Olshen and Stone, *Classification and Regression Trees*, 1984), with
    the standard error of the paired difference to the best candidate.

    Parameters
    ----------
    losses : ndarray, shape (R, K)
        Held-out loss of each candidate in each round.
    times : float
        Number of standard errors.
    """
    best = int(losses.mean(axis=0).argmin())
    if len(losses) < 2:  # and so no standard error
        return np.array([best], dtype=np.intp)
    gap = losses - losses[:, [best]]
    return np.flatnonzero(gap.mean(axis=0) <= times * gap.std(axis=0, ddof=1) / np.sqrt(len(losses)))


def _average(judged: Array, parts: Sequence[Moments], averaging: Averaging) -> Array:
    """Average scores (folds, M, P + 1) per unit of weight over the folds, weighted by the folds' weights."""
    weight = np.stack([part.weight for part in parts])[..., None]
    counts = np.where(weight > 0, weight, 1.0)  # a fold that a field does not see scores 0 with weight 0
    scores = judged / counts
    if averaging == "geometric":
        # The score of a perfect fit, or of a demonstration at rest, is rounding: its logarithm must not decide.
        energy = np.stack([part.energy for part in parts])[..., None].sum(axis=0)
        floor = 1e-9 * energy / np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
        scores = np.log(np.maximum(scores + floor, np.finfo(float).tiny))
    total = np.where(weight > 0, weight * scores, 0.0).sum(axis=0)
    mean = total / np.maximum(weight.sum(axis=0), np.finfo(float).tiny)
    return np.exp(mean) if averaging == "geometric" else mean


def _last_best(scores: Array) -> NDArray[np.intp]:
    """The largest split of the lowest score: ties are left to the standard risk."""
    good = scores == scores.min(axis=1, keepdims=True)
    return scores.shape[1] - 1 - good[:, ::-1].argmax(axis=1)

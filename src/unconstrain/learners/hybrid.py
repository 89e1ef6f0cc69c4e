"""Consistency first; then, in the directions that leaves undetermined, the standard risk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from ..base.arrays import check_at_least
from ..base.errors import SettingError
from ..risks import (
    FoldedMoments,
    Moments,
    Path,
    Quadratic,
    inconsistency,
    lexicographic_path,
    softened_minima,
    standard_risk,
)
from ..training import Training
from .learner import Learner
from .solution import Solution
from .thresholds import Averaging, check_settings, judged, solve_at_threshold, within_errors

AT_REST = 1e-3
"""A demonstration whose mean square action is below this share of the largest has nothing to say of softness."""

SOFTNESSES = (1e-11, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0)
"""What ``Hybrid(alpha="auto")`` tries."""


@dataclass(frozen=True)
class Hybrid(Learner):
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
        check_settings(self.threshold, self.averaging)

    def learn(self, training: Training) -> Solution:
        """Learn from the whole, at a threshold or with a softness chosen on the folds."""
        folds = training.folds
        if self.alpha == "auto":
            return replace(self, alpha=0.0, threshold=0.0, softness=chosen_softness(folds)).learn(training)
        return solve_at_threshold(
            folds, self._path, partial(_score, self.alpha), self.threshold, self.averaging, method="hybrid"
        )

    def _path(self, moments: Moments) -> Path:
        consistent, risk = inconsistency(moments), standard_risk(moments)
        return lexicographic_path(consistent + self.softness * risk if self.softness else consistent, risk)


def _score(alpha: float, moments: Moments) -> Quadratic:
    return inconsistency(moments) + alpha * standard_risk(moments)


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
        missed.append(judged(inconsistency(held_out), candidates).sum(axis=0) / max(held_out.energy.sum(), 1e-300))
    return SOFTNESSES[within_errors(np.stack(missed)).max()]

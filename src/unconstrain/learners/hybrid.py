"""The inconsistency first, then the standard risk in the directions that it leaves undetermined."""

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
from .secondary import Objective, Secondary, on
from .solution import Solution
from .thresholds import Averaging, check_settings, judged, solve_at_threshold, within_errors

AT_REST = 1e-3
"""Demonstrations with a mean square action below this share of the largest are left out in choosing the softness."""

SOFTNESSES = (1e-11, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0)
"""Softnesses among which ``Hybrid(alpha="auto")`` chooses."""


@dataclass(frozen=True)
class Hybrid(Learner):
    """Minimise the inconsistency, then the standard risk in the directions left undetermined (eqs 6 to 17).

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
        choosing. 0 leaves out rounding errors only.
    softness : float
        Replace the first objective of eq. 6 by ``E_i + softness E_2``. The
        paper has 0, a hard split of the directions. On noisy recordings 0.1
        with ``threshold=0`` is better: each direction is then a weighted
        compromise of both objectives.
    secondary : callable or Secondary, optional
        What is minimised in the directions left undetermined, in place of the standard risk: ``towards(goal, gain)``,
        ``like(policy)``, ``damped(gain)``, ``smooth()`` of :mod:`unconstrain.learners.secondary`, sums of them and of
        :func:`~unconstrain.learners.secondary.standard_risk`, or a function of your own from moments to a quadratic.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(states, actions).predict([[1.0, 2.0]]).round(3)
    array([[-1., -2.]])
    >>> uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit(states, actions).predict([[1.0, 2.0]]).round(1)
    array([[-0.2, -1.2]])
    """

    alpha: float | Literal["auto"] = 0.1
    threshold: float | None = None
    softness: float = 0.0
    averaging: Averaging = "geometric"
    secondary: Objective | Secondary | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "needs_samples", getattr(self.secondary, "needs_samples", False))
        if self.alpha != "auto":
            check_at_least("alpha", self.alpha, 0.0)
        elif self.threshold is not None or self.softness:
            raise SettingError('alpha: "auto" chooses a softness, and needs no threshold and no softness beside it.')
        check_at_least("softness", self.softness, 0.0)
        check_settings(self.threshold, self.averaging)

    def learn(self, training: Training) -> Solution:
        """Learn from all folds, with a threshold or softness chosen by cross-validation."""
        folds = training.folds
        if self.alpha == "auto":
            return replace(self, alpha=0.0, threshold=0.0, softness=chosen_softness(folds)).learn(training)
        path = partial(self._path, on(self.secondary, training))
        return solve_at_threshold(
            folds, path, partial(_score, self.alpha), self.threshold, self.averaging, method="hybrid"
        )

    def _path(self, second: Objective, moments: Moments) -> Path:
        consistent = inconsistency(moments)
        first = consistent + self.softness * standard_risk(moments) if self.softness else consistent
        return lexicographic_path(first, second(moments))


def _score(alpha: float, moments: Moments) -> Quadratic:
    return inconsistency(moments) + alpha * standard_risk(moments)


def chosen_softness(folds: FoldedMoments) -> float:
    """The softness of ``alpha="auto"``, for all models: the largest by the one-standard-error rule.

    The loss is the held-out inconsistency; see :func:`~.thresholds.within_errors`.
    """
    rounds = folds.rounds()
    if not rounds:
        return SOFTNESSES[0]
    speeds = [held_out.energy.sum() / max(held_out.weight.sum(), 1e-300) for _, held_out in rounds]
    losses = []
    for (training, held_out), speed in zip(rounds, speeds, strict=True):
        if speed < AT_REST * max(speeds):
            continue  # all noise: relative to its motion its loss would outweigh the others'
        candidates = softened_minima(inconsistency(training), standard_risk(training), SOFTNESSES)
        # Each round relative to its own motion, so that fast demonstrations do not outweigh slow ones.
        losses.append(judged(inconsistency(held_out), candidates).sum(axis=0) / max(held_out.energy.sum(), 1e-300))
    return SOFTNESSES[within_errors(np.stack(losses)).max()]

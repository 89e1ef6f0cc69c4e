"""How far the policy may be from what is predicted, and why."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .posterior import RobustSolution

__all__ = ["Uncertainty", "uncertainty"]


class Uncertainty(NamedTuple):
    """Standard deviations of the predicted policy, each of shape (N, d).

    ``from_noise`` is what noise and misfit leave open, ``undetermined`` what
    the data does not say, and ``total`` both: 95 % of the time the policy
    should be within 1.96 of it, where ``undetermined`` is not most of it.
    """

    from_noise: Array
    undetermined: Array
    total: Array


def uncertainty(solution: RobustSolution, features: Array, shares: Array, centring: Array) -> Uncertainty:
    """Posterior spread of the prediction at N states.

    Neighbouring models learn from the same samples, so their errors are
    taken to go together: standard deviations are averaged, not variances.

    Parameters
    ----------
    solution : RobustSolution
    features : ndarray, shape (N, p)
    shares : ndarray, shape (N, M)
        Of each model in the prediction.
    centring : ndarray, shape (M, p, p)
        T_m of :class:`~unconstrain.robust.Samples`.
    """
    d = solution.weights.shape[1]
    parts = []
    for covariance in (solution.from_noise, solution.undetermined):
        spread = np.zeros((len(features), d))
        for share, change, blocks in zip(shares.T, centring, covariance, strict=True):
            own = features @ change.T
            p = own.shape[1]
            of_action = blocks.reshape(p, d, p, d)
            for action in range(d):
                variance = ((own @ of_action[:, action, :, action]) * own).sum(axis=1)
                spread[:, action] += share * np.sqrt(np.maximum(variance, 0.0))
        parts.append(spread)
    from_noise = np.hypot(parts[0], solution.misfit)
    return Uncertainty(from_noise, parts[1], np.hypot(from_noise, parts[1]))

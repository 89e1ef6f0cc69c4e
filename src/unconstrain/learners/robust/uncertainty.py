"""How far the policy may be from what is predicted, and why."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...base.arrays import Array
from .posterior import RobustSolution

__all__ = ["Uncertainty", "covariances", "uncertainty"]


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
        T_m of :class:`~unconstrain.learners.robust.Samples`.
    """
    from_noise = np.hypot(_spread(solution.from_noise, features, shares, centring), solution.misfit)
    undetermined = _spread(solution.undetermined, features, shares, centring)
    return Uncertainty(from_noise, undetermined, np.hypot(from_noise, undetermined))


def covariances(covariance: Array, features: Array, shares: Array, centring: Array) -> Array:
    """Covariance of the prediction at N states, shape (N, d, d).

    On the diagonal are the squares of what :func:`uncertainty` says. Beside
    it, models are mixed by their correlations, so that the result is positive.

    Parameters
    ----------
    covariance : ndarray, shape (M, d p, d p)
        Of the weights, such as ``solution.undetermined``.
    features, shares, centring
        As in :func:`uncertainty`.
    """
    p = features.shape[1]
    d = covariance.shape[1] // p
    spread = _spread(covariance, features, shares, centring)
    mixed = np.zeros((len(features), d, d))
    for share, change, blocks in zip(shares.T, centring, covariance, strict=True):
        own = features @ change.T
        local = np.einsum("ni,iajb,nj->nab", own, blocks.reshape(p, d, p, d), own, optimize=True)
        size = np.sqrt(np.maximum(np.einsum("naa->na", local), 0.0))
        inverse = np.where(size > 0, 1.0 / np.where(size > 0, size, 1.0), 0.0)
        mixed += share[:, None, None] * inverse[:, :, None] * local * inverse[:, None, :]
    mixed[:, np.arange(d), np.arange(d)] = 1.0
    return np.asarray(spread[:, :, None] * mixed * spread[:, None, :])


def _spread(covariance: Array, features: Array, shares: Array, centring: Array) -> Array:
    """Standard deviation of each action coordinate, averaged over the models, shape (N, d)."""
    p = features.shape[1]
    d = covariance.shape[1] // p
    spread = np.zeros((len(features), d))
    for share, change, blocks in zip(shares.T, centring, covariance, strict=True):
        own = features @ change.T
        of_action = blocks.reshape(p, d, p, d)
        for action in range(d):
            variance = ((own @ of_action[:, action, :, action]) * own).sum(axis=1)
            spread[:, action] += share * np.sqrt(np.maximum(variance, 0.0))
    return spread

"""The sums that every learner needs, and the only code that sees N samples.

All risks of the method are one quadratic with three metrics. For any
orthogonal projection P with ``P u = u``,

    Σ w ‖u − P π̃(x)‖² = Σ w uᵀu − 2 Σ w uᵀπ̃ + Σ w π̃ᵀ P π̃,

so the standard risk (P = I, eq. 5) and the inconsistency (P = ûûᵀ, eq. 4)
share the constant and the linear term, and with ``π̃(x) = W φ(x)`` five sums
say everything about a data set.

A zero action has no direction: it counts in weight, gram (and, adding
nothing, in energy and cross), but not in ``consistent``. This is the one place
where that is decided.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import reduce
from operator import add
from typing import Protocol

import numpy as np

from .arrays import Array
from .projection import unit_actions

__all__ = ["Moments", "gather", "total"]


@dataclass(frozen=True, eq=False)
class Moments:
    """Weighted sums over samples, for M models at once.

    They add (batches, machines), subtract (leave a fold out) and scale
    (forgetting).

    Parameters
    ----------
    weight : ndarray, shape (M,)
        ``Σ w``.
    energy : ndarray, shape (M,)
        ``Σ w uᵀu``, the E₀ of eqs 4 and 11.
    cross : ndarray, shape (M, d, p)
        ``Σ w u φᵀ``; by columns it is the g of eq. 7 and the m of eq. 11.
    gram : ndarray, shape (M, p, p)
        ``Σ w φφᵀ``, so that the M of eq. 11 is ``gram ⊗ I``.
    consistent : ndarray, shape (M, d p, d p)
        ``Σ w (φφᵀ ⊗ ûûᵀ)``, the H of eqs 7 and 15.
    """

    weight: Array
    energy: Array
    cross: Array
    gram: Array
    consistent: Array

    @classmethod
    def zero(cls, models: int, actions: int, features: int) -> Moments:
        """Moments of no sample at all."""
        weights = actions * features
        return cls(
            np.zeros(models),
            np.zeros(models),
            np.zeros((models, actions, features)),
            np.zeros((models, features, features)),
            np.zeros((models, weights, weights)),
        )

    def __add__(self, other: Moments) -> Moments:
        """Moments of both data sets together."""
        return Moments(*(mine + theirs for mine, theirs in zip(self.sums, other.sums, strict=True)))

    def __sub__(self, other: Moments) -> Moments:
        """Moments without a part that is in them."""
        return Moments(*(mine - theirs for mine, theirs in zip(self.sums, other.sums, strict=True)))

    def __mul__(self, factor: float) -> Moments:
        """Moments with every sample's weight multiplied."""
        return Moments(*(factor * mine for mine in self.sums))

    __rmul__ = __mul__

    @property
    def sums(self) -> tuple[Array, ...]:
        """The five sums, in the order of the fields."""
        return tuple(getattr(self, field.name) for field in fields(self))

    def in_features(self, change: Array) -> Moments:
        """Moments of other features that are linear in these, ``φ' = T_m φ``.

        Parameters
        ----------
        change : ndarray, shape (M, p', p)
            T for each model.

        Returns
        -------
        Moments
        """
        models, d, p = self.cross.shape
        new = change.shape[1]
        back = np.swapaxes(change, -1, -2)
        blocks = self.consistent.reshape(models, p, d, p, d).transpose(0, 2, 4, 1, 3)  # (M, d, d, p, p)
        moved = change[:, None, None] @ blocks @ back[:, None, None]
        return Moments(
            self.weight,
            self.energy,
            self.cross @ back,
            change @ self.gram @ back,
            moved.transpose(0, 3, 1, 4, 2).reshape(models, new * d, new * d),
        )


def total(parts: Iterable[Moments]) -> Moments:
    """Sum of several moments."""
    return reduce(add, parts)


def gather(features: Array, actions: Array, weights: Array | None = None) -> Moments:
    """Sum over samples. The matrix V = φ ⊗ û of all samples (N × d p) never exists.

    Parameters
    ----------
    features : ndarray, shape (N, p)
    actions : ndarray, shape (N, d)
    weights : ndarray, shape (N, M), optional
        How much each sample counts in each model, not negative; ones for a
        single model if None.

    Returns
    -------
    Moments
    """
    samples, p = features.shape
    d = actions.shape[1]
    counts = np.ones((samples, 1)) if weights is None else weights
    columns = max(p * d, counts.shape[1] + p * (p + 1) // 2 * (d * (d + 1) // 2 + 1) if counts.shape[1] > 1 else 0)
    rows = max(64, _BLOCK // columns)
    sums = _grams_of_one if counts.shape[1] == 1 else _grams_of_many
    return total(
        [Moments.zero(counts.shape[1], d, p)]
        + [
            _gather_block(features[i : i + rows], actions[i : i + rows], counts[i : i + rows], sums)
            for i in range(0, samples, rows)
        ]
    )


_BLOCK = 2**18
"""Numbers in the largest temporary of a block: about a core's share of cache."""


def _gather_block(features: Array, actions: Array, weights: Array, grams: _Grams) -> Moments:
    models, (_, p), d = weights.shape[1], features.shape, actions.shape[1]
    directions, lengths = unit_actions(actions)
    gram, blocks = grams(features, directions, weights)
    cross = weights.T @ (actions[:, :, None] * features[:, None, :]).reshape(len(features), d * p)
    return Moments(
        weights.sum(axis=0),
        weights.T @ lengths**2,
        cross.reshape(models, d, p),
        gram,
        blocks.transpose(0, 3, 1, 4, 2).reshape(models, p * d, p * d),
    )


class _Grams(Protocol):
    def __call__(self, features: Array, directions: Array, weights: Array) -> tuple[Array, Array]:
        """Compute gram (M, p, p) and, for each pair of action directions, (M, d, d, p, p)."""
        ...


def _grams_of_one(features: Array, directions: Array, weights: Array) -> tuple[Array, Array]:
    """One model: a symmetric rank-k update for each pair of action directions.

    With ``F_k = diag(√w û_k) φ`` the blocks are ``F_kᵀF_l``. Off the diagonal,
    ``F_kᵀF_l + F_lᵀF_k = (F_k + F_l)ᵀ(F_k + F_l) − F_kᵀF_k − F_lᵀF_l`` (and
    both terms are equal), so that every product is of a matrix with its own
    transpose, which BLAS does at half the price. The last diagonal block
    follows from the others, since ``Σ û_k² = 1``.
    """
    d, p = directions.shape[1], features.shape[1]
    rooted = np.sqrt(weights) * features
    moving = directions.any(axis=1)
    seen = rooted[moving] if not moving.all() else rooted
    pointed = [seen * directions[moving, k, None] for k in range(d)]
    gram = seen.T @ seen
    blocks = np.empty((d, d, p, p))
    for k in range(d - 1):
        blocks[k, k] = pointed[k].T @ pointed[k]
    blocks[d - 1, d - 1] = gram - sum(blocks[k, k] for k in range(d - 1))
    for k in range(d):
        for m in range(k):
            both = pointed[k] + pointed[m]
            blocks[k, m] = blocks[m, k] = 0.5 * (both.T @ both - blocks[k, k] - blocks[m, m])
    still = rooted[~moving]
    return (gram + still.T @ still)[None], blocks[None]


def _grams_of_many(features: Array, directions: Array, weights: Array) -> tuple[Array, Array]:
    """Many models: one product ``Wᵀ (vech φφᵀ ⊗ (1, vech ûûᵀ))`` for all of them."""
    models, d, p = weights.shape[1], directions.shape[1], features.shape[1]
    row, column = np.triu_indices(p)
    first, second = np.triu_indices(d)
    squares = features[:, row] * features[:, column]
    metrics = np.column_stack([np.ones(len(features)), directions[:, first] * directions[:, second]])
    sums = weights.T @ (metrics[:, :, None] * squares[:, None, :]).reshape(len(features), -1)
    full = np.empty((models, metrics.shape[1], p, p))
    full[:, :, row, column] = full[:, :, column, row] = sums.reshape(models, metrics.shape[1], len(row))
    blocks = np.empty((models, d, d, p, p))
    blocks[:, first, second] = blocks[:, second, first] = full[:, 1:]
    return full[:, 0], blocks

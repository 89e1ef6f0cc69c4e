"""The sums that every learner needs, and the only code that sees N samples.

All risks of the method are one quadratic with three metrics. For any
orthogonal projection P with ``P u = u``,

    Σ w ‖u − P π̃(x)‖² = Σ w uᵀu − 2 Σ w uᵀπ̃ + Σ w π̃ᵀ P π̃,

so the standard risk (P = I, eq. 5) and the inconsistency (P = ûûᵀ, eq. 4)
share the constant and the linear term, and with ``π̃(x) = W φ(x)`` five sums
say everything about a data set.

A zero action has no direction: it counts in weight, gram (and, adding
nothing, in energy and cross), but not in ``consistent``. This is the one place
where that is decided. What is zero is for the caller to say (``at_rest``):
the direction of rounding would claim that the policy is zero along it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import reduce
from operator import add

import numpy as np

from .arrays import Array
from .projection import unit_actions

__all__ = ["Moments", "gather", "gather_blocks", "total"]


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


def gather(features: Array, actions: Array, weights: Array | None = None, at_rest: float = 0.0) -> Moments:
    """Sum over samples. The matrix V = φ ⊗ û of all samples (N × d p) never exists.

    Parameters
    ----------
    features : ndarray, shape (N, p)
    actions : ndarray, shape (N, d)
    weights : ndarray, shape (N, M), optional
        How much each sample counts in each model, not negative; ones for a
        single model if None.
    at_rest : float
        Actions of at most this length have no direction.

    Returns
    -------
    Moments
    """
    counts = np.ones((len(features), 1)) if weights is None else weights
    block = features, actions, counts
    return gather_blocks([block], counts.shape[1], actions.shape[1], features.shape[1], at_rest)


def gather_blocks(
    blocks: Iterable[tuple[Array, Array, Array]], models: int, actions: int, features: int, at_rest: float = 0.0
) -> Moments:
    """Sum over blocks of samples, each (features, actions, weights) as in :func:`gather`."""
    single = models == 1
    pairs = features**2 if single else features * (features + 1) // 2
    metrics = 1 + actions * (actions + 1) // 2
    products = np.zeros((models, metrics, pairs))
    weight, energy, cross = np.zeros(models), np.zeros(models), np.zeros((models, actions, features))
    rows = max(64, _BLOCK // (actions * features if single else metrics * pairs))
    for block in blocks:
        for start in range(0, len(block[0]), rows):
            phi, u, w = (part[start : start + rows] for part in block)
            directions, lengths = unit_actions(u)
            directions[lengths <= at_rest] = 0.0
            products += (_products_of_one if single else _products_of_many)(phi, directions, w)
            weight += w.sum(axis=0)
            energy += w.T @ lengths**2
            cross += (w.T @ (u[:, :, None] * phi[:, None, :]).reshape(len(u), -1)).reshape(cross.shape)
    return Moments(weight, energy, cross, *_unpacked(products, actions, features))


_BLOCK = 2**18
"""Numbers in the largest temporary: about a core's share of cache."""


def _products_of_one(features: Array, directions: Array, weights: Array) -> Array:
    """``Σ w φφᵀ`` for the metrics 1 and û_k û_m (k ≤ m) of one model, shape (1, metrics, p²).

    With ``F_k = diag(√w û_k) φ`` they are ``F_kᵀF_m``. Off the diagonal,
    ``F_kᵀF_m + F_mᵀF_k = (F_k + F_m)ᵀ(F_k + F_m) − F_kᵀF_k − F_mᵀF_m`` (and
    both terms are equal), so that every product is of a matrix with its own
    transpose, which BLAS does at half the price. The largest diagonal one
    follows from the others, since ``Σ û_k² = 1``.
    """
    rooted = np.sqrt(weights) * features
    moving = directions.any(axis=1)
    still = rooted[~moving]
    seen = rooted if moving.all() else rooted[moving]
    pointed = [seen * directions[moving, k, None] for k in range(directions.shape[1])]
    whole = seen.T @ seen
    largest = int(np.argmax([(f**2).sum() for f in pointed]))  # subtracting for a small one would leave rounding
    own = [np.zeros_like(whole) if k == largest else f.T @ f for k, f in enumerate(pointed)]
    own[largest] = whole - sum(own, start=np.zeros_like(whole))
    products = [whole + still.T @ still]
    for k, m in zip(*np.triu_indices(len(pointed)), strict=True):
        if k == m:
            products.append(own[k])
        else:
            both = pointed[k] + pointed[m]
            products.append(0.5 * (both.T @ both - own[k] - own[m]))
    return np.stack(products).reshape(1, len(products), -1)


def _products_of_many(features: Array, directions: Array, weights: Array) -> Array:
    """The same for many models, half of each: one product ``Wᵀ ((1, vech ûûᵀ) ⊗ vech φφᵀ)``."""
    first, second = np.triu_indices(directions.shape[1])
    row, column = np.triu_indices(features.shape[1])
    metrics = np.column_stack([np.ones(len(features)), directions[:, first] * directions[:, second]])
    squares = features[:, row] * features[:, column]
    sums = weights.T @ (metrics[:, :, None] * squares[:, None, :]).reshape(len(features), -1)
    return sums.reshape(weights.shape[1], metrics.shape[1], len(row))


def _unpacked(products: Array, d: int, p: int) -> tuple[Array, Array]:
    """Gram (M, p, p) and consistent (M, d p, d p) from the products of each metric."""
    models, metrics, pairs = products.shape
    if pairs == p * p:
        full = products.reshape(models, metrics, p, p)
    else:
        row, column = np.triu_indices(p)
        full = np.empty((models, metrics, p, p))
        full[..., row, column] = full[..., column, row] = products
    first, second = np.triu_indices(d)
    consistent = np.empty((models, p, d, p, d))
    for metric, (k, m) in enumerate(zip(first, second, strict=True), start=1):
        consistent[:, :, k, :, m] = consistent[:, :, m, :, k] = full[:, metric]
    return full[:, 0].copy(), consistent.reshape(models, p * d, p * d)

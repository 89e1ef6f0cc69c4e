"""The samples themselves, for learners that need more than their sums."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.display import Shown, counted
from ..risks import Moments, Quadratic, gather
from .order import path_beside
from .suspects import unlike_neighbours

_OF_ALL = ("centring", "roughness", "places", "notes", "reconstructed")


@dataclass(frozen=True, eq=False, repr=False)
class Samples(Shown):
    """Samples as a policy sees them, demonstration by demonstration, each in the order in which it was recorded.

    Parameters
    ----------
    states : ndarray, shape (N, n)
    features : ndarray, shape (N, p)
    actions : ndarray, shape (N, d)
    counts : ndarray, shape (N,)
        Sample weights, one on average over those of any weight; copies of a sample are one, with the sum of theirs.
    memberships : ndarray, shape (N, M)
        How much each sample counts in each model, without its sample weight.
    shares : ndarray, shape (N, M)
        Share of each model in the prediction.
    groups : ndarray of int, shape (N,)
        Which demonstration each sample is from.
    folds : ndarray of int, shape (N,)
        What is held out together, from 0; every number up to the largest occurs.
    centring : ndarray, shape (M, p', p)
        T_m, with which model m is solved in regressors ``T_m φ``, for the sake of rounding.
    roughness : ndarray, shape (M, p', p')
        Measures how rough each model's policy is, over ``T_m φ``; zero where nothing is said of it.
    places : ndarray of int, one for each sample that was given
        Where it is among these, or was before some were taken.
    times : ndarray, shape (N,), optional
        Seconds, where they were given.
    noise : ndarray, shape (N,), optional
        Standard deviation of the noise on each action coordinate, where it was given.
    notes : tuple of str
        What had to be assumed of their order.
    reconstructed : bool
        Whether the order within some demonstrations is a path through their states, as nothing tells the true one.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, -states).training_.samples
    Samples(60 samples, 2 states, 2 actions, 3 features, 1 model)
    """

    states: Array
    features: Array
    actions: Array
    counts: Array
    memberships: Array
    shares: Array
    groups: NDArray[np.intp]
    folds: NDArray[np.intp]
    centring: Array
    roughness: Array
    places: NDArray[np.intp]
    times: Array | None = None
    noise: Array | None = None
    notes: tuple[str, ...] = ()
    reconstructed: bool = False

    def __len__(self) -> int:
        """Number of samples N."""
        return len(self.features)

    def __getitem__(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Samples:
        """Some of them."""
        per_sample = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in _OF_ALL}
        some: dict[str, Any] = {name: None if part is None else part[rows] for name, part in per_sample.items()}
        return replace(self, **some)

    def path(self, more: Array) -> NDArray[np.intp]:
        """Order along a path of short steps through states, which together spread by one, and more (N, k), (N,)."""
        return path_beside(self.states, more)

    @property
    def regressors(self) -> int:
        """Number of regressors p' of each model."""
        return self.centring.shape[1]

    @cached_property
    def sizes(self) -> Array:
        """Number of samples in each model, shape (M,)."""
        return self.counts @ self.memberships

    @property
    def energy(self) -> float:
        """Mean of ‖u‖²."""
        return self.mean((self.actions**2).sum(axis=1))

    def mean(self, values: Array) -> float:
        """Mean of one value for each sample, (N,), weighted."""
        return float(self.counts @ values / self.counts.sum())

    def predict(self, weights: Array) -> Array:
        """What models of these weights (..., M, d, p), over ``T_m φ``, predict, shape (..., N, d)."""
        return self._predicted(weights, slice(None))

    def _predicted(self, weights: Array, rows: slice | NDArray[np.bool_]) -> Array:
        features, shares = self.features[rows], self.shares[rows]
        plain = weights @ self.centring
        *policies, models, d, p = plain.shape
        of_model = np.moveaxis(plain.reshape(-1, models, d, p), 0, 1)
        if models == 1:
            found = features @ of_model.reshape(-1, p).T
        else:  # weights are blended first: there are fewer of them than of models
            own = (shares @ of_model.reshape(models, -1)).reshape(len(features), -1, p)
            found = (own @ features[:, :, None])[..., 0]
        return np.moveaxis(found.reshape(len(features), -1, d), 0, 1).reshape(*policies, len(features), d)

    def moments(self, actions: Array, weights: Array) -> Moments:
        """Moments of any actions (N, d) at these features, each sample weighted (N,)."""
        counted = (self.counts * weights)[:, None] * self.memberships
        return gather(self.features, actions, counted).in_features(self.centring)

    def risk(self, targets: Array, weights: Array) -> Quadratic:
        """``Σ w ‖v − π̃‖²`` for targets v (N, d), without the sums that it does not need."""
        counted = (self.counts * weights)[:, None] * self.memberships
        d, p = targets.shape[1], self.regressors
        gram, cross = self._gram(counted), _sum_of_products(counted, self.features, targets)
        linear = (self.centring @ cross).reshape(len(gram), p * d)
        hessian = np.einsum("mij,kl->mikjl", gram, np.eye(d)).reshape(-1, p * d, p * d)
        return Quadratic(hessian, linear, counted.T @ (targets**2).sum(axis=1))

    def constrained(self, projections: Array) -> Quadratic:
        """``Σ w ‖N (u − π̃)‖²`` with a projection N of each sample, (N, d, d)."""
        counted = self.counts[:, None] * self.memberships
        d, p = self.actions.shape[1], self.regressors
        hessian = np.empty((len(self.centring), p, d, p, d))
        for a, b in combinations_with_replacement(range(d), 2):
            hessian[:, :, a, :, b] = hessian[:, :, b, :, a] = self._gram(counted * projections[:, a, b, None])
        left = np.einsum("nab,nb->na", projections, self.actions)
        linear = self.centring @ _sum_of_products(counted, self.features, left)
        flat = hessian.reshape(-1, p * d, p * d)
        return Quadratic(flat, linear.reshape(-1, p * d), counted.T @ np.vecdot(left, left))

    def _gram(self, weights: Array) -> Array:
        """``Σ w φφᵀ`` in features ``T_m φ``, with weights (N, M): shape (M, p, p)."""
        gram = _sum_of_products(weights, self.features, self.features)
        return np.asarray(self.centring @ gram @ self.centring.mT)

    @property
    def suspects(self) -> NDArray[np.intp]:
        """Which of all that were given look wrong beside their neighbours in time, ascending; see :mod:`.suspects`."""
        rows = np.flatnonzero(self.counts)
        return np.flatnonzero(np.isin(self.places, rows[unlike_neighbours(self.actions[rows], self.groups[rows])]))

    @property
    def counted(self) -> Samples:
        """Those of some weight."""
        return self if self.counts.all() else self[self.counts > 0.0]

    def by_fold(self) -> list[Samples]:
        """What is held out together."""
        return [self[self.folds == fold] for fold in range(int(self.folds.max()) + 1)]

    @cached_property
    def moments_by_fold(self) -> list[Moments]:
        """Moments of the actions, fold by fold."""
        return [part.moments(part.actions, np.ones(len(part))) for part in self.by_fold()]

    def held_out(self, refits: Sequence[Array] | Array) -> Array:
        """What weights that were learnt without each fold (R, ..., M, d, p) predict there, shape (..., N, d)."""
        found = np.empty((*np.shape(refits)[1:-3], *self.actions.shape))
        for fold, weights in enumerate(refits):
            rows = self.folds == fold
            found[..., rows, :] = self._predicted(weights, rows)
        return found

    def _summary(self) -> tuple[str, ...]:
        sizes = self.states.shape[1], self.actions.shape[1], self.features.shape[1], self.memberships.shape[1]
        nouns = ("state", "action", "feature", "model")
        return counted(len(self), "sample"), *map(counted, sizes, nouns)


def _sum_of_products(weights: Array, one: Array, other: Array) -> Array:
    """``Σ_n w_nm a_n b_nᵀ`` of two tables (N, a) and (N, b), shape (M, a, b)."""
    if weights.shape[1] == 1:
        return ((one * weights).T @ other)[None]
    products = one[:, :, None] * other[:, None, :]
    flat = products.reshape(len(one), one.shape[1] * other.shape[1])
    return (weights.T @ flat).reshape(-1, *products.shape[1:])

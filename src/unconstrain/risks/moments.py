"""Moments: the sufficient statistics of all objectives. No other code of the learners from moments sees N samples.

All risks of the method are one quadratic with three metrics. For any orthogonal projection P with ``P u = u``,

    Σ w ‖u − P π̃(x)‖² = Σ w uᵀu − 2 Σ w uᵀπ̃ + Σ w π̃ᵀ P π̃,

so the standard risk (P = I, eq. 5) and the inconsistency (P = ûûᵀ, eq. 4) share the constant and the linear term, and
with ``π̃(x) = W φ(x)`` five sums are sufficient statistics.

A zero action has no direction: it counts in ``weight`` and ``gram`` (and, as zero, in ``energy`` and ``cross``), but
not in ``consistent``. The caller sets the length up to which actions are zero (``at_rest``): the direction of a
rounding error would state that the policy is zero along it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from itertools import combinations, combinations_with_replacement
from operator import add, sub
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, beside, is_foreign, namespace, on_host
from ..base.display import Shown, counted
from .projection import unit_actions


@dataclass(frozen=True, eq=False, repr=False)
class Moments(Shown):
    """Weighted sums over samples, for M models at once.

    They add (batches, machines), subtract (leaving a fold out) and scale
    (forgetting). The weight w of a sample in a model is its sample weight times
    its membership in that model.

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

    Examples
    --------
    >>> whole, first = (uc.gather(np.ones((count, 1)), np.ones((count, 1))) for count in (5, 2))
    >>> (whole - first).weight
    array([3.])
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

    @staticmethod
    def total(parts: Iterable[Moments]) -> Moments:
        """Sum of several moments."""
        return reduce(add, parts)

    def __add__(self, other: Moments) -> Moments:
        """Moments of both data sets together."""
        return Moments(*(mine + theirs for mine, theirs in zip(self.sums, other.sums, strict=True)))

    def __sub__(self, other: Moments) -> Moments:
        """Moments of the rest of the data set, without a part of it."""
        return Moments(*(mine - theirs for mine, theirs in zip(self.sums, other.sums, strict=True)))

    def __mul__(self, factor: float) -> Moments:
        """Moments with each sample's weight multiplied by a factor."""
        return Moments(*(factor * mine for mine in self.sums))

    __rmul__ = __mul__

    @property
    def sums(self) -> tuple[Array, ...]:
        """The five sums, in the order of the fields."""
        return self.weight, self.energy, self.cross, self.gram, self.consistent

    def in_features(self, change: Array) -> Moments:
        """Moments of other features that are linear in these, ``φ' = T_m φ``.

        Parameters
        ----------
        change : ndarray, shape (M, p', p)
            T for each model.
        """
        models, d, p = self.cross.shape
        new = change.shape[1]
        back = change.mT
        blocks = self.consistent.reshape(models, p, d, p, d).transpose(0, 2, 4, 1, 3)  # (M, d, d, p, p)
        moved = change[:, None, None] @ blocks @ back[:, None, None]
        return Moments(
            self.weight,
            self.energy,
            self.cross @ back,
            change @ self.gram @ back,
            moved.transpose(0, 3, 1, 4, 2).reshape(models, new * d, new * d),
        )

    def in_units(self, action: float, weight: float) -> Moments:
        """Moments with actions and sample weights measured in units ``1 / action`` and ``1 / weight`` as large."""
        energy, cross = action * (action * self.energy), action * self.cross
        return weight * replace(self, energy=energy, cross=cross)

    def on_host(self) -> Moments:
        """Moments as NumPy arrays."""
        return Moments(*map(on_host, self.sums))

    def _summary(self) -> tuple[str, ...]:
        models, d, p = self.cross.shape
        sizes = counted(models, "model"), counted(d, "action"), counted(p, "feature")
        return *sizes, f"weight={float(self.weight.sum()):.4g}"


def gather(features: Array, actions: Array, weights: Array | None = None, at_rest: float = 0.0) -> Moments:
    """Sum over samples. The matrix V = φ ⊗ û of all samples (N × d p) never exists.

    Parameters
    ----------
    features : ndarray, shape (N, p)
        These and the following may be arrays of any library that follows the
        array API standard; the moments then are too. Summed in float64.
    actions : ndarray, shape (N, d)
    weights : ndarray, shape (N, M), optional
        Sample weight times membership in each model, not negative; ones for a single model if None.
    at_rest : float
        Actions of at most this length have no direction.

    Examples
    --------
    >>> moments = uc.gather(features=np.ones((3, 1)), actions=np.array([[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]]))
    >>> moments.weight, moments.energy
    (array([3.]), array([5.]))
    """
    counts = namespace(features).ones_like(features[:, :1]) if weights is None else weights
    sums = Sums(counts.shape[1], actions.shape[1], features.shape[1], at_rest)
    for rows in sums.pieces(features):
        sums.add(*(part[rows, :] for part in (features, actions, counts)))
    return sums.moments


class Sums:
    """Accumulator of moments: samples are added block by block, and Hessians are assembled at the end.

    ``û_k û_m`` and 1 are called metrics here: a Hessian consists of one
    product ``Σ w û_k û_m φφᵀ`` for each k ≤ m, and the Gram matrix is that of 1.

    Parameters
    ----------
    models, actions, features : int
        M, d and p; together the attribute ``shape``.
    at_rest : float
        Actions of at most this length have no direction.
    """

    def __init__(self, models: int, actions: int, features: int, at_rest: float = 0.0) -> None:
        self.shape, self._at_rest = (models, actions, features), at_rest
        self._sums: list[Array] = []

    def pieces(self, table: Array, start: int = 0, stop: int | None = None) -> Iterator[slice]:
        """Slices of a table, or of part of it, to add one at a time, short enough for temporaries to stay in cache."""
        models, d, p = self.shape
        columns = p if models == 1 else max(1, d * d * p * p // 4)
        numbers, most = (_FOREIGN_BLOCK, 2**20) if is_foreign(table) else (_BLOCK, 8192)
        rows = min(max(512, numbers // columns), most)
        samples = (table.shape[0] if stop is None else stop) - start
        number = -(-samples // rows)
        return (slice(start + samples * i // number, start + samples * (i + 1) // number) for i in range(number))

    def add(self, features: Array, actions: Array, weights: Array) -> None:
        """Add some samples, of shapes as in :func:`gather`."""
        xp = namespace(features)
        phi, u, w = (xp.asarray(part, dtype=xp.float64) for part in (features, actions, weights))
        u = xp.stack([u[:, k] for k in range(u.shape[1])]).T  # columns in one piece: there are few, and long
        directions, lengths = unit_actions(u)
        moving = lengths > self._at_rest
        further = [xp.sum(w, axis=0), w.T @ lengths**2]
        if self.shape[0] == 1:
            further += [(w * u).T @ phi, *_products_of_one(xp, phi, directions, moving, w)]
        else:
            directions = xp.where(moving[:, None], directions, 0.0)
            further += [
                _sum_of_each_with_each(w, first, second) for first, second in ((u, phi), _metrics(xp, phi, directions))
            ]
        if not self._sums:
            self._sums = further
        else:
            for number, sums in enumerate(further):
                self._sums[number] += sums

    @property
    def moments(self) -> Moments:
        """Moments of all samples added so far."""
        models, d, p = self.shape
        if not self._sums:
            return Moments.zero(models, d, p)
        xp = namespace(self._sums[0])
        # The first three as copies: samples added later must not change them.
        weight, energy, cross = (xp.asarray(each, copy=True) for each in self._sums[:3])
        products = self._sums[3:]
        if models == 1:
            full = xp.stack(_by_metric(products, d))[None, ...]  # (1, metrics, p, p)
        else:
            halves = xp.reshape(products[0], (models, -1, p * (p + 1) // 2))
            full = xp.take(halves, beside(_places(p).ravel(), weight), axis=2)
            full = xp.reshape(full, (models, -1, p, p))
        hessian = xp.take(full, beside(1 + _places(d).ravel(), weight), axis=1)
        hessian = xp.permute_dims(xp.reshape(hessian, (models, d, d, p, p)), (0, 3, 1, 4, 2))
        return Moments(
            weight,
            energy,
            xp.reshape(cross, (models, d, p)),
            xp.asarray(full[:, 0, :, :], copy=True),
            xp.reshape(hessian, (models, p * d, p * d)),
        )


_BLOCK = 2**20
"""Numbers in the largest temporary: more do not stay in cache, fewer make products too small for BLAS."""

_FOREIGN_BLOCK = 2**25
"""The same for arrays of another library, which may be on a device that needs larger products."""


class _Workspace:
    """Memory for the largest temporaries, used again for each block: :data:`_BLOCK` numbers for each thread that adds.

    The C library hands the memory of each block back to the system, and faulting
    it in again for the next took up to half of the time.
    """

    def __init__(self) -> None:
        self._free: list[Array] = []

    @contextmanager
    def room(self, shape: tuple[int, ...], order: Literal["C", "F"] = "C") -> Iterator[Array]:
        """An array to write to, of any content; not to be kept."""
        numbers = int(np.prod(shape))
        try:
            memory = self._free.pop()
        except IndexError:  # as many threads as there are pieces
            memory = np.empty(0)
        if memory.size < numbers:
            memory = np.empty(numbers)
        try:
            yield memory[:numbers].reshape(shape, order=order)
        finally:
            self._free.append(memory)


_WORKSPACE = _Workspace()


def _products_of_one(
    xp: Any, features: Array, directions: Array, moving: NDArray[np.bool_], weights: Array
) -> list[Array]:
    """Products from which those of each metric follow (:func:`_by_metric`), for one model, each (p, p).

    With ``F_k = diag(√w û_k) φ`` they are ``Σ w φφᵀ``, ``F_kᵀF_k`` for each k, and ``(F_k + F_m)ᵀ(F_k + F_m)`` for each
    k < m: all of a matrix with its own transpose, which BLAS does at half the price. One ``F_kᵀF_k`` follows from the
    others, since ``Σ û_k² = 1``.
    """
    root = xp.sqrt(weights)
    pointed = directions * root
    resting: Array | float = 0.0
    if not xp.all(moving):
        still, moves = xp.nonzero(~moving)[0], xp.nonzero(moving)[0]
        resting = _gram(xp.take(features, still, axis=0) * xp.take(root, still, axis=0))
        features, root, pointed = (xp.take(part, moves, axis=0) for part in (features, root, pointed))
    whole = _gram(features) if xp.all(root == 1.0) else _scaled_gram(features, root)
    largest = int(xp.argmax(xp.sum(pointed**2, axis=0)))  # subtracting for a small one would leave rounding
    d = pointed.shape[1]
    own = {k: _scaled_gram(features, pointed[:, k, None]) for k in range(d) if k != largest}
    own[largest] = reduce(sub, own.values(), whole) if d > 1 else whole + 0.0
    pairs = (pointed[:, k, None] + pointed[:, m, None] for k, m in combinations(range(d), 2))
    both = [_scaled_gram(features, pair) for pair in pairs]
    return [whole + resting, *(own[k] for k in range(d)), *both]


def _by_metric(products: list[Array], d: int) -> list[Array]:
    """``Σ w φφᵀ`` for the metrics 1 and û_k û_m (k ≤ m)."""
    # ``(F_k + F_m)ᵀ(F_k + F_m) = F_kᵀF_k + F_mᵀF_m + 2 F_kᵀF_m``, since F_kᵀF_m is symmetric.
    own = products[1 : d + 1]
    both = dict(zip(combinations(range(d), 2), products[d + 1 :], strict=True))
    pairs = combinations_with_replacement(range(d), 2)
    return [products[0], *(own[k] if k == m else 0.5 * (both[k, m] - own[k] - own[m]) for k, m in pairs)]


def _gram(table: Array) -> Array:
    return table.T @ table


def _scaled_gram(table: Array, factors: Array) -> Array:
    """Gram matrix of a table (N, p) whose rows are multiplied by some factors (N, 1)."""
    if is_foreign(table):
        return _gram(table * factors)
    with _WORKSPACE.room(table.shape, "F" if table.flags.f_contiguous else "C") as room:
        return _gram(np.multiply(table, factors, out=room))


def _metrics(xp: Any, features: Array, directions: Array) -> tuple[Array, Array]:
    """Metrics of each sample, 1 first, and half of its φφᵀ: (N, metrics) and (N, p (p + 1) / 2)."""
    half, other = _halves(xp, directions), _halves(xp, features)
    return xp.concat([xp.ones_like(half[:, :1]), half], axis=1), other


def _halves(xp: Any, table: Array) -> Array:
    """Products of the columns, each pair once."""
    first, second = (beside(index, table) for index in _pairs(table.shape[1]))
    halves: Array = xp.take(table, first, axis=1) * xp.take(table, second, axis=1)
    return halves


def _sum_of_each_with_each(weights: Array, first: Array, second: Array) -> Array:
    """Weighted sums (M, a b) of the products of each column of one table (N, a) with each of another (N, b)."""
    shape = first.shape[0], first.shape[1] * second.shape[1]
    left, right = first[:, :, None], second[:, None, :]
    if is_foreign(first):
        return weights.T @ namespace(first).reshape(left * right, shape)
    with _WORKSPACE.room(shape) as room:
        np.multiply(left, right, out=room.reshape(shape[0], first.shape[1], second.shape[1]))
        return weights.T @ room


@lru_cache(maxsize=8)  # a fit asks for those of its sizes a hundred times
def _pairs(size: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs k ≤ m; not to be changed."""
    return np.triu_indices(size)


@lru_cache(maxsize=8)
def _places(size: int) -> NDArray[np.intp]:
    """Where each entry of a symmetric matrix is among its pairs k ≤ m, row by row; not to be changed."""
    places = np.zeros((size, size), dtype=np.intp)
    row, column = _pairs(size)
    places[row, column] = places[column, row] = np.arange(len(row))
    return places

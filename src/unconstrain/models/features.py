"""Feature maps: states (N, n) to features (N, p).

A feature map is any callable on a table of states. One whose parameters depend on the data also has ``place(states)``,
which returns the map to use; a policy calls it once, on the first batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations_with_replacement
from math import comb
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.arrays import SMALLEST_VARIANCE, Array, as_matrix, beside, check_at_least, namespace
from ..base.display import Shown, counted
from ..base.errors import InvalidDataError, SettingError
from ..base.parameters import Parameters
from .formula import ClosedForm, exponents

_LEAST_SPREAD = 1e10 * np.sqrt(SMALLEST_VARIANCE)
"""States that spread less count as one: centres placed among them may be a millionth of this apart."""

MOST_MONOMIALS = 2000
"""Most features of a polynomial: the sums of their products are then 32 MB for each pair of actions and each fold."""


class FeatureMap(Protocol):
    """A callable from states to features, possibly called by several threads at once."""

    def __call__(self, states: Array, /) -> Array:
        """Compute features (N, p) of states (N, n)."""
        ...


@runtime_checkable
class Placeable(Protocol):
    """Features whose parameters depend on the data."""

    def place(self, states: Array, /) -> FeatureMap:
        """Return the feature map to use from now on."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Affine(Shown):
    """Globally linear features ``x̄ = (x, 1)`` (section III-C).

    Parameters
    ----------
    centre, scale : float or array_like, shape (n,)
        The features are ``((x − centre) / scale, 1)``. The functions they span
        do not depend on either; the condition of the solution does.

    Examples
    --------
    >>> uc.Affine()(np.array([[2.0, 3.0]]))
    array([[2., 3., 1.]])
    """

    centre: Array | float = 0.0
    scale: Array | float = 1.0

    def __call__(self, states: Array) -> Array:
        """Compute features (N, n + 1) of states (N, n)."""
        xp = namespace(states)
        centre, scale = (beside(np.asarray(part, np.float64), states) for part in (self.centre, self.scale))
        scaled = (states - centre) / scale
        return xp.concat([scaled, xp.ones_like(scaled[:, :1])], axis=1)

    def closed_form(self, weights: Array) -> ClosedForm:
        """Closed form of the policy ``W φ(x)`` with weights (d, n + 1)."""
        n = weights.shape[1] - 1
        scale = np.broadcast_to(np.asarray(self.scale, np.float64), n)
        maps = np.column_stack([weights[:, :n] / scale, weights[:, n]])
        return ClosedForm(np.broadcast_to(np.asarray(self.centre, np.float64), n), maps[None], None, 3 * np.abs(scale))

    def place(self, states: Array) -> Affine:
        """Centre and scale on the data, unless centre or scale were given."""
        if np.any(self.centre != 0.0) or np.any(self.scale != 1.0):
            return self
        centre = states.mean(axis=0)
        spread = np.sqrt(((states - centre) ** 2).mean(axis=0))
        # The spread of a constant coordinate is rounding only; dividing by it would amplify that.
        still = spread <= np.maximum(1e-12 * np.abs(states).max(axis=0, initial=0.0), _LEAST_SPREAD)
        return replace(self, centre=centre, scale=np.where(still, 1.0, spread))

    def _summary(self) -> tuple[str, ...]:
        n = max(np.size(self.centre), np.size(self.scale))
        return () if n == 1 else (f"centred and scaled in {counted(n, 'dimension')}",)


@dataclass(frozen=True, eq=False, repr=False)
class Polynomial(Shown, Parameters):
    """Monomials of the states up to a degree: products of so many entries of :class:`Affine` features ``(x, 1)``.

    They come in lexicographic order, for two states and degree 2 as
    ``(x₁², x₁x₂, x₁, x₂², x₂, 1)``; those of degree 1 are the affine features.

    Parameters
    ----------
    degree : int
    centre, scale : float or array_like, shape (n,)
        The monomials are those of ``(x − centre) / scale``. The functions they
        span do not depend on either; the condition of the solution does.

    Raises
    ------
    SettingError
        If the degree is no whole number above zero, or states have more than :data:`MOST_MONOMIALS` monomials.

    Examples
    --------
    >>> uc.Polynomial(2)(np.array([[2.0, 3.0]]))
    array([[4., 6., 2., 9., 3., 1.]])
    """

    degree: int = 2
    centre: Array | float = 0.0
    scale: Array | float = 1.0

    def __post_init__(self) -> None:
        check_at_least("degree", self.degree, 1, whole=True)

    def __call__(self, states: Array) -> Array:
        """Compute features (N, p) of states (N, n), ``p = (n + degree)! / n! degree!``."""
        xp, factors = namespace(states), self._affine(states).T
        first, *others = (beside(place, states) for place in self._monomials(states.shape[1]).T)
        products = xp.take(factors, first, axis=0)  # (p, N): sums over monomials then run along rows
        for place in others:
            products *= xp.take(factors, place, axis=0)
        return products.T

    def closed_form(self, weights: Array) -> ClosedForm:
        """Closed form of the policy ``W φ(x)`` with weights (d, p)."""
        n = next(n for n in range(weights.shape[1]) if comb(n + self.degree, n) == weights.shape[1])
        affine, monomials = self._affine.closed_form(np.ones((1, n + 1))), self._monomials(n)
        return replace(affine, maps=weights * affine.maps[:, :, monomials].prod(axis=3), monomials=monomials)

    def place(self, states: Array) -> Polynomial:
        """Centre and scale on the data, unless centre or scale were given."""
        placed = self._affine.place(states)
        return replace(self, centre=placed.centre, scale=placed.scale)

    @property
    def _affine(self) -> Affine:
        return Affine(self.centre, self.scale)

    def _monomials(self, n: int) -> NDArray[np.intp]:
        """Which of the n + 1 affine features each monomial multiplies, shape (p, degree)."""
        if comb(n + self.degree, n) > MOST_MONOMIALS:
            raise SettingError(
                f"degree: got {self.degree} for states of {counted(n, 'column')}, which have more than "
                f"{MOST_MONOMIALS} monomials. Take a lower degree, fewer columns, or a LocallyLinearPolicy."
            )
        return np.array(list(combinations_with_replacement(range(n + 1), self.degree)), np.intp)

    def _summary(self) -> tuple[str, ...]:
        return f"degree={self.degree}", *self._affine._summary()


@dataclass(frozen=True, eq=False, repr=False)
class Kernels(Shown):
    """Isotropic Gaussian kernels ``exp(−‖x − c‖² / 2σ²)`` of one variance σ² about some centres."""

    centres: Array
    variance: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centres", as_matrix(self.centres, "centres"))
        check_at_least("variance", self.variance, SMALLEST_VARIANCE, strict=True)

    def support(self, states: Array) -> Array:
        """Kernel of the nearest centre, from 1 at it to 0 far from all, shape (N,)."""
        distances = squared_distances(states, self.centres)
        return gaussian(namespace(distances).min(distances, axis=1), self.variance)

    def blend_of(self, origin: Array, maps: Array) -> ClosedForm:
        """Closed form of maps, one for each kernel, that are blended by these; or of one map in their midst."""
        reach = np.abs(self.centres - origin).max(axis=0) + np.sqrt(self.variance)
        slopes = exponents(self.centres, self.variance, origin)
        return ClosedForm(origin, maps, slopes, reach, precisions=np.full(len(origin), 1.0 / self.variance))

    def _summary(self) -> tuple[str, ...]:
        centres, n = self.centres.shape
        return f"{counted(centres, 'centre')} in {counted(n, 'dimension')}", f"variance={self.variance:.4g}"


class NormalisedRBF(Kernels):
    """Gaussian kernels normalised to sum to one at each state (section III-C).

    ``b_i(x) = K(x − c_i) / Σ_j K(x − c_j)`` with ``K(δ) = exp(−‖δ‖² / 2σ²)``. Computed by log-sum-exp: far from all
    centres the nearest kernel has a share of one, and nothing overflows.

    Parameters
    ----------
    centres : array_like, shape (p, n)
    variance : float
        The kernels' σ², in squared units of the state.

    Raises
    ------
    InvalidDataError, SettingError
        If the centres are no finite table or the variance is not positive.

    Examples
    --------
    >>> grid = uc.NormalisedRBF.grid(-1, 1, 3)
    >>> grid
    NormalisedRBF(9 centres in 2 dimensions, variance=1)
    >>> grid(np.array([[0.3, 0.1]])).sum().round(6)
    np.float64(1.0)
    """

    def __call__(self, states: Array) -> Array:
        """Compute features (N, p) of states (N, n); each row sums to one."""
        if len(self._ticks) < 2:
            return shares(states, self.centres, self.variance)
        # On a grid kernels and their sums factorise over the axes, which takes fewer exponentials.
        _check_columns(states, self.centres)
        xp = namespace(states)
        product, *others = (
            shares(states[:, axis : axis + 1], ticks[:, None], self.variance).T
            for axis, ticks in enumerate(self._ticks)
        )
        for along in others:
            product = xp.reshape(product[:, None, :] * along[None, :, :], (-1, states.shape[0]))
        return product.T

    @cached_property
    def _ticks(self) -> list[Array]:
        """Coordinates of the centres along each axis, if they are all points of a grid; else empty."""
        ticks = [np.unique(column) for column in self.centres.T]
        if np.prod([len(each) for each in ticks], dtype=float) != len(self.centres):
            return []
        return ticks if np.array_equal(_grid(ticks), self.centres) else []

    def closed_form(self, weights: Array) -> ClosedForm:
        """Closed form of the policy ``W φ(x)`` with weights (d, p)."""
        return self.blend_of(self.centres.mean(axis=0), weights.T[:, :, None])

    def roughness(self) -> Array:
        """Roughness matrix R of the kernels' weights, shape (p, p).

        ``wᵀ R w`` is the mean square, over the kernels, of the residual of each weight from a local affine fit to its
        neighbours' weights. It is zero for weights that are affine in the centres. This is the analogue, for kernels
        at any place, of the second-difference penalty of P-splines [1]_.

        References
        ----------
        .. [1] P. H. C. Eilers and B. D. Marx. Flexible smoothing with B-splines and penalties. *Statistical Science*
           11(2), 1996.
        """
        count, n = self.centres.shape
        squared = squared_distances(self.centres, self.centres)
        np.fill_diagonal(squared, np.inf)
        near = np.sort(squared, axis=1)[:, : min(2 * n, count - 1)].mean() if count > n + 1 else 0.0
        if not near > 0.0:
            return np.zeros((count, count))
        weights = np.exp(-0.5 * squared / near)  # of kernel j in the local fit at kernel i, zero for i itself
        apart = (self.centres - self.centres[:, None]) / np.sqrt(near)
        affine = np.concatenate([np.ones((count, count, 1)), apart], axis=2)
        weighted = weights[:, None, :] * affine.mT
        normal = weighted @ affine
        normal += 1e-6 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(n + 1)
        missed = np.eye(count) - np.linalg.solve(normal, weighted)[:, 0]
        return missed.T @ missed / count

    @classmethod
    def grid(
        cls,
        low: float | ArrayLike,
        high: float | ArrayLike,
        per_axis: int | Sequence[int],
        *,
        width: float = 1.0,
        dimensions: int = 2,
    ) -> NormalisedRBF:
        """Place the centres on a regular grid.

        Parameters
        ----------
        low, high : float or array_like, shape (n,)
            Corners of the grid. A number serves every axis.
        per_axis : int or sequence of int
            Centres along each axis, at least two.
        width : float
            The kernels' σ as a multiple of the (mean) grid spacing.
        dimensions : int
            Number of axes, where all of the above are numbers.

        Raises
        ------
        SettingError
            If there are fewer than two centres on an axis or ``low`` is not below ``high``.
        """
        told = max(np.size(low), np.size(high), np.size(per_axis))
        axes = told if told > 1 else dimensions
        try:
            lows, highs, counts = (np.broadcast_to(np.asarray(v, np.float64), (axes,)) for v in (low, high, per_axis))
        except ValueError as error:
            raise SettingError(
                f"grid: low, high and per_axis have {np.size(low)}, {np.size(high)} and {np.size(per_axis)} values, "
                "expected one number each or the same number for every axis."
            ) from error
        if (counts < 2).any() or (counts % 1 != 0).any() or not (lows < highs).all():
            raise SettingError(
                f"grid: got low={low!r}, high={high!r}, per_axis={per_axis!r}; "
                "expected low < high and a whole number of at least two centres."
            )
        check_at_least("width", width, 0.0, strict=True)
        ticks = [np.linspace(lo, hi, int(count)) for lo, hi, count in zip(lows, highs, counts, strict=True)]
        spacing = np.mean([tick[1] - tick[0] for tick in ticks])
        return cls(_grid(ticks), float((width * spacing) ** 2))

    @classmethod
    def kmeans(cls, states: Array, count: int = 25, *, width: float = 1.0, seed: int = 0) -> NormalisedRBF:
        """Place the centres by k-means on the states.

        Parameters
        ----------
        states : array_like, shape (N, n)
        count : int
            Number of centres; fewer where there are fewer different states.
        width : float
            The kernels' σ as a multiple of the mean distance from a centre to its nearest neighbour.
        seed : int
            Seed of k-means.
        """
        from sklearn.cluster import KMeans

        check_at_least("count", count, 1, whole=True)
        check_at_least("width", width, 0.0, strict=True)
        table = as_matrix(states, "states")
        middle = table.mean(axis=0)
        unit = float(np.abs(table - middle).max())
        if unit <= max(1e-12 * np.abs(table).max(), _LEAST_SPREAD):
            return cls(table[:1], 1.0)
        # To a millionth: states that differ by rounding must not count as different.
        scaled = np.round((table - middle) / unit, 6) + 0.0
        count = min(count, len(np.unique(scaled, axis=0)))
        found = KMeans(count, n_init=4, random_state=seed).fit(scaled).cluster_centers_
        distances = squared_distances(found, found)
        np.fill_diagonal(distances, np.inf)
        spacing = np.mean(np.sqrt(distances.min(axis=1))) if count > 1 else 1.0
        centres = np.clip(middle + unit * found, table.min(axis=0), table.max(axis=0))  # rounding may put them outside
        return cls(centres, float((width * spacing * unit) ** 2))


@dataclass(frozen=True)
class KMeansRBF(Parameters):
    """Normalised RBFs with centres by k-means on the first batch.

    Parameters
    ----------
    count : int
        Number of centres; never more than one for each four states.
    width : float
        See :meth:`NormalisedRBF.kmeans`.
    seed : int
        Seed of k-means.

    Examples
    --------
    >>> uc.KMeansRBF(3).place(np.random.default_rng(0).normal(size=(100, 2))).centres.shape
    (3, 2)
    """

    count: int = 25
    width: float = 1.0
    seed: int = field(default=0)

    def place(self, states: Array) -> NormalisedRBF:
        """Place the centres on states (N, n)."""
        count = max(1, min(self.count, len(states) // 4))
        return NormalisedRBF.kmeans(states, count, width=self.width, seed=self.seed)


def gaussian(squared: Array, variance: float) -> Array:
    """Gaussian kernel ``exp(−δ² / 2σ²)`` of squared distances."""
    with np.errstate(over="ignore"):  # to −inf: a kernel of zero
        exponents = squared * (-0.5 / variance)
    weights: Array = namespace(exponents).exp(exponents)
    return weights


def squared_distances(states: Array, centres: Array) -> Array:
    """Squared Euclidean distances, shape (N, M), without forming (N, M, n).

    Both are taken relative to the centres' mean, so that a large common offset costs no digits.
    """
    near, far = _apart(states, centres)
    xp = namespace(near)
    squared = -2.0 * (far @ near.T)  # (M, N): sums over centres then run along rows
    squared += xp.sum(near * near, axis=1)
    squared += xp.sum(far * far, axis=1)[:, None]
    nearest: Array = xp.clip(squared, 0.0, None).T
    return nearest


def shares(states: Array, centres: Array, variance: float) -> Array:
    """Gaussian kernels normalised to sum to one at each state, by log-sum-exp, shape (N, M)."""
    # ‖x‖² is common to all centres and cancels; leaving it out keeps far states exact.
    near, far = _apart(states, centres)
    xp = namespace(near)
    exponents = far @ near.T  # (M, N): sums over centres then run along rows
    exponents -= 0.5 * xp.sum(far * far, axis=1)[:, None]
    exponents -= xp.max(exponents, axis=0)
    with np.errstate(over="ignore"):  # to −inf: a share of zero
        exponents *= 1.0 / variance
    weights: Array = xp.exp(exponents)
    weights *= 1.0 / xp.sum(weights, axis=0)
    return weights.T


def _grid(ticks: Sequence[Array]) -> Array:
    """All points of a grid, the last axis varying fastest."""
    return np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, len(ticks))


def _apart(states: Array, centres: Array) -> tuple[Array, Array]:
    """States and centres relative to the centres' mean."""
    _check_columns(states, centres)
    origin = centres.mean(axis=0)
    return states - beside(origin, states), beside(centres - origin, states)


def _check_columns(states: Array, centres: Array) -> None:
    if states.shape[1] != centres.shape[1]:
        raise InvalidDataError(
            f"states: got {states.shape[1]} columns, expected {centres.shape[1]} as the centres have."
        )

"""Quadratic objectives, and solving them in order of importance.

Everything here has a leading axis of M independent problems.

The derivation of :func:`lexicographic_path`, for one problem. Let
``H = V Λ Vᵀ`` with ascending eigenvalues, ``a = Vᵀ g``, ``c = Λ⁻¹ a``,
``B = Vᵀ M V`` and ``b = Vᵀ m``. When the k smallest eigenvalues count as
undetermined, V₂ is the first k columns of V and eqs 7–13 read, in the
coordinates of V,

    w₁ = (0, c[k:])                                                    (7)
    z  = B[:k, :k]⁻¹ (b[:k] − B[:k, k:] c[k:])                         (12)
    w  = (z, c[k:])                                                    (13)

V₂ for a larger threshold contains V₂ for a smaller one, so ``B[:k, :k]`` is
a leading block of one matrix: with ``B = L Lᵀ`` its factor is the leading
block of L for *every* k. And because L is lower triangular, its leading
block is applied to a vector by applying L to the vector padded with zeros.
So all k are solved together by two triangular solves with P + 1 columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from .arrays import Array

__all__ = [
    "NOISE",
    "SECONDARY_NOISE",
    "Path",
    "Quadratic",
    "eigensystem",
    "lexicographic_path",
    "minimum",
    "softened_minima",
]

NOISE = 1e-10
"""Eigenvalues of the first objective below this share of the largest are rounding."""

SECONDARY_NOISE = 1e-12
"""The same for the second objective."""

UNDERFLOW = 1e-290
"""A Hessian whose largest eigenvalue is below this is zero: its smaller ones have lost their digits."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """M functions ``f(w) = constant − 2 linearᵀw + wᵀ hessian w``.

    Parameters
    ----------
    hessian : ndarray, shape (M, P, P)
        Symmetric, positive semidefinite; half the matrix of second derivatives.
    linear : ndarray, shape (M, P)
    constant : ndarray, shape (M,)
    """

    hessian: Array
    linear: Array
    constant: Array

    def __call__(self, weights: Array) -> Array:
        """Evaluate at ``weights``, shape (M, P) or, for K candidates each, (M, P, K).

        Returns
        -------
        ndarray, shape (M,) or (M, K)
            Not below zero: what rounding leaves there is cut off.
        """
        many = weights if weights.ndim == 3 else weights[..., None]
        with np.errstate(over="ignore", invalid="ignore"):  # overflow is for the caller to see, as inf
            bent = self.hessian @ many - 2.0 * self.linear[..., None]
            values = self.constant[:, None] + np.einsum("mpk,mpk->mk", many, bent)
        values = np.where(np.isfinite(values), np.maximum(values, 0.0), np.inf)
        return values if weights.ndim == 3 else values[:, 0]

    def __add__(self, other: Quadratic) -> Quadratic:
        """Add, problem by problem."""
        return Quadratic(self.hessian + other.hessian, self.linear + other.linear, self.constant + other.constant)

    def __mul__(self, factor: float) -> Quadratic:
        """Scale by a positive number."""
        return Quadratic(factor * self.hessian, factor * self.linear, factor * self.constant)

    __rmul__ = __mul__


@dataclass(frozen=True, eq=False)
class Path:
    """The minimum for every split of the eigenvectors.

    Parameters
    ----------
    eigenvalues : ndarray, shape (M, P)
        Of the first objective's Hessian, ascending.
    weights : ndarray, shape (M, P, P + 1)
        ``weights[m, :, k]`` solves problem m when its k smallest eigenvalues
        count as undetermined.
    lowest : ndarray of int, shape (M,)
        Splits below this one would divide by rounding noise; there the path
        repeats the solution at this one.
    """

    eigenvalues: Array
    weights: Array
    lowest: NDArray[np.intp]

    def at(self, splits: NDArray[np.intp]) -> Array:
        """Weights at one split for each problem, shape (M, P)."""
        chosen = np.broadcast_to(np.asarray(splits)[:, None, None], (*self.weights.shape[:2], 1))
        return np.take_along_axis(self.weights, chosen, axis=2)[..., 0]

    def threshold(self, splits: NDArray[np.intp]) -> Array:
        """The λ_t of eq. 7 at a split, as a share of the largest eigenvalue, shape (M,).

        The largest eigenvalue that counts as undetermined, or 0 if none does.
        """
        below = np.take_along_axis(self.eigenvalues, np.maximum(splits - 1, 0)[:, None], axis=1)[:, 0]
        largest = self.eigenvalues[:, -1]
        return np.where((splits > 0) & (largest > 0), below / np.where(largest > 0, largest, 1.0), 0.0)

    def split(self, threshold: float) -> NDArray[np.intp]:
        """How many eigenvalues do not exceed ``threshold`` times the largest, shape (M,)."""
        count = (self.eigenvalues <= threshold * self.eigenvalues[:, -1:]).sum(axis=1)
        return np.maximum(count, self.lowest)


def lexicographic_path(first: Quadratic, second: Quadratic | None = None) -> Path:
    """Minimise ``first``, then ``second`` in the directions that it leaves undetermined.

    Exact for all P + 1 splits at the price of one factorisation (see above).

    Parameters
    ----------
    first : Quadratic
        Its eigenvectors are split (eq. 7).
    second : Quadratic, optional
        Minimised over the rest (eqs 8–13). Without it the undetermined
        directions stay zero: the truncated pseudo-inverse.

    Returns
    -------
    Path
    """
    eigenvalues, vectors = eigensystem(first.hessian)
    size = eigenvalues.shape[1]
    largest = eigenvalues[:, -1:]
    noise = (eigenvalues <= NOISE * largest) | (largest <= UNDERFLOW)
    lowest = noise.sum(axis=1)
    determined = _across(vectors, first.linear) / np.where(noise, 1.0, eigenvalues)

    splits = np.maximum(np.arange(size + 1), lowest[:, None])  # (M, P + 1)
    undetermined = np.arange(size)[:, None] < splits[:, None, :]  # (M, P, P + 1)
    coordinates = np.where(undetermined, 0.0, determined[..., None])
    if second is not None:
        coordinates += _fill(second, vectors, coordinates, undetermined)
    return Path(eigenvalues, vectors @ coordinates, lowest)


def minimum(objective: Quadratic) -> Array:
    """Minimise one objective alone, shape (M, P); of least norm where it is not unique."""
    size = objective.linear.shape[1]
    lower, _ = _factor(objective.hessian, np.broadcast_to(np.eye(size), objective.hessian.shape))
    return _solve_lower(lower, _solve_lower(lower, objective.linear), transposed=True)


def softened_minima(first: Quadratic, second: Quadratic, softnesses: Sequence[float]) -> Array:
    """Minimise ``first + s second`` for each s, at the price of one factorisation, shape (M, P, K).

    With ``second.hessian = L Lᵀ`` and ``L⁻¹ first.hessian L⁻ᵀ = Q Λ Qᵀ`` every
    minimum is ``L⁻ᵀ Q (Λ + s)⁻¹ Qᵀ L⁻¹ (linear₁ + s linear₂)``.
    """
    size = first.linear.shape[1]
    lower, _ = _factor(second.hessian, np.broadcast_to(np.eye(size), second.hessian.shape))
    half = _solve_lower(lower, first.hessian)
    eigenvalues, vectors = eigensystem(_solve_lower(lower, half.swapaxes(-1, -2)))
    along, beside = (_across(vectors, _solve_lower(lower, one.linear)) for one in (first, second))
    shares = np.asarray(softnesses)
    scaled = (along[..., None] + shares * beside[..., None]) / (np.maximum(eigenvalues, 0.0)[..., None] + shares)
    return _solve_lower(lower, vectors @ scaled, transposed=True)


def eigensystem(hessian: Array) -> tuple[Array, Array]:
    """Eigenvalues (M, P), ascending, and eigenvectors (M, P, P) of symmetric matrices.

    Scaled to one, and without what is too small to matter: LAPACK gives up
    on some matrices whose entries span hundreds of orders of magnitude.
    """
    size = np.abs(hessian).max(axis=(-2, -1), keepdims=True)
    unit = np.where(size > UNDERFLOW, size, 1.0)
    scaled = hessian / unit
    eigenvalues, vectors = np.linalg.eigh(np.where(np.abs(scaled) > 1e-60, scaled, 0.0))
    return eigenvalues * unit[..., 0], vectors


def _fill(second: Quadratic, vectors: Array, coordinates: Array, undetermined: NDArray[np.bool_]) -> Array:
    """The z of eq. 12 for every split, padded with zeros, shape (M, P, P + 1)."""
    lower, metric = _factor(second.hessian, vectors)
    gap = _across(vectors, second.linear)[..., None] - metric @ coordinates
    reduced = np.where(undetermined, _solve_lower(lower, gap), 0.0)
    return _solve_lower(lower, reduced, transposed=True)


def _factor(hessian: Array, vectors: Array) -> tuple[Array, Array]:
    """Cholesky factor of ``Vᵀ M V``, and that matrix, both (M, P, P).

    Where M is singular, its null directions are given the weight of its
    largest eigenvalue first. The linear term has no part in them, so they
    stay zero, which is the solution of least norm. An M that is nothing but
    underflow, as of a field that no sample is near, counts as zero.
    """
    metric = np.swapaxes(vectors, -1, -2) @ hessian @ vectors
    try:
        lower: Array = np.linalg.cholesky(metric).astype(np.float64, copy=False)
        pivots = np.diagonal(lower, axis1=-2, axis2=-1) ** 2
        if (pivots.min(axis=-1) > SECONDARY_NOISE * pivots.max(axis=-1)).all():
            return lower, metric
    except np.linalg.LinAlgError:
        pass
    eigenvalues, axes = eigensystem(hessian)
    largest = eigenvalues[:, -1:]
    floored = np.where(eigenvalues > SECONDARY_NOISE * largest, eigenvalues, largest)
    floored = np.where(largest > UNDERFLOW, floored, 1.0)
    rotated = np.swapaxes(axes, -1, -2) @ vectors
    metric = np.swapaxes(rotated, -1, -2) @ (floored[..., None] * rotated)
    return np.linalg.cholesky(metric).astype(np.float64, copy=False), metric


def _across(vectors: Array, vector: Array) -> Array:
    """``Vᵀ g`` for each problem, shape (M, P)."""
    return np.einsum("mpq,mp->mq", vectors, vector)


def _solve_lower(lower: Array, right: Array, *, transposed: bool = False) -> Array:
    """Solve ``L y = r`` or ``Lᵀ y = r`` for each problem."""
    trans = "T" if transposed else "N"
    return np.stack(
        [
            solve_triangular(factor, side, lower=True, trans=trans, check_finite=False)
            for factor, side in zip(lower, right, strict=True)
        ]
    )

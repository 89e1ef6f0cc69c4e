"""Quadratic objectives, and solving them in order of importance.

Everything here has a leading axis of M independent problems.

The derivation of :func:`lexicographic_path`, for one problem. Let ``H = V Λ Vᵀ`` with ascending eigenvalues, and let V₂
be the first k columns of V: the directions that count as undetermined. Eqs 7–13 ask for the minimum of the second
objective over all w that agree with ``Λ⁻¹ Vᵀ g`` along the other columns.

With ``Vᵀ M V = L Lᵀ`` (Cholesky) the columns of ``A = V L⁻ᵀ`` are the eigenvectors, made orthonormal in the metric of
the second objective one after the other, the smallest eigenvalue first. L is lower triangular, so

- the first k columns of A span what those of V span, for *every* k, and
- of ``w = A s`` the entries of s from k on depend on the columns of V from k
  on alone: they are those of ``γ = Lᵀ Λ⁻¹ Vᵀ g`` (eq. 7), whatever k is.

In these coordinates the second objective is ``‖s‖² − 2 sᵀβ`` with ``β = Aᵀ m = L⁻¹ Vᵀ m``. It falls apart into its
entries; the free ones, below k, are those of β (eq. 12). So the solution at split k is

    s = (β[:k], γ[k:])                                                (13)

and the solutions at all splits are sums from the left of ``A diag(β)`` and
from the right of ``A diag(γ)``: one factorisation, and P numbers for each.

An eigenvalue below rounding says that a direction is undetermined only where the features are independent. Where they
nearly depend on each other, both matrices are as small along it, and the second objective knows no better. There the
smallest split is made in features made orthonormal by the second objective: with ``M = E Λ Eᵀ``, ``W = E Λ^-½`` over
the eigenvalues above rounding, and ``Wᵀ H W = Y diag(μ) Yᵀ``, the columns of ``W Y`` are orthonormal in M, a share μ of
each is determined, and

    w = W Y s,   s_i = (Yᵀ Wᵀ g)_i / μ_i  where μ_i > 0,  (Yᵀ Wᵀ m)_i  elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrsm

from ..base.arrays import Array, is_foreign, namespace
from ..base.display import Shown, counted

NOISE = 1e-10
"""Eigenvalues of the first objective below this share of the largest are rounding."""

SECONDARY_NOISE = 1e-12
"""The same for the second objective."""

DEPENDENT = 1e-14
"""Features of which a combination has less than this share of the largest mean square are dependent to rounding."""

UNDETERMINED = 1e-6
"""Shares of the second objective's curvature below this are rounding, where features nearly depend on each other.

On the policy demonstration of CCL, wide kernels and random constraints without noise, nUPE of the hybrid was 1e-8 to
2e-5 with :data:`DEPENDENT` at 1e-12, and 3e-10 to 4e-6 at 1e-14; it was 1e-2 without. At 5 % noise both gave the same.
"""

UNDERFLOW = 1e-290
"""A Hessian whose largest eigenvalue is below this is zero: its smaller ones have lost their digits."""


@dataclass(frozen=True, eq=False, repr=False)
class Quadratic(Shown):
    """M functions ``f(w) = constant − 2 linearᵀw + wᵀ hessian w``.

    Parameters
    ----------
    hessian : ndarray, shape (M, P, P)
        Symmetric, positive semidefinite; half the matrix of second derivatives.
    linear : ndarray, shape (M, P)
    constant : ndarray, shape (M,)
    gram : ndarray, shape (M, p, p), optional
        Where the Hessian is ``gram ⊗ I``; makes products with it cheaper.

    Examples
    --------
    >>> square = uc.Quadratic(hessian=np.eye(1)[None], linear=np.array([[3.0]]), constant=np.array([9.0]))
    >>> square(np.array([[3.0]]))  # (w − 3)²
    array([0.])
    """

    hessian: Array
    linear: Array
    constant: Array
    gram: Array | None = None

    def __call__(self, weights: Array) -> Array:
        """Evaluate at ``weights``, shape (M, P) or, for K candidates each, (M, P, K).

        Returns
        -------
        ndarray, shape (M,) or (M, K)
            Negative by rounding, or where the objective is, as with noise-corrected moments; NaN or infinite on
            overflow.
        """
        xp = namespace(weights)
        many = weights if weights.ndim == 3 else weights[..., None]
        with np.errstate(over="ignore", invalid="ignore"):  # the caller sees overflow in the values
            bent = self.hessian @ many
            bent -= 2.0 * self.linear[..., None]
            bent *= many
            values = self.constant[:, None] + xp.sum(bent, axis=1)
        return values if weights.ndim == 3 else values[:, 0]

    __array_ufunc__ = None  # so that array * quadratic calls __rmul__

    def __add__(self, other: Quadratic) -> Quadratic:
        """Add, problem by problem."""
        gram = None if self.gram is None or other.gram is None else self.gram + other.gram
        return Quadratic(self.hessian + other.hessian, self.linear + other.linear, self.constant + other.constant, gram)

    def __mul__(self, factor: float | Array) -> Quadratic:
        """Scale all problems by one number that is not negative, or each by its own, shape (M,)."""
        xp = namespace(self.hessian)
        each = xp.reshape(xp.asarray(factor, dtype=self.hessian.dtype, device=self.hessian.device), (-1, 1))
        gram = None if self.gram is None else each[..., None] * self.gram
        return Quadratic(each[..., None] * self.hessian, each * self.linear, each[:, 0] * self.constant, gram)

    __rmul__ = __mul__

    def times(self, vectors: Array) -> Array:
        """``hessian @ vectors`` for columns of shape (M, P, K)."""
        if self.gram is None:
            return self.hessian @ vectors
        xp = namespace(vectors)
        models, size = self.gram.shape[:2]
        product: Array = xp.reshape(self.gram @ xp.reshape(vectors, (models, size, -1)), vectors.shape)
        return product

    def _summary(self) -> tuple[str, ...]:
        models, weights = self.linear.shape
        return counted(models, "problem"), counted(weights, "weight")


@dataclass(frozen=True, eq=False)
class Path:
    """The minimum for every split of the eigenvectors.

    Parameters
    ----------
    eigenvalues : ndarray, shape (M, P)
        Of the first objective's Hessian, ascending.
    lowest : ndarray of int, shape (M,)
        Splits below this one would divide by rounding errors; there the path repeats the solution at this one.
    basis : ndarray, shape (M, P, P)
        The A of the derivation above.
    undetermined, determined : ndarray, shape (M, P)
        Its β and γ.
    finest : ndarray, shape (M, P)
        The solution at the lowest split and below.
    """

    eigenvalues: Array
    lowest: NDArray[np.intp]
    basis: Array
    undetermined: Array
    determined: Array
    finest: Array

    @cached_property
    def weights(self) -> Array:
        """Weights at every split, shape (M, P, P + 1).

        ``weights[m, :, k]`` solves problem m when its k smallest eigenvalues count as undetermined.
        """
        xp = namespace(self.basis)
        left = _running(self.basis * self.undetermined[:, None, :])
        right = xp.flip(_running(xp.flip(self.basis * self.determined[:, None, :], axis=-1)), axis=-1)
        splits = xp.arange(left.shape[-1], device=left.device)
        lowest = xp.asarray(self.lowest)[:, None, None]
        weights: Array = xp.where(splits <= lowest, self.finest[..., None], left + right)
        return weights

    def at(self, splits: NDArray[np.intp]) -> Array:
        """Weights at one split for each problem, shape (M, P)."""
        xp = namespace(self.basis)
        coarse = _joined(self.basis, self.undetermined, self.determined, splits)
        weights: Array = xp.where((splits > self.lowest)[:, None], coarse, self.finest)
        return weights

    def threshold(self, splits: NDArray[np.intp]) -> Array:
        """The λ_t of eq. 7 at a split, as a share of the largest eigenvalue, shape (M,).

        The largest eigenvalue that counts as undetermined, or 0 if none does.
        """
        xp = namespace(self.eigenvalues)
        below = xp.take_along_axis(self.eigenvalues, xp.clip(splits - 1, 0, None)[:, None], axis=1)[:, 0]
        largest = self.eigenvalues[:, -1]
        shares: Array = xp.where((splits > 0) & (largest > 0), below / xp.where(largest > 0, largest, 1.0), 0.0)
        return shares

    def split(self, threshold: float) -> NDArray[np.intp]:
        """How many eigenvalues do not exceed ``threshold`` times the largest, shape (M,)."""
        xp = namespace(self.eigenvalues)
        count = xp.sum(xp.astype(self.eigenvalues <= threshold * self.eigenvalues[:, -1:], xp.int64), axis=1)
        splits: NDArray[np.intp] = xp.where(count > self.lowest, count, self.lowest)
        return splits


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

    Examples
    --------
    >>> moments = uc.gather(np.ones((2, 1)), np.array([[1.0, 0.0], [2.0, 0.0]]))
    >>> path = uc.risks.lexicographic_path(uc.risks.inconsistency(moments), uc.risks.standard_risk(moments))
    >>> path.weights.shape  # one problem, two weights, three splits
    (1, 2, 3)
    """
    xp = namespace(first.hessian)
    eigenvalues, vectors = eigensystem(first.hessian)
    largest = eigenvalues[:, -1:]
    noise = (eigenvalues <= NOISE * largest) | (largest <= UNDERFLOW)
    lowest = xp.sum(xp.astype(noise, xp.int64), axis=1)
    determined = xp.where(noise, 0.0, _across(vectors, first.linear) / xp.where(noise, 1.0, eigenvalues))
    if second is None:
        nothing = xp.zeros_like(determined)
        return Path(eigenvalues, lowest, vectors, nothing, determined, _joined(vectors, nothing, determined, lowest))
    lower = _factor(second, vectors)
    basis = _solve_lower(lower, vectors.mT).mT
    undetermined, determined = _across(basis, second.linear), _across(lower, determined)
    finest = _joined(basis, undetermined, determined, lowest)
    if xp.any(lowest > 0):
        count, weights = _in_orthonormal_features(first, second)
        more = count > eigenvalues.shape[1] - lowest
        finest = xp.where(more[:, None], weights, finest)
    return Path(eigenvalues, lowest, basis, undetermined, determined, finest)


def _joined(basis: Array, undetermined: Array, determined: Array, splits: NDArray[np.intp]) -> Array:
    """The solution at one split for each problem (13), shape (M, P)."""
    xp = namespace(basis)
    left = xp.arange(basis.shape[-1], device=basis.device) < splits[:, None]
    weights: Array = (basis @ xp.where(left, undetermined, determined)[..., None])[..., 0]
    return weights


def _in_orthonormal_features(first: Quadratic, second: Quadratic) -> tuple[NDArray[np.intp], Array]:
    """How many directions the first objective determines, (M,), and the solution, (M, P); see above."""
    xp = namespace(first.hessian)
    sizes, axes = eigensystem(second.hessian)
    kept = (sizes > DEPENDENT * sizes[:, -1:]) & (sizes[:, -1:] > UNDERFLOW)
    whitening = axes * xp.where(kept, 1.0 / xp.sqrt(xp.where(kept, sizes, 1.0)), 0.0)[:, None, :]
    shares, vectors = eigensystem(whitening.mT @ first.hessian @ whitening)
    basis, determined = whitening @ vectors, shares > UNDETERMINED
    along = _across(basis, first.linear) / xp.where(determined, shares, 1.0)
    weights: Array = (basis @ xp.where(determined, along, _across(basis, second.linear))[..., None])[..., 0]
    return xp.sum(xp.astype(determined, xp.int64), axis=1), weights


def minimum(objective: Quadratic) -> Array:
    """Minimiser of one objective, shape (M, P); that of least norm where it is not unique.

    Examples
    --------
    >>> uc.risks.minimum(uc.Quadratic(np.eye(1)[None], linear=np.array([[3.0]]), constant=np.array([9.0])))
    array([[3.]])
    """
    xp = namespace(objective.linear)
    axes = xp.eye(objective.linear.shape[1], dtype=xp.float64, device=objective.linear.device)
    axes = xp.broadcast_to(axes, objective.hessian.shape)
    basis = _solve_lower(_factor(objective, axes), axes).mT
    weights: Array = (basis @ _across(basis, objective.linear)[..., None])[..., 0]
    return weights


def softened_minima(first: Quadratic, second: Quadratic, softnesses: Sequence[float]) -> Array:
    """Minimise ``first + s second`` for each s, at the price of one factorisation, shape (M, P, K).

    With ``second.hessian = L Lᵀ``, ``L⁻¹ first.hessian L⁻ᵀ = Q Λ Qᵀ`` and the
    basis ``A = L⁻ᵀ Q`` every minimum is ``A (Λ + s)⁻¹ Aᵀ (linear₁ + s linear₂)``.
    """
    axes = np.broadcast_to(np.eye(first.linear.shape[1]), first.hessian.shape)
    whitening = _solve_lower(_factor(second, axes), axes).mT
    eigenvalues, vectors = eigensystem(whitening.mT @ first.hessian @ whitening)
    basis, shares = whitening @ vectors, np.asarray(softnesses)
    linear = _across(basis, first.linear)[..., None] + shares * _across(basis, second.linear)[..., None]
    minima: Array = basis @ (linear / (np.maximum(eigenvalues, 0.0)[..., None] + shares))
    return minima


def eigensystem(hessian: Array) -> tuple[Array, Array]:
    """Eigenvalues (M, P), ascending, and eigenvectors (M, P, P) of symmetric matrices.

    Computed on the matrix scaled to one, with entries below 1e-60 set to zero:
    LAPACK fails on some matrices whose entries span hundreds of orders of magnitude.
    """
    xp = namespace(hessian)
    size = xp.max(xp.abs(hessian), axis=(-2, -1), keepdims=True)
    unit = xp.where(size > UNDERFLOW, size, 1.0)
    scaled = hessian / unit
    eigenvalues, vectors = xp.linalg.eigh(xp.where(xp.abs(scaled) > 1e-60, scaled, 0.0))
    return eigenvalues * unit[..., 0], vectors


def _factor(objective: Quadratic, vectors: Array) -> Array:
    """Cholesky factor of ``Vᵀ M V`` with M the Hessian, shape (M, P, P).

    Where M is singular, its zero eigenvalues are replaced by the largest one. The linear term is orthogonal to their
    eigenvectors, so weights along them stay zero: the solution of least norm. An M of underflow only, as of a field far
    from all samples, counts as zero.
    """
    xp = namespace(objective.hessian)
    try:
        lower: Array = xp.linalg.cholesky(vectors.mT @ objective.times(vectors))
        pivots = xp.linalg.diagonal(lower) ** 2
        if xp.all(xp.min(pivots, axis=-1) > SECONDARY_NOISE * xp.max(pivots, axis=-1)):
            return lower
    except (np.linalg.LinAlgError, RuntimeError):  # PyTorch's is a RuntimeError
        pass
    eigenvalues, axes = eigensystem(objective.hessian)
    largest = eigenvalues[:, -1:]
    floored = xp.where(eigenvalues > SECONDARY_NOISE * largest, eigenvalues, largest)
    floored = xp.where(largest > UNDERFLOW, floored, 1.0)
    rotated = axes.mT @ vectors
    replaced: Array = xp.linalg.cholesky(rotated.mT @ (floored[..., None] * rotated))
    return replaced


def _across(vectors: Array, vector: Array) -> Array:
    """``Vᵀ g`` for each problem, shape (M, P)."""
    across: Array = (vectors.mT @ vector[..., None])[..., 0]
    return across


def _running(columns: Array) -> Array:
    """Sums of the first 0 to P columns, shape (M, P, P + 1)."""
    xp = namespace(columns)
    return xp.cumulative_sum(columns, axis=-1, include_initial=True)


def _solve_lower(lower: Array, right: Array) -> Array:
    """Solve ``L y = r`` for each problem."""
    if is_foreign(lower):  # the array API standard has no triangular solve
        solved: Array = namespace(lower).linalg.solve(lower, right)
        return solved
    return np.stack(
        # BLAS stores columns first: it sees Lᵀ and rᵀ in the same memory, so r is on the right.
        [dtrsm(1.0, factor.T, side.T, side=1, lower=0) for factor, side in zip(lower, right, strict=True)]
    ).mT

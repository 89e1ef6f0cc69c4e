"""The null-space component ``v = N π`` of ``u = A⁺ b + N π``, where the task b varies and A stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_matrix
from ..base.errors import InvalidDataError
from ..models import FeatureMap, KMeansRBF, Placeable
from ..risks import null_space_projection, project
from .forms import placed
from .known import Constraint
from .matrices import constraint_matrices

_RESTING = 1e-9
"""Squares of components below this share of their mean have no direction."""


@dataclass(frozen=True, eq=False)
class NullSpaceComponent:
    """``v(x) = W φ(x)`` with weights W (d, p): a policy, for those who stay under the same constraint."""

    features: FeatureMap
    weights: Array

    def __call__(self, states: Array) -> Array:
        """Components (N, d) at states (N, n)."""
        return self.features(as_matrix(states, "states")) @ self.weights.T


def null_space_component(
    states: ArrayLike,
    actions: ArrayLike,
    constraint: Constraint | None = None,
    features: FeatureMap | Placeable | None = None,
) -> NullSpaceComponent:
    """Learn the part of the actions that the task has no share in [1]_.

    Where the constraint is known or learnt, it is the regression of ``N u``. Where it is not, the component is
    orthogonal to whatever the task does, so that ``uᵀ v̂ = |v|``, and v minimises ``Σ (|v| − uᵀv / |v|)²``. That has a
    spurious minimum at v = 0. So the scale is solved for, and the direction maximises what is left, the squared
    correlation ``(Σ uᵀv)² / Σ |v|² Σ (uᵀv̂)²``, from the regression of u on.

    Parameters
    ----------
    states : array_like, shape (N, n)
    actions : array_like, shape (N, d)
    constraint : callable, optional
        A(x, t) that reads no times.
    features : FeatureMap, optional
        φ; RBFs by default.

    Raises
    ------
    InvalidDataError
        If the arrays do not match, or nothing moves.

    References
    ----------
    .. [1] C. Towell, M. Howard and S. Vijayakumar. Learning nullspace policies. IROS, 2010.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> plane = uc.constraints.Plane([0.0, 1.0])  # takes away what points along y
    >>> uc.constraints.null_space_component(states, -states, plane, uc.Affine())(np.array([[0.5, 0.3]])).round(6)
    array([[-0.5,  0. ]])
    """
    table, moves = as_matrix(states, "states"), as_matrix(actions, "actions")
    if len(table) != len(moves):
        raise InvalidDataError(f"got {len(table)} states and {len(moves)} actions, expected one action for each state.")
    unit = float(np.abs(moves).max())
    if unit == 0.0:
        raise InvalidDataError("actions: all are zero, expected movement.")
    used = placed(KMeansRBF() if features is None else features, table)
    phi, moves = used(table), moves / unit
    if constraint is not None:
        free = null_space_projection(constraint_matrices(constraint, table, None, moves.shape[1]))
        return NullSpaceComponent(used, unit * _regression(phi, project(free, moves)))
    return NullSpaceComponent(used, unit * _scaled(phi, moves, _direction(phi, moves, _regression(phi, moves))))


def _regression(phi: Array, targets: Array) -> Array:
    return np.asarray(np.linalg.lstsq(phi, targets, rcond=1e-12)[0].T, np.float64)


def _scaled(phi: Array, moves: Array, weights: Array) -> Array:
    found = phi @ weights.T
    return weights * ((moves * found).sum() / (found**2).sum())


def _direction(phi: Array, moves: Array, start: Array) -> Array:
    """Maximise the squared correlation by BFGS, in features made orthonormal."""
    from scipy.optimize import minimize

    basis, sizes, back = np.linalg.svd(phi, full_matrices=False)
    kept = sizes > 1e-9 * sizes[0]
    basis, whitening = basis[:, kept], back[kept] / sizes[kept, None]

    def loss(vector: Array) -> tuple[float, Array]:
        found = basis @ vector.reshape(-1, moves.shape[1])
        squares = (found**2).sum(axis=1)
        squares = squares + _RESTING * squares.mean()
        along = (moves * found).sum(axis=1)
        total, size, spread = along.sum(), (found**2).sum(), (along**2 / squares).sum()
        ratio = (along / squares)[:, None]
        slope = 2.0 * (found / size + ratio * (moves - ratio * found) / spread - moves / total)
        return float(np.log(size) + np.log(spread) - 2.0 * np.log(abs(total))), (basis.T @ slope).ravel()

    begin = (basis.T @ (phi @ start.T)).ravel()
    closely = {"maxiter": 2000, "ftol": 1e-15, "gtol": 1e-10}
    found = minimize(loss, begin / np.linalg.norm(begin), jac=True, method="L-BFGS-B", options=closely)
    return (whitening.T @ found.x.reshape(-1, moves.shape[1])).T

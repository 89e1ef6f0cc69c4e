"""What a policy should minimise: functions from moments to quadratics.

A new objective is one function like these.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array
from .moments import Moments
from .quadratic import Quadratic

__all__ = ["inconsistency", "standard_risk", "unvec", "vec"]


def inconsistency(moments: Moments) -> Quadratic:
    """How far the policy, projected onto each action, misses it (eqs 4 and 14).

    ``E_i = Σ w (r − ûᵀ π̃(x))²``
    """
    return Quadratic(moments.consistent, vec(moments.cross), moments.energy)


def standard_risk(moments: Moments) -> Quadratic:
    """How far the policy misses each action (eqs 5 and 11).

    ``E_2 = Σ w ‖u − π̃(x)‖²``
    """
    models, d, p = moments.cross.shape
    hessian = np.einsum("mij,kl->mikjl", moments.gram, np.eye(d)).reshape(models, p * d, p * d)
    return Quadratic(hessian, vec(moments.cross), moments.energy)


def vec(weights: Array) -> Array:
    """Matrices (..., d, p) laid out by columns, shape (..., d p)."""
    return np.swapaxes(weights, -1, -2).reshape(*weights.shape[:-2], -1)


def unvec(vector: Array, actions: int) -> Array:
    """The inverse of :func:`vec`: shape (..., d p) to (..., d, p)."""
    return np.swapaxes(vector.reshape(*vector.shape[:-1], -1, actions), -1, -2)

"""Objectives: functions from moments to quadratics. A new objective is one such function."""

import numpy as np

from ..base.arrays import Array, beside, namespace
from .moments import Moments
from .quadratic import Quadratic


def inconsistency(moments: Moments) -> Quadratic:
    """Squared distance of each action from the policy projected onto it (eqs 4 and 14).

    ``E_i = Σ w (r − ûᵀ π̃(x))²``

    Examples
    --------
    >>> uc.risks.inconsistency(uc.gather(np.ones((2, 1)), np.array([[1.0, 0.0], [0.0, 3.0]])))(np.array([[1.0, 3.0]]))
    array([0.])
    """
    return Quadratic(moments.consistent, vec(moments.cross), moments.energy)


def standard_risk(moments: Moments) -> Quadratic:
    """Squared distance of each action from the policy (eqs 5 and 11).

    ``E_2 = Σ w ‖u − π̃(x)‖²``

    Examples
    --------
    >>> uc.risks.standard_risk(uc.gather(np.ones((2, 1)), np.array([[1.0], [3.0]])))(np.array([[2.0]]))
    array([2.])
    """
    models, d, p = moments.cross.shape
    each = beside(np.eye(d), moments.gram)[:, None, :]  # eye[k, l] at (k, j, l)
    hessian = namespace(moments.gram).reshape(moments.gram[:, :, None, :, None] * each, (models, p * d, p * d))
    return Quadratic(hessian, vec(moments.cross), moments.energy, moments.gram)


def vec(weights: Array) -> Array:
    """Matrices (..., d, p) stacked by columns, shape (..., d p)."""
    d, p = weights.shape[-2:]
    laid: Array = namespace(weights).reshape(weights.mT, (*weights.shape[:-2], d * p))
    return laid


def unvec(vector: Array, actions: int) -> Array:
    """The inverse of :func:`vec`: shape (..., d p) to (..., d, p)."""
    matrices: Array = namespace(vector).reshape(vector, (*vector.shape[:-1], -1, actions)).mT
    return matrices

"""Orthogonal projections: onto the null space of constraints, and onto actions.

Every projection here is symmetric and idempotent, ``P = Pᵀ = P²``.
"""

from functools import reduce
from operator import add

import numpy as np

from ..base.arrays import Array, namespace
from ..base.errors import InvalidDataError

RANK_TOLERANCE = 1e-9
"""Singular values below this share of the largest count as zero."""

ROW_TOLERANCE = 1e-12
"""Rows shorter than this share of the longest are rounding errors, as in a Jacobian at a singular posture."""

TURNED = 10.0
"""Actions shorter than so many standard deviations of the noise are turned by it: where much is held, far too much.

Of 120 sets of six reaches of a planar arm along lines of its hand, with noise of 1 mrad on positions and velocities by
differences, the right policy explained 70 % of the motion in 39 % without, in 53 % with 5, in 84 % with 10 and in 89 %
with 20. One turned by 37 degrees did in 7 % where there was no noise, and in 0, 6, 19 and 36 %.
"""


def null_space_projection(constraint_matrix: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """Projection onto the null space of constraints, ``N = I − A⁺A`` (eq. 3).

    Parameters
    ----------
    constraint_matrix : ndarray, shape (..., k, d)
        One constraint in each row; rows may be zero or linearly dependent.
    tolerance : float
        Singular values of the rows, scaled to unit length, count as zero below ``tolerance`` times the largest.

    Returns
    -------
    ndarray, shape (..., d, d)
        The projections, exactly symmetric.

    Raises
    ------
    InvalidDataError
        If it is not a matrix, or holds NaN or infinity.

    Examples
    --------
    >>> uc.null_space_projection(np.array([[0.0, 0.0, 2.0]]))
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 0.]])
    """
    constraint_matrix = np.asarray(constraint_matrix, dtype=np.float64)
    if constraint_matrix.ndim < 2:
        raise InvalidDataError(
            f"constraint matrix: got an array of shape {constraint_matrix.shape}, expected (..., k, d), "
            "one constraint in each row."
        )
    if not np.isfinite(constraint_matrix).all():
        raise InvalidDataError("constraint matrix: found NaN or infinity, expected finite numbers.")
    d = constraint_matrix.shape[-1]
    # A u = 0 does not depend on the lengths of the rows, so all are scaled to one, except those that are rounding.
    directions, lengths = unit_actions(constraint_matrix)
    directions[lengths <= ROW_TOLERANCE * lengths.max(axis=-1, initial=0.0, keepdims=True)] = 0.0
    # By rows of Vᵀ rather than by A⁺: the rank decision is explicit and N is symmetric by construction.
    _, singular, rows = np.linalg.svd(directions, full_matrices=False)
    active = singular > tolerance * singular.max(axis=-1, initial=0.0, keepdims=True)
    rows = rows * active[..., None]
    free = np.eye(d) - np.swapaxes(rows, -1, -2) @ rows
    # At full rank N is exactly zero: rounding errors must not become a direction.
    return np.where((active.sum(axis=-1) == d)[..., None, None], 0.0, free)


def unit_actions(actions: Array) -> tuple[Array, Array]:
    """Directions and lengths of actions, ``û`` and ``r`` of eq. 4.

    Parameters
    ----------
    actions : ndarray, shape (..., d)

    Returns
    -------
    directions : ndarray, shape (..., d)
        Unit vectors; zero where the action is zero, since that has no direction.
    lengths : ndarray, shape (...)
    """
    # Column by column: there are few, and reducing along a short last axis is slow.
    xp = namespace(actions)
    actions = xp.asarray(actions)
    columns = range(actions.shape[-1])
    # Scaled by the largest entry first: lengths of 1e-200 must not square to zero.
    size, nothing = xp.abs(actions), xp.zeros_like(actions[..., :1])[..., 0]
    scale = reduce(xp.maximum, (size[..., k] for k in columns), nothing)
    scaled = actions / xp.where(scale > 0, scale, 1.0)[..., None]
    lengths = xp.sqrt(reduce(add, (scaled[..., k] ** 2 for k in columns), nothing))
    scaled /= xp.where(lengths > 0, lengths, 1.0)[..., None]
    return scaled, lengths * scale


def action_projection(actions: Array) -> Array:
    """Projection onto each action's own direction, ``P = û ûᵀ`` (section III-A).

    Parameters
    ----------
    actions : ndarray, shape (..., d)

    Returns
    -------
    ndarray, shape (..., d, d)
        Zero where the action is zero.

    Examples
    --------
    >>> uc.action_projection(np.array([[0.0, 3.0]]))
    array([[[0., 0.],
            [0., 1.]]])
    """
    directions, _ = unit_actions(actions)
    return directions[..., :, None] * directions[..., None, :]


def along_motion(
    actions: Array,
    predicted: Array,
    counts: Array | None = None,
    usual: float | None = None,
    noise: float | Array = 0.0,
) -> tuple[float, float]:
    """``Σ w (‖u‖ − ûᵀ π̃)²`` and ``Σ w ‖u‖²``: the first over the second is the share of the motion left unexplained.

    As the inconsistency (eq. 4), but w falls from the sample weight to zero below half a usual length of actions, and
    below :data:`TURNED` standard deviations of the noise: it gives the direction of what is slow, and no policy does.

    Parameters
    ----------
    actions, predicted : ndarray, shape (N, d)
    counts : ndarray, shape (N,), optional
        Sample weights.
    usual : float, optional
        Usual length of actions, by default their root mean square.
    noise : float or ndarray, shape (N,)
        Variance of the noise on each action coordinate, of all samples or of each.
    """
    directions, lengths = unit_actions(actions)
    counts = np.ones(len(lengths)) if counts is None else counts
    usual = float(np.sqrt(counts @ lengths**2 / counts.sum())) if usual is None else usual
    knee = np.maximum(max(0.5 * usual, 1e-300), TURNED * np.sqrt(noise))
    weights = counts * np.minimum(1.0, lengths / knee) ** 2
    missed = lengths - (directions * predicted).sum(axis=1)
    return float(weights @ missed**2), float(weights @ lengths**2)


def project(projections: Array, vectors: Array) -> Array:
    """Apply one projection to each vector.

    Parameters
    ----------
    projections : ndarray, shape (..., d, d)
    vectors : ndarray, shape (..., d)

    Returns
    -------
    ndarray, shape (..., d)

    Examples
    --------
    >>> uc.project(uc.null_space_projection(np.array([[0.0, 1.0]])), np.array([3.0, 4.0]))
    array([3., 0.])
    """
    return np.einsum("...ij,...j->...i", projections, vectors)

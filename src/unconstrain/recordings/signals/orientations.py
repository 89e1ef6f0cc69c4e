"""Angles and orientations that jump although nothing did: other numbers for the same place."""

from typing import NamedTuple

import numpy as np

from ...base.arrays import BLOCK_ROWS, Array, slices

TURNS = (2 * np.pi, 360.0)
"""One turn in radians, and in degrees."""

MOST_TURNS = 16
"""Angles that go further than so many turns in radians are degrees."""


class Wrap(NamedTuple):
    """A column that jumps by one ``turn`` at ``rows`` (the first row after each jump)."""

    turn: float
    rows: list[int]


def wraps(angle: Array) -> Wrap | None:
    """Find jumps by a whole turn inside a range of one turn, in columns (T,); None where it is no wrapped angle."""
    for turn in TURNS:
        rows = _jumps_by(angle, turn)
        if rows:
            return Wrap(turn, rows)
    return None


def in_degrees(angle: Array) -> bool:
    """Whether an angle (T,) is in degrees: it jumps by 360, or goes too far to be in radians."""
    finite = angle[np.isfinite(angle)]
    wrap = wraps(finite)
    if wrap is None:
        return bool(np.ptp(finite) > MOST_TURNS * TURNS[0]) if finite.size else False
    return wrap.turn == TURNS[1]


def _jumps_by(angle: Array, turn: float) -> list[int]:
    """Rows at which a column jumps by a turn; none unless it is smooth without these jumps."""
    if len(angle) < 3 or not 0.5 * turn < np.ptp(angle) <= 1.02 * turn or np.abs(angle).max() > 1.02 * turn:
        return []
    steps = np.diff(angle)
    whole = np.round(steps / turn)
    inner = np.abs(steps - whole * turn)
    at = np.flatnonzero(whole)
    usual = float(np.quantile(inner, 0.95))
    close = inner[at] <= max(4.0 * usual, 0.01 * turn)
    return (at + 1).tolist() if at.size and close.all() and usual < turn / 8 else []


def quaternion_flips(quaternions: Array) -> list[int]:
    """Rows at which a unit quaternion (T, 4) turns its sign; none where the rows are no unit quaternions."""
    if any(np.abs(_lengths(quaternions[rows]) - 1.0).max() > 0.02 for rows in slices(quaternions, BLOCK_ROWS)):
        return []
    cosines = (quaternions[1:] * quaternions[:-1]).sum(axis=1)
    # Neighbours are close but for the sign: by how much they turn is seen from the others.
    return (np.flatnonzero(cosines < -0.7) + 1).tolist() if np.abs(cosines).min(initial=1.0) > 0.7 else []


def continuous_quaternions(quaternions: Array) -> Array:
    """Signs turned so that each row is the closer one to the row before, shape (T, 4)."""
    turned = np.where((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return quaternions * np.concatenate([[1.0], np.cumprod(turned)])[:, None]


def rotation_flips(vectors: Array) -> list[int]:
    """Rows at which a rotation vector (T, 3), radians or degrees, becomes the opposite one of nearly half a turn."""
    lengths = _lengths(vectors)
    for turn in TURNS:
        if not 0.4 * turn < lengths.max(initial=0.0) < 0.53 * turn:
            continue
        steps = np.linalg.norm(np.diff(vectors, axis=0), axis=1)
        opposite = vectors[:-1] * (1.0 - turn / np.maximum(lengths[:-1], turn / 1e3))[:, None]
        missed = np.linalg.norm(vectors[1:] - opposite, axis=1)
        far = steps > 0.6 * turn
        near = float(np.quantile(steps[~far], 0.95)) if not far.all() else 0.0
        close = (missed < 3.0 * near + 1e-3 * turn) & (missed < _missed_by_wrap(np.diff(vectors, axis=0), turn))
        rows = np.flatnonzero(far & close) + 1
        if rows.size:
            return rows.tolist()
    return []


def _lengths(vectors: Array) -> Array:
    """Of each row, (T,), without a table beside it."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def _missed_by_wrap(steps: Array, turn: float) -> Array:
    """How far steps (T, 3) are from a whole turn in one column alone and none in the others, shape (T,)."""
    whole = np.sign(steps)[:, :, None] * turn * np.eye(3)
    return np.linalg.norm(steps[:, None, :] - np.swapaxes(whole, 1, 2), axis=2).min(axis=1)


def continuous_rotations(vectors: Array, turn: float) -> Array:
    """Rotation vectors (T, 3) of the same rotations, each the closest one to the row before."""
    closest = vectors.astype(np.float64, copy=True)
    lengths = np.linalg.norm(vectors, axis=1)
    for row in range(1, len(vectors)):
        if lengths[row] > 0:
            axis = vectors[row] / lengths[row]
            turns = np.round((closest[row - 1] @ axis - lengths[row]) / turn)
            closest[row] = axis * (lengths[row] + turns * turn)
    return closest

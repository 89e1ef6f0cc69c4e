"""Unit quaternions (x, y, z, w), of either sign, in the last axis of an array."""

import numpy as np

from ...base.arrays import Array

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


def product(left: Array, right: Array) -> Array:
    """Of two rotations, the right one first."""
    v, w, u, s = left[..., :3], left[..., 3:], right[..., :3], right[..., 3:]
    return np.concatenate([w * u + s * v + np.cross(v, u), w * s - (v * u).sum(axis=-1, keepdims=True)], axis=-1)


def inverse(quaternion: Array) -> Array:
    """The rotation back."""
    return quaternion * [-1.0, -1.0, -1.0, 1.0]


def rotation(vector: Array) -> Array:
    """Of a rotation vector (3,), radians."""
    half = np.linalg.norm(vector) / 2
    return np.append(vector * np.sinc(half / np.pi) / 2, np.cos(half))


def mean_orientation(quaternions: Array) -> Array:
    """The nearest to all (N, 4) in squared sines, whatever their signs, (4,)."""
    return np.linalg.svd(quaternions, full_matrices=False)[2][0]


def turns_from(orientation: Array, quaternions: Array) -> Array:
    """Rotations (N, 3) from one orientation, along their axes: twice the sine of half an angle."""
    turned = product(quaternions, inverse(orientation))
    return 2 * turned[:, :3] * np.where(turned[:, 3:] < 0, -1.0, 1.0)

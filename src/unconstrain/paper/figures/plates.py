"""Plates that are wiped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Array


@dataclass(frozen=True, eq=False)
class Quad:
    """A piece of a plane in space, with its own two axes.

    Parameters
    ----------
    centre : ndarray, shape (3,)
    axes : ndarray, shape (3, 2)
        Orthonormal columns.
    half : float
        Half of the sides' length.
    """

    centre: Array
    axes: Array
    half: float

    @classmethod
    def around(cls, states: Array, normal: Array, margin: float = 1.15) -> Quad:
        """The plane through the middle of some states (N, 3), as large as they spread.

        The first axis is level: it points along the world's x as far as the plane allows.
        """
        normal = normal / np.linalg.norm(normal)
        # Where the plane faces x, "along x" means nothing; then y has to do.
        ahead = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
        first = ahead - (ahead @ normal) * normal
        first /= np.linalg.norm(first)
        axes = np.column_stack([first, np.cross(normal, first)])
        centre = states.mean(axis=0)
        spread = float(np.abs((states - centre) @ axes).max())
        return cls(centre, axes, margin * max(spread, 1e-9))

    @property
    def corners(self) -> Array:
        """Shape (4, 3), going round."""
        square = self.half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        return self.centre + square @ self.axes.T

    def grid(self, count: int) -> Array:
        """Points in the plane's own coordinates, shape (count², 2)."""
        axis = np.linspace(-self.half, self.half, count)
        return np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)

    def place(self, points: Array) -> Array:
        """From the plane's coordinates (N, 2) into space (N, 3)."""
        return self.centre + points @ self.axes.T

    def flatten(self, states: Array) -> Array:
        """From space (N, 3) into the plane's coordinates (N, 2)."""
        return (states - self.centre) @ self.axes

"""Plates that are wiped, and paths seen from above them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.arrays import Array
from ...pages.figures.planes import broken, equal_axes, line_through
from ...pages.figures.style import COLOURS, DASHES, figure, legend


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


def paths(
    lines: Mapping[str, Array],
    *,
    reach: float | None = None,
    title: str = "",
    labels: tuple[str, str] = ("first axis (m)", "second axis (m)"),
    height: int = 460,
) -> Any:
    """Paths in a plane, each with a dot where it starts, with equal axes.

    Parameters
    ----------
    lines : dict
        Key to points (T, 2).
    reach : float, optional
        The axes span [−reach, reach]; what is beyond is not drawn.
    title, labels, height
        As in :func:`~unconstrain.pages.figures.vector_field`.
    """
    made = figure(title, *labels, height=height)
    for key, line in lines.items():
        seen = key == "observed"
        made.add_trace(
            line_through(broken(line) if seen else line, key, width=1.1 if seen else 2.2, dash=DASHES.get(key, "solid"))
        )
    for key, line in lines.items():
        start = line[:1]
        marker = {"color": COLOURS.get(key), "size": 8}
        made.add_scatter(x=start[:, 0], y=start[:, 1], mode="markers", marker=marker, **legend(key, first=False))
    equal_axes(made)
    if reach is not None:
        made.update_xaxes(range=[-reach, reach])
        made.update_yaxes(range=[-reach, reach])
    return made

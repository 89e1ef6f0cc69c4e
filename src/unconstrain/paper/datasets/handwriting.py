"""Handwriting on a tablet: thirty shapes, each drawn seven times.

S. M. Khansari-Zadeh and A. Billard, "Learning stable nonlinear dynamical systems with Gaussian mixture models", IEEE
Transactions on Robotics, 2011 (to be cited where the data is used). The copy is that of the repository
mrana6/euclideanizing_flows, whose licence is MIT.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import unconstrain as uc

from ...base.arrays import Array
from .files import Source

SOURCE = Source(
    "lasa_handwriting",
    "https://github.com/mrana6/euclideanizing_flows/raw/cfa7c9414610c5061f1b9f2bf9505bc5e0cb8731/"
    "data/lasa_handwriting_dataset/",
)

SHAPES = (
    "Angle", "BendedLine", "CShape", "DoubleBendedLine", "GShape", "JShape", "JShape_2", "Khamesh", "LShape", "Leaf_1",
    "Leaf_2", "Line", "Multi_Models_1", "Multi_Models_2", "Multi_Models_3", "Multi_Models_4", "NShape", "PShape",
    "RShape", "Saeghe", "Sharpc", "Sine", "Snake", "Spoon", "Sshape", "Trapezoid", "WShape", "Worm", "Zshape", "heee",
)  # fmt: skip
"""What was drawn. The strokes of Multi_Models are of two or three movements."""


def load_handwriting(shape: str, *, download: bool = False, every: int = 20) -> list[uc.Demonstration]:
    """Seven strokes of one shape, each ending at the origin, at rest.

    A person varies by a factor on the speed from stroke to stroke, and strokes cross.

    Parameters
    ----------
    shape : str
        One of :data:`SHAPES`.
    download : bool
        Fetch the file (0.3 MB) if there is no local copy, check it and keep it.
    every : int
        Keep one sample in so many of the 1000 of each stroke.

    Returns
    -------
    list of Demonstration
        Positions in mm, velocities in mm/s as published, times in s.

    Raises
    ------
    ReadError
        As :func:`~unconstrain.datasets.load_rim_wiping`.
    """
    from scipy.io import loadmat  # slow to import

    cells = loadmat(SOURCE.path(f"{shape}.mat", download))["demos"].ravel()
    return [_stroke(cell[0, 0], every, f"{shape} {index + 1}") for index, cell in enumerate(cells)]


def _stroke(fields: Any, every: int, name: str) -> uc.Demonstration:
    def rows(field: str) -> Array:
        return np.ascontiguousarray(fields[field].T[::every])

    return uc.Demonstration(rows("pos"), rows("vel"), rows("t")[:, 0], name=name)

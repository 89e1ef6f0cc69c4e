"""An arm on a plate as a drawing of lines: for where the physics engine cannot draw."""

from __future__ import annotations

import io

from ...base.arrays import Array, require_extra
from ...pages.figures.style import COLOURS, INK
from .plates import Quad


def arm_on_plate(joints: Array, track: Array, plate: Quad) -> bytes:
    """Draw an arm in several postures, its plate, and the path of its tip.

    Parameters
    ----------
    joints : ndarray, shape (K, n + 1, 3)
        Where joints and tip are in each posture, m.
    track : ndarray, shape (T, 3)
        Of the tip, m.
    plate : Quad

    Returns
    -------
    bytes
        A PNG.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    require_extra("mpl_toolkits.mplot3d", "viz")
    drawing = require_extra("matplotlib.figure", "viz").Figure(figsize=(4.2 * len(joints), 4.2), dpi=100)
    corners = plate.corners[[0, 1, 2, 3, 0]]
    for index, posture in enumerate(joints):
        axes = drawing.add_subplot(1, len(joints), index + 1, projection="3d", proj_type="persp")
        axes.plot(*corners.T, color=COLOURS["direct"], linewidth=1.5)
        axes.plot(*track.T, color=COLOURS["held out"], linewidth=1.2)
        axes.plot(*posture.T, color=INK, linewidth=4, marker="o", markersize=6, markerfacecolor="white")
        axes.set(xlim=(-0.1, 0.9), ylim=(-0.5, 0.5), zlim=(0.0, 1.0), xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        axes.set_box_aspect((1, 1, 1))
        axes.view_init(elev=25, azim=-50)
    drawing.tight_layout()
    stream = io.BytesIO()
    drawing.savefig(stream, format="png")
    return stream.getvalue()

"""The whole idea in one picture, for a front page."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

import unconstrain as uc

from ...base.arrays import Array, require_extra
from ...base.files import write
from ...pages.figures.style import COLOURS, INK
from ...risks import unit_actions

WORST = 60.0
"""Angular errors are coloured up to here, degrees."""

SHADES = ("#3fb996", "#e8b100", "#8c1c4f")
"""From right to wrong; darker at the end, so that it reads without colours too."""

_Policy = Callable[[Array], Array]


def overview(
    path: str | os.PathLike[str],
    demonstrations: Sequence[uc.Demonstration],
    truth: _Policy,
    learnt: Mapping[str, _Policy],
    *,
    reach: float = 1.0,
    arrows: int = 17,
) -> None:
    """Draw recordings in the plane, and beside them what was learnt from them.

    Parameters
    ----------
    path : path
        Of the PNG or SVG file.
    demonstrations : sequence of Demonstration
        With two state and two action columns.
    truth : callable
        The policy that demonstrated.
    learnt : dict
        Title to policy, a panel each.
    reach : float
        The panels show [−reach, reach]².
    arrows : int
        Fields are drawn on ``arrows × arrows`` states.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    drawing = require_extra("matplotlib.figure", "viz").Figure(figsize=(16, 5.5), dpi=100, facecolor="white")
    panels = drawing.subplots(1, 1 + len(learnt), gridspec_kw={"wspace": 0.07})
    drawing.subplots_adjust(left=0.012, right=0.925, top=0.92, bottom=0.015)
    axis = np.linspace(-0.95 * reach, 0.95 * reach, arrows)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    wanted = truth(grid)
    _recorded(panels[0], demonstrations)
    coloured = [
        _field(panel, grid, policy(grid), wanted, reach)
        for panel, policy in zip(panels[1:], learnt.values(), strict=True)
    ]
    shown = (-1.08 * reach, 1.08 * reach)
    for panel, title in zip(panels, ("What is recorded", *learnt), strict=True):
        panel.set(aspect="equal", xlim=shown, ylim=shown, xticks=[], yticks=[])
        panel.set_title(title, fontsize=19, color=INK, pad=12)
        panel.spines[:].set_color("#c9ced6")
    _colour_bar(drawing, coloured[-1])
    write(path, partial(drawing.savefig, format="png", metadata={"Software": None}))


def _colour_bar(drawing: Any, coloured: Any) -> None:
    bar = drawing.colorbar(coloured, cax=drawing.add_axes((0.938, 0.1, 0.011, 0.74)), extend="max")
    bar.set_label("angle to the true policy (thin black), °", fontsize=13, color=INK)
    bar.ax.tick_params(labelsize=12, colors=INK)
    bar.outline.set_visible(False)


def _recorded(panel: Any, demonstrations: Sequence[uc.Demonstration]) -> None:
    for demo in demonstrations:
        panel.plot(*demo.states.T, color=COLOURS["training"], linewidth=2.2, solid_capstyle="round")
        panel.plot(*demo.states[0], "o", color=COLOURS["training"], markersize=5)
        tip, back = demo.states[-1], demo.states[-min(3, len(demo))]
        panel.annotate("", tip, back, arrowprops={"arrowstyle": "-|>", "color": "#6b7178", "lw": 1.4})


def _field(panel: Any, grid: Array, found: Array, wanted: Array, reach: float) -> Any:
    """Learnt arrows, coloured by how much they are turned, below the true ones."""
    longest = float(np.linalg.norm(wanted, axis=1).max())
    # Square roots of lengths: the middle of the field would be dots otherwise.
    learnt, true = (_softened(vectors, longest) for vectors in (found, wanted))
    look = {"angles": "xy", "scale_units": "xy", "scale": 6.2 / reach, "pivot": "tail"}
    shades = require_extra("matplotlib.colors", "viz").LinearSegmentedColormap.from_list("angle", SHADES)
    thick = panel.quiver(
        *grid.T,
        *learnt.T,
        _degrees(found, wanted),
        cmap=shades,
        width=0.0075,
        headwidth=3.4,
        headlength=3.6,
        headaxislength=3.4,
        **look,
    )
    thick.set_clim(0.0, WORST)
    panel.quiver(*grid.T, *true.T, color=COLOURS["truth"], width=0.0022, headwidth=6, headlength=7, **look)
    return thick


def _softened(vectors: Array, longest: float) -> Array:
    directions, lengths = unit_actions(vectors)
    return directions * np.sqrt(np.minimum(lengths / longest, 1.5))[:, None]


def _degrees(found: Array, wanted: Array) -> Array:
    cosine = (unit_actions(found)[0] * unit_actions(wanted)[0]).sum(axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))

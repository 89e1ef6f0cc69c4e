"""Many small pictures of paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array
from ...pages.figures.style import COLOURS, figure

WAYS = {
    "shown": ("training", 2.5),
    "unguided": ("inconsistency", 1.2),
    "contracting": ("robust", 0.9),
    "random": ("", 0.5),
    "guided": ("hybrid", 1.2),
}
"""Way to the key of its colour and the width of its lines, in the order in which they are drawn."""

PALE = "#9ccfbc"


def small_multiples(drawn: Mapping[str, Mapping[str, Sequence[Array]]]) -> list[Any]:
    """A picture of each shape with the paths of every way, (T, 2) each, around a goal at the origin.

    Parameters
    ----------
    drawn : dict
        Shape to way to paths; ways are those of :data:`WAYS`.
    """
    return [_panel(shape, ways) for shape, ways in drawn.items()]


def _panel(shape: str, ways: Mapping[str, Sequence[Array]]) -> Any:
    made = figure(shape, height=170)
    [axes] = made.axes
    for way, (key, width) in WAYS.items():
        line = np.concatenate([np.vstack([path, [np.nan, np.nan]]) for path in ways[way]])
        axes.plot(*line.T, color=COLOURS.get(key, PALE), linewidth=width)
    axes.plot(0.0, 0.0, "o", color=COLOURS["truth"], markersize=4)
    shown = np.concatenate(ways["shown"])
    low, high = shown.min(axis=0), shown.max(axis=0)
    around = 0.25 * float((high - low).max())
    axes.set(xlim=(low[0] - around, high[0] + around), ylim=(low[1] - around, high[1] + around), xticks=[], yticks=[])
    axes.set_aspect("equal")
    axes.grid(visible=False)
    return made

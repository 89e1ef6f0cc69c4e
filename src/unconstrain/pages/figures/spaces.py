"""Pictures in three dimensions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array
from .planes import broken
from .style import COLOURS, INK, PALETTE, RULE, figure, legend


def movements(
    tracks: Sequence[tuple[str, str, Array]],
    plates: Mapping[str, Array] | None = None,
    *,
    labels: tuple[str, str, str] = ("x (m)", "y (m)", "z (m)"),
) -> Any:
    """Movements in space, and the plates they were made on.

    Parameters
    ----------
    tracks : sequence of (key, name, states)
        The key decides the colour and what is hidden together; states (T, 3).
    plates : dict, optional
        Name of a track to the corners (4, 3) of its plate, going round; drawn translucent in the same colour.
    labels : tuple of str
        Of the axes, with their unit.

    Returns
    -------
    plotly.graph_objects.Figure
    """
    made = figure(height=520)
    keys = list(dict.fromkeys(key for key, _, _ in tracks))
    others = [key for key in keys if key not in COLOURS]
    colours = {key: COLOURS.get(key) or PALETTE[others.index(key) % len(PALETTE)] for key in keys}
    drawn: set[str] = set()
    for key, name, states in tracks:
        line = {"color": colours[key], "width": 3}
        x, y, z = broken(states).T
        where = legend(key, first=key not in drawn)
        made.add_scatter3d(x=x, y=y, z=z, mode="lines", line=line, hovertemplate=f"{name}<extra></extra>", **where)
        drawn.add(key)
        if plates and name in plates:
            made.add_mesh3d(**_mesh(plates[name]), color=colours[key], opacity=0.13, hoverinfo="skip", legendgroup=key)
    axis = {"gridcolor": RULE, "backgroundcolor": "white", "color": INK, "title_font_size": 13, "tickfont_size": 11}
    made.update_layout(
        scene={
            **{f"{name}axis": axis | {"title_text": label} for name, label in zip("xyz", labels, strict=True)},
            "aspectmode": "data",
            "camera": {"eye": {"x": 1.35, "y": -1.5, "z": 0.9}, "center": {"x": 0, "y": 0, "z": -0.12}},
        },
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
    )
    return made


def _mesh(corners: Array) -> dict[str, Any]:
    x, y, z = corners.T
    first = np.array([0, 0])
    return {"x": x, "y": y, "z": z, "i": first, "j": np.array([1, 2]), "k": np.array([2, 3])}

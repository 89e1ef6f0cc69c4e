"""Pictures in a plane: vector fields and paths."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array
from .style import COLOURS, figure, legend, plotly

# In the order in which they are drawn, with their widths: what lies below shows at the edges.
_ARROWS = {"inconsistency": 1.4, "direct": 3.2, "hybrid": 1.9, "truth": 0.9, "observed": 0.9}


def vector_field(
    points: Array,
    fields: Mapping[str, Array],
    *,
    longest: float,
    scale: float,
    trajectories: Sequence[Array] = (),
    trajectories_are: str = "training",
    title: str = "",
    labels: tuple[str, str] = ("x₁ (m)", "x₂ (m)"),
    height: int = 520,
    equal: bool = True,
) -> Any:
    """Arrows of several fields at the same points, with equal axes.

    Parameters
    ----------
    points : ndarray, shape (A, 2)
    fields : dict
        Key ("truth", "direct", ...) to vectors (A, 2); what is true or observed is drawn thin and on top.
    longest : float
        Arrows longer than this are cut to it.
    scale : float
        Drawn length of a vector of length one.
    trajectories : sequence of ndarray, shape (T, 2)
        Drawn below.
    trajectories_are : str
        Their key.
    title : str
    labels : tuple of str
        Of the axes, with their unit.
    height : int
        Pixels.
    equal : bool
        Both axes to one scale.
    """
    made = figure(title, *labels, height=height)
    if trajectories:
        made.add_trace(line_through(_joined(trajectories), trajectories_are, width=1.2))
    for key in sorted(fields, key=list(_ARROWS).index):
        vectors = scale * clipped(fields[key], longest)
        made.add_trace(line_through(arrow_lines(points, vectors), key, width=_ARROWS[key]))
    made.update_traces(hoverinfo="skip")
    if equal:
        equal_axes(made)
    if fields:
        _show(made, points)
    return made


def known_map(
    points: Array,
    values: Array,
    marked: Array,
    *,
    labels: tuple[str, str],
    scale: str,
    texts: Sequence[str] = (),
    directions: Array | None = None,
    top: float = 0.0,
) -> Any:
    """Points coloured by how little is known there, with some of them marked and numbered.

    Parameters
    ----------
    points : ndarray, shape (N, 2)
    values : ndarray, shape (N,)
        From 0, known, on.
    marked : ndarray, shape (K, 2)
        Drawn on top, numbered from 1.
    labels : tuple of str
        Of the axes, with their unit.
    scale : str
        Of the colours, with the unit.
    texts : sequence of str
        What each marked point says when it is pointed at.
    directions : ndarray, shape (K, 2), optional
        Drawn through the marked points as lines, the longest as long as an eighth of the picture.
    top : float
        Colours end there, or at the largest value if that is larger.
    """
    made = figure("", *labels, height=520)
    order = np.argsort(values, kind="stable")  # what is known least lies on top
    bar = {"title": {"text": scale, "side": "right"}, "thickness": 14, "outlinewidth": 0, "tickformat": ".2~g"}
    bar |= {"len": 0.92, "y": 0.0, "yanchor": "bottom"}
    look = {"color": values[order], "colorscale": "Cividis", "cmin": 0.0, "size": 5, "colorbar": bar}
    made.add_scatter(
        x=points[order, 0], y=points[order, 1], mode="markers", marker=look | {"cmax": max(float(values.max()), top)},
        name="recorded states", hovertemplate="(%{x:.3g}, %{y:.3g}): %{marker.color:.3g}<extra></extra>",
    )  # fmt: skip
    if directions is not None and len(marked):
        reach = float(np.ptp(points, axis=0).max()) / 16
        ways = directions * reach / max(float(np.linalg.norm(directions, axis=1).max()), 1e-300)
        ends = np.stack([marked - ways, marked + ways, np.full_like(marked, np.nan)], axis=1).reshape(-1, 2)
        line = {"color": COLOURS["inconsistency"], "width": 2.5}
        made.add_scatter(x=ends[:, 0], y=ends[:, 1], mode="lines", line=line, hoverinfo="skip", name="to leave free")
    ring = {"color": "white", "size": 17, "line": {"color": COLOURS["inconsistency"], "width": 2}}
    made.add_scatter(
        x=marked[:, 0], y=marked[:, 1], mode="markers+text", marker=ring, textfont={"size": 11},
        text=[str(number) for number in range(1, len(marked) + 1)], hovertext=list(texts), hoverinfo="text",
        name="to record",
    )  # fmt: skip
    return made


def clipped(vectors: Array, longest: float) -> Array:
    """Vectors (A, d), those that are longer than ``longest`` cut to it."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(lengths, 1e-300))


def arrow_lines(points: Array, vectors: Array, head: float = 0.32) -> Array:
    """Arrows as one broken line, six rows each, the last of them NaN.

    Parameters
    ----------
    points, vectors : ndarray, shape (A, 2)
        Where the arrows begin, and how far they reach.
    head : float
        Length of the barbs, as a share of the arrow's.

    Returns
    -------
    ndarray, shape (6 A, 2)
    """
    tips = points + vectors
    angle = 0.45  # between barb and shaft, radians
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    left, right = tips - head * vectors @ turn.T, tips - head * vectors @ turn
    gaps = np.full_like(points, np.nan)
    return np.stack([points, tips, left, tips, right, gaps], axis=1).reshape(-1, 2)


def broken(states: Array) -> Array:
    """States (T, n) with a row of NaN wherever they jump: the tool was lifted, and no line should go there.

    A jump is a step of more than three times what 95 % of all steps stay below.
    """
    steps = np.linalg.norm(np.diff(states, axis=0), axis=1)
    if not len(steps):
        return states
    jumps = np.flatnonzero(steps > 3.0 * np.quantile(steps, 0.95))
    return np.insert(states, jumps + 1, np.nan, axis=0)


def line_through(points: Array, key: str, width: float, dash: str = "solid") -> Any:
    """A trace through points (N, 2); NaN interrupts it."""
    line = {"color": COLOURS.get(key), "width": width, "dash": dash}
    return plotly().Scatter(x=points[:, 0], y=points[:, 1], mode="lines", line=line, **legend(key))


def _joined(trajectories: Sequence[Array]) -> Array:
    gap = np.full((1, trajectories[0].shape[1]), np.nan)
    return np.concatenate([part for one in trajectories for part in (broken(one), gap)])


def _show(made: Any, points: Array) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    edge = 0.12 * (high - low)
    made.update_xaxes(range=[low[0] - edge[0], high[0] + edge[0]])
    made.update_yaxes(range=[low[1] - edge[1], high[1] + edge[1]])


def equal_axes(made: Any) -> None:
    """Draw both axes to one scale."""
    made.update_xaxes(constrain="domain")
    made.update_yaxes(constrain="domain", scaleanchor="x", scaleratio=1)

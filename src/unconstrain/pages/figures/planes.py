"""Pictures in a plane: vector fields and paths."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array, require_extra
from .style import COLOURS, DASHES, INK, figure, keyed

# In the order in which they are drawn, with their widths: what lies below shows at the edges.
_ARROWS = {"inconsistency": 1.8, "direct": 1.8, "hybrid": 1.8, "robust": 1.8, "truth": 0.8, "observed": 0.8}


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
    height: int = 430,
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
    """
    made = figure(title, *labels, height=height)
    [axes] = made.axes
    if trajectories:
        axes.plot(*_joined(trajectories).T, **keyed(trajectories_are, linewidth=1.1))
    for key in sorted(fields, key=list(_ARROWS).index):
        vectors = scale * clipped(fields[key], longest)
        axes.plot(*arrow_lines(points, vectors).T, **keyed(key, linewidth=_ARROWS[key]))
    axes.set_aspect("equal")
    if fields:
        low, high = points.min(axis=0), points.max(axis=0)
        edge = np.maximum(0.12 * (high - low), 1e-12)
        axes.set(xlim=(low[0] - edge[0], high[0] + edge[0]), ylim=(low[1] - edge[1], high[1] + edge[1]))
    return made


def paths(
    lines: Sequence[tuple[str, Array]],
    *,
    reach: float | None = None,
    title: str = "",
    labels: tuple[str, str] = ("first axis (m)", "second axis (m)"),
    height: int = 400,
    equal: bool = True,
) -> Any:
    """Paths in a plane, each with a dot where it starts.

    Parameters
    ----------
    lines : sequence of (key, points)
        Points (T, 2).
    reach : float, optional
        The axes span [−reach, reach]; what is beyond is not drawn.
    title, labels, height
        As in :func:`vector_field`.
    equal : bool
        Both axes to one scale.
    """
    made = figure(title, *labels, height=height)
    [axes] = made.axes
    for key, line in lines:
        recorded = key in ("observed", "training")
        shown = broken(line) if recorded else line
        axes.plot(*shown.T, **keyed(key, linewidth=1.0 if recorded else 1.9, linestyle=DASHES.get(key, "-")))
        axes.plot(*line[:1].T, **keyed(key, marker="o", markersize=4 if recorded else 6))
    if equal:
        axes.set_aspect("equal")
    if reach is not None:
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
    return made


def known_map(
    points: Array,
    values: Array,
    marked: Array,
    *,
    labels: tuple[str, str],
    scale: str,
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
    directions : ndarray, shape (K, 2), optional
        Drawn through the marked points as lines, the longest as long as an eighth of the picture.
    top : float
        Colours end there, or at the largest value if that is larger.
    """
    made = figure("", *labels, height=430)
    [axes] = made.axes
    order = np.argsort(values, kind="stable")  # what is known least lies on top
    shades = require_extra("matplotlib.colors", "viz").LinearSegmentedColormap.from_list(
        "known", [COLOURS["training"], COLOURS["inconsistency"]]
    )
    end = max(float(values.max()), top)
    small = {"rasterized": True, "linewidths": 0, "antialiased": False}  # in bytes
    drawn = axes.scatter(*points[order].T, 9, values[order], cmap=shades, vmin=0.0, vmax=end, **small)
    made.colorbar(drawn, label=scale).outline.set_visible(False)
    if directions is not None and len(marked):
        reach = float(np.ptp(points, axis=0).max()) / 16
        ways = directions * reach / max(float(np.linalg.norm(directions, axis=1).max()), 1e-300)
        axes.plot(*strokes(marked, ways).T, **keyed("to leave free", color=COLOURS["inconsistency"], linewidth=2))
    ring = {"markersize": 14, "markerfacecolor": "#ffffff", "markeredgecolor": COLOURS["inconsistency"]}
    axes.plot(*marked.T, "o", **ring)
    for number, place in enumerate(marked, 1):
        axes.annotate(str(number), place, ha="center", va="center", color=INK, fontsize=9)
    return made


def clipped(vectors: Array, longest: float) -> Array:
    """Vectors (A, d), those that are longer than ``longest`` cut to it."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(lengths, 1e-300))


def strokes(points: Array, half: Array) -> Array:
    """Lines through points (K, n) to either side as one broken line, with a row of NaN after each, shape (3 K, n)."""
    return np.stack([points - half, points + half, np.full_like(points, np.nan)], axis=1).reshape(-1, points.shape[1])


def arrow_lines(points: Array, vectors: Array) -> Array:
    """Arrows from points (A, 2) by vectors (A, 2) as one broken line, six rows each, the last of them NaN."""
    tips = points + vectors
    angle, head = 0.45, 0.32  # between barb and shaft, radians; length of a barb as a share of the arrow's
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


def _joined(trajectories: Sequence[Array]) -> Array:
    gap = np.full((1, trajectories[0].shape[1]), np.nan)
    return np.concatenate([part for one in trajectories for part in (broken(one), gap)])

"""Pictures of errors, and of ratios of errors, beside those printed in the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array, require_extra
from ...pages.figures.style import COLOURS, DASHES, MARKERS, METHODS, figure, keyed, log_axis, power, readable


def bands(
    x: Array,
    curves: Mapping[str, tuple[Array, Array]],
    *,
    title: str,
    labels: tuple[str, str],
    log: bool = False,
    top: float | None = None,
    height: int = 380,
) -> Any:
    """Means with a band of one standard deviation.

    Parameters
    ----------
    x : ndarray, shape (K,)
    curves : dict
        Key to means (K,) and standard deviations (K,).
    title : str
    labels : tuple of str
        Of the axes.
    log : bool
        A logarithmic vertical axis; bands that reach zero then end at its lower edge.
    top : float, optional
        Where the vertical axis ends.
    height : int
        Pixels.
    """
    made = figure(title, *labels, height=height)
    [axes] = made.axes
    means = np.concatenate([mean for mean, _ in curves.values()])
    floor = 0.5 * means[means > 0].min() if log and (means > 0).any() else 0.0
    for key, (mean, sd) in curves.items():
        axes.fill_between(x, np.maximum(mean - sd, floor), mean + sd, **keyed(key, alpha=0.15, linewidth=0))
    for key, (mean, _) in curves.items():
        look = {"marker": MARKERS[key], "linestyle": DASHES.get(key, "-"), "markersize": 5}
        axes.plot(x, mean, **keyed(key, **look))
    if log:
        log_axis(axes)
        high = max(float((mean + sd).max()) for mean, sd in curves.values())
        axes.set_ylim(floor or 1e-12, 1.5 * (high or 1.0))
    elif top is not None:
        axes.set_ylim(0.0, top)
    return made


def dots(
    groups: Sequence[str],
    values: Mapping[str, Sequence[tuple[float | None, float | None]]],
    printed: Mapping[str, Sequence[float | None]],
    *,
    title: str,
    label: str,
    height: int = 360,
) -> Any:
    """Errors on a logarithmic axis, ours filled and the paper's open.

    Parameters
    ----------
    groups : sequence of str
        Of the horizontal axis.
    values : dict
        Method to (mean, standard deviation) for each group.
    printed : dict
        Method to the paper's mean for each group, None where there is none.
    title, label : str
        Of the figure and its vertical axis.
    height : int
        Pixels.
    """
    made = figure(title, "", label, height=height)
    [axes] = made.axes
    place = dict(zip(METHODS, (-0.24, 0.0, 0.24), strict=True))
    at = np.arange(len(groups), dtype=np.float64)
    for key, pairs in values.items():
        mean, sd = np.array(pairs, dtype=np.float64).T
        look = {"marker": MARKERS[key], "markersize": 8}
        for where, value, more in zip(at + place[key] - 0.045, mean, sd, strict=True):
            axes.plot([where, where], [value, value + more], **keyed(key, linewidth=1.3))
        axes.plot(at + place[key] - 0.045, mean, **keyed(key, linestyle="", **look))
        theirs = [np.nan if value is None else value for value in printed.get(key, [None] * len(at))]
        axes.plot(at + place[key] + 0.045, theirs, **keyed(key, linestyle="", fillstyle="none", **look))
    axes.set_xticks(at, groups)
    axes.set_xlim(-0.5, len(groups) - 0.5)
    axes.grid(axis="x", visible=False)
    log_axis(axes)
    return made


RATIO_COLOURS = {"nUPE": "#56b4e9", "nCPE": "#e69f00"}
"""Of errors rather than methods, in :func:`ratios`."""


def ratios(x: Array, curves: Mapping[str, Array], *, labels: tuple[str, str], height: int = 380) -> Any:
    """Ratios of errors on a logarithmic axis, with a line at one.

    Parameters
    ----------
    x : ndarray, shape (K,)
    curves : dict
        Name of an error to ratios (K,).
    labels : tuple of str
        Of the axes.
    height : int
        Pixels.
    """
    made = figure("", *labels, height=height)
    [axes] = made.axes
    for (name, values), marker in zip(curves.items(), "osD", strict=False):
        axes.plot(x, values, **keyed(name, color=RATIO_COLOURS.get(name), marker=marker, markersize=5))
    axes.axhline(1.0, color=COLOURS["truth"], linewidth=1, linestyle="--")
    log_axis(axes)
    axes.yaxis.set_minor_formatter(lambda value, _: power(value) if f"{value:e}"[0] in "25" else "")
    return made


def ratio_table(
    rows: Sequence[str], columns: Sequence[str], values: Array, *, title: str = "", scale: str = "", top: float = 10.0
) -> Any:
    """Ratios as coloured cells with their numbers, on a logarithmic scale from ``1 / top`` to ``top``.

    Parameters
    ----------
    rows, columns : sequence of str
        Labels, the first row on top.
    values : ndarray, shape (R, C)
        NaN leaves a cell empty.
    title, scale : str
        Of the figure and of the colours.
    top : float
        What is beyond has the colour of the end.
    """
    made = figure(title, height=26 * len(rows) + 150)
    [axes] = made.axes
    logs = np.log10(np.where(values > 0, values, np.nan))
    end = float(np.log10(top))
    shades = require_extra("matplotlib.colors", "viz").LinearSegmentedColormap.from_list(
        "ratios", [COLOURS["direct"], "#f7f7f7", COLOURS["inconsistency"]]
    )
    cells = axes.pcolormesh(np.clip(logs, -end, end), cmap=shades, vmin=-end, vmax=end, edgecolor="none")
    for row, column in np.ndindex(*values.shape):
        text, colour = _short(float(values[row, column])), readable(cells.to_rgba(logs[row, column]))
        axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize=9, color=colour)
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns, rotation=35, ha="right")
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows)
    axes.invert_yaxis()
    axes.grid(visible=False)
    bar = made.colorbar(cells, label=scale, ticks=[-end, 0.0, end])
    bar.ax.set_yticklabels([f"{1 / top:g}", "1", f"{top:g}"])
    bar.outline.set_visible(False)
    return made


def _short(value: float) -> str:
    """A ratio in five characters at most."""
    if np.isnan(value):
        return ""
    return f"{value:.3g}" if value < 999.5 else f"{value:.2g}".replace("e+0", "e") if value >= 9950 else f"{value:.0f}"

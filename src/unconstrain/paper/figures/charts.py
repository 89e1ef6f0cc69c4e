"""Pictures of errors, and of ratios of errors, beside those printed in the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array
from ...pages.figures.style import COLOURS, LABELS, MARKERS, METHODS, figure, legend, log_axis, translucent


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
    means = np.concatenate([mean for mean, _ in curves.values()])
    floor = 0.5 * means[means > 0].min() if log and (means > 0).any() else 0.0
    for key, (mean, sd) in curves.items():
        edge = np.concatenate([mean + sd, np.maximum(mean - sd, floor)[::-1]])
        shade = {"fill": "toself", "fillcolor": translucent(COLOURS[key], 0.15), "line": {"width": 0}}
        around = np.concatenate([x, x[::-1]])
        made.add_scatter(x=around, y=edge, mode="lines", hoverinfo="skip", **shade, **legend(key, first=False))
    for key, (mean, _) in curves.items():
        look = {"line": {"color": COLOURS[key], "width": 2}, "marker": {"symbol": MARKERS[key], "size": 7}}
        made.add_scatter(x=x, y=mean, mode="lines+markers", **look, **legend(key))
    if log:
        high = max(float((mean + sd).max()) for mean, sd in curves.values())
        log_axis(made, range=[np.log10(floor or 1e-12), np.log10(1.5 * (high or 1.0))])
    elif top is not None:
        made.update_yaxes(range=[0.0, top])
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
    place = dict(zip(METHODS, (-0.24, 0.0, 0.24), strict=True))
    at = np.arange(len(groups), dtype=np.float64)
    for key, pairs in values.items():
        mean, sd = np.array(pairs, dtype=np.float64).T
        marker = {"color": COLOURS[key], "symbol": MARKERS[key], "size": 12}
        bar = {"type": "data", "symmetric": False, "array": sd, "arrayminus": 0 * sd, "thickness": 1.4, "width": 5}
        made.add_scatter(
            x=at + place[key] - 0.045, y=mean, error_y=bar, mode="markers", marker=marker, **legend(key),
            hovertemplate=f"{LABELS[key]}, ours: %{{y:.3g}}<extra></extra>",
        )  # fmt: skip
        theirs = [np.nan if value is None else value for value in printed.get(key, [None] * len(at))]
        empty = marker | {"symbol": f"{MARKERS[key]}-open", "line": {"width": 2}}
        made.add_scatter(
            x=at + place[key] + 0.045, y=theirs, mode="markers", marker=empty, **legend(key, first=False),
            hovertemplate=f"{LABELS[key]}, paper: %{{y:.3g}}<extra></extra>",
        )  # fmt: skip
    made.update_xaxes(tickvals=at, ticktext=list(groups), range=[-0.5, len(groups) - 0.5], showgrid=False, ticks="")
    log_axis(made)
    return made


RATIO_COLOURS = {"nUPE": "#56b4e9", "nCPE": "#e69f00"}
"""Of errors rather than methods, in :func:`ratios`."""


_ROUND = [digit * 10.0**power for power in range(-3, 5) for digit in (1, 2, 5)]


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
    for (name, values), symbol in zip(curves.items(), ("circle", "square", "diamond"), strict=False):
        look = {"line": {"color": RATIO_COLOURS.get(name), "width": 2}, "marker": {"symbol": symbol, "size": 7}}
        made.add_scatter(x=x, y=values, mode="lines+markers", **look, name=name, legendgroup=name)
    made.add_hline(y=1.0, line={"color": COLOURS["truth"], "width": 1, "dash": "dash"})
    made.update_yaxes(type="log", tickvals=_ROUND, ticktext=[f"{tick:g}" for tick in _ROUND])
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
    made = figure(title, "", "", height=30 * len(rows) + 190)
    logs = np.log10(np.where(values > 0, values, np.nan))
    end = float(np.log10(top))
    texts = [[_short(one) for one in line] for line in values]
    ticks = [-end, -end / 2, 0.0, end / 2, end]
    bar = {"title": {"text": scale, "side": "right"}, "thickness": 14, "outlinewidth": 0, "tickvals": ticks}
    bar |= {"ticktext": [f"{10.0**tick:.2g}" for tick in ticks], "len": 0.92, "y": 0.0, "yanchor": "bottom"}
    made.add_heatmap(
        x=list(columns), y=list(rows), z=np.clip(logs, -end, end), zmin=-end, zmax=end, xgap=1, ygap=1,
        colorscale=[[0.0, COLOURS["direct"]], [0.5, "#ffffff"], [1.0, COLOURS["inconsistency"]]], colorbar=bar,
        text=texts, texttemplate="%{text}", textfont={"size": 11}, hoverongaps=False,
        hovertemplate="%{y}, %{x}: %{text}<extra></extra>",
    )  # fmt: skip
    made.update_xaxes(showgrid=False, ticks="", type="category", tickangle=-35)
    made.update_yaxes(showgrid=False, ticks="", type="category", autorange="reversed")
    return made


def _short(value: float) -> str:
    """A ratio in five characters at most."""
    if np.isnan(value):
        return ""
    return f"{value:.3g}" if value < 999.5 else f"{value:.2g}".replace("e+0", "e") if value >= 9950 else f"{value:.0f}"

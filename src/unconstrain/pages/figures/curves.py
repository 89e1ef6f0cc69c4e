"""Pictures of numbers: errors, time series, spectra."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from .style import COLOURS, DASHES, LABELS, dress, figure, legend, log_axis, plotly, translucent


def bars(
    groups: Sequence[str], values: Mapping[str, Sequence[float]], *, title: str, label: str, height: int = 380
) -> Any:
    """One bar for each method in each group; parameters as in :func:`dots`."""
    made = figure(title, "", label, height=height, barmode="group", bargap=0.28, bargroupgap=0.06)
    for key, heights in values.items():
        made.add_bar(x=list(groups), y=list(heights), marker_color=COLOURS[key], **legend(key),
                     hovertemplate=f"{LABELS[key]}, %{{x}}: %{{y:.3g}}<extra></extra>")  # fmt: skip
    made.update_xaxes(showgrid=False, ticks="", type="category")
    made.update_yaxes(rangemode="tozero")
    return made


def over_time(
    times: Array,
    series: Mapping[str, Array],
    names: Sequence[str],
    *,
    title: str = "",
    time_label: str = "time (s)",
    row_height: int = 150,
) -> Any:
    """Several vectors over time, one row for each component.

    Parameters
    ----------
    times : ndarray, shape (T,)
    series : dict
        Key to values (T, d).
    names : sequence of str
        Label of each component, with its unit.
    title, time_label : str
    row_height : int
        Pixels.
    """
    rows = len(names)
    made = plotly("subplots").make_subplots(rows=rows, cols=1, shared_xaxes=True, vertical_spacing=0.12 / rows)
    dress(made, title, row_height * rows + 90)
    for row, name in enumerate(names):
        for key, values in series.items():
            line = {
                "color": COLOURS.get(key),
                "dash": DASHES.get(key, "solid"),
                "width": 1.2 if key == "observed" else 1.8,
            }
            where = legend(key, first=row == 0) | {"row": row + 1, "col": 1}
            made.add_scatter(x=times, y=values[:, row], mode="lines", line=line, **where)
        made.update_yaxes(title_text=name, row=row + 1, col=1)
    made.update_xaxes(title_text=time_label, row=rows, col=1)
    return made


def spectra(eigenvalues: Array, *, title: str = "") -> Any:
    """Eigenvalues of each field, largest first, as shares of its largest, on a logarithmic axis.

    Parameters
    ----------
    eigenvalues : ndarray, shape (M, P)
        Ascending.
    title : str
    """
    made = figure(title, "weight direction, best determined first", "λ / largest λ", height=380)
    largest = np.maximum(eigenvalues[:, -1:], 1e-300)
    shares = np.maximum(eigenvalues / largest, 1e-16)[:, ::-1]
    order = np.arange(1, shares.shape[1] + 1)
    for index, share in enumerate(shares):
        line = {"color": translucent(COLOURS["inconsistency"], 0.35), "width": 1.2}
        where = {"name": "each field", "legendgroup": "each field", "showlegend": index == 0}
        made.add_scatter(
            x=order,
            y=share,
            mode="lines",
            line=line,
            hovertemplate=f"field {index + 1}: %{{y:.2g}}<extra></extra>",
            **where,
        )
    middle = np.exp(np.median(np.log(shares), axis=0))
    look = {"line": {"color": COLOURS["truth"], "width": 2}, "marker": {"size": 6}}
    made.add_scatter(x=order, y=middle, mode="lines+markers", name="median", legendgroup="median", **look)
    log_axis(made)
    return made


def step_scores(scores: Array, chosen: NDArray[np.intp], *, title: str = "") -> Any:
    """Held-out score against how many directions are left undetermined.

    Parameters
    ----------
    scores : ndarray, shape (M, P + 1)
        For 0 to P undetermined directions; those that are not finite are left out.
    chosen : ndarray of int, shape (M,)
        What was chosen in each model.
    title : str
    """
    made = figure(title, "undetermined weight directions", "held-out score / best", height=380)
    scores = np.where(np.isfinite(scores) & (scores > 0), scores, np.nan)
    for index, score in enumerate(scores):
        if np.isnan(score).all():
            continue
        ratio = score / np.nanmin(score)
        group = {"name": f"field {index + 1}", "legendgroup": f"field {index + 1}", "showlegend": False}
        line = {"color": translucent(COLOURS["truth"], 0.35 if len(scores) > 1 else 1.0), "width": 1.4}
        made.add_scatter(x=np.arange(len(ratio)), y=ratio, mode="lines", line=line, **group)
        at = int(chosen[index])
        marker = {"color": COLOURS["hybrid"], "size": 10, "line": {"color": "white", "width": 1}}
        made.add_scatter(x=[at], y=ratio[at : at + 1], mode="markers", marker=marker, **group)
    log_axis(made, dtick=None)
    return made

"""Pictures of numbers: errors, time series, spectra."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from .style import COLOURS, DASHES, figure, keyed, log_axis


def bars(groups: Sequence[str], values: Mapping[str, Sequence[float]], *, title: str, label: str) -> Any:
    """One bar for each method in each group.

    Parameters
    ----------
    groups : sequence of str
        Of the horizontal axis.
    values : dict
        Key to the height of its bar in each group.
    title, label : str
        Of the picture and its vertical axis.
    """
    made = figure(title, "", label)
    [axes] = made.axes
    at, wide = np.arange(len(groups)), 0.76 / max(len(values), 1)
    for index, (key, heights) in enumerate(values.items()):
        for place, tall in zip(at - 0.38 + wide * (index + 0.5), heights, strict=True):
            axes.bar(place, tall, 0.9 * wide, **keyed(key))
    axes.set_xticks(at, groups if len(groups) <= 40 else [""] * len(groups), rotation=90 if len(groups) > 8 else 0)
    axes.grid(axis="x", visible=False)
    return made


def over_time(
    times: Array,
    series: Mapping[str, Array],
    names: Sequence[str],
    *,
    title: str = "",
    time_label: str = "time (s)",
    row_height: int = 110,
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
    made = figure(title, time_label, height=row_height * len(names) + 60, rows=len(names))
    for row, (axes, name) in enumerate(zip(made.axes, names, strict=True)):
        axes.set_ylabel(name)
        for key, values in series.items():
            thin = 1.1 if key == "observed" else 1.6
            axes.plot(times, values[:, row], DASHES.get(key, "-"), **keyed(key, linewidth=thin))
    return made


def spectra(eigenvalues: Array, *, title: str = "") -> Any:
    """Eigenvalues of each field, largest first, as shares of its largest, on a logarithmic axis.

    Parameters
    ----------
    eigenvalues : ndarray, shape (M, P)
        Ascending.
    title : str
    """
    made = figure(title, "weight direction, best determined first", "λ / largest λ")
    [axes] = made.axes
    largest = np.maximum(eigenvalues[:, -1:], 1e-300)
    shares = np.maximum(eigenvalues / largest, 1e-16)[:, ::-1]
    order = np.arange(1, shares.shape[1] + 1)
    axes.plot(order, shares.T, **keyed("each field", color=COLOURS["inconsistency"], alpha=0.35, linewidth=1.1))
    axes.plot(order, np.exp(np.median(np.log(shares), axis=0)), ".-", **keyed("median", color=COLOURS["truth"]))
    log_axis(axes)
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
    made = figure(title, "undetermined weight directions", "held-out score / best")
    [axes] = made.axes
    scores = np.where(np.isfinite(scores) & (scores > 0), scores, np.nan)
    for score, at in zip(scores, chosen, strict=True):
        if np.isnan(score).all():
            continue
        ratio = score / np.nanmin(score)
        axes.plot(ratio, color=COLOURS["truth"], alpha=0.35 if len(scores) > 1 else 1.0, linewidth=1.3)
        axes.plot(int(at), ratio[at], "o", color=COLOURS["hybrid"], markersize=7)
    log_axis(axes)
    return made

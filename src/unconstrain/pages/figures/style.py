"""One look for all pictures: a colour, a marker and a dash for each method."""

import json
from importlib import resources
from types import ModuleType
from typing import Any

from ...base.arrays import require_extra

METHODS = ("direct", "inconsistency", "hybrid")

# Okabe and Ito's palette: told apart with any colour vision, and by lightness in print.
COLOURS = {
    "direct": "#0072b2",
    "inconsistency": "#d55e00",
    "hybrid": "#009e73",
    "truth": "#1a1a1a",
    "observed": "#1a1a1a",
    "training": "#9aa0a6",
    "held out": "#cc79a7",
}
"""The same on every page."""

PALETTE = ("#56b4e9", "#e69f00", "#cc79a7", "#6f4e9c", "#7a6a2f", "#8a8f96")
"""For what is not a method: surfaces, demonstrations, fields."""

LABELS = {
    "direct": "direct",
    "inconsistency": "inconsistency",
    "hybrid": "hybrid",
    "truth": "true policy",
    "observed": "demonstration",
    "training": "training data",
    "held out": "held out",
}

MARKERS = {"direct": "circle", "inconsistency": "square", "hybrid": "diamond"}
DASHES = {"direct": "dash", "inconsistency": "dot", "hybrid": "solid", "truth": "solid", "observed": "solid"}

INK = "#33373d"
RULE = "#e3e6ea"


def plotly(module: str = "graph_objects") -> ModuleType:
    """Import a module of plotly, or say which extra brings it."""
    return require_extra(f"plotly.{module}", "viz")


def figure(title: str = "", x: str = "", y: str = "", height: int = 400, **layout: Any) -> Any:
    """An empty plotly figure in the house style.

    Parameters
    ----------
    title, x, y : str
        Of the figure and its axes.
    height : int
        Pixels; the width is that of the page.
    **layout
        Anything else for plotly's layout.
    """
    made = plotly().Figure()
    dress(made, title, height)
    made.update_layout(xaxis_title_text=x, yaxis_title_text=y, **layout)
    return made


def dress(made: Any, title: str, height: int) -> None:
    """Put the house style on a plotly figure."""
    look = json.loads((resources.files(__package__) / "look.json").read_text())
    made.update_layout(look["layout"], title_text=title, height=height, font_color=INK, margin_t=38 if title else 14)
    for each in (made.update_xaxes, made.update_yaxes):
        each(look["axis"], gridcolor=RULE)


def legend(key: str, first: bool = True) -> dict[str, Any]:
    """Arguments that put a trace into the legend under a key, so that one click hides all of that key."""
    return {"name": LABELS.get(key, key), "legendgroup": key, "showlegend": first}


def translucent(colour: str, opacity: float) -> str:
    """A colour such as ``#0072b2`` with an opacity."""
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def log_axis(made: Any, **axis: Any) -> None:
    """Make the vertical axis logarithmic, with a tick for each power of ten unless told otherwise."""
    # plotly writes powers a quarter larger than other ticks.
    made.update_yaxes(**{"type": "log", "dtick": 1, "tickfont_size": 10, **axis})

"""One look for all pictures: a colour, a marker and a dash for each method; and pictures as text."""

import io
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from html import escape
from importlib import resources
from typing import Any

import numpy as np

from ...base.arrays import Array, require_extra
from .compact import compact

METHODS = ("direct", "inconsistency", "hybrid")

# Okabe and Ito's palette: told apart with any colour vision, and by lightness in print.
COLOURS = {
    "direct": "#0072b2",
    "inconsistency": "#d55e00",
    "hybrid": "#009e73",
    "robust": "#8a63d2",
    "truth": "#1a1a1a",
    "observed": "#1a1a1a",
    "training": "#9aa0a6",
    "held out": "#cc79a7",
    "roll-out, free": "#56b4e9",
    "roll-out, new plane": "#e69f00",
    "extrapolated": "#80868b",
}
"""The same on every page."""

PALETTE = ("#56b4e9", "#e69f00", "#cc79a7", "#8a63d2", "#7a6a2f", "#8a8f96")
"""For what is not a method: surfaces, demonstrations, fields."""

LABELS = {
    "direct": "direct",
    "inconsistency": "inconsistency",
    "hybrid": "hybrid",
    "robust": "robust (default)",
    "truth": "true policy",
    "observed": "demonstration",
    "training": "training data",
    "held out": "held out",
    "extrapolated": "no demonstration passes near",
}

MARKERS = {"direct": "o", "inconsistency": "s", "hybrid": "D", "robust": "^"}
DASHES = {"direct": "--", "inconsistency": ":", "hybrid": "-", "robust": "-", "extrapolated": "--"}

INK = "#33373d"
RULE = "#e3e6ea"

THEMED = {INK: "var(--ink)", COLOURS["truth"]: "var(--ink)", RULE: "var(--rule)", "#ffffff": "var(--paper)"}
"""Colours that the page decides, by its variables: they are others in the dark."""

_KEY, _MOST_BARS = "key:", 12  # of one key, told one by one to those who cannot see them
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@contextmanager
def _look() -> Iterator[None]:
    sheet = str(resources.files(__package__) / "look.mplstyle")
    with require_extra("matplotlib.style", "viz").context(sheet), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of limits that are too near to draw
        yield


def figure(title: str = "", x: str = "", y: str = "", height: int = 320, rows: int = 1, **axes: Any) -> Any:
    """An empty picture in the house style, one pixel for each of its points.

    Parameters
    ----------
    title, x, y : str
        Of the picture and its axes.
    height : int
        Pixels; the width is that of the page.
    rows : int
        Axes below each other, with one horizontal axis.
    **axes
        For matplotlib's axes.
    """
    with _look():
        made = require_extra("matplotlib.figure", "viz").Figure(figsize=(1.0, height / 72))
        made.subplots(rows, sharex=True, subplot_kw=axes)
        made.axes[0].set_title(title)
        made.axes[-1].set_xlabel(x)
        made.axes[0].set_ylabel(y)
    return made


def keyed(key: str, **look: Any) -> dict[str, Any]:
    """Arguments of an artist that a key of the page shows and hides, in the colour of the key."""
    return {"gid": f"{_KEY}{key}", "color": COLOURS.get(key, PALETTE[0])} | look


def log_axis(axes: Any) -> None:
    """Make the vertical axis logarithmic, with powers as text."""
    with _look():
        axes.set_yscale("log")
    axes.yaxis.set_major_formatter(lambda value, _: power(value))
    axes.yaxis.set_minor_formatter(lambda *_: "")


def power(value: float) -> str:
    """A number of an axis, such as ``0.1``, ``20`` or ``10⁻⁶``."""
    exponent = round(float(np.log10(value)))
    return f"{value:g}" if abs(exponent) < 4 else f"10{str(exponent).translate(RAISED)}"


def readable(colour: Sequence[float]) -> str:
    """Black or white, whichever is read better on a colour (red, green, blue from 0 to 1, with or without alpha)."""
    linear = [((value + 0.055) / 1.055) ** 2.4 if value > 0.04045 else value / 12.92 for value in colour[:3]]
    light = float(np.dot(linear, (0.2126, 0.7152, 0.0722)))
    return "#fefefe" if 1.05 / (light + 0.05) > (light + 0.05) / 0.05 else "#000000"  # themed colours would change


def svg(made: Any, width: int, alternative: str) -> str:
    """A picture as SVG to stand in a page: its text is text, its colours follow the page, and its keys can be hidden.

    Parameters
    ----------
    made : matplotlib.figure.Figure
    width : int
        Pixels; the page scales it.
    alternative : str
        What it shows, for those who cannot see it.
    """
    made.set_figwidth(width / 72)
    stream = io.StringIO()
    with _look():
        made.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"\n\s*", "\n", text)
    text = re.sub(rf'<g id="{_KEY}([^"]*)"', r'<g data-key="\1"', re.sub(rf'<g id="(?!{_KEY})[^"]*"', "<g", text))
    for colour, variable in THEMED.items():
        text = text.replace(colour, variable)
    opening = re.search(r'viewBox="[^"]*"', text)[0]  # type: ignore[index]
    opening += f""" font-family="'DejaVu Sans', sans-serif" role="img" aria-label="{escape(alternative)}\""""
    return f"<svg {opening}>{compact(text[text.index('>') + 1 :])}"


def described(made: Any, names: Mapping[str, str] = LABELS) -> str:
    """What a picture shows, in words: titles, axes, how far lines and shades reach, bars; keys by their names."""
    return " ".join(_described(axes, names) for axes in made.axes if axes.get_label() != "<colorbar>")


def _described(axes: Any, names: Mapping[str, str]) -> str:
    title, x, y = axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel()
    in_space = axes.name == "3d"
    lines: dict[str, list[Array]] = {}
    for line in axes.lines:
        if str(line.get_gid()).startswith(_KEY):
            upwards = line.get_data_3d()[2] if in_space else line.get_ydata()
            lines.setdefault(line.get_gid().removeprefix(_KEY), []).append(np.asarray(upwards, float))
    said = [f"{names.get(key, key)} {_reach(np.concatenate(values))}" for key, values in lines.items()]
    said += [f"{one.colorbar.ax.get_ylabel()} {_reach(one.get_array())}" for one in axes.collections if one.colorbar]
    plotted = f"{axes.get_zlabel()} over {x} and {y}" if in_space else f"{y} over {x}" if x and y else x or y
    parts = [": ".join(filter(None, (title, plotted))), *_bars(axes, names), ", ".join(said)]
    return f"{'; '.join(filter(None, parts))}."


def _bars(axes: Any, names: Mapping[str, str]) -> Iterator[str]:
    """The bars of each key with their groups; of many, how far they reach."""
    groups = [one.get_text().replace("\n", " ") for one in axes.get_xticklabels()]
    for name in dict.fromkeys(str(bar.get_gid()).removeprefix(_KEY) for bar in axes.patches):
        tall = np.array([bar.get_height() for bar in axes.patches if bar.get_gid() == f"{_KEY}{name}"])
        each = [f"{group} {height:.3g}" for group, height in zip(groups, tall, strict=True)]
        yield f"{names.get(name, name)} {', '.join(each) if len(each) <= _MOST_BARS else _reach(tall)}"


def _reach(values: Array) -> str:
    values = values[np.isfinite(values)]
    return f"from {values.min():.3g} to {values.max():.3g}" if len(values) else "empty"

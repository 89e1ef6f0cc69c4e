"""The parts of a page: text, numbers, tables, pictures."""

from __future__ import annotations

import base64
import inspect
import re
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from typing import Any

import numpy as np

from .figures.style import COLOURS, LABELS, MARKERS, PALETTE, plotly

__all__ = ["document", "mean_sd", "number", "paragraph", "picture", "section", "settings_table", "table", "tiles"]

STYLE = """
:root { --ink: #24282e; --soft: #5c6570; --rule: #dfe3e8; --wash: #f6f7f9; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1160px; margin: 0 auto; padding: 2.2rem 1.25rem 4rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .6rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.8rem 0 .5rem; }
p { max-width: 46rem; margin: .5rem 0; }
p.lead { font-size: 1.08rem; }
figure { margin: 1.1rem 0 0; }
figcaption, .note { color: var(--soft); font-size: .92rem; max-width: 52rem; margin-top: .4rem; }
.panels { display: grid; gap: .5rem 1rem;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, var(--least)), 1fr)); }
.panels > div { min-width: 0; }
.key { display: flex; flex-wrap: wrap; gap: .35rem .5rem; margin: .3rem 0 .6rem; }
.key button { display: inline-flex; align-items: center; gap: .45rem; font: inherit; font-size: .9rem;
  color: var(--ink); background: #fff; border: 1px solid var(--rule);
  border-radius: 999px; padding: .2rem .75rem; cursor: pointer; }
.key button:hover { background: var(--wash); }
.key button:focus-visible { outline: 2px solid #0072b2; outline-offset: 1px; }
.key button[aria-pressed="false"] { color: var(--soft); text-decoration: line-through; opacity: .6; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; margin: .6rem 0; }
th, td { padding: .32rem .6rem; text-align: right; border-bottom: 1px solid var(--rule); white-space: nowrap; }
th { font-weight: 600; border-bottom: 1.5px solid var(--ink); vertical-align: bottom; }
th.left, td.left { text-align: left; }
td.text { text-align: left; white-space: normal; min-width: 14rem; color: var(--soft); }
tr.rule td { border-top: 1.5px solid var(--ink); }
.dot { display: inline-block; width: .7em; height: .7em; border-radius: 50%; margin-right: .5em; }
.tiles { display: grid; gap: .7rem; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); margin: 1.2rem 0; }
.tiles div { background: var(--wash); border-radius: 10px; padding: .7rem .95rem; }
.tiles b { display: block; font-size: 1.45rem; line-height: 1.25; font-variant-numeric: tabular-nums; }
.tiles span { color: var(--soft); font-size: .88rem; }
details { margin: 1.4rem 0; border: 1px solid var(--rule); border-radius: 10px; padding: .6rem 1rem; }
summary { cursor: pointer; font-weight: 600; }
code { font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; font-size: .92em; }
@media (max-width: 600px) { table { font-size: .86rem; } th, td { padding: .3rem .4rem; } }
@media print { .key button { border-color: transparent; } main { max-width: none; } }
"""

# One key for several pictures: a click hides all traces of its group in them.
SCRIPT = """
// The first of two panels is drawn before the second is there to share the row with.
window.addEventListener("load", function () {
  document.querySelectorAll(".js-plotly-plot").forEach(function (plot) { Plotly.Plots.resize(plot); });
});
document.addEventListener("click", function (event) {
  var button = event.target.closest(".key button");
  if (!button) return;
  var shown = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(shown));
  button.closest("figure").querySelectorAll(".js-plotly-plot").forEach(function (graph) {
    var which = [];
    graph.data.forEach(function (trace, index) { if (trace.legendgroup === button.value) which.push(index); });
    if (which.length) Plotly.restyle(graph, { visible: shown }, which);
  });
});
"""

# Nothing may be fetched: a report has to open in ten years, on a machine without a network.
POLICY = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:"

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def document(title: str, lead: str, *parts: str) -> str:
    """A whole page that needs nothing else.

    Parameters
    ----------
    title : str
        Text.
    lead : str
        What one sees, in plain words; HTML.
    *parts : str
        The body; HTML.
    """
    library = plotly("offline").get_plotlyjs()
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        f'<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n<style>{STYLE}</style>\n'
        f"<script>{library}</script>\n<script>{SCRIPT}</script>\n</head>\n<body>\n<main>\n"
        f'<h1>{escape(title)}</h1>\n<p class="lead">{lead}</p>\n' + "\n".join(parts) + "\n</main>\n</body>\n</html>\n"
    )


def section(heading: str, *parts: str) -> str:
    """A heading (text) and what is below it (HTML)."""
    return f"<h2>{escape(heading)}</h2>\n" + "\n".join(parts)


def paragraph(html: str) -> str:
    """Some HTML as a paragraph."""
    return f"<p>{html}</p>"


def tiles(values: Sequence[tuple[str, str]]) -> str:
    """A few numbers to see first, as pairs of number and meaning; text."""
    cells = "".join(f"<div><b>{escape(value)}</b><span>{escape(what)}</span></div>" for value, what in values)
    return f'<div class="tiles">{cells}</div>'


def number(value: float | None, digits: int = 3) -> str:
    """A number to read, with three significant digits: ``0.0131``, ``50200``, ``1.2×10⁻⁷``; "–" for none."""
    if value is None or not np.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if -5 < power < 6:
        text, raised = f"{float(f'{mantissa}e{power}'):.{max(digits - 1 - power, 0)}f}", ""
    else:
        text, raised = mantissa, f"×10{str(power).translate(_SUPERSCRIPTS)}"
    shorter = text.rstrip("0").rstrip(".") if "." in text else text
    return shorter.replace("-", "−") + raised


def mean_sd(mean: float | None, sd: float | None, scale: float = 100.0) -> str:
    """Such as ``0.0131 ± 0.002``, after scaling; "–" where there is no mean."""
    if mean is None:
        return "–"
    return f"{number(scale * mean)} ± {number(None if sd is None else scale * sd, 2)}"


def label(key: str) -> str:
    """A method or another key with its colour; HTML."""
    return f'<span class="dot" style="background:{COLOURS.get(key, PALETTE[0])}"></span>{escape(LABELS.get(key, key))}'


def table(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, left: int = 1, note: str = "", rules: Sequence[int] = ()
) -> str:
    """A table that scrolls sideways on a narrow screen.

    Parameters
    ----------
    header : sequence of str
        HTML.
    rows : sequence of sequences of str
        HTML.
    left : int
        So many columns are aligned to the left; the others hold numbers.
    note : str
        Below the table; HTML.
    rules : sequence of int
        Rows with a line above.
    """

    def aligned(column: int) -> str:
        return ' class="left"' if column < left else ""

    head = "".join(f"<th{aligned(column)}>{text}</th>" for column, text in enumerate(header))
    body = ""
    for index, row in enumerate(rows):
        cells = "".join(f"<td{aligned(column)}>{text}</td>" for column, text in enumerate(row))
        body += f'<tr class="rule">{cells}</tr>' if index in rules else f"<tr>{cells}</tr>"
    below = f'<p class="note">{note}</p>' if note else ""
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>{below}'


def picture(
    name: str,
    panels: Sequence[Any],
    caption: str,
    *,
    keys: Sequence[str] = (),
    colours: dict[str, str] | None = None,
    labels: dict[str, str] | None = None,
    least: int = 420,
) -> str:
    """Plotly figures side by side, or below each other where the screen is narrow, with one key.

    Parameters
    ----------
    name : str
        Of the picture within the page, such as ``"errors"``.
    panels : sequence of plotly.graph_objects.Figure
    caption : str
        HTML.
    keys : sequence of str
        Groups of traces that can be switched off.
    colours : dict, optional
        Of keys that have no colour of their own.
    labels : dict, optional
        Of keys that are called something else here.
    least : int
        Width below which panels go below each other, pixels.
    """
    drawn = []
    for index, panel in enumerate(panels):
        panel.update_layout(showlegend=False)
        graph = panel.to_html(
            full_html=False,
            include_plotlyjs=False,
            config=_config(panel),
            div_id=f"{name}-{index + 1}",
            default_height=f"{panel.layout.height}px",
        )
        drawn.append(f"<div>{graph}</div>")
    buttons = "".join(_button(key, LABELS | (labels or {}), COLOURS | (colours or {})) for key in keys)
    key = f'<div class="key">{buttons}</div>' if keys else ""
    style = f"--least:{least}px"
    return (
        f'<figure id="{name}">{key}<div class="panels" style="{style}">{"".join(drawn)}</div>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def image(name: str, data: bytes, kind: str, alternative: str, caption: str) -> str:
    """A picture that is part of the page.

    Parameters
    ----------
    name : str
        Of the picture within the page.
    data : bytes
    kind : {"png", "gif"}
    alternative : str
        What it shows, for those who cannot see it.
    caption : str
        HTML.
    """
    encoded = base64.b64encode(data).decode("ascii")
    return (
        f'<figure id="{name}"><img src="data:image/{kind};base64,{encoded}" alt="{escape(alternative)}" '
        f'style="max-width:100%;height:auto"><figcaption>{caption}</figcaption></figure>'
    )


def settings_table(settings: Any) -> str:
    """All settings of an experiment, folded away, with what their docstring says of them."""
    meanings = _meanings(type(settings))
    rows = "".join(
        f'<tr><td class="left"><code>{escape(name)}</code></td><td class="left">{escape(_plain(value))}</td>'
        f'<td class="text">{escape(meanings.get(name, ""))}</td></tr>'
        for name, value in asdict(settings).items()
    )
    head = '<tr><th class="left">setting</th><th class="left">value</th><th class="left">meaning</th></tr>'
    return f'<details><summary>Settings</summary><div class="wide"><table>{head}{rows}</table></div></details>'


def _config(panel: Any) -> dict[str, Any]:
    again = "resetCameraDefault3d" if any(trace.type == "scatter3d" for trace in panel.data) else "resetScale2d"
    return {"responsive": True, "displaylogo": False, "modeBarButtons": [["toImage", again]]}


def _button(key: str, labels: dict[str, str], colours: dict[str, str]) -> str:
    name = labels.get(key, key)
    # A method that goes by another name here is a line like any other.
    mark = _swatch(key if name == LABELS.get(key) else "", colours.get(key, PALETTE[0]))
    return f'<button type="button" aria-pressed="true" value="{escape(key)}">{mark}{escape(name)}</button>'


def _swatch(key: str, colour: str) -> str:
    """The method's marker, or a line; told apart by shape as well as by colour."""
    shapes = {
        "circle": '<circle cx="8" cy="6" r="5"/>',
        "square": '<rect x="3" y="1" width="10" height="10"/>',
        "diamond": '<path d="M8 0l6 6-6 6-6-6z"/>',
    }
    shape = shapes.get(MARKERS.get(key, ""), '<rect x="0" y="4.5" width="16" height="3"/>')
    return f'<svg width="16" height="12" fill="{colour}" aria-hidden="true">{shape}</svg>'


def _plain(value: Any) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(map(_plain, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _meanings(kind: type) -> dict[str, str]:
    """What the numpydoc docstrings of a class and its bases say of each parameter."""
    found: dict[str, str] = {}
    for one in kind.__mro__:
        text = inspect.cleandoc(one.__doc__ or "")
        for names, body in re.findall(r"^(\w[\w, ]*) : .*\n((?:    .*\n?)*)", text, flags=re.MULTILINE):
            plain = re.sub(r":\w+:`~?([^`]*)`", lambda match: match[1].rpartition(".")[2], " ".join(body.split()))
            for name in names.split(", "):
                found.setdefault(name, plain)
    return found

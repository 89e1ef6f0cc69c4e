"""The parts of a page: text, numbers, tables, pictures.

Templates put them into HTML. What goes in is text and is escaped, unless it came from here or from :func:`markup`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arrays import require_extra
from .figures.style import COLOURS, LABELS, MARKERS, PALETTE, RAISED, THEMED, described, svg

if TYPE_CHECKING:
    from markupsafe import Markup as Markup

    from ..evaluation import verdicts

ALONE, WIDER = 620, 50
"""Width for which the text of a picture is made where it is alone in its row, and by how much it is wider than the
least width where it is not, pixels."""


def document(title: str, verdict: verdicts.Verdict, lead: str, *parts: Markup) -> str:
    """A whole page that needs nothing else.

    Parameters
    ----------
    title : str
    verdict : Verdict
        What comes first.
    lead : str
        What one sees, in plain words.
    *parts : Markup
        The body.
    """
    page = _templates().get_template("page.html")
    return str(page.render(title=title, parts=[_part("verdict", verdict), _part("lead", lead), *parts]))


def markup(source: str) -> Markup:
    """HTML on purpose. What its ``format`` puts in is text."""
    require_extra("jinja2", "viz")
    from markupsafe import Markup  # a part of jinja2 in all but name

    return Markup(source)  # noqa: S704 - callers are held to literals by the same rule


def words(passage: str, **values: Any) -> Markup:
    """A passage of ``words.html`` with its values put in."""
    said: Markup = getattr(_templates().get_template("words.html").module, passage)(**values)
    return markup(" ").join(said.split())


def section(heading: str, *parts: Markup) -> Markup:
    """A heading and what is below it."""
    return _part("section", heading, parts)


def paragraph(text: str) -> Markup:
    """Some text as a paragraph."""
    return _part("paragraph", text)


def bullets(texts: Iterable[str]) -> Markup:
    """A list of sentences."""
    return _part("bullets", texts)


def folded(summary: str, part: Markup) -> Markup:
    """Something that is shown on a click."""
    return _part("folded", summary, part)


def tiles(values: Sequence[tuple[str, str]]) -> Markup:
    """A few numbers to see first, as pairs of number and meaning."""
    return _part("tiles", values)


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
        text, raised = mantissa, f"×10{str(power).translate(RAISED)}"
    shorter = text.rstrip("0").rstrip(".") if "." in text else text
    return shorter.replace("-", "−") + raised


def table(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, note: str, left: int = 1, rules: Collection[int] = ()
) -> Markup:
    """A table that scrolls sideways on a narrow screen; the first cell of each row names it.

    Parameters
    ----------
    header : sequence of str
        A line break is kept, here and in the cells.
    rows : sequence of sequences of str
    note : str
        Its caption, below it.
    left : int
        So many columns are aligned to the left; the others hold numbers.
    rules : collection of int
        Rows with a line above.
    """
    return _part("table", header, rows, left, note, rules)


def picture(
    name: str,
    panels: Sequence[Any],
    caption: str,
    *,
    keys: Sequence[str] = (),
    colours: dict[str, str] | None = None,
    labels: dict[str, str] | None = None,
    least: int = 420,
) -> Markup:
    """Pictures side by side, or below each other where the screen is narrow, with one key.

    Parameters
    ----------
    name : str
        Of the picture within the page, such as ``"errors"``.
    panels : sequence of matplotlib.figure.Figure
    caption : str
    keys : sequence of str
        Keys of artists that can be switched off.
    colours : dict, optional
        Of keys that have no colour of their own.
    labels : dict, optional
        Of keys that are called something else here.
    least : int
        Width below which panels go below each other, pixels.
    """
    width = least + WIDER if len(panels) > 1 else ALONE
    named, coloured = LABELS | (labels or {}), COLOURS | (colours or {})
    drawn = [svg(panel, width, described(panel, named)) for panel in panels]
    shown = [_key(key, named.get(key, key), coloured.get(key, PALETTE[0])) for key in keys]
    return _part("picture", name, drawn, caption, shown, least)


def settings_table(settings: Any) -> Markup:
    """All settings of an experiment, folded away, with what their docstring says of them."""
    meanings = _meanings(type(settings))
    rows = [
        (markup("<code>{}</code>").format(name), _plain(value), meanings.get(name, ""))
        for name, value in asdict(settings).items()
    ]
    header = ("setting", "value", "meaning")
    return folded("Settings", table(header, rows, left=3, note="Everything that was set, and what it means."))


@cache
def _templates() -> Any:
    jinja2 = require_extra("jinja2", "viz")
    return jinja2.Environment(
        loader=jinja2.PackageLoader(__package__),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _part(macro: str, *values: Any) -> Markup:
    """What a macro of ``parts.html`` makes of some values."""
    made: Markup = getattr(_templates().get_template("parts.html").module, macro)(*values)
    return made


def _key(value: str, name: str, colour: str) -> dict[str, str]:
    # A method that goes by another name here is a line like any other.
    marker = MARKERS.get(value, "") if name == LABELS.get(value) else ""
    return {"value": value, "name": name, "colour": THEMED.get(colour, colour), "marker": marker}


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
            words = " ".join(body.split()).replace("``", "")
            plain = re.sub(r":\w+:`~?([^`]*)`", lambda match: match[1].rpartition(".")[2], words)
            for name in names.split(", "):
                found.setdefault(name, plain)
    return found

"""Parts that only the pages of the paper's experiments need."""

from __future__ import annotations

import base64

from ...pages import html
from ...pages.figures import COLOURS, LABELS, PALETTE


def mean_sd(mean: float | None, sd: float | None, scale: float = 100.0) -> str:
    """Such as ``0.0131 ± 0.002``, after scaling; "–" where there is no mean."""
    if mean is None:
        return "–"
    return f"{html.number(scale * mean)} ± {html.number(None if sd is None else scale * sd, 2)}"


def label(key: str) -> html.Markup:
    """A method, or another key, with its colour."""
    return html.markup('<span class="dot" style="background:{}"></span>{}').format(
        COLOURS.get(key, PALETTE[0]), LABELS.get(key, key)
    )


def image(name: str, data: bytes, kind: str, alternative: str, caption: str) -> html.Markup:
    """A picture that is part of the page.

    Parameters
    ----------
    name : str
        Of the picture within the page.
    data : bytes
    kind : {"png", "webp"}
    alternative : str
        What it shows, for those who cannot see it.
    caption : str
    """
    source = f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
    return html.markup('<figure id="{}"><img src="{}" alt="{}"><figcaption>{}</figcaption></figure>').format(
        name, source, alternative, caption
    )

"""Text with ``@words@`` to fill in, from the files in the folder ``templates``."""

import re
from collections.abc import Mapping
from importlib import resources
from importlib.metadata import PackageNotFoundError, version


def filled(part: str, fill: Mapping[str, str]) -> str:
    """A template, ``PART.in``, with its words filled in."""
    text = (resources.files(__package__) / "templates" / f"{part}.in").read_text()
    return re.sub(r"@([a-zA-Z_]+)@", lambda found: fill[found[1]], text)


def own_version() -> str:
    """Version of this package."""
    try:
        return version("unconstrain")
    except PackageNotFoundError:
        return "from its sources"

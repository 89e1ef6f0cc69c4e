"""Text with ``@words@`` to fill in, from the files in the folder ``templates``."""

import re
from collections.abc import Mapping
from importlib import resources
from importlib.metadata import PackageNotFoundError, version


def filled(part: str, fill: Mapping[str, str]) -> str:
    """A template, ``PART.in``, with its words filled in."""
    return re.sub(r"@([a-zA-Z_]+)@", lambda found: fill[found[1]], template(f"{part}.in"))


def template(name: str) -> str:
    """The text of a file in the folder."""
    return (resources.files(__package__) / "templates" / name).read_text("utf-8")


def own_version() -> str:
    """Version of this package."""
    try:
        return version("unconstrain")
    except PackageNotFoundError:
        return "from its sources"

"""Pages that are one file each and run by themselves: their parts, in ``static``, put together."""

import json
import re
from importlib import resources
from typing import Any


def assembled(page: str, **values: str) -> str:
    """A page of ``static`` with the files that it names, and values, put in.

    Parameters
    ----------
    page : str
        File in which ``@file NAME@`` stands for another file of the folder, and ``@NAME@`` for a value.
    **values : str
        HTML or JavaScript, as it is.
    """
    folder = resources.files(__package__) / "static"
    text = re.sub(
        r"@file ([a-z.]+)@", lambda found: (folder / found[1]).read_text("utf-8"), (folder / page).read_text("utf-8")
    )
    return re.sub(r"@([a-z]+)@", lambda found: values[found[1]], text)


def literal(data: Any) -> str:
    """Data as JSON that can stand in a script of a page, whatever text it holds."""
    plain = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return plain.replace("<", "\\u003c")

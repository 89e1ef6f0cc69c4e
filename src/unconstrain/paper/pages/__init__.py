"""Results as a page to look at and a file to read by machine.

A page is one HTML file that needs no network and nothing beside it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from ...base import files
from ..experiments.trials import Result
from . import arrival, constraints, figure4, figure5, plain, recorded, regimes, table1, table2, washing

__all__ = ["page", "write"]

# An experiment without a page of its own gets its rows as a table.
_PAGES = {
    "table1": table1.page,
    "figure4": figure4.page,
    "figure5": figure5.page,
    "table2": table2.page,
    "washing": washing.page,
    "regimes": regimes.page,
    "recorded": recorded.page,
    "constraints": constraints.page,
    "arrival": arrival.page,
}


def page(result: Result) -> str:
    """Make the page of a result.

    Parameters
    ----------
    result : Result

    Returns
    -------
    str
        A whole HTML document.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.
    """
    return _PAGES.get(result.name, plain.page)(result)


def write(result: Result, directory: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Write ``NAME.json`` and ``NAME.html`` into a directory, which is made if need be.

    Parameters
    ----------
    result : Result
    directory : path

    Returns
    -------
    tuple of Path
        The JSON and the HTML file.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed; the JSON is written all the same.
    WriteError
        If a file cannot be written.
    """
    rows = json.dumps(_finite(result.to_json()), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    data, shown = folder / f"{result.name}.json", folder / f"{result.name}.html"
    files.write(data, rows)
    files.write(shown, page(result))
    return data, shown


def _finite(value: Any) -> Any:
    """The same with plain Python values, and None for what is not finite: JSON knows neither NaN nor infinity."""
    if isinstance(value, dict):
        return {str(key): _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_finite(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value

"""Recordings that come with the package: wiping in the physics engine, made by ``scripts/example_data.py``."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from ...base.files import put_folder, workshop


def write_example(folder: str | os.PathLike[str]) -> list[Path]:
    """Copy the recordings that come with this package to a folder: a sponge on plates of other tilts.

    They were simulated by this project, and come under its licence; a README beside them says more.

    Parameters
    ----------
    folder : path
        If it is there, it is replaced with all it holds.

    Returns
    -------
    list of Path
        The CSV files to learn from. Those of two more plates are in the folder ``unseen`` inside.

    Raises
    ------
    WriteError
        If the folder cannot be written; what was there is then as it was.

    Examples
    --------
    >>> len(uc.read(uc.datasets.write_example("wiping")))
    10
    """
    with workshop(folder) as place:
        put_folder(Path(shutil.copytree(Path(__file__).with_name("wiping"), place / "wiping")), folder)
    return sorted(Path(folder).glob("*.csv"))

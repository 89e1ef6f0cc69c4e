"""Where commands write: refused before any work, so that nothing is lost and no work is for nothing."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import click

from ..base.errors import SettingError
from ..base.files import PICKLES, check

NEEDED: dict[str, tuple[str, tuple[str, ...]]] = {
    ".html": ("viz", ("jinja2", "matplotlib")),
    ".onnx": ("onnx", ("onnx",)),
    ".parquet": ("data", ("pyarrow",)),
    ".rrd": ("rerun", ("rerun",)),
    ".mcap": ("formats", ("rosbags",)),
}
"""For files that end so, the extra that writes them, and what it brings."""

option_for_force = click.option("--force", is_flag=True, help="Replace what is there.")


def check_outputs(outputs: Iterable[str | None], inputs: Iterable[str | Path | None], force: bool) -> None:
    """Refuse to write over what is read, two things to one place, where nothing can be written, or over what is there.

    What is needed to write is looked for, too.

    Parameters
    ----------
    outputs, inputs : iterable of path
        ``None`` is what was not asked for.
    force : bool
        Replace what is there, though no input.

    Raises
    ------
    SettingError, WriteError, MissingExtraError
        But for the last in one sentence that begins with the output.
    """
    read = [Path(path) for path in inputs if path is not None]
    before: list[Path] = []
    for path in (Path(output) for output in outputs if output is not None):
        if path.suffix.lower() in PICKLES:
            raise SettingError(f"{path}: nothing here writes pickles, which run code when opened; name it .npz.")
        if any(_overlap(path, other) for other in read):
            raise SettingError(f"{path}: is one of the files to read; give another name to write to.")
        if any(_same(path, other) for other in before):
            raise SettingError(f"{path}: is given for two outputs; give each a name of its own.")
        if not path.is_dir():
            check(path)
        if path.exists() and not force:
            lost = "".join(f" And {one}: no such file." for one in read if not one.exists())
            raise SettingError(f"{path}: is there; give another name, or --force to replace it.{lost}")
        _check_extra(path)
        before.append(path)


def _check_extra(path: Path) -> None:
    if path.suffix.lower() in NEEDED:
        from ..base.arrays import require_extra

        extra, modules = NEEDED[path.suffix.lower()]
        for module in modules:
            require_extra(module, extra)


def check_name(output: str) -> None:
    """Refuse to write an archive of arrays under a name that says something else."""
    if Path(output).suffix.lower() not in ("", ".npz"):
        better = Path(output.removesuffix(Path(output).suffix)).with_suffix(".npz")
        raise SettingError(f"{output}: what is learnt is written as .npz; name it {better}.")


def _overlap(output: Path, read: Path) -> bool:
    """Whether writing one changes the other: one file under two names, or one in the folder that the other is."""
    if not (output.exists() and read.exists()):
        return False
    places = Path(os.path.realpath(output)), Path(os.path.realpath(read))
    return _same(output, read) or places[0] in places[1].parents or places[1] in places[0].parents


def _same(one: Path, other: Path) -> bool:
    if one.exists() and other.exists():
        return one.samefile(other)
    return os.path.realpath(one) == os.path.realpath(other)

"""What the command line does with the paper: reproduce an experiment, wash a car, and say what came out."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ..base.errors import MissingExtraError, ReadError, SettingError
from . import experiments, pages
from .experiments import washing
from .experiments.journal import Journal
from .experiments.trials import LABELS, Progress, Result

Table = Callable[[Sequence[str], Sequence[Sequence[str]]], None]
"""Prints a head and rows."""

TITLES = {
    "constraint": "constr.",
    "theta_max": "θmax",
    "ninc": "norm. incon.",
    "to_safe": "/ safe",
    "worst_to_safe": "worst",
    "behind": "> 1.1",
    "to_best": "/ best",
} | {name: LABELS[name] for name in ("nupe", "ncpe")}
"""Short enough for a terminal."""


def reproduce(
    experiment: str, out: str, table: Table, *, trials: int | None, seed: int, only: tuple[str, ...], workers: int
) -> None:
    """Run an experiment, going on where an earlier run was interrupted; print the result and write it to a folder.

    Raises
    ------
    SettingError
        If the experiment has no such setting, or there is no worker.
    """
    if workers == 0:
        raise SettingError("--workers: got 0, expected a number of processes, or -1 for one on each core.")
    module = experiments.find(experiment)
    settings = replace(module.Settings(), seed=seed)
    if trials is not None:
        if not hasattr(settings, "trials"):
            raise SettingError(f"--trials: {experiment} is a single data set.")
        settings = replace(settings, trials=trials)
    if only:
        if not hasattr(settings, "only"):
            raise SettingError(f"--only: {experiment} has no parts to choose from.")
        settings = replace(settings, only=only)
    journal = Journal(Path(out) / f".{experiment}.trials", settings)
    kept = (journal,) if experiment in experiments.JOURNALED else ()
    with progress_bar(experiment) as progress:
        result = module.run(settings, workers, progress, *kept)
    said = [*module.headlines(result), *_beside(experiment, Path(out))]
    if deliver(result, said, out, table) and kept:
        journal.finish()


def _beside(experiment: str, folder: Path) -> list[str]:
    """What another experiment that belongs to this one found, where its result is in the folder."""
    other = experiments.BESIDE.get(experiment)
    if other is None:
        return []
    path, module = folder / f"{other}.json", experiments.find(other)
    if not path.is_file():
        return [f"{other}: no {path}; 'unconstrain reproduce {other} --out {folder}' adds its lines here"]
    try:
        result = Result.from_json(json.loads(path.read_text(encoding="utf-8")), module.Settings)
        return [f"{other}, {line}" for line in module.headlines(result)]
    except (KeyError, TypeError, ValueError):
        return [f"{other}: {path} is of another version; reproduce it again"]


def demo(out: str, table: Table, *, real: bool, download: bool, plate: tuple[float, ...] | None, seed: int) -> None:
    """Wash a car, simulated or recorded; print the result and write it to a folder.

    Raises
    ------
    ReadError
        If the recordings are not there.
    SettingError
        If the plate is not two tilts.
    """
    if plate is not None and len(plate) != 2:
        raise SettingError(f"--plate: got {len(plate)} numbers, expected two, the tilts about x and y in degrees.")
    tilts = None if plate is None else (plate[0], plate[1])
    settings = washing.Settings(real=real, download=download, trials=1, seed=seed, plate=tilts)
    try:
        with progress_bar("washing") as progress:
            result = washing.run(settings, 1, progress)
    except ReadError as error:
        raise error if download else ReadError(f"{error} On the command line, --download allows it.") from error
    if not real:
        click.echo("Seven plates were wiped, five to learn from, two to be tested on.")
    deliver(result, washing.headlines(result), out, table)


def deliver(result: Result, headlines: Sequence[str], out: str, table: Table) -> bool:
    """Print and write a result; False where it could not be written."""
    table(*summary(result))
    for line in headlines:
        click.echo(line)
    try:
        data, page = pages.write(result, Path(out))
    except MissingExtraError as error:
        click.echo(f"No report: {error}", err=True)
        return False
    click.echo(f"numbers: {data}\nreport:  {page}")
    return True


def summary(result: Result) -> tuple[list[str], list[list[str]]]:
    """Head and rows: mean and s.d. fill a terminal's 80 columns; medians and the paper's values stay in the files."""
    first = result.rows[0]
    kept = [name for name in first if not name.startswith("paper_") and not name.endswith(("_sd", "_median"))]
    names = [short if f"{short}_sd" in first else name for name in kept for short in [name.removesuffix("_mean")]]
    rows = [
        [_cell(row[name]) if name in row else f"{row[f'{name}_mean']:.2g} ± {row[f'{name}_sd']:.2g}" for name in names]
        for row in result.rows
    ]
    return [TITLES.get(name, name) for name in names], rows


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """Show a bar on stderr while the block runs; yields what to call with (done, of)."""
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(file=sys.__stderr__), transient=True, disable=not sys.stderr.isatty()) as bar:
        job = bar.add_task(title, total=None)
        yield lambda done, of: bar.update(job, completed=done, total=of)

"""What the command line does with the paper: reproduce an experiment, wash a car, and say what came out."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

import unconstrain as uc

from ..base.errors import MissingExtraError, ReadError, SettingError
from . import experiments, pages
from .experiments import washing
from .experiments.journal import Journal
from .experiments.trials import LABELS, Progress, Result

Verdict = uc.evaluation.verdicts.Verdict
Table = Callable[[Sequence[str], Sequence[Sequence[str]]], None]
"""Prints a head and rows."""

Shown = Callable[[str], AbstractContextManager[Progress]]
"""Shows how far something of a name is while its block runs."""

_KEPT = "What was finished is kept in {}; the same command goes on from there."

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


def written(experiment: str, out: str) -> list[str]:
    """What an experiment writes into a folder, as far as it is there already."""
    return [str(path) for end in ("json", "html") if (path := Path(out) / f"{experiment}.{end}").exists()]


def reproduce(
    experiment: str,
    out: str,
    table: Table,
    shown: Shown,
    *,
    trials: int | None,
    seed: int,
    only: tuple[str, ...],
    workers: int,
    as_json: bool,
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
    with shown(experiment) as progress:
        try:
            result = module.run(settings, workers, progress, *kept)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(*([_KEPT.format(journal.path)] if kept else [])) from None
    said = [*module.headlines(result), *_beside(experiment, Path(out))]
    if deliver(result, module.verdict(result), said, out, table, as_json) and kept:
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
        return [f"{other}: {path} is of another version; reproduce it again with --force"]


def demo(
    out: str,
    table: Table,
    shown: Shown,
    *,
    real: bool,
    download: bool,
    plate: tuple[float, ...] | None,
    seed: int,
    as_json: bool,
) -> None:
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
        with shown("washing") as progress:
            result = washing.run(settings, 1, progress)
    except ReadError as error:
        raise error if download else ReadError(f"{error} On the command line, --download allows it.") from error
    before = [] if real else ["Seven plates were wiped, five to learn from, two to be tested on."]
    deliver(result, washing.verdict(result), [*before, *washing.headlines(result)], out, table, as_json)


def deliver(result: Result, verdict: Verdict, headlines: Sequence[str], out: str, table: Table, as_json: bool) -> bool:
    """Print and write a result; False where it could not be written."""
    if not as_json:
        click.echo("\n".join([*verdict.lines(), ""]))
        table(*summary(result))
        click.echo("\n".join(headlines))
    try:
        data, page = pages.write(result, Path(out))
    except MissingExtraError as error:
        click.echo(f"No report: {error}", err=True)
        return False
    click.echo(data.read_text("utf-8") if as_json else f"numbers: {data}\nreport:  {page}")
    return True


def summary(result: Result) -> tuple[list[str], list[list[str]]]:
    """Head and rows: mean and s.d. fill a terminal's 80 columns; medians and the paper's values stay in the files.

    Where a part without rows of the result's own was asked for, they are of the first table that has any.
    """
    found = result.rows or next(rows for rows in result.tables.values() if rows)
    first = found[0]
    kept = [name for name in first if not name.startswith("paper_") and not name.endswith(("_sd", "_median"))]
    names = [short if f"{short}_sd" in first else name for name in kept for short in [name.removesuffix("_mean")]]
    rows = [
        [_cell(row[name]) if name in row else f"{row[f'{name}_mean']:.2g} ± {row[f'{name}_sd']:.2g}" for name in names]
        for row in found
    ]
    return [TITLES.get(name, name) for name in names], rows


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)

"""``unconstrain convert`` and ``example``: recordings as files, for other programs and to begin with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Any

import click

import unconstrain as uc

from ..base.display import counted
from ..base.errors import NOTHING_LEFT, ReadError
from .printing import option_for_json, say_judged
from .progress import shown
from .reading import left_in, of_files, options_for_reading, reading_of, recipe_of
from .writing import check_outputs, option_for_force


@click.command(epilog="\b\nExample:\n  unconstrain convert demo.hdf5 wiping --state robot0_eef_pos --action actions")
@options_for_reading
@click.argument("output", type=click.Path())
@click.option("--align", is_flag=True, help="Bring all recordings onto one clock, beside each other.")
@option_for_force
@option_for_json
def convert(files: Sequence[str], output: str, align: bool, force: bool, as_json: bool, **options: Any) -> None:
    """Write recordings in another format.

    Those in each FILE go to OUTPUT: .csv, .parquet, .mcap, or a folder for LeRobot. With --state or --action only
    those columns are written.
    """
    paths = uc.readers.expand(files)
    check_outputs((output,), paths, force)
    with shown("reading"):
        every = left_in(uc.read(paths, **reading_of(**options).arguments), options["leave_out"], recipe_of(**options))
        recordings = [_timed(recording, options.get("rate")) for recording in every]
    if not recordings:
        raise ReadError(NOTHING_LEFT)
    if align:
        recordings = [uc.preparation.align(recordings)]
    with of_files(recordings):
        states, actions = _columns(recordings[0], options)
        kept = (*states, *actions) or recordings[0].columns
        chosen = [replace(each, columns=kept, values=each.select(kept)) for each in recordings]
    uc.writers.write_recordings(chosen, output, states, actions)
    counts = {"recordings": len(chosen), "samples": sum(map(len, chosen))}
    said = f"{counted(counts['recordings'], 'recording')}, {counted(counts['samples'], 'sample')}."
    verdicts, then = uc.evaluation.verdicts, f"unconstrain inspect {quote(output)}"
    say_judged(verdicts.Verdict(verdicts.Mark.GOOD, said, next=then), {"output": output}, as_json, **counts)


@click.command(epilog="\b\nExample:\n  unconstrain example wiping")
@click.argument("folder", type=click.Path(file_okay=False))
@option_for_force
@option_for_json
def example(folder: str, force: bool, as_json: bool) -> None:
    """Write recordings to begin with to FOLDER.

    Simulated wiping of tilted plates, which comes with this package.
    """
    check_outputs((folder,), (), force)
    paths = uc.datasets.write_example(folder)
    written = {"output": folder, "to judge what was learnt": str(Path(folder) / "unseen")}
    said = f"{counted(len(paths), 'recording')} to begin with."
    then = f"unconstrain inspect {Path(quote(folder)) / '*.csv'}"
    verdicts = uc.evaluation.verdicts
    say_judged(verdicts.Verdict(verdicts.Mark.GOOD, said, next=then), written, as_json, recordings=len(paths))


def _columns(recording: uc.Recording, options: dict[str, Any]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    recipe = recipe_of(**options)
    return recording.resolve(recipe.states or ()), recording.resolve(recipe.actions or ())


def _timed(recording: uc.Recording, rate: float | None) -> uc.Recording:
    import numpy as np

    if recording.times is not None or rate is None:
        return recording
    return replace(recording, times=np.arange(len(recording)) / rate)

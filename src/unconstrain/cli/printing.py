"""Output on the terminal: tables, notes, and errors in one sentence."""

from __future__ import annotations

import errno
import sys
import warnings
from collections.abc import Sequence
from math import isfinite
from typing import Any

import click

import unconstrain as uc

from ..base.errors import UnconstrainError


class Group(click.Group):
    """Reports our errors, and those of the file system, in one sentence, with exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        said, result = "", None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("default", UserWarning)
                warnings.showwarning = show_warning  # type: ignore[assignment]
                result = super().invoke(ctx)
        except UnconstrainError as error:
            said = str(error)
        except OSError as error:
            if error.errno == errno.EPIPE:  # the reader of our output has closed it; click exits quietly
                raise
            said = f"{error.filename}: {error.strerror}." if error.filename and error.strerror else str(error)
        if said:
            click.echo(f"Error: {said}", err=True)
            ctx.exit(2)
        return result


def say_fit(policy: uc.Policy, stream: uc.Stream | None, learner: str) -> None:
    """Print the solution, the share that the data determined, and the held-out inconsistency.

    Without a stream, whatever needs a further pass over the samples is left out.
    """
    solution = policy.solution_
    models = f", {len(solution.weights)} local models" if len(solution.weights) > 1 else ""
    training = 0.0
    if stream is not None:
        names, samples, training = _walked(policy, stream)
        click.echo(f"{names} demonstrations, {samples} samples{models}.")
    elif models:
        click.echo(f"{models.removeprefix(', ')}.")
    if solution.belief is not None:
        click.echo(_said_of_samples(solution))
    elif learner != "direct":
        rest = "; the rest follows the standard risk." if learner == "hybrid" and solution.determined_share < 1 else "."
        click.echo(
            f"The inconsistency determined {solution.determined_share:.0%} of {solution.directions} weight directions"
            + (" of each model" if len(solution.weights) > 1 else "")
            + rest
        )
        if solution.determined_share == 0.0:
            click.echo("Note: nothing was determined, so this is the same as --learner direct.", err=True)
    held_out = 1.0 - policy.held_out_score()
    click.echo(
        "share of the observed motion left unexplained (inconsistency): "
        + ("" if stream is None else f"{training:.4g} on the training data, ")
        + (f"{held_out:.4g} where held out." if isfinite(held_out) else "nothing could be held out.")
    )
    if stream is not None and held_out > 0.05 + 2.0 * training:
        faster = "" if learner == "robust" else "--speed-power 2 or "
        click.echo(
            "Note: much of the held-out motion is unexplained. If the noise at low speed is large, try a wider "
            f"--window, {faster}--still; otherwise the demonstrations may have too little in common.",
            err=True,
        )


def _said_of_samples(solution: uc.Solution) -> str:
    """The candidate that a robust learner took, and its estimates of noise and free samples."""
    ways = {
        "likelihood": "by likelihood: samples look free, or constrained at random",
        "noise-corrected": "by noise-corrected consistency: constraints look like a function of the state",
        "hybrid": "by softened consistency: the residuals are not noise",
    }
    return (
        f"Learnt {ways.get(solution.method, solution.method)}. Noise and misfit are about {solution.noise:.3g} on "
        f"each action, {solution.free_share:.0%} of the samples look free, and the data determined "
        f"{solution.determined_share:.0%} of the weight directions."
    )


def _walked(policy: uc.Policy, stream: uc.Stream) -> tuple[int, int, float]:
    """Numbers of demonstrations and samples, and the unexplained share of their motion, without sample weights."""
    names, samples, unexplained, energy = set(), 0, 0.0, 0.0
    for name, demonstration in stream.named_demonstrations():
        names.add(name)
        samples += len(demonstration)
        motion = float((demonstration.actions**2).sum())
        energy += motion
        unexplained += motion * (1.0 - policy.score(demonstration.states, demonstration.actions))
    return len(names), samples, unexplained / energy if energy > 0 else 1.0


def number(value: Any, form: str) -> str:
    """A value as text, or a dash."""
    return "-" if value is None else form.format(value)


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table that fits the terminal."""
    from rich.console import Console
    from rich.table import Table

    table = Table(*head, box=None, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    # Piped output is for programs and files: no wrapping there.
    console = Console(width=None if sys.stdout.isatty() else 10_000)
    console.print(table)


def show_warning(message: Warning | str, *_: Any) -> None:
    """Print a warning as a note, without where it came from."""
    click.echo(f"Note: {message}", err=True)

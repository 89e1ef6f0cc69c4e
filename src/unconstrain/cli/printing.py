"""Output on the terminal: tables, notes, and errors in one sentence."""

from __future__ import annotations

import errno
import sys
import warnings
from collections.abc import Iterable, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

import unconstrain as uc

from ..base.errors import InvalidDataError
from .endings import REFUSED, ending
from .terminal import plain_output

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

CODES = "unconstrain.codes"
"""Where the codes of warnings are kept in the context of a command."""


class Group(click.Group):
    """Ends in one sentence and the right exit code, whatever happens; what cannot be printed stops no command."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Parse and run the command line; ends with ``SystemExit``."""
        with plain_output() as printed:
            try:
                return super().main(*args, **extra)
            except SystemExit as end:
                # Who closes a pipe has seen enough.
                if end.code or printed.trouble is None or printed.trouble.errno == errno.EPIPE:
                    raise
                click.echo(f"Error: standard output: cannot be written ({printed.trouble.strerror}).", err=True)
                raise SystemExit(REFUSED) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("default", UserWarning)
                warnings.showwarning = show_warning  # type: ignore[assignment]
                return super().invoke(ctx)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - the last clause
            said, code = ending(error)
            click.echo(f"Error: {said}", err=True)
            ctx.exit(code)


def say_surveys(surveys: Sequence[Any]) -> None:
    """Print what was found in recordings: a line for each, their columns, and what is not as it seems."""
    rows = [
        [
            found.name,
            str(found.samples),
            number(found.duration_s, "{:.2f} s"),
            number(found.rate_hz, "{:.1f} Hz"),
            number(found.jitter, "{:.1%}"),
            "; ".join(f"{gap.length:.2f} s at {gap.start:.2f} s" for gap in found.gaps[:3])
            + (f" and {len(found.gaps) - 3} more" if len(found.gaps) > 3 else "")
            or "none",
            ", ".join(f"{name}: {count}" for name, count in found.missing.items()) or "none",
            number(found.zero_actions, "{}"),
        ]
        for found in surveys
    ]
    print_table(["demonstration", "samples", "length", "rate", "jitter", "gaps", "missing", "zero actions"], rows)
    for columns in dict.fromkeys(found.columns for found in surveys):
        click.echo(f"columns: {', '.join(columns)}")
    for found in surveys:
        if found.non_increasing:
            click.echo(f"'{found.name}': time does not increase at row {found.non_increasing[0]}.")
        for remark in found.warnings:
            click.echo(remark.about(found.name))
        for note in found.notes:
            click.echo(f"'{found.name}': {note.message}")


def say_fit(policy: uc.Policy, stream: uc.Stream | None, learner: str) -> None:
    """Print the solution, the share that the data determined, and the held-out inconsistency.

    Without a stream, whatever needs a further pass over the samples is left out.
    """
    solution = policy.solution_
    models = f", {len(solution.weights)} local models" if len(solution.weights) > 1 else ""
    names, training = 0, 0.0
    if stream is not None:
        names, samples, training = _walked(policy, stream)
        click.echo(f"{names} demonstrations, {samples} samples{models}.")
    elif models:
        click.echo(f"{models.removeprefix(', ')}.")
    if getattr(policy, "features", None) == "auto":
        click.echo(f"Features of least estimated error: {policy.training_.model.features}.")
    if solution.belief is not None:
        click.echo(_said_of_samples(solution))
        _say_suspects(solution.belief.suspects, stream)
    elif learner != "direct":
        rest = "."
        if learner == "hybrid" and solution.determined_share < 1:
            rest = "; along the others the policy is as close to the recorded actions as can be."
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
    if stream is not None:
        say(uc.preparation.doubts(names, training), "fit")
    if stream is not None and held_out > 0.05 + 2.0 * training:
        faster = "" if learner == "robust" else "--speed-power 2 or "
        click.echo(
            "Note: much of the held-out motion is unexplained. If the noise at low speed is large, try a wider "
            f"--window, {faster}--still; otherwise the demonstrations may have too little in common.",
            err=True,
        )


def say_scale(policy: uc.Policy, recipe: uc.Recipe) -> None:
    """Print what counts as one of each state and action, where that is not their own unit."""
    if policy.scale is not None and (recipe.angles or recipe.quaternions):
        click.echo("Note: --scale auto: angles and orientations have none; give positions in metres.", err=True)
    if policy.scale_ is None:
        return
    states = recipe.states or ()
    names = states if recipe.actions is None else (*states, *recipe.actions)
    sizes = [*policy.scale_.states, *policy.scale_.actions]
    told = ", ".join(f"{size:.4g} of {name}" for name, size in zip(names, sizes, strict=False))
    click.echo(f"As one count {told} (--scale); noise and features are in these units, predictions as in the files.")


def _say_suspects(rows: NDArray[np.intp], stream: uc.Stream | None) -> None:
    """Name the samples that look wrong, in a further walk if there are any."""
    if len(rows) and stream is not None:
        named = ((name.partition("/")[2], demo) for name, demo in stream.named_demonstrations())
        places = uc.evaluation.diagnosis.places_of(rows, named)
        for line in uc.evaluation.diagnosis.about_suspects(places):
            click.echo(f"Note: {line}", err=True)


def _said_of_samples(solution: uc.Solution) -> str:
    """The candidate that a robust learner took, and its estimates of noise and free samples."""
    risks = {name: one.risk for name, one in solution.candidates.items()}
    choice = uc.evaluation.diagnosis.about_choice(solution.method, risks)
    return (
        f"{choice} Noise and misfit are about {solution.noise:.3g} on each action, and "
        f"{solution.free_share:.0%} of the samples were free{_said_of_undecided(solution)}. At least three "
        f"demonstrations show {solution.determined_share:.0%} of the weight directions."
    )


def _said_of_undecided(solution: uc.Solution) -> str:
    share = solution.believed.undecided_share
    return f" ({share:.0%} free or always held in the same way, which looks alike)" if share >= 0.01 else ""


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
    width = None if sys.stdout.isatty() else 10_000
    Console(width=width, markup=False, emoji=False, highlight=False, color_system=None).print(table)


def show_warning(message: Warning | str, *_: Any) -> None:
    """Print a warning as a note, without where it came from, and keep its code for :func:`refuse_warnings`."""
    click.echo(f"Note: {message}", err=True)
    keep_codes([getattr(message, "code", "")])


def say(remarks: Iterable[Any], name: str) -> None:
    """Print remarks about something of some name as notes."""
    for remark in remarks:
        show_warning(uc.preparation.PreparationWarning(remark.about(name), remark.code))


def keep_codes(codes: Iterable[str]) -> None:
    """Keep the codes of warnings for the end of the command."""
    context = click.get_current_context(silent=True)
    if context is not None:
        context.meta.setdefault(CODES, []).extend(filter(None, codes))


def refuse_warnings(strict: bool) -> None:
    """With ``--strict``, end with an error where there was a warning.

    Raises
    ------
    InvalidDataError
        With the codes of the warnings.
    """
    codes = click.get_current_context().meta.get(CODES, [])
    if strict and codes:
        raise InvalidDataError(f"--strict: not as it seems ({', '.join(dict.fromkeys(codes))}); nothing was written.")

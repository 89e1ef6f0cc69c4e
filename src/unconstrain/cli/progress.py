"""What goes on, on the error stream, while it takes long: a bar where somebody looks, else a line now and then."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from ..base.display import listening

Progress = Callable[[int, int | None], None]
"""Called with how much is done, and of how much, if that is known."""

Say = Callable[[str, int, int | None], None]
"""The same, and of what."""

FIRST_S = 2.0
"""After so many seconds somebody may wonder; so often again where lines are written."""

FIRST_STEP, KNOWN_AFTER = "noise correction: fold", 2
"""What the default learner counts off first, and after how many of it its pace is known."""

WHOLE = 9.0
"""Time to learn by the default learner over that of the first step.

Measured with 6, 9, 12 and 16 states, and 10,000, 6,000, 20,000 and 8,000 samples: 12, 10, 9.6 and 6.6 times.
"""

LONG_S = 20.0
"""What takes longer is foretold."""


@contextmanager
def shown(title: str) -> Iterator[Progress]:
    """Show a bar, or a wheel as long as nobody says how much there is to do, and the time, while the block runs.

    Where what runs counts off its steps (:mod:`unconstrain.base.display`), they take the place of the title.
    """
    with (_bar if sys.stderr.isatty() else _lines)() as say, listening(_foretelling(say)):
        say(f"{title}:", 0, None)
        yield lambda done, of: say(f"{title}:", done, of)


def _foretelling(say: Say) -> Say:
    """Also say that a fit of the default learner will take long, once its pace is known."""
    begun = list[float]()

    def heard(what: str, done: int, of: int | None) -> None:
        say(what, done, of)
        if what != FIRST_STEP or of is None or len(begun) > KNOWN_AFTER:
            return
        begun.append(time.monotonic())
        spent = begun[-1] - begun[0]
        left = WHOLE * spent * of / KNOWN_AFTER - spent
        if len(begun) > KNOWN_AFTER and left > LONG_S:
            context = click.get_current_context(silent=True)
            told = "; '--learner hybrid' takes less" if context is not None and "learner" in context.params else ""
            click.echo(f"Note: this may take minutes{told}.", err=True)

    return heard


@contextmanager
def _bar() -> Iterator[Say]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Bar(*columns, console=Console(file=sys.__stderr__), transient=True) as bar:
        job = bar.add_task("", total=None)
        yield lambda what, done, of: bar.update(job, description=what, completed=done, total=of)


@contextmanager
def _lines() -> Iterator[Say]:
    """A line after two seconds, four, eight, ..., where it is another; the same is said again after a long time."""
    finished, begun, counted = threading.Event(), time.monotonic(), [""]

    def say(what: str, done: int, of: int | None) -> None:
        counted[0] = f"{what} {done:,} of {of:,}" if of else f"{what} {done:,}" if done else what

    def tell() -> None:
        wait, said = FIRST_S, ""
        while not finished.wait(wait):
            spent = time.monotonic() - begun
            if counted[0] != said or wait > LONG_S:
                click.echo(f"{(said := counted[0])} ... ({spent:.0f} s)", err=True)
            wait = spent

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield say
    finally:
        finished.set()
        teller.join()

"""What goes on, on the error stream, while it takes long: a bar where somebody looks, else a line now and then."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

Progress = Callable[[int, int | None], None]
"""Called with how much is done, and of how much, if that is known."""

FIRST_S = 2.0
"""After so many seconds somebody may wonder; so often again where lines are written."""


@contextmanager
def shown(title: str) -> Iterator[Progress]:
    """Show a bar, or a wheel as long as nobody says how much there is to do, and the time, while the block runs."""
    with (_bar if sys.stderr.isatty() else _lines)(title) as progress:
        yield progress


@contextmanager
def _bar(title: str) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Bar(*columns, console=Console(file=sys.__stderr__), transient=True) as bar:
        job = bar.add_task(title, total=None)
        yield lambda done, of: bar.update(job, completed=done, total=of)


@contextmanager
def _lines(title: str) -> Iterator[Progress]:
    """A line after two seconds, four, eight, ..."""
    finished, begun, counted = threading.Event(), time.monotonic(), [""]

    def count(done: int, of: int | None) -> None:
        counted[0] = f" {done:,}" if of is None else f" {done:,} of {of:,}"

    def tell() -> None:
        wait = FIRST_S
        while not finished.wait(wait):
            spent = time.monotonic() - begun
            click.echo(f"{title}:{counted[0]} ... ({spent:.0f} s)", err=True)
            wait = spent

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield count
    finally:
        finished.set()
        teller.join()

"""What goes on, on the error stream, while it takes long and somebody looks."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[int, int], None]
"""Called with how much is done, and of how much."""


@contextmanager
def shown(title: str) -> Iterator[Progress]:
    """Show a bar, or a wheel as long as nobody says how much there is to do, and the time, while the block runs."""
    if not sys.stderr.isatty():  # then rich need not be there in a blink
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Bar(*columns, console=Console(file=sys.__stderr__), transient=True) as bar:
        job = bar.add_task(title, total=None)
        yield lambda done, of: bar.update(job, completed=done, total=of)

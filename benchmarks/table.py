"""What all benchmarks share: rows, repeats, one table."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

Row = dict[str, Any]


def row(
    what: str,
    value: float,
    unit: str,
    at_least: float | None = None,
    target: float | None = None,
    *,
    more_is_better: bool = False,
) -> Row:
    """One line of the table; ``at_least`` is what must be reached, ``target`` what is aimed at."""
    return {
        "what": what,
        "value": float(value),
        "unit": unit,
        "at_least": at_least,
        "target": target,
        "more_is_better": more_is_better,
    }


def seconds(call: Callable[[], object]) -> float:
    """How long a call takes."""
    start = perf_counter()
    call()
    return perf_counter() - start


def side_by_side(calls: Sequence[Callable[[], object]], repeats: int = 7) -> np.ndarray:
    """Times of some calls in turn, (repeats, calls), so that other work on the machine meets all of them alike."""
    for call in calls:
        call()  # what is done once
    return np.array([[seconds(call) for call in calls] for _ in range(repeats)])


def ratio(times: np.ndarray, of: int, to: int) -> float:
    """Median over the repeats of one call's time against another's."""
    return float(np.median(times[:, of] / times[:, to]))


_LAUNCH = """
import json, os, sys, time
start = time.perf_counter()
nowhere = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
pid = os.posix_spawn(sys.executable, [sys.executable, *sys.argv[1:]], os.environ, file_actions=nowhere)
_, status, used = os.wait4(pid, 0)
assert status == 0
unit = 1 if sys.platform == "darwin" else 1024
print(json.dumps([time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss * unit / 1e6]))
"""
"""The peak of a process counts what the one that starts it holds, which is little here."""


def spent(what: str, arguments: Sequence[object], most: float, aim: float | None = None) -> list[Row]:
    """Rows of Python run with these arguments; what other work on the machine takes is not in the processor's time."""
    line = [sys.executable, "-c", _LAUNCH, *map(str, arguments)]
    time, processor, peak = json.loads(subprocess.run(line, stdout=subprocess.PIPE, check=True).stdout)
    return [
        row(f"{what}: time", time, "s"),
        row(f"{what}: processor", processor, "s", most, aim),
        row(f"{what}: peak memory", peak, "MB"),
    ]


def verdict(line: Row) -> str:
    """Whether what must be reached is, and what is aimed at."""
    sign = -1.0 if line["more_is_better"] else 1.0
    for bound, said in ((line["target"], "[green]target[/]"), (line["at_least"], "[yellow]enough[/]")):
        if bound is not None and sign * line["value"] <= sign * bound:
            return said
    return "" if line["at_least"] is None else "[bold red]missed[/]"


def show(rows: Sequence[Row], before: dict[str, float] | None = None, title: str = "") -> None:
    """Print the table; with values of an earlier run, the ratio to them too."""
    table = Table(title=title, title_justify="left", expand=False)
    table.add_column("what", overflow="fold")
    for name in ("value", "unit", "must be", "target", "", *(["now / then"] if before else [])):
        table.add_column(name, justify="left" if name == "unit" else "right", no_wrap=True)
    for line in rows:
        bounds = [_bound(line, name) for name in ("at_least", "target")]
        cells = [line["what"], f"{line['value']:.3g}", line["unit"], *bounds, verdict(line)]
        if before:
            then = before.get(line["what"])
            cells.append(f"{line['value'] / then:.2f}" if then else "-")
        table.add_row(*cells)
    Console(width=None if Console().is_terminal else 140).print(table)


def _bound(line: Row, name: str) -> str:
    if line[name] is None:
        return "-"
    return f"{'≥' if line['more_is_better'] else '≤'} {line[name]:g}"


def script(main: Callable[..., list[Row]], **options: Any) -> None:
    """Run a benchmark from the command line: print its table, or write its rows to a file."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=Path, help="write the rows there as JSON instead of printing them")
    for name, (kind, default) in options.items():
        parser.add_argument(f"--{name}", type=kind, default=default)
    asked = vars(parser.parse_args())
    path = asked.pop("rows")
    rows = main(**asked)
    if path is None:
        show(rows)
    else:
        path.write_text(json.dumps(rows))

"""Figures of the README and the documents, each bound to the run that made it.

A figure is written as it is read, beside where it comes from: the run, a file in ``docs/results``, and its name there.

    README.md     [0.0941e-2](docs/results/table1.json "random, hybrid: nUPE")
    docs/*.rst    :measured:`0.0941e-2 <table1 random, hybrid: nUPE>`

What is written says how: as many decimals, an exponent, words around several numbers ("7.7, 9.7 and 27.9").

    make numbers                  write every figure anew from docs/results
    make numbers RUNS=results     take in first what commands wrote to that folder; see scripts/runs.py
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Sequence
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs" / "results"
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.rst")))

BOUND = re.compile(
    r":measured:`(?P<written>[^`<]+?)\s+<(?P<run>\w+)\s+(?P<name>[^`]+?)>`"
    r'|\[(?P<md_written>[^\[\]]+)\]\(docs/results/(?P<md_run>\w+)\.json "(?P<md_name>[^"]+)"\)'
)
NUMBER = re.compile(r"[-−]?(?:[0-9]{1,3}(?:,[0-9]{3})+|[0-9]+)(?:\.[0-9]+)?(?:e-?[0-9]+)?")


class Figure(NamedTuple):
    """A figure as a page has it: where it is written, how, and the run and name that it is bound to."""

    page: Path
    line: int
    written: str
    run: str
    name: str

    @property
    def values(self) -> Sequence[float]:
        """What the run found; ``LookupError`` with what to do where it has nothing of that name."""
        path = RESULTS / f"{self.run}.json"
        found = figures_of(path) if path.is_file() else {}
        if self.name not in found:
            raise LookupError(f"{self}: {path.relative_to(ROOT)} has no {self.name!r}; it has {sorted(found)}.")
        value = found[self.name]
        return value if isinstance(value, list) else [value]

    @property
    def right(self) -> str:
        """What should be written."""
        try:
            return like(self.written, self.values)
        except ValueError as error:
            raise ValueError(f"{self}: {error}") from error

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def figures_of(path: Path) -> dict[str, Any]:
    """Figures of a run by their names: numbers, or lists of them."""
    found: dict[str, Any] = json.loads(path.read_text("utf-8"))["figures"]
    return found


def bound(page: Path) -> Iterator[Figure]:
    """Every figure of a page."""
    text = page.read_text("utf-8")
    for match in BOUND.finditer(text):
        run, name = (match[key] or match[f"md_{key}"] for key in ("run", "name"))
        yield Figure(page, text.count("\n", 0, match.start()) + 1, _written(match), run, " ".join(name.split()))


def _written(match: re.Match[str]) -> str:
    return match["written"] or match["md_written"]


def like(written: str, values: Sequence[float]) -> str:
    """Values, written as the numbers of a text are, with what stands around them."""
    numbers = NUMBER.findall(written)
    if len(numbers) != len(values):
        raise ValueError(f"{written!r} has {len(numbers)} numbers for {len(values)} values.")
    each = iter(values)
    return NUMBER.sub(lambda found: _number(found[0], next(each)), written)


def _number(pattern: str, value: float) -> str:
    """One number: -2 is kept as an exponent, as in the paper's tables; any other one follows the value."""
    mantissa, _, exponent = pattern.partition("e")
    decimals = len(mantissa.partition(".")[2])
    last, exact = Decimal(1).scaleb(-decimals), Decimal(str(value))  # 5.85 is 5.9, as people round
    if exponent == "-2":
        text = f"{exact.scaleb(2).quantize(last, ROUND_HALF_UP)}e-2"
    elif exponent and value:
        digits, power = f"{value:.{decimals}e}".split("e")
        text = f"{digits}e{int(power)}"
    else:
        text = f"{exact.quantize(last, ROUND_HALF_UP):{',' if ',' in mantissa else ''}f}"
    if value and not re.search("[1-9]", text.partition("e")[0]):
        raise ValueError(f"{value:g} would be written {text}; write {pattern!r} with more decimals.")
    return text.replace("-", "−", 1) if value < 0 else text


def write(page: Path) -> int:
    """Write every figure of a page anew; how many were others."""
    stale = [one for one in bound(page) if one.right != one.written]
    right = iter([one.right for one in bound(page)])
    text = BOUND.sub(lambda match: match[0].replace(_written(match), next(right), 1), page.read_text("utf-8"))
    page.write_text(text, "utf-8")
    return len(stale)


def quoted() -> dict[str, set[str]]:
    """Names that the pages quote, by run."""
    names: dict[str, set[str]] = {}
    for page in PAGES:
        for figure in bound(page):
            names.setdefault(figure.run, set()).add(figure.name)
    return names


def main(folders: Sequence[str]) -> int:
    """Take in what runs wrote to some folders, then write all pages; 1 where a figure is nowhere."""
    import runs

    for folder in folders:
        for line in runs.take(Path(folder), quoted()):
            print(line)
    try:
        for page in PAGES:
            if changed := write(page):
                print(f"{page.relative_to(ROOT)}: {changed} written anew")
    except (LookupError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

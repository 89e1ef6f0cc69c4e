"""The page of an experiment that has none of its own."""

from __future__ import annotations

from typing import Any

import unconstrain as uc

from ...pages import html
from ..experiments.trials import Result

verdicts = uc.evaluation.verdicts


def page(result: Result) -> str:
    """All rows as one table."""
    columns = list(dict.fromkeys(name for row in result.rows for name in row))
    texts = [
        name for name in columns if any(isinstance(row.get(name), str | bool | tuple | list) for row in result.rows)
    ]
    header = [*texts, *(name for name in columns if name not in texts)]
    rows = [[_cell(row.get(name)) for name in header] for row in result.rows]
    return html.document(
        result.name,
        verdicts.Verdict(verdicts.Mark.DOUBTFUL, "No verdict: nobody has said what these numbers should be."),
        "The numbers of this experiment, in plain units, one row for each method and setting.",
        html.table(header, rows, note="All rows of the experiment.", left=len(texts)),
        html.settings_table(result.settings),
    )


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return html.number(value) if value is None or isinstance(value, int | float) else str(value)

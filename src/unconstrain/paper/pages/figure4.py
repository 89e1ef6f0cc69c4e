"""The page of figure 4."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pages import figures, html
from ..experiments.figure4 import verdict
from ..experiments.trials import METRICS, Result
from . import parts
from .table1 import TITLES

WORDS = {"none": "Unconstrained demonstrations", "random": "Randomly constrained demonstrations"}


def page(result: Result) -> str:
    """Vector fields beside each other."""
    return html.document(
        "Figure 4: what each method learns from one data set",
        verdict(result),
        "Grey lines are recorded movements of a point in the plane; thin arrows are the policy that made them. "
        "Above, nothing held the point. Below, a rail did, and its direction changed twice on the way, hence the "
        "kinks. Where a coloured arrow lies on the thin one, the method has found the policy. Direct learning (blue) "
        "shrinks and bends below, for it averages what the rails allowed. Inconsistency alone (orange) is right there "
        "and wild above: free data shows one direction at each state, and it leaves the others to chance. The hybrid "
        "(green) should cover the thin arrows in both.",
        html.section("Fields", *(_fields(result, constraint) for constraint in WORDS)),
        html.section("Errors on held-out samples of this data set", _table(result)),
        html.settings_table(result.settings),
    )


def _fields(result: Result, constraint: str) -> html.Markup:
    """A panel for each method, so that no arrow hides another."""
    details = result.details
    grid, truth, fields = details["grid"], details["policy"], details[constraint]["fields"]
    longest = float(np.linalg.norm(truth, axis=1).max())
    spacing = float(np.diff(np.unique(grid[:, 0])).min()) if len(grid) > 1 else 1.0
    panels = [
        figures.vector_field(
            grid,
            {"truth": truth, method: fields[method]},
            longest=longest,
            scale=1.3 * spacing / longest,
            trajectories=[demo.states for demo in details[constraint]["demonstrations"]],
            title=figures.LABELS[method],
        )
        for method in figures.METHODS
    ]
    cut = _cut(fields, longest)
    words = f" Cut here: {'; '.join(cut)}." if cut else " None had to be cut."
    return html.picture(
        f"fields-{constraint}",
        panels,
        f"{WORDS[constraint]}. Arrows are velocities, not to the scale of the axes; whatever exceeds {longest:.2f} "
        f"m/s, the longest true one, is cut to that length so that the picture stays readable.{words}",
        keys=("truth", *figures.METHODS, "training"),
        least=340,
    )


def _cut(fields: dict[str, Any], longest: float) -> list[str]:
    shares = {key: float((np.linalg.norm(field, axis=1) > longest).mean()) for key, field in fields.items()}
    return [f"{share:.0%} of {figures.LABELS[key]}" for key, share in shares.items() if share > 0]


def _table(result: Result) -> html.Markup:
    header = ["method", "data", *(TITLES[metric] for metric in METRICS)]
    words = {"none": "free", "random": "constrained"}
    rows = [
        [
            parts.label(row["method"]),
            words.get(row["constraint"], row["constraint"]),
            *(html.number(100 * row[f"{metric}_mean"]) for metric in METRICS),
        ]
        for row in result.rows
    ]
    return html.table(header, rows, left=2, note="All × 10⁻², as a share of the policy’s variance.")

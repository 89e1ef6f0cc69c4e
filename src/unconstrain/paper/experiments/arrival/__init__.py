"""Motion that arrives: a person's strokes and cycles, guided, from where they began and from anywhere.

Nobody wrote with a constraint in the way. So strokes are followed as they are, and turned onto planes of any tilt,
which the learner is not told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import unconstrain as uc

from ...datasets.handwriting import SHAPES
from ..journal import Journal
from ..trials import Progress, Result, run_trials
from . import cycles, strokes

CYCLES = "cycles"

OTHERS = {"contracting": "contracting", "stable": "LPV-DS"}
"""What arrives by construction, too."""

DRIFT_MM = 5.0
"""A cycle that drifts by more over a hundred turns leaves its place."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Settings:
    """What is run.

    Parameters
    ----------
    trials : int
        Random starts of each shape, and random planes.
    only : tuple of str
        Shapes, such as "Worm", and "cycles"; all by default.
    turns : int
        Of each cycle.
    dt : float
        V is learnt for Euler steps of this length, s, or longer ones, with which movements are then followed.
    longest : float
        Movements take so many times as long as the longest demonstration.
    every : int
        Keep one sample in so many of the 1000 of each stroke.
    seed : int
        Of starts and planes.
    """

    trials: int = 100
    only: tuple[str, ...] = ()
    turns: int = 100
    dt: float = 0.005
    longest: float = 4.0
    every: int = 20
    seed: int = 0


def run(
    settings: Settings | None = None, workers: int = 1, progress: Progress | None = None, journal: Journal | None = None
) -> Result:
    """Guide what was learnt of every shape, free and on planes.

    Returns
    -------
    Result
        A row for each shape; the table "planes" has one for each shape lifted onto planes, "prices" what guiding costs
        with steps of several lengths, "ways" compares guided with unguided, contracting and another stable policy,
        "cycles" has a row for each cycle. ``details["drawn"]`` maps
        shapes to paths: "shown", "unguided" and "guided", first those from where strokes began.
    """
    chosen = settings or Settings()
    parts = chosen.only or (*SHAPES, CYCLES)
    shapes = [part for part in parts if part != CYCLES]
    calls: list[tuple[Any, ...]] = [(way, shape, chosen) for way in ("free", "lifted") for shape in shapes]
    if CYCLES in parts:
        calls += [(CYCLES, number, chosen) for number in range(cycles.BOUTS + 2)]
    found = run_trials(_trial, calls, workers, progress, journal)
    count = len(shapes)
    free, lifted, turned = found[:count], found[count : 2 * count], found[2 * count :]
    return Result(
        "arrival",
        chosen,
        [one["row"] for one in free],
        {"drawn": {one["row"]["shape"]: one["drawn"] for one in free}},
        {
            "planes": lifted,
            "ways": [way for one in free for way in one["ways"]],
            "prices": [one["prices"] for one in free],
            "cycles": [row for rows in turned for row in rows],
        },
    )


def _trial(way: str, which: Any, settings: Settings) -> Any:
    if way == CYCLES:
        return cycles.followed(which, settings)
    return strokes.free(which, settings) if way == "free" else strokes.lifted(which, settings)


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether guided movements arrive, and cycles stay where they were shown."""
    said, holds = list[str](), list[bool]()
    if result.rows:
        shown, anywhere, alone = (
            float(np.mean([row[key] for row in result.rows]))
            for key in ("shown_guided", "random_guided", "shown_unguided")
        )
        said.append(
            f"guided, {shown:.0%} of movements arrive from where they were shown and {anywhere:.0%} from anywhere, "
            f"{alone:.0%} without guidance"
        )
        holds.append(min(shown, anywhere) == 1.0)
    if result.tables["cycles"]:
        drift = max(row["drift_mm"] for row in result.tables["cycles"])
        said.append(f"cycles drift by {drift:.2f} mm at most")
        holds.append(drift <= DRIFT_MM)
    mark = uc.evaluation.verdicts.Mark.GOOD if all(holds) else uc.evaluation.verdicts.Mark.DOUBTFUL
    told = "; ".join(said)
    trust = "Arrival, which is by construction; how like the strokes movements are, as far as these strokes go."
    return uc.evaluation.verdicts.Verdict(
        mark.GOOD if all(holds) else mark.DOUBTFUL, f"{told[:1].upper()}{told[1:]}.", trust
    )


def headlines(result: Result) -> list[str]:
    """What was found, in a sentence for each promise."""
    return [
        *(_of_shapes(result.rows, result.tables["prices"]) if result.rows else []),
        *(_beside(result.tables["ways"]) if result.rows else []),
        *(_on_planes(result.tables["planes"]) if result.rows else []),
        *(_of_cycles(result.tables["cycles"]) if result.tables["cycles"] else []),
    ]


def _of_shapes(rows: Sequence[Row], prices: Sequence[Row]) -> list[str]:
    def mean(key: str) -> float:
        return float(np.mean([row[key] for row in rows if row[key] is not None] or [np.nan]))

    worst = max(rows, key=lambda row: row["nupe_ratio"])
    ratios = [row["area_ratio"] for row in rows if row["area_ratio"] is not None]
    beside = f", {np.mean(ratios):.2f} times that of unguided ones that arrive" if ratios else ""
    dearest = {step: max(row[step] for row in prices) for step in prices[0] if step != "shape"}
    return [
        f"arrive within 5 %, demonstrated starts: guided {mean('shown_guided'):.1%}, else {mean('shown_unguided'):.1%}",
        f"arrive within 5 %, random starts: guided {mean('random_guided'):.1%}, else {mean('random_unguided'):.1%}",
        f"area between path and stroke: {mean('area'):.0f} mm²{beside}; time warping: {mean('dtw'):.1f} mm",
        f"correction at demonstrated states: {mean('correction'):.1%} of motion, {mean('energy'):.2%} of its energy",
        f"nUPE there: {mean('nupe_ratio'):.3f} times, at worst {worst['nupe_ratio']:.2f} ({worst['shape']})",
        "nUPE there at worst with V for steps of "
        + ", ".join(f"{step}: {price:.2f}" for step, price in dearest.items()),
        f"one step takes {mean('step'):.2f} times as long, at worst {max(row['step'] for row in rows):.2f}",
    ]


def by_way(rows: Sequence[Row]) -> dict[str, dict[str, float | None]]:
    """Means over the shapes of each way; of an area over those where it arrives from where strokes began."""
    found = {}
    for way in dict.fromkeys(row["way"] for row in rows):
        mine = [row for row in rows if row["way"] == way]
        told = {
            key: [row[key] for row in mine if row[key] is not None] for key in mine[0] if key not in ("shape", "way")
        }
        found[way] = {key: float(np.mean(values)) if values else None for key, values in told.items()}
    return found


def _beside(rows: Sequence[Row]) -> list[str]:
    """Guided beside what else arrives."""
    areas = {way: np.array([row["area"] for row in rows if row["way"] == way], float) for way in ("guided", *OTHERS)}
    said = []
    for way, name in OTHERS.items():
        ratios = areas["guided"] / areas[way]
        said.append(
            f"guided paths sweep {areas['guided'].mean() / areas[way].mean():.2f} times the area of {name} ones: more "
            f"than 1.2 times in {(ratios > 1.2).sum()} of {len(ratios)} shapes, {np.median(ratios):.2f} in their median"
        )
    return said


def _on_planes(rows: Sequence[Row]) -> list[str]:
    keys = ("falls", "optimum", "own_planes", "contracting")
    falls, optimum, own, contracting = (float(np.mean([row[key] for row in rows])) for key in keys)
    return [
        f"on random planes V falls at every step in {falls:.1%}, and ends where it is least there in {optimum:.1%}",
        f"strokes turned onto planes of their own: {own:.1%} arrive guided, {contracting:.1%} contracting",
    ]


def _of_cycles(rows: Sequence[Row]) -> list[str]:
    said = []
    for name, some in (("simulated", rows[: -cycles.BOUTS - 1]), ("recorded", rows[-cycles.BOUTS - 1 :])):
        radius, pace = (max((row[f"{key}_off"] for row in some), key=abs) for key in ("radius", "pace"))
        least, most = (pick(row["correction"] for row in some) for pick in (min, max))
        said.append(
            f"{name} cycles after {min(row['turns'] for row in some):.0f} turns, the worst: radius {radius:+.1%}, pace "
            f"{pace:+.1%}, drift {max(row['drift_mm'] for row in some):.2f} mm, correction {least:.0%} to {most:.0%}"
            " of the motion"
        )
    return said

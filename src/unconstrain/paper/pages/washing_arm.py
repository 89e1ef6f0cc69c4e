"""The arm that wipes with the learnt policy: pictures, force, path and what was measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...base.errors import UnconstrainError
from ...pages import figures, html
from ..experiments.trials import Result
from ..experiments.washing import WITHOUT_PHYSICS
from ..experiments.washing.arm import Reproduction
from ..figures import arms, plates
from ..simulation import BACKENDS
from ..simulation.pictures import animation, film, strip
from ..simulation.reproduction import Wipe
from ..systems.arm import LWR3
from . import parts

STATEMENT = (
    "The default policy gives a velocity at every position; projected onto the plate it becomes joint velocities, "
    "together with standing upright on the plate and an admittance that holds the pressing force; what that leaves "
    "free returns the arm to a resting posture. Torques move the arm, and a spring in the sponge meets the plate. "
    "The cycle attracts on every plate, at the pace that was shown: where recordings only show a steady cycle, they "
    "cannot tell that, and it is seen to by construction (Guided)."
)


def on_the_arm(result: Result) -> list[html.Markup]:
    """Everything about the reproduction; a sentence where there is no physics engine."""
    done: list[Reproduction] = result.details["reproductions"]
    if not done:
        return [html.paragraph(WITHOUT_PHYSICS)]
    parts = [html.paragraph(STATEMENT)]
    wiped = [(one, one.wipe) for one in done if one.wipe is not None]
    if wiped:
        shown = next((pair for pair in wiped if not pair[0].seen), wiped[0])
        parts += [_pictures(*shown), _tracks(wiped)]
    return [*parts, _measures(result.tables["reproduction"])]


def _pictures(shown: Reproduction, wipe: Wipe) -> html.Markup:
    name = f"plate {shown.plate.name}, which nobody {'wiped' if shown.demonstration is None else 'learnt from'}"
    turn = 1.0 / wipe.measures()["frequency"]  # seconds; of one turn, a film repeats without a jump
    try:
        moving = parts.image(
            "animation", animation(film(wipe, turn)), "webp", f"The arm wipes a plate tilted {shown.plate.name}",
            f"The arm on {name}, as fast as it is. The line is the path of the sponge.",
        )  # fmt: skip
        if shown.demonstration is None:
            return moving
        return moving + parts.image(
            "strip", strip(shown.demonstration, wipe), "webp", "A hand wipes a plate; below, the arm wipes it",
            "One turn of the demonstration on this plate (above, positions as the camera saw them), and one of the "
            "reproduction (below), like figure 6 of the paper. The demonstration was not learnt from.",
        )  # fmt: skip
    except UnconstrainError:
        without = html.markup(
            "The arm on {}, at four moments of its last turn. The scene cannot be rendered on this machine, so the arm "
            "is drawn as lines. On Debian, <code>apt-get install {egl} libegl-mesa0</code> or <code>apt-get install "
            "{osmesa}</code> gives the real picture; <code>unconstrain doctor</code> tells what is missing."
        ).format(name, **BACKENDS)
        shows = f"The arm wipes a plate tilted {shown.plate.name}, as lines"
        return parts.image("arm", _lines(wipe), "png", shows, without)


def _lines(wipe: Wipe) -> bytes:
    length = round(1.0 / (wipe.measures()["frequency"] * (wipe.times[1] - wipe.times[0])))
    last = slice(max(0, len(wipe.times) - length), None)
    rows = np.linspace(max(0, len(wipe.times) - length), len(wipe.times) - 1, 4).astype(int)
    _, joints = LWR3.frames(wipe.postures[rows])
    track = wipe.positions[last] + wipe.plate.centre
    plate = plates.Quad.around(track, wipe.plate.rotation[:, 2], margin=1.5)
    return arms.arm_on_plate(np.moveaxis(joints, -1, 0), track, plate)


def _tracks(wiped: list[tuple[Reproduction, Wipe]]) -> html.Markup:
    panels = []
    for one, wipe in wiped:
        plate = plates.Quad.around(wipe.positions, wipe.plate.rotation[:, 2], margin=1.6)
        lines = {} if one.demonstration is None else {"observed": plate.flatten(one.demonstration.states)}
        lines["robust"] = plate.flatten(wipe.positions)
        title = f"{one.plate.name} ({'seen' if one.seen else 'unseen'})"
        labels = ("in the plate (m)", "in the plate (m)")
        panels.append(figures.paths(list(lines.items()), reach=plate.half, title=title, labels=labels))
        series = {"robust": np.column_stack([wipe.forces])}
        force = figures.over_time(wipe.times, series, ["force (N)"], title=f"normal force, {title}", row_height=340)
        force.axes[0].set_ylim(bottom=0.0)
        panels.append(force)
    return html.picture(
        "arm-paths",
        panels,
        "The sponge on each plate, seen from above it, with the hand’s strokes thin where there are any; beside it "
        "the normal force between sponge and plate. Zero would be lost contact.",
        keys=("observed", "robust"),
        labels={"robust": "arm", "observed": "hand"},
        least=380,
    )


MEASURES = (
    "learnt from",
    "turns",
    "contact",
    "force (N)",
    "frequency (Hz)",
    "demonstrated (Hz)",
    "radius (cm)",
    "demonstrated (cm)",
    "drift (mm)",
    "path error (mm)",
    "largest torque",
    "× real time",
)


def _measures(rows: list[dict[str, Any]]) -> html.Markup:
    """A column for each plate, so that any screen is wide enough."""
    several = len({row["trial"] for row in rows}) > 1
    names, columns = [], []
    for surface in dict.fromkeys(row["surface"] for row in rows):
        of_plate = [row for row in rows if row["surface"] == surface]
        done = [row for row in of_plate if not row["failed"]]
        names.append(surface + (f"\n{len(of_plate)} runs" if several else ""))
        cells = _cells(done) if done else ["–"] * (len(MEASURES) - 1)
        columns.append(["yes" if of_plate[0]["seen"] else "no", *cells])
    note = (
        "Largest torque: as a share of what its joint can. Radius: rms distance from the middle. Drift: from the "
        "middle of the first turn to that of the last. Path error: rms distance from where the policy itself would "
        "have been. "
    )
    note += "Means over the runs, and in brackets the worst." if several else ""
    failed = [f"Not wiped: {row['failed']}" for row in rows if row["failed"]]
    body = [list(row) for row in zip(MEASURES, *columns, strict=True)]
    return html.table(["plate", *names], body, note=html.markup("<br>").join([note, *failed]))


def _cells(rows: list[dict[str, Any]]) -> list[str]:
    def mean(key: str) -> float:
        return float(np.mean([row[key] for row in rows]))

    def cell(key: str, scale: float, worst: Any) -> str:
        values = [scale * row[key] for row in rows]
        bracket = f" ({html.number(worst(values))})" if len(rows) > 1 else ""
        return html.number(float(np.mean(values))) + bracket

    return [
        html.number(mean("cycles")),
        f"{cell('contact_share', 100.0, min)} %",
        f"{html.number(mean('force_mean'))} ± {html.number(mean('force_sd'), 2)}",
        html.number(mean("frequency")),
        html.number(mean("frequency_demonstrated")),
        html.number(100.0 * mean("spread_m")),
        html.number(100.0 * mean("spread_demonstrated_m")),
        cell("drift_m", 1000.0, max),
        cell("path_error_m", 1000.0, max),
        f"{cell('torque_share', 100.0, max)} %",
        cell("speed", 1.0, min),
    ]

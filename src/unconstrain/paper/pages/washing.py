"""The page of the car-washing experiment, simulated or recorded."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import unconstrain as uc

from ...base.arrays import Array
from ...pages import figures, html
from ...risks import null_space_projection, project
from ..experiments import washing
from ..experiments.trials import Result
from ..experiments.washing.learning import Split
from ..experiments.washing.surfaces import Surface
from ..figures import plates
from ..systems.wiping import WipingPolicy
from .washing_arm import on_the_arm
from .washing_scores import LEARNERS, bars, scores

BESIDE = ("direct", "robust")
"""Learners whose velocities are drawn over time; more would hide each other."""

MOST_CASES = 4
"""Velocities are drawn for so many of the plates that nobody learnt from."""

ARROWS = 11
"""Fields are drawn on so many points along each axis of a plate."""


class Case(NamedTuple):
    """A demonstration that nobody learnt from, on its plate, and the split that held it out."""

    split: Split
    surface: Surface
    demonstration: uc.Demonstration
    normal: Array

    @property
    def plate(self) -> plates.Quad:
        """Where the demonstration was, as a piece of its plane."""
        return plates.Quad.around(self.demonstration.states, self.normal)

    @property
    def title(self) -> str:
        """Such as ``"+16° about y"`` or ``"tilt40 (B1)"``."""
        name = self.demonstration.name
        return self.surface.name if name in ("", self.surface.name) else f"{self.surface.name} ({name})"


def page(result: Result) -> str:
    """Demonstrations, fields, predictions, movements, scores and what the data determined."""
    splits: list[Split] = result.details["splits"]
    real = bool(result.rows and "normal" in result.rows[0])
    cases = [
        Case(split, surface, surface.demonstrations[0], surface.normals[0]["plane"])
        for split in splits
        for surface in split.held_out
    ]
    return html.document(
        "Wiping a car rim, as recorded" if real else "Washing a car, simulated",
        washing.verdict(result),
        _lead(real),
        html.section("On the arm", *on_the_arm(result)),
        html.section("How well each method does", scores(result), bars(result)),
        html.section("The demonstrations", _demonstrations(splits)),
        html.section("The policy on plates that nobody learnt from", _fields(cases, real)),
        html.section("Predicted and observed velocity on these plates", _velocities(cases)),
        html.section("Wiping a plate that nobody learnt from", _rollouts(splits)),
        html.section("What the data determined", _spectra(splits, result.settings)),
        html.settings_table(result.settings),
    )


def _lead(real: bool) -> html.Markup:
    recorded = html.markup(
        "A robot arm is led by hand to wipe a car rim at four tilts. One tilt at a time is left out: the policy is "
        "learnt from the other three, put under the constraint of the fourth, and compared with what was done there. "
        "The true policy is not known, so only the error along the surface can be told (<b>nCPE</b>)."
    )
    simulated = html.markup(
        "One policy in three dimensions (circle, come back to height, press down) wipes seven plates, and each "
        "plate takes away what points into it. A camera watches with millimetres of noise. The policy is learnt from "
        "the five plates that are tilted about x and tested on the two that are tilted about y. <b>nCPE</b> is its "
        "error along the plate, <b>nUPE</b> its error where nothing is in the way."
    )
    return (recorded if real else simulated) + (
        " Nobody tells the learner where the plates are. Direct learning averages them into the skill; "
        "inconsistency alone removes them, but trusts noisy directions as much as clear ones; the hybrid weighs the "
        "one against the other, and robust, the default of fit, chooses with nothing set for this job."
    )


def _demonstrations(splits: list[Split]) -> html.Markup:
    if len(splits) == 1:
        [split] = splits
        kinds = [("training", one) for one in split.training] + [("held out", one) for one in split.held_out]
        caption = "Each plate is drawn translucent around the movement that was made on it. Grey ones are learnt from, "
        caption += "the coloured ones are for testing."
    else:
        kinds = [(one.name, one) for split in splits for one in split.held_out]
        caption = (
            "Each translucent plane is the one nearest to a bout; bouts of one colour share a tilt, and each tilt "
        )
        caption += "is held out once."
    tracks, corners = [], []
    for key, surface in kinds:
        for demo, normals in zip(surface.demonstrations, surface.normals, strict=True):
            tracks.append((key, demo.states))
            corners.append((key, plates.Quad.around(demo.states, normals["plane"]).corners))
    keys = tuple(dict.fromkeys(key for key, _ in kinds))
    colours = {key: figures.COLOURS.get(key, figures.PALETTE[at % len(figures.PALETTE)]) for at, key in enumerate(keys)}
    return html.picture(
        "demonstrations",
        [figures.movements(tracks, corners)],
        f"{caption} Positions are relative to the middle of each plate.",
        keys=keys,
        colours=colours,
    )


def _fields(cases: list[Case], real: bool) -> html.Markup:
    """A panel for each learner, so that no arrow hides another, on the first of these plates."""
    case, plate = cases[0], cases[0].plate
    points = plate.grid(ARROWS)
    states = plate.place(points)
    truth = {} if real else {"truth": WipingPolicy()(states) @ plate.axes}
    demo = case.demonstration
    reference = (demo.truth.policy if demo.truth is not None else demo.actions) @ plate.axes
    longest = float(np.linalg.norm(reference, axis=1).max())
    panels = [
        figures.vector_field(
            points,
            truth | {name: case.split.policies[name](states) @ plate.axes},
            longest=longest,
            scale=2.6 * plate.half / ARROWS / longest,
            trajectories=[plate.flatten(demo.states)],
            trajectories_are="held out",
            title=f"{figures.LABELS[name]}, {case.title}",
            labels=_axis_labels(case),
        )
        for name in LEARNERS
    ]
    against = (
        "The pink line is the demonstration that was held out; arrows should follow it."
        if real
        else "Thin arrows are the true policy; the pink line is the demonstration that was held out."
    )
    return html.picture(
        "fields",
        panels,
        f"Learnt velocities, projected onto the plate and seen from above it. {against} Away from it "
        "nobody recorded anything, and all of them guess. Arrows are not to the scale of the axes, and those that are "
        f"longer than the longest {'observed' if real else 'true'} one on the pink line are cut to it.",
        keys=(*(() if real else ("truth",)), *LEARNERS, "held out"),
    )


def _velocities(cases: list[Case]) -> html.Markup:
    panels = []
    for case in cases[:MOST_CASES]:
        demo = case.demonstration
        onto = null_space_projection(case.normal[None, :])
        series = {name: project(onto, case.split.policies[name](demo.states)) for name in BESIDE}
        times = demo.times if demo.times is not None else np.arange(len(demo), dtype=np.float64)
        names = [f"v{axis} (m/s)" for axis in "xyz"]
        panels.append(figures.over_time(times, series | {"observed": demo.actions}, names, title=case.title))
    return html.picture(
        "velocities",
        panels,
        "Velocity in world coordinates. Thin is what was observed, coloured what each method predicts at the observed "
        "positions once its prediction is projected onto the plate (N π̃).",
        keys=("observed", *BESIDE),
    )


def _rollouts(splits: list[Split]) -> html.Markup:
    panels, left = [], []
    for split in splits:
        surface = split.held_out[0]
        case = Case(split, surface, surface.demonstrations[0], surface.normals[0]["plane"])
        plate = case.plate
        reach = 2.0 * plate.half
        lines = {"observed": plate.flatten(case.demonstration.states)}
        for name, run in split.rollouts.items():
            path = plate.flatten(run.states)
            outside = np.flatnonzero(np.abs(path).max(axis=1) > reach)
            if len(outside):
                left.append(f"{figures.LABELS[name]} after {_seconds(run, outside[0])} on {case.title}")
            lines[name] = path[: outside[0] + 1] if len(outside) else path
        panels.append(
            figures.paths(list(lines.items()), reach=reach, title=case.title, labels=_axis_labels(case), height=480)
        )
    longest = next(iter(splits[0].rollouts.values()))
    escaped = f" These left the picture: {'; '.join(left)}." if left else ""
    return html.picture(
        "rollouts",
        panels,
        f"Each learnt policy, started where the demonstration starts (dot) and followed for {_seconds(longest, -1)} "
        "under the plate’s constraint, seen from above the plate. "
        f"A policy that drifts off or falls into the middle would not wipe.{escaped}",
        keys=("observed", *LEARNERS),
    )


def _seconds(movement: uc.Demonstration, at: int) -> str:
    return f"step {at}" if movement.times is None else f"{round(movement.times[at], 1):g} s"


def _spectra(splits: list[Split], settings: Any) -> html.Markup:
    panels, counts, directions = [], [], 0
    for split in splits:
        found = split.policies["inconsistency"].solution_
        if found.eigenvalues is None:
            continue
        names = ", ".join(surface.name for surface in split.held_out)
        panels.append(figures.spectra(found.eigenvalues, title=f"without {names}" if len(splits) > 1 else ""))
        counts.append(str(len(found.eigenvalues)))
        directions = found.directions
    return html.picture(
        "spectra",
        panels,
        f"Each receptive field ({', '.join(counts)} of them) has a linear model with {directions} weights; lines show "
        "how strongly the inconsistency pins down each direction of these weights, relative to its strongest. "
        "Directions far down on the right are barely determined: inconsistency alone fills them with noise, while the "
        f"hybrid here (softness {settings.softness:g}, threshold {settings.threshold:g}) hands each direction over to "
        "direct learning by degrees, the weaker the more.",
        keys=("each field", "median"),
        colours={"each field": figures.COLOURS["inconsistency"], "median": figures.COLOURS["truth"]},
    )


def _axis_labels(case: Case) -> tuple[str, str]:
    first, second = (_direction(axis) for axis in case.plate.axes.T)
    return f"in the plate, along {first} (m)", f"in the plate, along {second} (m)"


def _direction(axis: Array) -> str:
    """Which world axis a direction is nearest to."""
    at = int(np.abs(axis).argmax())
    return f"{'−' if axis[at] < 0 else ''}{'xyz'[at]}"

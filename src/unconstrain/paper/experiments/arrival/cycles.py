"""Cycles, simulated and recorded: radius, pace and drift after a hundred turns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ...datasets import load_rim_wiping
from ...systems.wiping import HELD_OUT, PLATES, Plate, Strokes, WipingPolicy, demonstrate
from .strokes import price

if TYPE_CHECKING:
    from . import Settings

BOUTS = 10
"""Recorded."""

DT = 0.05
"""Of the samples of what is followed, s."""

LAST = 5
"""Radius and pace are those of the last turns, of twice so many."""

Planes = Sequence[uc.constraints.Plane]


def followed(which: int, settings: Settings) -> list[dict[str, Any]]:
    """Simulated cycles (0), each bout, and all bouts together."""
    if which == 0:
        return simulated(settings)
    return recorded(which - 1, settings) if which <= BOUTS else pooled(settings)


def recorded(bout: int, settings: Settings) -> list[dict[str, Any]]:
    """Learnt from one bout, and followed on its plane."""
    one = load_rim_wiping(centre=True)[bout]
    demos = [one.demonstration]
    policy = _learnt(demos)
    plane = uc.constraints.Plane(one.plane_normal)
    return _followed(uc.Guided(policy, demonstrations=demos), demos, [plane], [one.name], settings)


def pooled(settings: Settings) -> list[dict[str, Any]]:
    """Learnt from all bouts, and followed on the plane of each, where people wiped wider and narrower ones."""
    bouts = load_rim_wiping(centre=True)
    demos = [bout.demonstration for bout in bouts]
    policy, planes = _learnt(demos), [uc.constraints.Plane(bout.plane_normal) for bout in bouts]
    found = _followed(uc.Guided(policy, demonstrations=demos), demos, planes, ["all"] * len(bouts), settings)
    mean = {name: float(np.mean([one[name] for one in found])) for name in found[0] if name != "cycle"}
    return [{"cycle": "ten bouts together, mean", **mean}]


def simulated(settings: Settings) -> list[dict[str, Any]]:
    """Learnt from strokes that swing in to a cycle on five plates, and followed on these and on two others."""
    rng, how = np.random.default_rng(settings.seed), Strokes()
    wiped = {plate: demonstrate(plate, rng, strokes=how) for plate in PLATES if plate not in HELD_OUT}
    demos = list(wiped.values())
    policy, planes = _learnt(demos), [plate.constraint for plate in PLATES]
    truth = uc.rollout(WipingPolicy(), _on_circle(PLATES), 400, DT, planes)
    guided = uc.Guided(policy, orbit="shown", demonstrations=[one for demo in demos for one in how.settled(demo)])
    return _followed(guided, [run[200:] for run in truth], planes, [plate.name for plate in PLATES], settings)


def measured(path: Array, normal: Array, dt: float) -> dict[str, float]:
    """Turns of a path (T, 3) on a plane; their radius, rms from their middle, pace, and how far each one's middle is.

    The drift is that from the second turn to the last.
    """
    flat = (path - path.mean(axis=0)) @ np.linalg.svd(normal[None])[2][1:].T
    angle = np.unwrap(np.angle(flat @ [1.0, 1j]))
    angle *= np.sign(angle[-1] - angle[0])
    count = int((angle[-1] - angle[0]) / (2.0 * np.pi))
    rows = np.interp(angle[-1] - 2.0 * np.pi * np.arange(count, -1, -1), angle, np.arange(len(flat)))
    within = np.linspace(rows[:-1], rows[1:], 64, endpoint=False)  # (64, turns), as time goes
    middles = np.stack([np.interp(within, np.arange(len(flat)), each).mean(axis=0) for each in flat.T], axis=1)
    return {
        "turns": float(count),
        "radius": float(np.sqrt(flat.var(axis=0).sum())),
        "pace": count / float((rows[-1] - rows[0]) * dt),
        "drift": float(np.linalg.norm(middles[-1] - middles[min(1, count - 1)])),
    }


def _learnt(demos: Sequence[uc.Demonstration]) -> uc.LocallyLinearPolicy:
    """As in the washing experiment."""
    policy = uc.LocallyLinearPolicy(0.0025, 0.7, learner=uc.Hybrid(threshold=0.0, softness=0.1))
    return policy.fit_demonstrations(demos)


def _on_circle(plates: Sequence[Plate]) -> Array:
    return np.stack([WipingPolicy().radius * plate.rotation[:, 0] for plate in plates])


def _followed(
    guided: uc.Guided, shown: Sequence[uc.Demonstration], planes: Planes, names: Sequence[str], settings: Settings
) -> list[dict[str, Any]]:
    normals = [np.asarray(plane.normal, np.float64) for plane in planes]
    asked = [measured(demo.states, normal, DT) for demo, normal in zip(shown, normals, strict=True)]
    steps = int((settings.turns + 3) / min(one["pace"] for one in asked) / DT * 1.2)
    starts = np.stack([_on(normal, demo.states) for demo, normal in zip(shown, normals, strict=True)])
    runs = uc.rollout(guided, starts, steps, DT, planes)
    each = zip(names, asked, runs, normals, shown, strict=True)
    return [
        _row(name, was, run.states, normal) | price(guided.policy, guided, [demo])
        for name, was, run, normal, demo in each
    ]


def _on(normal: Array, states: Array) -> Array:
    """Where a movement begins, put down on the plane through its middle."""
    return states[0] - normal * float(normal @ (states[0] - states.mean(axis=0)))


def _row(name: str, was: dict[str, float], path: Array, normal: Array) -> dict[str, Any]:
    whole, last = measured(path, normal, DT), measured(path[-round(2.0 * LAST / was["pace"] / DT) :], normal, DT)
    shown = {f"{key}_shown": was[key] for key in ("radius", "pace")}
    off = {f"{key}_off": last[key] / was[key] - 1.0 for key in ("radius", "pace")}
    return {"cycle": name, "turns": whole["turns"], **shown, **off, "drift_mm": 1e3 * whole["drift"]}

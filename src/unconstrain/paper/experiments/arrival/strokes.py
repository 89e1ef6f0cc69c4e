"""A person's strokes, free and lifted onto planes: where movements with what was learnt of them end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc

from ....base.arrays import Array
from ...datasets import load_handwriting
from .paths import resampled, swept_area, warped

if TYPE_CHECKING:
    from . import Settings

Demos = Sequence[uc.Demonstration]
Ways = dict[str, Callable[[Array], Array]]

NEAR = 0.05
"""Arrived: nearer to the goal than this share of the largest distance that was shown."""

DRAWN = 12
"""Paths from random starts on the page, of each shape."""

AROUND = 1.5
"""Random starts are anywhere in a box so many times that of the demonstrations."""

PLANE_DT = 0.02
"""Of the Euler steps on planes, s."""

PATIENCE = 3.0
"""On random planes movements may take so many times as long: V falls slowly where a plane leaves little of a policy."""

PIECE_S = 0.5
"""What has not moved for so long, by more than STILL of the largest distance, has come to rest."""

STILL = 1e-4

PACES = (0.02, 0.01, 0.005, 0.002, 0.001)
"""Steps for which V is learnt and the price is told, s."""

STEEPEST = np.pi / 4
"""Of the planes that strokes are lifted onto."""


def free(shape: str, settings: Settings) -> dict[str, Any]:
    """One shape with nothing in the way: a row, and the paths to draw."""
    demos = load_handwriting(shape, every=settings.every)
    policy = uc.LocallyLinearPolicy(learner="direct").fit_demonstrations(demos)
    guided = uc.Guided(policy, demonstrations=demos, dt=settings.dt)
    strokes = [demo.states for demo in demos]
    starts = [*(stroke[0] for stroke in strokes), *anywhere(demos, settings)]
    ways: Ways = {"unguided": stopped_outside(policy, demos), "guided": guided}
    runs = {name: _paths(way, starts, demos, settings) for name, way in ways.items()}
    ends = {name: arrived(paths, guided.goal_, demos) for name, paths in runs.items()}
    shown = slice(len(demos))
    row = {
        "shape": shape,
        **{f"shown_{name}": float(there[shown].mean()) for name, there in ends.items()},
        **{f"random_{name}": float(there[len(demos) :].mean()) for name, there in ends.items()},
        **_likeness(runs, ends["unguided"][shown], strokes),
        **_price(policy, guided, demos),
        "step": per_step(guided, demos) / per_step(policy, demos),
        "dt": guided.dt_,
    }
    count = len(demos)
    drawn = {
        "shown": strokes,
        "unguided": runs["unguided"][:count],
        "guided": runs["guided"][:count],
        "random": runs["guided"][count : count + DRAWN],
    }
    return {
        "row": row,
        "prices": {"shape": shape} | _prices(policy, demos),
        "drawn": {name: [resampled(path, 60).round(2).tolist() for path in paths] for name, paths in drawn.items()},
    }


def lifted(shape: str, settings: Settings) -> dict[str, Any]:
    """One shape whose strokes are each turned onto a plane of their own, which nobody tells the learner: a row."""
    flat = load_handwriting(shape, every=settings.every)
    rng = np.random.default_rng([settings.seed, *shape.encode()])
    turns = [_turn(rng) for _ in flat]
    demos = [
        uc.Demonstration(demo.states @ turn.T, demo.actions @ turn.T, demo.times, name=demo.name)
        for demo, turn in zip(flat, turns, strict=True)
    ]
    policy = uc.LocallyLinearPolicy(learner=uc.Hybrid(threshold=0.0, softness=0.1)).fit_demonstrations(demos)
    guided = uc.Guided(policy, demonstrations=demos, dt=settings.dt)
    own = [uc.constraints.Plane(np.cross(*turn.T)) for turn in turns]
    paths = _paths(guided, [demo.states[0] for demo in demos], demos, settings, own)
    there = arrived(paths, guided.goal_, demos)
    inside = [path @ turn for path, turn in zip(paths, turns, strict=True)]
    return {
        "shape": shape,
        "own_planes": float(there.mean()),
        "area": float(np.mean([swept_area(a, b.states) for a, b in zip(inside, flat, strict=True)])),
        **_price(policy, guided, demos),
        **_on_random_planes(guided, demos, rng, settings),
    }


def anywhere(demos: Demos, settings: Settings) -> Array:
    """Random starts around the demonstrations."""
    states = uc.stack(demos).states
    low, high = states.min(axis=0), states.max(axis=0)
    drawn = np.random.default_rng(settings.seed).random((settings.trials, states.shape[1]))
    return (low + high) / 2 + AROUND * (drawn - 0.5) * (high - low)


def stopped_outside(policy: uc.Policy, demos: Demos) -> Callable[[Array], Array]:
    """A policy that stands still far from anything that was shown: what leaves has left."""
    far = 10.0 * _reach(demos)
    return lambda states: np.where(np.linalg.norm(states, axis=1, keepdims=True) < far, policy(states), 0.0)


def arrived(paths: Sequence[Array], goal: Array, demos: Demos) -> NDArray[np.bool_]:
    """Which paths end near the goal."""
    return np.array([np.linalg.norm(path[-1] - goal) for path in paths]) < NEAR * _reach(demos)


def per_step(policy: Any, demos: Demos) -> float:
    """Seconds for a single state: the least of some runs."""
    states, times = uc.stack(demos).states[:200], []
    for _ in range(15):
        begun = perf_counter()
        for state in states:
            policy.step(state)
        times.append(perf_counter() - begun)
    return min(times) / len(states)


def _reach(demos: Demos) -> float:
    return float(np.linalg.norm(uc.stack(demos).states, axis=1).max())


def _paths(
    policy: Callable[[Array], Array], starts: Sequence[Array], demos: Demos, settings: Settings, held: Any = None,
    patience: float = 1.0,
) -> list[Array]:  # fmt: skip
    """Followed until all have come to rest, or for as long as there is patience."""
    longest = max(float(demo.times[-1]) for demo in demos if demo.times is not None)
    steps = round(PIECE_S / settings.dt)
    pieces, places = list[Array](), np.stack(starts)
    for _ in range(int(patience * settings.longest * longest / PIECE_S)):
        pieces.append(np.stack([run.states for run in uc.rollout(policy, places, steps + 1, settings.dt, held)]))
        moved, places = np.abs(pieces[-1][:, -1] - places).max(), pieces[-1][:, -1]
        if moved < STILL * _reach(demos):
            break
    return list(np.concatenate([pieces[0][:, :1], *(piece[:, 1:] for piece in pieces)], axis=1))


def _likeness(
    runs: dict[str, list[Array]], there: NDArray[np.bool_], strokes: Sequence[Array]
) -> dict[str, float | None]:
    """Means over the strokes; the guided paths beside those unguided ones that arrive, where any does."""
    areas = {name: np.array([swept_area(*pair) for pair in zip(paths, strokes, strict=False)])
             for name, paths in runs.items()}  # fmt: skip
    beside = float(areas["guided"][there].sum() / areas["unguided"][there].sum()) if there.any() else None
    return {
        "area": float(areas["guided"].mean()),
        "area_ratio": beside,
        "dtw": float(np.mean([warped(*pair) for pair in zip(runs["guided"], strokes, strict=False)])),
    }


def _price(policy: uc.Policy, guided: uc.Guided, demos: Demos) -> dict[str, float]:
    """What the correction is at the demonstrated states, and what it costs there."""
    states, actions, _ = uc.stack(demos)
    wanted, added = policy(states), guided.correction(states)
    return {
        "correction": float(np.linalg.norm(added, axis=1).sum() / np.linalg.norm(wanted, axis=1).sum()),
        "energy": float((added**2).sum() / (wanted**2).sum()),
        "nupe_ratio": float(((wanted + added - actions) ** 2).sum() / ((wanted - actions) ** 2).sum()),
    }


def _prices(policy: uc.Policy, demos: Demos) -> dict[str, float]:
    """The same price of V for steps of other lengths."""
    return {
        f"{1e3 * dt:g} ms": _price(policy, uc.Guided(policy, demonstrations=demos, dt=dt), demos)["nupe_ratio"]
        for dt in PACES
    }


def _turn(rng: np.random.Generator) -> Array:
    """Axes of a plane through the goal, (3, 2): turned about a level line."""
    about, by = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, STEEPEST)
    level, across = np.array([np.cos(about), np.sin(about), 0.0]), np.array([-np.sin(about), np.cos(about), 0.0])
    tilted = np.cos(by) * across + np.sin(by) * np.array([0.0, 0.0, 1.0])
    return np.outer(level, level[:2]) + np.outer(tilted, across[:2])


def _on_random_planes(
    guided: uc.Guided, demos: Demos, rng: np.random.Generator, settings: Settings
) -> dict[str, float]:
    """Whether V falls at every step on planes of any tilt, and ends where it is least on them."""
    normals = rng.standard_normal((settings.trials, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    planes = [uc.constraints.Plane(normal) for normal in normals]
    paths = _paths(guided, list(anywhere(demos, settings)), demos, settings, planes, PATIENCE)
    falls, ends = [], []
    for path, normal in zip(paths, normals, strict=True):
        level = guided.potential_(path)
        falls.append(bool((np.diff(level) <= 1e-12 * level[0]).all()))
        ends.append(np.linalg.norm(path[-1] - _least(guided, path[-1], normal)) < NEAR * _reach(demos))
    return {"falls": float(np.mean(falls)), "optimum": float(np.mean(ends))}


def _least(guided: uc.Guided, place: Array, normal: Array) -> Array:
    """Where V is least on the plane through a place."""
    from scipy.optimize import minimize

    basis = np.linalg.svd(normal[None])[2][1:]
    found = minimize(
        lambda y: guided.potential_((place + y @ basis)[None])[0],
        np.zeros(2),
        jac=lambda y: basis @ guided.potential_.gradient((place + y @ basis)[None])[0],
    )
    return place + found.x @ basis

"""A person's strokes, free and lifted onto planes: where movements with what was learnt of them end."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc

from ....base.arrays import Array
from ...datasets import load_handwriting
from .paths import resampled, swept_area, warped
from .stable import stable

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

LONGEST_STEP = 0.02
"""Of Euler's, s: movements are followed with steps up to this with which V is sure to fall."""

PATIENCE = 6.0
"""Of what arrives by construction, and comes nearer slowly at worst: so many times as long."""

PIECE_S = 0.5
"""What has not moved for so long, by more than STILL of the largest distance, has come to rest."""

STILL = 1e-4

RATE = 0.3
"""At which contracting and stable policies come nearer at least, over the duration of the longest stroke."""

FREE = 1e3
"""Softness of the contracting policy of free strokes: those of the standard risk alone, as of the policy guided."""

PACES = (0.02, 0.005, 0.001)
"""Steps for which V is learnt and the price is told, s."""

STEEPEST = np.pi / 4
"""Of the planes that strokes are lifted onto."""


def free(shape: str, settings: Settings) -> dict[str, Any]:
    """One shape with nothing in the way: a row, and the paths to draw."""
    demos = load_handwriting(shape, every=settings.every)
    policy = uc.LocallyLinearPolicy("auto", learner="direct").fit_demonstrations(demos)
    guided = uc.Guided(policy, demonstrations=demos, dt=settings.dt)
    strokes = [demo.states for demo in demos]
    contracting = _contracting(demos, guided.goal_, policy, FREE)
    runs = _runs(policy, guided, contracting, demos, settings)
    ends = {name: arrived(paths, guided.goal_, demos) for name, paths in runs.items()}
    timed = {"unguided": policy, "guided": guided, "contracting": contracting}
    steps = {name: 1e6 * least for name, least in per_step(timed, demos).items()}
    likeness = {name: _likeness(runs[name], ends[name], strokes) for name in runs}
    shares = {name: _shares(there, len(demos)) for name, there in ends.items()}
    row = {
        "shape": shape,
        **{f"{key}_{name}": shares[name][key] for key in ("shown", "random") for name in ("unguided", "guided")},
        "area": likeness["guided"]["area"],
        "area_ratio": _ratio(runs, ends["unguided"], strokes),
        "dtw": likeness["guided"]["dtw"],
        **price(policy, guided, demos),
        "step": steps["guided"] / steps["unguided"],
        "dt": guided.dt_,
    }
    return {
        "row": row,
        "ways": [
            {"shape": shape, "way": name, **shares[name], **likeness[name], "step_us": steps.get(name)} for name in runs
        ],
        "prices": {"shape": shape} | _prices(policy, demos),
        "drawn": _drawn(runs, strokes),
    }


def _runs(
    policy: uc.Policy, guided: uc.Guided, contracting: uc.Policy, demos: Demos, settings: Settings
) -> dict[str, list[Array]]:
    """Paths of every way, from where strokes began and from anywhere."""
    ways: Ways = {
        "unguided": stopped_outside(flow(policy), demos),
        "guided": flow(policy, guided.aim_),
        "contracting": flow(contracting),
        "stable": stable(demos, guided.goal_, RATE / _longest(demos)),
    }
    starts = [*(demo.states[0] for demo in demos), *anywhere(demos, settings)]
    return {
        name: followed(way, starts, demos, settings, _step(guided), 1.0 if name == "unguided" else PATIENCE)
        for name, way in ways.items()
    }


def _shares(there: NDArray[np.bool_], count: int) -> dict[str, float]:
    """Of movements that arrive, of which so many began where strokes did."""
    return {"shown": float(there[:count].mean()), "random": float(there[count:].mean())}


def _drawn(runs: dict[str, list[Array]], strokes: Sequence[Array]) -> dict[str, Any]:
    """Paths to draw, in short."""
    count = len(strokes)
    drawn = {name: runs[name][:count] for name in ("contracting", "unguided", "guided")}
    drawn |= {"shown": list(strokes), "random": runs["guided"][count : count + DRAWN]}
    return {name: [resampled(path, 60).round(2).tolist() for path in paths] for name, paths in drawn.items()}


def lifted(shape: str, settings: Settings) -> dict[str, Any]:
    """One shape whose strokes are each turned onto a plane of their own, which nobody tells the learner: a row."""
    flat = load_handwriting(shape, every=settings.every)
    rng = np.random.default_rng([settings.seed, *shape.encode()])
    turns = [_turn(rng) for _ in flat]
    demos = [
        uc.Demonstration(demo.states @ turn.T, demo.actions @ turn.T, demo.times, name=demo.name)
        for demo, turn in zip(flat, turns, strict=True)
    ]
    policy = uc.LocallyLinearPolicy("auto", learner=uc.Hybrid(threshold=0.0, softness=0.1)).fit_demonstrations(demos)
    guided = uc.Guided(policy, demonstrations=demos, dt=settings.dt)
    own = np.stack([turn @ turn.T for turn in turns])
    starts = [demo.states[0] for demo in demos]
    paths = followed(flow(policy, guided.aim_, own), starts, demos, settings, _step(guided))
    there = arrived(paths, guided.goal_, demos)
    contracting = flow(_contracting(demos, guided.goal_, policy, 0.1), None, own)
    others = followed(contracting, starts, demos, settings, _step(guided), PATIENCE)
    inside = [path @ turn for path, turn in zip(paths, turns, strict=True)]
    return {
        "shape": shape,
        "own_planes": float(there.mean()),
        "contracting": float(arrived(others, guided.goal_, demos).mean()),
        "area": float(np.mean([swept_area(a, b.states) for a, b in zip(inside, flat, strict=True)])),
        **price(policy, guided, demos),
        **_on_random_planes(policy, guided, demos, rng, settings),
    }


def anywhere(demos: Demos, settings: Settings) -> Array:
    """Random starts around the demonstrations."""
    states = uc.stack(demos).states
    low, high = states.min(axis=0), states.max(axis=0)
    drawn = np.random.default_rng(settings.seed).random((settings.trials, states.shape[1]))
    return (low + high) / 2 + AROUND * (drawn - 0.5) * (high - low)


def stopped_outside(policy: Callable[[Array], Array], demos: Demos) -> Callable[[Array], Array]:
    """A policy that stands still far from anything that was shown: what leaves has left."""
    far = 10.0 * _reach(demos)
    return lambda states: np.where(np.linalg.norm(states, axis=1, keepdims=True) < far, policy(states), 0.0)


def arrived(paths: Sequence[Array], goal: Array, demos: Demos) -> NDArray[np.bool_]:
    """Which paths end near the goal."""
    return np.array([np.linalg.norm(path[-1] - goal) for path in paths]) < NEAR * _reach(demos)


def per_step(policies: Mapping[str, Any], demos: Demos) -> dict[str, float]:
    """Seconds of each for a single state: the least of some runs, taken in turn, so that all meet the same machine."""
    states, least = uc.stack(demos).states[:200], dict.fromkeys(policies, math.inf)
    for _ in range(15):
        for name, policy in policies.items():
            begun = perf_counter()
            for state in states:
                policy.step(state)
            least[name] = min(least[name], (perf_counter() - begun) / len(states))
    return least


def _reach(demos: Demos) -> float:
    return float(np.linalg.norm(uc.stack(demos).states, axis=1).max())


def _step(guided: uc.Guided) -> float:
    return min(guided.dt_, LONGEST_STEP)


def _longest(demos: Demos) -> float:
    """Duration of the longest demonstration, s."""
    return max(float(demo.times[-1]) for demo in demos if demo.times is not None)


def flow(policy: uc.Policy, aim: Any = None, projections: Array | None = None) -> Callable[[Array], Array]:
    """Velocities (N, n) of a policy, guided by an aim, under projections (N, n, n): as ``rollout`` has them, unchecked.

    Nothing is checked at each of some ten thousand steps, nor is the projection found anew.
    """
    predict, weights = policy.training_.model.predict, policy.solution_.weights

    def velocities(states: Array) -> Array:
        wanted = predict(weights, states)
        held = wanted if projections is None else uc.project(projections, wanted)
        return held if aim is None else np.asarray(aim.guided(states, held, projections))

    return velocities


def followed(
    velocities: Callable[[Array], Array], starts: Sequence[Array], demos: Demos, settings: Settings, dt: float,
    patience: float = 1.0,
) -> list[Array]:  # fmt: skip
    """Followed by Euler's steps until all have come to rest, or for as long as there is patience."""
    path, steps = [np.stack(starts)], round(PIECE_S / dt)
    for _ in range(int(patience * settings.longest * _longest(demos) / PIECE_S)):
        for _ in range(steps):
            path.append(path[-1] + dt * velocities(path[-1]))
        if np.abs(path[-1] - path[-1 - steps]).max() < STILL * _reach(demos):
            break
    return list(np.stack(path, axis=1))


def _contracting(demos: Demos, goal: Array, policy: uc.LocallyLinearPolicy, softness: float) -> uc.Policy:
    """In the same fields, or usual ones where a cubic model was chosen."""
    learner = uc.Contracting(RATE / _longest(demos), goal, softness)
    width = None if policy.variance_ == "cubic" else policy.variance_
    return uc.LocallyLinearPolicy(width, learner=learner).fit_demonstrations(demos)


def _likeness(paths: Sequence[Array], there: NDArray[np.bool_], strokes: Sequence[Array]) -> dict[str, float | None]:
    """Mean area and distance of the paths that arrive from where strokes began; None where none does."""
    pairs = [(path, stroke) for path, stroke, arrives in zip(paths, strokes, there, strict=False) if arrives]
    measures = {"area": swept_area, "dtw": warped}
    return {name: float(np.mean([of(*pair) for pair in pairs])) if pairs else None for name, of in measures.items()}


def _ratio(runs: dict[str, list[Array]], there: NDArray[np.bool_], strokes: Sequence[Array]) -> float | None:
    """Area of guided paths over that of unguided ones, of those starts from where unguided ones arrive."""
    guided, unguided = (_likeness(runs[name], there, strokes)["area"] for name in ("guided", "unguided"))
    return None if guided is None or unguided is None else guided / unguided


def price(policy: Callable[[Array], Array], guided: uc.Guided, demos: Demos) -> dict[str, float]:
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
        f"{1e3 * dt:g} ms": price(policy, uc.Guided(policy, demonstrations=demos, dt=dt), demos)["nupe_ratio"]
        for dt in PACES
    }


def _turn(rng: np.random.Generator) -> Array:
    """Axes of a plane through the goal, (3, 2): turned about a level line."""
    about, by = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, STEEPEST)
    level, across = np.array([np.cos(about), np.sin(about), 0.0]), np.array([-np.sin(about), np.cos(about), 0.0])
    tilted = np.cos(by) * across + np.sin(by) * np.array([0.0, 0.0, 1.0])
    return np.outer(level, level[:2]) + np.outer(tilted, across[:2])


def _on_random_planes(
    policy: uc.Policy, guided: uc.Guided, demos: Demos, rng: np.random.Generator, settings: Settings
) -> dict[str, float]:
    """Whether V falls at every step on planes of any tilt, and ends where it is least on them."""
    normals = rng.standard_normal((settings.trials, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    velocities = flow(policy, guided.aim_, np.eye(3) - normals[:, :, None] * normals[:, None])
    paths = followed(velocities, list(anywhere(demos, settings)), demos, settings, _step(guided), PATIENCE)
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

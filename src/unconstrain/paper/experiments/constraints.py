"""The constraint learnt: the generators of the library CCL, its recording, and the null-space component.

The systems, policies, starts, time steps and counts are those of CCL's demonstrations (toy example, two links, seven
joints), but for noise on the states. Noise on the actions is a share of the policy's spread, as in
``regimes``. Tests are fresh trajectories without noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

import unconstrain as uc

from ...base.arrays import Array
from ...base.errors import ReadError
from ...models import FeatureMap, NormalisedRBF
from ..datasets import load_fingertip
from ..systems.arm import LWR3, Arm
from . import mechanisms
from .journal import Journal
from .trials import Progress, Result, reproduced, run_trials
from .truths import spread, with_noise

Demos = Sequence[uc.Demonstration]

GRID = NormalisedRBF.grid(-2.2, 2.2, 5)
"""Five by five kernels over the states of CCL's toy example."""

LINKS = Arm.from_dh(a=np.ones(2), alpha=np.zeros(2), d=np.zeros(2), limits=np.full(2, np.pi))
"""Two links of one metre in a plane."""


def in_plane(postures: Array) -> Array:
    """Jacobian of the hand of :data:`LINKS` in its plane, shape (T, 2, 2)."""
    return LINKS.jacobian(postures)[:, :2]


def hand(postures: Array) -> Array:
    """The hand's place in its plane and 1: the features that a selection has which varies with it, shape (T, 3)."""
    places = LINKS.frames(postures)[1][-1, :2].T
    return np.column_stack([places, np.ones(len(places))])


@dataclass(frozen=True)
class Task:
    """One of CCL's generators.

    Parameters
    ----------
    constraint : callable
        Of a random generator, draws A(x, t).
    policy, starts : callable
        States to actions; a random generator and a number to starts.
    shape : tuple
        Trajectories, steps, and seconds of each.
    rank : int
    features : mapping
        Features that are tried beside "auto", by name.
    jacobian : callable, optional
    """

    constraint: Callable[[np.random.Generator], uc.constraints.Constraint]
    policy: Callable[[Array], Array]
    starts: Callable[[np.random.Generator, int], Array]
    shape: tuple[int, int, float]
    rank: int
    features: Mapping[str, FeatureMap | str]
    jacobian: Callable[[Array], Array] | None = None


def _unit(rng: np.random.Generator) -> Array:
    row = rng.random(2)
    return row / np.linalg.norm(row)


def _parabola(states: Array, _: Array) -> Array:
    return np.stack([4.0 * states[:, 0], -np.ones(len(states))], axis=1)[:, None]


def _selected(rng: np.random.Generator) -> uc.constraints.Constraint:
    row = _unit(rng)
    return lambda postures, _: row @ in_plane(postures)[:, None]


def _varying(postures: Array, _: Array) -> Array:
    """Λ = [4 x, −1] of the hand's place x."""
    return _parabola(hand(postures), _) @ in_plane(postures)


def _rows(rng: np.random.Generator, rank: int) -> uc.constraints.Constraint:
    select = np.linalg.qr(rng.standard_normal((6, 6)))[0][:rank]
    return lambda postures, _: select @ LWR3.jacobian(postures)


def _corners(rng: np.random.Generator, count: int) -> Array:
    return (np.array([1.0, 2.0]) + 0.1 * rng.random((count, 2))) * rng.choice([-1.0, 1.0], (count, 2))


def _folded(rng: np.random.Generator, count: int) -> Array:
    return np.radians([0.0, 90.0] + 10.0 * rng.random((count, 2)))


def _postures(rng: np.random.Generator, count: int) -> Array:
    return LWR3.upper * (rng.random((count, 7)) - 0.5)


def _towards(target: Array, gain: float) -> Callable[[Array], Array]:
    return lambda states: gain * (target - states)


_TOY: dict[str, Any] = {"policy": _towards(np.zeros(2), 0.5), "starts": _corners, "shape": (50, 20, 0.1), "rank": 1}
_LINKS: dict[str, Any] = {
    "policy": _towards(np.radians([10.0, -10.0]), 1.0), "starts": _folded, "shape": (40, 40, 0.01), "rank": 1,
    "jacobian": in_plane,
}  # fmt: skip
_JOINTS: dict[str, Any] = {"policy": _towards(np.zeros(7), 1.0), "starts": _postures, "shape": (40, 40, 0.02)}
_JOINTS |= {"features": {"constant": "constant"}, "jacobian": LWR3.jacobian}

TASKS: dict[str, Task] = {
    "constant": Task(lambda rng: uc.constraints.Plane(_unit(rng)), **_TOY, features={"constant": "constant"}),
    "[4x₁, −1]": Task(lambda _: _parabola, **_TOY, features={"affine": "affine", "5×5 RBF": GRID}),
    "two links, Λ": Task(_selected, **_LINKS, features={"constant": "constant"}),
    "two links, Λ(q)": Task(lambda _: _varying, **_LINKS, features={"of the hand": hand}),
    "seven joints, 1 row": Task(partial(_rows, rank=1), **_JOINTS, rank=1),
    "seven joints, 3 rows": Task(partial(_rows, rank=3), **_JOINTS, rank=3),
}
"""By name."""


@dataclass(frozen=True)
class Settings:
    """What is drawn.

    Parameters
    ----------
    trials : int
        Data sets of each task.
    noise : tuple of float
        On actions, as shares of the policy's spread.
    blocks : tuple of int
        The recording is cut into so many pieces, each held out once, by what is learnt from the others.
    mechanisms : int
        Simulated mechanisms whose kind is to be found.
    seed : int
        Of everything random.
    """

    trials: int = 10
    noise: tuple[float, ...] = (0.0, 0.05, 0.2)
    blocks: tuple[int, ...] = (20, 40)
    mechanisms: int = 200
    seed: int = 0


def run(
    settings: Settings | None = None, workers: int = 1, progress: Progress | None = None, journal: Journal | None = None
) -> Result:
    """Learn the constraint of every task at every level of noise, and that of the recording where it is there.

    Returns
    -------
    Result
        A row for each task, noise and features: medians of "nppe", "npoe" and "ms", the worst "nppe", the noise found
        over the true one, and how often the rank is right. ``details`` holds the recording and its constraint; the
        table "recorded" its nPOE where held out, the table "normals" what :func:`.mechanisms.normals` finds on a car
        rim, the table "component" the error of null-space components, the table
        "mechanisms" what :func:`.mechanisms.mechanisms` finds.
    """
    chosen = settings or Settings()
    calls = [(name, number, chosen) for name in TASKS for number in range(chosen.trials)]
    found = [row for rows in run_trials(_trial, calls, workers, progress, journal) for row in rows]
    keys = dict.fromkeys((one["task"], one["noise"], one["features"]) for one in found)
    rows = [_row(key, [one for one in found if (one["task"], one["noise"], one["features"]) == key]) for key in keys]
    named, _ = mechanisms.mechanisms(chosen.mechanisms, chosen.seed, workers, progress)
    tables = {"component": _components(chosen), "mechanisms": named}
    try:
        demo = load_fingertip()
    except ReadError:
        return Result("constraints", chosen, rows, tables=tables)
    learnt = uc.LearntConstraint().fit(demo.states, demo.actions)
    tables["recorded"] = [_held_out(demo, blocks) for blocks in chosen.blocks]
    with suppress(ReadError):
        tables["normals"] = mechanisms.normals()
    return Result("constraints", chosen, rows, {"demonstration": demo, "learnt": learnt}, tables)


def _trial(name: str, number: int, settings: Settings) -> list[dict[str, Any]]:
    task = TASKS[name]
    rng = np.random.default_rng([settings.seed, number, *name.encode()])
    constraint = task.constraint(rng)
    train, test = (_demonstrations(task, rng, constraint) for _ in range(2))
    found = []
    for noise in settings.noise:
        noisy = with_noise(train, noise, rng)
        for features, made in {"auto": "auto", **task.features}.items():
            judged = _judged(task, made, noisy, test)
            judged["noise_found"] = judged["noise_found"] / (noise * spread(train)) if noise else np.nan
            found.append({"task": name, "noise": noise, "features": features, **judged})
    return found


def _demonstrations(task: Task, rng: np.random.Generator, constraint: uc.constraints.Constraint) -> Demos:
    count, steps, dt = task.shape
    starts = task.starts(rng, count).tolist()
    return uc.rollout(task.policy, starts, steps, dt, constraint, method="euler")


def _judged(task: Task, features: FeatureMap | str, train: Demos, test: Demos) -> dict[str, float]:
    states, actions, groups = uc.stack(train)
    begun = perf_counter()
    learnt = uc.LearntConstraint(features, task.jacobian).fit(states, actions, groups=groups)
    return {
        "ms": 1e3 * (perf_counter() - begun),
        "nppe": uc.nppe(learnt, test),
        "npoe": uc.npoe(learnt, test),
        "noise_found": learnt.noise_,
        "rank_right": float(learnt.rank_ == task.rank),
    }


def _row(key: tuple[str, float, str], found: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    numbers = {
        name: np.array([one[name] for one in found]) for name in ("nppe", "npoe", "noise_found", "rank_right", "ms")
    }
    medians = {name: float(np.median(each)) for name, each in numbers.items()}
    told = dict(zip(("task", "noise", "features"), key, strict=True)) | medians
    rank = float(numbers["rank_right"].mean())
    noise = medians["noise_found"] if key[1] else None
    return told | {"nppe_worst": float(numbers["nppe"].max()), "noise_found": noise, "rank_right": rank}


def _held_out(demo: uc.Demonstration, blocks: int) -> dict[str, Any]:
    """NPOE of the recording, in so many blocks of which every fourth is held out at a time."""
    fold = np.arange(len(demo)) * blocks // len(demo) % 4
    missed = 0.0
    for held in range(4):
        rows = fold == held
        learnt = uc.LearntConstraint().fit(demo.states[~rows], demo.actions[~rows])
        part = uc.Demonstration(demo.states[rows], demo.actions[rows])
        missed += uc.npoe(learnt, part) * rows.sum() * float(part.actions.var(axis=0).sum())
    assert demo.times is not None
    every = len(demo) * float(demo.actions.var(axis=0).sum())
    return {"blocks": blocks, "s_each": float(np.ptp(demo.times)) / blocks, "npoe": float(missed) / every}


def _components(settings: Settings) -> list[dict[str, Any]]:
    """CCL's limit cycle with a task drawn at each sample: median errors of regression, without A and with it."""
    found = [_component(np.random.default_rng([settings.seed, number])) for number in range(settings.trials)]
    return [{"way": way, "error": float(np.median([one[way] for one in found]))} for way in found[0]]


def _component(rng: np.random.Generator) -> dict[str, float]:
    normal = _unit(rng)
    train, test = (_driven(rng, normal) for _ in range(2))
    features, truth = uc.Polynomial(3).place(train[0]), _circling(test[0]) @ (np.eye(2) - np.outer(normal, normal))
    ways: dict[str, Callable[[Array], Array]] = {
        "regression": uc.ParametricPolicy(features, "direct").fit(*train),
        "task unknown": uc.constraints.null_space_component(*train, features=features),
        "constraint known": uc.constraints.null_space_component(*train, uc.constraints.Plane(normal), features),
    }
    scale = float(((truth - truth.mean(axis=0)) ** 2).sum())
    return {way: float(((learnt(test[0]) - truth) ** 2).sum()) / scale for way, learnt in ways.items()}


def _driven(rng: np.random.Generator, normal: Array) -> tuple[Array, Array]:
    states = rng.uniform(-1.0, 1.0, (500, 2))
    actions = _circling(states)
    actions = actions + np.outer(rng.uniform(-1.0, 1.0, 500) - actions @ normal, normal)
    return states, actions + 0.01 * rng.standard_normal(actions.shape)


def _circling(states: Array) -> Array:
    """CCL's limit cycle."""
    radial = (0.75 - (states**2).sum(axis=1))[:, None] * states
    return -radial + np.column_stack([states[:, 1], -states[:, 0]])


def verdict(result: Result) -> uc.evaluation.verdicts.Verdict:
    """Whether what held simulated movements is found, and nothing wrong said with confidence."""
    found = [row for row in result.rows if row["features"] == "auto"]
    right = float(np.mean([row["rank_right"] for row in found]))
    every = result.tables["mechanisms"][-1]
    wrong = every["confident_and_wrong"] / max(every["confident"], 1)
    return reproduced(
        {
            f"the number of held directions is right in {right:.0%}": right >= uc.evaluation.verdicts.GOOD,
            f"{wrong:.1%} of confident verdicts on mechanisms are wrong": wrong <= 0.05,
        },
        "What is learnt with features of its own choice (“auto”).",
    )


def headlines(result: Result) -> list[str]:
    """What was found, in a sentence for each task and for the recording."""
    said = []
    for task in TASKS:
        rows = [row for row in result.rows if row["task"] == task and row["features"] == "auto"]
        errors = ", ".join(f"{row['nppe']:.1e} at {row['noise']:.0%}" for row in rows)
        said.append(f"{task}: nPPE {errors} noise, rank right in {np.mean([row['rank_right'] for row in rows]):.0%}")
    said += [
        f"recorded fingertip, blocks of {row['s_each']:.1f} s held out: nPOE {row['npoe']:.3f}"
        for row in result.tables.get("recorded", [])
    ]
    said += [
        f"wiped rim, {row['bout']}: plane {row['angle']:.1f}° from the tool's axis, {1e3 * row['off_plane']:.1f} mm "
        f"off it; quadratic surface {row['angle_curved']:.1f}°, {1e3 * row['off_curved']:.1f} mm"
        for row in result.tables.get("normals", [])
    ]
    ways = ", ".join(f"{row['way']} {row['error']:.1e}" for row in result.tables["component"])
    every = result.tables["mechanisms"][-1]
    found = (
        f"{every['mechanisms']} simulated mechanisms: kind right in {every['right']:.1%}, {every['inside']:.1%} of the "
        f"parameters inside their 95 % intervals, {every['confident_and_wrong']} of {every['confident']} confident "
        "verdicts wrong"
    )
    return [*said, f"null-space component: {ways}", found]

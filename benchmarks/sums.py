"""Sums, solves and whole fits, against their floors and against plain NumPy, on one thread and on all."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from table import Row, ratio, row, script, side_by_side
from threadpoolctl import threadpool_limits

import unconstrain as uc
from unconstrain.base.arrays import Array, namespace
from unconstrain.risks import FoldedMoments, Moments, Sums
from unconstrain.risks.objectives import inconsistency, standard_risk
from unconstrain.risks.quadratic import lexicographic_path

SAMPLES = 100_000
GRIDS = (5, 10, 20)
LOCAL_SAMPLES, FIELDS, JOINTS = 10_000, 50, 7
FOLDS = uc.Folds(5)
LEARNER = uc.Hybrid(alpha=1e-2)
THRESHOLD = 1e-3


def plane() -> tuple[Array, Array]:
    """A swirl in the plane, behind a line of random direction at each sample."""
    rng = np.random.default_rng(0)
    states, angle = rng.uniform(-1, 1, (SAMPLES, 2)), rng.uniform(0, np.pi, SAMPLES)
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    wanted = np.column_stack([states[:, 1], np.sin(2 * states[:, 0])])
    return states, along * (along * wanted).sum(axis=1, keepdims=True)


def arm() -> tuple[Array, Array]:
    """Seven joints, each sample held along one random direction."""
    rng = np.random.default_rng(1)
    states, normal = rng.uniform(-1, 1, (LOCAL_SAMPLES, JOINTS)), rng.standard_normal((LOCAL_SAMPLES, JOINTS))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    wanted = np.sin(states[:, ::-1]) - 0.3 * states
    return states, wanted - normal * (normal * wanted).sum(axis=1, keepdims=True)


def gathered(features: uc.NormalisedRBF, states: Array, actions: Array) -> Moments:
    """Moments of a parametric policy, as it gathers them: features and sums, block by block."""
    sums, ones = Sums(1, actions.shape[1], len(features.centres)), namespace(states).ones_like(states[:, :1])
    for rows in sums.pieces(states):
        sums.add(features(states[rows]), actions[rows], ones[rows])
    return sums.moments


def floor(features: uc.NormalisedRBF, states: Array, actions: Array) -> None:
    """What cannot be left out: the features, and d (d + 1) / 2 Gram products of them, in the same blocks."""
    d = actions.shape[1]
    for rows in Sums(1, d, len(features.centres)).pieces(states):
        phi = features(states[rows])
        for _ in range(d * (d + 1) // 2):
            phi.T @ phi


def plain_numpy(features: uc.NormalisedRBF, states: Array, actions: Array) -> Array:
    """The hybrid at one fixed threshold, written straight from the equations; V is formed."""
    squared = ((states[:, None, :] - features.centres) ** 2).sum(axis=2)
    phi = np.exp(-0.5 * squared / features.variance)
    phi /= phi.sum(axis=1, keepdims=True)
    lengths = np.linalg.norm(actions, axis=1)
    directions = actions / lengths[:, None]
    V = (phi[:, :, None] * directions[:, None, :]).reshape(len(states), -1)
    H, g = V.T @ V, V.T @ lengths
    M, m = np.kron(phi.T @ phi, np.eye(actions.shape[1])), (phi.T @ actions).ravel()
    return at_one_threshold(H, g, M, m)


def at_one_threshold(H: Array, g: Array, M: Array, m: Array) -> Array:
    """Eqs 7, 12 and 13 at one threshold."""
    eigenvalues, vectors = np.linalg.eigh(H)
    undetermined = eigenvalues <= THRESHOLD * eigenvalues[-1]
    V1, V2 = vectors[:, ~undetermined], vectors[:, undetermined]
    w = V1 @ ((V1.T @ g) / eigenvalues[~undetermined])
    return w + V2 @ np.linalg.solve(V2.T @ M @ V2, V2.T @ (m - M @ w))


def path_against_one(policy: uc.ParametricPolicy) -> float:
    """All thresholds and their held-out scores, against one, on the same moments."""
    training, held_out = policy.training_.gathered.rounds()[0]
    first, second = inconsistency(training), standard_risk(training)
    score = inconsistency(held_out) + LEARNER.alpha * standard_risk(held_out)

    def one() -> Array:
        return score(at_one_threshold(first.hessian[0], first.linear[0], second.hessian[0], second.linear[0])[None])

    return ratio(side_by_side([lambda: score(lexicographic_path(first, second).weights), one]), 0, 1)


def parametric(per_axis: int) -> list[Row]:
    """Rows for a grid of kernels in the plane."""
    states, actions = plane()
    features = uc.NormalisedRBF.grid(-1, 1, per_axis)
    policy = uc.ParametricPolicy(features, LEARNER, FOLDS)
    once = uc.Hybrid(threshold=THRESHOLD)
    calls: list[Callable[[], object]] = [
        lambda: floor(features, states, actions),
        lambda: gathered(features, states, actions),
        lambda: policy.fit(states, actions),
    ]
    name = f"N = 1e5, d = 2, M = {per_axis**2}"
    with threadpool_limits(1):
        if per_axis == GRIDS[0]:
            calls += [
                lambda: plain_numpy(features, states, actions),
                lambda: once.learn(_whole(gathered(features, states, actions))),
            ]
        times = side_by_side(calls, repeats=9 if per_axis < GRIDS[-1] else 5)
        seconds = np.median(times, axis=0)
        rows = [
            row(f"{name}: features and Gram products, the floor", seconds[0], "s"),
            row(f"{name}: gather", seconds[1], "s"),
            row(f"{name}: gather / floor", ratio(times, 1, 0), "×", 2.0, 1.2),
            row(f"{name}: whole fit, 5 folds, all thresholds", seconds[2], "s"),
            row(f"{name}: whole fit / gather", ratio(times, 2, 1), "×", 2.0, 1.3),
            row(f"{name}: all thresholds / one threshold", path_against_one(policy), "×", 3.0, 1.5),
        ]
        if per_axis == GRIDS[0]:
            rows += [
                row(f"{name}: plain NumPy, one threshold", seconds[3], "s"),
                row(f"{name}: plain NumPy / ours, one threshold", ratio(times, 3, 4), "×", 4, 10, more_is_better=True),
                row(f"{name}: plain NumPy / whole fit", ratio(times, 3, 2), "×", more_is_better=True),
                row(f"{name}: plain NumPy / floor", ratio(times, 3, 0), "×"),
            ]
    return [*rows, *on_all_threads(name, calls[2], seconds[2])]


def _whole(moments: Moments) -> Any:
    """What a learner looks at that needs the sums alone."""
    return SimpleNamespace(folds=FoldedMoments((moments,), range(1)))


def on_all_threads(name: str, fit: Callable[[], object], alone: float) -> list[Row]:
    """The same fit with as many threads as there are."""
    return [row(f"{name}: whole fit on one thread / on all", alone / np.median(side_by_side([fit], 5)), "×")]


def local() -> list[Row]:
    """Rows for local models of an arm."""
    states, actions = arm()
    policy = uc.LocallyLinearPolicy(3.0, centres=states[:FIELDS], learner=LEARNER, validation=FOLDS)
    policy.fit(states, actions)
    features, weights = policy.features_(states), policy.fields_.weights(states)
    pairs = features.shape[1] * (features.shape[1] + 1) // 2 * (JOINTS * (JOINTS + 1) // 2)
    formed = np.random.default_rng(2).standard_normal((LOCAL_SAMPLES, pairs))
    calls: list[Callable[[], object]] = [
        lambda: weights.T @ formed,
        lambda: uc.gather(features, actions, weights),
        lambda: policy.fit(states, actions),
    ]
    name = f"N = 1e4, {FIELDS} fields, {JOINTS}-DOF"
    with threadpool_limits(1):
        times = side_by_side(calls, repeats=15)
        seconds = np.median(times, axis=0)
    return [
        row(f"{name}: one product Wᵀ(vech φφᵀ ⊗ vech ûûᵀ), formed before, the floor", seconds[0], "s"),
        row(f"{name}: gather", seconds[1], "s"),
        row(f"{name}: gather / floor", ratio(times, 1, 0), "×", 3.0, 1.5),
        row(f"{name}: whole fit, 5 folds, all thresholds", seconds[2], "s", 0.6, 0.25),
        *on_all_threads(name, calls[2], seconds[2]),
    ]


def main() -> list[Row]:
    """Rows of all."""
    return [*(line for per_axis in GRIDS for line in parametric(per_axis)), *local()]


if __name__ == "__main__":
    script(main)

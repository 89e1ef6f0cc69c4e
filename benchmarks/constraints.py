"""How long it takes to learn a constraint from 1,000 samples, on one thread."""

from __future__ import annotations

from functools import partial

import numpy as np
from table import Row, row, script, side_by_side
from threadpoolctl import threadpool_limits

import unconstrain as uc

SAMPLES, DEMONSTRATIONS = 1000, 10
AT_LEAST_MS, TARGET_MS = 10.0, 1.0


def main() -> list[Row]:
    """Rows of features that are named, and of "auto", which compares all of them."""
    rng = np.random.default_rng(0)
    states, wanted = rng.uniform(-1, 1, (2, SAMPLES, 2))
    normals = np.column_stack([4.0 * states[:, 0], -np.ones(SAMPLES)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    held = {
        "constant": wanted * [1.0, 0.0],
        "affine": wanted - normals * (normals * wanted).sum(axis=1, keepdims=True),
    }
    groups = np.arange(SAMPLES) // (SAMPLES // DEMONSTRATIONS)
    fits = {(name, name): actions for name, actions in held.items()} | {("auto", "affine"): held["affine"]}
    calls = [
        partial(uc.LearntConstraint(features).fit, states, actions, groups) for (features, _), actions in fits.items()
    ]
    with threadpool_limits(1):
        times = np.median(side_by_side(calls, 15), axis=0) * 1e3
    bounds = [(AT_LEAST_MS, TARGET_MS) if features != "auto" else (None, None) for features, _ in fits]
    return [
        row(f"N = 1e3, d = 2: {truth} constraint, features {features!r}", took, "ms", *bound)
        for (features, truth), took, bound in zip(fits, times, bounds, strict=True)
    ]


if __name__ == "__main__":
    script(main)

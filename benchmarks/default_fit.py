"""The default learner on a million samples in a hundred demonstrations: arrays, and CSV on the command line."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from table import Row, row, script, side_by_side, spent

import unconstrain as uc

SAMPLES, DEMONSTRATIONS, AXES = 1_000_000, 100, 3
PERIOD, HELD_STEPS = 0.01, 200


def drawn(samples: int) -> tuple[NDArray[np.float64], ...]:
    """A circle in space that is gone round, each time held in other directions, (N, 3): states, actions; and groups."""
    rng = np.random.default_rng(0)
    place, states, actions = rng.normal(size=(DEMONSTRATIONS, AXES)), [], []
    for step in range(samples // DEMONSTRATIONS):
        if step % HELD_STEPS == 0:
            held = rng.normal(size=place.shape)
            held /= np.linalg.norm(held, axis=1, keepdims=True)
        inwards = 1.0 - (place[:, :2] ** 2).sum(axis=1)
        wanted = inwards[:, None] * place + np.column_stack([-place[:, 1], place[:, 0], -2.0 * place[:, 2]])
        states.append(place)
        actions.append(wanted - held * (held * wanted).sum(axis=1, keepdims=True))
        place = place + PERIOD * actions[-1]
    groups = np.repeat(np.arange(DEMONSTRATIONS), len(states))
    return np.stack(states, 1).reshape(-1, AXES), np.stack(actions, 1).reshape(-1, AXES), groups


def write(folder: Path, samples: int) -> None:
    """The same as arrays and as CSV."""
    states, actions, groups = drawn(samples)
    np.savez(folder / "arrays.npz", states=states, actions=actions, groups=groups)
    names = [f"{kind}{axis}" for kind in "xu" for axis in range(AXES)]
    uc.writers.write_recordings(
        [
            uc.Recording(tuple(names), table, PERIOD * np.arange(len(table)), f"demo{at}")
            for at, table in enumerate(np.split(np.hstack([states, actions]), DEMONSTRATIONS))
        ],
        folder / "samples.csv",
    )


def learn(path: Path) -> None:
    """Fit, in a process of its own."""
    held = np.load(path)
    uc.LocallyLinearPolicy().fit(held["states"], held["actions"], groups=held["groups"])


def small() -> list[Row]:
    """Twenty demonstrations of two hundred samples in the plane, each under a constraint that switches."""
    rng, steps, period = np.random.default_rng(0), 200, 0.02
    starts = rng.uniform(-1.5, 1.5, (20, 2))
    lines = [uc.constraints.SwitchingLine.random(rng, steps * period, 4) for _ in starts]
    demos = [
        uc.rollout(lambda x: -x, start, steps, period, line, method="euler")
        for start, line in zip(starts, lines, strict=True)
    ]
    noisy = [replace(demo, actions=demo.actions + 0.05 * rng.normal(size=demo.actions.shape)) for demo in demos]
    policies = uc.LocallyLinearPolicy(), uc.LocallyLinearPolicy(None), uc.ParametricPolicy()
    times = side_by_side([lambda one=one: one.fit_demonstrations(noisy) for one in policies], 3)  # type: ignore[misc]
    names = ("chooses its model", "widest fields", "25 kernels")
    what = f"default learner, {len(starts) * steps:,} × 2, noisy"
    each = [row(f"{what}: {name}", time, "s") for name, time in zip(names, np.median(times, axis=0), strict=True)]
    each[0] |= {"at_least": 5.0, "target": 0.5}
    return each


def main(samples: int = SAMPLES) -> list[Row]:
    """Rows of all."""
    what = f"{samples:.0e} × {AXES} in {DEMONSTRATIONS} demonstrations"
    with TemporaryDirectory(dir=Path.cwd()) as name:
        folder = Path(name)
        write(folder, samples)
        line = ["-m", "unconstrain", "fit", folder / "samples.csv", "--state", "x*", "--action", "u*"]
        arrays = spent(f"default fit, {what}, from arrays", [__file__, "--learn", folder / "arrays.npz"], 20, 6)
        arrays[-1] |= {"at_least": 1000.0, "target": 400.0}
        return [
            *small(),
            *arrays,
            *spent("the same by the command line, from CSV", [*line, "-o", folder / "p.npz"], 40, 15),
        ]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--learn"]:
        learn(Path(sys.argv[2]))
    else:
        script(main, samples=(lambda text: int(float(text)), SAMPLES))

"""Learning from more samples than fit into memory: time, peak memory, growth; ``--samples 1e8`` for more."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

import numpy as np
from table import Row, row, script

import unconstrain as uc
from unconstrain.recordings.preparation import Recipe

SMALL = 100_000
SAMPLES = 10_000_000
FEW, REPEATS = 2_000_000, 3
ROWS_IN_FILE = 2_000_000
KERNELS_ON_AXIS = 10
RECIPE = Recipe(states=("x", "y"), actions=("vx", "vy"))


def write(folder: Path, samples: int) -> None:
    """Parquet files of a swirl in the plane, behind a line of random direction at each sample."""
    import pyarrow as pa
    from pyarrow import parquet

    for number, start in enumerate(range(0, samples, ROWS_IN_FILE)):
        rng = np.random.default_rng([0, number])
        with parquet.ParquetWriter(folder / f"{number:05}.parquet", _schema(pa), compression="none") as file:
            for begin in range(start, min(start + ROWS_IN_FILE, samples), SMALL):
                states = rng.uniform(-1, 1, (min(SMALL, samples - begin), 2))
                angle = rng.uniform(0, np.pi, len(states))
                along = np.column_stack([np.cos(angle), np.sin(angle)])
                wanted = np.column_stack([states[:, 1], np.sin(2 * states[:, 0])])
                actions = along * (along * wanted).sum(axis=1, keepdims=True)
                file.write_table(pa.table(list(np.hstack([states, actions]).T), _schema(pa)))


def _schema(pa: Any) -> Any:
    return pa.schema([(name, pa.float64()) for name in ("x", "y", "vx", "vy")])


def learn(folder: Path) -> None:
    """Fit, in a process of its own, and print what it took as JSON."""
    features = uc.NormalisedRBF.grid(-1, 1, KERNELS_ON_AXIS)
    before = _peak_mb()
    warm = folder / "first"
    warm.mkdir()
    write(warm, SMALL)
    uc.ParametricPolicy(features).fit_batches(uc.Stream(warm, RECIPE))  # what is imported and set up once is no growth
    start, computing = perf_counter(), process_time()
    policy = uc.ParametricPolicy(features).fit_batches(uc.Stream(folder / "*.parquet", RECIPE))
    took = {"seconds": perf_counter() - start, "computing": process_time() - computing}
    samples = int(policy.moments_.weight[0])
    print(json.dumps({"samples": samples, "before_mb": before, "peak_mb": _peak_mb(), **took}))


def _peak_mb() -> float:
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def measured(samples: int) -> dict[str, float]:
    """Write that many samples, learn from them, and say what it took."""
    with TemporaryDirectory(dir=Path.cwd()) as folder:
        write(Path(folder), samples)
        command = [sys.executable, __file__, "--learn", folder]
        alone = os.environ | {"OPENBLAS_NUM_THREADS": "1"}  # threads that wait for one another count as computing
        said = subprocess.run(command, capture_output=True, text=True, check=True, env=alone).stdout
    found: dict[str, float] = json.loads(said)
    assert found["samples"] == samples
    return found


def main(samples: int = SAMPLES) -> list[Row]:
    """Rows of all."""
    # A machine's pace drifts by more than what is asked here, so few samples are timed before and after many; in
    # processor time, which does not count other work. Few are still too many to be kept in memory after the first walk.
    before = [measured(FEW) for _ in range(REPEATS)]
    many = measured(samples)
    few = before + [measured(FEW) for _ in range(REPEATS)]
    pace = many["computing"] / samples
    what = f"{samples:.0e} samples from Parquet, d = 2, M = {KERNELS_ON_AXIS**2}"
    growth = pace * FEW / float(np.mean([each["computing"] for each in few]))
    return [
        row(f"peak memory, {what}", many["peak_mb"], "MB", 1000.0, 300.0),
        row("of it Python and its libraries", many["before_mb"], "MB"),
        row(f"time, one thread, {what}", many["seconds"], "s"),
        row("samples in a second of one core", 1.0 / pace, "1/s"),
        row(f"processor time per sample, {samples:.0e} samples against {FEW:.0e} before and after", growth, "×", 1.1),
    ]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--learn"]:
        learn(Path(sys.argv[2]))
    else:
        script(main, samples=(lambda text: int(float(text)), SAMPLES))

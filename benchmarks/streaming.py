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
from unconstrain.preparation import Recipe

SMALL = 100_000
SAMPLES = 10_000_000
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
    start, computing = perf_counter(), process_time()
    policy = uc.ParametricPolicy(features).fit_batches(uc.Stream(folder, RECIPE))
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


def _rate(smaller: dict[str, float], larger: dict[str, float]) -> float:
    return (larger["samples"] - smaller["samples"]) / (larger["computing"] - smaller["computing"])


def main(samples: int = SAMPLES) -> list[Row]:
    """Rows of all."""
    # What is done once (importing, solving) is no growth: rates are of what came on top of the smaller one,
    # in processor time, which does not count other work on the machine. All are read in both walks: 32 MB and
    # less would be kept in memory after the first.
    small, middle, large = (measured(samples * part // 10) for part in (4, 7, 10))
    before, beyond = _rate(small, middle), _rate(middle, large)
    what = f"{samples:.0e} samples from Parquet, d = 2, M = {KERNELS_ON_AXIS**2}"
    return [
        row(f"peak memory, {what}", large["peak_mb"], "MB", 1000.0, 300.0),
        row("of it Python and its libraries", large["before_mb"], "MB"),
        row(f"time, one thread, {what}", large["seconds"], "s"),
        row("samples in a second of one core", _rate(small, large), "1/s"),
        row(f"processor time per sample beyond {middle['samples']:.0e} against before", before / beyond, "×", 1.1),
    ]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--learn"]:
        learn(Path(sys.argv[2]))
    else:
        script(main, samples=(lambda text: int(float(text)), SAMPLES))

"""Two processes of dask against this one, on the same chunks, each with one thread.

What two processes that know nothing of each other gain is what the machine
has to give: on a busy one, less than two.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
from table import Row, row, script, seconds
from threadpoolctl import threadpool_limits

import unconstrain as uc
from unconstrain import cluster

PROCESSES = 2
PARTS, ROWS = 16, 200_000
REPEATS = 3

FEATURES = uc.NormalisedRBF.grid(-1, 1, 10)

KEEP_MEMORY = {"MALLOC_TRIM_THRESHOLD_": 2**27, "MALLOC_MMAP_THRESHOLD_": 2**25}
"""Dask's workers give each freed array back to the system and fault its pages in again; this keeps them."""


class Drawn:
    """A part that is drawn where it is needed, so that reading takes the same everywhere."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __iter__(self) -> Any:
        rng = np.random.default_rng([0, self.number])
        states = rng.uniform(-1, 1, (ROWS, 2))
        along = rng.standard_normal((ROWS, 2))
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        wanted = np.column_stack([states[:, 1], np.sin(2 * states[:, 0])])
        yield states, along * (along * wanted).sum(axis=1, keepdims=True)


class Together:
    """Parts, one after the other."""

    def __init__(self, parts: int = PARTS) -> None:
        self.parts = parts

    def __iter__(self) -> Any:
        for number in range(self.parts):
            yield from Drawn(number)


def alone(parts: int) -> None:
    """Fit to some parts, in this process, with one thread."""
    with threadpool_limits(1):
        here(parts)


def here(parts: int) -> None:
    """Fit to some parts, in this process, with as many threads as there are."""
    uc.ParametricPolicy(FEATURES).fit_batches(Together(parts))


def main() -> list[Row]:
    """Rows of all."""
    import dask
    from distributed import Client, LocalCluster

    parts = [Drawn(number) for number in range(PARTS)]
    with (
        dask.config.set({f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in KEEP_MEMORY.items()}),
        LocalCluster(n_workers=PROCESSES, threads_per_worker=1, dashboard_address=None) as running,
        Client(running, set_as_default=False) as client,
        ProcessPoolExecutor(PROCESSES, get_context("spawn")) as apart,
    ):
        serial, parallel, bound, threads = [], [], [], []
        policy = uc.ParametricPolicy(FEATURES)
        cluster.fit_batches(policy, parts[:PROCESSES], client=client)  # workers import
        list(apart.map(alone, [1] * PROCESSES))
        for _ in range(REPEATS):
            serial.append(seconds(lambda: alone(PARTS)))
            parallel.append(seconds(lambda: cluster.fit_batches(policy, parts, client=client)))
            bound.append(seconds(lambda: list(apart.map(alone, [PARTS // PROCESSES] * PROCESSES))))
            threads.append(seconds(lambda: here(PARTS)))
    one = uc.ParametricPolicy(FEATURES).fit_batches(Together())
    difference = max(
        float(np.abs(a - b).max() / np.abs(b).max())
        for a, b in zip(policy.moments_.sums, one.moments_.sums, strict=True)
    )
    ratio, most, threaded = (
        float(np.median(np.array(serial) / np.array(times))) for times in (parallel, bound, threads)
    )
    what = f"{PROCESSES} processes of dask, {PARTS * ROWS:.1e} samples, d = 2, M = 100"
    return [
        row(f"{what}: serial", float(np.median(serial)), "s"),
        row(f"{what}: dask", float(np.median(parallel)), "s"),
        row(f"{what}: serial / dask", ratio, "×", 1.5, 1.8, more_is_better=True),
        row(f"{what}: serial / halves apart", most, "×"),
        row(f"{what}: serial / all threads of one process", threaded, "×"),
        row(f"{what}: difference of the sums", difference, "1"),
    ]


if __name__ == "__main__":
    script(main)

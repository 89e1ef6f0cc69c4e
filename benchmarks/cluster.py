"""Two processes of dask against this one, on the same chunks."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

import unconstrain as uc
from unconstrain import cluster

PROCESSES = 2
PARTS, ROWS = 32, 50_000
REPEATS = 3

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
    """All parts, one after the other."""

    def __iter__(self) -> Any:
        for number in range(PARTS):
            yield from Drawn(number)


def main() -> list[dict[str, Any]]:
    """Print the table and return its rows."""
    import dask
    from distributed import Client, LocalCluster

    features = uc.NormalisedRBF.grid(-1, 1, 10)
    parts = [Drawn(number) for number in range(PARTS)]
    with (
        dask.config.set({f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in KEEP_MEMORY.items()}),
        LocalCluster(n_workers=PROCESSES, threads_per_worker=1, dashboard_address=None) as running,
        Client(running, set_as_default=False) as client,
    ):
        serial, parallel = [], []
        cluster.fit_batches(uc.ParametricPolicy(features), parts[:PROCESSES], client=client)  # workers import
        for _ in range(REPEATS):
            start = perf_counter()
            one = uc.ParametricPolicy(features).fit_batches(Together())
            serial.append(perf_counter() - start)
            start = perf_counter()
            other = cluster.fit_batches(uc.ParametricPolicy(features), parts, client=client)
            parallel.append(perf_counter() - start)
    difference = max(
        float(np.abs(a - b).max() / np.abs(b).max())
        for a, b in zip(other.moments_.sums, one.moments_.sums, strict=True)
    )
    ratio = float(np.median(np.array(serial) / np.array(parallel)))
    what = f"{PROCESSES} processes of dask, {PARTS * ROWS:.1e} samples, d = 2, M = 100"
    rows = [
        {"what": f"{what}: serial", "value": float(np.median(serial)), "unit": "s", "at_least": None, "aim": None},
        {"what": f"{what}: dask", "value": float(np.median(parallel)), "unit": "s", "at_least": None, "aim": None},
        {"what": f"{what}: serial / dask", "value": ratio, "unit": "×", "at_least": 1.5, "aim": 1.8},
        {"what": f"{what}: difference of the sums", "value": difference, "unit": "1", "at_least": None, "aim": None},
    ]
    for row in rows:
        print(f"{row['what']:76} {row['value']:10.4g} {row['unit']:2} at least {row['at_least'] or '-'}")
    return rows


if __name__ == "__main__":
    main()

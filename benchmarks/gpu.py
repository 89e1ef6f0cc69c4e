"""Sums and a fit on this processor with NumPy, and with PyTorch on a GPU if there is one: ``make bench-gpu``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from sums import GRIDS, SAMPLES, gathered, plane
from table import Row, row, script, side_by_side

import unconstrain as uc

REPETITIONS = 10


def waiting(call: Callable[[], object]) -> Callable[[], object]:
    """The same call, which returns only when the device has done it."""

    def done() -> None:
        call()
        if torch.cuda.is_available():
            torch.cuda.synchronize()

    return done


def rows_for(per_axis: int, states: Any, actions: Any, where: str) -> tuple[list[Row], np.ndarray]:
    """Times of sums and fit, and the weights that were learnt."""
    policy = uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, per_axis), uc.Hybrid(alpha=1e-2), uc.Folds(5))
    features = policy.features
    sums = waiting(lambda: gathered(features, states, actions))
    times = np.median(side_by_side([sums, waiting(lambda: policy.fit(states, actions))], repeats=3), axis=0)
    name = f"N = {len(states):.0e}, d = 2, M = {per_axis**2}, {where}"
    rows = [row(f"{name}: gather", times[0], "s"), row(f"{name}: whole fit", times[1], "s")]
    return rows, policy.solution_.weights


def main() -> list[Row]:
    """Rows of both."""
    repetitions = REPETITIONS if torch.cuda.is_available() else 1
    tables = [np.tile(part, (repetitions, 1)) for part in plane()]
    rows: list[Row] = []
    if not torch.cuda.is_available():
        print("There is no GPU here that PyTorch sees; PyTorch runs on the processor instead.")
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    where = torch.cuda.get_device_name() if device.type == "cuda" else "PyTorch on the processor"
    for per_axis in GRIDS if device.type == "cuda" else GRIDS[:1]:
        here, expected = rows_for(per_axis, *tables, "NumPy")
        there, found = rows_for(per_axis, *(torch.asarray(part, device=device) for part in tables), where)
        gap = float(np.abs(found - expected).max() / np.abs(expected).max())
        name = f"N = {repetitions * SAMPLES:.0e}, d = 2, M = {per_axis**2}"
        rows += [*here, *there, row(f"{name}: NumPy / {where}, gather", here[0]["value"] / there[0]["value"], "×")]
        rows += [row(f"{name}: difference of the weights, relative", gap, "1", 1e-8)]
    return rows


if __name__ == "__main__":
    script(main)

"""What it brings that the default chooses its model: nUPE over that of the widest fields, on what is reported.

Of every kind of ``unconstrain reproduce recorded`` that is learnt with local models, its first data sets of the report
half; recordings are in the folder named by ``UNCONSTRAIN_DATA``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from table import Row, row, script

import unconstrain as uc
from unconstrain.paper.experiments.recorded.sets import KINDS, REPORT_SEED, DataSet, data_sets


def both(data: DataSet) -> tuple[float, float, str]:
    """Its nUPE by default, that in the widest fields, and which was chosen: "affine", "cubic", "narrower", "widest"."""
    chosen = data.fit(uc.Robust())
    widest = replace(data, policy=uc.LocallyLinearPolicy(None)).fit(uc.Robust())
    one = {np.inf: "affine", "cubic": "cubic", widest.variance_: "widest"}
    return uc.nupe(chosen, data.test), uc.nupe(widest, data.test), one.get(chosen.variance_, "narrower")


def found(at_most: int) -> Iterator[tuple[str, tuple[float, float, str]]]:
    """Kind, errors and choice of each data set."""
    for kind in KINDS:
        for data in data_sets(REPORT_SEED, [kind], at_most):
            if isinstance(data.policy, uc.LocallyLinearPolicy):
                yield kind, both(data)


def main(sets: int = 3) -> list[Row]:
    """Geometric means of the ratio over all and over each kind."""
    kinds, compared = zip(*found(sets), strict=True)
    chosen, widest, model = map(np.array, zip(*compared, strict=True))
    ratio, of = np.maximum(chosen, 1e-12) / np.maximum(widest, 1e-12), np.array(kinds)
    exact = model == "cubic"  # of which the policies of some kinds are: their errors are rounding
    each = {kind: float(np.exp(np.log(ratio[of == kind]).mean())) for kind in dict.fromkeys(kinds)}
    return [
        row("data sets", len(ratio), ""),
        row("nUPE to that of the widest fields, geometric mean", np.exp(np.log(ratio).mean()), "×", 1.0),
        row("the same, where no cubic model was chosen", np.exp(np.log(ratio[~exact]).mean()), "×", 1.0),
        row("the same, worst kind", max(each.values()), "×", 1.5),
        row("single sets more than a tenth better", (ratio < 1 / 1.1).mean() * 100, "%"),
        row("single sets more than a tenth worse", (ratio > 1.1).mean() * 100, "%"),
        row("one affine model for all states", (model == "affine").mean() * 100, "%"),
        row("one cubic model for all states", exact.mean() * 100, "%"),
        row("narrower fields than the widest", (model == "narrower").mean() * 100, "%"),
        *(row(kind, value, "×") for kind, value in sorted(each.items(), key=lambda item: item[1])),
    ]


if __name__ == "__main__":
    script(main, sets=(int, 3))

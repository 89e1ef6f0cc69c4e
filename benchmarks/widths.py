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


def both(data: DataSet) -> tuple[float, float, float]:
    """Its nUPE by default, that in the widest fields, and the variance that was chosen, as a share of theirs."""
    chosen = data.fit(uc.Robust())
    widest = replace(data, policy=uc.LocallyLinearPolicy(None)).fit(uc.Robust())
    return uc.nupe(chosen, data.test), uc.nupe(widest, data.test), chosen.variance_ / widest.variance_


def found(at_most: int) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """Kind and errors of each data set."""
    for kind in KINDS:
        for data in data_sets(REPORT_SEED, [kind], at_most):
            if isinstance(data.policy, uc.LocallyLinearPolicy):
                yield kind, both(data)


def main(sets: int = 3) -> list[Row]:
    """Geometric means of the ratio over all and over each kind."""
    kinds, errors = zip(*found(sets), strict=True)
    chosen, widest, variance = np.maximum(errors, 1e-12).T
    ratio, of = chosen / widest, np.array(kinds)
    each = {kind: float(np.exp(np.log(ratio[of == kind]).mean())) for kind in dict.fromkeys(kinds)}
    return [
        row("data sets", len(ratio), ""),
        row("nUPE to that of the widest fields, geometric mean", np.exp(np.log(ratio).mean()), "×", 1.0),
        row("the same, worst kind", max(each.values()), "×", 1.5),
        row("single sets more than a tenth better", (ratio < 1 / 1.1).mean() * 100, "%"),
        row("single sets more than a tenth worse", (ratio > 1.1).mean() * 100, "%"),
        row("one affine model for all states", np.isinf(variance).mean() * 100, "%"),
        row("narrower fields than the widest", (variance < 1).mean() * 100, "%"),
        *(row(kind, value, "×") for kind, value in sorted(each.items(), key=lambda item: item[1])),
    ]


if __name__ == "__main__":
    script(main, sets=(int, 3))

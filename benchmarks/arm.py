"""How long the parts of one trial of Table II take: run with ``make bench``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from table import Row, row, script, side_by_side
from threadpoolctl import threadpool_limits

from unconstrain import Folds, Hybrid, LocallyLinearPolicy, gather, stack
from unconstrain.paper.experiments import table2
from unconstrain.paper.systems.arm import LWR3


def main() -> list[Row]:
    """Rows of all."""
    settings = table2.Settings()
    rng = np.random.default_rng(0)
    states, actions, groups = stack(table2.demonstrate(settings, 3, settings.demonstrations, rng))
    policy = LocallyLinearPolicy(settings.variance, validation=Folds(settings.folds))
    policy.fit(states, actions, groups=groups)
    features, weights = policy.features_(states), policy.fields_.weights(states)
    learner = Hybrid(settings.alpha, softness=settings.softness)
    postures = rng.uniform(LWR3.lower, LWR3.upper, (10_000, LWR3.joints))
    calls: list[tuple[str, Callable[[], object]]] = [
        (
            f"sums, {len(states):,} samples × {weights.shape[1]} fields × 7-DOF",
            lambda: gather(features, actions, weights),
        ),
        (f"hybrid, all thresholds of each field, {settings.folds} folds", lambda: policy.with_learner(learner)),
        ("whole fit: fields, sums in folds, hybrid", lambda: policy.set_params(learner=learner).fit(states, actions)),
        ("10,000 Jacobians", lambda: LWR3.jacobian(postures)),
    ]
    with threadpool_limits(1):
        times = side_by_side([call for _, call in calls])
    return [row(f"arm, {name}", 1e3 * value, "ms") for (name, _), value in zip(calls, np.median(times, 0), strict=True)]


if __name__ == "__main__":
    script(main)

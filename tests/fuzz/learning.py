"""Data as it comes, and as it should not, for every learner."""

import numpy as np

import unconstrain as uc

from .attack import numbers_of

LEARNERS = (uc.Direct, uc.Inconsistency, uc.Hybrid, uc.Robust, uc.NoiseCorrected, uc.Segments, uc.Likelihood)


def odd_table(rng, rows, columns, plain):
    table = rng.normal(size=(rows, columns)) * 10.0 ** rng.integers(-3, 4)
    if plain:
        return table
    for _ in range(rng.integers(0, 3)):
        some = rng.random(table.shape) < rng.choice([0.02, 0.5, 1.0])
        match rng.integers(6):
            case 0:
                table[some] = 0.0
            case 1:
                table *= 10.0 ** rng.integers(-29, 29)
            case 2:
                table[:, rng.integers(columns)] = rng.normal()
            case 3:
                table[some] = rng.choice([np.nan, np.inf, 1e30, -1e30, 1e-300, 5e-324])
            case 4:
                table = table[rng.integers(0, rows, rows)]
            case 5:
                table = np.round(table)
    return table


def learning(begin, folder):
    rng = numbers_of(begin)
    rows, n, d = int(rng.integers(1, 40)), int(rng.integers(1, 4)), int(rng.integers(1, 4))
    plain = rng.random() < 0.3
    states, actions = odd_table(rng, rows, n, plain), odd_table(rng, rows, d, plain)
    weights = None if rng.integers(3) else rng.choice([0.0, 1.0, 1e-310, 1e300], rows)
    groups = None if rng.integers(3) == 0 else rng.integers(0, rng.integers(1, 8), rows)
    learner = LEARNERS[rng.integers(len(LEARNERS))]()
    features = (uc.Affine(), uc.Polynomial(2), uc.KMeansRBF(5))[rng.integers(3)]
    policy = uc.LocallyLinearPolicy(learner=learner) if rng.integers(2) else uc.ParametricPolicy(features, learner)
    if isinstance(learner, uc.Segments) and rng.integers(2):
        policy.learner = uc.Segments("groups")
    policy.fit(states, actions, sample_weight=weights, groups=groups)
    if rng.integers(4) == 0:
        policy.partial_fit(odd_table(rng, rows, n, plain), odd_table(rng, rows, d, plain), groups=groups)
    found = policy.predict(states)
    return None if np.isfinite(found).all() else f"{policy} predicts what is not finite"

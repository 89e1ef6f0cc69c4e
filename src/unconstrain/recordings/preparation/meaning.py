"""What recorded actions are, by how they go with the states: velocities, or states to come."""

from typing import NamedTuple

import numpy as np

from ...base.arrays import Array

LEAST_ROWS = 10
LAGS = (1, 2, 3, 5, 8, 12)
"""Samples ahead at which a target may be reached."""


class Explained(NamedTuple):
    """Shares of actions explained by states to come and by the change of the states, and the factor of the change."""

    by_targets: float
    by_changes: float
    factor: float


def are_targets(states: Array, actions: Array) -> bool:
    """Whether actions (T, n) are the states (T, n) to come, and no velocities."""
    found = _explained(states, actions)
    return found is not None and found.by_targets > 0.9 and (found.by_changes < 0.5 or found.factor < 0)


def are_backwards(states: Array, actions: Array) -> bool:
    """Whether states (T, n) move against the actions (T, n)."""
    found = _explained(states, actions)
    return found is not None and found.by_changes > 0.7 and found.factor < 0 and found.by_targets < 0.5


def _explained(states: Array, actions: Array) -> Explained | None:
    if states.shape != actions.shape or len(states) < 2 * LEAST_ROWS:
        return None
    spread, energy = states.std(axis=0), float((actions**2).sum())
    if not spread.all() or energy == 0.0:
        return None
    changes = np.gradient(states, axis=0)
    if not changes.any():
        return None
    factor = float((changes * actions).sum() / (changes**2).sum())
    by_changes = 1.0 - float(((actions - factor * changes) ** 2).sum()) / energy
    lags = [lag for lag in LAGS if lag < len(states) // 3]
    by_targets = max(_share(states[lag:], actions[:-lag], spread) for lag in lags)
    return Explained(by_targets, by_changes, factor)


def _share(ahead: Array, actions: Array, spread: Array) -> float:
    """Share of the actions' variation that the states ahead explain as they are, 1 where they are the same."""
    unlike = (((actions - ahead) / spread) ** 2).sum()
    whole = (((actions - actions.mean(axis=0)) / spread) ** 2).sum()
    return 1.0 - float(unlike / max(whole, np.finfo(float).tiny))

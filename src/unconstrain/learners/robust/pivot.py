"""Motion about one place, as a hinge or a crank leads it: what points there, nobody shows.

Each local model alone would take it for told, as directions of motion turn within its field. So did the constraint.
"""

from __future__ import annotations

import numpy as np

from ...base.arrays import Array
from ...risks import minimum
from ...training import Samples

MOST_INWARDS, LEAST_TURNED, ONE_PATH = 0.08, 0.01, 0.15
"""Largest share of motion towards or from the place, least share of squared actions in a direction of motion, and
largest spread of distances from the place, as a share of these: what fills an area about it wants to turn.

The first was 0.01 to 0.06 for seven sets of doors with noise of up to 5 %, and 0.12 or more for 29 sets of other
movements: handwriting, signs, contours, wiping, cycles. The last was up to 0.09 for the doors."""


def pivot_of(states: Array, actions: Array) -> Array | None:
    """The place (n,) about which all samples move in one plane, at about one distance; None where there is none.

    Motion about a place in all directions of space is that of surfaces that differ, which tell more. States have to be
    of the actions' shape.
    """
    if states.shape != actions.shape:
        return None
    values, axes = np.linalg.eigh(actions.T @ actions)
    plane = axes[:, values > LEAST_TURNED * values[-1]]
    if plane.shape[1] != 2:
        return None
    middle = states.mean(axis=0)
    along = (actions * (states - middle)).sum(axis=1)
    within = actions @ plane
    pivot: Array = middle + plane @ np.linalg.solve(within.T @ within, within.T @ along)
    outwards = states - pivot
    inwards, far = np.vecdot(actions, outwards), np.linalg.norm(outwards, axis=1)
    on_one = far.std() < ONE_PATH * far.mean()
    about_it = (inwards**2).sum() <= MOST_INWARDS**2 * (np.linalg.norm(actions, axis=1) ** 2 @ far**2)
    return pivot if on_one and about_it else None


def pointing(samples: Samples) -> Array:
    """Weights (M, P, 1) of a policy as large as the actions that points away from the pivot; (M, P, 0) without one."""
    pivot = pivot_of(samples.states, samples.actions)
    if pivot is None:
        return np.empty((len(samples.sizes), samples.regressors * samples.actions.shape[1], 0))
    outwards = samples.states - pivot
    scale = np.sqrt(samples.energy / np.vecdot(outwards, outwards).mean())
    return np.asarray(minimum(samples.risk(scale * outwards, np.ones(len(samples))))[..., None])

"""Which action columns go with the change of the states, and are not it: of another unit, column or sign."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....base.arrays import Array
from ....base.display import listed
from ...remarks import Remark
from .checks import FASTEST, SLOWEST
from .directions import of_length_one
from .outlines import Outline

SURE, NEARER = 0.85, 10.0
"""Cosine with the change of a state from which on an action goes with it; with another than its own if this leaves out
of the action so many times as much, or as a hundredth."""

FACTORS = np.log([10.0, 180.0 / np.pi, 60.0, 100.0, 1e3, 1e6, 1e9])
"""Logarithms of factors between units of length, angle, and time."""

NEAR, ALIKE = np.log(1.03), np.log(1.2)
"""How far from such a factor, and from one, the logarithm of a ratio may be, beside that of its cosine.

Of 46 sets of recorded movements, and 184 alone, none is said to be odd beside velocities, recorded or not, late, per
sample, thrice as large, or turned by 90 degrees, nor beside accelerations, places to come, or springs with dampers."""


def actions_differ(outlines: Sequence[Outline]) -> list[tuple[int, Remark]]:
    """Demonstrations whose actions are the change of the states but for a unit, the order of columns, or signs.

    Actions that go with no change, or by another factor, may be what they are: forces, accelerations, commands.
    """
    moved = {at: one for at, one in enumerate(outlines) if one.made.shape == one.steps.shape and one.made.any()}
    if not moved or (found := _relation([*moved.values()])) is None:
        return []
    one, of, factors = next(iter(moved.values())), *found
    exchanged = of != np.arange(len(of))
    if not (odd := np.flatnonzero(exchanged | (factors != 1.0))).size:
        return []
    many = ["" if factor == 1.0 else f"{factor:.4g} times " for factor in factors]
    ways = [f"{one.actions[at]!r} is {many[at]}the change of {one.names[of[at]]!r}" for at in odd]
    if len({*factors}) == 1 and not exchanged.any():
        ways = [f"all actions are {many[0]}the change of the states"]
    cure = (
        "take the velocity of the states with differentiate='savgol', or correct units or signs (of time: time_unit=)"
    )
    if (factors == 1.0).all():
        cure = f"in the order of the states they are actions={tuple(one.actions[at] for at in np.argsort(of))}"
    said = f"{listed(ways, 4)} in the same time: {cure}. If that is meant, say action_is='velocity'."
    return [(at, Remark("not-velocities", said, one.actions[odd[0]])) for at in moved]


def _relation(known: Sequence[Outline]) -> tuple[NDArray[np.intp], Array] | None:
    """Of which state (n,) each action is the change, and how many times (n,); None where another thing may be meant.

    On a circle, place and acceleration are the change of another state, one with its sign turned.
    """
    made, steps = (np.concatenate([of_length_one(getattr(one, of)) for one in known]) for of in ("made", "steps"))
    lengths, columns = np.linalg.norm([made, steps], axis=1), np.arange(made.shape[1])
    cosines = made.T @ steps / np.maximum(np.outer(*lengths), np.finfo(float).tiny)
    left, best = np.maximum(1.0 - cosines**2, 0.01), np.abs(cosines).argmax(axis=1)
    of = np.where(left.diagonal() > NEARER * left[columns, best], best, columns)
    sure = np.abs(cosines[columns, of]) > SURE
    of = np.where(sure, of, columns)
    turned, exchanged = sure & (cosines[columns, of] < 0), (of != columns).any()
    timed = SLOWEST < 1.0 / (interval := float(np.median([one.interval for one in known]))) < FASTEST  # as it seems
    unclear = (lengths[0] ** 2) @ sure < SURE * (lengths[0] ** 2).sum() or len({*of.tolist()}) < len(of)
    if unclear or (turned.any() and (exchanged or turned[sure].all() or not timed)):  # all: moves against its actions
        return None
    sizes = [[np.linalg.norm(table, axis=0) for table in (one.made, one.steps[:, of])] for one in known]
    logs = np.median(np.subtract(*np.log(np.maximum(sizes, np.finfo(float).tiny)).swapaxes(0, 1)), axis=0)
    if not timed:
        logs -= np.median(logs[sure])
    elif (np.abs(logs - np.log(interval))[sure] < ALIKE).all():  # changes to the next sample, which are let be
        logs[:] = 0.0
    factors = np.where(sure, _factors(logs, np.where(sure, np.abs(cosines[columns, of]), 1.0)), 1.0)
    return None if np.isnan(factors).any() else (of, np.where(turned, -factors, factors))


def _factors(logs: Array, cosines: Array) -> Array:
    """The factor between units that each logarithm is near, as far as its cosine tells; NaN where it is near none."""
    every, noise = np.concatenate([FACTORS, -FACTORS]), -np.log(cosines)
    nearest = every[np.abs(logs[:, None] - every).argmin(axis=1)]
    near = np.where(np.abs(logs - nearest) < NEAR + noise, np.exp(nearest), np.nan)
    return np.where(np.abs(logs) < ALIKE + noise, 1.0, near)

"""States of angles and orientations without the jumps that are none: what a recipe names is made continuous in time."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ...base.arrays import Array
from ...base.errors import SettingError
from ..signals.orientations import TURNS, continuous_quaternions, continuous_rotations
from .recipes import Recipe


def continuous(states: Array, recipe: Recipe) -> Array:
    """Unwrap the angles, and give quaternions and rotation vectors the numbers closest to those of the row before.

    Parameters
    ----------
    states : ndarray, shape (T, n)
        Columns as ``recipe.states``; in the order of time.
    recipe : Recipe

    Returns
    -------
    ndarray, shape (T, n)
        The same table where the recipe names no such column.
    """
    unwrapped: Callable[[Array], Array] = partial(np.unwrap, axis=0)
    groups = [
        *(((name,), unwrapped) for name in recipe.angles),
        *((names, continuous_quaternions) for names in recipe.quaternions),
        *((names, unturned) for names in recipe.rotation_vectors),
    ]
    if not groups or not len(states):
        return states
    smooth, known = states.copy(), recipe.states or ()
    for names, repair in groups:
        if strange := [name for name in names if name not in known]:
            expected = f"expected one of the states {', '.join(known)}; add it to them."
            raise SettingError(f"got {strange[0]!r} as an angle, {expected}")
        columns = [known.index(name) for name in names]
        smooth[:, columns] = repair(smooth[:, columns])
    return smooth


def unturned(vectors: Array) -> Array:
    """Rotation vectors (T, 3), radians or degrees, as those of the same rotations closest to the row before."""
    in_degrees = bool(np.ptp(np.linalg.norm(vectors, axis=1)) > 1.02 * TURNS[0])
    return continuous_rotations(vectors, TURNS[in_degrees])

"""Forces as the second witness: a mechanism pushes along the rows of its A, and friction against the movement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from .mechanism import Mechanism
from .track import noise_by_differences

LEAST_SHARE = 0.1
"""A force counts from this share of the whole on: an axis off by a few degrees shows that much of the others."""

LEAST_NOISE = 5.0
"""And from this many standard deviations of the sensor's noise on."""

SMALLEST = 1e-9
"""No force at all, whatever the rounding."""


class Witness(NamedTuple):
    """What the forces say of one direction in which nothing moved.

    Parameters
    ----------
    direction : str
    force : float
        Root mean square, in the unit of the forces.
    held : bool
        Whether a force shows there. If not, the direction may be held, or nobody wanted to move in it.
    """

    direction: str
    force: float
    held: bool

    def __str__(self) -> str:
        if self.held:
            return f"held {self.direction}, where {self.force:.2g} N show"
        return f"undetermined {self.direction}: nothing moved and nothing pushed ({self.force:.2g} N)"


def witnesses(
    mechanisms: Sequence[Mechanism], positions: Array, forces: Array, groups: NDArray[np.intp]
) -> list[Witness]:
    """What forces (N, D) at positions (N, D), in the same frame, say of each direction that mechanisms hold.

    There is one mechanism for all, or one for each group, and groups are ascending. Friction is against the movement,
    and no row of A is along the movement: what pushes along the rows is free of it.
    """
    if not mechanisms[0].form.chart:
        return []
    parts = np.split(positions, np.flatnonzero(np.diff(groups)) + 1) if len(mechanisms) > 1 else [positions]
    rows = np.concatenate([one.rows(part) for one, part in zip(mechanisms, parts, strict=True)])
    pushed = np.einsum("nkd,nd->nk", rows, forces)
    turn, names = np.eye(rows.shape[1]), mechanisms[0].form.directions
    if not names:  # the rows are the same everywhere: those of most and of least force
        turn = np.linalg.eigh(pushed.T @ pushed)[1][:, ::-1].T
        names = tuple(f"along ({', '.join(f'{number:z.2f}' for number in way)})" for way in turn @ rows[0])
    strength = np.sqrt(((pushed @ turn.T) ** 2).mean(axis=0))
    whole = np.sqrt((forces**2).sum(axis=1).mean())
    least = max(LEAST_SHARE * whole, LEAST_NOISE * noise_by_differences(forces, groups), SMALLEST)
    return [Witness(name, float(force), bool(force > least)) for name, force in zip(names, strength, strict=True)]

"""Samples as they arrive. No more than a block of rows is held beside what was given: it may be mapped from files."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import BLOCK_ROWS, Array, beside, is_foreign, namespace, slices

Groups = Sequence[Hashable] | NDArray[np.generic]

FOREIGN_BLOCK_ROWS = 2**20
"""Rows of an array of another library that are summed together: its device may want much to do at once."""


class Batch(NamedTuple):
    """Samples that were checked.

    ``states`` (N, n) and ``actions`` (N, d), of any real type (:meth:`blocks` gives float64) and of any array library;
    sample ``weights`` (N,), ``groups`` (N,) and ``times`` (N,) in seconds, where given.
    """

    states: NDArray[Any]
    actions: NDArray[Any]
    weights: Array | None = None
    groups: NDArray[np.generic] | None = None
    times: Array | None = None

    def blocks(self) -> Iterator[Batch]:
        """Go through it by some rows at a time, without those of no weight."""
        xp = namespace(self.states)
        for rows in slices(self.states, FOREIGN_BLOCK_ROWS if is_foreign(self.states) else BLOCK_ROWS):
            columns = (None if one is None else one[rows] for one in self[2:])
            part = Batch(self.states[rows, :], self.actions[rows, :], *columns)  # type: ignore[arg-type]
            if part.weights is not None and not part.weights.all():
                part = part.at(np.flatnonzero(part.weights))  # a weight of zero is the same as not being there
            if part.states.shape[0]:
                states, actions = (xp.asarray(table, dtype=xp.float64) for table in part[:2])
                yield part._replace(states=states, actions=actions)

    def at(self, rows: NDArray[np.intp]) -> Batch:
        """Some of the samples, in any order."""
        parts: list[Any] = [
            None if part is None else namespace(part).take(part, beside(rows, part), axis=0) for part in self
        ]
        return Batch(*parts)

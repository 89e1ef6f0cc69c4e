"""Samples as they arrive. No more than a block of rows is held beside what was given: it may be mapped from files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.arrays import (
    BLOCK_ROWS,
    Array,
    Groups,
    as_groups,
    as_matrix,
    as_table,
    as_vector,
    as_weights,
    beside,
    is_foreign,
    namespace,
    on_host,
    slices,
)
from ..base.errors import InvalidDataError
from .suspects import credibility, lengths_in

FOREIGN_BLOCK_ROWS = 2**20
"""Rows of an array of another library that are summed together: its device may want much to do at once."""


class Batch(NamedTuple):
    """Samples that were checked.

    ``states`` (N, n) and ``actions`` (N, d), of any real type (:meth:`blocks` gives float64) and of any array library;
    sample ``weights`` (N,), ``groups`` (N,), ``times`` (N,) in seconds and the standard deviation of each action's
    ``noise`` (N, d), where given.
    """

    states: NDArray[Any]
    actions: NDArray[Any]
    weights: Array | None = None
    groups: NDArray[np.generic] | None = None
    times: Array | None = None
    noise: Array | None = None

    @classmethod
    def checked(
        cls,
        states: Array,
        actions: ArrayLike,
        sample_weight: ArrayLike | None = None,
        groups: Groups | None = None,
        times: ArrayLike | None = None,
        noise: ArrayLike | None = None,
    ) -> tuple[Batch, bool]:
        """Check what goes with some states (N, n), and say whether the actions were a vector (N,).

        Raises
        ------
        InvalidDataError
            If lengths differ or a number is not finite.
        """
        if actions is None:
            raise InvalidDataError("requires y to be passed, but the target y is None: expected the observed actions.")
        if is_foreign(actions) != is_foreign(states):
            actions = beside(on_host(actions), states)
        table, flat = as_table(actions, "actions", convert=False)
        samples = states.shape[0]
        if table.shape[0] != samples:
            raise InvalidDataError(
                f"got {samples} states and {table.shape[0]} actions (inconsistent numbers of samples), "
                "expected one action for each state."
            )
        weights = None if sample_weight is None else as_weights(sample_weight, samples)
        names = None if groups is None else as_groups(groups, samples)
        stamps = None if times is None else as_vector(times, "times", samples)
        return cls(states, table, weights, names, stamps, None if noise is None else as_matrix(noise, "noise")), flat

    def blocks(self) -> Iterator[Batch]:
        """Go through it by some rows at a time, without those of no weight."""
        xp = namespace(self.states)
        for rows in self._slices():
            columns = (None if one is None else one[rows] for one in self[2:])
            part = Batch(self.states[rows, :], self.actions[rows, :], *columns)  # type: ignore[arg-type]
            if part.weights is not None and not part.weights.all():
                part = part.at(np.flatnonzero(part.weights))  # a weight of zero is the same as not being there
            if part.states.shape[0]:
                states, actions = (xp.asarray(table, dtype=xp.float64) for table in part[:2])
                yield part._replace(states=states, actions=actions)

    def tempered(self, longest: float) -> Batch:
        """With less weight for actions longer than what is plausible; itself where there is none."""
        if not np.isfinite(longest):
            return self
        xp = namespace(self.actions)
        parts = (xp.asarray(self.actions[rows, :], dtype=xp.float64) for rows in self._slices())
        factors = credibility(np.concatenate([lengths_in(longest, part) for part in parts]))
        return self if (factors == 1.0).all() else self._replace(weights=self.counts * factors)

    def without(self, rows: NDArray[np.intp]) -> Batch:
        """With a weight of zero for some of the samples: the same as their not being there."""
        counts = self.counts.copy()
        counts[rows] = 0.0
        return self._replace(weights=counts)

    def followed_by(self, other: Batch) -> Batch:
        """Both in one; groups, times and noise only where both have them."""
        xp, weighted = namespace(self.states), self.weights is not None or other.weights is not None
        columns: list[Any] = [xp.concat([mine, theirs]) for mine, theirs in zip(self[:2], other[:2], strict=True)]
        columns.append(np.concatenate([self.counts, other.counts]) if weighted else None)
        for mine, theirs in zip(self[3:], other[3:], strict=True):
            columns.append(None if mine is None or theirs is None else np.concatenate([mine, theirs]))
        return Batch(*columns)

    def _slices(self) -> Iterator[slice]:
        return slices(self.states, FOREIGN_BLOCK_ROWS if is_foreign(self.states) else BLOCK_ROWS)

    @property
    def counts(self) -> Array:
        """Sample weights, ones where none were given, shape (N,)."""
        return np.ones(self.states.shape[0]) if self.weights is None else self.weights

    def at(self, rows: NDArray[np.intp]) -> Batch:
        """Some of the samples, in any order."""
        parts: list[Any] = [
            None if part is None else namespace(part).take(part, beside(rows, part), axis=0) for part in self
        ]
        return Batch(*parts)

"""Constraints ``A(x) = Λ J(x)``: the Jacobian J of a task is known, which combinations Λ of its rows were held is not.

With ``v = J u``, a combination λ of rows was held by demonstrations in which ``λᵀ v`` is within the noise:

    S λ = μ B λ,   S = Σ v vᵀ,   B = Σ J Jᵀ,   held where μ < 2 V

V is the variance of an action along a held direction: the noise's, and that of
the misfit τ of J as a share of the actions, ``V = σ² + τ² E‖u‖² / d``.
Demonstrations under the same Λ are of one kind. Kinds are found by random
sample consensus (Fischler and Bolles, *Communications of the ACM* 24(6),
1981) over triples of demonstrations. A demonstration belongs to a kind if its
motion along the kind's rows, ``‖(I − N̂) u‖²``, is on average what noise and
misfit explain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import null_space_projection
from .constants import (
    HELD_VARIANCES,
    KIND_TRIES,
    LEAST_OF_KIND,
    LEAST_SHARE_OF_KIND,
    MISFIT_OF_KIND,
    MOST_KINDS,
    NOISE_OF_KIND,
    SAMPLES_OF_KIND,
)

UNKNOWN = -1
"""Label of a demonstration that is of no kind."""

_RANK = 1e-6
"""Singular values of ΛJ below this share of the largest count as zero: near singular postures, J says little."""


@dataclass(frozen=True, eq=False)
class Kinds:
    """Kinds of constraints that demonstrations have in common.

    Parameters
    ----------
    labels : ndarray of int, shape (G,)
        Which kind each demonstration is of; :data:`UNKNOWN` where none fits.
    rows : tuple of ndarray, shape (k, r)
        Λ of each kind.
    """

    labels: NDArray[np.intp]
    rows: tuple[Array, ...]

    def projections(self, jacobians: Array, groups: NDArray[np.intp]) -> Array:
        """N of each sample (N, d, d), the identity where the kind is not known."""
        found = np.tile(np.eye(jacobians.shape[2]), (len(groups), 1, 1))
        for kind, rows in enumerate(self.rows):
            of_kind = self.labels[groups] == kind
            found[of_kind] = null_space_projection(rows @ jacobians[of_kind], _RANK)
        return found


class HeldRows:
    """What demonstrations show of Λ.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    jacobians : ndarray, shape (N, r, d)
    groups : ndarray of int, shape (N,)
        Which of G demonstrations each sample is from.
    noise : float
        Variance σ² on each action coordinate.
    """

    def __init__(self, actions: Array, jacobians: Array, groups: NDArray[np.intp], noise: float) -> None:
        self._groups, self._noise = groups, noise
        self._count, self._size = int(groups.max()) + 1, float(np.vecdot(actions, actions).mean()) / actions.shape[1]
        self._dimension = actions.shape[1]
        self._moved = np.einsum("nrd,nd->nr", jacobians, actions)  # v = J u
        self._metric = jacobians @ jacobians.swapaxes(1, 2)  # J Jᵀ
        self._some = np.arange(len(groups)) % -(-len(groups) // (SAMPLES_OF_KIND * self._count)) == 0

    def kinds(self, misfit: float) -> Kinds:
        """The kinds of constraints, the one of most motion held first, for a misfit τ of the Jacobian."""
        labels = np.full(self._count, UNKNOWN)
        rows: list[Array] = []
        variance = self._noise + misfit**2 * self._size
        while len(rows) < MOST_KINDS:
            found = self._largest(np.flatnonzero(labels == UNKNOWN), variance)
            if found is None:
                break
            labels[found[1]] = len(rows)
            rows.append(found[0])
        return Kinds(labels, tuple(rows))

    def alone(self) -> Kinds:
        """A kind for each demonstration, of the rows that it held as far as noise tells, with motion left; or none."""
        most = self._dimension - 1
        every = [self._held(np.array([group]), self._noise)[:most] for group in range(self._count)]
        shown = np.array([len(rows) > 0 for rows in every])
        labels = np.where(shown, np.cumsum(shown) - 1, UNKNOWN)
        return Kinds(labels, tuple(rows for rows in every if len(rows)))

    def _largest(self, left: NDArray[np.intp], variance: float) -> tuple[Array, NDArray[np.intp]] | None:
        """Λ of the kind that holds most samples in most directions, and the demonstrations of it."""
        least, best = max(LEAST_OF_KIND, LEAST_SHARE_OF_KIND * self._count), None
        most = 0.0
        for start in self._starts(left, least):
            rows, support = self._consensus(start, left, variance)
            held = float(self._samples[support].sum()) * len(rows)
            if len(support) >= least and held > most:
                best, most = (rows, support), held
            if len(support) == len(left) and len(rows):
                break
        return best

    def _starts(self, left: NDArray[np.intp], least: float) -> Iterator[NDArray[np.intp]]:
        """All demonstrations that are left, and triples of them."""
        if len(left) >= least:
            yield left
            rng = np.random.default_rng(len(left))
            for _ in range(KIND_TRIES):
                yield rng.choice(left, 3, replace=False)

    def _consensus(
        self, start: NDArray[np.intp], left: NDArray[np.intp], variance: float
    ) -> tuple[Array, NDArray[np.intp]]:
        """Rows held by some demonstrations, and by all that fit these rows, in turn."""
        rows = self._held(start, variance)
        for _ in range(3):
            support = self._support(rows, left, variance)
            if len(support) == 0:
                break
            before, rows = len(rows), self._held(support, variance)
            if len(rows) == before:
                break
        return rows, self._support(rows, left, variance)

    def _support(self, rows: Array, left: NDArray[np.intp], variance: float) -> NDArray[np.intp]:
        """Which of some demonstrations fit rows; none where there is no row."""
        return left[self._fits(rows, variance)[left]] if len(rows) else left[:0]

    def _held(self, of: NDArray[np.intp], variance: float) -> Array:
        """Λ (k, r), normalised to ``Λ B Λᵀ = I``, of what some demonstrations held in common."""
        moved, metric = (each[of].sum(axis=0) for each in self._sums)
        values, axes = np.linalg.eigh(metric)
        kept = values > 1e-9 * values[-1]
        scaled = axes[:, kept] / np.sqrt(values[kept])
        along, rows = np.linalg.eigh(scaled.T @ moved @ scaled)
        return np.asarray((scaled @ rows[:, along < HELD_VARIANCES * variance]).T)

    def _fits(self, rows: Array, variance: float) -> NDArray[np.bool_]:
        """Which demonstrations move along rows as little as noise and misfit explain, if any were looked at, (G,)."""
        moved, inner = self._moved[self._some] @ rows.T, rows @ self._metric[self._some] @ rows.T
        inner = inner + 1e-12 * np.trace(inner, axis1=1, axis2=2)[:, None, None] * np.eye(len(rows))
        leak = np.vecdot(moved, np.linalg.solve(inner, moved[:, :, None])[:, :, 0])  # ‖(I − N) u‖²
        groups, k = self._groups[self._some], len(rows)
        counts = np.bincount(groups, minlength=self._count)
        sizes = np.maximum(counts, 1)
        mean = np.bincount(groups, leak, self._count) / sizes
        chance = 1.0 + NOISE_OF_KIND + 4.0 * np.sqrt(2.0 / (sizes * k))
        explained = k * (self._noise * chance + MISFIT_OF_KIND * (variance - self._noise))
        return np.asarray((counts > 0) & (mean < explained))

    @cached_property
    def _samples(self) -> NDArray[np.intp]:
        return np.bincount(self._groups, minlength=self._count)

    @cached_property
    def _sums(self) -> tuple[Array, Array]:
        """S and B of each demonstration, (G, r, r)."""
        size = self._moved.shape[1]
        moved, metric = np.zeros((2, self._count, size, size))
        np.add.at(moved, self._groups, self._moved[:, :, None] * self._moved[:, None, :])
        np.add.at(metric, self._groups, self._metric)
        return moved, metric

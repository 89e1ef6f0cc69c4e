"""From sums to a constraint: ``S w = λ G w``, the rank at each state, and the noise.

White noise of variance σ² on actions adds ``σ² G`` to S: the eigenvectors stay, and the smallest eigenvalues are σ².
If ``a(x)`` holds then so does ``x_i a(x)``: eigenvalues at that floor do not count directions. What does is the row
space, at each state, of all fields ``V_i(x)`` of the eigenvectors. Each is taken in inverse proportion to its excess,

    M(x) = Σ_i V_i(x)ᵀ V_i(x) / (λ_i − σ² + σ² / √N),                  (d, d)

and ``1 / nᵀ M(x)⁻¹ n`` is then the least excess of any constraint of the form that holds direction n at x. So the
leading eigenvectors of M(x) are what is held there, and no threshold decides which fields take part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Array
from ..base.errors import InvalidDataError
from .forms import Lifted

DEPENDENT = 1e-13
"""Combinations of coefficients with less than this share of the largest |A|² are no constraint."""

ROUNDING = 1e-14
"""Eigenvalues below this share of the largest are rounding, for each coefficient."""

NOTHING = 1e-20
"""Of actions of about one, none move where the largest eigenvalue is smaller."""

LEAST = 1e-17
"""Least excess, as the same share. What is larger costs digits where data is exact: 1e-15 gave 1e-20 for 1e-24."""

FLOOR = 4.0
"""Eigenvalues above so many times the smallest are not at the floor."""

FAINTEST = 0.03
"""Directions in which fields at the floor have less than this share of their largest size are noise or not there."""

TYPICAL = 200
"""States that the rank is found at."""

HELD = 1e-3
"""Directions with more than this share of the largest eigenvalue are held only if their noise is that of the floor."""


@dataclass(frozen=True, eq=False)
class Fields:
    """Eigenvectors of one pencil as fields over the states, and which of their directions are held.

    Parameters
    ----------
    coefficients : ndarray, shape (P, K)
        Of the eigenvectors, each over the square root of its excess; those at the floor first.
    floor : int
        How many these are.
    noise : float
        The smallest eigenvalue.
    motion : float
        The largest.
    rank : int
        Most directions that are held at once.
    cost : float
        Directions of a larger least excess are free.
    next : float
        Cost of the first free direction, as a share of the largest eigenvalue.
    """

    coefficients: Array
    floor: int
    noise: float
    motion: float
    rank: int = 1
    cost: float = np.inf
    next: float = 1.0

    @classmethod
    def of(cls, motion: Array, size: Array, weight: float) -> Fields:
        """Solve with S and G of mean weight one, over samples of some weight; without a rank."""
        values, vectors = _eigensystem(motion, size)
        if not len(values):
            raise InvalidDataError("the features are the same at all states, and so no surface goes through them.")
        noise, largest = max(values[0], 0.0), max(values[-1], NOTHING)
        excess = values - values[0] + noise / np.sqrt(weight) + LEAST * len(values) * largest
        floor = _count_at_floor(values, weight, ROUNDING * len(values) * largest)
        return cls(vectors / np.sqrt(excess), floor, noise, largest)

    def ranked(self, samples: Lifted, crossing: bool) -> Fields:
        """With the rank where fields at the floor have their largest gap, and the middle of held and free costs.

        Where movements cross each other, directions with more noise count, too, if their cost is nearer to the least
        than to the next one's.
        """
        typical = samples.at(slice(TYPICAL))
        rows = typical.acting(typical.fields(self.coefficients[:, : self.floor]))
        squares = np.linalg.eigvalsh(rows.swapaxes(1, 2) @ rows).mean(axis=0)[::-1]
        sizes = np.sqrt(np.maximum(squares / squares[0], FAINTEST**2))
        most = min(self.floor, len(sizes))
        rank = int((sizes[:most] / np.append(sizes[1:most], FAINTEST)).argmax()) + 1
        costs = np.median(self.directions(typical)[0], axis=0)
        excess = np.minimum(costs + self.noise, self.motion)
        least = np.minimum(np.sqrt(excess[0] * excess[1:]), HELD * self.motion)
        while crossing and rank < len(costs) - 1 and excess[rank] < least[rank]:
            rank += 1
        between = float(np.sqrt(costs[rank - 1] * costs[rank])) if rank < len(costs) else np.inf
        return replace(self, rank=rank, cost=between, next=float(excess[min(rank, len(costs) - 1)] / self.motion))

    def directions(self, samples: Lifted) -> tuple[Array, Array]:
        """Least excess of each direction, ascending, shape (N, d), and the directions in rows, shape (N, d, d)."""
        rows = samples.acting(samples.fields(self.coefficients))
        values, vectors = np.linalg.eigh(rows.swapaxes(1, 2) @ rows)
        with np.errstate(divide="ignore"):
            costs = 1.0 / np.maximum(values[:, ::-1], 0.0)
        return costs, vectors[:, :, ::-1].swapaxes(1, 2)

    def rows(self, samples: Lifted) -> Array:
        """Orthonormal rows of A, zero where fewer are held, shape (N, rank, d)."""
        costs, directions = self.directions(samples)
        return np.where((costs <= self.cost)[:, : self.rank, None], directions[:, : self.rank], 0.0)

    def residuals(self, samples: Lifted, rows: Array) -> Array:
        """``A u − b`` for rows (N, K, d) of A, as velocity, or as distance from a surface, shape (N, K).

        What all fields as a whole expect along n: ``nᵀ Σ V_iᵀ (V_i v) / nᵀ M n``.
        """
        fields = samples.fields(self.coefficients)
        along = samples.acting(fields) @ rows.swapaxes(1, 2)  # (N, fields, K)
        missed = (along * (fields @ samples.motions[:, :, None])).sum(axis=1)
        return missed / np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)


def _eigensystem(motion: Array, size: Array) -> tuple[Array, Array]:
    """Eigenvalues, ascending, and vectors (P, K) of ``S w = λ G w``, with ``wᵀ G w = 1``.

    What has no part in G (a task's b, the height of a surface) takes the value that makes S least: a Schur complement.
    """
    parts, axes = np.linalg.eigh(size)
    counting = parts > DEPENDENT * parts[-1]
    whitening = axes[:, counting] / np.sqrt(parts[counting])
    if not counting.all():
        absent = axes[:, ~counting]
        moved, ways = np.linalg.eigh(absent.T @ motion @ absent)
        real = moved > DEPENDENT * np.abs(motion).max()
        absent = absent @ ways[:, real] / np.sqrt(moved[real])
        whitening = whitening - absent @ (absent.T @ motion @ whitening)
    values, vectors = np.linalg.eigh(whitening.T @ motion @ whitening)
    return values, whitening @ vectors


def _count_at_floor(values: Array, weight: float, rounding: float) -> int:
    """How many eigenvalues are the noise, by the widest gap that can be its end.

    Sampling spreads those of noise alone by ``((1 + √γ) / (1 − √γ))²``, γ the coefficients per sample [1]_; misfit
    may spread them further, up to :data:`FLOOR`.

    References
    ----------
    .. [1] V. A. Marchenko and L. A. Pastur. Distribution of eigenvalues for some sets of random matrices.
       *Mathematics of the USSR-Sbornik* 1(4), 1967.
    """
    root = np.sqrt(min(len(values) / weight, 0.25))
    noise = max(values[0], 0.0)
    least = int((values <= noise * 1.1 * ((1.0 + root) / (1.0 - root)) ** 2 + rounding).sum())
    most = max(int((values <= FLOOR * noise + rounding).sum()), least)
    ends = np.maximum(values[least - 1 : most + 1], max(noise, rounding))
    return least if len(ends) < 2 else least + int((ends[1:] / ends[:-1]).argmax())

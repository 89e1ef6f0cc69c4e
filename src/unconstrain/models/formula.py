"""Closed form of a fitted policy, without estimator, moments or feature map."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.arrays import Array
from ..base.display import Shown, counted
from .spaces import Embedding


@dataclass(frozen=True, eq=False)
class Correction:
    """What makes a policy's velocities arrive, at a goal or on a cycle, as numbers.

    Parameters
    ----------
    kind : str
        Of the formula: ``"descent"`` or ``"orbit"``, as described in :class:`~unconstrain.Guided`.
    goal : ndarray, shape (n,)
    directions : ndarray, shape (K, n)
    offsets, weights : ndarray, shape (K,)
        Of ``V(x) = ½ Σ w (aᵀ(x − x*) − b)₊²``.
    numbers : mapping of str to float
        The other constants of the formula, by name.
    turn : ndarray, shape (n, n)
        B of a cycle, else zero.
    promise : str
        What is guaranteed, in words.
    """

    kind: str
    goal: Array
    directions: Array
    offsets: Array
    weights: Array
    numbers: Mapping[str, float]
    turn: Array
    promise: str

    @property
    def tables(self) -> dict[str, Array]:
        """All numbers but the single ones, by name."""
        names = ("goal", "directions", "offsets", "weights", "turn")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, eq=False, repr=False)
class ClosedForm(Shown):
    """Affine maps blended by normalised Gaussian kernels, or one map, affine or a polynomial.

    With ``z = x − origin`` in the coordinates of the state space, which are the states where those are Euclidean,

        ``π̃(x) = Σ_m s_m(x) (A_m z + b_m)``,  ``s_m = exp(e_m) / Σ_k exp(e_k)``,

    where ``e_m = slope_mᵀ z + offset_m`` is the logarithm of a Gaussian kernel without ``−‖z‖² / 2σ²``, which is common
    to all and cancels. A parametric policy on normalised RBFs has A = 0. Of one map, M = 1, no kernel has a share: if
    there are any, they only measure support. That of a polynomial policy takes products of entries of ``(z, 1)`` in
    place of these. All of :mod:`~unconstrain.deployment` is generated from it.

    Parameters
    ----------
    origin : ndarray, shape (m,)
    maps : ndarray, shape (M, d, m + 1), (M, d, 1) or (1, d, p)
        ``(A_m, b_m)``, or ``b_m`` alone, or factors of the monomials.
    exponents : ndarray, shape (M, m + 1), or (K, m + 1) with M = 1, optional
        ``(slope_m, offset_m)``; see :func:`exponents`. Without it M is 1.
    reach : ndarray, shape (m,)
        Extent of the data from the origin along each axis; the range of self-tests.
    monomials : ndarray of int, shape (p, degree), optional
        Monomial j is the product of the entries ``monomials[j]`` of ``(z, 1)``. With one map only.
    embedding : Embedding
        States (n,) to coordinates (m,).
    precisions : ndarray, shape (m,), optional
        ``λ = 1 / σ²`` along each axis, which is ``slope_m`` over the centre of kernel m. The kernel of the nearest
        centre, the support of a state, is ``exp(max_m e_m − ½ Σ_i λ_i z_i²)``.
    correction : Correction, optional
        What is done to the actions afterwards.

    Examples
    --------
    >>> twice = uc.ClosedForm(origin=np.zeros(1), maps=np.array([[[2.0, 0.0]]]), exponents=None, reach=np.ones(1))
    >>> twice.sizes  # coordinates, actions, models
    (1, 1, 1)
    """

    origin: Array
    maps: Array
    exponents: Array | None
    reach: Array
    monomials: NDArray[np.intp] | None = None
    embedding: Embedding = field(default_factory=Embedding)
    precisions: Array | None = None
    correction: Correction | None = None

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of coordinates m, of actions d, and of models M."""
        return len(self.origin), self.maps.shape[1], self.maps.shape[0]

    @property
    def columns(self) -> int:
        """Number of state columns n."""
        return int(self.embedding.states(self.origin[None]).shape[1])

    @property
    def within(self) -> Array:
        """How far from the origin states are near the data: its reach, or without kernels twice that, (m,)."""
        return self.reach * (2 if self.precisions is None else 1)

    @property
    def is_affine(self) -> bool:
        """Whether the models are affine maps rather than constants."""
        return self.maps.shape[2] > 1

    @property
    def blending(self) -> Array | None:
        """The exponents where they blend the maps, (M, m + 1); None of one map."""
        return self.exponents if len(self.maps) > 1 or not self.is_affine else None

    @property
    def degree(self) -> int:
        """How fast the actions grow far away: at most with this power of the distance."""
        return 1 if self.monomials is None else self.monomials.shape[1]

    def support(self, states: ArrayLike) -> Array:
        """How near the data states (N, n) are, as exports say, (N,): 1 to 0; without kernels 1 within reach, else 0."""
        z = self.embedding(np.asarray(states, np.float64)) - self.origin
        if self.exponents is None or self.precisions is None:
            return (np.abs(z) <= self.within).all(axis=1).astype(float)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite has no support
            nearest = (z @ self.exponents[:, :-1].T + self.exponents[:, -1]).max(axis=1) - 0.5 * z**2 @ self.precisions
        return np.asarray(np.exp(np.minimum(nearest, 0.0)))

    def _summary(self) -> tuple[str, ...]:
        return tuple(map(counted, (self.columns, *self.sizes[1:]), ("state", "action", "model")))


def exponents(centres: Array, variance: float, origin: Array) -> Array:
    """Slopes and offsets of Gaussian kernels, shape (M, n + 1): ``(c_m / σ², −‖c_m‖² / 2σ²)``, from the origin."""
    far = centres - origin
    return np.column_stack([far, -0.5 * (far**2).sum(axis=1)]) / variance

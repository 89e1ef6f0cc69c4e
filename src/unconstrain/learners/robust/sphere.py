"""The sphere on which every projection of the policy lies, and how samples lie on it.

By Thales' theorem a projection ``u = N π`` sees 0 and π at a right angle, so
it lies on the sphere with diameter [0, π], whatever the constraint. What is
observed is therefore at a distance of the sphere's surface that is noise
alone; where on the surface it is, is the constraint's doing. A sample that
was free is at the end of the diameter, π itself.

Density of a sample, given π (d actions, noise of variance σ² in each):

    p(u | π) = N(δ; 0, σ²) Σ_k m_k D_k(t)

with δ the distance to the surface, and t = ‖u − π‖ along it. The D_k are
normal densities in d − 1 dimensions of variance ``σ² + s_k² ‖π‖²``: for
``s_0 = 0`` the sample was free, for larger ones the constraint turned it
that far off. The last D is uniform on the sphere. The shares m_k, and so how
near to the free end constraints leave the samples, come from the data.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import gammaln, logsumexp

from ...base.arrays import Array

SPREADS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
"""The s_k: typical angles between action and policy, in radians for the small ones."""

_TINY = 1e-300


class Distances(NamedTuple):
    """Where samples are about their spheres: ``radial`` (N,) is δ, ``normal`` (N, d) minus its derivative by π.

    On the sphere the normal is ``u / ‖π‖``: the inconsistency with samples weighted by ``‖u‖² / ‖π‖²``.
    ``turn`` (N, d) takes π to its own length along u, at right angles to π; ``lengths`` (N,) are ‖π‖.
    """

    radial: Array
    normal: Array
    turn: Array
    lengths: Array


class Beliefs(NamedTuple):
    """What is thought of each sample: ``shares`` (N, K + 1) are the probabilities of each spread, free first.

    ``tangential`` (N,) is the precision along the surface of those that are neither free nor anywhere, and
    ``likelihood`` (N,) the logarithm of each sample's density.
    """

    shares: Array
    tangential: Array
    likelihood: Array

    @property
    def free(self) -> Array:
        """Probability that each sample was free, (N,)."""
        return self.shares[:, 0]


def distances(actions: Array, policy: Array) -> Distances:
    """Where the actions (N, d) are about the spheres of the policy's (N, d)."""
    lengths = np.linalg.norm(policy, axis=1)
    from_middle = actions - 0.5 * policy
    reach = np.linalg.norm(from_middle, axis=1)
    along = policy / (lengths + _TINY)[:, None]
    normal = 0.5 * (from_middle / (reach + _TINY)[:, None] + along)
    speed = np.linalg.norm(actions, axis=1)
    turn = actions * (lengths / (speed + _TINY))[:, None]
    turn = turn - along * (turn * along).sum(axis=1, keepdims=True)
    return Distances(reach - 0.5 * lengths, normal, turn, lengths)


def beliefs(actions: Array, policy: Array, place: Distances, variance: float, mixture: Array) -> Beliefs:
    """What each sample says about its constraint, given the policy.

    Parameters
    ----------
    actions, policy : ndarray, shape (N, d)
    place : Distances
        Of the one from the other.
    variance : float
        σ² of the noise.
    mixture : ndarray, shape (K + 1,) or (N, K + 1)
        Share of each spread, and of the uniform density, before looking.
    """
    d = actions.shape[1]
    along = np.maximum(((actions - policy) ** 2).sum(axis=1) - place.radial**2, 0.0)
    radial = -0.5 * place.radial**2 / variance - 0.5 * np.log(2.0 * np.pi * variance)
    variances = variance + np.square(SPREADS) * place.lengths[:, None] ** 2
    spread = -0.5 * along[:, None] / variances - 0.5 * (d - 1) * np.log(2.0 * np.pi * variances)
    # A sphere that noise hides has no smaller area than what noise covers, so that nothing is gained by shrinking it.
    radius = 0.25 * (place.lengths**2 + 8.0 * variance)
    area = np.log(2.0) + 0.5 * d * np.log(np.pi) - gammaln(0.5 * d) + 0.5 * (d - 1) * np.log(radius)
    joint = radial[:, None] + np.column_stack([spread, -area]) + np.log(mixture + _TINY)
    likelihood = logsumexp(joint, axis=1)
    shares = np.exp(joint - likelihood[:, None])
    return Beliefs(shares, (shares[:, 1:-1] / variances[:, 1:]).sum(axis=1), likelihood)

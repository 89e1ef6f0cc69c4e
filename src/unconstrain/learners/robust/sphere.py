"""Mixture model of the actions on the sphere of all projections of the policy, and its E-step.

By Thales' theorem every projection ``u = N π`` lies on the sphere with
diameter [0, π], whatever the constraint: u and π − u are orthogonal. A free
sample is π itself. Noise moves a sample off the surface, the constraint
determines its position on the surface.

Density of a sample given π, with d actions and noise of variance σ² in each:

    p(u | π) = N(δ; 0, σ²) Σ_k m_k D_k(t)

Here δ is the distance to the surface and t = ‖u − π‖ along it. The D_k are
normal densities in d − 1 dimensions with variance ``σ² + s_k² ‖π‖²``; the
component ``s_0 = 0`` is that of free samples. The last D is uniform on the
sphere. Mixing proportions m_k are estimated by expectation maximisation.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from ...base.arrays import Array
from .constants import ANGULAR_SPREADS

_TINY = 1e-300


class Distances(NamedTuple):
    """Residuals of samples on their spheres.

    ``radial`` (N,) is δ, ``normal`` (N, d) minus its gradient in π. On the sphere the normal is ``u / ‖π‖``: that of
    the inconsistency with samples weighted by ``‖u‖² / ‖π‖²``. ``turn`` (N, d) is the component orthogonal to π of
    the vector of length ‖π‖ along u; ``lengths`` (N,) are ‖π‖.
    """

    radial: Array
    normal: Array
    turn: Array
    lengths: Array


class Responsibilities(NamedTuple):
    """Result of the E-step: ``components`` (N, K + 1) are the responsibilities, free first and uniform last.

    ``tangential`` (N,) is the expected precision along the surface of samples that are neither free nor uniform, and
    ``log_likelihood`` (N,) that of each sample.
    """

    components: Array
    tangential: Array
    log_likelihood: Array

    @property
    def free(self) -> Array:
        """Probability that each sample was free, (N,)."""
        return self.components[:, 0]


def distances(actions: Array, policy: Array) -> Distances:
    """Residuals of the actions (N, d) on the spheres of the policy's predictions (N, d)."""
    lengths = np.sqrt(np.vecdot(policy, policy))
    from_middle = actions - 0.5 * policy
    reach = np.sqrt(np.vecdot(from_middle, from_middle))
    along = policy / (lengths + _TINY)[:, None]
    normal = 0.5 * (from_middle / (reach + _TINY)[:, None] + along)
    speed = np.sqrt(np.vecdot(actions, actions))
    turn = lengths[:, None] * (actions / (speed + _TINY)[:, None])
    turn = turn - along * np.vecdot(turn, along)[:, None]
    return Distances(reach - 0.5 * lengths, normal, turn, lengths)


def e_step(actions: Array, policy: Array, place: Distances, variance: float, mixture: Array) -> Responsibilities:
    """Responsibilities of the mixture's components for each sample, given the policy.

    Parameters
    ----------
    actions, policy : ndarray, shape (N, d)
    place : Distances
        Of actions and policy.
    variance : float
        σ² of the noise.
    mixture : ndarray, shape (K + 1,) or (N, K + 1)
        Mixing proportions: of each spread, and of the uniform component.
    """
    d = actions.shape[1]
    off = actions - policy
    along = np.maximum(np.vecdot(off, off) - place.radial**2, 0.0)
    radial = -0.5 * place.radial**2 / variance - 0.5 * np.log(2.0 * np.pi * variance)
    variances = variance + np.square(ANGULAR_SPREADS) * place.lengths[:, None] ** 2
    spread = -0.5 * along[:, None] / variances - 0.5 * (d - 1) * np.log(2.0 * np.pi * variances)
    # The area is at least what noise covers: otherwise shrinking the sphere below the noise would raise the density.
    radius = 0.25 * (place.lengths**2 + 8.0 * variance)
    area = np.log(2.0) + 0.5 * d * np.log(np.pi) - gammaln(0.5 * d) + 0.5 * (d - 1) * np.log(radius)
    joint = radial[:, None] + np.column_stack([spread, -area]) + np.log(mixture + _TINY)
    likeliest = joint.max(axis=1, keepdims=True)
    components = np.exp(joint - likeliest)
    together = components.sum(axis=1, keepdims=True)
    components /= together
    log_likelihood = (likeliest + np.log(together))[:, 0]
    return Responsibilities(components, (components[:, 1:-1] / variances[:, 1:]).sum(axis=1), log_likelihood)

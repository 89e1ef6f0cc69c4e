"""A stable method of the literature, to be measured beside: a linear parameter-varying dynamical system (LPV-DS).

N. Figueroa and A. Billard, "A physically-consistent Bayesian non-parametric mixture model for dynamical system
learning", CoRL 2018: ``f(x) = Σ γ_k(x) A_k (x − x*)`` with the posterior γ of a Gaussian mixture, and
``A_kᵀ P + P A_k < 0``, so that ``(x − x*)ᵀ P (x − x*)`` falls. It knows no constraints. As simply as can be: the
mixture is by expectation maximisation, its size by the Bayesian information criterion. As in the paper it sees where
velocities point, so that what crosses is told apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import softmax

import unconstrain as uc

from ....base.arrays import Array, require_extra

PARTS = (1, 2, 3, 4, 5, 6, 8, 10, 12)
"""Numbers of Gaussians that are tried."""


def stable(demos: Sequence[uc.Demonstration], goal: Array, rate: float) -> Callable[[Array], Array]:
    """Velocities (N, n) of states (N, n); the square root of the Lyapunov function falls by this rate at least, 1/s."""
    states, velocities, _ = uc.stack(demos)
    size, speed = (float(np.sqrt((each**2).sum(axis=1).mean())) for each in (states - goal, velocities))
    z, v, decay = (states - goal) / size, velocities / speed, rate * size / speed
    parts = _parts(z, v)
    metric = _metric(z, v)
    maps = _maps(z, v, parts(z), metric, decay)

    def policy(states: Array) -> Array:
        z = (states - goal) / size
        return speed * np.einsum("nk,kij,nj->ni", parts(z), maps, z)

    return policy


def _parts(z: Array, v: Array) -> Callable[[Array], Array]:
    """The posterior (N, K) of a mixture that was fitted to places and ways, of places alone."""
    from sklearn.mixture import GaussianMixture

    ways = v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 0.05)
    seen = np.column_stack([z, ways])
    fits = [GaussianMixture(k, reg_covar=1e-3, random_state=0).fit(seen) for k in PARTS]
    best: Any = min(fits, key=lambda fit: fit.bic(seen))
    n = z.shape[1]
    means, roots = best.means_[:, :n], np.linalg.cholesky(np.linalg.inv(best.covariances_[:, :n, :n]))
    sizes = np.log(best.weights_) + np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(axis=1)

    def posterior(z: Array) -> Array:
        off = np.einsum("nki,kij->nkj", z[:, None] - means, roots)
        return np.asarray(softmax(sizes - 0.5 * (off**2).sum(axis=2), axis=1))

    return posterior


def _metric(z: Array, v: Array) -> Array:
    """P (n, n) of trace n: velocities lead up its quadratic form as little as can be, by their angle to its slope."""
    n = z.shape[1]
    moving = np.linalg.norm(v, axis=1) > 0.05
    ways, lower = v[moving] / np.linalg.norm(v[moving], axis=1, keepdims=True), np.tril_indices(n)

    def metric(entries: Array) -> Array:
        root = np.zeros((n, n))
        root[lower] = entries
        form = root @ root.T + 1e-3 * np.eye(n)
        return n * form / np.trace(form)

    def climb(entries: Array) -> float:
        slope = z[moving] @ metric(entries)
        slope /= np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
        return float((np.maximum(np.vecdot(slope, ways), 0.0) ** 2).mean())

    begun = [np.eye(n)[lower], *np.random.default_rng(0).standard_normal((8, len(lower[0])))]
    return metric(min((minimize(climb, each) for each in begun), key=lambda found: found.fun).x)


def _maps(z: Array, v: Array, shares: Array, metric: Array, decay: float) -> Array:
    """A_k (K, n, n) of least squared error, by a semidefinite program."""
    cvxpy = require_extra("cvxpy", "certify")
    n, count = z.shape[1], shares.shape[1]
    maps = [cvxpy.Variable((n, n)) for _ in range(count)]
    design = (shares[:, :, None] * z[:, None]).reshape(len(z), count * n)
    missed = design @ cvxpy.vstack([each.T for each in maps]) - v
    falls = [metric @ each + each.T @ metric << -2.0 * decay * metric for each in maps]
    cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(missed)), falls).solve(solver="CLARABEL")
    return np.stack([each.value for each in maps])

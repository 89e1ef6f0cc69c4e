"""Belief about a policy that was learnt: noise, free samples, and how far the truth may be from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg
from scipy.special import ndtri, stdtrit

from ...base.arrays import Array
from ...base.display import counted_off
from ...models import Model
from ...risks import SECONDARY_NOISE, Quadratic, eigensystem, unvec, vec
from ...training import Samples
from ..solution import Belief, Solution
from .candidate import Candidate
from .constants import (
    JACKKNIFE_IN_INTERVALS,
    LEAST_EXPLAINED,
    LEAST_MISFIT,
    LEAST_SMOOTH_MISFIT,
    LEFT_OUT,
    LITTLE_OPEN,
    MOST_BEYOND_SHOWN,
    UNSEEN_SPREAD,
)
from .evidence import Evidence, shown, surely
from .likelihood import free_probability, mixture_of
from .noise import hides_sphere, most_noise
from .pivot import pointing
from .posterior import Posterior, unit_information
from .smoothness import Smoothness


def solution(
    chosen: Candidate, samples: Samples, everything: Samples, model: Model, second: Quadratic | None = None, **more: Any
) -> Solution:
    """The solution of a candidate, with a belief.

    Parameters
    ----------
    chosen : Candidate
    samples, everything : Samples
        Those of positive weight, and all.
    model : Model
    second : Quadratic, optional
        What is minimised in the directions that are not determined; by default weights are the candidate's.
    **more
        Further fields of the belief.
    """
    policy = samples.predict(chosen.weights)
    variance, mixture = mixture_of(samples, policy)
    free = free_probability(everything, everything.predict(chosen.weights), variance, mixture)
    evidence = shown(samples, policy, variance, free[everything.counts > 0.0], chosen.by_segments)
    priors = _Priors(samples, evidence.seen, chosen.smoothness)
    models = counted_off(range(len(chosen.weights)), "uncertainty: local model")
    away = pointing(samples)
    says = not more.get("held_out_score", np.nan) < LEAST_EXPLAINED
    told = [_Told(chosen, evidence, priors, samples, away[m], m, says) for m in models]
    belief = Belief(
        noise=float(np.sqrt(variance)),
        misfit=float(np.sqrt(_misfit(samples, variance))),
        free_share=np.nan,
        free=free,
        from_noise=np.stack([one.from_noise for one in told]),
        undetermined=np.stack([one.undetermined for one in told]),
        **more,
    )
    count, d, p = chosen.weights.shape
    return Solution(
        chosen.weights if second is None else _followed(chosen.weights, second, [one.open for one in told]),
        np.array([one.determined for one in told], dtype=np.intp),
        d * p,
        np.zeros(count),
        method=chosen.name,
        belief=_as_free_as_known(belief, everything, model, np.stack([one.together for one in told])),
    )


def weak_prior(samples: Samples) -> Quadratic:
    """Unit information of p samples, their residual along each coordinate as large as the whole action."""
    risk = samples.risk(samples.actions, np.full(len(samples), 1.0 / max(samples.energy, 1e-300)))
    return unit_information(samples.regressors, samples.sizes) * risk


def _followed(weights: Array, second: Quadratic, open_: Sequence[Array]) -> Array:
    """Weights (M, d, p) changed within the columns of M matrices (P, K) only, to where the second objective is least.

    Minimised in coordinates of the open directions: the others are equal to rounding.
    """
    flat, left = vec(weights), second.linear - np.einsum("mij,mj->mi", second.hessian, vec(weights))
    moved = [
        basis @ np.linalg.pinv(basis.T @ hessian @ basis, SECONDARY_NOISE, hermitian=True) @ (basis.T @ rest)
        for basis, hessian, rest in zip(open_, second.hessian, left, strict=True)
    ]
    return unvec(flat + np.stack(moved), weights.shape[1])


class _Priors:
    """Weak priors of each model: coordinates in which a precision is one, and the precision in them.

    The second is smaller along directions of action space in which nobody ever moved, and larger by smoothness along
    the others.
    """

    def __init__(self, samples: Samples, seen: Array, smoothness: Smoothness) -> None:
        weak = weak_prior(samples)
        precision = Posterior(weak, weak).floored_prior()
        values, axes = eigensystem(precision)
        size = np.sqrt(np.maximum(values, 1e-300))[:, None, :]
        self.axes, self.back = axes / size, (axes * size).swapaxes(1, 2)
        d, p = samples.actions.shape[1], samples.regressors
        looser = seen + (np.eye(d) - seen) / UNSEEN_SPREAD**2
        smooth = _along(smoothness.prior().hessian, seen, p)  # symmetric: that of the roughness is gram ⊗ I
        self.precision = self.axes.swapaxes(1, 2) @ (_along(precision, looser, p) + smooth) @ self.axes


def _along(matrices: Array, of_actions: Array, p: int) -> Array:
    """Matrices (M, P, P) times ``I ⊗ A`` with matrices A (M, d, d) of action space."""
    models, size, d = len(matrices), matrices.shape[1], of_actions.shape[1]
    blocks = matrices.reshape(models, size * p, d) @ of_actions
    return np.asarray(blocks.reshape(models, size, size))


class _Told:
    """What is known of one model's weights: in coordinates in which the weak prior's precision is one.

    Nothing is, where the policy does not say (``says``) how those move that were held out.
    """

    def __init__(
        self, chosen: Candidate, evidence: Evidence, priors: _Priors, samples: Samples, away: Array, m: int, says: bool
    ) -> None:
        self._axes, self._back = priors.axes[m], priors.back[m]
        scale = max(samples.energy, 1e-300) * samples.sizes[m] / samples.regressors  # of Σ w φφᵀ ⊗ I
        self._least = 1.0 + float(evidence.error[m]) * scale
        parts = self._whitened(evidence.hessians[:, m])
        claimed = self._whitened(chosen.posterior.evidence.hessian[m])
        self._known = says * _restricted(claimed, parts.sum(axis=0), surely(parts, self._least))
        shares, directions = np.linalg.eigh(self._known)
        self.determined = max(int((shares > 1.0).sum()) - away.shape[1], 0)
        self.open = np.hstack([self._axes @ directions[:, shares <= 1.0], away])
        prior = priors.precision[m]
        self._both = _inverse(self._known + prior)
        noise = self._both @ self._known @ self._both
        self.from_noise = self._axes @ self._inflated(noise, chosen, samples, m) @ self._axes.T
        alone = self._whitened(sum(one.hessian[m] for one in evidence.consistent))
        values, axes = np.linalg.eigh(alone)
        off = np.hstack([self._axes @ self._disagreement(chosen, evidence, m, values, axes), away])
        both = self._both, _inverse(_restricted(claimed, alone, axes[:, values > self._least]) + prior)
        self.undetermined, self.together = (self._axes @ (b @ prior @ b) @ self._axes.T + off @ off.T for b in both)

    def _whitened(self, matrices: Array) -> Array:
        return np.asarray(self._axes.T @ matrices @ self._axes)

    def _inflated(self, noise: Array, chosen: Candidate, samples: Samples, m: int) -> Array:
        """Covariance from noise, and from how far weights differ that were learnt without a fold each (jackknife)."""
        if len(chosen.refits) <= LEFT_OUT:
            return noise
        weights, count = vec(chosen.refits)[:, m], len(chosen.refits)
        apart = np.sqrt(JACKKNIFE_IN_INTERVALS * (count - 1) / count) * (weights - weights.mean(axis=0)).T
        apart = self._both @ self._known @ self._back @ apart
        ratio = _ratio(self._axes @ apart, self._axes @ noise @ self._axes.T, samples, m)
        wide = (stdtrit(count - 1, 0.975) / ndtri(0.975)) ** 2
        return np.asarray(0.5 * wide * (max(1.0, ratio) * noise + apart @ apart.T))

    def _disagreement(self, chosen: Candidate, evidence: Evidence, m: int, values: Array, axes: Array) -> Array:
        """Steps (P, P), as columns, from the chosen weights to the most consistent ones, beyond chance.

        Along each eigenvector of the information, by a t-test over the parts of the data.
        """
        slopes = evidence.gradients(vec(chosen.weights))[:, m] @ self._axes
        parts = slopes @ axes
        mean, error = parts.sum(axis=0), np.sqrt(len(parts) * parts.var(axis=0, ddof=min(1, len(parts) - 1)))
        chance = stdtrit(max(len(parts) - 1, 1), 0.975) * error
        beyond = np.sqrt(np.maximum(mean**2 - chance**2, 0.0)) / (1.0 + np.maximum(values, 0.0))
        return np.asarray(axes * np.where(values > self._least, beyond, 0.0))


def _inverse(precision: Array) -> Array:
    values, vectors = np.linalg.eigh(precision)
    return np.asarray((vectors / np.maximum(values, 1e-12 * values[-1])) @ vectors.T)


def _restricted(evidence: Array, shown: Array, basis: Array) -> Array:
    """Evidence of what it says along a basis (P, S), whatever the rest of the weights, but not far more than is shown.

    A learner may know more than the actions show along themselves: it weighs them better, and uses that some are
    nearly free. Where that is most of what it knows, it is its assumption.
    """
    across = evidence @ basis
    inner = basis.T @ across
    values, axes = scipy.linalg.eigh(inner, basis.T @ shown @ basis) if basis.size else (np.zeros(0), inner)
    # With inner = T X Λ Xᵀ T and XᵀTX = 1, inner⁻¹ min(inner) inner⁻¹ = X min(Λ) / Λ² Xᵀ.
    kept = values > 1e-13 * values.max(initial=1e-140)
    safe = np.where(kept, values, 1.0)
    counted = np.where(kept, np.minimum(safe, MOST_BEYOND_SHOWN) / safe**2, 0.0)
    return np.asarray((across @ axes * counted) @ axes.T @ across.T)


def _ratio(apart: Array, noise: Array, samples: Samples, m: int) -> float:
    """Geometric mean over samples of the jackknife's variance of the prediction, over that from noise."""
    own, d = samples.features @ samples.centring[m].T, samples.actions.shape[1]
    p = own.shape[1]
    weights, found = samples.counts * samples.memberships[:, m], []
    for action in range(d):
        off = own @ apart.reshape(p, d, -1)[:, action]
        said = np.vecdot(own @ noise.reshape(p, d, p, d)[:, action, :, action], own)
        with np.errstate(divide="ignore", invalid="ignore"):
            found.append(np.log(np.vecdot(off, off)) - np.log(said))
    logs = np.mean(found, axis=0)
    fine = np.isfinite(logs) & (weights > 0)
    return float(np.exp(np.average(logs[fine], weights=weights[fine]))) if fine.any() else 1.0


def _as_free_as_known(belief: Belief, everything: Samples, model: Model, together: Array) -> Belief:
    """With no sample called free that may as well have been held, as no other shows; and what all leave together."""
    spread = belief.uncertainty(model, everything.states)
    open_, noise = (np.linalg.norm(one, axis=1) for one in (spread.undetermined, spread.from_noise))
    counts = everything.counts / everything.counts.sum()
    hidden = everything.groups.max() == 0 or hides_sphere(belief.noise**2, everything)
    of_all = replace(belief, undetermined=together).uncertainty(model, everything.states).undetermined
    little, told = (one < LITTLE_OPEN * np.sqrt(everything.energy) for one in (open_, np.linalg.norm(of_all, axis=1)))
    known, told = ((open_ < noise) | little) & (not hidden), told & (everything.groups.max() >= LEFT_OUT)
    return replace(
        belief,
        free=np.where(known, belief.free, 0.5 * belief.free)[everything.places],
        free_share=float(counts @ (belief.free * known)),
        undecided_share=float(counts @ (belief.free * ~known)),
        told_together=float(counts @ told),
        together=told[everything.places],
    )


def _misfit(samples: Samples, variance: float) -> float:
    """Variance of the misfit per coordinate: residual variance less that of the noise by differences in time."""
    floor = LEAST_MISFIT**2 * samples.energy
    smooth = variance - max(most_noise(samples), floor)
    return LEAST_SMOOTH_MISFIT**2 * samples.energy / samples.actions.shape[1] + max(smooth, 0.0)

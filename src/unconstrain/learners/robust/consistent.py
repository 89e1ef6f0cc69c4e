"""Consistency first, with the noise taken out of the sums."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from operator import add

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import (
    NOISE,
    FoldedMoments,
    Moments,
    Quadratic,
    eigensystem,
    inconsistency,
    softened_minima,
    standard_risk,
    total,
    unvec,
    vec,
)
from ...training import Samples
from ..hybrid import SOFTNESSES, chosen_softness
from ..thresholds import judged, within_errors
from .candidate import Candidate
from .noise import corrected, correlation_time, noise_by_differences
from .posterior import Posterior, unit_information
from .segments import constrained_error
from .smoothness import Smoothness
from .sphere import distances

_ROUNDS = 3
_STEPS = 6
_REFUTED = 3.0
"""Standard errors by which held-out data has to speak against the prior's softness before it counts."""

_CERTAIN = 2.0
"""Standard errors by which an eigenvalue has to be above the noise that was subtracted from it."""


def noise_corrected(samples: Samples, noise: float | None = None) -> Candidate:
    """Minimise the inconsistency on noise-corrected moments, softened as far as a prior goes.

    The noise level is the smaller of two estimates: from differences in time
    (too large where constraints change at every sample), and from the
    residuals (too large where the model does not fit). Or it is given.
    """
    parts = _Parts(samples)
    d, rough, time = samples.actions.shape[1], Smoothness.of(samples), 1.0
    most, variance = noise_by_differences(samples.actions, samples.groups), 0.0 if noise is None else noise**2
    for _ in range(_ROUNDS):
        used = variance
        whole = parts.corrected(used)
        softness, smoothness, unit = whole.balanced(rough, time)
        policy = samples.predict(whole.posterior(softness, smoothness.prior(unit)).weights(d))
        time = correlation_time(_residuals(samples, policy, used)[:, None], samples.groups)
        if noise is None:
            variance = min(most, _mean(samples, distances(samples.actions, policy).radial ** 2))
    smooth, proposed = smoothness.prior(unit), float(np.median(softness))
    softnesses = (proposed, *SOFTNESSES)
    held_out, missed = parts.held_out(softnesses, smooth, used)
    chosen, best = _not_refuted(missed, np.log(np.array(softnesses) / proposed)), int(missed.mean(axis=0).argmin())
    posterior = Posterior(whole.consistent, softnesses[chosen] * whole.risk + smooth)
    weights = posterior.weights(d)
    of_noise, residual = whole.noise(weights), whole.residual(weights)
    together = time * of_noise + _repeats(time, samples) * (residual - of_noise)
    smoothness = replace(smoothness, precision=smoothness.precision * unit / np.maximum(together, 1e-300))
    return Candidate(
        "noise-corrected", weights, _per(posterior, together), held_out[chosen], variance, smoothness, held_out[best]
    )


def _residuals(samples: Samples, policy: Array, variance: float) -> Array:
    """ρ of each sample."""
    missed = (samples.actions * (samples.actions - policy)).sum(axis=1)
    return np.asarray(missed - samples.actions.shape[1] * variance)


def _not_refuted(missed: Array, away: Array) -> int:
    """The candidate least far ``away`` (K,) from the proposal that the held-out loss (R, K) does not speak against.

    It does where the loss is above the best by so many standard errors of the difference, round by round.
    """
    near = within_errors(missed, _REFUTED)
    return int(near[np.abs(away[near]).argmin()])


def softened(samples: Samples, folds: FoldedMoments) -> Candidate:
    """:class:`~unconstrain.Hybrid` with ``alpha="auto"``."""
    whole, d = folds.whole, samples.actions.shape[1]
    softness = chosen_softness(folds)

    def posterior(moments: Moments) -> Posterior:
        return Posterior(inconsistency(moments), softness * standard_risk(moments))

    weights = posterior(whole).weights(d)
    held_out = np.empty_like(samples.actions)
    for fold, part in enumerate(folds.parts):
        rest = total([one for one in folds.parts if one is not part])
        rows = samples.folds == fold
        held_out[rows] = samples[rows].predict(posterior(rest).weights(d))
    radial = distances(samples.actions, samples.predict(weights)).radial
    sizes = np.maximum(whole.weight, np.finfo(float).tiny)
    residual = np.maximum(judged(inconsistency(whole), vec(weights)), 1e-12 * whole.energy) / sizes
    repeats = _repeats(correlation_time(radial[:, None], samples.groups), samples)
    return Candidate(
        "hybrid",
        weights,
        _per(posterior(whole), repeats * residual),
        held_out,
        _mean(samples, radial**2),
        Smoothness.of(samples),
        held_out,
    )


def by_segments(samples: Samples, labels: NDArray[np.intp], noise: float) -> Candidate:
    """Minimise the constrained error with the projection of each segment, and the standard risk as far as a prior goes.

    Segments are held out by fold; a projection is always from all of its segment.
    """
    d, ones = samples.actions.shape[1], np.ones(len(samples))
    parts = [samples.folds == fold for fold in range(int(samples.folds.max()) + 1)]
    errors = [constrained_error(samples[rows], labels[rows], noise) for rows in parts]
    risks = [samples[rows].risk(samples.actions[rows], ones[rows]) for rows in parts]
    sizes = samples.sizes
    worth = unit_information(d * samples.features.shape[1], sizes)

    def posterior(of: list[int], softness: Array) -> Posterior:
        error, risk = (reduce(add, (one[i] for i in of)) for one in (errors, risks))
        return Posterior(error, softness * risk)

    everything, softness = list(range(len(parts))), np.full(len(sizes), 1e-2)
    for _ in range(_STEPS):
        whole = posterior(everything, softness)
        weights = vec(whole.weights(d))
        missed, taken = judged(whole.evidence, weights), judged(reduce(add, risks), weights)
        softness = np.clip(worth * missed / np.maximum(taken - missed, 1e-3 * taken + 1e-300), 1e-8, 1.0)
    found = posterior(everything, softness)
    held_out = np.empty_like(samples.actions)
    for fold, rows in enumerate(parts):
        rest = [i for i in everything if i != fold] or everything
        held_out[rows] = samples[rows].predict(posterior(rest, softness).weights(d))
    best = found.weights(d)
    radial = distances(samples.actions, samples.predict(best)).radial
    residual = np.maximum(missed, 1e-12 * reduce(add, risks).constant) / np.maximum(sizes, 1e-300)
    time = correlation_time(radial[:, None], samples.groups)
    return Candidate(
        "segments",
        best,
        _per(found, time * residual),
        held_out,
        _mean(samples, radial**2),
        Smoothness.of(samples),
        held_out,
    )


class _Parts:
    """Samples and moments of each fold, to be corrected together, or all but one."""

    def __init__(self, samples: Samples) -> None:
        self._samples, self._parts = samples, samples.by_fold()
        self._weighted = [part.moments(part.actions, (part.actions**2).sum(axis=1)) for part in self._parts]
        self._plain = [part.moments(part.actions, np.ones(len(part))) for part in self._parts]

    def corrected(self, variance: float, without: int | None = None) -> _Corrected:
        """Of everything, or without one fold."""
        kept = [fold for fold in range(len(self._parts)) if fold != without] or [0]
        weighted, plain = (total(moments[fold] for fold in kept) for moments in (self._weighted, self._plain))
        return _Corrected(weighted, plain, variance, self._samples.sizes)

    def held_out(self, softnesses: Sequence[float], smooth: Quadratic, variance: float) -> tuple[Array, Array]:
        """Predictions (K, N, d) by what the other folds say, softened so, and mean square of ρ in each fold (R, K)."""
        predictions = np.empty((len(softnesses), *self._samples.actions.shape))
        missed = np.empty((len(self._parts), len(softnesses)))
        for fold, part in enumerate(self._parts):
            rest = self.corrected(variance, without=fold)
            found = softened_minima(rest.consistent + smooth, rest.risk, softnesses)
            for k in range(len(softnesses)):
                predicted = part.predict(unvec(found[..., k], part.actions.shape[1]))
                predictions[k, self._samples.folds == fold] = predicted
                missed[fold, k] = part.counts @ _residuals(part, predicted, variance) ** 2 / part.counts.sum()
        return predictions, missed


class _Corrected:
    """The two objectives of corrected moments, without what is not above the noise."""

    def __init__(self, weighted: Moments, plain: Moments, variance: float, sizes: Array) -> None:
        moments = _positive(corrected(weighted, plain, variance))
        self.sizes, self.d = sizes, plain.cross.shape[1]
        self.expected = variance * weighted.weight
        self.variance, self.plain, self.count = variance, standard_risk(plain), plain.weight
        self.risk = standard_risk(moments)
        self.consistent = _certain(inconsistency(moments), self.plain.hessian, variance, sizes)

    def posterior(self, softness: Array, smooth: Quadratic) -> Posterior:
        return Posterior(self.consistent, softness * self.risk + smooth)

    def balanced(self, smoothness: Smoothness, time: float) -> tuple[Array, Smoothness, Array]:
        """Softness, smoothness, and the variance of an independent residual, (M,), found in a few steps.

        The softness is the variance along each action over that across it, by as much as a prior counts.
        """
        worth = unit_information(self.risk.linear.shape[1], self.sizes)
        softness, unit = np.full(len(worth), 1e-2), np.zeros(len(worth))
        for _ in range(_STEPS):
            posterior = self.posterior(softness, smoothness.prior(unit))
            weights = posterior.weights(self.d)
            along = judged(self.consistent, vec(weights)) + self.expected
            both = judged(self.risk, vec(weights)) + self.expected
            across = np.maximum((both - along) / max(self.d - 1, 1), 1e-3 * both)
            softness = np.clip(worth * along / np.where(across > 0, across, 1.0), 1e-8, 1.0)
            noise, residual = self.noise(weights), self.residual(weights)
            unit = time * residual
            smoothness = smoothness.updated(weights, posterior, noise / residual, unit)
        return softness, smoothness, unit

    def noise(self, weights: Array) -> Array:
        """Mean square of ρ that noise alone would leave, shape (M,)."""
        flat = vec(weights)
        squares = np.einsum("mi,mij,mj->m", flat, self.plain.hessian, flat)  # Σ ‖π‖²
        noise = self.variance * squares + 2 * self.d * self.variance**2 * self.count
        return noise / np.maximum(self.sizes, 1e-300)

    def residual(self, weights: Array) -> Array:
        """Mean square of ρ, shape (M,)."""
        missed = judged(self.consistent, vec(weights)) / np.maximum(self.sizes, 1e-300)
        least = 1e-12 * np.abs(self.consistent.constant) / np.maximum(self.sizes, 1e-300)
        return np.maximum(missed + self.noise(weights), np.maximum(least, 1e-300))


def _positive(moments: Moments) -> Moments:
    """Without those features of which noise makes up all there is: subtracting it has left less than nothing."""
    values, axes = eigensystem(moments.gram)
    if (values >= 0.0).all():
        return moments
    kept = np.where(values > NOISE * values[:, -1:], values, 0.0)
    gram = (axes * kept[:, None, :]) @ axes.swapaxes(1, 2)
    shares = (axes * (kept > 0.0)[:, None, :]) @ axes.swapaxes(1, 2)
    return replace(moments, gram=gram, cross=moments.cross @ shares)


def _certain(objective: Quadratic, gram: Array, variance: float, sizes: Array) -> Quadratic:
    """Only those directions whose eigenvalue is more than the noise's own scatter would leave."""
    eigenvalues, vectors = eigensystem(objective.hessian)
    scatter = variance * np.sqrt(2.0 / np.maximum(sizes, 1.0))[:, None] * (vectors * (gram @ vectors)).sum(axis=1)
    kept = eigenvalues > np.maximum(_CERTAIN * scatter, NOISE * eigenvalues[:, -1:])
    values = np.where(kept, eigenvalues, 0.0)
    linear = np.where(kept, np.einsum("mij,mi->mj", vectors, objective.linear), 0.0)
    return Quadratic(
        (vectors * values[:, None, :]) @ vectors.swapaxes(1, 2),
        np.einsum("mij,mj->mi", vectors, linear),
        objective.constant,
    )


def _repeats(time: float, samples: Samples) -> Array:
    """How many samples say as much as an independent one of what the model misses, shape (M,).

    That is a function of the state of about as many degrees of freedom as the model has: so many are independent,
    however many samples there are.
    """
    return np.maximum(time, samples.sizes / (samples.actions.shape[1] * samples.features.shape[1]))


def _per(posterior: Posterior, variance: Array) -> Posterior:
    """The same in units of a variance, shape (M,)."""
    by = 1.0 / np.maximum(variance, 1e-300)
    return Posterior(by * posterior.evidence, by * posterior.prior)


def _mean(samples: Samples, values: Array) -> float:
    return float(samples.counts @ values / samples.counts.sum())

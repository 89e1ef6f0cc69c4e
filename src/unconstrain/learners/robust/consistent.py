"""Candidates that minimise an error of consistency: noise-corrected, and by segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import NamedTuple

import numpy as np

from ...base.arrays import Array
from ...base.display import counted_off
from ...risks import NOISE, Moments, Quadratic, eigensystem, inconsistency, softened_minima, standard_risk, unvec, vec
from ...training import Samples
from ..hybrid import SOFTNESSES
from ..thresholds import judged, within_errors
from .agreement import where_agreed
from .candidate import Candidate, scaled
from .constants import (
    BALANCE_STEPS,
    EIGENVALUE_STANDARD_ERRORS,
    FIRST_SOFTNESS,
    MOST_OF_LEAST,
    NOISE_ROUNDS,
    SOFTNESS_RANGE,
    SOFTNESS_STANDARD_ERRORS,
)
from .noise import consistency_residuals, corrected, correlation_time, inefficiency, most_noise
from .posterior import Posterior, unit_information
from .smoothness import Smoothness
from .sphere import distances


def noise_corrected(samples: Samples, noise: float | None = None, worth: float | None = None) -> Candidate:
    """Minimise the inconsistency on noise-corrected moments, with a prior of standard risk and smoothness.

    The prior of the standard risk has the information of ``worth`` samples, by default one for each weight. The noise
    variance is given, or else the smaller of two estimates, both
    biased upwards: from differences in time (where constraints change at
    every sample) and from the residuals (where the model does not fit).
    """
    parts = _Folds(samples)
    d, rough, time = samples.actions.shape[1], Smoothness.of(samples), 1.0
    most, variance = most_noise(samples), 0.0 if noise is None else noise**2
    for _ in range(NOISE_ROUNDS):
        used = variance
        whole = parts.corrected(used)
        softness, smoothness, unit = whole.balanced(rough, time, worth)
        policy = samples.predict(whole.posterior(softness, smoothness.prior(unit)).weights(d))
        time = correlation_time(consistency_residuals(samples, policy, used)[:, None], samples.groups)
        if noise is None:
            variance = min(most, samples.mean(distances(samples.actions, policy).radial ** 2))
    smooth, proposed = smoothness.prior(unit), float(np.median(softness))
    softnesses = (proposed, *SOFTNESSES)
    held_out, loss, refits = parts.held_out(softnesses, smooth, used)
    chosen = _nearest(loss, np.log(np.array(softnesses) / proposed))
    posterior = Posterior(whole.consistent, softnesses[chosen] * whole.risk + smooth)
    weights = posterior.weights(d)
    of_noise, residual = whole.noise(weights), whole.residual(weights)
    inflated = time * of_noise + inefficiency(time, samples) * (residual - of_noise)
    smoothness = replace(smoothness, precision=smoothness.precision * unit / np.maximum(inflated, 1e-300))
    return Candidate(
        "noise-corrected" if worth is None else "hard noise-corrected",
        weights,
        scaled(posterior, inflated),
        held_out[chosen],
        variance,
        smoothness,
        refits[chosen],
        softnesses[chosen] if worth is None else 0.0,
    )


def _nearest(loss: Array, distance: Array) -> int:
    """The candidate at the least ``distance`` (K,) from the proposal whose held-out loss (R, K) is not clearly larger.

    Clearly: by so many standard errors of the difference to the least, round by round.
    """
    near = within_errors(loss, SOFTNESS_STANDARD_ERRORS)
    return int(near[np.abs(distance[near]).argmin()])


def by_segments(samples: Samples, projections: Array, name: str = "segments") -> Candidate:
    """Minimise the constrained error with each sample's projection (N, d, d), with a prior of standard risk.

    Predictions are cross-validated by fold, except for the projections: each is from all samples of its segment.
    """
    errors = [part.constrained(projections[samples.folds == fold]) for fold, part in enumerate(samples.by_fold())]
    found = replace(least_error(name, samples, errors), by_segments=True)
    return where_agreed(found, samples, projections) or found


def least_error(name: str, samples: Samples, errors: Sequence[Quadratic], odds: float = 1.0) -> Candidate:
    """Minimise the sum of an error over the folds, with a prior of standard risk.

    The prior has the information of one sample, or of one for each weight where the error held out is then clearly
    less. Its softness is the error missed over the risk missed beside it, times that over the number of samples, by
    fixed-point iteration; ``odds`` is the number of coordinates beside the error over the number in it.
    """
    d = samples.actions.shape[1]
    risks = [part.risk(part.actions, np.ones(len(part))) for part in samples.by_fold()]
    parts = [_Objectives(*pair) for pair in zip(errors, risks, strict=True)]
    whole = reduce(_Objectives.plus, parts)
    balances = [whole.balanced(odds * worth, samples.sizes, d) for worth in (1.0, d * samples.regressors)]
    refits = []
    for fold in counted_off(range(len(parts)), f"{name}: fold"):
        rest = reduce(_Objectives.plus, parts[:fold] + parts[fold + 1 :] or parts)
        refits.append([rest.posterior(softness).weights(d) for softness, _ in balances])
    missed = [
        sum(judged(*pair).sum() for pair in zip(errors, map(vec, each), strict=True))
        for each in zip(*refits, strict=True)
    ]
    chosen = next((k for k, each in enumerate(missed) if each <= MOST_OF_LEAST * min(missed)), -1)
    softness, loss = balances[chosen]
    found = whole.posterior(softness)
    best, without = found.weights(d), [each[chosen] for each in refits]
    residual = np.maximum(loss, 1e-12 * whole.risk.constant) / np.maximum(samples.sizes, 1e-300)
    radial = distances(samples.actions, samples.predict(best)).radial
    time = correlation_time(radial[:, None], samples.groups)
    return Candidate(
        name,
        best,
        scaled(found, time * residual),
        samples.held_out(without),
        samples.mean(radial**2),
        Smoothness.of(samples),
        np.stack(without),
        0.0 if chosen == 0 else float(np.median(softness)),
    )


class _Objectives(NamedTuple):
    """An error of some folds, and their standard risk."""

    error: Quadratic
    risk: Quadratic

    def plus(self, other: _Objectives) -> _Objectives:
        return _Objectives(self.error + other.error, self.risk + other.risk)

    def posterior(self, softness: Array) -> Posterior:
        return Posterior(self.error, softness * self.risk)

    def balanced(self, worth: float, sizes: Array, d: int) -> tuple[Array, Array]:
        """Softness (M,) of a prior with the information of ``worth`` samples, and the error missed with it, (M,)."""
        factor, softness = unit_information(worth, sizes), np.full(len(sizes), FIRST_SOFTNESS)
        for _ in range(BALANCE_STEPS):
            weights = vec(self.posterior(softness).weights(d))
            loss, taken = judged(self.error, weights), judged(self.risk, weights)
            softness = np.clip(factor * loss / np.maximum(taken - loss, 1e-3 * taken + 1e-300), *SOFTNESS_RANGE)
        return softness, loss


class _Folds:
    """Samples and moments of each fold, for the noise correction of the whole and of all folds but one."""

    def __init__(self, samples: Samples) -> None:
        self._samples, self._parts = samples, samples.by_fold()
        self._weighted = [part.moments(part.actions, (part.actions**2).sum(axis=1)) for part in self._parts]
        self._plain = samples.moments_by_fold

    def corrected(self, variance: float, without: int | None = None) -> _Corrected:
        """Noise-corrected objectives of the whole, or without one fold."""
        kept = [fold for fold in range(len(self._parts)) if fold != without] or [0]
        weighted, plain = (Moments.total(moments[fold] for fold in kept) for moments in (self._weighted, self._plain))
        return _Corrected(weighted, plain, variance, self._samples.sizes)

    def held_out(self, softnesses: Sequence[float], smooth: Quadratic, variance: float) -> tuple[Array, Array, Array]:
        """For K softnesses, cross-validated predictions (K, N, d); by R folds, mean square of ρ (R, K), and weights."""
        samples, refits = self._samples, []
        for fold in counted_off(range(len(self._parts)), "noise correction: fold"):
            rest = self.corrected(variance, without=fold)
            found = softened_minima(rest.consistent + smooth, rest.risk, softnesses)
            refits.append(unvec(np.moveaxis(found, -1, 0), samples.actions.shape[1]))
        predictions, sizes = samples.held_out(np.stack(refits)), np.bincount(samples.folds, samples.counts)
        squares = [samples.counts * consistency_residuals(samples, each, variance) ** 2 for each in predictions]
        loss = np.column_stack([np.bincount(samples.folds, each) / sizes for each in squares])
        return predictions, loss, np.stack(refits, axis=1)


class _Corrected:
    """The two objectives of noise-corrected moments, truncated to what exceeds the noise."""

    def __init__(self, weighted: Moments, plain: Moments, variance: float, sizes: Array) -> None:
        moments = _positive_gram(corrected(weighted, plain, variance))
        self.sizes, self.d = sizes, plain.cross.shape[1]
        self.expected = variance * weighted.weight
        self.variance, self.plain, self.count = variance, standard_risk(plain), plain.weight
        self.risk = standard_risk(moments)
        self.consistent = _truncated(inconsistency(moments), self.plain.hessian, variance, sizes)

    def posterior(self, softness: Array, smooth: Quadratic) -> Posterior:
        return Posterior(self.consistent, softness * self.risk + smooth)

    def balanced(
        self, smoothness: Smoothness, time: float, worth: float | None = None
    ) -> tuple[Array, Smoothness, Array]:
        """Softness (M,), smoothness, and residual variance times autocorrelation time (M,), by fixed-point iteration.

        The softness is the residual variance along the action over that across it, times the unit-information factor.
        """
        factor = unit_information(self.risk.linear.shape[1] if worth is None else worth, self.sizes)
        softness, unit = np.full(len(factor), FIRST_SOFTNESS), np.zeros(len(factor))
        for _ in range(BALANCE_STEPS):
            posterior = self.posterior(softness, smoothness.prior(unit))
            weights = posterior.weights(self.d)
            along = judged(self.consistent, vec(weights)) + self.expected
            both = judged(self.risk, vec(weights)) + self.expected
            across = np.maximum((both - along) / max(self.d - 1, 1), 1e-3 * both)
            softness = np.clip(factor * along / np.where(across > 0, across, 1.0), *SOFTNESS_RANGE)
            noise, residual = self.noise(weights), self.residual(weights)
            unit = time * residual
            smoothness = smoothness.updated(weights, posterior, noise / residual, unit)
        return softness, smoothness, unit

    def noise(self, weights: Array) -> Array:
        """Variance of ρ from noise alone, shape (M,)."""
        flat = vec(weights)
        squares = np.einsum("mi,mij,mj->m", flat, self.plain.hessian, flat)  # Σ ‖π‖²
        noise = self.variance * squares + 2 * self.d * self.variance**2 * self.count
        return noise / np.maximum(self.sizes, 1e-300)

    def residual(self, weights: Array) -> Array:
        """Mean square of ρ, shape (M,)."""
        loss = judged(self.consistent, vec(weights)) / np.maximum(self.sizes, 1e-300)
        least = 1e-12 * np.abs(self.consistent.constant) / np.maximum(self.sizes, 1e-300)
        return np.maximum(loss + self.noise(weights), np.maximum(least, 1e-300))


def _positive_gram(moments: Moments) -> Moments:
    """With a positive semidefinite Gram matrix: eigenvalues that the noise correction made negative are zero."""
    values, axes = eigensystem(moments.gram)
    if (values >= 0.0).all():
        return moments
    kept = np.where(values > NOISE * values[:, -1:], values, 0.0)
    gram = (axes * kept[:, None, :]) @ axes.swapaxes(1, 2)
    shares = (axes * (kept > 0.0)[:, None, :]) @ axes.swapaxes(1, 2)
    return replace(moments, gram=gram, cross=moments.cross @ shares)


def _truncated(objective: Quadratic, gram: Array, variance: float, sizes: Array) -> Quadratic:
    """With zero for eigenvalues within a few standard errors of the noise that was subtracted from them."""
    eigenvalues, vectors = eigensystem(objective.hessian)
    error = variance * np.sqrt(2.0 / np.maximum(sizes, 1.0))[:, None] * (vectors * (gram @ vectors)).sum(axis=1)
    kept = eigenvalues > np.maximum(EIGENVALUE_STANDARD_ERRORS * error, NOISE * eigenvalues[:, -1:])
    values = np.where(kept, eigenvalues, 0.0)
    linear = np.where(kept, np.einsum("mij,mi->mj", vectors, objective.linear), 0.0)
    return Quadratic(
        (vectors * values[:, None, :]) @ vectors.swapaxes(1, 2),
        np.einsum("mij,mj->mi", vectors, linear),
        objective.constant,
    )

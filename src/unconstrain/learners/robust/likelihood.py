"""Maximum a posteriori policy under the mixture model of :mod:`.sphere`, by expectation maximisation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce
from operator import add
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.display import counted_off
from ...risks import inconsistency
from ...training import Samples
from .candidate import Candidate
from .constants import (
    ANGULAR_SPREADS,
    EM_LEAST_STEPS,
    EM_TOLERANCE,
    LEAST_MISFIT,
    POOLED_PSEUDO_COUNT,
    RACE_STEPS,
    REFIT_STEPS,
)
from .noise import correlation_time, most_noise
from .posterior import Posterior, unit_information
from .smoothness import Smoothness
from .sphere import Distances, Responsibilities, distances, e_step


def maximise(
    samples: Samples, starts: Sequence[Array], smoothness: Smoothness, steps: int, most: int
) -> tuple[Candidate, Array]:
    """Expectation maximisation from several starts.

    Parameters
    ----------
    samples : Samples
    starts : sequence of ndarray, shape (M, d, p)
        A later start goes on in place of an earlier one if after some steps its log-likelihood is higher by more than
        one standard error over the folds.
    smoothness : Smoothness
        Initial smoothness prior.
    steps : int
        Most steps from each start.
    most : int
        More samples than these are thinned to every second, third, ...; the last step uses all.

    Returns
    -------
    candidate : Candidate
    mixture : ndarray, shape (K + 1,)
        Mixing proportions: of each spread, and of the uniform component.
    """
    thinned, noise = samples[:: -(-len(samples) // most)], most_noise(samples)
    first = min(steps, RACE_STEPS)
    optima = [_maximise_from(thinned, _start(thinned, start, smoothness), first, noise) for start in starts]
    best = optima[0]
    for optimum in optima[1:]:
        if exceeds_error(thinned, optimum.log_likelihood - best.log_likelihood):
            best = optimum
    best = _maximise_from(thinned, best, steps - first, noise) if steps > first else best
    model = _GaussNewton(samples, samples.predict(best.weights), best.variance, best.mixture, best.smoothness)
    whole = model.posterior()
    weights, refits = whole.weights(samples.actions.shape[1]), []
    for fold, start in enumerate(_without_each_fold(thinned, best)):
        rest = thinned[thinned.folds != fold]
        moving = len(rest) and rest.energy > 0.0
        refits.append(_maximise_from(rest, start, REFIT_STEPS, noise).weights if moving else weights)
    held_out = samples.held_out(refits)
    found = Candidate("likelihood", weights, whole, held_out, best.variance, best.smoothness, np.stack(refits))
    return found, best.mixture


def _without_each_fold(samples: Samples, best: _Optimum) -> Iterator[_Optimum]:
    """One step from the optimum of all without each fold, from sums that all folds share."""
    model = _GaussNewton(samples, samples.predict(best.weights), best.variance, best.mixture, best.smoothness)
    parts = [model.posterior(samples.folds == fold) for fold in range(int(samples.folds.max()) + 1)]
    for fold in counted_off(range(len(parts)), "likelihood: fold"):
        rest = reduce(add, (part for other, part in enumerate(parts) if other != fold or len(parts) == 1))
        yield best._replace(weights=rest.weights(samples.actions.shape[1]))


def mixture_of(samples: Samples, policy: Array, steps: int = 20) -> tuple[float, Array]:
    """Noise variance and mixing proportions of maximum likelihood, at a policy's fixed predictions (N, d)."""
    variance, mixture = _initial(samples, policy)
    place = distances(samples.actions, policy)
    for _ in range(steps):
        found = e_step(samples.actions, policy, place, variance, mixture)
        residual, mixture = _m_step(samples, policy, place, found)
        variance = _floored(samples, residual)
    return variance, mixture


def free_probability(samples: Samples, policy: Array, variance: float, mixture: Array) -> Array:
    """Posterior probability that each sample was free, with a mixture for each demonstration, shape (N,).

    A demonstration's mixing proportions have a Dirichlet prior around the pooled ones. Spreads below the noise are
    indistinguishable from free, and count as free.
    """
    place = distances(samples.actions, policy)
    count = int(samples.groups.max()) + 1
    own = np.tile(mixture, (count, 1))
    size = np.bincount(samples.groups, samples.counts, count)[:, None]
    for _ in range(EM_LEAST_STEPS):
        components = e_step(samples.actions, policy, place, variance, own[samples.groups]).components
        seen = np.stack([np.bincount(samples.groups, samples.counts * one, count) for one in components.T], axis=1)
        own = (seen + POOLED_PSEUDO_COUNT * mixture) / (size + POOLED_PSEUDO_COUNT)
    hidden = np.array(ANGULAR_SPREADS) * place.lengths[:, None] < np.sqrt(variance)
    return np.asarray((components[:, :-1] * hidden).sum(axis=1))


def _initial(samples: Samples, policy: Array) -> tuple[float, Array]:
    """Noise variance from the median of δ², which is 0.455 σ² (χ² of one degree of freedom), and an even mixture."""
    radial = distances(samples.actions, policy).radial
    count = len(ANGULAR_SPREADS) + 1
    return _floored(samples, float(np.median(radial**2)) / 0.455), np.full(count, 1.0 / count)


def _floored(samples: Samples, variance: float) -> float:
    """Residual variance, at least that of the least misfit."""
    return max(variance, LEAST_MISFIT**2 * samples.energy)


def _m_step(samples: Samples, policy: Array, place: Distances, found: Responsibilities) -> tuple[float, Array]:
    """Residual variance and mixing proportions, given the responsibilities."""
    counts, free, d = samples.counts, found.free, samples.actions.shape[1]
    off = samples.actions - policy
    squares = (1.0 - free) * place.radial**2 + free * np.vecdot(off, off)
    return float(counts @ squares / (counts @ (1.0 - free + d * free))), counts @ found.components / counts.sum()


class _Optimum(NamedTuple):
    """Where expectation maximisation ended; ``log_likelihood`` (N,) is that of each sample."""

    weights: Array
    variance: float
    mixture: Array
    smoothness: Smoothness
    log_likelihood: Array


def _start(samples: Samples, weights: Array, smoothness: Smoothness) -> _Optimum:
    return _Optimum(weights, *_initial(samples, samples.predict(weights)), smoothness, np.full(len(samples), -np.inf))


def _maximise_from(samples: Samples, start: _Optimum, steps: int, noise: float) -> _Optimum:
    """Expectation maximisation from some weights; ``noise`` is the variance estimated by differences in time."""
    weights, variance, mixture, smoothness, _ = start
    policy, last = samples.predict(weights), -np.inf
    for step in range(steps):
        model = _GaussNewton(samples, policy, variance, mixture, smoothness)
        residual, mixture = _m_step(samples, policy, model.place, model.found)
        variance = _floored(samples, residual)
        mean = float(samples.counts @ model.found.log_likelihood / samples.counts.sum())
        posterior = model.posterior(variance=variance)
        weights = posterior.weights(samples.actions.shape[1])
        smoothness = smoothness.updated(weights, posterior, min(1.0, noise / variance, residual / variance))
        policy = samples.predict(weights)
        if step >= EM_LEAST_STEPS and abs(mean - last) < EM_TOLERANCE * samples.actions.shape[1]:
            break
        last = mean
    return _Optimum(weights, variance, mixture, smoothness, model.found.log_likelihood)


def exceeds_error(samples: Samples, gain: Array) -> bool:
    """Whether the mean gain over the folds exceeds its standard error, so that no single demonstration decides."""
    size = np.bincount(samples.folds, samples.counts)
    by_fold = np.bincount(samples.folds, samples.counts * gain)[size > 0] / size.mean()
    return len(by_fold) > 1 and bool(by_fold.mean() > by_fold.std(ddof=1) / np.sqrt(len(by_fold)))


class _GaussNewton:
    """Quadratic approximation of the expected log-posterior about a policy (Gauss–Newton), as evidence and prior."""

    def __init__(
        self, samples: Samples, policy: Array, variance: float, mixture: Array, smoothness: Smoothness
    ) -> None:
        self.samples, self.policy, self.variance = samples, policy, variance
        self.smoothness = smoothness
        self.place = distances(samples.actions, policy)
        self.found = e_step(samples.actions, policy, self.place, variance, mixture)

    def posterior(self, rows: NDArray[np.bool_] | None = None, variance: float | None = None) -> Posterior:
        """Of all samples, or of some, with the prior scaled to their share of all."""
        samples, place, found = self.samples, self.place, self.found
        noise = self.variance if variance is None else variance
        free, tangential = found.free, found.tangential
        # Residuals and constraints are autocorrelated in time, so n samples carry the information of fewer.
        along = correlation_time(place.radial[:, None], samples.groups)
        across = correlation_time(np.sqrt(tangential)[:, None] * place.turn, samples.groups)
        size = np.sqrt(np.vecdot(place.normal, place.normal))
        felt = np.maximum(size, 1e-15)  # zero actions are on all spheres, and what is left of theirs is rounding
        normal = place.normal / felt[:, None]
        target = (place.radial + np.vecdot(place.normal, self.policy)) / felt
        radial = (1.0 - free) * size**2 / (noise * along)
        at_end, turned = free / (noise * along), tangential / across
        points = turned[:, None] * (self.policy + place.turn) + at_end[:, None] * samples.actions
        points /= np.maximum(turned + at_end, 1e-300)[:, None]
        spread, factor = self._prior()
        part = slice(None) if rows is None else rows
        some = samples if rows is None else samples[rows]
        evidence = inconsistency(some.moments(target[part, None] * normal[part], radial[part]))
        evidence = evidence + some.risk(points[part], (turned + at_end)[part])
        risk = some.risk(samples.actions[part], np.full(len(some), 1.0 / (spread * along)))
        counted = float(some.counts.sum() / samples.counts.sum())
        smooth = self.smoothness.prior(counted)
        return Posterior(evidence, factor * risk + smooth)

    def _prior(self) -> tuple[float, Array]:
        """Variance per coordinate of the constrained actions about the policy, and unit-information factors (M,)."""
        samples, constrained = self.samples, self.samples.counts * (1.0 - self.found.free)
        d = samples.actions.shape[1]
        away = np.maximum(((samples.actions - self.policy) ** 2).sum(axis=1) - self.place.radial**2, 0.0)
        spread = float(constrained @ away / ((constrained.sum() + 1e-9) * (d - 1))) + self.variance
        return spread, unit_information(d * samples.regressors, samples.sizes)

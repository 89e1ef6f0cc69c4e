"""The most probable policy if each sample was free, turned a little, or anywhere on its sphere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import inconsistency
from ...training import Samples
from .candidate import Candidate
from .noise import correlation_time, noise_by_differences
from .posterior import Posterior, unit_information
from .smoothness import Smoothness
from .sphere import SPREADS, Beliefs, Distances, beliefs, distances

MISFIT = 0.015
"""No model is right to better than this share of the actions' size."""

_GAIN = 1e-4
"""Less than this in a sample's log-likelihood, for each action coordinate, is the end of a climb."""

_AT_LEAST = 6
_POOLED = 10.0
"""Samples that the data as a whole counts for, beside a demonstration's own, in how free it was."""


def maximise(
    samples: Samples, starts: Sequence[Array], smoothness: Smoothness, steps: int, most: int
) -> tuple[Candidate, Array]:
    """Expectation maximisation from several starts; the most probable end is kept.

    Parameters
    ----------
    samples : Samples
    starts : sequence of ndarray, shape (M, d, p)
        Another end than the first one's is kept only if it is clearly more probable.
    smoothness : Smoothness
        To begin with.
    steps : int
        At most so many from each.
    most : int
        Of more samples than these, every second, third, ... is climbed on; the last step is on all.

    Returns
    -------
    candidate : Candidate
    mixture : ndarray, shape (K + 1,)
        Share of each spread on the sphere, and of the uniform density.
    """
    thinned, noise = samples[:: -(-len(samples) // most)], noise_by_differences(samples.actions, samples.groups)
    ends = [_climb(thinned, start, smoothness, steps, noise) for start in starts]
    best = ends[0]
    for end in ends[1:]:
        if clearly_more(thinned, end.likelihood - best.likelihood):
            best = end
    model = _Model(samples, samples.predict(best.weights), best.variance, best.mixture, best.smoothness)
    parts = [model.posterior(samples.folds == fold) for fold in range(int(samples.folds.max()) + 1)]
    d = samples.actions.shape[1]
    whole = _sum(parts)
    held_out = np.empty_like(samples.actions)
    for fold in range(len(parts)):
        rest = _sum([part for i, part in enumerate(parts) if i != fold] or parts)
        held_out[samples.folds == fold] = samples[samples.folds == fold].predict(rest.weights(d))
    found = Candidate("likelihood", whole.weights(d), whole, held_out, best.variance, best.smoothness, held_out)
    return found, best.mixture


def settle(samples: Samples, policy: Array, steps: int = 20) -> tuple[float, Array]:
    """Noise variance and mixture that go best with a policy's predictions (N, d)."""
    variance, mixture = _begin(samples, policy)
    place = distances(samples.actions, policy)
    for _ in range(steps):
        found = beliefs(samples.actions, policy, place, variance, mixture)
        missed, mixture = _updated(samples, policy, place, found)
        variance = _trusted(samples, missed)
    return variance, mixture


def free_probability(samples: Samples, policy: Array, variance: float, mixture: Array) -> Array:
    """Probability that each sample was free, knowing that a demonstration's samples go together, shape (N,).

    Each demonstration has a share of free samples of its own, drawn towards that of all. What turned a sample by less
    than the noise does is as good as nothing, and counts as free.
    """
    place = distances(samples.actions, policy)
    count = int(samples.groups.max()) + 1
    own = np.tile(mixture, (count, 1))
    size = np.bincount(samples.groups, samples.counts, count)[:, None]
    for _ in range(_AT_LEAST):
        shares = beliefs(samples.actions, policy, place, variance, own[samples.groups]).shares
        seen = np.stack([np.bincount(samples.groups, samples.counts * one, count) for one in shares.T], axis=1)
        own = (seen + _POOLED * mixture) / (size + _POOLED)
    hidden = np.array(SPREADS) * place.lengths[:, None] < np.sqrt(variance)
    return np.asarray((shares[:, :-1] * hidden).sum(axis=1))


def _begin(samples: Samples, policy: Array) -> tuple[float, Array]:
    radial = distances(samples.actions, policy).radial
    count = len(SPREADS) + 1
    return _trusted(samples, float(np.median(radial**2)) / 0.455), np.full(count, 1.0 / count)


def _trusted(samples: Samples, variance: float) -> float:
    """Not below what no model is right to."""
    return max(variance, MISFIT**2 * samples.energy)


def _updated(samples: Samples, policy: Array, place: Distances, found: Beliefs) -> tuple[float, Array]:
    """Variance of what is missed, and mixture, given what is thought of each sample."""
    counts, free, d = samples.counts, found.free, samples.actions.shape[1]
    missed = (1.0 - free) * place.radial**2 + free * ((samples.actions - policy) ** 2).sum(axis=1)
    return float(counts @ missed / (counts @ (1.0 - free + d * free))), counts @ found.shares / counts.sum()


class _End(NamedTuple):
    """Where a climb ended: weights, σ² and mixture, how much smoothness counts, and each sample's log-likelihood."""

    weights: Array
    variance: float
    mixture: Array
    smoothness: Smoothness
    likelihood: Array


def _climb(samples: Samples, weights: Array, smoothness: Smoothness, steps: int, noise: float) -> _End:
    """One run of expectation maximisation; ``noise`` is the variance of what does not go on from sample to sample."""
    policy, last = samples.predict(weights), -np.inf
    variance, mixture = _begin(samples, policy)
    for step in range(steps):
        model = _Model(samples, policy, variance, mixture, smoothness)
        missed, mixture = _updated(samples, policy, model.place, model.found)
        variance = _trusted(samples, missed)
        likelihood = float(samples.counts @ model.found.likelihood / samples.counts.sum())
        posterior = model.posterior(variance=variance)
        weights = posterior.weights(samples.actions.shape[1])
        smoothness = smoothness.updated(weights, posterior, min(1.0, noise / variance, missed / variance))
        policy = samples.predict(weights)
        if step >= _AT_LEAST and abs(likelihood - last) < _GAIN * samples.actions.shape[1]:
            break
        last = likelihood
    return _End(weights, variance, mixture, smoothness, model.found.likelihood)


def clearly_more(samples: Samples, gain: Array) -> bool:
    """Whether the gain of each sample is above zero by a standard error: one demonstration must not decide."""
    size = np.bincount(samples.folds, samples.counts)
    by_fold = np.bincount(samples.folds, samples.counts * gain)[size > 0] / size.mean()
    return len(by_fold) > 1 and bool(by_fold.mean() > by_fold.std(ddof=1) / np.sqrt(len(by_fold)))


class _Model:
    """The quadratic that stands for the likelihood near a policy (Gauss–Newton), as evidence and prior."""

    def __init__(
        self,
        samples: Samples,
        policy: Array,
        variance: float,
        mixture: Array,
        smoothness: Smoothness,
    ) -> None:
        self.samples, self.policy, self.variance = samples, policy, variance
        self.smoothness = smoothness
        self.place = distances(samples.actions, policy)
        self.found = beliefs(samples.actions, policy, self.place, variance, mixture)

    def posterior(self, rows: NDArray[np.bool_] | None = None, variance: float | None = None) -> Posterior:
        """Of all samples, or of some, which then count as their part of all."""
        samples, place, found = self.samples, self.place, self.found
        noise = self.variance if variance is None else variance
        free, tangential = found.free, found.tangential
        # Neighbours in time say the same again: misfit and constraints go on from sample to sample.
        along = correlation_time(place.radial[:, None], samples.groups)
        across = correlation_time(np.sqrt(tangential)[:, None] * place.turn, samples.groups)
        size = np.linalg.norm(place.normal, axis=1)
        normal = place.normal / np.maximum(size, 1e-300)[:, None]
        target = (place.radial + (place.normal * self.policy).sum(axis=1)) / np.maximum(size, 1e-300)
        radial = (1.0 - free) * size**2 / (noise * along)
        held, turned = free / (noise * along), tangential / across
        points = turned[:, None] * (self.policy + place.turn) + held[:, None] * samples.actions
        points /= np.maximum(turned + held, 1e-300)[:, None]
        spread, worth = self._prior()
        part = slice(None) if rows is None else rows
        some = samples if rows is None else samples[rows]
        evidence = inconsistency(some.moments(target[part, None] * normal[part], radial[part]))
        evidence = evidence + some.risk(points[part], (turned + held)[part])
        risk = some.risk(samples.actions[part], np.full(len(some), 1.0 / (spread * along)))
        counted = float(some.counts.sum() / samples.counts.sum())
        smooth = self.smoothness.prior(counted)
        return Posterior(evidence, worth * risk + smooth)

    def _prior(self) -> tuple[float, Array]:
        """Mean square of what constraints took in each coordinate, and what the risk is worth beside it."""
        samples, held = self.samples, self.samples.counts * (1.0 - self.found.free)
        d = samples.actions.shape[1]
        away = np.maximum(((samples.actions - self.policy) ** 2).sum(axis=1) - self.place.radial**2, 0.0)
        spread = float(held @ away / ((held.sum() + 1e-9) * (d - 1))) + self.variance
        return spread, unit_information(d * samples.features.shape[1], samples.sizes)


def _sum(parts: Sequence[Posterior]) -> Posterior:
    evidence, prior = parts[0].evidence, parts[0].prior
    for part in parts[1:]:
        evidence, prior = evidence + part.evidence, prior + part.prior
    return Posterior(evidence, prior)

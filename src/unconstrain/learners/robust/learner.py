"""Learners that use the samples themselves: they estimate the noise and need no α."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from ...base.arrays import Array, check_at_least
from ...base.errors import SettingError
from ...risks import Quadratic, inconsistency, unit_actions, vec
from ...training import Samples, Training
from ..direct import Direct
from ..hybrid import Hybrid
from ..learner import Learner
from ..solution import Belief, Solution
from ..thresholds import judged
from .candidate import Candidate
from .consistent import by_segments, noise_corrected, softened
from .constants import (
    INCONSISTENCY_RATIO,
    LEAST_INFORMATIVE,
    LEAST_MISFIT,
    NEARLY_EXACT,
    NEGLIGIBLE_RESIDUAL,
    NOISE_TO_CORRECT,
    SPHERE_HIDDEN_BY_NOISE,
)
from .likelihood import free_probability, maximise, mixture_of
from .noise import noise_by_differences
from .posterior import Posterior, unit_information
from .segments import found_segments


class SampleLearner(Learner):
    """Learns from the samples, not only from their moments; its solution has a ``belief``."""

    needs_samples: ClassVar[bool] = True

    def learn(self, training: Training) -> Solution:
        """Learn from the samples; as :class:`~unconstrain.Hybrid` with one action, no motion or a single fold."""
        everything = training.samples
        samples = everything.counted
        if _trivial(samples):
            return _plain(training, samples, everything)
        chosen, more = self.candidate(samples, training)
        return _solution(chosen, samples, everything, **more)

    @abstractmethod
    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """Learn from the samples of positive weight; returns a policy and further fields of the belief."""


@dataclass(frozen=True)
class _Maximising(SampleLearner):
    """Settings of the learners that use expectation maximisation."""

    steps: int = 60
    most: int = 2000

    def __post_init__(self) -> None:
        check_at_least("steps", self.steps, 1, whole=True)
        check_at_least("most", self.most, 1, whole=True)

    def _maximised(
        self, samples: Samples, training: Training, corrected: Candidate, consistent: Candidate
    ) -> tuple[Candidate, Array]:
        """The most probable policy, from two starts: the consistent policy and direct regression."""
        starts = [consistent.weights, Direct().learn(training).weights]
        return maximise(samples, starts, corrected.smoothness, self.steps, self.most)


@dataclass(frozen=True)
class Likelihood(_Maximising):
    """Maximum a posteriori policy under a mixture of free, nearly free and uniformly constrained samples.

    The model is that of :mod:`unconstrain.learners.robust.sphere`. It supposes
    constraints that vary at random. Where they are a function of the state,
    their effect is taken for part of the policy. Needs the samples, not only
    their moments.

    Parameters
    ----------
    steps : int
        Most steps of expectation maximisation from each of two starts.
    most : int
        All steps but the last use at most so many samples, evenly thinned in time.
    """

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The most probable policy."""
        corrected, consistent = _consistent(samples, training)
        return self._maximised(samples, training, corrected, consistent)[0], {}


@dataclass(frozen=True)
class NoiseCorrected(SampleLearner):
    """Minimise the inconsistency on noise-corrected moments; see :mod:`unconstrain.learners.robust.noise`.

    Samples are weighted by ‖u‖², and the standard risk is a unit-information
    prior. Valid under noise and constraints of any kind; does not use that
    samples were free. Needs the samples, not only their moments.

    Parameters
    ----------
    noise : float, optional
        Standard deviation of the noise on each action coordinate; estimated by default.
    """

    noise: float | None = None

    def __post_init__(self) -> None:
        if self.noise is not None:
            check_at_least("noise", self.noise, 0.0)

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The consistent policy."""
        return noise_corrected(samples, self.noise), {}


@dataclass(frozen=True)
class Segments(SampleLearner):
    """Learn from segments of constant constraint; see :mod:`unconstrain.learners.robust.segments`.

    Needs the samples, not only their moments.

    Parameters
    ----------
    labels : {"found", "groups"}
        "groups": each demonstration is one segment. "found": change points within demonstrations are found from the
        actions, which must then be in the order of time.
    noise : float, optional
        Standard deviation of the noise on each action coordinate; by default from differences in time.
    """

    labels: Literal["found", "groups"] = "found"
    noise: float | None = None

    def __post_init__(self) -> None:
        if self.labels not in ("found", "groups"):
            raise SettingError(f"labels: got {self.labels!r}, expected 'found' or 'groups'.")
        if self.noise is not None:
            check_at_least("noise", self.noise, 0.0)

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The policy of least constrained error."""
        most = noise_by_differences(samples.actions, samples.groups)
        noise = self.noise if self.noise is not None else float(np.sqrt(min(most, samples.energy)))
        by_group = self.labels == "groups"
        if by_group and samples.groups.max() == 0:
            raise SettingError("labels: 'groups' needs groups=, one name for each demonstration, at least two.")
        labels = samples.groups if by_group else found_segments(samples.actions, samples.groups, noise)
        return by_segments(samples, labels, noise), {}


@dataclass(frozen=True)
class Robust(_Maximising):
    """Learn under noise and any kind of constraints, without a setting to tune.

    Learns two policies and takes one. The *consistent* policy is
    :class:`NoiseCorrected` where the residuals are noise or small, and
    :class:`~unconstrain.Hybrid` with ``alpha="auto"`` otherwise. The *most
    probable* policy is that of :class:`Likelihood`. It is taken unless noise
    hides the sphere, or nearly all samples are in the uniform component, or
    its held-out inconsistency is too far above that of noise-corrected
    moments: then the constraints do not vary at random, as it supposes.

    Needs the samples, not only their moments, and keeps them.

    Parameters
    ----------
    steps, most : int
        See :class:`Likelihood`.
    """

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The likelihood's or the consistent policy."""
        corrected, consistent = _consistent(samples, training)
        likely, mixture = self._maximised(samples, training, corrected, consistent)
        learnt = {one.name: one for one in (corrected, consistent, likely)}
        gaps = {
            name: compared(samples, one.held_out, corrected.most_consistent, corrected.variance)
            for name, one in learnt.items()
        }
        informed = 1.0 - float(mixture[-1])
        gap, error = gaps[likely.name]
        refuted = bool(gap > max(np.log(INCONSISTENCY_RATIO ** min(1.0, 2.0 * informed)), error))
        hidden = _more_than(SPHERE_HIDDEN_BY_NOISE, likely.variance, samples)
        usable = informed > LEAST_INFORMATIVE and not refuted and not hidden
        return likely if usable else consistent, {
            "compared": {name: gap for name, (gap, _) in gaps.items()},
            "refuted": refuted,
            "candidates": {name: one.weights for name, one in learnt.items()},
        }


def _consistent(samples: Samples, training: Training) -> tuple[Candidate, Candidate]:
    """The policy of noise-corrected moments, and the consistent policy: the same where residuals are noise or small.

    Elsewhere, as where a demonstrator varies, it is a softened hybrid of the softness that held-out data allows.
    """
    corrected = noise_corrected(samples)
    exact = 1.0 - _explained(samples, corrected.held_out) < NEARLY_EXACT
    noisy = _more_than(NOISE_TO_CORRECT, corrected.variance, samples)
    return corrected, corrected if noisy or exact else softened(samples, training.filled)


def compared(samples: Samples, one: Array, other: Array, variance: float) -> tuple[float, float]:
    """Logarithm of the inconsistency of ``one`` over that of ``other``: median over the folds, and standard error.

    The inconsistency is the mean square of ρ (:mod:`unconstrain.learners.robust.noise`), whose variance does not
    depend on the constraint.
    """
    actions, d = samples.actions, samples.actions.shape[1]
    counts = np.bincount(samples.folds, samples.counts)

    def loss(policy: Array) -> Array:
        residual = (actions * (actions - policy)).sum(axis=1) - d * variance
        return np.asarray(np.bincount(samples.folds, samples.counts * residual**2) / counts)

    floor = (NEGLIGIBLE_RESIDUAL * samples.energy) ** 2
    gap = np.log(loss(one) + floor) - np.log(loss(other) + floor)
    return float(np.median(gap)), float(gap.std(ddof=1) / np.sqrt(len(gap)))


def _solution(chosen: Candidate, samples: Samples, everything: Samples, **more: Any) -> Solution:
    variance, mixture = mixture_of(samples, samples.predict(chosen.weights))
    free = free_probability(everything, everything.predict(chosen.weights), variance, mixture)
    models, d, p = chosen.weights.shape
    vague = _vague_posterior(samples, chosen.posterior.evidence)
    from_noise, undetermined = vague.covariances()
    return Solution(
        chosen.weights,
        vague.determined(),
        d * p,
        np.zeros(models),
        method=chosen.name,
        belief=Belief(
            noise=float(np.sqrt(variance)),
            misfit=float(np.sqrt(_misfit(samples, variance))),
            free_share=float(everything.counts @ free / everything.counts.sum()),
            free=free[np.argsort(everything.places)],
            from_noise=from_noise,
            undetermined=undetermined + _prior_sensitivity(chosen, vague),
            held_out_score=_explained(samples, chosen.held_out),
            **more,
        ),
    )


def _vague_posterior(samples: Samples, evidence: Quadratic) -> Posterior:
    """Posterior with a weak prior: unit information of p samples, their residuals as large as the actions."""
    d, p = samples.actions.shape[1], samples.features.shape[1]
    risk = samples.risk(samples.actions, np.full(len(samples), d / max(samples.energy, 1e-300)))
    return Posterior(evidence, unit_information(p, samples.sizes) * risk)


def _prior_sensitivity(chosen: Candidate, vague: Posterior) -> Array:
    """Outer product of the change in the weights under the weak prior, (M, P, P), to be added to a covariance."""
    prior = vague.prior + chosen.smoothness.prior()
    apart = vec(chosen.weights) - vec(Posterior(vague.evidence, prior).weights(chosen.weights.shape[1]))
    return np.asarray(apart[:, :, None] * apart[:, None, :])


def _misfit(samples: Samples, variance: float) -> float:
    """Variance of the misfit per coordinate: residual variance less that of the noise by differences in time."""
    least = LEAST_MISFIT**2 * samples.energy
    smooth = variance - max(noise_by_differences(samples.actions, samples.groups), least)
    return least / samples.actions.shape[1] + max(smooth, 0.0)


def _explained(samples: Samples, policy: Array) -> float:
    """Share of the squared motion explained: one minus the inconsistency of predictions (N, d) over the energy."""
    directions, lengths = unit_actions(samples.actions)
    loss = samples.counts @ (lengths - (directions * policy).sum(axis=1)) ** 2
    return float(1.0 - loss / (samples.counts @ lengths**2))


def _trivial(samples: Samples) -> bool:
    """Whether there is one action column only, no motion, or nothing to hold out."""
    return samples.actions.shape[1] == 1 or samples.energy == 0.0 or samples.folds.max() == 0


def _plain(training: Training, samples: Samples, everything: Samples) -> Solution:
    """The hybrid's solution, with a belief from its residuals."""
    found, whole = Hybrid().learn(training), training.filled.whole
    size, d = found.directions, samples.actions.shape[1]
    residual = judged(inconsistency(whole), vec(found.weights)) / np.maximum(samples.sizes - size, 1.0)
    evidence = (1.0 / np.maximum(residual, LEAST_MISFIT**2 * samples.energy + 1e-300)) * inconsistency(whole)
    from_noise, undetermined = _vague_posterior(samples, evidence).covariances()
    return replace(
        found,
        belief=Belief(
            noise=float(np.sqrt(residual.mean())),
            misfit=LEAST_MISFIT * float(np.sqrt(samples.energy / d)),
            free_share=1.0,
            free=np.ones(len(everything)),
            from_noise=from_noise,
            undetermined=undetermined,
        ),
    )


def _more_than(share: float, variance: float, samples: Samples) -> bool:
    """Whether noise of a variance per coordinate exceeds a share of the actions."""
    return samples.actions.shape[1] * variance > share**2 * samples.energy

"""Learners that look at the samples: they need no α and hold under noise."""

from __future__ import annotations

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
from .likelihood import MISFIT, free_probability, maximise, settle
from .noise import noise_by_differences
from .posterior import Posterior, unit_information
from .segments import found_segments

NOISY = 0.015
"""Noise of more than this share of the actions' size is taken out of the sums."""

CLEAR = 0.05
"""Where less than this share of the motion is missed, held out and along the actions, a policy is next to exact."""

INFORMED = 0.1
"""Where of fewer samples than this share more is known than that they are on their spheres, nothing is added by it."""

WORSE = 1.9
"""By which factor the inconsistency of the likelihood has to be larger to refute it, if it knows half of the samples.

It fits more than the inconsistency, and may be the worse in that for it; the less else it knows, the less.
"""

NEGLIGIBLE = 0.05
"""Share of the actions' size that may be missed without counting, when policies are compared."""

HIDDEN = 0.35
"""Noise of more than this share hides the sphere: free and constrained samples look the same."""


class SampleLearner(Learner):
    """Looks at the samples, not only at their moments, and has a belief beside the weights."""

    needs_samples: ClassVar[bool] = True

    def learn(self, training: Training) -> Solution:
        """Learn from samples; where there is nothing to tell free from constrained, as the hybrid does."""
        everything = training.samples
        samples = everything.counted
        if _trivial(samples):
            return _plain(training, samples, everything)
        chosen, more = self.candidate(samples, training)
        return _solution(chosen, samples, everything, **more)

    @abstractmethod
    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """Learn from samples of some weight; also what the belief is to say of the choice."""


@dataclass(frozen=True)
class _Climbing(SampleLearner):
    """What learners have that climb to the most probable policy."""

    steps: int = 60
    most: int = 2000

    def __post_init__(self) -> None:
        check_at_least("steps", self.steps, 1, whole=True)
        check_at_least("most", self.most, 1, whole=True)

    def _climbed(
        self, samples: Samples, training: Training, corrected: Candidate, consistent: Candidate
    ) -> tuple[Candidate, Array]:
        """The most probable policy, from the consistent one and from what was observed."""
        starts = [consistent.weights, Direct().learn(training).weights]
        return maximise(samples, starts, corrected.smoothness, self.steps, self.most)


@dataclass(frozen=True)
class Likelihood(_Climbing):
    """The most probable policy, where each sample was free, turned a little, or anywhere on its sphere.

    See :mod:`unconstrain.learners.robust.sphere`. It holds where constraints vary at
    random; where they are a function of the state, what they took looks like
    part of the policy. Needs the samples, not only their moments.

    Parameters
    ----------
    steps : int
        Of expectation maximisation from each of two starts, at most.
    most : int
        Steps but the last look at no more samples than these, evenly thinned in time.
    """

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The most probable policy."""
        corrected, consistent = _consistent(samples, training)
        return self._climbed(samples, training, corrected, consistent)[0], {}


@dataclass(frozen=True)
class NoiseCorrected(SampleLearner):
    """Consistency first, on moments without the expected part of the noise; see :mod:`~.robust.noise`.

    Samples count by ‖u‖², and the standard risk beside the inconsistency by
    what a prior counts. Holds under noise, constraints of any kind, and
    knows nothing of free samples. Needs the samples, not only their moments.

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
    """Learn where each constraint stays the same for a while; see :mod:`unconstrain.learners.robust.segments`.

    Needs the samples, not only their moments.

    Parameters
    ----------
    labels : {"found", "groups"}
        "groups": each demonstration has one constant constraint. "found": constraints change on the way, and where
        they do is found from the actions, which must then be in the order of time.
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
        """The policy that is consistent with the projection of each segment."""
        most = noise_by_differences(samples.actions, samples.groups)
        noise = self.noise if self.noise is not None else float(np.sqrt(min(most, samples.energy)))
        by_group = self.labels == "groups"
        if by_group and samples.groups.max() == 0:
            raise SettingError("labels: 'groups' needs groups=, one name for each demonstration, at least two.")
        labels = samples.groups if by_group else found_segments(samples.actions, samples.groups, noise)
        return by_segments(samples, labels, noise), {}


@dataclass(frozen=True)
class Robust(_Climbing):
    """Learn under noise and in every constraint setting, with nothing to tune.

    Learns a consistent policy, on noise-corrected moments where what is
    missed is noise or next to nothing, and as :class:`~unconstrain.Hybrid`
    with ``alpha="auto"`` otherwise, and the most probable one (:class:`Likelihood`). The likelihood's is
    taken unless noise hides the sphere, or it knows no more of next to any
    sample than that it is on its sphere, or its inconsistency on samples held
    out is too far above that on noise-corrected moments: then constraints do
    not vary as it supposes.

    Needs the samples, not only their moments, and keeps those it has seen.

    Parameters
    ----------
    steps, most : int
        See :class:`Likelihood`.
    """

    def candidate(self, samples: Samples, training: Training) -> tuple[Candidate, dict[str, Any]]:
        """The likelihood's or the consistent policy."""
        corrected, consistent = _consistent(samples, training)
        likely, mixture = self._climbed(samples, training, corrected, consistent)
        learnt = {one.name: one for one in (corrected, consistent, likely)}
        gaps = {
            name: compared(samples, one.held_out, corrected.most_consistent, corrected.variance)
            for name, one in learnt.items()
        }
        informed = 1.0 - float(mixture[-1])
        refuted = _refuted(*gaps[likely.name], WORSE ** min(1.0, 2.0 * informed))
        usable = informed > INFORMED and not refuted and not _more_than(HIDDEN, likely.variance, samples)
        return likely if usable else consistent, {
            "compared": {name: gap for name, (gap, _) in gaps.items()},
            "refuted": refuted,
            "candidates": {name: one.weights for name, one in learnt.items()},
        }


def _consistent(samples: Samples, training: Training) -> tuple[Candidate, Candidate]:
    """On noise-corrected moments; and what is to be had of consistency alone: the same where noise is what is missed.

    Where it is not, as if people do not always do the same, consistency is given up as far as held-out data lets it.
    """
    corrected = noise_corrected(samples)
    exact = 1.0 - _explained(samples, corrected.held_out) < CLEAR
    noisy = _more_than(NOISY, corrected.variance, samples)
    return corrected, corrected if noisy or exact else softened(samples, training.filled)


def _refuted(gap: float, error: float, factor: float) -> bool:
    """Whether an inconsistency is larger by a factor, and by more than a standard error."""
    return bool(gap > max(np.log(factor), error))


def compared(samples: Samples, one: Array, other: Array, variance: float) -> tuple[float, float]:
    """Logarithm of the inconsistency of ``one`` over ``other``'s, median over the folds and standard error.

    The inconsistency is that of :mod:`unconstrain.learners.robust.noise`, in which
    every sample's residual has the same variance.
    """
    actions, d = samples.actions, samples.actions.shape[1]
    counts = np.bincount(samples.folds, samples.counts)

    def missed(policy: Array) -> Array:
        residual = (actions * (actions - policy)).sum(axis=1) - d * variance
        return np.asarray(np.bincount(samples.folds, samples.counts * residual**2) / counts)

    floor = (NEGLIGIBLE * samples.energy) ** 2
    gap = np.log(missed(one) + floor) - np.log(missed(other) + floor)
    return float(np.median(gap)), float(gap.std(ddof=1) / np.sqrt(len(gap)))


def _solution(chosen: Candidate, samples: Samples, everything: Samples, **more: Any) -> Solution:
    variance, mixture = settle(samples, samples.predict(chosen.weights))
    free = free_probability(everything, everything.predict(chosen.weights), variance, mixture)
    models, d, p = chosen.weights.shape
    belief = _belief(samples, chosen.posterior.evidence)
    from_noise, undetermined = belief.spreads()
    return Solution(
        chosen.weights,
        belief.determined(),
        d * p,
        np.zeros(models),
        method=chosen.name,
        belief=Belief(
            noise=float(np.sqrt(variance)),
            misfit=float(np.sqrt(_misfit(samples, variance))),
            free_share=float(everything.counts @ free / everything.counts.sum()),
            free=free[np.argsort(everything.places)],
            from_noise=from_noise,
            undetermined=undetermined + _moved(chosen, belief),
            held_out_score=_explained(samples, chosen.held_out),
            **more,
        ),
    )


def _belief(samples: Samples, evidence: Quadratic) -> Posterior:
    """Evidence beside a prior that knows the policy's size, as if each model had seen one such sample a feature."""
    d, p = samples.actions.shape[1], samples.features.shape[1]
    vague = samples.risk(samples.actions, np.full(len(samples), d / max(samples.energy, 1e-300)))
    return Posterior(evidence, unit_information(p, samples.sizes) * vague)


def _moved(chosen: Candidate, belief: Posterior) -> Array:
    """How far the weights would move under the weaker prior of the belief, as a covariance, shape (M, P, P)."""
    prior = belief.prior + chosen.smoothness.prior()
    apart = vec(chosen.weights) - vec(Posterior(belief.evidence, prior).weights(chosen.weights.shape[1]))
    return np.asarray(apart[:, :, None] * apart[:, None, :])


def _misfit(samples: Samples, variance: float) -> float:
    """Variance, per coordinate, of what the model misses: what the residuals have and differences in time have not."""
    least = MISFIT**2 * samples.energy
    smooth = variance - max(noise_by_differences(samples.actions, samples.groups), least)
    return least / samples.actions.shape[1] + max(smooth, 0.0)


def _explained(samples: Samples, policy: Array) -> float:
    directions, lengths = unit_actions(samples.actions)
    missed = samples.counts @ (lengths - (directions * policy).sum(axis=1)) ** 2
    return float(1.0 - missed / (samples.counts @ lengths**2))


def _trivial(samples: Samples) -> bool:
    """Whether there is no sphere, or nothing on it."""
    return samples.actions.shape[1] == 1 or samples.energy == 0.0 or samples.folds.max() == 0


def _plain(training: Training, samples: Samples, everything: Samples) -> Solution:
    """What the hybrid makes of it."""
    found, whole = Hybrid().learn(training), training.filled.whole
    size, d = found.directions, samples.actions.shape[1]
    missed = judged(inconsistency(whole), vec(found.weights)) / np.maximum(samples.sizes - size, 1.0)
    evidence = (1.0 / np.maximum(missed, MISFIT**2 * samples.energy + 1e-300)) * inconsistency(whole)
    from_noise, undetermined = _belief(samples, evidence).spreads()
    return replace(
        found,
        belief=Belief(
            noise=float(np.sqrt(missed.mean())),
            misfit=MISFIT * float(np.sqrt(samples.energy / d)),
            free_share=1.0,
            free=np.ones(len(everything)),
            from_noise=from_noise,
            undetermined=undetermined,
        ),
    )


def _more_than(share: float, variance: float, samples: Samples) -> bool:
    return samples.actions.shape[1] * variance > share**2 * samples.energy

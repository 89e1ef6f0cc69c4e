"""Choice of a candidate by an estimate of its error, without the truth.

The squared error of a policy has components that held-out motion shows, and
others that constraints hide. An action shows the component along itself. A
demonstration that never moved along some directions in which others moved, and
much along all the rest, was held in the same way all the time, and shows all
components along that rest. Nothing shows what is hidden, but a candidate's own
variance and bias there can be estimated:

    risk_k = (loss_k − least loss) + variance_k + bias_k

loss_k is the mean square of what held-out motion shows to be missed: the
residual ``r = ‖u‖ − ûᵀπ̃`` along the action, or ``‖N̂ (u − π̃)‖`` where N̂ is
known. Noise makes actions longer, and policies that are too long look good: r²
is ``ρ² / ‖u‖²`` without the noise's part, see :mod:`.noise`. N̂ is not known
exactly, so differences aside from the action that are less than the least
misfit do not count. Where N̂ is one line, û is along it, also of samples at
rest. Where each of few demonstrations is needed, policies by segments are
judged by :mod:`.agreement`. variance_k is the jackknife's, from the policies
learnt without each fold, and half of it where they are learnt by segments.
bias_k compares the candidate with others of less bias, j, as Goldenshluger and
Lepski do (*Annals of Statistics* 39(3), 2011):

    bias_k = max_j E ‖π̃_k − π̃_j‖² − half the variance of π̃_k − π̃_j

over those j from which it is farther than by chance, E ‖π̃_k − π̃_j‖² being more
than that variance.

Softened hybrids (eq. 6 with ``E_i + s E_2``) have the less bias the smaller
their softness s; s is infinite for direct regression, and that of their prior
for learners that minimise another error of consistency beside a prior of the
standard risk: zero if it has the information of one sample altogether. The
likelihood takes samples for free that are near to the policy. If most of these
were held in the same way all the time, as far as can be seen, nothing shows
that they were free, and it is as soft as direct regression; otherwise its
softness is zero. Whoever knows the Jacobian of the constraints has less bias
than all, and a softness of −1; it is a candidate only if it is as consistent
as the best of the others, and is compared no more.

Nobody shows k's bias whose own variance is many times the motion: where nothing
was constrained, hard hybrids follow rounding. One whose variance is many times
what k misses along the actions shows it only if it is the more consistent. One
that is less consistent than k where held out may be wrong itself, by up to a
hundred times what it misses more: it shows what is beyond that, and nothing if
it is far less consistent. And one that is more consistent by a tenth shows it
however soft both are; if it is as soft as direct regression, whose bias towards
the actions held-out actions do not show, up to ten times what k misses more.

Residuals have the variance ``‖π‖² (σ² / ‖u‖² + κ²)`` under any constraint:
noise of variance σ² turns the direction of a slow action, and people vary by
a factor of standard deviation κ. Samples are weighted by its inverse up to
‖π‖², so that the weight saturates at ``‖u‖ = σ / κ``, and by the inverse of
``1 + h`` with the leverage h of a held-out state, which is the factor of its
variance from estimating the weights: predictions far from all other
demonstrations say little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...risks import unit_actions
from ...training import Samples
from ..solution import Judged
from .candidate import Candidate
from .constants import (
    AS_DIRECT,
    BEYOND_CHANCE,
    COMPARED_STATES,
    FAR_MORE_CONSISTENT,
    LEAST_DEMONSTRATIONS,
    LEAST_HIDDEN,
    LEAST_MISFIT,
    MORE_CONSISTENT,
    MOST_HIDDEN,
    MOST_VARIANCE,
    MOST_VARIANCE_TO_LOSS,
    NEGLIGIBLE_LOSS,
    NEGLIGIBLE_RATIO,
    REFUTED,
    SHARE_OF_JACKKNIFE,
    TIED,
    VARIANCE_ROUNDS,
)
from .noise import beyond_misfit, corrected_squares
from .segments import held_throughout

TINY = 1e-12
"""Shares of the mean squared action below this are rounding."""


class Comparison:
    """Candidates that were learnt from the same samples, possibly in different features.

    Parameters
    ----------
    candidates : sequence of K Candidate
    noise : ndarray, shape (N,)
        Variance σ² of the noise on each action coordinate of each sample.
    samples : Samples or sequence of K Samples
        Those of all candidates, or of each.
    """

    def __init__(self, candidates: Sequence[Candidate], noise: Array, samples: Samples | Sequence[Samples]) -> None:
        self._candidates, self.noise = candidates, noise
        self.unused = ""  # why no candidate uses a Jacobian that was given
        self._views = [samples] * len(candidates) if isinstance(samples, Samples) else list(samples)
        self._samples = samples = self._views[0]
        self._held, self._seen = held_throughout(samples.actions, samples.groups, beyond_misfit(noise, samples))
        held, seen = held_throughout(samples.actions, samples.groups, noise)  # as far as noise tells, not misfit
        self._on_line = held & (np.einsum("naa->n", seen) < 1.5)
        moved = np.einsum("nab,nb->na", seen, samples.actions)
        self._directions, self._lengths = unit_actions(np.where(self._on_line[:, None], moved, samples.actions))
        self._held_out = np.stack([one.held_out for one in candidates])
        self._residuals = self._lengths - (self._held_out * self._directions).sum(axis=2)
        self._places = slice(None, None, -(-len(samples) // COMPARED_STATES))
        self._leverage = np.max([leverage(one) for one in dict.fromkeys(self._views)], axis=0)
        self._noise, self._variation = self._variances(noise)

    def beside(self, other: Comparison) -> Comparison:
        """The candidates that both compare, each learnt twice."""
        learnt = {one.name: (one, other._samples) for one in other._candidates}
        both = [replace(one, otherwise=learnt[one.name]) for one in self._candidates if one.name in learnt]
        found = Comparison(both, self.noise, self._samples)
        found.unused = self.unused or other.unused
        return found

    def judged(self) -> dict[str, Judged]:
        """Figures of each candidate, by name, as shares of the mean squared action."""
        unit = max(self._samples.energy, 1e-300)
        figures = np.column_stack([sum(self._missed), self._variance, self._bias, self.risks]) / unit
        return {
            one.name: Judged(loss, variance, bias, risk, one.weights)
            for one, (loss, variance, bias, risk) in zip(self._candidates, figures.tolist(), strict=True)
        }

    @property
    def best(self) -> Candidate:
        """The candidate of least risk; of those that are softened, the softest that is as good within chance."""
        best = int(self.risks.argmin())
        if self._candidates[best].softness <= 0.0:
            return self._candidates[best]
        near = np.flatnonzero(self.risks <= self.risks[best] + TIED * self._gaps[1][:, best])
        return max((self._candidates[k] for k in near.tolist()), key=lambda one: one.softness)

    @property
    def as_consistent(self) -> list[Candidate]:
        """The candidates after the first that are not less consistent than it, beyond chance, where held out.

        By the loss, or by the noise-corrected inconsistency: noise adds to the former where a policy is long across
        the actions, as the right one is where much is held.
        """
        gaps = [_gaps(losses) for losses in (self._losses, self._corrected_losses)]
        kept = np.any([gap[1:, 0] <= REFUTED * error[1:, 0] for gap, error in gaps], axis=0)
        return [self._candidates[1 + k] for k in np.flatnonzero(kept).tolist()]

    def refutes(self, one: str, other: str) -> bool:
        """Whether a candidate misses far less than another where held out, and beyond chance.

        Along the action, or with what is aside from it.
        """
        names = [each.name for each in self._candidates]
        both = self._losses, self._by_demonstration(self._reliable, self._along + self._aside) / self._reliable.sum()
        return any(_far_more(losses, names.index(other), names.index(one)) for losses in both)

    def shows(self, one: str, other: str) -> bool:
        """Whether a candidate has less bias than another and shows it, beyond their own variances."""
        names = [each.name for each in self._candidates]
        by, of, own = names.index(one), names.index(other), self._predictions[0]
        if self._candidates[by].softness >= self._candidates[of].softness or not self._may_show(by, of):
            return False
        found = self._shown(by, of, float(((own[by] - own[of]) ** 2).sum()))
        return found > float(self._variance[by] + self._variance[of])

    @cached_property
    def risks(self) -> Array:
        """Estimated squared error, shape (K,), up to what all have in common.

        Where candidates were learnt with other samples held out, too, the geometric mean of both estimates.
        """
        twice = [(one, *one.otherwise) for one in self._candidates if one.otherwise is not None]
        if len(twice) < len(self._candidates):
            return self._risks
        again = [replace(other, softness=one.softness, by_segments=one.by_segments) for one, other, _ in twice]
        both = self._risks, Comparison(again, self.noise, [samples for *_, samples in twice])._risks
        tiny = TINY * self._samples.energy + 1e-300
        return np.asarray(np.sqrt(np.prod([np.maximum(risks, tiny) for risks in both], axis=0)))

    @cached_property
    def _risks(self) -> Array:
        along, aside = self._missed
        more = aside - aside[np.nan_to_num(along + aside, nan=np.inf).argmin()]
        unresolved = LEAST_MISFIT**2 * self._samples.energy
        missed = along + more - np.clip(more, -unresolved, unresolved)
        risk = missed - np.nanmin(missed) + self._variance + self._bias
        found: Array = np.where(np.isfinite(risk), risk, np.inf)
        return found

    @cached_property
    def _missed(self) -> tuple[Array, Array]:
        """Weighted mean square of what held-out motion shows to be missed, along the action and aside from it, (K,)."""
        along, aside = (each @ self._reliable / self._reliable.sum() for each in (self._along, self._aside))
        return along, aside

    @cached_property
    def _gaps(self) -> tuple[Array, Array]:
        """By how much each candidate's loss is above each other's, and its standard error, paired; each (K, K)."""
        return _gaps(self._losses)

    @cached_property
    def _losses(self) -> Array:
        """Weighted mean square of the held-out residuals, without the noise's part, by demonstration: (K, G)."""
        return self._by_demonstration(self._reliable, self._along) / self._reliable.sum()

    @cached_property
    def _along(self) -> Array:
        """Squared residuals along the action, without the noise's part, (K, N)."""
        noise, d = self._noise, self._held_out.shape[2]
        size = self._squares + d * noise
        on_lines = self._residuals**2 - noise * (self._held_out**2).sum(axis=2) / size
        squares = np.stack([corrected_squares(self._samples, one, noise) for one in self._held_out])
        return np.where(self._on_line, on_lines, (squares + 2.0 * d * noise**2) / size)

    @cached_property
    def _aside(self) -> Array:
        """Squared residuals aside from the action where a demonstration was held throughout, without noise, (K, N)."""
        held, aside = self._held, np.zeros_like(self._along)
        off = np.einsum("nab,knb->kna", self._seen[held], self._samples.actions[held] - self._held_out[:, held])
        expected = self._noise[held] * np.einsum("naa->n", self._seen[held])
        aside[:, held] = np.vecdot(off, off) - expected - self._along[:, held]
        return aside

    @cached_property
    def _reliable(self) -> Array:
        """Weight of each sample, (N,)."""
        noise = self._noise / (self._variation * self._squares)
        return np.asarray(self._samples.counts / (1.0 + self._leverage) / (1.0 + noise))

    @cached_property
    def _corrected_losses(self) -> Array:
        """Noise-corrected inconsistency of the held-out predictions, by demonstration: (K, G)."""
        values = [corrected_squares(self._samples, policy, self.noise) for policy in self._held_out]
        return self._by_demonstration(self._samples.counts, np.stack(values))

    def _by_demonstration(self, weights: Array, values: Array) -> Array:
        """Weighted sums of values (K, N) over each demonstration, or each fold where there are few, (K, G)."""
        samples = self._samples
        few = len(np.unique(samples.groups)) < LEAST_DEMONSTRATIONS
        return np.stack([np.bincount(samples.folds if few else samples.groups, weights * each) for each in values])

    @property
    def _squares(self) -> Array:
        """Squared lengths of actions (N,), at least of rounding; along lines, which noise does not turn, usual ones."""
        found, usual = np.maximum(self._lengths**2, TINY * self._samples.energy), self._samples.energy
        return np.where(self._on_line, np.maximum(found, usual), found)

    def _variances(self, noise: Array) -> tuple[Array, float]:
        """σ² of each sample and κ², by iteratively reweighted least squares on the squared residuals.

        They are of the candidate with the least residuals weighted by ‖u‖². The noise given is an upper bound, since
        constraints that change look like noise.
        """
        from scipy.optimize import nnls  # takes long to import

        squares, counts, unit = self._squares, self._samples.counts, self._samples.energy
        best = int((self._residuals**2 @ (counts * squares)).argmin())
        size = np.maximum((self._held_out[best] ** 2).sum(axis=1), squares) / unit
        design, found = np.column_stack([size * noise / squares, size]), self._residuals[best] ** 2 / unit
        scale, least = np.full(len(found), max(float(np.median(found)), TINY)), 1e-6 * size + TINY
        for _ in range(VARIANCE_ROUNDS):
            weights = np.sqrt(counts / (1.0 + found / (4.0 * scale))) / scale
            (share, variation), _ = nnls(design * weights[:, None], found * weights)
            share = min(share, 1.0)
            scale = np.maximum(design @ [share, variation], least)
        return share * noise, max(float(variation), 1e-8)

    @cached_property
    def _variance(self) -> Array:
        """Variance of what motion does not show, shape (K,), by the jackknife: a share of it for those by segments."""
        found = [_jackknife(refits - own) for own, refits in zip(*self._predictions, strict=True)]
        share = [SHARE_OF_JACKKNIFE if one.by_segments else 1.0 for one in self._candidates]
        known = zip(self._candidates, share, found, strict=True)
        return np.array([part * own if one.spread is None else one.spread for one, part, own in known])

    @cached_property
    def _bias(self) -> Array:
        """The largest squared distance to a candidate of less bias that its variance does not explain, shape (K,)."""
        own, refits = self._predictions
        centred = refits - refits.mean(axis=1, keepdims=True)
        bias = np.zeros(len(own))
        for k, j in combinations(range(len(own)), 2):
            shown = [(one, by) for one, by in ((k, j), (j, k)) if self._may_show(by, one)]
            if shown:
                apart, variance = float(((own[k] - own[j]) ** 2).sum()), _jackknife(centred[k] - centred[j])
                for one, by in shown if apart > variance else ():
                    bias[one] = max(bias[one], self._shown(by, one, apart - SHARE_OF_JACKKNIFE * variance))
        return bias

    def _may_show(self, one: int, other: int) -> bool:
        """Whether the first has less bias than the second, or as little as any, and is stable.

        Or is more consistent by a tenth, however soft both are. Whoever knows more of the constraints than the second
        was compared before, see :attr:`as_consistent`.
        """
        mine, its = self._candidates[one].softness, self._candidates[other].softness
        if mine < 0.0 <= its:
            return True
        more_consistent, loss = self._refuted[other, one], self._losses[other].sum()
        less_biased = mine <= its
        most = MOST_VARIANCE * self._samples.energy if more_consistent and less_biased else MOST_VARIANCE_TO_LOSS * loss
        more_consistent &= its >= 0.0 and loss > MORE_CONSISTENT * self._losses[one].sum()
        return bool((less_biased or more_consistent) and self._variance[one] < most)

    def _shown(self, one: int, other: int, apart: float) -> float:
        """What the first shows of the second's bias, of so large a squared distance: the rest may be its own error.

        Each is wrong by a multiple of what it misses more along the motion than the other.
        """
        gap, error = (each[one, other] for each in self._gaps)
        mine, its = self._candidates[one].softness, self._candidates[other].softness
        if mine < 0.0 <= its:  # who knows the Jacobian was compared before
            return apart
        if mine > its:
            return min(apart, -LEAST_HIDDEN * gap) if mine >= AS_DIRECT else apart
        if _far_more(self._losses, one, other):
            return 0.0
        chance = BEYOND_CHANCE * error if self._candidates[one].by_segments else 0.0
        return max(apart - MOST_HIDDEN * max(gap - chance, 0.0), 0.0) if self._refuted[one, other] else apart

    @cached_property
    def _refuted(self) -> NDArray[np.bool_]:
        """Whether each is less consistent than each other where held out, (K, K).

        Differences that are less than any model's misfit say nothing unless they are beyond chance, or one loss is a
        multiple of the other.
        """
        return _less_consistent(self._losses / self._samples.energy)

    @cached_property
    def _predictions(self) -> tuple[Array, Array]:
        """Of each candidate (K, n, d) and of its refits (K, R, n, d), at some of the states, what motion does not show.

        Weighted, so that the sum of squares is the weighted mean square.
        """
        views = {view: view[self._places] for view in dict.fromkeys(self._views)}
        pairs = [(one, views[view]) for one, view in zip(self._candidates, self._views, strict=True)]
        own = np.stack([self._hidden(some.predict(one.weights)) for one, some in pairs])
        refits = np.stack([self._hidden(some.predict(one.refits)) for one, some in pairs])
        return own, refits

    def _hidden(self, predictions: Array) -> Array:
        """Weighted component of predictions (..., n, d) in the directions that motion does not show."""
        seen, weights = self._seen[self._places], 1.0 / (1.0 + self._leverage[self._places])
        hidden = predictions - (seen @ predictions[..., None])[..., 0]
        return np.asarray(np.sqrt(weights / weights.sum())[:, None] * hidden)


def _jackknife(deviations: Array) -> float:
    """Variance by the jackknife from the deviations (R, n, d) of the refits."""
    count = len(deviations)
    return (count - 1) / count * float((deviations**2).sum())


def leverage(samples: Samples) -> Array:
    """Leverage ``φᵀ (Σ w φ φᵀ)⁻¹ φ`` of each sample among the other folds' samples, averaged over the models, (N,)."""
    parts = np.stack([part.gram for part in samples.moments_by_fold])
    whole, found = parts.sum(axis=0), np.zeros(len(samples))
    ridge = 1e-6 * np.trace(whole, axis1=1, axis2=2)[:, None, None] / whole.shape[1] * np.eye(whole.shape[1])
    inverses = np.linalg.pinv(whole - parts + ridge, hermitian=True)
    for fold, inverse in enumerate(samples.centring.mT @ inverses @ samples.centring):
        rows = samples.folds == fold
        own = np.tensordot(samples.features[rows], inverse, axes=(1, 1))
        found[rows] = np.einsum("nm,nmp,np->n", samples.shares[rows], own, samples.features[rows], optimize=True)
    return np.clip(found, 0.0, 1e6)


def _less_consistent(losses: Array) -> NDArray[np.bool_]:
    """Whether each candidate's loss (K, G) is larger than each other's, and not negligibly or beyond chance, (K, K)."""
    gap, error = _gaps(losses)
    whole = losses.sum(axis=1)
    times = whole[:, None] > NEGLIGIBLE_RATIO * np.maximum(whole, 1e-9)
    return np.asarray((gap > NEGLIGIBLE_LOSS) | times | (gap > BEYOND_CHANCE * np.maximum(error, TINY)))


def _far_more(losses: Array, one: int, other: int) -> bool:
    """Whether one loss of some by demonstration (K, G) is far more than another, and beyond chance."""
    gap, error = _gaps(losses[[one, other]])
    far = losses[one].sum() > FAR_MORE_CONSISTENT * losses[other].sum()
    return bool(far and gap[0, 1] > REFUTED * error[0, 1])


def _gaps(losses: Array) -> tuple[Array, Array]:
    """By how much each candidate's loss (K, G) is above each other's, and its standard error, paired; each (K, K)."""
    gaps = losses[:, None] - losses
    return gaps.sum(axis=2), gaps.std(axis=2, ddof=1) * np.sqrt(losses.shape[1])

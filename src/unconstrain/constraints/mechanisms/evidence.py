"""How well a kind explains a recording: the logarithm of its evidence.

With n effective samples, noise σ_b in each of c_b directions of a block, J the Jacobian of the residuals, and ℓ_t the
extent of the movement in each direction t that is free,

    log p(data | kind) ≈ − Σ_b n c_b/2 (1 + log 2πσ_b²) − Σ_t n log ℓ_t − ½ log |JᵀWJ| / |JᵀW₀J| − Σ_t log(n² L²/2ℓ_t²)

The first term is the fit where the kind holds. Where it does not, the movement is uniform over its extent, the second
term: a kind that holds less pays for the freedom it claims. The third is Laplace's, W = n/N σ_b⁻²; a priori, with
W₀ = 1/N S_b⁻², a parameter moves the mechanism by as much as the recording extends. The fourth is the same for the two
ends of ℓ_t, which lie anywhere in L; the box that they make is turned as it fits best, which is paid for, too. On a
surface that bends it counts as no smaller than on a flat one.

How strongly a kind bends away from a straight one, a circle from a line, is of any size: the prior of its q parameters
beyond that one's has the width S s, and s is uniform in the logarithm (a mixture of g-priors, Liang et al. 2008). With
g = n s²/σ² and Δ, by how much bending explains the recording better, Laplace's n S²/σ² of each becomes the mean of

    (1 + g)^(−q/2) exp(−Δ / (1 + g)).

So a bend that is too small to be seen leaves the two undecided; a fixed width would call the straight one certain.

A path along which one direction is free may be a habit within a surface: whoever wipes a plate in circles wants the
circle, and only the plate holds. What holds is as tight in one direction as in the other. Who follows a habit strays
along the surface by more than the noise across it, and for long. So the best of these paths is explained a second time,
with noise of its own in either direction (Bartlett's likelihood ratio), for which two numbers are paid by Schwarz's
criterion, its size and where it points. That explanation counts for each kind that holds less: of such a kind the
movement was uniform, or it was a habit.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from ...base.arrays import Array
from .fitting import RESOLUTION, Fit, noise
from .mechanism import Mechanism
from .track import Track, correlation_time, principal

UNIT_ENTROPY = np.sqrt(2 * np.pi * np.e)
"""Extent of the uniform distribution that has the entropy of a normal one of variance 1."""

LEAST_BEND = 1 / 300
"""A bend moves the mechanism by this share of the extent at least: an arc of a degree and a half."""

USUAL_NOISE = 0.02
"""Share of the widest extent. Noise above it, and above what is white, has a prior that falls with its square."""

HABIT = 1 / 20
"""Odds, before anything was recorded, that whoever moves along a curve wants to, and is not held."""

LASTING = 2.0
"""Straying lasts so many times longer than noise does: a sensor may be noisier in one direction than in the other."""

Explained = Mapping[tuple[type[Mechanism], int], list[Fit]]
"""By kind, and by how many mechanisms there are: one for all demonstrations, or one for each."""


def log_evidences(explained: Explained, time: float, white: float) -> dict[tuple[type[Mechanism], int], float]:
    """Of every explanation.

    Parameters
    ----------
    explained : mapping
    time : float
        Samples that are worth one.
    white : float
        Standard deviation of what is white in a coordinate.
    """
    found = {}
    for (kind, count), fits in explained.items():
        straight = None if kind.form.straight is None else explained[kind.form.straight, count]
        found[kind, count] = _log_evidence(fits, straight, time, white)
    paths = [each for each, fits in explained.items() if fits[0].held.shape[1] == 2 == fits[0].track.dimensions - 1]
    if not paths:
        return found
    best = max(paths, key=lambda each: found[each])
    looser = [each for each, fits in explained.items() if fits[0].held.shape[1] < 2]
    wanted = found[best] + _habit(explained[best], time)
    credit = float(np.logaddexp(0.0, wanted - max(found[each] for each in looser)))
    return {each: value + credit * (each in looser) for each, value in found.items()}


def _habit(fits: list[Fit], time: float) -> float:
    """Log odds of a habit against a mechanism that holds the same path in all directions but one."""
    gain = sum(_looseness(one) for one in fits) / time
    paid = sum(np.log(max(len(one.residuals) / time, 2.0)) for one in fits)
    return float(gain - paid + np.log(HABIT))


def _looseness(one: Fit) -> float:
    """Log likelihood ratio of noise that differs between both directions that are held, where the larger lasts."""
    squares, turn = np.linalg.eigh(one.held.T @ one.held / len(one.held))
    tight, loose = (correlation_time((one.held @ turn)[:, [way]], one.track.groups) for way in (0, 1))
    if loose <= LASTING * tight:
        return 0.0
    squares = np.maximum(squares, RESOLUTION**2)
    return len(one.held) * float(np.log(squares.mean()) - np.log(squares).mean())


def _log_evidence(fits: list[Fit], straight: list[Fit] | None, time: float, white: float) -> float:
    """Of one kind, whose noise is common to all fits, and of that which it is where it does not bend."""
    variances = noise(fits)
    paid = _slack(fits, white) - sum(_parameters(one, variances, time) for one in fits)
    value = _explained(fits, time, straight) - paid
    if straight is None:
        return value
    bends = sum(one.mechanism.count for one in fits) - sum(one.mechanism.count for one in straight)
    strength = sum(len(one.residuals) for one in fits) / len(fits) / time / variances[0]
    gain = _explained(fits, time, straight) - _explained(straight, time)
    own = np.mean([one.track.positions.var(axis=0).sum() for one in fits])  # a demonstration is less wide than all
    spread = strength * own * np.geomspace(LEAST_BEND, 1.0, 60) ** 2
    bent = logsumexp(-bends / 2 * np.log1p(spread) - gain / (1 + spread)) - np.log(len(spread))
    return value + float(bends / 2 * np.log(strength) + bent)


def _explained(fits: list[Fit], time: float, straight: list[Fit] | None = None) -> float:
    """Log likelihood where the kind holds, and log density where the movement is free: no more than on a flat surface.

    A path is no cloud of samples: on a surface that bends as it turns it is straight, and seems to fill less.
    """
    variances, count = noise(fits), sum(len(one.residuals) for one in fits) / time
    held = -count / 2 * float((1 + np.log(2 * np.pi * variances)).sum())
    flat = straight if straight is not None and fits[0].held.shape[1] == 1 else fits
    return held + float(np.minimum(_freedoms(fits, time), _freedoms(flat, time)).sum())


def _freedoms(fits: list[Fit], time: float) -> Array:
    least = UNIT_ENTROPY * np.sqrt(noise(fits).max(initial=RESOLUTION**2))
    return np.array([_freedom(one, part, time, least) for one in fits for part in one.track.demonstrations])


def _slack(fits: list[Fit], white: float) -> float:
    """What noise costs above the usual, in each direction that is held."""
    held = noise(fits)[: sum(fits[0].mechanism.form.blocks[:1])]
    usual = max(white, USUAL_NOISE * max(one.track.extent for one in fits), RESOLUTION)
    return float(np.maximum(np.log(held / usual**2), 0.0).sum())


def _parameters(one: Fit, variances: Array, time: float) -> float:
    """Occam's factor: of what the parameters may be a priori, the share that the recording leaves."""
    mechanism, prior = one.mechanism, np.full(len(variances), float(len(one.residuals)))
    if mechanism.form.ties:
        prior[-mechanism.form.blocks[-1] :] *= max(float((one.track.turns**2).sum(axis=1).mean()), RESOLUTION**2)
    pair = (one.information(variances) / time, one.information(prior))
    likely, before = (np.linalg.slogdet(each + 1e-12 * np.trace(each) * np.eye(len(each)))[1] for each in pair)
    return float(before - likely) / 2


def _freedom(one: Fit, part: Track, time: float, least: float) -> float:
    value = _uniform(one.mechanism.travel(part), time, least, one.track.extent)
    if one.mechanism.form.ties or not part.poses:
        return value
    return value + _uniform(part.turns, time, RESOLUTION, 2 * np.pi)


def _uniform(values: Array, time: float, least: float, most: float) -> float:
    """Log density of values (n, m), uniform over the box of their principal directions, whose ends are unknown."""
    extents = np.sort(np.maximum(np.ptp(values @ principal(values)[1].T, axis=0), least))[::-1]
    count = max(len(values) / time, 2.0)
    turned = sum(np.log(np.sqrt(count) * wide / narrow) for wide, narrow in combinations(extents, 2))
    ends = 2 * np.log(count * np.maximum(most / extents, 1.0)) - np.log(2)
    return -float((count * np.log(extents) + ends).sum() + turned)

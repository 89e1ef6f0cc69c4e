"""Direct regression and softened hybrids: candidates from one set of sums."""

import numpy as np

from ...base.arrays import Array
from ...base.display import counted_off
from ...risks import Moments, inconsistency, minimum, softened_minima, standard_risk, unvec, vec
from ...training import Samples
from ..thresholds import judged
from .candidate import Candidate, scaled
from .constants import CANDIDATE_SOFTNESSES
from .noise import correlation_time, inefficiency
from .posterior import Posterior
from .smoothness import Smoothness
from .sphere import distances

_NAMES = ("direct", *(f"softened hybrid, {softness:g}" for softness in CANDIDATE_SOFTNESSES))


def softened(samples: Samples) -> list[Candidate]:
    """Direct regression and the minima of ``E_i + s E_2`` for each softness s, the softest first."""
    parts = samples.moments_by_fold
    whole, d = Moments.total(parts), samples.actions.shape[1]
    left_out = counted_off(parts, "softened hybrids: fold")
    refits = np.stack([_path(Moments.total([one for one in parts if one is not part]), d) for part in left_out])
    learnt = zip(_path(whole, d), samples.held_out(refits), np.moveaxis(refits, 1, 0), strict=True)
    return [
        _candidate(name, softness, *found, whole, samples)
        for name, softness, found in zip(_NAMES, (np.inf, *CANDIDATE_SOFTNESSES), learnt, strict=True)
    ]


def _path(moments: Moments, d: int) -> Array:
    """Weights of all candidates, shape (K, M, d, p)."""
    consistent, risk = inconsistency(moments), standard_risk(moments)
    minima = softened_minima(consistent, risk, CANDIDATE_SOFTNESSES)
    return unvec(np.concatenate([minimum(risk)[None], np.moveaxis(minima, -1, 0)]), d)


def _candidate(
    name: str, softness: float, weights: Array, held_out: Array, refits: Array, whole: Moments, samples: Samples
) -> Candidate:
    radial = distances(samples.actions, samples.predict(weights)).radial
    sizes = np.maximum(whole.weight, np.finfo(float).tiny)
    consistent = inconsistency(whole)
    residual = np.maximum(judged(consistent, vec(weights)), 1e-12 * whole.energy) / sizes
    variance = inefficiency(correlation_time(radial[:, None], samples.groups), samples) * residual
    posterior = Posterior(consistent, min(softness, 1.0 / np.finfo(float).eps) * standard_risk(whole))
    return Candidate(
        name,
        weights,
        scaled(posterior, variance),
        held_out,
        samples.mean(radial**2),
        Smoothness.of(samples),
        refits,
        softness,
    )

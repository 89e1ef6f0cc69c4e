"""Whether demonstrations agree on one policy, where each is needed and what is held out says little.

Ten strokes along rulers may tell a policy twice over, and seven of them next to nothing: every candidate, right or
wrong, then misses what is held out. But that one policy fits all ten, though they tell far more than it has freedom to
fit, is no chance. Demonstration g tells ``E_g = tr H_g (H_g + B)⁻¹`` independent numbers of the policy, with the
Hessians H_g of its error and B of the prior; the sum of these, E, was fitted by ``P = tr H (H + B)⁻¹`` of them, with
the Hessian H of all. What is new is then missed by ``E / (E − P)`` times as much as what was learnt from: generalised
cross-validation (Golub, Heath and Wahba, *Technometrics* 21(2), 1979), by demonstration. It supposes that the policy
has the form of the model: what another form would make of places between the strokes, none of them tells. So what is
missed must be no more than noise: of another form some is left, however little, and grows where nobody was.
"""

from dataclasses import replace

import numpy as np

from ...base.arrays import Array
from ...training import Samples
from .candidate import Candidate
from .constants import AGREED, AGREED_EXACTLY, MOST_FITTED, MOST_OF_NOISE
from .noise import most_noise


def where_agreed(found: Candidate, samples: Samples, projections: Array) -> Candidate | None:
    """The candidate, judged by agreement; None unless that says that it is right, and no worse than held out.

    Its variance is that of the posterior, its held-out predictions miss as much as agreement says, and its refits are
    all alike.

    Parameters
    ----------
    found : Candidate
        The policy of least constrained error.
    samples : Samples
    projections : ndarray, shape (N, d, d)
        Of that error.
    """
    if len(found.weights) > 1:  # in narrow fields demonstrations are alone, and lines: agreement there is chance
        return None
    policy, motion = samples.predict(found.weights), samples.energy
    residuals = np.einsum("nab,nb->na", projections, samples.actions - policy)
    held_out = np.einsum("nab,nb->na", projections, samples.actions - found.held_out)
    most = min(AGREED * motion, _square(samples, held_out))
    noise = most_noise(samples) * samples.mean(np.einsum("naa->n", projections))
    if _square(samples, residuals) > min(most, MOST_OF_NOISE * (noise + AGREED_EXACTLY**2 * motion)):
        return None
    told, fitted = _numbers(found, samples, projections)
    if fitted >= MOST_FITTED * told:
        return None
    factor = told / (told - fitted)
    missed = factor * residuals
    if _square(samples, missed) > most:
        return None
    from_noise, undetermined = found.posterior.covariances()
    return replace(
        found,
        spread=_spread(samples, factor * from_noise[0] + undetermined[0]),
        held_out=policy + residuals - missed,
        refits=np.repeat(found.weights[None], len(found.refits), axis=0),
        alone=_square(samples, held_out) / motion,
    )


def _square(samples: Samples, residuals: Array) -> float:
    """Mean square of residuals (N, d), weighted."""
    return samples.mean(np.vecdot(residuals, residuals))


def _numbers(found: Candidate, samples: Samples, projections: Array) -> tuple[float, float]:
    """How many numbers of the policy the demonstrations tell, each on its own, E, and how many are fitted, P.

    A direction of the weights counts as far as the data says more of it than the prior.
    """
    groups = (samples.groups == group for group in np.unique(samples.groups))
    alone = np.stack([samples[rows].constrained(projections[rows]).hessian[0] for rows in groups])
    evidence, prior = found.posterior.evidence.hessian[0], found.posterior.floored_prior()[0]
    alone *= np.trace(evidence) / max(float(np.einsum("gii->", alone)), 1e-300)  # over the variance, as the evidence is

    def count(information: Array) -> float:
        return float(np.trace(np.linalg.solve(information + prior, information), axis1=-2, axis2=-1).sum())

    return count(alone), count(evidence)


def _spread(samples: Samples, covariance: Array) -> float:
    """Mean variance of the predictions, summed over the action, by a covariance of the weights (P, P)."""
    d, p = samples.actions.shape[1], samples.regressors
    own = samples.features @ samples.centring[0].T
    of_each = np.einsum("pdqd->pq", covariance.reshape(p, d, p, d))
    return samples.mean(np.vecdot(own @ of_each, own))

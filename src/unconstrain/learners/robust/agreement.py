"""Whether demonstrations agree on one policy, where each is needed and what is held out says nothing.

Ten strokes along rulers may tell a policy twice over, and seven of them next to nothing: every candidate, right or
wrong, then misses what is held out. But that one policy fits all ten, though they tell far more than it has freedom to
fit, is no chance. Demonstration g tells ``E_g = tr H_g (H_g + B)⁻¹`` independent numbers of the policy, with the
Hessians H_g of its error and B of the prior; the sum of these, E, was fitted by ``P = tr H (H + B)⁻¹`` of them, with
the Hessian H of all. What is new is then missed by ``E / (E − P)`` times as much as what was learnt from: generalised
cross-validation (Golub, Heath and Wahba, *Technometrics* 21(2), 1979), by demonstration.
"""

from dataclasses import replace

import numpy as np

from ...base.arrays import Array
from ...training import Samples
from .candidate import Candidate
from .constants import AGREED, AGREED_OF_HELD_OUT, MOST_FITTED


def where_agreed(found: Candidate, samples: Samples, projections: Array) -> Candidate | None:
    """The candidate, judged by agreement; None unless that says that it is right and what was held out says nothing.

    Its held-out predictions are such that they miss what is new by as much as agreement says, its refits are all
    alike, and its variance is that of the posterior.

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
    most = min(AGREED * motion, AGREED_OF_HELD_OUT * _square(samples, held_out))
    if _square(samples, residuals) > most:
        return None
    told, fitted = _numbers(found, samples, projections)
    if fitted.sum() >= MOST_FITTED * told.sum():
        return None
    factors = told / (told - fitted)
    missed = factors * residuals
    if _square(samples, missed) > most:
        return None
    from_noise, undetermined = found.posterior.covariances()
    covariances = factors[:, None, None] * from_noise + undetermined
    return replace(
        found,
        held_out=policy + residuals - missed,
        refits=np.repeat(found.weights[None], len(found.refits), axis=0),
        spread=samples.mean(_variances(samples, covariances)),
    )


def _square(samples: Samples, residuals: Array) -> float:
    """Mean square of residuals (N, d), weighted."""
    return samples.mean(np.vecdot(residuals, residuals))


def _numbers(found: Candidate, samples: Samples, projections: Array) -> tuple[Array, Array]:
    """How many numbers of each model's policy the demonstrations tell, each on its own, and how many are fitted, (M,).

    A direction of the weights counts as far as the data says more of it than the prior.
    """
    groups = (samples.groups == group for group in np.unique(samples.groups))
    alone = np.stack([samples[rows].constrained(projections[rows]).hessian for rows in groups])
    evidence, prior = found.posterior.evidence.hessian, found.posterior.floored_prior()
    whole = np.maximum(np.einsum("gmii->m", alone), 1e-300)
    alone *= (np.einsum("mii->m", evidence) / whole)[:, None, None]  # over the variance, as the evidence is

    def count(information: Array) -> Array:
        return np.einsum("...ii->...", np.linalg.solve(information + prior, information))

    return count(alone).sum(axis=0), count(evidence)


def _variances(samples: Samples, covariances: Array) -> Array:
    """Variance of the prediction at each sample, summed over the action, (N,), by covariances of weights (M, P, P)."""
    models, d, p = len(covariances), samples.actions.shape[1], samples.regressors
    of_each = np.einsum("mpdqd->mpq", covariances.reshape(models, p, d, p, d))
    found = np.zeros(len(samples))
    for m, centring in enumerate(samples.centring):
        own = samples.features @ centring.T
        found += samples.shares[:, m] ** 2 * np.vecdot(own @ of_each[m], own)
    return found

"""Noise on the actions: its variance, its autocorrelation, and moments corrected for it.

Let ``u = N π + ε`` with ε of variance σ² in each of d coordinates. The
direction of a slow action is mostly noise, and eq. 4 gives it full weight.
The residual

    ρ = ‖u‖² − uᵀπ − d σ² = ‖ε‖² − d σ² − εᵀ(I − 2N) π

has mean zero and, since I − 2N is a reflection, the variance
``σ²‖π‖² + 2 d σ⁴`` under any constraint. It is the residual of the
inconsistency with samples weighted by ‖u‖². The sum of its squares is biased
as a quadratic in the weights, since u is a regressor with errors; the bias
follows from the expectations

    E[u uᵀ]       = N π πᵀ N + σ² I
    E[‖u‖² u]     = (‖N π‖² + (d + 2) σ²) N π
    E[‖u‖⁴]       = ‖N π‖⁴ + 2 (d + 2) σ² ‖N π‖² + d (d + 2) σ⁴

and is a combination of the moments with sample weights ‖u‖² and 1.
"""

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from ...base.arrays import Array
from ...risks import Moments, autocorrelations, standard_risk
from ...training import Samples
from .constants import (
    DIFFERENCE_ORDER,
    LEAST_APART,
    LEAST_AUTOCORRELATION,
    LEAST_DIFFERENCES,
    LEAST_MISFIT,
    MOST_GROWTH,
    MOST_LAGS,
    MOST_SHARED_NOISE,
    SPHERE_HIDDEN_BY_NOISE,
)


def noise_by_differences(actions: Array, groups: NDArray[np.intp]) -> float:
    """Variance of the noise on each action coordinate, from differences in time.

    The median of the squared fourth differences within demonstrations, which
    is robust to constraints that switch now and then. Differences are of
    neighbours where these show white noise, and of samples farther apart where
    neighbours share their noise, since positions were filtered, or
    differentiated over a window; see :data:`~.constants.MOST_GROWTH`. Biased upwards where a
    constraint changes at every sample: that looks like noise. Infinity where
    no demonstration is long enough.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    groups : ndarray of int, shape (N,)
    """
    return _by_differences(actions, groups, lag_of_noise(actions, groups))


def lag_of_noise(actions: Array, groups: NDArray[np.intp]) -> int:
    """How many samples apart noise is no longer shared, a power of two; 1 where neighbours tell it, or nothing does.

    Noise that neighbours share grows with the lag, and stays the same from its correlation time on, everywhere alike; a
    smooth movement grows until it is as large as the actions. A derivative over a window has a little white noise
    besides, from the window's ends, so that the last lag counts from which on it stays.
    """
    found, lag, at = 1, 1, _by_differences(actions, groups)
    most = MOST_SHARED_NOISE**2 * float((actions**2).mean()) if len(actions) else 0.0
    told = np.inf  # of a first plateau that is higher than neighbours tell
    while at <= most:
        farther = _by_differences(actions, groups, 2 * lag, least=2 * lag * LEAST_APART)
        if farther <= MOST_GROWTH * at and (told == np.inf or at > MOST_GROWTH**2 * told):
            alike = at <= MOST_GROWTH**2 * _by_differences(actions, groups, lag, 0.25)
            found, told = (2 * lag if lag > 1 and farther < at else lag, at) if alike else (found, told)
        lag, at = 2 * lag, farther
    return found


def _by_differences(
    actions: Array, groups: NDArray[np.intp], lag: int = 1, quantile: float = 0.5, least: int = 1
) -> float:
    """Variance by a quantile of fourth differences of samples so far apart; infinity of fewer than the least."""
    weights = np.array([(-1) ** i * comb(DIFFERENCE_ORDER, i) for i in range(DIFFERENCE_ORDER + 1)], dtype=np.float64)
    count = len(actions) - DIFFERENCE_ORDER * lag
    if count < 1:
        return np.inf
    same = groups[-count:] == groups[:count]
    if same.sum() < least:
        return np.inf
    differences = sum(weight * actions[i * lag : i * lag + count] for i, weight in enumerate(weights))
    lengths = (np.asarray(differences)[same] ** 2).sum(axis=1)
    usual = 2.0 * gammaincinv(0.5 * actions.shape[1], quantile)  # of χ²; scipy.stats takes long to import
    return float(np.quantile(lengths, quantile) / usual / (weights**2).sum())


def most_noise(samples: Samples) -> float:
    """Variance of the noise by differences in time over all demonstrations, at least what is known of it.

    At most that of the actions.
    """
    found = noise_by_differences(samples.actions, samples.groups)
    known = 0.0 if samples.noise is None else samples.mean(samples.noise**2)
    return min(max(found, known), samples.energy)


def noise_of_each(actions: Array, labels: NDArray[np.intp], most: float, known: Array | None = None) -> Array:
    """Noise variance of each sample, (N,): what is known, or of its segment by differences, where it is long enough.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    labels : ndarray of int, shape (N,)
        Demonstration or segment of each sample.
    most : float
        Variance of short segments.
    known : ndarray, shape (N,), optional
        Standard deviation on each coordinate. Where samples share their noise, it is at least that by differences.
    """
    lag, found = lag_of_noise(actions, labels), np.full(len(actions), most)
    if known is not None and lag == 1:
        return known**2
    for label in np.unique(labels):
        rows = labels == label
        if rows.sum() >= LEAST_DIFFERENCES + DIFFERENCE_ORDER * (lag - 1):
            found[rows] = _by_differences(actions[rows], labels[rows], lag)
    return found if known is None else np.maximum(found, known**2)


def beyond_misfit(noise: Array, samples: Samples) -> Array:
    """Variance of the noise (N,), at least that of the least misfit: positions that were smoothed hide their noise."""
    return np.maximum(noise, LEAST_MISFIT**2 * samples.energy / samples.actions.shape[1])


def correlation_time(residuals: Array, groups: NDArray[np.intp]) -> float:
    """Integrated autocorrelation time of residuals, ``1 + 2 Σ_k r_k``, in samples.

    N samples carry the information of N over this number of independent ones.
    The sum ends at the first autocorrelation r_k near zero; it is at least 1.

    Parameters
    ----------
    residuals : ndarray, shape (N, k)
    groups : ndarray of int, shape (N,)
    """
    time = 1.0
    for correlation in autocorrelations(residuals, groups, MOST_LAGS):
        if correlation <= LEAST_AUTOCORRELATION:
            break
        time += 2.0 * correlation
    return time


def consistency_residuals(samples: Samples, policy: Array, variance: float | Array) -> Array:
    """ρ of each sample at predictions (N, d), under noise of a variance, one or each sample's; see above."""
    along = np.vecdot(samples.actions, samples.actions - policy)
    return np.asarray(along - samples.actions.shape[1] * variance)


def corrected_squares(samples: Samples, policy: Array, variance: float | Array) -> Array:
    """``ρ² − σ²‖2u − π‖²`` of each sample at predictions (N, d).

    Noise adds ``σ²‖2Nπ' − π‖² + 2 d σ⁴`` to the expectation of ρ² for any prediction π under the true policy π', and
    ``−2 d σ⁴``, which is the same for all predictions, to this.
    """
    aside = 2.0 * samples.actions - policy
    return np.asarray(consistency_residuals(samples, policy, variance) ** 2 - variance * np.vecdot(aside, aside))


def hides_sphere(variance: float, samples: Samples) -> bool:
    """Whether noise of a variance per coordinate makes free and constrained samples look the same."""
    return bool(samples.actions.shape[1] * variance > SPHERE_HIDDEN_BY_NOISE**2 * samples.energy)


def inefficiency(time: float, samples: Samples) -> Array:
    """Statistical inefficiency of the misfit, (M,): the number of samples over the effective number.

    Misfit is a function of the state. It is taken to have as many degrees of freedom as the model has, P, and so at
    most P independent values, however many samples there are.
    """
    return np.maximum(time, samples.sizes / (samples.actions.shape[1] * samples.regressors))


def corrected(weighted: Moments, plain: Moments, variance: float) -> Moments:
    """Moments of samples weighted by ‖u‖², without the noise's expected contribution (see above).

    Parameters
    ----------
    weighted, plain : Moments
        Of the samples weighted by ‖u‖², and by 1.
    variance : float
        σ².

    Returns
    -------
    Moments
        The matrix ``consistent`` may be indefinite: the noise's contribution differs from its expectation.
    """
    d = plain.cross.shape[1]
    return Moments(
        weighted.weight - d * variance * plain.weight,
        weighted.energy - 2 * (d + 2) * variance * plain.energy + d * (d + 2) * variance**2 * plain.weight,
        weighted.cross - (d + 2) * variance * plain.cross,
        weighted.gram - d * variance * plain.gram,
        weighted.consistent - variance * standard_risk(plain).hessian,
    )

"""How much noise there is on the actions, how it hangs together in time, and sums without it.

Let ``u = N π + ε`` with ε of variance σ² in each of d coordinates. The
direction of a slow action is mostly noise, and eq. 4 gives it full weight.
The residual

    ρ = ‖u‖² − uᵀπ − d σ² = ‖ε‖² − d σ² − εᵀ(I − 2N) π

has mean zero, and, since I − 2N is a reflection, the variance
``σ²‖π‖² + 2 d σ⁴`` whatever the constraint: it is the inconsistency with
samples weighted by ‖u‖². Its quadratic is not yet right, as u is noisy in
it twice; expectations give what has to be subtracted:

    E[u uᵀ]       = N π πᵀ N + σ² I
    E[‖u‖² u]     = (‖N π‖² + (d + 2) σ²) N π
    E[‖u‖⁴]       = ‖N π‖⁴ + 2 (d + 2) σ² ‖N π‖² + d (d + 2) σ⁴

All of it is in the moments with weights ‖u‖² and with weights 1.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from ...base.arrays import Array
from ...risks import Moments, standard_risk

_ORDER = 4
_LAGS = 20
_QUIET = 0.05


def noise_by_differences(actions: Array, groups: NDArray[np.intp]) -> float:
    """Variance of what does not go on smoothly from sample to sample, per coordinate.

    From fourth differences within each demonstration: a movement has almost
    none. Their median does not mind a constraint that switches now and then.
    One that changes at every sample looks like noise; then this is too large.

    Parameters
    ----------
    actions : ndarray, shape (N, d)
    groups : ndarray of int, shape (N,)

    Returns
    -------
    float
        Infinity where no demonstration is long enough.
    """
    weights = np.array([(-1) ** i * comb(_ORDER, i) for i in range(_ORDER + 1)], dtype=np.float64)
    count = len(actions) - _ORDER
    if count < 1:
        return np.inf
    same = groups[_ORDER:] == groups[:-_ORDER]
    if not same.any():
        return np.inf
    differences = sum(weight * actions[i : i + count] for i, weight in enumerate(weights))
    lengths = (np.asarray(differences)[same] ** 2).sum(axis=1)
    return float(np.median(lengths) / chi2.median(actions.shape[1]) / (weights**2).sum())


def correlation_time(residuals: Array, groups: NDArray[np.intp]) -> float:
    """Samples that say as much as one independent one, ``1 + 2 Σ_k r_k`` up to the first r_k near zero.

    Parameters
    ----------
    residuals : ndarray, shape (N, k)
    groups : ndarray of int, shape (N,)

    Returns
    -------
    float
        At least 1.
    """
    energy = float((residuals**2).sum(axis=1).mean()) if len(residuals) else 0.0
    time = 1.0
    for lag in range(1, min(_LAGS, len(residuals) - 1) + 1):
        same = groups[lag:] == groups[:-lag]
        if energy <= 0.0 or not same.any():
            break
        correlation = float((residuals[lag:] * residuals[:-lag]).sum(axis=1)[same].mean()) / energy
        if correlation <= _QUIET:
            break
        time += 2.0 * correlation
    return time


def corrected(weighted: Moments, plain: Moments, variance: float) -> Moments:
    """Moments of samples weighted by ‖u‖², without the expected part of the noise (see above).

    Parameters
    ----------
    weighted, plain : Moments
        Of the samples weighted by ‖u‖², and by 1.
    variance : float
        σ².

    Returns
    -------
    Moments
        The matrix ``consistent`` need not be positive: subtracting leaves what the noise was by chance.
    """
    d = plain.cross.shape[1]
    return Moments(
        weighted.weight - d * variance * plain.weight,
        weighted.energy - 2 * (d + 2) * variance * plain.energy + d * (d + 2) * variance**2 * plain.weight,
        weighted.cross - (d + 2) * variance * plain.cross,
        weighted.gram - d * variance * plain.gram,
        weighted.consistent - variance * standard_risk(plain).hessian,
    )

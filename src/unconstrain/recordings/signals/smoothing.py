"""Velocities of noisy positions by a Kalman smoother (Rauch, Tung and Striebel, 1965), noise included.

Each coordinate has position, velocity and acceleration, ``x_k``, driven by white jerk of density q; positions are
measured with white noise of variance r,

    x_{k+1} = F(τ) x_k + w_k,   w_k ~ N(0, q Q(τ)),      y_k = (1, 0, 0) x_k + ε_k,   ε_k ~ N(0, r),

for steps of length τ at stamps of any distance. Nothing is said of the first state. What the smoother gives is the
mode of the posterior density, and so the solution of one linear system with a banded matrix ``J / r``,
``J = HᵀH + P / λ`` with ``λ = q / r`` and P the precision of the steps; its inverse holds the variances. With
``R = yᵀ (y − p̂)``, −2 times the logarithm of the likelihood of λ, at its best r of ``R / (T − 3)``, is

    (T − 3) log R + 3 (T − 1) log λ + log |J|

up to a constant, and λ is the one of largest likelihood.
"""

from typing import NamedTuple

import numpy as np

from ...base.arrays import Array

LEAST = 5
"""Samples that it takes to tell noise from movement."""

SMOOTHEST, ROUGHEST = -23.0, 16.0
"""Range of log λ, with the usual interval as the unit of time: from all noise to none."""

ROUNDING = 1e-13
"""What is less than this share of the positions is rounding."""

BAND = 5
"""Above the diagonal: steps couple the three numbers of a sample with those of the next."""

MEDIAN_SQUARE = 0.4549
"""Median of the square of a standard normal number."""

PLACES = 20
"""Samples at which the variance of the velocity is computed."""


class Smoothed(NamedTuple):
    """Velocities (T, n), and the standard deviation of their noise in each coordinate (n,), root-mean-square."""

    velocities: Array
    deviations: Array


def kalman_velocities(times: Array, positions: Array) -> Smoothed:
    """Velocities by a smoother whose noise is the most likely one, coordinate by coordinate.

    Parameters
    ----------
    times : ndarray, shape (T,)
        Seconds, increasing, at least :data:`LEAST`.
    positions : ndarray, shape (T, n)
    """
    unit = float(np.median(np.diff(times)))
    steps = _precision(np.diff(times) / unit)
    # Of parabolas nothing is said beforehand, so they are fitted exactly; without them little is left to rounding.
    parabolas, slopes = _parabolas((times - times[0]) / unit)
    weights = np.linalg.lstsq(parabolas, positions, rcond=None)[0]
    rest = positions - parabolas @ weights
    nothing = ROUNDING * np.abs(positions).max(axis=0)
    each = [_smoothed(steps, column, least) for column, least in zip(rest.T, nothing, strict=True)]
    velocities = np.column_stack([velocity for velocity, _ in each]) + slopes @ weights
    return Smoothed(velocities / unit, np.array([noise for _, noise in each]) / unit)


def _parabolas(times: Array) -> tuple[Array, Array]:
    """Polynomials of degree two at some times, and their derivatives, both (T, 3)."""
    half = times[-1] / 2
    along = times / half - 1.0
    one, nothing = np.ones_like(along), np.zeros_like(along)
    return np.column_stack([one, along, along**2]), np.column_stack([nothing, one, 2 * along]) / half


def _smoothed(steps: Array, positions: Array, nothing: float) -> tuple[Array, float]:
    """Velocity (T,) and the standard deviation of its noise, per unit of time."""
    size = float(np.abs(positions).max())
    if size <= nothing:
        return np.zeros(len(positions)), 0.0
    scaled = positions / size
    log_ratio = _likeliest(steps, scaled)
    factor = _factor(steps, log_ratio)
    states = _solved(factor, _measured(scaled))
    variance = _residual(scaled, states) / (len(scaled) - 3) * _velocity_variance(factor, len(scaled))
    return size * states[1::3], size * float(np.sqrt(variance))


def _likeliest(steps: Array, positions: Array) -> float:
    from scipy.optimize import minimize_scalar  # takes long to import

    def cost(log_ratio: float) -> float:
        try:
            factor = _factor(steps, log_ratio)
        except np.linalg.LinAlgError:  # so smooth that rounding hides the measurements
            return np.inf
        residual = _residual(positions, _solved(factor, _measured(positions)))
        samples = len(positions)
        determinant = 2.0 * float(np.log(factor[BAND]).sum())
        return (samples - 3) * float(np.log(residual)) + 3 * (samples - 1) * log_ratio + determinant

    grid = np.linspace(SMOOTHEST, ROUGHEST, 14)
    best = int(np.argmin([cost(one) for one in grid]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    return float(minimize_scalar(cost, bounds=ends, method="bounded", options={"xatol": 1e-3}).x)


def _precision(steps: Array) -> Array:
    """P of steps of some lengths (T − 1,), its upper bands (BAND + 1, 3 T)."""
    t, one, nothing = steps, np.ones_like(steps), np.zeros_like(steps)
    forward = _matrices([[one, t, t**2 / 2], [nothing, one, t], [nothing, nothing, one]])
    spread = _matrices([[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]])
    inverse = np.linalg.inv(spread)
    onto = forward.swapaxes(1, 2) @ inverse
    diagonal = np.zeros((len(steps) + 1, 3, 3))
    diagonal[:-1] += onto @ forward
    diagonal[1:] += inverse
    bands = np.zeros((BAND + 1, 3 * len(diagonal)))
    for i in range(3):
        for j in range(3):
            if j >= i:
                bands[BAND + i - j, j::3] = diagonal[:, i, j]
            bands[BAND + i - j - 3, 3 + j :: 3] = -onto[:, i, j]
    return bands


def _matrices(rows: list[list[Array]]) -> Array:
    """Matrices (K, 3, 3) of entries (K,)."""
    return np.moveaxis(np.array(rows), 2, 0)


def _factor(steps: Array, log_ratio: float) -> Array:
    from scipy.linalg import cholesky_banded  # takes a fifth of a second to import

    matrix = steps * np.exp(-log_ratio)
    matrix[BAND, ::3] += 1.0
    return np.asarray(cholesky_banded(matrix, overwrite_ab=True))


def _measured(positions: Array) -> Array:
    """Hᵀ y, shape (3 T,)."""
    sums = np.zeros(3 * len(positions))
    sums[::3] = positions
    return sums


def _solved(factor: Array, right: Array) -> Array:
    from scipy.linalg import cho_solve_banded

    return np.asarray(cho_solve_banded((factor, False), right))


def _residual(positions: Array, states: Array) -> float:
    """R, not less than rounding makes it."""
    return max(float(positions @ (positions - states[::3])), 1e-24 * len(positions))


def _velocity_variance(factor: Array, samples: int) -> float:
    """Mean variance of the velocity over the samples, as a multiple of r."""
    rows = 3 * np.unique(((np.arange(PLACES) + 0.5) / PLACES * samples).astype(np.intp)) + 1
    units = np.zeros((3 * samples, len(rows)))
    units[rows, np.arange(len(rows))] = 1.0
    return float(_solved(factor, units)[rows, np.arange(len(rows))].mean())


def white_noise(positions: Array) -> Array:
    """Standard deviation of white noise of positions (T, n), by fourth differences, at least that of rounding: (n,).

    Velocities that were smoothed hide it from their own differences. Of fewer than five positions: rounding alone.
    """
    rounding = np.array([_rounding(column) for column in positions.T])
    if len(positions) < LEAST:
        return rounding
    squares = np.median(np.diff(positions, 4, axis=0) ** 2, axis=0) / (MEDIAN_SQUARE * 70.0)
    return np.asarray(np.sqrt(np.maximum(squares, rounding**2)))


def _rounding(values: Array) -> float:
    """Standard deviation of rounding values (T,) to multiples of a step that recur, such as whole pixels, or zero."""
    found, counts = np.unique(values, return_counts=True)
    steps = np.diff(found[counts > 2])
    steps = steps[steps > 1e-9 * np.ptp(values)]
    whole = len(steps) > 2 and np.allclose(times := steps / steps.min(), np.round(times))
    return float(steps.min()) / np.sqrt(12.0) if whole else 0.0

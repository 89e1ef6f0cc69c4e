"""Autocorrelations of residuals, within demonstrations."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array


def autocorrelations(residuals: Array, groups: NDArray[np.intp]) -> Iterator[float]:
    """Autocorrelations r_1, r_2, ... up to the longest lag; zero where no two samples are so far apart, or all vanish.

    Parameters
    ----------
    residuals : ndarray, shape (N, k)
        In the order of time within each demonstration.
    groups : ndarray of int, shape (N,)
        Which demonstration each sample is from.
    """
    energy = float(np.vecdot(residuals, residuals).mean()) if len(residuals) else 0.0
    for lag in range(1, len(residuals)):
        same = groups[lag:] == groups[:-lag]
        none = energy <= 0.0 or not same.any()
        yield 0.0 if none else float(np.vecdot(residuals[lag:], residuals[:-lag])[same].mean()) / energy

"""Autocorrelations of residuals, within demonstrations."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array


def autocorrelations(residuals: Array, groups: NDArray[np.intp], most: int) -> Iterator[float]:
    """Autocorrelations r_1, r_2, ... r_most; zero where no two samples are so far apart, or all vanish.

    Parameters
    ----------
    residuals : ndarray, shape (N, k)
        In the order of time within each demonstration.
    groups : ndarray of int, shape (N,)
        Which demonstration each sample is from.
    most : int
        The longest lag.
    """
    count, columns = residuals.shape
    first = np.concatenate(([0], np.flatnonzero(groups[1:] != groups[:-1]) + 1, [count]))
    lengths = first[1:] - first[:-1]
    apart = min(most, int(lengths.max()))
    # With zeros between demonstrations, products of neighbours are those within demonstrations.
    spread = np.zeros((count + apart * len(lengths), columns))
    spread[np.arange(count) + np.repeat(apart * np.arange(len(lengths)), lengths)] = residuals
    values, pairs = spread.ravel(), np.maximum(lengths[:, None] - np.arange(apart + 1), 0).sum(axis=0)
    energy = float(values @ values) / max(count, 1)
    for lag in range(1, most + 1):
        none = energy <= 0.0 or lag > apart or not pairs[lag]
        yield 0.0 if none else float(values[lag * columns :] @ values[: -lag * columns]) / float(pairs[lag]) / energy

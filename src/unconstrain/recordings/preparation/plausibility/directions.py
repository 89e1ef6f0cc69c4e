"""Which demonstrations go the other way: a policy learnt from all others, where one is left out, tells."""

from collections.abc import Sequence

import numpy as np

from ....base.arrays import Array
from .outlines import Outline

REACH, RIDGE = 0.3, 3.0
"""How far a place says something of others, in standard deviations of all in each direction, and how much is noise."""

AGAINST, WITH = -0.8, 0.6
"""Cosines with the prediction: of one that goes the other way at most, and of the median one at least.

Rails and doors lead people where others do not predict, or against it: with −0.5, 15 of 100 such sets that nothing is
wrong with were accused, with −0.8 seven; of 120 backward ones among free movements 115 are found in place of 116.
"""

WEAK = 0.15
"""Predictions shorter than this share of the steps say nothing."""


class _Others:
    """Kernel ridge regression of steps on places, each demonstration predicted from all others.

    The kernel is a constant, a linear and a Gaussian one together; leaving a block of rows out is the block-wise form
    of the formula for leaving one out, so that one inverse does for all.
    """

    def __init__(self, outlines: Sequence[Outline]) -> None:
        places = np.concatenate([one.places for one in outlines])
        scale = np.maximum(places.std(axis=0), np.finfo(np.float64).tiny)
        at = (places - places.mean(axis=0)) / scale
        ends = np.cumsum([len(one.places) for one in outlines])
        self._rows = [slice(end - len(one.places), end) for end, one in zip(ends, outlines, strict=True)]
        self.steps = np.concatenate([of_length_one(one.steps / scale) for one in outlines])
        from scipy.linalg import lapack  # takes a fifth of a second to import

        half = lapack.dpotri(lapack.dpotrf(_kernel(at) + RIDGE * np.eye(len(at)))[0])[0]  # at half the price of LU
        self._inverse = np.triu(half) + np.triu(half, 1).T
        self._blocks = [np.linalg.inv(self._inverse[rows, rows]) for rows in self._rows]

    def cosines(self, signs: Array) -> Array:
        """Cosine of each demonstration's steps, times its sign, with those predicted from the others, shape (D,)."""
        steps = self.steps * np.repeat(signs, [rows.stop - rows.start for rows in self._rows])[:, None]
        weighted = self._inverse @ steps
        return np.array(
            [
                _cosine(steps[rows] - block @ weighted[rows], steps[rows])
                for rows, block in zip(self._rows, self._blocks, strict=True)
            ]
        )


def turned_round(outlines: Sequence[Outline]) -> list[int]:
    """Demonstrations, with steps, that agree with all others once they are turned round, and not before."""
    if len(outlines) < 4:
        return []
    others, signs = _Others(outlines), np.ones(len(outlines))
    cosines = others.cosines(signs)
    while (signs < 0).sum() < len(outlines) / 3 and cosines.min() < AGAINST:
        worst = int(np.argmin(cosines))
        signs[worst] *= -1.0
        turned = others.cosines(signs)
        if signs[worst] > 0 or turned[worst] < -AGAINST or turned.mean() < cosines.mean() + 0.15:
            return []
        cosines = turned
    agree = np.median(cosines) >= WITH and cosines.min() >= AGAINST
    return np.flatnonzero(signs < 0).tolist() if agree else []


def _kernel(at: Array) -> Array:
    n, products = at.shape[1], at @ at.T
    lengths = np.diag(products)
    gaussian: Array = np.exp((products - (lengths[:, None] + lengths) / 2) / (n * REACH**2))
    return gaussian + 1.0 + products / n


def of_length_one(steps: Array) -> Array:
    """Steps of a root mean square length of one: how fast a demonstration is says nothing about its direction."""
    length = np.sqrt((steps**2).sum(axis=1).mean())
    return steps / length if length > 0 else steps


def _cosine(predicted: Array, steps: Array) -> float:
    lengths = float(np.linalg.norm(predicted)), float(np.linalg.norm(steps))
    return float((predicted * steps).sum() / (lengths[0] * lengths[1])) if lengths[0] > WEAK * lengths[1] > 0 else 0.0

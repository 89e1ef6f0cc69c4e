"""Maximum likelihood: Gauss-Newton steps on geometric distances, from closed-form starts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import stdtrit

from ...base.arrays import Array
from .mechanism import Mechanism
from .track import Track, correlation_time

MOST_FOR_START = 200
"""Samples on which fits begin."""

RESOLUTION = 1e-6
"""Noise is at least this share of the extent, and as many radians: exact data would be infinitely certain."""

STEP = 1e-5
"""Of central differences, in units of the extent and radians."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A mechanism, and the track that it was fitted to."""

    mechanism: Mechanism
    track: Track

    @cached_property
    def residuals(self) -> Array:
        """Shape (N, c)."""
        return self.mechanism.residuals(self.track)

    @property
    def held(self) -> Array:
        """Residuals of the positions, in each direction that is held, (N, k)."""
        return self.residuals[:, : sum(self.mechanism.form.blocks[:1])]

    @cached_property
    def jacobian(self) -> Array:
        """Change of the residuals with the chart, (k, N, c), by central differences where the mechanism is."""
        track, steps = self.track, STEP * self.mechanism.units(max(abs(self.mechanism.radius), 1.0))
        if self.mechanism.count and not self.mechanism.form.ties:
            off = np.einsum("nk,nkd->nd", self.residuals, self.mechanism.rows(track.positions))
            track = replace(track, positions=track.positions - off)
        ends = [[self.mechanism.moved(way * step).residuals(track) for way in (1, -1)] for step in np.diag(steps)]
        slopes = np.array([(ahead - behind) / (2 * step) for (ahead, behind), step in zip(ends, steps, strict=True)])
        return slopes.reshape(self.mechanism.count, *self.residuals.shape)

    @cached_property
    def time(self) -> float:
        """How many samples are worth one."""
        return correlation_time(self.held, self.track.groups, self.mechanism.count)

    def information(self, variances: Array) -> Array:
        """Fisher information of the chart (k, k), at noise variances (c,)."""
        return np.einsum("inc,jnc,c->ij", self.jacobian, self.jacobian, 1 / variances, optimize=True)

    def certain(self, variances: Array) -> Mechanism:
        """With the covariance of its parameters, by the Jacobian: of a nearly straight arc its square is singular."""
        if not self.mechanism.count:
            return self.mechanism
        whitened = (self.jacobian / np.sqrt(variances * self.time)).reshape(self.mechanism.count, -1)
        inverse: Any = np.linalg.pinv(whitened).T
        freedom = self.residuals.size / self.time - self.mechanism.count
        quantile = float(stdtrit(max(freedom, 1.0), 0.975))
        return replace(self.mechanism, covariance=inverse @ inverse.T, quantile=quantile)


def fit(kind: type[Mechanism], track: Track) -> Fit:
    """The most likely mechanism of a kind, its first steps on part of the samples."""
    few = track.thinned(MOST_FOR_START)
    optima = [Fit(_optimum(start, few, 15), track) for start in kind.starts(track)]
    best = min(optima, key=lambda one: float(np.log(noise([one])).sum()))
    return Fit(_optimum(best.mechanism, track, 40), track)


def noise(fits: list[Fit]) -> Array:
    """Variance of each column of residuals (c,), common to all fits and to the columns of a block."""
    squares = (np.concatenate([one.residuals for one in fits]) ** 2).mean(axis=0)
    blocks = np.split(squares, np.cumsum(fits[0].mechanism.form.blocks)[:-1])
    means = [np.full(len(block), max(block.mean(), RESOLUTION**2)) for block in blocks if len(block)]
    return np.concatenate([np.zeros(0), *means])


def _optimum(start: Mechanism, track: Track, most: int) -> Mechanism:
    """In turn with the noise of the blocks, where there are several."""
    from scipy.optimize import least_squares  # takes long to import

    for _ in start.form.blocks:
        scales = np.sqrt(noise([Fit(start, track)]))

        def whitened(step: Array, start: Mechanism = start, scales: Array = scales) -> Array:
            return (start.moved(step).residuals(track) / scales).ravel()

        start = start.moved(least_squares(whitened, np.zeros(start.count), method="lm", max_nfev=most, ftol=1e-7).x)
    return start

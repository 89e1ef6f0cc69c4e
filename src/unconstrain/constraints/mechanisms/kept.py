"""The round mechanism that one demonstration keeps to: where velocities can not, its positions tell of it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import log

import numpy as np
from numpy.typing import ArrayLike

from ...base.arrays import Array, as_matrix
from .identify import FEWEST, LIKELY, identify
from .mechanism import Mechanism
from .track import noise_by_differences, turned_by

SMALLEST = 1e-9
"""Share of the numbers themselves below which positions that are looked at do not move."""

ROUND = ("circle", "sphere", "cylinder", "screw")

WITHIN, EXACT, NEAR = 1.5, 1e-5, 0.05
"""Positions leave what they keep to by less than so many times what is white in them, or than the second share of their
spread, and not by more than the third: rows that are not in the order of time seem to be all noise.

The first was 0.8 to 1.4 on 170 surfaces of four kinds under noise of 0.3 mm, and 1.9 to 4.3 for free strokes that were
taken for round ones."""

WOUND = 0.75
"""What is held turns less often where free strokes were taken for round ones, up to 0.35 times on 94 of them and 0.65
on a spiral towards its middle; on the legs of a table, knobs and pots it was 1.2 to 2.6 times."""

MOST_POSITIONS = 200
"""Positions, at most, by which a mechanism is named; more are thinned evenly."""


def kept(positions: ArrayLike, wound: bool = False) -> Mechanism | None:
    """Return the round mechanism that one demonstration keeps to, by its positions; None if to none.

    That is so where each kind that is likely is round, and noise that is white explains how far positions leave it. Of
    these kinds it is the one that holds least: a path along a cylinder may be a screw as well.

    Parameters
    ----------
    positions : array_like, shape (T, 2) or (T, 3)
        In the order of time.
    wound : bool
        Only if what is held turns on their way as it seems to on no free stroke: these may turn within a bowl.

    Examples
    --------
    >>> turn, noise = np.linspace(0, 9, 90), np.random.default_rng(0).normal(scale=1e-3, size=(90, 2))
    >>> uc.constraints.kept(0.4 * np.column_stack([np.cos(turn), np.sin(turn)]) + noise).kind
    'circle'
    """
    table = as_matrix(positions, "positions")
    if len(table) < FEWEST:
        return None
    middle, thinned = table.mean(axis=0), table[:: -(-len(table) // MOST_POSITIONS)]
    spread = float(np.sqrt(thinned.var(axis=0).sum()))
    if spread <= SMALLEST * float(np.abs(thinned).max()):
        return None
    white = noise_by_differences(table, np.zeros(len(table), dtype=np.intp))
    most = max(min(WITHIN * white, NEAR * spread), EXACT * spread)
    if _off_quadric(table) > most or (wound and turned_by(np.diff(table, axis=0)) < WOUND):
        return None
    likely = _likely((thinned - middle).tobytes(), table.shape[1])
    round_ = all(one.kind in ROUND and not one.vague for one, _ in likely)
    found, off = min(likely, key=lambda one: one[0].rank)
    found = replace(found, centre=found.centre + middle)
    turned = not wound or max(turned_by(normals) for normals in found.rows(table).swapaxes(0, 1)) >= WOUND
    return found if round_ and off <= most and turned else None


@lru_cache(maxsize=2048)
def _likely(positions: bytes, columns: int) -> list[tuple[Mechanism, float]]:
    """Mechanisms that may be it, the likeliest first, and how far it leaves each; once for all learners that ask."""
    found = identify(np.frombuffer(positions).reshape(-1, columns)).candidates
    worst = found[0].log_evidence - log(LIKELY)
    return [(one.mechanisms[0], one.noise) for one in found if one.log_evidence > worst]


def _off_quadric(positions: Array) -> float:
    """Root mean square distance from the surface of second order that fits best, where it is small (Taubin 1991).

    The polynomial is of least mean square over that of its gradient.
    """
    centred, (first, second) = positions - positions.mean(axis=0), np.triu_indices(positions.shape[1])
    size, unit = np.sqrt((centred**2).mean()), np.eye(positions.shape[1])
    x = centred / size
    values = np.hstack([x, x[:, first] * x[:, second]])
    slopes = x[:, first, None] * unit[second] + x[:, second, None] * unit[first]
    slopes = np.concatenate([np.broadcast_to(unit, (len(x), *unit.shape)), slopes], axis=1)
    scales, axes = np.linalg.eigh(np.einsum("npa,nqa->pq", slopes, slopes) / len(x))
    some = scales > 1e-12 * scales[-1]
    white = (values - values.mean(axis=0)) @ (axes[:, some] / np.sqrt(scales[some]))
    return float(size * np.sqrt(max(np.linalg.eigvalsh(white.T @ white / len(x))[0], 0.0)))

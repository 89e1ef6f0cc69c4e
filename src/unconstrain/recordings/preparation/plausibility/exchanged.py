"""Which demonstration is like no other, and like them with two columns exchanged, or the sign of one turned."""

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np

from ....base.arrays import Array
from .directions import of_length_one
from .outlines import Outline

FEWEST, MOST_COLUMNS = 5, 12
"""Demonstrations that it takes, and columns beyond which there are too many pairs to try."""

FAR, NEARER, ALIKE = 2.0, 5.0, 1.5
"""It is farther from the others than each of these by the first factor, and exchanged nearer by the second and within
the third of these. What comes as near, to within that, is named, too; nothing is if it comes nearer by the first factor
when it is played backwards.

With a second factor of 4, none of 630 recorded movements is so beside others of their kind; put in, 83 % were found. Of
80 sets with it in the tests 5 finds as many, and one fewer without it."""


def exchanged(outlines: Sequence[Outline]) -> tuple[int, list[tuple[int, int]]] | None:
    """The demonstration, and pairs of columns, the same one twice if its sign is turned; None where there is none."""
    turning = frozenset[str]().union(*(one.turning for one in outlines))  # a turn more is no difference
    columns = [at for at, name in enumerate(outlines[0].names) if name not in turning]
    if len(outlines) < FEWEST or not 0 < len(columns) <= MOST_COLUMNS:
        return None
    usual = np.median([one.extent for one in outlines], axis=0)
    scale = np.where([name in turning for name in outlines[0].names], np.inf, np.where(usual > 0, usual, 1.0) / 2.0)
    others = [_table(one, scale) for one in outlines]
    far = [_off(one, [*others[:place], *others[place + 1 :]]) for place, one in enumerate(others)]
    odd = int(np.argmax(far))
    del others[odd]
    rest = max(_off(one, [*others[:place], *others[place + 1 :]]) for place, one in enumerate(others))
    if far[odd] <= FAR * rest:
        return None
    pairs, one = [*combinations_with_replacement(columns, 2)], outlines[odd]
    offs = [_off(_table(_with_exchanged(one, *pair), scale), others) for pair in pairs]
    near, backwards = ALIKE * min(offs), _off(_table(one._replace(steps=-one.steps), scale), others)
    if min(offs) >= min(far[odd] / NEARER, ALIKE * rest) or backwards < far[odd] / FAR:
        return None
    return odd, [pair for pair, off in zip(pairs, offs, strict=True) if off <= near]


def _with_exchanged(one: Outline, first: int, second: int) -> Outline:
    order, signs = np.arange(len(one.extent)), np.ones(len(one.extent))
    order[[first, second]], signs[first] = [second, first], -1.0 if first == second else 1.0
    return one._replace(places=one.places[:, order] * signs, steps=one.steps[:, order] * signs)


def _table(one: Outline, scale: Array) -> Array:
    """Places and steps side by side, in usual extents, (k, 2 n)."""
    return np.hstack([one.places / scale, of_length_one(one.steps / scale)])


def _off(rows: Array, others: Sequence[Array]) -> float:
    """How far rows are from the nearest ones of others, in the mean."""
    from scipy.spatial import KDTree  # slow to import

    return float(KDTree(np.vstack(others)).query(rows)[0].mean())

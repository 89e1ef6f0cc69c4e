"""What is kept of a demonstration to compare it with others."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....base.arrays import Array


class Outline(NamedTuple):
    """A demonstration in a few numbers.

    ``extent`` and ``size`` (n,) of its states, which of them are ``noisy`` (n,), and some ``places`` with the ``steps``
    made there (k, n); its ``title``, and the seconds between samples, NaN where not known. Of its ``turning`` columns,
    angles and orientations, several numbers stand for one place. ``made`` (k, d) is what columns of ``actions`` make of
    each step if they are velocities, per sample where the time is not known; empty where they are said not to be.
    ``exact`` is whether columns are states and their velocities alone, which agree as in what was computed.
    """

    title: str
    interval: float
    names: tuple[str, ...]
    extent: Array
    size: Array
    noisy: NDArray[np.bool_]
    places: Array
    steps: Array
    turning: frozenset[str] = frozenset()
    actions: tuple[str, ...] = ()
    made: Array = np.zeros((0, 0))
    exact: bool = False

    @property
    def push(self) -> float:
        """How far it comes from its first place to its last, as a share of its extent."""
        size = float(np.linalg.norm(self.extent))
        return float(np.linalg.norm(self.places[-1] - self.places[0])) / size if size > 0 else 0.0

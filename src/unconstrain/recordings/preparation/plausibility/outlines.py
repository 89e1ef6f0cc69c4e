"""What is kept of a demonstration to compare it with others."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....base.arrays import Array


class Outline(NamedTuple):
    """A demonstration in a few numbers.

    ``extent`` and ``size`` (n,) of its states, which of them are ``noisy`` (n,), and some ``places`` with the ``steps``
    made there (k, n).
    """

    names: tuple[str, ...]
    extent: Array
    size: Array
    noisy: NDArray[np.bool_]
    places: Array
    steps: Array

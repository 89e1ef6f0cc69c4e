"""A fingertip that circles on a bent sheet, seen by a magnetic tracker.

Published with the library CCL of King's College London, mhoward3210/ccl, and used there to learn a constraint (Zhao et
al., "A library for constraint consistent learning", arXiv:1807.04676). The repository is under the GPL.
"""

from __future__ import annotations

import numpy as np

import unconstrain as uc

from .files import Source
from .rim import POSITION

SOURCE = Source(
    "ccl_trakstar_planar",
    "https://github.com/mhoward3210/ccl/raw/35c10a9b9f76d0791b30699500bf67c049a29ba0/Matlab_Version/data/",
)

RATE_HZ = 50.0
"""Of the tracker."""


def load_fingertip(*, download: bool = False) -> uc.Demonstration:
    """One recording of a minute at 50 Hz.

    The tracker cannot tell a place from the one across its source, and takes it for some rows in three bursts; that is
    undone. In spite of the file's name the sheet is no plane: the positions are 22 mm off the nearest one.

    Parameters
    ----------
    download : bool
        Fetch the file (0.4 MB) if there is no local copy, check it and keep it.

    Returns
    -------
    Demonstration
        Positions in m, velocities in m/s by a Savitzky-Golay filter, times in s.

    Raises
    ------
    ReadError
        As :func:`~unconstrain.datasets.load_rim_wiping`.
    """
    table = np.loadtxt(SOURCE.path("planer_circle.csv", download), delimiter=",", skiprows=1)
    times, positions = 1e-9 * (table[:, 0] - table[0, 0]), table[:, 1:4]
    crossed = (np.diff(positions, axis=0) ** 2).sum(axis=1) > ((positions[1:] + positions[:-1]) ** 2).sum(axis=1)
    signs = np.cumprod(np.append(1.0, np.where(crossed, -1.0, 1.0)))
    recording = uc.Recording(POSITION, signs[:, None] * positions, times, "fingertip")
    return uc.prepare([recording], uc.Recipe(states=POSITION, differentiate="savgol", rate=RATE_HZ))[0]

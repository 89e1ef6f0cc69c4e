"""A tool held by hand that follows a contour in space, with a tracker.

Published with the code of the research group Robotics of KU Leuven, trajectory-invariants/invariants_mat, under the
MIT licence.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

import unconstrain as uc

from .files import Source
from .rim import POSITION

SOURCE = Source(
    "kuleuven_contour",
    "https://github.com/trajectory-invariants/invariants_mat/raw/17e1a426fd98c91964aba59ce1ad97082550d2bc/"
    "data/data_segmented_original/contour/",
)

TRACKER_HZ = 29.0

SETUPS = ("a", "b", "c", "d", "e", "f")
"""How the tool is held and where the contour is."""


def load_contour(setup: str, *, download: bool = False, rate: float = 20.0) -> list[uc.Demonstration]:
    """Two recordings of a contour that is followed once, of five to seven seconds.

    Parameters
    ----------
    setup : str
        ``"a"`` to ``"f"``.
    download : bool
        Fetch the files (0.6 MB) if there are no local copies, check them and keep them.
    rate : float
        Samples per second; the tracker gives 29.

    Returns
    -------
    list of Demonstration
        Positions of the tool's body in m, velocities in m/s by a Savitzky-Golay filter (0.25 s, cubic).

    Raises
    ------
    ReadError
        As :func:`~unconstrain.datasets.load_rim_wiping`.
    """
    recordings = [_recording(SOURCE.path(f"data_demo_{setup}_{take}.dat", download)) for take in (1, 2)]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "rest: ")  # it is known of these recordings
        return uc.prepare(recordings, uc.Recipe(states=POSITION, differentiate="savgol", rate=rate))


def _recording(path: Path) -> uc.Recording:
    """Rows at which the pose changes, at a steady rate: between them the tracker repeats itself."""
    table = np.loadtxt(path, skiprows=1)
    new = np.r_[True, (np.diff(table[:, 1:8], axis=0) != 0).any(axis=1)]
    times, positions = uc.preparation.resample(table[new, 0], table[new, 1:4], TRACKER_HZ)
    return uc.Recording(POSITION, positions, times, path.stem)

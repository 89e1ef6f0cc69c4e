"""The wiping of a car rim by a robot that is led by hand.

Recorded at LASA, EPFL, in 2019 and published with the code of N. Figueroa and A. Billard, arXiv:1710.10060. Its
licence is SimPL-2.0 (copyleft), which is why it does not come with this package.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import unconstrain as uc

from ...base.arrays import Array
from .files import Source

RIM_FILE = "demos_rim_processed_data.mat"
SOURCE = Source(
    "lasa_rim_wiping",
    "https://github.com/nbfigueroa/ICSC-HMM/raw/58f6778f6d1528e5b4204d6deb5cf216b1f33946/test-data/Wiping/",
)

POSITION = ("x", "y", "z")


class _Bout(NamedTuple):
    """Rows ``start`` to ``stop`` of one recording, in which the tool wipes the rim at one tilt."""

    name: str
    recording: int
    start: int
    stop: int
    tilt: str
    backwards: bool = False


# Picked where the tool presses with more than 8 N and trimmed by eye. The force in recordings 3 and 4 is partly
# frozen; there the labels of its authors decide.
RIM_BOUTS = (
    _Bout("A1", 0, 260, 740, "flat"),
    _Bout("A2", 5, 330, 960, "flat"),
    _Bout("A3", 5, 1490, 2080, "flat"),
    _Bout("B1", 1, 270, 945, "tilt40"),
    _Bout("B2", 2, 295, 810, "tilt40"),
    _Bout("B3", 5, 2665, 3255, "tilt40"),
    _Bout("B4", 5, 3460, 4000, "tilt40"),
    _Bout("B5", 5, 4430, 4980, "tilt40"),
    _Bout("C1", 3, 350, 1190, "tilt66", backwards=True),
    _Bout("D1", 4, 345, 880, "tilt67"),
)


@dataclass(frozen=True, eq=False)
class WipingBout:
    """One stretch of wiping on one surface.

    Parameters
    ----------
    name : str
        A1 to A3 flat, B1 to B5 tilted by about 40 degrees, C1 by 66 and D1 by 67, each another way.
    tilt : str
        Which bouts share a surface: flat, tilt40, tilt66, tilt67.
    demonstration : Demonstration
        Positions in m in the frame of the robot's base, velocities in m/s.
    plane_normal : ndarray, shape (3,)
        Unit normal of the plane nearest to the positions, away from the surface.
    tool_normal : ndarray, shape (3,)
        Unit mean of the tool's axis, away from the surface: a second estimate that shares nothing with the first.
    """

    name: str
    tilt: str
    demonstration: uc.Demonstration
    plane_normal: Array
    tool_normal: Array


def load_rim_wiping(*, download: bool = False, rate: float = 20.0, centre: bool = False) -> list[WipingBout]:
    """Ten bouts of a robot arm that is led by hand to wipe a car rim at four tilts.

    Positions at 74 to 103 Hz are differentiated by a Savitzky-Golay filter (0.25 s, cubic) and
    resampled. C1 was wiped the other way round and is given reversed in time, so that
    one policy can explain all ten.

    Parameters
    ----------
    download : bool
        Fetch the file (3 MB) if there is no local copy, check it and keep it.
    rate : float
        Samples per second.
    centre : bool
        Positions from the centroid of each bout rather than from the robot's base.

    Returns
    -------
    list of WipingBout

    Raises
    ------
    ReadError
        If there is no local copy and ``download`` is False, the download fails, or the file is not the published one.
    MissingExtraError
        If a download is asked for and the extra ``data`` is not installed.

    Notes
    -----
    A local copy is looked for in the folder named by the environment variable
    ``UNCONSTRAIN_DATA``, and there in ``lasa_rim_wiping/``; then in the cache of earlier downloads.
    """
    recordings = _load_rim(SOURCE.path(RIM_FILE, download))
    return [_cut(recordings[bout.recording], bout, rate, centre) for bout in RIM_BOUTS]


class _Track(NamedTuple):
    """One recording: seconds between samples, positions (T, 3), axis of the tool (T, 3)."""

    interval: float
    positions: Array
    tool_axes: Array


def _load_rim(path: Path) -> list[_Track]:
    from scipy.io import loadmat  # slow to import

    cells = loadmat(path)["proc_data"].ravel()
    return [_track(cell[0, 0]) for cell in cells]


def _track(fields: Any) -> _Track:
    # X: position, orientation (w, x, y, z), wrench. H: pose of the tool, whose z axis points at the surface.
    return _Track(float(fields["dt"].item()), fields["X"][:3].T, -fields["H"][:3, 2].T)


def _cut(track: _Track, bout: _Bout, rate: float, centre: bool) -> WipingBout:
    rows = slice(bout.start, bout.stop)
    positions = track.positions[rows]
    tool = track.tool_axes[rows].mean(axis=0)
    plane = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=False)[2][2]
    recording = uc.Recording(
        POSITION, positions, track.interval * np.arange(len(positions), dtype=np.float64), bout.name
    )
    recipe = uc.Recipe(states=POSITION, differentiate="savgol", rate=rate, centre=centre)
    [demonstration] = uc.prepare(recording, recipe)
    return WipingBout(
        name=bout.name,
        tilt=bout.tilt,
        demonstration=_reversed(demonstration) if bout.backwards else demonstration,
        plane_normal=plane * np.sign(plane @ tool),
        tool_normal=tool / np.linalg.norm(tool),
    )


def _reversed(demonstration: uc.Demonstration) -> uc.Demonstration:
    """The same way, walked back."""
    times = demonstration.times
    return replace(
        demonstration,
        states=demonstration.states[::-1],
        actions=-demonstration.actions[::-1],
        times=None if times is None else times[-1] - times[::-1],
    )

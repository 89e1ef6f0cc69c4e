"""Movements that people made freely, in two halves: one to develop on, one to report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from zlib import crc32

import numpy as np

import unconstrain as uc

from ....base.errors import ReadError, SettingError
from ...datasets import load_contour, load_hand_tracks, load_handwriting, load_rim_wiping
from ...datasets.contours import SETUPS
from ...datasets.hands import SIGNS
from ...datasets.handwriting import SHAPES

PIECES_S = 1.5
"""Longer recordings are cut into demonstrations of this length, s."""


@dataclass(frozen=True)
class Movement:
    """One class of movements, recorded several times.

    Parameters
    ----------
    source : str
        Such as "handwriting".
    name : str
        Such as "Angle".
    every : callable
        All its recordings, whose actions are velocities that nothing known constrained.
    dimensions : int
    at_most : int
        So many of the recordings, drawn at random, are learnt from.
    """

    source: str
    name: str
    every: Callable[[], list[uc.Demonstration]]
    dimensions: int = 2
    at_most: int = 15

    def load(self, rng: np.random.Generator) -> list[uc.Demonstration]:
        """Demonstrations to learn from."""
        found = self.every()
        return [found[index] for index in np.sort(rng.permutation(len(found))[: self.at_most])]

    @property
    def title(self) -> str:
        """Such as "handwriting, Angle"."""
        return f"{self.source}, {self.name}"


def movements(report: bool) -> list[Movement]:
    """One half of all movements, in an order that mixes the sources; those whose files are missing are left out.

    In each source, every second movement by the checksum of its name is reported.
    """
    halves = [_halves(source)[0 if report else 1] for source in _every() if _is_here(source[0])]
    return sorted((one for half in halves for one in half), key=_checksum)


def missing() -> list[str]:
    """Sources whose files are not on this machine."""
    return [source[0].source for source in _every() if not _is_here(source[0])]


def named(title: str) -> tuple[Movement, Movement]:
    """A movement, and the next of the same source in the same half."""
    for half in (half for source in _every() for half in _halves(source)):
        for movement, following in zip(half, (*half[1:], half[0]), strict=True):
            if movement.title == title:
                return movement, following
    raise SettingError(f"movement: got {title!r}, expected one of those listed by movements().")


def _halves(source: Sequence[Movement]) -> tuple[list[Movement], list[Movement]]:
    """Those to report, and those to develop on."""
    ordered = sorted(source, key=_checksum)
    return ordered[::2], ordered[1::2]


def _checksum(movement: Movement) -> int:
    return crc32(movement.title.encode())


@cache
def _every() -> tuple[tuple[Movement, ...], ...]:
    """All movements, by source."""
    return (
        tuple(Movement("handwriting", shape, partial(load_handwriting, shape)) for shape in SHAPES),
        tuple(Movement("signs", f"sign {sign}", partial(load_hand_tracks, sign)) for sign in SIGNS),
        tuple(Movement("contour", f"setup {setup}", partial(_contour, setup), 3) for setup in SETUPS),
        tuple(Movement("rim", tilt, partial(_bouts, tilt), 3) for tilt in ("flat", "tilt40")),
    )


def _is_here(movement: Movement) -> bool:
    try:
        movement.every()
    except ReadError:
        return False
    return True


def _contour(setup: str) -> list[uc.Demonstration]:
    return _pieces(load_contour(setup))


def _bouts(tilt: str) -> list[uc.Demonstration]:
    return _pieces([bout.demonstration for bout in load_rim_wiping(centre=True) if bout.tilt == tilt])


def _pieces(demonstrations: Sequence[uc.Demonstration]) -> list[uc.Demonstration]:
    """Cut at regular intervals, each piece with a clock of its own."""
    found = []
    for demo in demonstrations:
        assert demo.times is not None
        count = max(1, round(float(demo.times[-1] - demo.times[0]) / PIECES_S))
        for index, rows in enumerate(np.array_split(np.arange(len(demo)), count)):
            piece = demo[rows]
            assert piece.times is not None
            found.append(replace(piece, times=piece.times - piece.times[0], name=f"{demo.name}, {index + 1}"))
    return found

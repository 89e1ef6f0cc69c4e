"""Make the recordings that come with the package: ``python scripts/example_data.py``; needs the extra ``sim``.

A hand in the physics engine wipes plates of other tilts, two strokes on each, and a camera watches its sponge at 20
frames a second: :mod:`unconstrain.paper.simulation`. Positions are relative to the middle of the plate, to a tenth of
a millimetre.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import unconstrain as uc
from unconstrain.paper.simulation.hand import record
from unconstrain.paper.systems.wiping import HELD_OUT, PLATES, Plate, Strokes, WipingPolicy

FOLDER = Path(uc.datasets.__file__).parent / "wiping"
STROKES = Strokes(count=2, duration=16.0)


def table(recording: uc.Recording) -> str:
    """One recording as CSV, with units in its header."""
    rows = np.column_stack([recording.times, recording.values])
    lines = (f"{time:.2f},{x:.4f},{y:.4f},{z:.4f}" for time, x, y, z in rows)
    return "\n".join(["t [s],x [m],y [m],z [m]", *lines, ""])


def tables(plate: Plate, number: int) -> dict[str, str]:
    """By the names of their files, the strokes on a plate."""
    strokes = record(plate, np.random.default_rng(number), WipingPolicy(), STROKES)
    return {f"plate{number}_{stroke}.csv": table(recording) for stroke, recording in enumerate(strokes, start=1)}


def main(folder: Path = FOLDER) -> None:
    """Write them."""
    (folder / "unseen").mkdir(parents=True, exist_ok=True)
    for number, plate in enumerate(PLATES, start=1):
        place = folder / "unseen" if plate in HELD_OUT else folder
        for name, text in tables(plate, number).items():
            (place / name).write_text(text, "utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=FOLDER)
    main(parser.parse_args().folder)

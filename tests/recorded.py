"""Real recordings: beside the clone, or where UNCONSTRAIN_DATA says; tests that need them are skipped without."""

import os
from pathlib import Path

import pytest

DATA = Path(os.environ.get("UNCONSTRAIN_DATA", Path(__file__).parents[2] / "shared" / "data"))
RIM = DATA / "lasa_rim_wiping"

needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"no real recordings in {DATA}; set UNCONSTRAIN_DATA to a folder that holds them"
)
needs_rim = pytest.mark.skipif(
    not (RIM / "demos_rim_processed_data.mat").is_file(),
    reason=f"no car-rim recordings in {RIM}; set UNCONSTRAIN_DATA to a folder that holds lasa_rim_wiping/",
)

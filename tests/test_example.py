"""The recordings that come with the package: ours, small, as they were made, and written by one command."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import example_data
import unconstrain as uc
from test_cli import refused, run
from unconstrain.paper.systems.wiping import HELD_OUT, PLATES

DOCS = Path(__file__).parent.parent / "docs"


def inside(path):
    return {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()}


def test_one_command_writes_all_that_came_along(tmp_path):
    said = run("example", tmp_path / "wiping")
    assert inside(tmp_path / "wiping") == inside(example_data.FOLDER)
    assert sum(map(len, inside(example_data.FOLDER).values())) < 200_000
    assert f"unconstrain inspect {tmp_path / 'wiping' / '*.csv'}" in said
    assert "--force to replace it" in refused("example", tmp_path / "wiping")


def test_each_file_says_its_units_and_has_lost_frames_at_most():
    files = sorted(example_data.FOLDER.rglob("*.csv"))
    assert len(files) == 2 * len(PLATES)
    for one in uc.read(files):
        assert dict(one.units) == {f"{axis} [m]": "m" for axis in "xyz"}
        assert_allclose(np.diff(one.times) / 0.05, np.rint(np.diff(one.times) / 0.05), atol=1e-9)
        assert 150 < len(one) <= example_data.STROKES.samples


def test_the_script_makes_what_came_along():
    for name, text in example_data.tables(PLATES[1], 2).items():
        made, kept = (
            np.array([row.split(",") for row in each.split()[6:]], float)
            for each in (text, (example_data.FOLDER / name).read_text())
        )
        assert_allclose(made, kept, atol=1e-3)  # releases of the engine differ by less


@pytest.mark.parametrize("plate", HELD_OUT, ids=str)
def test_the_readme_beside_them_tells_the_normals(plate):
    told = re.findall(r"\((-?[\d.]+), 0, ([\d.]+)\)", (example_data.FOLDER / "README.txt").read_text())
    normal = plate.rotation[:, 2]
    assert min(np.abs(np.subtract(normal[[0, 2]], list(map(float, one)))).max() for one in told) < 1e-4


def test_the_document_shows_them_as_they_are():
    shown = re.search(r"code-block:: text\n\n((?: {4}.*\n)+)", (DOCS / "from_zero.rst").read_text())[1]
    lines = [line.strip() for line in shown.splitlines()]
    assert (example_data.FOLDER / "plate1_1.csv").read_text().splitlines()[: len(lines)] == lines

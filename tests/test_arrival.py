"""The experiment of motion that arrives."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from recorded import DATA, needs_data
from unconstrain.paper import pages
from unconstrain.paper.experiments import arrival
from unconstrain.paper.experiments.arrival import cycles, paths


@pytest.fixture(scope="module")
def small(once):
    settings = arrival.Settings(trials=3, only=("Line",), dt=0.02, every=40)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UNCONSTRAIN_DATA", str(DATA))
        return once("small arrival", lambda: arrival.run(settings))


@needs_data
def test_a_shape_arrives_free_and_on_planes_at_a_small_price(small):
    [row], [plane] = small.rows, small.tables["planes"]
    assert row["shown_guided"] == row["random_guided"] == plane["own_planes"] == plane["falls"] == 1.0
    assert row["shown_unguided"] == 0.0
    assert row["correction"] < 0.1
    assert max(row["nupe_ratio"], plane["nupe_ratio"], small.tables["prices"][0]["1 ms"]) < 1.1


@needs_data
def test_it_has_sentences_and_a_page_with_a_picture_of_every_shape(small):
    assert arrival.headlines(small)[0].startswith("arrive within 5 %, demonstrated starts: guided 100.0%, else 0.0%")
    page = pages.page(small)
    assert "small pictures" not in page
    assert ">Line<" in page
    assert "Narrow hairpins" in page


@needs_data
def test_a_recorded_bout_keeps_radius_and_pace(monkeypatch):
    monkeypatch.setenv("UNCONSTRAIN_DATA", str(DATA))
    [row] = cycles.followed(5, arrival.Settings(turns=8))
    assert row["cycle"] == "B2"
    assert row["turns"] >= 8
    assert abs(row["radius_off"]) < 0.1
    assert abs(row["pace_off"]) < 0.05
    assert row["drift_mm"] < 5.0


def test_the_area_between_two_lines_is_that_of_the_strip():
    along = np.linspace(0, 4, 50)
    one, other = np.column_stack([along, 0 * along]), np.column_stack([along, 0 * along + 0.5])
    assert_allclose(paths.swept_area(one, other), 2.0)
    assert paths.swept_area(one[::7], one) < 1e-12
    assert_allclose(paths.warped(one, other), 0.5, rtol=1e-6)


def test_radius_pace_and_drift_of_a_circle_that_moves():
    times = 0.05 * np.arange(2000)
    angle = 2 * np.pi * 0.4 * times
    path = 0.3 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    found = cycles.measured(path + np.outer(times, [1e-4, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0.05)
    assert found["turns"] == 39
    assert_allclose(found["pace"], 0.4, rtol=1e-3)
    assert_allclose(found["radius"], 0.3, rtol=1e-3)
    assert_allclose(found["drift"], 38 / 0.4 * 1e-4, rtol=0.1)

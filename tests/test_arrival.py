"""The experiment of motion that arrives."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import unconstrain as uc
from recorded import DATA, needs_data
from unconstrain.paper import commands, pages
from unconstrain.paper.experiments import arrival
from unconstrain.paper.experiments.arrival import cycles, paths, stable, strokes
from unconstrain.paper.experiments.trials import Result


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
    assert row["random_unguided"] < 1.0
    assert row["correction"] < 0.1
    assert max(row["nupe_ratio"], plane["nupe_ratio"], small.tables["prices"][0]["1 ms"]) < 1.1


@needs_data
def test_it_has_sentences_and_a_page_with_a_picture_of_every_shape(small):
    assert arrival.headlines(small)[0].startswith("arrive within 5 %, demonstrated starts: guided 100.0%, else ")
    page = pages.page(small)
    assert "small pictures" not in page
    assert ">Line<" in page
    assert "Narrow hairpins" in page
    assert "LPV-DS (Figueroa and Billard 2018)" in page


@needs_data
def test_where_nothing_arrives_it_is_told_without_an_area(small):
    none = [{**row, "area": None, "dtw": None} for row in small.rows]
    ways = [{**row, "area": None} if row["way"] == "guided" else row for row in small.tables["ways"]]
    said = arrival.headlines(replace(small, rows=none, tables={**small.tables, "ways": ways}))
    assert any(line.startswith("area between path and stroke: nan mm²") for line in said)
    assert any(line.startswith("guided paths sweep nan times the area of LPV-DS ones") for line in said)


@needs_data
def test_what_arrives_by_construction_is_measured_beside(small):
    found = arrival.by_way(small.tables["ways"])
    assert list(found) == ["unguided", "guided", "contracting", "stable"]
    alone = found["unguided"]["area"]  # where any of them arrives
    assert small.rows[0]["area_ratio"] == (alone and pytest.approx(found["guided"]["area"] / alone))
    for way in ("guided", "contracting", "stable"):
        assert found[way]["shown"] == found[way]["random"] == 1.0
        assert 0.0 < found[way]["dtw"] < 10.0
    assert found["guided"]["area"] == small.rows[0]["area"]
    assert found["contracting"]["step_us"] < found["guided"]["step_us"]
    assert small.tables["planes"][0]["contracting"] == 1.0
    said = next(line for line in arrival.headlines(small) if "LPV-DS" in line)
    ratio = found["guided"]["area"] / found["stable"]["area"]
    assert said.startswith(f"guided paths sweep {ratio:.2f} times the area of LPV-DS ones")


def test_the_stable_method_beside_learns_a_linear_system_and_falls_everywhere_in_one_metric():
    goal = np.array([1.0, -2.0])
    linear = np.array([[-1.0, 4.0], [-0.5, -1.0]])  # leads away from the goal at times: its metric is no circle
    demos = uc.rollout(lambda x: (x - goal) @ linear.T, [[3.0, -2.0], [1.0, -1.0], [0.0, -3.0]], 60, 0.05)
    policy = stable.stable(demos, goal, rate=0.1)
    around = goal + np.random.default_rng(0).uniform(-3, 3, (30, 2))
    states, actions, _ = uc.stack(demos)
    assert np.linalg.norm(policy(states) - actions) < 0.01 * np.linalg.norm(actions)
    bent = uc.rollout(lambda x: (x - goal) @ linear.T * (1 + 0.5 * np.sin(3 * x[:, :1])), around[:5], 60, 0.05)
    runs = uc.rollout(stable.stable(bent, goal, rate=0.2), goal + 5 * (around - goal), 2500, 0.01)
    assert max(np.linalg.norm(run.states[-1] - goal) for run in runs) < 0.1


@needs_data
def test_a_recorded_bout_keeps_radius_and_pace(monkeypatch):
    monkeypatch.setenv("UNCONSTRAIN_DATA", str(DATA))
    [row] = cycles.followed(5, arrival.Settings(turns=8))
    assert row["cycle"] == "B2"
    assert row["turns"] >= 8
    assert abs(row["radius_off"]) < 0.1
    assert abs(row["pace_off"]) < 0.05
    assert row["drift_mm"] < 5.0


CYCLE = "turns radius_shown pace_shown radius_off pace_off drift_mm correction energy nupe_ratio"


def test_of_cycles_alone_the_terminal_has_their_rows_and_a_page_is_written(tmp_path):
    found = [
        {"cycle": name, **dict.fromkeys(CYCLE.split(), 0.1)} for name in ("flat", *map(str, range(cycles.BOUTS + 1)))
    ]
    tables = {"planes": [], "ways": [], "prices": [], "cycles": found}
    result = Result("arrival", arrival.Settings(only=("cycles",)), [], {"drawn": {}}, tables)
    head, rows = commands.summary(result)
    assert (head[0], rows[0][0], len(rows)) == ("cycle", "flat", cycles.BOUTS + 2)
    assert pages.write(result, tmp_path)[1].is_file()


def test_movements_are_those_of_a_rollout():
    goal, planes = np.zeros(2), [uc.constraints.Plane([1.0, 0.5]), uc.constraints.Plane([0.0, 1.0])]
    shown = uc.rollout(lambda x: x @ np.array([[-1.0, 1.0], [-1.0, -1.0]]), np.eye(2), 40, 0.1)
    policy = uc.LocallyLinearPolicy(None, learner="direct").fit_demonstrations(shown)
    guided, settings = uc.Guided(policy, goal, demonstrations=shown), arrival.Settings(longest=0.5)
    projections = uc.null_space_projection(np.stack([plane.normal for plane in planes])[:, None])
    flow, starts = strokes.flow(policy, guided.aim_, projections), [[2.0, 1.0], [-1.0, 0.5]]
    found = strokes.followed(flow, starts, shown, settings, 0.05)
    for path, run in zip(found, uc.rollout(guided, starts, len(found[0]), 0.05, planes, method="euler"), strict=True):
        assert_allclose(path, run.states, atol=1e-12)


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

"""Recordings go out to other programs and come back, and series of different rates onto one clock."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from foreign import ACTIONS, STATES, STEPS, bag, robomimic
from unconstrain.base.errors import InvalidDataError, SettingError, WriteError
from unconstrain.cli import main
from unconstrain.recordings.preparation import align

COLUMNS = ("x", "y", "z", "vx", "vy", "vz")
MOVEMENTS = [
    uc.Recording(
        COLUMNS, np.hstack([k * STATES, ACTIONS]), STEPS * 0.02, f"move_{k}", attributes={"task": f"task {k % 2}"}
    )
    for k in (1, 2, 3)
]


def written(path, recordings=MOVEMENTS, **told):
    uc.writers.write_recordings(recordings, path, **told)
    return path


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_tables_come_back_to_the_last_digit(tmp_path, suffix):
    again = uc.read(written(tmp_path / f"a.{suffix}"))
    for one, other in zip(MOVEMENTS, again, strict=True):
        assert (one.name, one.columns) == (other.name, other.columns)
        assert_array_equal(one.values, other.values)
        assert_array_equal(one.times, other.times)


@given(st.lists(st.floats(allow_infinity=False), min_size=1, max_size=5))
def test_any_number_comes_back_from_text(tmp_path_factory, numbers):
    values = np.array([[1.0, number] for number in [0.0, *numbers]])
    path = written(tmp_path_factory.mktemp("any") / "a.csv", [uc.Recording(("a", "b"), values, None, "one")])
    assert_array_equal(uc.read(path)[0].values, values)


def test_lerobot_comes_back_with_its_names_rate_and_tasks(tmp_path):
    root = written(tmp_path / "set", states=COLUMNS[:3], actions=COLUMNS[3:])
    info = json.loads((root / "meta" / "info.json").read_text())
    assert (info["fps"], info["total_episodes"], info["total_frames"]) == (50, 3, 90)
    assert info["features"]["action"] == {"dtype": "float32", "shape": [3], "names": ["vx", "vy", "vz"]}
    again = uc.read(root)
    for one, other in zip(MOVEMENTS, again, strict=True):
        recipe = uc.Recipe("observation.state", "action", action_is="velocity")
        [demonstration] = uc.prepare(other, recipe)
        assert_allclose(demonstration.states, one.values[:, :3], atol=1e-6)
        assert_allclose(demonstration.actions, one.values[:, 3:], atol=1e-6)
        assert_allclose(other.times, one.times, atol=1e-6)
        assert other.attributes["task"] == one.attributes["task"]
    written(root, MOVEMENTS[:1])
    assert len(uc.read(root)) == 1


def test_a_folder_that_is_something_else_is_left_alone(tmp_path):
    (tmp_path / "home" / "letters").mkdir(parents=True)
    with pytest.raises(SettingError, match="is there and no LeRobot data set"):
        written(tmp_path / "home")
    assert (tmp_path / "home" / "letters").is_dir()


def test_mcap_comes_back_topic_by_topic(tmp_path):
    path = written(tmp_path / "a.mcap", states=COLUMNS[:3], actions=COLUMNS[3:])
    for one in MOVEMENTS:
        [other] = uc.read(path, topic=one.name)
        assert_array_equal(other.values, one.values)
        assert_allclose(other.times, one.times, atol=1e-9)
    with pytest.raises(SettingError, match="3 states and 1 actions"):
        written(tmp_path / "b.mcap", states=COLUMNS[:3], actions=COLUMNS[3:4])


@pytest.mark.parametrize(
    ("recordings", "name", "error", "sentence"),
    [
        (MOVEMENTS, "a.doc", SettingError, r"got the suffix '\.doc', expected \.csv, \.parquet, \.mcap, or none"),
        ([MOVEMENTS[0], uc.Recording(("x",), STATES[:, :1])], "a.csv", SettingError, "only recordings of the same"),
        ([uc.Recording(("x",), STATES[:, :1], None, "still")], "set", WriteError, "'still': has no times"),
        (MOVEMENTS, "gone/a.csv", WriteError, "cannot be written"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, recordings, name, error, sentence):
    with pytest.raises(error, match=sentence):
        written(tmp_path / name, recordings)
    assert list(tmp_path.iterdir()) == []


# The command


def run(*arguments):
    return CliRunner().invoke(main, ["convert", *map(str, arguments)])


def test_convert_goes_from_robomimic_to_lerobot(tmp_path):
    done = run(robomimic(tmp_path / "a.hdf5"), tmp_path / "set", "--state", "robot0_eef_pos", "--action", "actions")
    assert done.exit_code == 0, done.output
    again = uc.read(tmp_path / "set")
    assert len(again) == 3
    assert_allclose(uc.prepare(again[1], uc.Recipe("observation.state", "action"))[0].actions, ACTIONS, atol=1e-6)


def test_convert_brings_topics_onto_one_clock(tmp_path):
    path = bag(tmp_path / "a.bag", "bag")
    done = run(path, tmp_path / "a.csv", "--topic", "/joint_states,/pose", "--align")
    assert done.exit_code == 0, done.output
    [both] = uc.read(tmp_path / "a.csv")
    assert_array_equal(both.select(["position.a", "pose.position.y"]), STATES[:, :2])


def test_convert_does_not_write_over_what_is_there_or_read(tmp_path):
    path = written(tmp_path / "a.csv")
    assert "is one of the files to read" in run(path, path, "--force").output
    assert run(path, tmp_path / "b.csv").exit_code == 0
    assert "or --force to replace it" in run(path, tmp_path / "b.csv").output
    assert run(path, tmp_path / "b.csv", "--force").exit_code == 0


# One clock


def sampled(rate, start=0.0, length=2.0, name="a", **attributes):
    times = start + np.arange(round(length * rate)) / rate
    values = np.column_stack([np.sin(3 * times), times])
    clock = times if not attributes else times - start
    return uc.Recording((f"{name}1", f"{name}2"), values, clock, name, attributes=attributes)


@pytest.mark.parametrize("rates", [(50, 50), (50, 70), (50, 1000), (1000, 50)])
def test_series_of_different_rates_come_onto_the_clock_of_the_slowest(rates):
    one, other = sampled(rates[0], name="a"), sampled(rates[1], start=0.3, name="b")
    both = align([one, other])
    assert both.columns == ("a1", "a2", "b1", "b2")
    assert both.times[0] == 0.0
    assert_allclose(np.diff(both.times), 1 / min(rates))
    inside = both.values[1:-1]
    assert_allclose(inside[:, 2:], inside[:, :2], atol=2e-2 if max(rates) > 500 else 2e-3)


def test_fast_series_are_averaged_not_picked():
    noise = np.random.default_rng(0).normal(size=2000)
    fast = uc.Recording(("f",), noise[:, None], np.arange(2000) / 1000, "force")
    both = align([sampled(50), fast])
    assert both.select(["f"]).std() < 0.35  # twenty samples each, so a spread of 1 / sqrt(20)


def test_clocks_that_know_when_they_began_are_moved_by_it():
    one, other = sampled(50, start_ns=5_000_000_000), sampled(50, start=0.5, name="b", start_ns=5_500_000_000)
    both = align([one, other])
    assert_allclose(both.select(["a2"]), both.select(["b2"]), atol=1e-9)


def test_equal_names_are_told_apart_by_the_recording():
    assert align([sampled(50), sampled(50)]).columns == ("a/a1", "a/a2", "a/a1.1", "a/a2.1")


@pytest.mark.parametrize(
    ("recordings", "sentence"),
    [
        ([sampled(50), uc.Recording(("x",), STATES[:, :1], None, "b")], "'b': has no times that increase"),
        ([sampled(50), sampled(50, start=9.0)], "were not recorded at one time"),
    ],
)
def test_what_cannot_be_aligned_is_refused(recordings, sentence):
    with pytest.raises(InvalidDataError, match=sentence):
        align(recordings)

"""Which columns are meant, and what clocks count."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import unconstrain as uc
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.recordings.columns import resolve
from unconstrain.recordings.demonstration import Recording
from unconstrain.recordings.preparation.recipes import complete_recipe
from unconstrain.recordings.readers import Reading
from unconstrain.recordings.readers.clocks import find_clock, find_clock_of, read_words


def seconds(stamps, name):
    return find_clock_of(stamps, name).seconds(stamps)


COLUMNS = (
    "q1",
    "q2",
    "q10",
    "action1",
    "action2",
    "hand.X",
    "hand.Y",
    "joint_a",
    "joint_b",
    "observation.state.x",
    "x",
)


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        (("q2", "q1"), ("q2", "q1")),
        (("q",), ("q1", "q2", "q10")),
        (("q?",), ("q1", "q2")),
        (("q1..q2",), ("q1", "q2")),
        (("q1..2",), ("q1", "q2")),
        (("hand.X..joint_a",), ("hand.X", "hand.Y", "joint_a")),
        (("joint_?", "q1"), ("joint_a", "joint_b", "q1")),
        (("action",), ("action1", "action2")),
        (("observation.state",), ("observation.state.x",)),
        (("hand",), ("hand.X", "hand.Y")),
        (("Y",), ("hand.Y",)),
        (("x",), ("x",)),
        (("gone", "q1"), ("gone", "q1")),
        (("q?", "q1"), ("q1", "q2")),
    ],
)
def test_names_mean_columns(asked, meant):
    assert resolve(asked, COLUMNS) == meant


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        (("x", "y"), ("x [m]", "y (m)")),
        (("q1..q2",), ("q1 [rad]", "q2 [rad]")),
        (("x..q1",), ("x [m]", "y (m)", "q1 [rad]")),
        (("d",), ("d",)),
        (("s",), ("s",)),
        (("v",), ("v[0]", "v[1]")),
    ],
    ids=" ".join,
)
def test_units_need_not_be_named(asked, meant):
    """But where two columns differ in nothing else, nobody knows which one is meant."""
    assert (
        resolve(asked, ["x [m]", "y (m)", "q1 [rad]", "q2 [rad]", "d", "d [m]", "s [m]", "s [s]", "v[0]", "v[1]"])
        == meant
    )


@given(st.lists(st.sampled_from(COLUMNS), min_size=1, unique=True))
def test_names_of_columns_mean_themselves(names):
    assert resolve(names, COLUMNS) == tuple(names)


def complete(columns, **told):
    return complete_recipe(uc.Recipe(**told), Recording(tuple(columns), np.ones((2, len(columns)))))


def numbered(head, first=0, count=3):
    return [f"{head}{at}" for at in range(first, first + count)]


@pytest.mark.parametrize(
    ("states", "actions", "others"),
    [
        (["X", "Y", "Z"], "savgol", ["Frame"]),
        (["pose_x", "pose_y", "pose_z"], "savgol", ["pose_qx", "pose_qy", "pose_qz", "pose_qw"]),
        (numbered("joint_"), "savgol", ["gripper"]),
        (numbered("q"), "savgol", []),
        (numbered("actual_q_"), numbered("actual_qd_"), numbered("actual_TCP_pose_")),
        (numbered("position"), numbered("velocity"), numbered("effort")),
        (numbered("field.position"), numbered("field.velocity"), ["field.header.seq"]),
        (numbered("joint_pos"), numbered("joint_vel"), []),
        ([f"field.pose.position.{a}" for a in "xyz"], "savgol", [f"field.pose.orientation.{a}" for a in "xyzw"]),
        ([f"transform.translation.{a}" for a in "xyz"], "savgol", [f"transform.rotation.{a}" for a in "xyzw"]),
        (numbered("observation.state."), numbered("action."), ["next.done", "index"]),
        (["hand X", "hand Y", "hand Z"], "savgol", ["Frame"]),
        (["x", "y"], ["vx", "vy"], ["fx", "fy"]),
        (["x", "y", "z"], "savgol", ["fx", "fy", "fz"]),
        (["x [mm]", "y [mm]"], ["vx [mm/s]", "vy [mm/s]"], ["fx [N]", "fy [N]"]),
        (["p_x (m)", "p_y (m)", "p_z (m)"], "savgol", [f"q_{a} []" for a in "wxyz"]),
        (["tx", "ty", "tz"], "savgol", ["qx", "qy", "qz", "qw"]),
    ],
)
def test_usual_names_are_understood(states, actions, others):
    recipe = complete([*others, *states, *([] if isinstance(actions, str) else actions)])
    assert recipe.states == tuple(states)
    assert (recipe.differentiate or list(recipe.actions)) == actions


@pytest.mark.parametrize(
    "columns",
    [
        ["left.X", "left.Y", "left.Z", "right.X", "right.Y", "right.Z"],
        [*numbered("states"), *numbered("actions")],
        ["force.x", "force.y", "force.z"],
        ["tx", "ty", "tz", "fx", "fy", "fz", "qx", "qy", "qz", "qw"],
        numbered("column"),
    ],
)
def test_where_names_do_not_tell_it_is_asked(columns):
    with pytest.raises(SettingError, match="states="):
        complete(columns)


def test_what_is_named_as_an_angle_is_a_state_beside_what_is_guessed():
    recipe = complete(["x", "y", "yaw"], angles=("yaw",))
    assert (recipe.states, recipe.differentiate) == (("x", "y", "yaw"), "savgol")
    recipe = complete(["x", "y", "vx", "vy", "yaw", "vyaw"], angles=("yaw",))
    assert (recipe.states, recipe.actions) == (("x", "y", "yaw"), ("vx", "vy", "vyaw"))
    with pytest.raises(InvalidDataError, match="no column 'gone'"):
        complete(["x", "y"], angles=("gone",))


def test_patterns_hold_for_recipes_and_unknown_names_list_the_columns():
    recipe = complete(["q1", "q2", "u1", "u2"], states="q?", actions="u1..u2")
    assert (recipe.states, recipe.actions) == (("q1", "q2"), ("u1", "u2"))
    with pytest.raises(InvalidDataError, match="no column 'p'; it has q1, q2"):
        complete(["q1", "q2"], states="p")


# Clocks


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *(
            (name, 1.0)
            for name in (
                "t",
                "Time",
                "%time",
                "__time",
                "Time (s)",
                "Time (Seconds)",
                "header.stamp",
                "clock",
                "Zeit (s)",
            )
        ),
        *((name, 1e-3) for name in ("Timestamp (ms)", "TimeMs", "time_ms", "t[ms]", "ElapsedTime (msec)", "tms")),
        *((name, 1e-9) for name in ("timestamp [ns]", "field.header.stamp_ns", "robot_time_ns")),
        *((name, 1e-6) for name in ("timestamp_us", "Time [µs]", "time(microseconds)")),
    ],
)
def test_clocks_are_known_by_their_names_and_units(name, unit):
    found = find_clock(["x", name])
    assert found is not None
    assert found.whole == name
    assert_allclose(seconds(np.array([0.0, 20.0]), name), [0.0, 20 * unit])


@pytest.mark.parametrize("name", ["x", "torque", "tool", "temperature", "step", "dt", "distance"])
def test_other_names_are_no_clocks(name):
    assert find_clock([name]) is None


@pytest.mark.parametrize("prefix", ["", "header.stamp.", "field.header."])
@pytest.mark.parametrize(("whole", "part"), [("secs", "nsecs"), ("sec", "nanosec"), ("seconds", "nanoseconds")])
def test_seconds_and_nanoseconds_are_one_clock(tmp_path, prefix, whole, part):
    steps = np.arange(100) * 20_000_000
    rows = "".join(f"{1_700_000_000 + step // 10**9},{step % 10**9},{at}\n" for at, step in enumerate(steps))
    (tmp_path / "a.csv").write_text(f"{prefix}{whole},{prefix}{part},x\n{rows}")
    [recording] = uc.read(tmp_path / "a.csv")
    assert recording.columns == ("x",)
    assert_allclose(recording.times, steps * 1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "apart"),
    [
        ("2024-05-01T10:00:00.000Z", "2024-05-01T10:00:00.020Z", 0.02),
        ("2024-05-01 23:59:59,5", "2024-05-02 00:00:00,25", 0.75),
        ("2024-05-01T10:00:00+02:00", "2024-05-01T10:00:01+02:00", 1.0),
        ("23:59:59.5", "00:00:00.5", 1.0),
        ("1:02.5", "1:03", 0.5),
        ("2024/05/01 10:00:00.00", "2024/05/01 10:00:00.02", 0.02),
    ],
)
def test_words_of_times_become_seconds(first, second, apart):
    times = read_words([first, "", second])
    assert np.isnan(times[1])
    assert times[2] - times[0] == pytest.approx(apart, abs=1e-9)


@pytest.mark.parametrize("words", [["noon"], ["1.5.2024"], [""], ["2024-99-99"], ["10:00", "x"]])
def test_other_words_are_no_times(words):
    assert read_words(words) is None


@pytest.mark.parametrize(("unit", "length"), [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)])
def test_the_unit_of_time_can_be_told(tmp_path, unit, length):
    (tmp_path / "a.csv").write_text("timestamp,x\n0,1\n20,2\n40,3\n")
    [recording] = uc.read(tmp_path / "a.csv", time_unit=unit)
    assert_allclose(recording.times, np.array([0, 20, 40]) * length)


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e6, 1e9])
def test_stamps_since_1970_begin_at_nought_in_any_unit(unit):
    stamps = np.round((1_700_000_000 + np.array([0.0, 0.5, 1.0])) * unit)
    assert_allclose(seconds(stamps, "stamp"), [0.0, 0.5, 1.0] if unit > 1 else [0.0, 0.0, 1.0], atol=1e-6)


def test_a_stamp_of_a_machine_that_is_on_for_a_day_is_left_as_it_is():
    assert_allclose(seconds(np.array([86_400.0, 86_401.0]), "t"), [86_400.0, 86_401.0])


@pytest.mark.parametrize(
    "told",
    [
        {"time_unit": "min"},
        {"group": "a", "time": "a"},
        {"columns": ("x", "x")},
    ],
)
def test_what_cannot_be_told_is_refused(told):
    with pytest.raises(SettingError):
        Reading(**told)


def test_a_range_of_episodes_that_runs_backwards_is_refused():
    with pytest.raises(SettingError, match="expected a range such as 0-9"):
        Reading(episodes=("9-0",)).takes("demo_1")

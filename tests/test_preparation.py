"""Recordings become demonstrations; what was mended on the way is announced."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from recorded import DATA, needs_data
from unconstrain.base.errors import InvalidDataError, SettingError, UnconstrainError
from unconstrain.recordings.demonstration import Demonstration, Recording
from unconstrain.recordings.preparation import (
    PreparationWarning,
    Recipe,
    decide,
    differentiate,
    prepare,
    resample,
    survey,
    trim,
)
from unconstrain.recordings.preparation.movements import Gap, find_gaps
from unconstrain.recordings.preparation.recipes import complete_recipe
from unconstrain.recordings.readers import read

TURN = 3.0  # rad/s
RADIUS = 0.06  # m


def circle(times: np.ndarray) -> np.ndarray:
    return RADIUS * np.column_stack([np.cos(TURN * times), np.sin(TURN * times)])


def circle_velocity(times: np.ndarray) -> np.ndarray:
    return RADIUS * TURN * np.column_stack([-np.sin(TURN * times), np.cos(TURN * times)])


def wiping(times: np.ndarray) -> Recording:
    return Recording(("x", "y"), circle(times), times, "wipe")


def only(demonstrations: list[Demonstration]) -> Demonstration:
    [demonstration] = demonstrations
    return demonstration


STEADY = np.arange(0, 4, 0.01)
JITTERED = STEADY + np.random.default_rng(0).uniform(-0.003, 0.003, len(STEADY))
TORN = STEADY[(STEADY < 1.5) | (STEADY > 2.2)]


# -------------------------------------------------------------------------------------------------- differentiation


@pytest.mark.parametrize(("method", "worst"), [("savgol", 2e-3), ("central", 2e-4)])
def test_the_velocity_of_a_circle_is_found(method: str, worst: float) -> None:
    velocity = differentiate(STEADY, circle(STEADY), method, window_s=0.25, order=3)
    inside = slice(13, -13)
    assert np.abs(velocity - circle_velocity(STEADY))[inside].max() < worst * RADIUS * TURN
    assert np.abs(velocity - circle_velocity(STEADY)).max() < 0.04 * RADIUS * TURN


@pytest.mark.parametrize("order", [2, 3])
def test_a_polynomial_of_the_filters_degree_is_differentiated_exactly_up_to_the_ends(order: int) -> None:
    times = np.arange(50) / 20
    velocity = differentiate(times, times[:, None] ** order, order=order)
    np.testing.assert_allclose(velocity[:, 0], order * times ** (order - 1), atol=1e-9)


def test_central_differences_are_exact_for_parabolas_at_any_stamps() -> None:
    times = np.sort(np.random.default_rng(1).uniform(0, 1, 30))
    velocity = differentiate(times, np.column_stack([times**2, times]), "central")
    np.testing.assert_allclose(velocity, np.column_stack([2 * times, np.ones(30)]), atol=1e-9)


def test_smoothing_beats_differences_on_noise() -> None:
    noisy = circle(STEADY) + np.random.default_rng(2).normal(0, 1e-3, (len(STEADY), 2))
    errors = {
        method: np.linalg.norm(differentiate(STEADY, noisy, method) - circle_velocity(STEADY))
        for method in ("savgol", "central")
    }
    assert errors["savgol"] < errors["central"] / 5


def test_a_window_shorter_than_the_polynomial_needs_is_widened() -> None:
    times = np.arange(10.0)
    np.testing.assert_allclose(differentiate(times, times[:, None], window_s=0.01), 1)


@pytest.mark.parametrize(
    ("times", "method", "sentence"),
    [
        ([0, 1, 1, 2, 3], "savgol", "times: got 1.0 after 1.0 at row 2, expected them to increase."),
        ([0, 1], "central", "positions: got 2 samples, expected at least 3 to differentiate them."),
        ([0, 1, 2, 3.5, 4, 5], "savgol", "times: got irregular stamps, expected uniform ones. Use resample() before"),
    ],
)
def test_stamps_that_cannot_be_differentiated_are_refused(times: list[float], method: str, sentence: str) -> None:
    with pytest.raises(InvalidDataError) as caught:
        differentiate(np.array(times), np.ones((len(times), 1)), method)
    assert sentence in str(caught.value)


def test_an_unknown_method_lists_the_known_ones() -> None:
    with pytest.raises(SettingError, match="differentiate: got 'spline', expected one of savgol, kalman, central"):
        differentiate(STEADY, circle(STEADY), "spline")


# ------------------------------------------------------------------------------------------------------- resampling


@given(st.floats(0.5, 200), st.integers(2, 40), st.integers(0, 1000))
def test_resampling_keeps_straight_lines_and_stays_inside(rate: float, count: int, seed: int) -> None:
    times = np.cumsum(np.random.default_rng(seed).uniform(0.01, 0.2, count))
    grid, values = resample(times, np.column_stack([3 * times - 1, -times]), rate)
    np.testing.assert_allclose(values, np.column_stack([3 * grid - 1, -grid]), atol=1e-6)
    np.testing.assert_allclose(np.diff(grid), 1 / rate)
    assert grid[0] == times[0]
    assert times[-1] - 1 / rate < grid[-1] < times[-1] + 1e-5 / rate


def test_resampling_to_the_same_rate_changes_nothing() -> None:
    times, values = resample(STEADY, circle(STEADY), 100)
    assert times is STEADY
    np.testing.assert_array_equal(values, circle(STEADY))


def test_rates_that_make_no_sense_are_refused() -> None:
    with pytest.raises(SettingError, match="rate: got 0, expected a number above 0"):
        resample(STEADY, circle(STEADY), 0)
    with pytest.raises(SettingError, match=r"rate: got 1e\+12 Hz for 3.99 s, that is 3.99e\+12 samples. Take less."):
        resample(STEADY, circle(STEADY), 1e12)


# --------------------------------------------------------------------------------------------------------- trimming


def test_trimming_takes_seconds_from_both_ends() -> None:
    demonstration = Demonstration(circle(STEADY), circle_velocity(STEADY), STEADY)
    trimmed = trim(demonstration, 0.5, 1.0)
    assert trimmed.times is not None
    np.testing.assert_allclose(trimmed.times[[0, -1]], [0.5, 2.99])


def test_trimming_what_is_still_leaves_pauses_inside() -> None:
    actions = np.array([0, 0, 1, 0, 2, 0.01])[:, None]
    trimmed = trim(Demonstration(np.arange(6.0)[:, None], actions), still=0.1)
    np.testing.assert_array_equal(trimmed.states[:, 0], [2, 3, 4])


def test_trimming_everything_or_without_times_is_refused() -> None:
    timeless = Demonstration(np.ones((3, 1)), np.ones((3, 1)), name="wipe")
    with pytest.raises(InvalidDataError, match=r"'wipe': nothing is left after trimming .* slower than 5\. Trim less"):
        trim(timeless, still=5)
    with pytest.raises(SettingError, match="'wipe' has no times to trim by"):
        trim(timeless, 1)


# ------------------------------------------------------------------------------------------------------ preparation


def test_positions_become_states_and_velocities() -> None:
    demonstration = only(prepare(wiping(STEADY)))
    assert demonstration.name == "wipe"
    np.testing.assert_array_equal(demonstration.states, circle(STEADY))
    np.testing.assert_array_equal(demonstration.actions, differentiate(STEADY, circle(STEADY)))
    np.testing.assert_array_equal(demonstration.times, STEADY)


def test_recorded_actions_are_taken_as_they_are() -> None:
    recording = Recording(("x", "u"), np.array([[1.0, 2], [3, 4]]), None, "a")
    demonstration = only(prepare([recording], Recipe(states=("x",), actions=("u",))))
    np.testing.assert_array_equal(demonstration.states, [[1], [3]])
    np.testing.assert_array_equal(demonstration.actions, [[2], [4]])
    assert demonstration.times is None


def turned(unit: str = "deg", speed: str = "deg/s") -> Recording:
    """An arm's position, an angle in degrees, and the velocities of both."""
    angle = np.column_stack([circle(STEADY)[:, 0], 10 * circle(STEADY)[:, 1]])
    table = np.column_stack([angle, np.gradient(angle, STEADY, axis=0)])
    return Recording(
        ("x", "a", "vx", "va"), table, STEADY, "arm", units={"x": "m", "a": unit, "vx": "m/s", "va": speed}
    )


@pytest.mark.parametrize("unit", ["deg", "Degrees", "°", "deg ", "degree"])
@pytest.mark.parametrize("speed", ["deg/s", "°/s", "deg s^-1", "degrees per second", "deg/sec", "deg s⁻¹"])
def test_columns_in_degrees_by_their_units_are_taken_in_radians(unit: str, speed: str) -> None:
    recording = turned(unit, speed)
    with pytest.warns(PreparationWarning, match=r"degrees: 'arm': a, va is taken in radians; degrees=\(\) forbids it"):
        demonstration = only(prepare(recording))
    np.testing.assert_allclose(demonstration.states, recording.values[:, :2] * [1, np.pi / 180], rtol=1e-15)
    np.testing.assert_allclose(demonstration.actions, recording.values[:, 2:] * [1, np.pi / 180], rtol=1e-15)
    np.testing.assert_array_equal(recording.values, turned().values)  # they are those of the file still


@pytest.mark.parametrize(("unit", "speed"), [("rad", "rad/s"), ("", ""), ("degC", "deg/m"), ("mm", "mm/s")])
def test_other_units_and_none_are_left_as_they_are(unit: str, speed: str) -> None:
    recording = turned(unit, speed)
    demonstration = only(prepare(recording))
    np.testing.assert_array_equal(np.hstack([demonstration.states, demonstration.actions]), recording.values)


def test_degrees_are_told_for_files_without_units_and_forbidden_for_others() -> None:
    bare = turned("", "")
    told = only(prepare(bare, Recipe(states=("x", "a"), differentiate="savgol", degrees=("a",))))
    plain = only(prepare(bare, Recipe(states=("x", "a"), differentiate="savgol")))
    np.testing.assert_allclose(told.actions, plain.actions * [1, np.pi / 180], rtol=1e-12, atol=1e-12)
    forbidden = only(prepare(turned(), Recipe(degrees=())))
    np.testing.assert_array_equal(forbidden.states, bare.values[:, :2])
    with pytest.raises(SettingError, match="degrees: got yaw, expected some of x, a, vx, va"):
        prepare(bare, Recipe(degrees=("yaw",)))


@pytest.mark.parametrize("degrees", [None, ("a", "b", "a_next", "b_next")])
def test_what_was_decided_of_targets_in_degrees_is_decided_so_again(degrees: tuple[str, ...] | None) -> None:
    columns, states = ("a", "b", "a_next", "b_next"), np.degrees(circle(STEADY))
    table = np.hstack([states[:-1], states[1:]])
    units = dict.fromkeys(columns, "deg") if degrees is None else {}
    recording = Recording(columns, table, STEADY[:-1], "arm", units=units)
    asked = Recipe(columns[:2], columns[2:], degrees=degrees)
    decided, remarks = decide(asked, recording)
    assert "targets-as-velocities" in {remark.code for remark in remarks}
    assert (decided.actions, decided.degrees) == (None, ("a", "b"))
    assert decide(decided, recording) == (decided, ())
    assert decide(replace(asked, action_is="target"), recording)[0] == decided
    np.testing.assert_allclose(only(prepare(recording, decided)).states, circle(STEADY)[:-1], rtol=1e-12)


def test_an_angle_in_degrees_is_made_continuous_in_radians() -> None:
    turning = np.degrees(3 * STEADY)
    wrapped = Recording(("a",), ((turning + 180) % 360 - 180)[:, None], STEADY, "crank", units={"a": "°"})
    with pytest.warns(PreparationWarning, match="taken in radians"):
        demonstration = only(prepare(wrapped, Recipe(states=("a",), differentiate="savgol", angles=("a",))))
    np.testing.assert_allclose(demonstration.actions, 3.0, rtol=1e-9)


def test_a_recording_without_times_takes_its_rate_from_the_recipe() -> None:
    demonstration = only(prepare(Recording(("x", "y"), circle(STEADY)), Recipe(rate=100)))
    np.testing.assert_allclose(demonstration.times, STEADY)
    np.testing.assert_allclose(demonstration.actions, differentiate(STEADY, circle(STEADY)), atol=1e-12)


def test_velocities_are_taken_at_the_full_rate_and_then_resampled() -> None:
    demonstration = only(prepare(wiping(STEADY), Recipe(rate=20)))
    assert demonstration.times is not None
    np.testing.assert_allclose(np.diff(demonstration.times), 0.05)
    np.testing.assert_allclose(demonstration.actions, differentiate(STEADY, circle(STEADY))[::5], atol=1e-12)


def test_recorded_actions_are_resampled_with_the_states() -> None:
    recording = Recording(("x", "vx"), np.column_stack([STEADY, 2 * STEADY]), STEADY)
    demonstration = only(prepare(recording, Recipe(rate=7)))
    np.testing.assert_allclose(demonstration.actions, 2 * demonstration.states, atol=1e-12)


def test_centring_subtracts_the_mean_of_each_demonstration() -> None:
    far = Recording(("x", "y"), circle(STEADY) + np.array([5, -3]), STEADY, "far")
    for demonstration in prepare([wiping(STEADY), far], Recipe(centre=True)):
        np.testing.assert_allclose(demonstration.states.mean(axis=0), 0, atol=1e-12)


def test_preparation_trims() -> None:
    demonstration = only(prepare(wiping(STEADY), Recipe(trim=(1, 1))))
    assert demonstration.times is not None
    np.testing.assert_allclose(demonstration.times[[0, -1]], [1, 2.99])
    pause = np.concatenate([np.zeros(50), np.arange(100) * 0.01, np.ones(50)])
    moving = Recording(("x", "y"), np.column_stack([pause, pause]), np.arange(200) * 0.01)
    assert 95 < len(only(prepare(moving, Recipe(still=0.3)))) < 130


def test_irregular_stamps_are_resampled_and_announced() -> None:
    with pytest.warns(PreparationWarning, match=r"^irregular: 'wipe': time stamps are .*, so it is resampled to its"):
        demonstration = only(prepare(wiping(JITTERED)))
    assert demonstration.times is not None
    assert np.ptp(np.diff(demonstration.times)) < 1e-9
    error = np.abs(demonstration.actions - circle_velocity(demonstration.times))
    assert error[13:-13].max() < 0.01 * RADIUS * TURN


def test_central_differences_take_irregular_stamps_as_they_are() -> None:
    demonstration = only(prepare(wiping(JITTERED), Recipe(differentiate="central")))
    np.testing.assert_array_equal(demonstration.times, JITTERED)


def test_intervals_that_drift_by_less_than_irregular_are_differentiated() -> None:
    intervals = np.where(np.arange(399) < 150, 0.01 * 0.991, 0.01)
    intervals[100:110] = 0.01 * 1.0095
    times = np.concatenate([[0], np.cumsum(intervals)])
    times[151:] += 1
    with pytest.warns(PreparationWarning, match="1 gap "):
        demonstration = only(prepare(wiping(times)))
    assert np.abs(demonstration.actions - circle_velocity(times)).max() < 0.06 * RADIUS * TURN


def test_nothing_is_smoothed_across_a_gap() -> None:
    with pytest.warns(PreparationWarning) as caught:
        demonstration = only(prepare(wiping(TORN)))
    assert [str(warning.message) for warning in caught] == [
        (
            "clock-gap: 'wipe', row 150: 1 gap in the time stamps, the longest 0.72 s after 1.49 s; "
            "nothing is smoothed or interpolated across (max_gap_s=)."
        )
    ]
    assert caught[0].filename == __file__
    cut = 150
    np.testing.assert_array_equal(demonstration.times, TORN)
    np.testing.assert_allclose(demonstration.actions[:cut], differentiate(TORN[:cut], circle(TORN[:cut])), atol=1e-12)
    np.testing.assert_allclose(demonstration.actions[cut:], differentiate(TORN[cut:], circle(TORN[cut:])), atol=1e-12)


def test_nothing_is_interpolated_across_a_gap() -> None:
    with pytest.warns(PreparationWarning, match="1 gap "):
        demonstration = only(prepare(wiping(TORN), Recipe(rate=20)))
    assert demonstration.times is not None
    assert not ((demonstration.times > 1.495) & (demonstration.times < 2.205)).any()
    assert np.abs(np.linalg.norm(demonstration.states, axis=1) - RADIUS).max() < 1e-5


def test_pieces_too_short_for_the_window_are_left_out_and_announced() -> None:
    times = STEADY[(STEADY < 1.5) | ((STEADY > 2.0) & (STEADY < 2.1)) | (STEADY > 3)]
    with pytest.warns(PreparationWarning) as caught:
        demonstration = only(prepare(wiping(times)))
    assert "2 gaps in the time stamps, the longest 0.92 s after 2.09 s" in str(caught[0].message)
    assert "1 of 3 pieces between gaps have fewer than 25 samples and were left out." in str(caught[1].message)
    assert demonstration.times is not None
    assert not ((demonstration.times > 1.5) & (demonstration.times < 3)).any()


def test_what_counts_as_a_gap_can_be_said() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        demonstration = only(prepare(wiping(TORN), Recipe(differentiate="central", max_gap_s=2)))
    assert len(demonstration) == len(TORN)


def test_a_recording_with_no_piece_long_enough_is_refused() -> None:
    with pytest.raises(InvalidDataError, match=r"'wipe': got at most 9 samples in a row, expected at least 25 to diff"):
        prepare(wiping(STEADY[:9]))


def test_a_single_sample_can_be_taken_but_not_differentiated() -> None:
    recording = Recording(("x", "y", "vx", "vy"), np.ones((1, 4)), np.zeros(1), "a")
    assert len(only(prepare(recording, Recipe(rate=10)))) == 1
    with pytest.raises(InvalidDataError, match="'a': got at most 1 samples in a row, expected at least 5"):
        prepare(recording, Recipe(differentiate="savgol"))


def test_rows_that_repeat_a_stamp_are_left_out_and_announced() -> None:
    times = np.insert(STEADY, 100, STEADY[99])
    states = np.insert(circle(STEADY), 100, 77, axis=0)
    recording = Recording(("x", "y", "vx", "vy"), np.hstack([states, states[:, ::-1]]), times, "wipe")
    sentence = "repeated: 'wipe': 1 rows repeat the time stamp of the row before and were left out."
    for recipe in (Recipe(), Recipe(states=("x", "y"), differentiate="savgol")):
        with pytest.warns(PreparationWarning) as caught:
            demonstration = only(prepare(recording, recipe))
        assert [str(warning.message) for warning in caught] == [sentence]
        np.testing.assert_array_equal(demonstration.states, circle(STEADY))


def test_stamps_that_run_backwards_are_refused_with_their_row() -> None:
    times = STEADY.copy()
    times[7] = 0.02
    refused = pytest.raises(InvalidDataError, match=r"'wipe', row 7: got time 0\.02 s after 0\.06 s, expected later")
    with pytest.warns(PreparationWarning, match=r"row-order: 'wipe', row 7: .* sort=True"), refused:
        prepare(wiping(times))


def test_rows_are_put_in_the_order_of_time_where_asked() -> None:
    order = np.random.default_rng(0).permutation(len(STEADY))
    shuffled = Recording(("x", "y"), circle(STEADY)[order], STEADY[order], "wipe")
    sorted_, straight = only(prepare(shuffled, Recipe(sort=True))), only(prepare(wiping(STEADY)))
    np.testing.assert_array_equal(sorted_.states, straight.states)
    np.testing.assert_array_equal(sorted_.actions, straight.actions)


def test_stamps_that_are_missing_are_refused_with_their_row() -> None:
    times = STEADY.copy()
    times[7] = np.nan
    with pytest.raises(InvalidDataError, match=r"'wipe', row 7, column 'time': found nan"):
        prepare(Recording(("x", "y"), circle(STEADY), times, "wipe"))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_missing_cell_is_refused_only_in_selected_columns(bad: float) -> None:
    values = np.ones((3, 3))
    values[1, 1] = bad
    recording = Recording(("x", "force", "vx"), values, None, "wipe")
    assert len(only(prepare(recording))) == 3
    with pytest.raises(InvalidDataError, match=r"'wipe', row 1, column 'force': found (nan|inf) \(1 such cell in the"):
        prepare(recording, Recipe(states=("x", "force"), actions=("vx",)))


def test_differentiating_without_times_says_how_to_give_them() -> None:
    with pytest.raises(SettingError, match=r"'wipe' has no times, which are needed to differentiate: name the time co"):
        prepare(Recording(("x", "y"), circle(STEADY), None, "wipe"))


def test_preparing_nothing_is_refused() -> None:
    with pytest.raises(InvalidDataError, match="'empty' has no samples, expected at least one"):
        prepare(Recording(("x", "y"), np.empty((0, 2)), np.empty(0), "empty"))
    with pytest.raises(InvalidDataError, match="got no recording, expected at least one"):
        prepare([])


def test_a_column_missing_in_a_later_recording_is_named() -> None:
    with pytest.raises(InvalidDataError, match=r"'b' has no column 'y'; it has x, z\."):
        prepare([wiping(STEADY), Recording(("x", "z"), circle(STEADY), STEADY, "b")])


# ---------------------------------------------------------------------------------------------------------- recipes


def columns(*names: str) -> Recording:
    return Recording(names, np.ones((2, len(names))), None, "wipe")


@pytest.mark.parametrize(
    ("names", "states", "actions"),
    [
        ("x y vx vy fx", "x y", "vx vy"),
        ("q1 q2 dq1 dq2", "q1 q2", "dq1 dq2"),
        ("x dx ddx", "x", "dx"),
        ("a a_dot b b_dot", "a b", "a_dot b_dot"),
        ("dot_a a", "a", "dot_a"),
        ("x y z xdot ydot zdot", "x y z", "xdot ydot zdot"),
        ("x1 x2 x3 u1 u2", "x1 x2 x3", "u1 u2"),
    ],
)
def test_usual_names_tell_states_and_actions(names: str, states: str, actions: str) -> None:
    recipe = complete_recipe(Recipe(), columns(*names.split()))
    assert recipe == Recipe(states=tuple(states.split()), actions=tuple(actions.split()))


@pytest.mark.parametrize("names", ["x y z qx qy qz qw fx fy fz", "x y", "w z y x"])
def test_positions_alone_are_differentiated(names: str) -> None:
    expected = ("x", "y", "z") if "z" in names else ("x", "y")
    assert complete_recipe(Recipe(), columns(*names.split())) == Recipe(states=expected, differentiate="savgol")


def test_what_is_said_is_not_guessed() -> None:
    recording = columns("x", "y", "vx", "vy", "x1")
    assert prepare(recording, Recipe(states=("y",)))[0].actions.shape == (2, 1)
    recording = columns("x1", "x2")
    with pytest.raises(SettingError, match=r"'wipe' has no times"):
        prepare(recording, Recipe(differentiate="central"))


@pytest.mark.parametrize(
    ("names", "recipe", "what"),
    [
        ("a b c", Recipe(), "states and actions"),
        ("x1 x2", Recipe(), "the actions"),
        ("a b c", Recipe(actions=("a",)), "states and actions"),
        ("x y a b", Recipe(states=("a", "b")), "the actions"),
    ],
)
def test_names_that_tell_nothing_are_refused_with_what_to_say(names: str, recipe: Recipe, what: str) -> None:
    with pytest.raises(SettingError) as caught:
        prepare(columns(*names.split()), recipe)
    assert f"'wipe': cannot tell {what} from its columns {', '.join(names.split())}." in str(caught.value)
    assert "Say which with states= and actions=, or" in str(caught.value)


names = st.text("ax_1 .,/'\"\\\n\té拭🙂", min_size=1)


@given(
    st.builds(
        Recipe,
        states=st.none() | st.lists(names, min_size=1, max_size=4, unique=True).map(tuple),
        differentiate=st.sampled_from([None, "savgol", "central"]),
        window_s=st.floats(1e-3, 10),
        order=st.sampled_from([2, 3]),
        rate=st.none() | st.floats(1e-3, 1e4),
        trim=st.none() | st.tuples(st.floats(0, 9), st.floats(0, 9)),
        still=st.none() | st.floats(0, 1),
        centre=st.booleans(),
        max_gap_s=st.none() | st.floats(1e-3, 10),
        degrees=st.none() | st.lists(names, max_size=2, unique=True).map(tuple),
    )
)
def test_a_recipe_survives_json(recipe: Recipe) -> None:
    assert Recipe.from_dict(json.loads(json.dumps(recipe.to_dict()))) == recipe


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"window": 1}, "recipe: got 'window', expected only states, actions, differentiate, window_s"),
        ({"order": 7}, "order: got 7, expected one of 2, 3."),
        ({"window_s": None}, "window_s: got None, expected a number above 0."),
        ({"rate": 0}, "rate: got 0, expected a number above 0."),
        ({"rate": "fast"}, "rate: got 'fast', expected a number above 0."),
        ({"trim": 3}, "trim: got 3, expected two numbers, seconds at the start and at the end."),
        ({"trim": [1, -1]}, "trim: got -1, expected a number of at least 0."),
        ({"still": -1}, "still: got -1, expected a number of at least 0."),
        ({"centre": "yes"}, "centre: got 'yes', expected one of False, True."),
        ({"states": []}, "states: got [], expected names of columns, at least one and each once."),
        ({"states": [["x"], 2]}, "states: got [['x'], 2], expected names of columns"),
        ({"states": 5}, "states: got 5, expected names of columns"),
        ({"actions": ["a", "a"]}, "actions: got ['a', 'a'], expected names of columns"),
        ({"actions": ["u"], "differentiate": "savgol"}, "got actions u and differentiate='savgol', expected one"),
    ],
)
def test_a_recipe_that_makes_no_sense_is_refused(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(SettingError) as caught:
        Recipe.from_dict(values)
    assert sentence in str(caught.value)


def test_a_recipe_from_something_else_is_refused() -> None:
    with pytest.raises(SettingError, match="recipe: got 5, expected a mapping of names to values"):
        Recipe.from_dict(5)  # type: ignore[arg-type]


def test_a_window_longer_than_anything_is_refused() -> None:
    with pytest.raises(InvalidDataError, match="expected at least 100000001 to differentiate them"):
        prepare(wiping(STEADY), Recipe(window_s=1e308))


def test_one_column_needs_no_tuple() -> None:
    assert Recipe(states="x").states == ("x",)  # type: ignore[arg-type]


# ---------------------------------------------------------------------------------------------------------- surveys


def test_the_table_and_the_remark_tell_one_time_of_a_gap() -> None:
    times = np.delete(3 + np.arange(100) * 0.02, slice(40, 60))
    found = survey(Recording(("x", "y"), np.column_stack([np.sin(times), np.cos(times)]), times, "wipe"))
    assert found.gaps == (Gap(pytest.approx(0.78), pytest.approx(0.42)),)
    assert "the longest 0.42 s after 0.78 s" in found.warnings[0].message


def test_a_survey_tells_what_is_there() -> None:
    times = np.delete(np.arange(100) * 0.02, slice(40, 60))
    values = np.ones((80, 4))
    values[3, 0], values[4, 0], values[[1, 2], 2:] = np.nan, np.inf, 0
    found = survey(Recording(("x", "y", "vx", "vy"), values, times, "wipe"))
    assert (found.name, found.samples, found.columns) == ("wipe", 80, ("x", "y", "vx", "vy"))
    assert found.duration_s == pytest.approx(1.98)
    assert found.rate_hz == pytest.approx(50)
    assert found.jitter == pytest.approx(0, abs=1e-9)
    assert found.gaps == (Gap(pytest.approx(0.78), pytest.approx(0.42)),)
    assert found.non_increasing == ()
    assert found.missing == {"x": 2}
    assert found.zero_actions == 2


def test_a_survey_refuses_nothing() -> None:
    times = np.array([0, 1, 1, np.nan, 3, 2])
    found = survey(Recording(("a", "b"), np.full((6, 2), np.nan), times, "bad"))
    assert found.non_increasing == (2, 3, 4, 5)
    assert found.missing == {"a": 6, "b": 6}
    assert found.zero_actions is None
    empty = survey(Recording(("a",), np.empty((0, 1)), np.empty(0)))
    assert (empty.samples, empty.duration_s, empty.rate_hz, empty.jitter, empty.gaps) == (0, None, None, None, ())


def test_a_survey_without_times_knows_the_rate_only_from_the_recipe() -> None:
    recording = columns("x", "y")
    assert survey(recording).duration_s is None
    assert survey(recording, Recipe(rate=4)).duration_s == 0.25
    assert survey(recording, Recipe(states=("x",), actions=("gone",))).zero_actions is None


@given(st.integers(0, 10_000))
def test_jitter_is_the_spread_of_the_intervals(seed: int) -> None:
    intervals = np.random.default_rng(seed).uniform(0.9, 1.1, 50)
    times = np.concatenate([[0], np.cumsum(intervals)])
    found = survey(Recording(("x",), np.ones((51, 1)), times))
    assert found.jitter == pytest.approx(intervals.std() / np.median(intervals))


def test_gaps_are_longer_than_five_usual_intervals() -> None:
    times = np.array([0, 1, 2, 7, 8, 13.5, 14.5])
    assert find_gaps(times) == (Gap(8.0, 5.5),)
    assert find_gaps(times, 4) == (Gap(2.0, 5.0), Gap(8.0, 5.5))
    assert find_gaps(np.zeros(1)) == ()


numbers = st.floats() | st.floats(-5, 5) | st.integers(0, 20).map(float)


@settings(deadline=None)
@given(
    values=hnp.arrays(np.float64, st.tuples(st.integers(0, 12), st.just(3)), elements=numbers),
    stamps=st.none() | st.lists(numbers, min_size=12, max_size=12) | st.lists(numbers, min_size=12).map(sorted),
    recipe=st.builds(
        Recipe,
        states=st.just(("x",)),
        differentiate=st.sampled_from([None, "savgol", "central"]),
        window_s=st.floats(1e-3, 10),
        rate=st.none() | st.floats(1e-3, 1e4),
        still=st.none() | st.floats(0, 1),
        max_gap_s=st.none() | st.floats(1e-3, 1e3),
    ),
)
@pytest.mark.filterwarnings("ignore")
def test_any_numbers_give_a_finite_demonstration_or_one_of_our_errors(
    values: np.ndarray, stamps: list[float] | None, recipe: Recipe
) -> None:
    times = None if stamps is None else np.array(stamps[: len(values)])
    recording = Recording(("x", "y", "vx"), values, times, "any")
    assert survey(recording, recipe).samples == len(values)
    try:
        demonstration = only(prepare(recording, recipe))
    except UnconstrainError:
        return
    assert np.isfinite(demonstration.states).all()
    assert np.isfinite(demonstration.actions).all()


# -------------------------------------------------------------------------------------------------- real recordings


@needs_data
@pytest.mark.filterwarnings("ignore::unconstrain.recordings.preparation.PreparationWarning")
def test_a_tracked_finger_tip_moves_as_its_positions_say() -> None:
    recordings = read(DATA / "ccl_trakstar_planar" / "planer_circle_unflipped.csv")
    demonstration = only(prepare(recordings, Recipe(states=("x", "y", "z"), differentiate="savgol", rate=20)))
    assert demonstration.times is not None
    moved = demonstration.states[-1] - demonstration.states[0]
    np.testing.assert_allclose(np.trapezoid(demonstration.actions, demonstration.times, axis=0), moved, atol=5e-3)


@needs_data
def test_a_survey_of_a_tracked_finger_tip_finds_fifty_hertz() -> None:
    found = survey(read(DATA / "ccl_trakstar_planar" / "planer_circle.csv")[0])
    assert found.samples == 3060
    assert found.rate_hz == pytest.approx(50, rel=0.02)
    assert found.duration_s == pytest.approx(61, rel=0.02)
    assert found.missing == {}


def test_targets_without_a_clock_are_learnt_as_they_are_with_a_word():
    path = np.cumsum(np.random.default_rng(3).normal(size=(80, 2)), axis=0)
    table = np.column_stack([path[:-1], path[1:]])
    recording = Recording(("q1", "q2", "a1", "a2"), table)
    with pytest.warns(PreparationWarning, match="are the states to come.*rate= without a clock"):
        [demonstration] = prepare(recording, Recipe(("q1", "q2"), ("a1", "a2")))
    np.testing.assert_array_equal(demonstration.actions, path[1:])

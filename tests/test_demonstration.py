"""Demonstrations, recordings, and laying them end to end."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_array_equal

from unconstrain import Demonstration, Recording, Truth, stack
from unconstrain.base.errors import InvalidDataError


def demonstration(steps=4, n=2, d=3, name="wipe"):
    rng = np.random.default_rng(steps)
    truth = Truth(rng.standard_normal((steps, d)), np.tile(np.eye(d), (steps, 1, 1)))
    return Demonstration(
        rng.standard_normal((steps, n)), rng.standard_normal((steps, d)), np.arange(float(steps)), truth, name
    )


def test_lists_become_tables():
    demo = Demonstration([[1, 2], [3, 4]], [[1], [2]], [0, 1])
    assert len(demo) == 2
    assert demo.states.dtype == demo.actions.dtype == demo.times.dtype == np.float64


@pytest.mark.parametrize("rows", [slice(1, 3), np.array([False, True, True, False]), np.array([1, 2])])
def test_some_samples_come_with_their_times_and_truth(rows):
    demo = demonstration()
    some = demo[rows]
    assert some.name == "wipe"
    assert_array_equal(some.states, demo.states[1:3])
    assert_array_equal(some.actions, demo.actions[1:3])
    assert_array_equal(some.times, [1.0, 2.0])
    assert_array_equal(some.truth.policy, demo.truth.policy[1:3])
    assert some.truth.projections.shape == (2, 3, 3)


def test_times_and_truth_may_be_missing():
    some = Demonstration(np.ones((3, 1)), np.ones((3, 1)))[:2]
    assert some.times is None
    assert some.truth is None


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"states": [[1.0, np.nan]] * 4}, r"^states of 'wipe': found nan at row 0, column 1"),
        ({"actions": [[1.0], [2.0, 3.0]]}, r"^actions of 'wipe': the rows have different lengths"),
        ({"actions": np.ones((3, 3))}, r"^demonstration of 'wipe': got 4 states and 3 actions, expected one action"),
        ({"times": np.arange(3)}, r"^times of 'wipe': got 3 values, expected 4"),
        (
            {"truth": Truth(np.ones((4, 2)), np.ones((4, 3, 3)))},
            r"^truth of 'wipe': got policy of shape \(4, 2\), expected \(4, 3\)",
        ),
        (
            {"truth": Truth(np.ones((4, 3)), np.ones((4, 3)))},
            r"^truth of 'wipe': got projections of shape \(4, 3\), expected \(4, 3, 3\)",
        ),
    ],
)
def test_an_error_names_the_demonstration_and_the_place(change, sentence):
    good = vars(demonstration())
    with pytest.raises(InvalidDataError, match=sentence):
        Demonstration(**(good | change))


def test_a_demonstration_without_a_name_has_errors_too():
    with pytest.raises(InvalidDataError, match=r"^states: got an array of shape \(2,\)"):
        Demonstration([1, 2], [[1], [2]])


def test_demonstrations_are_laid_end_to_end():
    first, second = demonstration(2), demonstration(3)
    states, actions, groups = stack([first, second])
    assert_array_equal(states, np.vstack([first.states, second.states]))
    assert_array_equal(actions, np.vstack([first.actions, second.actions]))
    assert_array_equal(groups, [0, 0, 1, 1, 1])


def test_one_demonstration_is_a_stack_of_one():
    assert_array_equal(stack(demonstration(3)).groups, [0, 0, 0])


def test_no_demonstration_is_no_stack():
    with pytest.raises(InvalidDataError, match="got no demonstration, expected at least one"):
        stack([])


def test_demonstrations_of_different_width_are_named():
    sentence = r"demonstration 1 \('odd'\) has 1 state and 3 action columns, expected 2 and 3 as in the first"
    with pytest.raises(InvalidDataError, match=sentence):
        stack([demonstration(), demonstration(n=1, name="odd")])


def test_columns_of_a_recording_are_picked_by_name():
    recording = Recording(("t", "x", "y"), np.arange(6.0).reshape(2, 3), name="log")
    assert len(recording) == 2
    assert_array_equal(recording.select(["y", "t"]), [[2.0, 0.0], [5.0, 3.0]])


def test_a_column_that_is_not_there_is_named_with_those_that_are():
    recording = Recording(("t", "x"), np.ones((2, 2)), name="log")
    with pytest.raises(InvalidDataError, match="'log' has no column 'y', 'z'; it has t, x"):
        recording.select(["y", "x", "z"])


STAMPS = pd.date_range("2024-01-01", periods=4, freq="20ms")
TABLE = np.arange(8.0).reshape(4, 2)


@pytest.mark.parametrize(
    "times",
    [
        STAMPS,
        STAMPS.tz_localize("Europe/Berlin"),
        STAMPS.to_numpy(),
        pd.Series(STAMPS),
        STAMPS - STAMPS[0],
        [datetime(2024, 1, 1, tzinfo=UTC) + k * timedelta(milliseconds=20) for k in range(4)],
        [0, 0.02, 0.04, 0.06],
    ],
)
def test_dates_become_seconds_from_the_first_on(times):
    recording = Recording(("x", "y"), TABLE, times, name="ts")
    assert recording.times.dtype == np.float64
    np.testing.assert_allclose(recording.times, 0.02 * np.arange(4), atol=1e-9)


def test_stamps_of_numbers_stay_as_they_are():
    assert_array_equal(Recording(["x", "y"], TABLE, 1.7e9 + np.arange(4)).times, 1.7e9 + np.arange(4))
    assert Recording(("x", "y"), TABLE).times is None


def test_tables_of_pandas_and_masked_ones_are_values():
    frame = pd.DataFrame(TABLE, columns=["x", "y"])
    recording = Recording(tuple(frame.columns), frame)
    assert_array_equal(recording.select(["y"]), TABLE[:, 1:])
    masked = Recording(("x", "y"), np.ma.masked_greater(TABLE.astype(int), 6)).values
    assert_array_equal(np.isnan(masked), TABLE > 6)
    assert Recording(("x", "y"), TABLE).values is TABLE


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((("x",), TABLE), r"recording: got values of shape \(4, 2\) and 1 name of columns \(x\)"),
        ((("x", "y"), TABLE[:, 0]), r"got values of shape \(4,\)"),
        ((("x", "y"), TABLE, np.arange(3.0)), r"times of shape \(3,\) .* expected a name for each column and a time"),
        ((("x", "y"), TABLE, ["noon"] * 4), r"times: got values that are not numbers"),
        ((("x", "y"), [["up", 1.0]]), r"values: got values that are not numbers"),
        ((("x", "y"), [[1.0, 2.0], [3.0]]), r"values: the rows have different lengths"),
    ],
)
def test_recordings_that_do_not_fit_together_are_refused(given, said):
    with pytest.raises(InvalidDataError, match=said):
        Recording(*given)

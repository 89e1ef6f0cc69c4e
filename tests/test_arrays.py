"""Checks at the door."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from unconstrain.base.arrays import (
    as_groups,
    as_matrix,
    as_table,
    as_vector,
    as_weights,
    check_at_least,
    require_extra,
)
from unconstrain.base.errors import InvalidDataError, MissingExtraError, SettingError, UnconstrainError


@pytest.mark.parametrize(
    "values",
    [
        [[1, 2], [3, 4]],
        ((1, 2), (3, 4)),
        np.array([[1, 2], [3, 4]], dtype=np.int8),
        np.array([[1, 2], [3, 4]], dtype=np.float32),
        np.array([[1, 3], [2, 4]]).T,
        np.array([[1, 0, 2], [3, 0, 4]])[:, ::2],
        np.array([[1, 2], [3, 4]], dtype=object),
    ],
    ids=["lists", "tuples", "int8", "float32", "transposed", "strided", "objects"],
)
def test_any_real_numbers_make_a_matrix(values):
    matrix = as_matrix(values, "states")
    assert matrix.dtype == np.float64
    assert_array_equal(matrix, [[1.0, 2.0], [3.0, 4.0]])


def test_a_good_matrix_is_not_copied_or_changed():
    values = np.ones((2, 2))
    values.flags.writeable = False
    assert np.shares_memory(as_matrix(values, "states"), values)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ([[1, 2], [3]], "the rows have different lengths, expected a rectangular table."),
        ([1, 2], r"got an array of shape \(2,\), expected two dimensions"),
        (np.ones((1, 1, 1)), r"got an array of shape \(1, 1, 1\), expected two dimensions"),
        (np.empty((0, 3)), r"got an empty array of shape \(0, 3\), expected at least one row and one column."),
        (np.empty((3, 0)), r"got an empty array of shape \(3, 0\)"),
        ([[1, 2], [3, np.nan]], r"found nan at row 1, column 1 \(NaN or infinity in 1 places\)"),
        ([[1, np.inf], [-np.inf, 2]], r"found inf at row 0, column 1 \(NaN or infinity in 2 places\)"),
        ([[1, 2], [3, -1e31]], r"found -1e\+31 at row 1, column 1, expected numbers up to 1e\+30"),
        ([["a", "b"]], "got values that are not numbers"),
        ([[1, None]], r"found nan at row 0, column 1"),
        ([[1j, 2]], "complex data not supported"),
    ],
)
def test_what_is_no_matrix_is_said_in_a_sentence(values, sentence):
    with pytest.raises(InvalidDataError, match=f"^actions of 'wipe': {sentence}"):
        as_matrix(values, "actions of 'wipe'")


@pytest.mark.parametrize(
    ("values", "length", "sentence"),
    [
        ([[1, 2]], None, r"got an array of shape \(1, 2\), expected one dimension."),
        ([1, 2], 3, "got 2 values, expected 3."),
        ([1, np.nan], None, "found nan at row 1 "),
    ],
)
def test_what_is_no_vector_is_said_in_a_sentence(values, length, sentence):
    with pytest.raises(InvalidDataError, match=f"^times: {sentence}"):
        as_vector(values, "times", length)


def test_a_vector_is_a_table_of_one_column():
    table, flat = as_table([1, 2, 3], "actions")
    assert flat
    assert_array_equal(table, [[1.0], [2.0], [3.0]])
    assert as_table([[1, 2]], "actions")[1] is False


@pytest.mark.parametrize("values", [[1, [2, 3]], [[1], [2, 3]], [[[1], [2, 3]]]])
def test_a_ragged_table_is_refused_however_it_is_ragged(values):
    with pytest.raises(InvalidDataError, match="actions: the rows have different lengths"):
        as_table(values, "actions")


def test_without_weights_every_sample_counts_once():
    assert_array_equal(as_weights(None, 3), np.ones(3))
    assert_array_equal(as_weights([0, 1, 2], 3), [0.0, 1.0, 2.0])


def test_a_weight_is_not_negative():
    with pytest.raises(InvalidDataError, match=r"sample_weight: got -1.0 at row 1, expected no negative weight"):
        as_weights([1, -1], 2)


@pytest.mark.parametrize(
    "names", [[1, 1, 2], ["a", "b", "b"], np.array(["a", "b", "b"], dtype=object), [1.0, 2.0, 1.0]]
)
def test_groups_may_be_names_or_numbers(names):
    assert_array_equal(as_groups(names, 3), names)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        ([1, 2], r"got an array of shape \(2,\), expected 3, one for each sample."),
        ([[1], [2], [3]], r"got an array of shape \(3, 1\), expected 3"),
        ([1, [2, 3], 4], "the values are of different lengths, expected 3 names."),
        ([0.0, np.nan, 1.0], "found nan at row 1, expected a name or a number."),
        (["a", None, "b"], "got values that cannot be compared"),
    ],
)
def test_what_names_no_groups_is_said_in_a_sentence(names, sentence):
    with pytest.raises(InvalidDataError, match=f"^groups: {sentence}"):
        as_groups(names, 3)


@pytest.mark.parametrize("value", [0, 0.0, 1, np.float32(2), np.int64(3)])
def test_settings_at_their_bound_are_good(value):
    check_at_least("alpha", value, 0.0)


@pytest.mark.parametrize("value", [-1e-9, np.nan, np.inf, None, "a", [1, 2], np.ones(2), 1j])
def test_settings_that_are_no_good_are_named(value):
    with pytest.raises(SettingError, match=r"^alpha: got .*, expected a number of at least 0.0\."):
        check_at_least("alpha", value, 0.0)


def test_a_strict_bound_is_not_good_itself():
    with pytest.raises(SettingError, match=r"^variance: got 0.0, expected a number above 0.0\."):
        check_at_least("variance", 0.0, 0.0, strict=True)


def test_half_a_step_is_no_count():
    check_at_least("steps", np.int64(2), 1, whole=True)
    with pytest.raises(SettingError, match=r"^steps: got 2.5, expected a whole number of at least 1\."):
        check_at_least("steps", 2.5, 1, whole=True)


def test_an_extra_that_is_there_is_imported():
    import math

    assert require_extra("math", "viz") is math


def test_an_extra_that_is_not_there_is_named():
    with pytest.raises(MissingExtraError, match=r"needs 'no_such_module'.*pip install 'unconstrain\[viz\]'"):
        require_extra("no_such_module.part", "viz")


def test_all_errors_are_of_one_family_and_of_the_usual_kind():
    assert issubclass(InvalidDataError, UnconstrainError)
    assert issubclass(InvalidDataError, ValueError)
    assert issubclass(MissingExtraError, ImportError)

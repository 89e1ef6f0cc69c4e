"""Projections of constraints and of actions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import null_space

from unconstrain import action_projection, null_space_projection, project
from unconstrain.base.errors import InvalidDataError
from unconstrain.risks.projection import unit_actions

numbers = st.floats(-1e100, 1e100)
matrices = hnp.arrays(float, hnp.array_shapes(min_dims=2, max_dims=3, max_side=4), elements=numbers)
vectors = hnp.arrays(float, st.tuples(st.integers(1, 5), st.integers(1, 4)), elements=numbers)


@given(matrices)
def test_what_a_constraint_leaves_is_a_projection(A):
    N = null_space_projection(A)
    assert_allclose(N @ N, N, atol=1e-12)
    assert_array_equal(N, np.swapaxes(N, -1, -2))


@given(vectors)
def test_what_an_action_shows_is_a_projection_that_keeps_it(u):
    P = action_projection(u)
    assert_allclose(P @ P, P, atol=1e-12)
    assert_array_equal(P, np.swapaxes(P, -1, -2))
    assert_allclose(project(P, u), u, atol=1e-12 * np.abs(u).max(initial=0))


@given(vectors)
def test_directions_have_length_one_or_none(u):
    directions, lengths = unit_actions(u)
    moving = u.any(axis=1)
    assert_allclose(np.linalg.norm(directions[moving], axis=1), 1)
    assert_array_equal(directions[~moving], 0)
    assert_allclose(directions * lengths[:, None], u, atol=1e-12 * np.abs(u).max())


@pytest.mark.parametrize("scale", [5e-324, 1e-310, 1e-200, 1e-160, 1e160, 1e300])
def test_the_direction_of_an_action_does_not_depend_on_its_length(scale):
    direction, length = unit_actions(scale * np.array([1.0, 0.0, 0.0]))
    assert_array_equal(direction, [1.0, 0.0, 0.0])
    assert length == scale


@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_the_null_space_is_scipy_s_and_i_minus_pinv(k):
    A = np.random.default_rng(k).standard_normal((k, 4))
    Z = null_space(A)
    assert_allclose(null_space_projection(A), Z @ Z.T, atol=1e-12)
    assert_allclose(null_space_projection(A), np.eye(4) - np.linalg.pinv(A) @ A, atol=1e-12)


def test_constraints_are_obeyed_and_projection_is_by_rows():
    rng = np.random.default_rng(0)
    A, v = rng.standard_normal((7, 2, 4)), rng.standard_normal((7, 4))
    u = project(null_space_projection(A), v)
    for n in range(7):
        assert_allclose(A[n] @ u[n], 0, atol=1e-12)
        assert_allclose(u[n], v[n] - np.linalg.pinv(A[n]) @ A[n] @ v[n], atol=1e-12)


def test_rows_that_are_zero_dependent_or_absent_constrain_nothing_new():
    A = np.array([[1.0, 1.0, 0.0]])
    for more in (np.zeros((1, 3)), 3 * A, (1 + 1e-12) * A):
        assert_allclose(null_space_projection(np.vstack([A, more])), null_space_projection(A), atol=1e-12)
    assert_array_equal(null_space_projection(np.zeros((2, 3))), np.eye(3))
    assert_array_equal(null_space_projection(np.empty((5, 0, 3))), np.tile(np.eye(3), (5, 1, 1)))


def test_a_full_set_of_constraints_leaves_nothing():
    assert_allclose(null_space_projection(np.random.default_rng(1).standard_normal((3, 3))), 0, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-300, 1e-8, 1e8, 1e300])
def test_the_size_of_a_constraint_does_not_matter(scale):
    A = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 1.0]])
    assert_allclose(null_space_projection(scale * A), null_space_projection(A), atol=1e-12)


def test_lists_of_integers_are_matrices_too():
    assert_array_equal(null_space_projection([[0, 0, 2]]), np.diag([1.0, 1.0, 0.0]))
    assert_array_equal(action_projection([0, 0, 2]), np.diag([0.0, 0.0, 1.0]))


def test_a_vector_is_no_constraint_matrix():
    with pytest.raises(InvalidDataError, match=r"got an array of shape \(3,\), expected \(\.\.\., k, d\)"):
        null_space_projection(np.ones(3))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_constraint_must_be_finite(bad):
    with pytest.raises(InvalidDataError, match="constraint matrix: found NaN or infinity"):
        null_space_projection(np.array([[1.0, bad]]))

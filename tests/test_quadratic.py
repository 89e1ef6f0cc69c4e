"""Quadratics, and solving them in order of importance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import minimize

import naive
from unconstrain.learners.thresholds import judged
from unconstrain.risks.quadratic import Quadratic, lexicographic_path, minimum


def least_squares(A, b):
    """‖A w − b‖² as one problem."""
    return Quadratic((A.T @ A)[None], (A.T @ b)[None], np.array([b @ b]))


def stacked(*quadratics):
    return Quadratic(
        *(np.concatenate([getattr(q, name) for q in quadratics]) for name in ("hessian", "linear", "constant"))
    )


def draw(seed, rows, size):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((rows, size)), rng.standard_normal(rows)


@given(st.integers(0, 1000))
def test_the_value_is_the_sum_of_squares_it_was_made_of(seed):
    A, b = draw(seed, 6, 4)
    w = np.random.default_rng(seed + 1).standard_normal((1, 4, 3))
    expected = ((A @ w[0] - b[:, None]) ** 2).sum(axis=0)
    assert_allclose(least_squares(A, b)(w), [expected], rtol=1e-9)
    assert_allclose(least_squares(A, b)(w[:, :, 0]), expected[:1], rtol=1e-9)


def test_sums_and_multiples_are_those_of_the_values():
    one, two = least_squares(*draw(0, 6, 4)), least_squares(*draw(1, 6, 4))
    w = np.ones((1, 4))
    assert_allclose((one + 0.5 * two)(w), one(w) + 0.5 * two(w))
    assert_allclose((two * 0.5)(w), (0.5 * two)(w))


def test_a_value_below_zero_is_told_and_judged_as_zero():
    quadratic = Quadratic(np.ones((1, 1, 1)), np.ones((1, 1)), np.array([1.0 - 1e-15]))
    assert -2e-15 < quadratic(np.ones((1, 1)))[0] < 0.0
    assert judged(quadratic, np.ones((1, 1))) == [0.0]


def test_a_quadratic_scales_and_adds_with_all_it_carries():
    rng = np.random.default_rng(0)
    gram = rng.standard_normal((2, 3, 3))
    gram = gram @ gram.mT
    hessian = np.stack([np.kron(one, np.eye(2)) for one in gram])
    with_gram = Quadratic(hessian, rng.standard_normal((2, 6)), np.ones(2), gram)
    without = Quadratic(hessian, with_gram.linear, with_gram.constant)
    vectors, factors = rng.standard_normal((2, 6, 4)), np.array([0.5, 3.0])
    for made, expected in ((factors * with_gram, factors[:, None, None] * hessian), (with_gram * 2.0, 2.0 * hessian)):
        assert made.gram is not None
        assert_allclose(made.times(vectors), expected @ vectors)
        assert_allclose(made(vectors), made.constant[:, None] + _by_hand(made, vectors))
    both = with_gram + factors * with_gram
    assert_allclose(both.times(vectors), (1.0 + factors)[:, None, None] * (hessian @ vectors))
    assert (with_gram + without).gram is None


def _by_hand(quadratic, vectors):
    bent = np.einsum("mik,mij,mjk->mk", vectors, quadratic.hessian, vectors)
    return bent - 2.0 * np.einsum("mi,mik->mk", quadratic.linear, vectors)


def test_a_value_that_overflows_is_judged_worse_than_all():
    quadratic = Quadratic(np.array([[[1.0, -1.0], [-1.0, 1.0]]]), np.ones((1, 2)), np.ones(1))
    candidates = np.array([[[1e200, np.inf, 0.0], [-1e200, np.inf, 0.0]]])
    assert_array_equal(np.isfinite(quadratic(candidates)), [[False, False, True]])
    assert_array_equal(judged(quadratic, candidates), [[np.inf, np.inf, 1.0]])


def test_the_minimum_is_that_of_least_squares():
    A, b = draw(2, 8, 5)
    assert_allclose(minimum(least_squares(A, b))[0], np.linalg.lstsq(A, b)[0])


def test_the_minimum_of_a_singular_objective_has_the_least_norm():
    A, b = draw(3, 2, 5)
    assert_allclose(minimum(least_squares(A, b))[0], np.linalg.pinv(A) @ b, atol=1e-10)


def test_the_minimum_of_nothing_is_zero():
    nothing = Quadratic(np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros(2))
    assert_array_equal(minimum(nothing), np.zeros((2, 3)))


def test_one_singular_problem_does_not_disturb_its_neighbours():
    (A, b), (C, e) = draw(4, 8, 4), draw(5, 2, 4)
    nothing = Quadratic(np.zeros((1, 4, 4)), np.zeros((1, 4)), np.zeros(1))
    found = minimum(stacked(least_squares(A, b), least_squares(C, e), nothing))
    assert_allclose(found[0], np.linalg.lstsq(A, b)[0])
    assert_allclose(found[1], np.linalg.pinv(C) @ e, atol=1e-10)
    assert_array_equal(found[2], 0)


@pytest.mark.parametrize("scale", [1e-300, 1e-280, 1e-150, 1e150])
def test_the_size_of_an_objective_does_not_move_its_minimum_and_underflow_counts_as_nothing(scale):
    A, b = draw(6, 2, 4)
    one = least_squares(A, b)
    found = minimum(stacked(scale * one, one))
    expected = np.linalg.pinv(A) @ b
    assert_allclose(found[1], expected, atol=1e-9)
    assert_allclose(found[0], 0 if scale < 1e-290 else expected, atol=1e-9)


def test_the_first_objective_comes_first():
    # w₀ + w₁ = 2 exactly; of all such w the one that is nearest to (3, 0).
    first = least_squares(np.array([[1.0, 1.0]]), np.array([2.0]))
    second = least_squares(np.eye(2), np.array([3.0, 0.0]))
    path = lexicographic_path(first, second)
    assert_allclose(path.at(path.split(0.0)), [[2.5, -0.5]])
    assert_allclose(path.at(path.split(1.0)), [[3.0, 0.0]], atol=1e-12)
    assert_array_equal(path.lowest, [1])


def test_lexicographic_minimum_is_that_of_constrained_optimisation():
    (A, b), (C, e) = draw(7, 2, 4), draw(8, 6, 4)
    path = lexicographic_path(least_squares(A, b), least_squares(C, e))
    expected = minimize(
        lambda w: ((C @ w - e) ** 2).sum(),
        np.zeros(4),
        constraints={"type": "eq", "fun": lambda w: A @ w - b},
        options={"ftol": 1e-14},
    )
    assert_allclose(path.at(path.split(0.0))[0], expected.x, atol=1e-5)


def test_without_a_second_objective_the_rest_stays_zero():
    A, b = draw(9, 3, 5)
    path = lexicographic_path(least_squares(A, b))
    assert_allclose(path.at(path.split(0.0))[0], np.linalg.pinv(A) @ b)
    assert_array_equal(path.weights[0, :, 5], 0)


@pytest.mark.parametrize("k", range(6))
def test_where_the_second_objective_is_singular_too_the_least_norm_is_taken(k):
    A, b = draw(10, 3, 5)
    C = np.vstack([A, draw(11, 1, 5)[0]])  # of rank 4, and never flat where the first is not
    e = np.append(b, 1.0)
    path = lexicographic_path(least_squares(A, b), least_squares(C, e))
    kept = max(k, 2)
    expected = naive.hybrid(A.T @ A, A.T @ b, C.T @ C, C.T @ e, kept)
    assert_allclose(path.weights[0, :, k], expected, atol=1e-9)


def test_a_first_objective_of_nothing_leaves_everything_to_the_second():
    C, e = draw(12, 6, 3)
    nothing = Quadratic(np.zeros((1, 3, 3)), np.zeros((1, 3)), np.zeros(1))
    path = lexicographic_path(nothing, least_squares(C, e))
    assert_array_equal(path.lowest, [3])
    assert_allclose(path.at(path.split(0.0))[0], np.linalg.lstsq(C, e)[0])
    assert_array_equal(path.threshold(path.split(0.0)), [0.0])


def test_two_objectives_of_nothing_leave_zero():
    nothing = Quadratic(np.zeros((1, 3, 3)), np.zeros((1, 3)), np.zeros(1))
    assert_array_equal(lexicographic_path(nothing, nothing).weights, np.zeros((1, 3, 4)))


def test_eigenvalues_of_rounding_are_never_divided_by():
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((4, 4)))[0]
    H = Q @ np.diag([1e-13, -1e-14, 1.0, 2.0]) @ Q.T
    first = Quadratic(0.5 * (H + H.T)[None], np.ones((1, 4)), np.ones(1))
    path = lexicographic_path(first)
    assert_array_equal(path.lowest, [2])
    assert np.abs(path.weights).max() < 10
    for k in (0, 1):
        assert_array_equal(path.weights[:, :, k], path.weights[:, :, 2])


def test_thresholds_are_shares_of_the_largest_eigenvalue():
    first = Quadratic(np.diag([1.0, 4.0, 2.0])[None], np.ones((1, 3)), np.ones(1))
    path = lexicographic_path(first)
    assert_array_equal(path.eigenvalues, [[1.0, 2.0, 4.0]])
    assert [int(path.split(t)[0]) for t in (0.0, 0.24, 0.25, 0.6, 1.0)] == [0, 0, 1, 2, 3]
    assert [float(path.threshold(np.array([k]))[0]) for k in range(4)] == [0.0, 0.25, 0.5, 1.0]


def test_each_problem_has_its_own_split():
    path = lexicographic_path(stacked(least_squares(*draw(13, 6, 3)), least_squares(*draw(14, 6, 3))))
    at = path.at(np.array([1, 3]))
    assert_array_equal(at[0], path.weights[0, :, 1])
    assert_array_equal(at[1], path.weights[1, :, 3])


@pytest.mark.parametrize("size", [1, 4, 20])
def test_every_split_of_the_path_is_that_of_the_naive_twin(size):
    problems = [(draw(20 + m, 3 * size, size), draw(30 + m, 3 * size, size)) for m in range(3)]
    firsts, seconds = ([least_squares(*pair[i]) for pair in problems] for i in (0, 1))
    path = lexicographic_path(stacked(*firsts), stacked(*seconds))
    for m, (first, second) in enumerate(zip(firsts, seconds, strict=True)):
        for k in range(size + 1):
            expected = naive.hybrid(first.hessian[0], first.linear[0], second.hessian[0], second.linear[0], k)
            assert_allclose(path.weights[m, :, k], expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_small_eigenvalues_do_not_spoil_the_splits_that_leave_them_out():
    # What is divided by 1e-9 is huge, and must not be added to and taken off again.
    Q = np.linalg.qr(np.random.default_rng(40).standard_normal((6, 6)))[0]
    spectrum = np.array([1e-9, 1e-6, 1e-3, 0.5, 1.0, 2.0])
    H = Q @ np.diag(spectrum) @ Q.T
    first = Quadratic(0.5 * (H + H.T)[None], np.ones((1, 6)), np.ones(1))
    second = least_squares(*draw(41, 12, 6))
    path = lexicographic_path(first, second)
    for k in range(2, 7):
        expected = naive.hybrid(first.hessian[0], first.linear[0], second.hessian[0], second.linear[0], k)
        assert_allclose(path.weights[0, :, k], expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_one_split_is_that_of_the_whole_path():
    path = lexicographic_path(least_squares(*draw(42, 3, 5)), least_squares(*draw(43, 8, 5)))
    for k in range(6):
        assert_allclose(path.at(np.array([k])), path.weights[..., k], rtol=1e-12, atol=1e-12)


def test_the_basis_is_orthonormal_in_the_metric_of_the_second_objective():
    second = least_squares(*draw(44, 8, 5))
    path = lexicographic_path(least_squares(*draw(45, 8, 5)), second)
    assert_allclose(path.basis[0].T @ second.hessian[0] @ path.basis[0], np.eye(5), atol=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 4))
def test_a_product_by_blocks_is_that_with_the_hessian(seed, d, p):
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((2, p, p))
    gram = half @ half.swapaxes(1, 2)
    hessian = np.stack([np.kron(one, np.eye(d)) for one in gram])
    columns = rng.standard_normal((2, p * d, 5))
    objective = Quadratic(hessian, np.zeros((2, p * d)), np.zeros(2), gram)
    assert_allclose(objective.times(columns), hessian @ columns, atol=1e-12)

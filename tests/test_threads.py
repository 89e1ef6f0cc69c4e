"""Solves side by side."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose
from threadpoolctl import threadpool_info, threadpool_limits

import samples
import unconstrain as uc
from unconstrain.base.threads import WORTH_A_THREAD, workers


def blas_threads():
    """Of the BLAS of NumPy and SciPy; other packages may have loaded their own, of one thread."""
    ours = [one for one in threadpool_info() if one["user_api"] == "blas" and "scs.libs" not in one["filepath"]]
    return {library["num_threads"] for library in ours}


def side_by_side(calls, multiplications):
    with workers() as threads:
        return threads.run(calls, multiplications)


@pytest.mark.parametrize("work", [1, WORTH_A_THREAD])
def test_results_come_in_the_order_of_the_calls(work):
    with threadpool_limits(2):
        assert side_by_side([lambda i=i: i**2 for i in range(5)], work) == [0, 1, 4, 9, 16]


def test_large_solves_run_in_threads_of_their_own_each_with_one_of_blas():
    together = threading.Barrier(2, timeout=30)

    def call():
        together.wait()
        return threading.get_ident(), blas_threads()

    with threadpool_limits(2):
        found = side_by_side([call, call], WORTH_A_THREAD)
        assert blas_threads() == {2}
    assert found[0][0] != found[1][0]
    assert [threads for _, threads in found] == [{1}, {1}]


def test_one_thread_stays_one_thread():
    with threadpool_limits(1):
        found = side_by_side([threading.get_ident] * 3, WORTH_A_THREAD)
    assert set(found) == {threading.get_ident()}


def test_small_solves_stay_where_they_are():
    with threadpool_limits(2):
        assert set(side_by_side([threading.get_ident] * 3, 1)) == {threading.get_ident()}


def test_a_single_one_stays_where_it_is():
    with threadpool_limits(2):
        assert side_by_side([threading.get_ident], WORTH_A_THREAD) == [threading.get_ident()]


def test_several_at_once_leave_blas_as_it_was():
    before = blas_threads()

    def program(_):
        return side_by_side([blas_threads] * 3, WORTH_A_THREAD)

    with ThreadPoolExecutor(4) as others:
        list(others.map(program, range(40)))
    assert blas_threads() == before


def test_whoever_ends_first_leaves_the_limit_to_the_other_and_the_last_one_takes_it_back():
    with threadpool_limits(2):
        first, second = workers(), workers()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert blas_threads() == {1}
        second.__exit__(None, None, None)
        assert blas_threads() == {2}


def test_two_at_once_share_the_threads():
    together = threading.Barrier(2, timeout=30)

    def program(_):
        with workers() as threads:
            together.wait()
            return threads.run([threading.get_ident] * 20, WORTH_A_THREAD)

    with threadpool_limits(2), ThreadPoolExecutor(2) as others:
        found = list(others.map(program, range(2)))
    assert len({ident for idents in found for ident in idents}) <= 2


def test_work_within_work_does_not_wait_for_its_own_thread():
    def within():
        return side_by_side([lambda: 1, lambda: 2], WORTH_A_THREAD)

    with threadpool_limits(2):
        assert side_by_side([within] * 4, WORTH_A_THREAD) == [[1, 2]] * 4


def test_a_generator_of_batches_may_use_blas_as_it_likes():
    seen = []

    def batches():
        for seed in range(3):
            data = samples.draw(seed)
            seen.append(blas_threads())
            yield data.states, data.actions

    with threadpool_limits(2):
        uc.ParametricPolicy(uc.Affine()).fit_batches(batches())
    assert seen == [{2}] * 3


def test_threads_know_what_numpy_was_told_about_errors():
    def divide():
        return float(np.float64(1.0) / np.float64(0.0))

    with threadpool_limits(2), np.errstate(divide="ignore"):
        assert side_by_side([divide, divide], WORTH_A_THREAD) == [np.inf, np.inf]


def test_an_error_in_a_thread_is_the_error():
    def fail():
        raise ZeroDivisionError("here")

    with threadpool_limits(2), pytest.raises(ZeroDivisionError, match="here"):
        side_by_side([fail, fail], WORTH_A_THREAD)


def test_the_number_of_threads_does_not_change_what_is_learnt(monkeypatch):
    monkeypatch.setattr("unconstrain.base.threads.WORTH_A_THREAD", 0)
    data = samples.draw()
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads):
            found.append(uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid(0.01)).fit(data.states, data.actions))
    assert_allclose(found[0].solution_.weights, found[1].solution_.weights, rtol=1e-8, atol=1e-10)
    assert np.array_equal(found[0].solution_.determined, found[1].solution_.determined)

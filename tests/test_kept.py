"""Samples that are kept for learners that look at them: of many, evenly some of each demonstration."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from samples import draw
from unconstrain.training import Batch, Training
from unconstrain.training.kept import Kept


def batch(numbers, groups, weights=None):
    """Samples whose only state is their number."""
    table = np.asarray(numbers, dtype=np.float64)[:, None]
    return Batch(table, table, weights, None if groups is None else np.asarray(groups))


def kept_of(most, groups, sizes=(), weights=None):
    numbers, kept = np.arange(len(groups)), Kept(most)
    for start, stop in pairwise([0, *np.cumsum(sizes).tolist(), len(groups)]):
        rows = slice(start, stop)
        kept = kept.with_batch(batch(numbers[rows], groups[rows], None if weights is None else weights[rows]))
    return kept


def numbers_in(kept):
    return kept.whole.states[:, 0].astype(int)


def test_all_are_kept_while_there_is_room():
    groups = np.arange(100) % 7
    for most in (None, 100, 5000):
        assert_array_equal(numbers_in(kept_of(most, groups)), np.arange(100))
        assert kept_of(most, groups).stride == 1


@given(st.integers(1, 9), st.integers(20, 60), st.integers(0, 2**32 - 1))
def test_steps_within_each_demonstration_are_equal_in_whatever_order_demonstrations_come(count, most, seed):
    groups = np.random.default_rng(seed).permutation(np.arange(400) % count)
    kept = kept_of(most, groups)
    assert kept.size <= most + count
    for name in range(count):
        ranks = np.searchsorted(np.flatnonzero(groups == name), numbers_in(kept)[groups[numbers_in(kept)] == name])
        assert len(ranks) >= 400 // count // kept.stride
        assert (np.diff(ranks) == kept.stride).all()


@given(st.lists(st.integers(1, 60), max_size=6), st.integers(0, 2**32 - 1))
def test_batches_are_the_same_as_all_at_once(sizes, seed):
    groups = np.random.default_rng(seed).integers(5, size=500)
    assert_array_equal(numbers_in(kept_of(64, groups, sizes)), numbers_in(kept_of(64, groups)))


def test_of_many_short_demonstrations_there_is_no_more_than_room_for():
    kept = kept_of(100, np.arange(1000))
    assert 50 <= kept.size <= 100


def test_a_weight_of_zero_is_the_same_as_not_being_there():
    groups, weights = np.arange(300) % 3, np.ones(300)
    weights[::2] = 0.0
    assert_array_equal(numbers_in(kept_of(50, groups, weights=weights)), 1 + 2 * numbers_in(kept_of(50, groups[1::2])))


def test_parts_that_are_thinned_differently_add():
    one, other = kept_of(64, np.repeat("a", 500)), kept_of(64, np.repeat("b", 100))
    both = one + other
    assert both.size <= 64
    for name in "ab":
        assert len(set(np.diff(both.whole.states[both.whole.groups == name, 0]))) == 1


@pytest.fixture
def little_room(monkeypatch):
    monkeypatch.setattr(Training, "MOST_KEPT", 600)


def test_robust_learns_as_well_from_some_of_many(little_room):
    turn = np.array([[-0.5, 1.0], [-1.0, -0.5]])
    data = draw(samples=2400, policy=lambda states: states @ turn.T)
    policy = uc.ParametricPolicy(uc.Affine()).fit(data.states, data.actions, groups=data.groups)
    solution, wanted = policy.solution_, data.states @ turn.T
    assert solution.method != "hybrid"
    assert len(solution.free) == 600
    assert "one in 4 samples of each demonstration, 600 in all" in " ".join(solution.notes)
    assert_allclose(policy.predict(data.states), wanted, atol=0.05)
    assert_allclose(policy.moments_.weight.sum(), 2400)

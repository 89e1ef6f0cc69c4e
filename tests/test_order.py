"""Orders of samples and demonstrations that depend on nothing but what they are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from unconstrain.training import Batch
from unconstrain.training.order import arranged, distinct, is_movement, path


def spiral(samples=60, laps=2.3):
    angle = np.linspace(0, 2 * np.pi * laps, samples)
    return np.linspace(0.3, 1, samples)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


@given(st.integers(0, 2**32 - 1))
def test_a_movement_is_found_again_in_shuffled_states(seed):
    order = np.random.default_rng(seed).permutation(60)
    found = order[path(spiral()[order])]
    assert_array_equal(found if found[0] < found[-1] else found[::-1], np.arange(60))


@pytest.mark.parametrize("count", [1, 2, 3, 9, 200])
def test_a_path_goes_through_every_state_once_even_where_all_are_the_same(count):
    for states in (np.zeros((count, 2)), np.random.default_rng(count).normal(size=(count, 3))):
        assert_array_equal(np.sort(path(states)), np.arange(count))


def test_a_path_is_much_shorter_than_a_random_order():
    states = np.random.default_rng(0).uniform(size=(400, 2))
    steps = np.linalg.norm(np.diff(states[path(states)], axis=0), axis=1)
    assert steps.sum() < 1.4 * 0.7124 * np.sqrt(400)  # of the shortest (Beardwood, Halton and Hammersley, 1959)


def test_movements_are_told_from_states_in_no_order():
    shuffled = np.random.default_rng(1).permutation(60)
    assert is_movement(spiral())
    assert is_movement(spiral()[::-1])
    assert not is_movement(spiral()[shuffled])
    assert not any(is_movement(np.random.default_rng(seed).normal(size=(15, 2))) for seed in range(200))
    assert not is_movement(np.zeros((5, 2)))


@pytest.mark.parametrize("interleaved", [False, True])
def test_the_order_of_arrival_is_kept_where_states_move_along_it(interleaved):
    states = np.vstack([spiral(), -spiral(60, 1.2)])
    groups = np.repeat([7, 3], 60)
    rows = np.arange(120).reshape(2, 60).T.ravel() if interleaved else np.arange(120)
    order, demonstrations, _, notes = arranged(Batch(states[rows], states[rows], None, groups[rows]))
    assert_array_equal(np.diff(rows[order])[np.diff(demonstrations) == 0], 1)
    assert notes == ("No times were given: rows count as recorded one after the other.",)


@given(st.integers(0, 2**32 - 1))
def test_times_tell_the_order(seed):
    rows = np.random.default_rng(seed).permutation(60)
    states = np.random.default_rng(5).normal(size=(60, 2))
    batch = Batch(states[rows], states[rows], None, np.zeros(60), np.arange(60.0)[rows])
    order, _, _, notes = arranged(batch)
    assert_array_equal(rows[order], np.arange(60))
    [alone] = notes
    assert alone.startswith("One demonstration alone: nothing tells what held it")
    assert arranged(batch._replace(groups=np.arange(60) // 30))[3] == ()


def test_copies_are_one_sample_but_not_at_another_time_or_of_another_demonstration():
    states = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, 2.0], [1.0, 2.0], [-0.0, 2.0]])
    first, places = distinct(Batch(states, states))
    assert_array_equal(states[first][places], states)
    assert len(first) == 2
    assert len(distinct(Batch(states, states, None, np.array(list("abbba"))))[0]) == 4
    assert len(distinct(Batch(states, states, None, None, np.arange(5.0)))[0]) == 5
    assert len(distinct(Batch(states, states * [[1], [2], [1], [1], [1]]))[0]) == 3


def test_what_had_to_be_assumed_is_said():
    states = spiral()
    fitted = uc.LocallyLinearPolicy(learner=uc.Robust()).fit(states, -states)
    assert fitted.solution_.notes == (
        "No groups were given: all samples count as one demonstration.",
        "No times were given: rows count as recorded one after the other.",
    )
    shuffled = np.random.default_rng(0).permutation(60)
    again = uc.LocallyLinearPolicy(learner=uc.Robust()).fit(states[shuffled], -states[shuffled])
    assert again.solution_.notes[1] == (
        "The rows came in no order of time: one was reconstructed from neighbouring states."
    )
    assert_allclose(again.predict(states), fitted.predict(states), atol=1e-6)
    assert_allclose(again.solution_.free, fitted.solution_.free[shuffled], atol=1e-6)

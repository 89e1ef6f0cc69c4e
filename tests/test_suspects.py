"""One bad sample changes the policy near it only: it is left out by its neighbours in time, and bounded in sums."""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

import unconstrain as uc
from conftest import LEARNERS, POLICIES, ROBUST
from samples import rotation
from unconstrain.evaluation.diagnosis import places_of
from unconstrain.recordings.demonstration import Source
from unconstrain.recordings.readers import parquet
from unconstrain.training import Batch, FirstLook, suspects

DEMONSTRATIONS, STEPS, DT = 8, 40, 0.05


def circling(states):
    """A smooth policy in the plane, whose movements end on a circle."""
    x, y = states[:, 0], states[:, 1]
    inwards = 1.0 - x**2 - y**2
    return np.column_stack([inwards * x - 2.0 * y, inwards * y + 2.0 * x])


@cache
def movements(noise=0.02):
    """States, actions, groups: movements on the circle, half of them held to a line each; not to be changed."""
    rng = np.random.default_rng(11)
    states, actions = [], []
    for index in range(DEMONSTRATIONS):
        direction = rotation(index, 2)[0]
        held = np.eye(2) if index % 2 else np.outer(direction, direction)
        state = rng.uniform(-1, 1, 2)
        for _ in range(STEPS):
            states.append(state)
            actions.append(held @ circling(state[None])[0])
            state = state + DT * actions[-1]
    actions = np.array(actions)
    groups = np.repeat(np.arange(DEMONSTRATIONS), STEPS)
    return np.array(states), actions + noise * rng.standard_normal(actions.shape), groups


def spoilt(row, error):
    states, actions, groups = movements()
    actions = actions.copy()
    actions[row] += error * actions.std(axis=0).mean() * np.array([0.6, 0.8])
    return states, actions, groups


def absent(row):
    weights = np.ones(DEMONSTRATIONS * STEPS)
    weights[row] = 0.0
    return weights


# Learners that look at samples


@pytest.mark.parametrize(("name", "kind"), product(ROBUST, POLICIES))
def test_a_bad_sample_is_named_and_absent(name, kind):
    row = 135
    states, actions, groups = spoilt(row, 5.0)
    policy = POLICIES[kind](ROBUST[name])
    # Features are laid over all states, those of samples that are left out too.
    if kind == "local":
        policy.set_params(centres=np.mgrid[-1:1:3j, -1:1:3j].reshape(2, -1).T)
    elif kind == "kmeans":
        policy.set_params(features=uc.NormalisedRBF.grid(-2, 2, 3))
    bad = clone(policy).fit(states, actions, groups=groups)
    without = clone(policy).fit(states, movements()[1], sample_weight=absent(row), groups=groups)
    assert_array_equal(bad.solution_.belief.suspects, [row])
    assert_allclose(bad.predict(states), without.predict(states), rtol=0, atol=1e-9 * np.abs(actions).max())


def test_clean_samples_stay(policy_of):
    states, actions, groups = movements()
    assert len(policy_of(uc.Robust()).fit(states, actions, groups=groups).solution_.belief.suspects) == 0


def test_a_bad_sample_is_named_however_the_samples_are_cut():
    states, actions, groups = spoilt(119, 8.0)
    policy = uc.ParametricPolicy(uc.Affine(), uc.NoiseCorrected(), uc.Folds(4, by="demonstration"))
    for start, stop in ((0, 118), (118, 119), (119, 120), (120, 320)):
        policy.partial_fit(states[start:stop], actions[start:stop], groups=groups[start:stop])
    assert_array_equal(policy.solution_.belief.suspects, [119])


def test_samples_stay_where_no_field_sees_any_other():
    states, actions = np.linspace(300, 900, 20)[:, None], np.random.default_rng(0).normal(size=(20, 2))
    still = np.full((20, 1), -2.0)
    policy = uc.LocallyLinearPolicy(learner=uc.Likelihood()).fit(still, np.full((20, 2), 1e9))
    policy.partial_fit(states, actions)
    assert len(policy.solution_.belief.suspects) == 0
    assert_allclose(policy.predict(still[:1]), [[1e9, 1e9]], rtol=1e-6)


# Neighbours in time


@given(st.integers(0, DEMONSTRATIONS * STEPS - 1), st.floats(3.0, 1e6), st.floats(0, 2 * np.pi))
@settings(max_examples=60)
def test_an_error_of_three_standard_deviations_is_found_wherever_it_is(row, error, angle):
    _, actions, groups = movements()
    actions = actions.copy()
    actions[row] += error * actions.std(axis=0).mean() * np.array([np.cos(angle), np.sin(angle)])
    assert_array_equal(np.flatnonzero(suspects.unlike_neighbours(actions, groups)), [row])


def test_two_bad_samples_in_a_row_are_found():
    _, actions, groups = movements()
    actions = actions.copy()
    actions[[50, 51]] = [[5.0, -4.0], [-3.0, 6.0]]
    assert_array_equal(np.flatnonzero(suspects.unlike_neighbours(actions, groups)), [50, 51])


def test_an_action_that_is_missing_is_found():
    _, actions, groups = movements(noise=0.0)
    actions = actions.copy()
    actions[100] = 0.0
    assert_array_equal(np.flatnonzero(suspects.unlike_neighbours(actions, groups)), [100])


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.3])
def test_a_constraint_that_switches_is_no_error(noise):
    rng = np.random.default_rng(2)
    policy = np.column_stack([np.cos(0.1 * np.arange(400)), np.sin(0.1 * np.arange(400))])
    angles = np.repeat(rng.uniform(0, np.pi, 50), 8)
    line = np.column_stack([np.cos(angles), np.sin(angles)])
    actions = line * (line * policy).sum(axis=1, keepdims=True) + noise * rng.standard_normal(policy.shape)
    assert not suspects.unlike_neighbours(actions, np.zeros(400, dtype=int)).any()


@pytest.mark.parametrize("every", [1, 2, 3])
def test_where_much_looks_wrong_it_is_how_the_movement_is(every):
    rng = np.random.default_rng(3)
    normals = np.repeat(rng.standard_normal((200, 3)), every, axis=0)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    actions = np.ones(3) - normals * normals.sum(axis=1, keepdims=True)
    assert suspects.unlike_neighbours(actions, np.zeros(len(actions), dtype=int)).mean() < 0.01


def test_units_and_axes_do_not_decide():
    _, actions, groups = spoilt(77, 3.0)
    expected = suspects.unlike_neighbours(actions, groups)
    for other in (1e-8 * actions, 1e8 * actions, actions @ rotation(1, 2)):
        assert_array_equal(suspects.unlike_neighbours(other, groups), expected)


@pytest.mark.parametrize("samples", range(1, 7))
def test_few_samples_tell_nothing_that_is_not_there(samples):
    actions = np.column_stack([np.ones(samples), np.arange(samples)])
    assert not suspects.unlike_neighbours(actions, np.zeros(samples, dtype=int)).any()


# Lengths, in the sums


@pytest.mark.parametrize(("name", "kind"), product(LEARNERS, POLICIES))
def test_a_bad_sample_of_thirty_standard_deviations_hardly_counts_in_sums(name, kind):
    row = 135
    states, actions, groups = spoilt(row, 30.0)
    policy = POLICIES[kind](LEARNERS[name])
    bad = clone(policy).fit(states, actions, groups=groups)
    clean = clone(policy).fit(states, movements()[1], groups=groups)
    truth = circling(states)
    missed = [((one.predict(states) - truth) ** 2).mean() for one in (bad, clean)]
    assert missed[0] < 1.3 * missed[1]


@pytest.mark.parametrize("sizes", [(320,), (135, 1, 184), (100, 100, 120)])
def test_what_counts_less_does_not_depend_on_how_samples_are_cut(sizes):
    states, actions, groups = spoilt(135, 30.0)
    policy, stops = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()), np.cumsum(sizes)
    rows = [slice(stop - size, stop) for size, stop in zip(sizes, stops, strict=True)]
    cut = clone(policy).fit_batches([(states[part], actions[part], None, groups[part]) for part in rows])
    whole = clone(policy).fit(states, actions, groups=groups)
    assert_allclose(cut.training_.longest, whole.training_.longest, rtol=1e-14)
    assert whole.training_.longest < np.linalg.norm(actions[135])
    assert_allclose(cut.predict(states), whole.predict(states), atol=1e-9)
    assert whole.moments_.weight[0] < len(states) - 0.9


def test_clean_samples_count_in_full():
    states, actions, _ = movements()
    assert uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit(states, actions).moments_.weight[0] == len(states)
    batch = Batch(states, actions)
    assert batch.tempered(suspects.longest_plausible(np.linalg.norm(actions, axis=1))) is batch


def test_later_batches_may_be_faster():
    states, actions, _ = movements()
    policy = uc.ParametricPolicy(uc.Affine(), uc.Direct()).partial_fit(states, actions)
    assert policy.partial_fit(states, 100.0 * actions).moments_.weight[0] == 2 * len(states)


def test_the_longest_action_of_each_state_is_seen_in_any_order():
    rng = np.random.default_rng(5)
    states, actions = np.repeat(rng.standard_normal((20, 2)), 3, axis=0), rng.standard_normal((60, 2))
    order = rng.permutation(60)
    whole = FirstLook.at(Batch(states, actions))
    parts = FirstLook.total(FirstLook.at(Batch(states[rows], actions[rows])) for rows in np.split(order, [7, 30]))
    assert_allclose(parts.lengths, whole.lengths, rtol=1e-15)
    assert_allclose(np.sort(whole.lengths), np.sort(np.linalg.norm(actions, axis=1).reshape(20, 3).max(axis=1)))


def test_nothing_that_moves_has_no_longest_action():
    assert suspects.longest_plausible(np.zeros(4)) == np.inf


def test_twice_the_longest_plausible_length_counts_little():
    assert_allclose(suspects.credibility(np.array([0.0, 0.5, 1.0, 2.0])), [1, 1, 1, 2.0**-suspects.DECLINE])


# What is said


def test_samples_are_named_by_demonstration_number_and_time():
    demo = uc.Demonstration(np.zeros((3, 1)), np.zeros((3, 1)), np.arange(3) / 2)
    still = uc.Demonstration(np.zeros((3, 1)), np.zeros((3, 1)))
    found = places_of(np.array([1, 3, 8]), [("a", demo), ("b", still), ("a", demo)])
    assert list(map(str, found)) == ["a sample 2 (0.5 s)", "b sample 1", "a sample 6 (1 s)"]


def test_samples_that_were_recorded_are_named_by_file_and_row():
    demo = uc.Demonstration(np.zeros((3, 1)), np.zeros((3, 1)), source=Source("in/a.csv", np.array([4, 6, 8])))
    found = places_of(np.array([0, 1]), [("a", demo[1:])])
    assert list(map(str, found)) == ["in/a.csv row 6", "in/a.csv row 8"]
    assert str(places_of(np.array([1]), [("3", demo)])[0]) == "in/a.csv '3' row 6"


@pytest.mark.parametrize("recipe", [uc.Recipe(differentiate="savgol"), uc.Recipe(("x",), ("y",), rate=5.0)])
def test_rows_are_those_of_the_recording_whatever_is_left_out_between(recipe):
    times = np.append(np.arange(40), np.arange(60, 100)) * 0.02
    order = np.random.default_rng(0).permutation(80)
    table = np.column_stack([times, times**2])
    [demo] = uc.prepare([uc.Recording(("x", "y"), table[order], times[order])], replace(recipe, sort=True))
    most = 0.01 if recipe.rate else 0.0
    assert np.abs(times[order][demo.source.rows] - demo.times).max() <= most + 1e-9


@pytest.mark.filterwarnings("ignore:in-parts")
def test_rows_of_blocks_go_on_from_block_to_block(tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "BLOCK_ROWS", 8)
    monkeypatch.setattr("unconstrain.recordings.readers.blocks.WHOLE_ROWS", 8)
    columns = {name: np.arange(20.0) + at for at, name in enumerate(("t", "x", "vx"))}
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    blocks = [demo for _, demo in uc.Stream(tmp_path / "a.parquet").named_demonstrations()]
    assert [len(one) for one in blocks] == [8, 8, 4]
    assert_array_equal(np.concatenate([one.source.rows for one in blocks]), np.arange(20))
    assert {one.source.file for one in blocks} == {str(tmp_path / "a.parquet")}

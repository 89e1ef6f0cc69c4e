"""Which samples are held out together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from samples import draw
from unconstrain import Folds, HeldOut, Hybrid, ParametricPolicy
from unconstrain.base.errors import SettingError
from unconstrain.risks import FoldedMoments, gather
from unconstrain.training import Batch, FirstLook, Split


def splitter(validation, states, groups=None, weights=None):
    return Split.begin(validation, FirstLook.at(Batch(states, states, weights, groups)))


def spread(samples=2000, seed=0, n=2):
    return np.random.default_rng(seed).standard_normal((samples, n))


def part(value):
    return gather(np.full((1, 1), float(value)), np.ones((1, 1)))


# Samples


def test_samples_are_dealt_evenly():
    states = spread()
    counts = np.bincount(splitter(Folds(5), states).assign(states, None), minlength=5)
    assert len(counts) == 5
    assert_allclose(counts, 400, rtol=0.2)


def test_a_share_of_the_samples_is_held_out():
    states = spread()
    assert_allclose((splitter(HeldOut(0.3), states).assign(states, None) == 0).mean(), 0.3, atol=0.04)


def test_the_seed_draws_other_samples():
    states = spread(200)
    folds = [splitter(Folds(3, seed=seed), states).assign(states, None) for seed in (0, 0, 1, -1)]
    assert_array_equal(folds[0], folds[1])
    assert (folds[0] != folds[2]).mean() > 0.4
    assert (folds[0] != folds[3]).mean() > 0.4


def test_folds_of_neighbouring_columns_and_of_states_on_a_grid_are_unrelated():
    grid = np.stack(np.meshgrid(np.arange(40.0), np.arange(40.0)), axis=-1).reshape(-1, 2)
    folds = splitter(Folds(4), grid).assign(grid, None)
    assert_allclose(np.bincount(folds), 400, rtol=0.25)
    assert abs(np.mean(folds == splitter(Folds(4), grid).assign(grid[:, ::-1], None)) - 0.25) < 0.08


@given(st.integers(0, 100), st.permutations(range(20)))
def test_a_sample_s_fold_depends_neither_on_order_nor_on_batches(seed, order):
    states = spread(20, seed)
    split = splitter(Folds(4), states)
    folds = split.assign(states, None)
    assert_array_equal(split.assign(states[order], None), folds[order])
    assert_array_equal(np.concatenate([split.assign(states[:7], None), split.assign(states[7:], None)]), folds)


@pytest.mark.parametrize(("factor", "offset"), [(2.0**-30, 0.0), (2.0**30, 0.0), (-1.0, 0.0), (1e-8, 0.0), (1.0, 64.0)])
def test_a_sample_s_fold_does_not_depend_on_units(factor, offset):
    states = spread(500)
    folds, moved = (splitter(Folds(4), s).assign(s, None) for s in (states, abs(factor) * states + offset))
    assert (folds == moved).mean() > 0.99


def test_equal_samples_stay_together():
    states = np.repeat(spread(50), 3, axis=0)
    folds = splitter(Folds(4), states).assign(states, None).reshape(50, 3)
    assert (folds == folds[:, :1]).all()


def test_states_that_do_not_move_are_all_in_one_fold():
    for states in (np.zeros((9, 2)), np.full((9, 2), 0.1), np.full((9, 1), 1e8)):
        assert len(set(splitter(Folds(4), states).assign(states, None))) == 1


@given(st.integers(2, 60), st.floats(0.01, 1e6))
def test_what_rounding_of_the_mean_leaves_does_not_scatter_states(samples, value):
    states = np.full((samples, 2), value)
    weights = np.random.default_rng(samples).uniform(0.1, 1, samples)
    split = splitter(Folds(10), states, weights=weights)
    again = value * (1 + 1e-13 * np.arange(samples))[:, None] * np.ones(2)
    assert len(set(split.assign(again, None))) == 1


def test_states_far_outside_the_first_batch_still_have_a_fold():
    split = splitter(Folds(4), spread(20))
    assert set(split.assign(np.array([[1e90, -1e90], [-1e100, 0.0]]), None)) <= set(range(4))


# Demonstrations


def test_demonstrations_at_first_look_are_dealt_in_turn():
    states, groups = spread(60), np.arange(60) % 11
    folds = splitter(Folds(3), states, groups).assign(states, groups)
    assert all(np.ptp(folds[groups == name]) == 0 for name in range(11))
    assert sorted(np.bincount([folds[groups == name][0] for name in range(11)])) == [3, 4, 4]


def test_demonstrations_that_come_later_are_dealt_as_they_come():
    split = splitter(Folds(3), np.array([[0.0], [1.0]]), ["b", "a"])
    later = ["d", "c", "a", "d"]
    folds = split.seeing(later).assign(np.zeros((4, 1)), later)
    assert_array_equal(folds, [2, 0, split.fold_of["a"], 2])


@given(st.permutations(range(7)), st.floats(1e-9, 1e9), st.integers(0, 2**32 - 1))
def test_neither_order_nor_names_nor_units_deal_demonstrations_otherwise(order, unit, seed):
    rng = np.random.default_rng(seed)
    states, actions, groups = rng.normal(size=(28, 2)), rng.normal(size=(28, 3)), np.arange(28) % 7
    split = Split.begin(Folds(3), FirstLook.at(Batch(states, actions, None, groups)))
    rows = rng.permutation(28)
    moved, named = unit * states[rows] + 5 * unit, np.array(order)[groups[rows]]
    other = Split.begin(Folds(3), FirstLook.at(Batch(moved, unit * actions[rows], np.full(28, unit), named)))
    assert_array_equal(other.assign(moved, named), split.assign(states, groups)[rows])


@pytest.mark.parametrize(
    ("share", "held"), [(0.5, [0, 2, 4]), (0.2, [0, 5]), (0.34, [0, 2, 5]), (0.9, [0, 1, 2, 3, 4, 5, 6, 7, 8])]
)
def test_the_first_and_then_evenly_many_demonstrations_are_held_out(share, held):
    validation = HeldOut(share)
    parts = [validation.deal_in_turn(i) for i in range(10)]
    assert [i for i in range(10) if parts[i] == 0][: len(held)] == held
    assert abs(parts.count(0) - 10 * share) <= 1


@pytest.mark.parametrize(
    ("by", "groups", "expected"),
    [
        ("auto", None, "sample"),
        ("auto", [1, 1, 1], "sample"),
        ("auto", [1, 2, 1], "demonstration"),
        ("sample", [1, 2, 1], "sample"),
        ("demonstration", [1, 1, 1], "demonstration"),
    ],
)
def test_automatic_means_demonstrations_where_there_are_several(by, groups, expected):
    assert splitter(Folds(2, by=by), spread(3), groups).by == expected


def test_demonstrations_that_are_not_named_cannot_be_held_out():
    with pytest.raises(SettingError, match="validation by demonstration: expected groups=, one name or number"):
        splitter(Folds(2, by="demonstration"), spread(3)).seeing(None)


@pytest.mark.parametrize("groups", [np.array([3, 1, 3]), ["b", "a", "b"], (2.5, 1.0, 2.5)])
def test_groups_may_be_any_names(groups):
    assert_array_equal(splitter(Folds(5), spread(3), groups).assign(spread(3), groups), [0, 1, 0])


# Rounds


def test_each_fold_is_held_out_once_and_the_rest_trains():
    parts = tuple(part(v) for v in (1, 2, 3))
    rounds = FoldedMoments(parts, range(3)).rounds()
    assert [(float(a.gram[0, 0, 0]), float(b.gram[0, 0, 0])) for a, b in rounds] == [(13, 1), (10, 4), (5, 9)]


def test_a_share_is_held_out_only_once():
    rounds = FoldedMoments((part(1), part(2)), HeldOut().held_out).rounds()
    assert [(float(a.gram[0, 0, 0]), float(b.gram[0, 0, 0])) for a, b in rounds] == [(4, 1)]


def test_empty_folds_are_passed_over():
    nothing = 0.0 * part(1)
    rounds = FoldedMoments((nothing, part(1), nothing, part(2)), range(4)).rounds()
    assert [(float(a.gram[0, 0, 0]), float(b.gram[0, 0, 0])) for a, b in rounds] == [(4, 1), (1, 4)]


@pytest.mark.parametrize("filled", [(0,), (1,), ()])
def test_where_there_is_nothing_to_compare_there_is_no_round(filled):
    parts = tuple(part(1) if i in filled else 0.0 * part(1) for i in range(2))
    assert FoldedMoments(parts, range(2)).rounds() == []
    assert FoldedMoments(parts, range(1)).rounds() == []


def test_a_held_out_part_that_is_empty_is_no_round():
    assert FoldedMoments((0.0 * part(1), part(1), part(2)), range(1)).rounds() == []


def test_folds_add_part_by_part():
    both = FoldedMoments((part(1), part(2)), range(2)) + FoldedMoments((part(3), part(4)), range(2))
    assert [float(p.gram[0, 0, 0]) for p in both.parts] == [10, 20]
    assert float(both.whole.gram[0, 0, 0]) == 30


def test_nothing_is_lost_to_cancellation_when_one_fold_is_huge():
    # Subtracting the huge fold from the whole would leave rounding instead of the small ones.
    rounds = FoldedMoments((part(1e8), part(1), part(2)), range(3)).rounds()
    assert float(rounds[0][0].gram[0, 0, 0]) == 5.0


# Settings


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Folds(1), "count: got 1, expected a whole number of at least 2"),
        (lambda: Folds(2.5), "count: got 2.5, expected a whole number of at least 2"),
        (lambda: Folds(by="trial"), "by: got 'trial', expected 'auto', 'demonstration' or 'sample'"),
        (lambda: HeldOut(by="trial"), "by: got 'trial', expected 'auto', 'demonstration' or 'sample'"),
        (lambda: HeldOut(0.0), "share: got 0.0, expected a number above 0.0"),
        (lambda: HeldOut(1.0), "share: got 1.0, expected a number between 0 and 1"),
        (lambda: HeldOut("half"), "share: got 'half', expected a number above 0.0"),
    ],
)
def test_settings_out_of_range_are_named(make, sentence):
    with pytest.raises(SettingError, match=sentence):
        make()


@pytest.mark.parametrize("validation", [Folds(50), Folds(50, by="demonstration"), HeldOut(0.4), HeldOut(0.01)], ids=str)
@pytest.mark.parametrize("groups", [1, 2, 6])
def test_more_folds_than_demonstrations_and_a_single_one_still_fit(validation, groups):
    data = draw(groups=groups)
    policy = ParametricPolicy(learner=Hybrid(), validation=validation).fit(
        data.states, data.actions, groups=data.groups
    )
    assert np.isfinite(policy.predict(data.states)).all()
    assert np.isfinite(policy.solution_.scores).all()

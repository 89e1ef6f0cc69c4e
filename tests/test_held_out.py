"""What the robust learners hold out together: constraints, and stretches of recordings that are not told apart."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.learners.robust.held_out import held_out_together, like_constraints

ANGLES = (0.0, 10.0, 20.0, 60.0, 100.0, 110.0)


def held_at(angles, samples=30, d=3):
    """Actions of demonstrations, each in the plane whose normal is turned by so many degrees; NaN for a free one."""
    rng = np.random.default_rng(1)
    actions, groups = [], []
    for group, angle in enumerate(np.radians(angles)):
        each = rng.standard_normal((samples, d))
        if np.isfinite(angle):
            normal = np.array([np.cos(angle), np.sin(angle), 0.0])
            each -= np.outer(each @ normal, normal)
        actions.append(each)
        groups += [group] * samples
    return np.concatenate(actions), np.array(groups)


def test_demonstrations_under_like_constraints_are_one_cluster():
    like = like_constraints(*held_at(ANGLES))
    assert len({*like[:3]}) == len({*like[4:]}) == 1
    assert len({*like}) == 3


def test_what_is_farther_apart_than_25_degrees_is_not():
    assert len({*like_constraints(*held_at((0.0, 26.0)))}) == 2
    assert len({*like_constraints(*held_at((0.0, 24.0)))}) == 1
    assert len({*like_constraints(*held_at((0.0, 20.0, 40.0)))}) == 2  # no chain from one to the next


def test_free_demonstrations_are_like_none_other():
    assert len({*like_constraints(*held_at((np.nan, np.nan, 0.0, 5.0)))}) == 3


@pytest.mark.parametrize("angles", [ANGLES, (0.0, 0.0, 50.0, 50.0, 90.0, 130.0)])
def test_folds_hold_out_constraints_and_every_one_holds_something(angles):
    actions, groups = held_at(angles)
    states = np.random.default_rng(2).standard_normal(actions.shape)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, actions, groups=groups)
    samples = held_out_together(policy.training_.samples)
    fold_of = {int(group): {*samples.folds[samples.groups == group]} for group in np.unique(samples.groups)}
    assert all(len(folds) == 1 for folds in fold_of.values())
    assert {*samples.folds} == set(range(samples.folds.max() + 1))
    like = like_constraints(samples.actions, samples.groups)
    for one in fold_of:
        for other in fold_of:
            if like[one] == like[other]:
                assert fold_of[one] == fold_of[other]


def test_without_groups_neighbours_are_held_out_together():
    rng = np.random.default_rng(3)
    states = np.column_stack([np.linspace(0, 1, 400), np.zeros(400)])
    policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, rng.standard_normal((400, 2)))
    folds = held_out_together(policy.training_.samples).folds
    assert (np.diff(folds) != 0).sum() == 39
    assert {*folds} == set(range(10))

"""Other aims where the demonstrations leave room (footnote 6)."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from conftest import POLICIES
from samples import draw
from unconstrain.base.errors import SettingError
from unconstrain.learners.secondary import damped, like, standard_risk, towards
from unconstrain.risks import inconsistency, vec

GOAL = np.array([0.4, -0.3])
AIMS = {
    "towards": towards(GOAL, 2.0),
    "damped": damped(0.5),
    "like": like(lambda x: np.sin(3 * x)),
    "sum": standard_risk + towards(GOAL, 2.0, weight=3.0),
    "own": lambda moments: 2.0 * standard_risk(moments) + damped(1.0)(moments),
}
NORMAL = np.array([0.6, 0.8])
RNG = np.random.default_rng(1)
STATES = RNG.uniform(-1, 1, (80, 2))
ACTIONS = np.outer(np.sin(STATES[:, 0]) + STATES[:, 1], [0.8, -0.6])
"""Always across the same normal: nothing is known of what is wanted along it."""


@pytest.mark.parametrize("aim", AIMS.values(), ids=AIMS)
@pytest.mark.parametrize("kind", POLICIES)
def test_what_the_data_determines_is_the_same_whatever_the_aim(kind, aim):
    data = draw(samples=60)
    keeping = POLICIES[kind](uc.Hybrid(secondary=AIMS["towards"]))
    training = keeping.fit(data.states, data.actions, groups=data.groups).training_
    plain, aimed = (uc.Hybrid(threshold=0.6, secondary=each).learn(training) for each in (standard_risk, aim))
    assert_array_equal(plain.determined, aimed.determined)
    assert (plain.determined < plain.directions).any()
    values, vectors = np.linalg.eigh(inconsistency(training.folds.whole).hessian)
    for one, other, share, basis in zip(vec(plain.weights), vec(aimed.weights), values, vectors, strict=True):
        known = basis[:, share > 0.6 * share[-1]]
        assert_allclose(known.T @ other, known.T @ one, rtol=0, atol=1e-10 * max(1.0, np.abs(one).max()))


def test_along_the_normal_of_all_data_the_aim_is_followed_exactly():
    for policy in (uc.ParametricPolicy(uc.Affine()), uc.LocallyLinearPolicy(variance=0.5)):
        policy.learner = uc.Hybrid(threshold=1e-6, secondary=towards(GOAL, 2.0))
        found = policy.fit(STATES, ACTIONS)(STATES)
        assert_allclose(found @ NORMAL, -2.0 * (STATES - GOAL) @ NORMAL, atol=1e-8)
        plain = policy.with_learner(uc.Hybrid(threshold=1e-6))(STATES)
        assert_allclose(found @ [0.8, -0.6], plain @ [0.8, -0.6], atol=1e-8)
        assert_allclose(plain @ NORMAL, 0.0, atol=1e-8)


def test_a_sum_is_the_least_squares_of_both():
    wanted = -2.0 * (STATES - GOAL) @ NORMAL
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(threshold=1e-6, secondary=AIMS["sum"])).fit(STATES, ACTIONS)
    assert_allclose(policy(STATES) @ NORMAL, 0.75 * wanted, atol=1e-8)  # weights of 3 and 1


def test_damping_alone_leaves_the_open_directions_at_rest():
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(threshold=1e-6, secondary=damped(2.0))).fit(STATES, ACTIONS)
    assert_allclose(policy(STATES) @ NORMAL, 0.0, atol=1e-8)


def test_units_of_actions_do_not_matter():
    learner = uc.Hybrid(secondary=towards(GOAL, 2.0))
    policy = uc.ParametricPolicy(uc.KMeansRBF(7), learner).fit(STATES, ACTIONS)
    faster = uc.ParametricPolicy(uc.KMeansRBF(7), uc.Hybrid(secondary=towards(GOAL, 2000.0))).fit(STATES, 1e3 * ACTIONS)
    assert_allclose(faster(STATES), 1e3 * policy(STATES), rtol=1e-6, atol=1e-6)


def test_an_aim_of_moments_needs_no_samples_and_others_say_that_they_do():
    assert not uc.Hybrid().needs_samples
    assert not uc.Hybrid(secondary=damped(1.0)).needs_samples
    assert uc.Hybrid(secondary=towards(GOAL, 1.0)).needs_samples
    sums_alone = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(STATES, ACTIONS)
    with pytest.raises(SettingError, match="needs the samples"):
        sums_alone.with_learner(uc.Hybrid(secondary=towards(GOAL, 1.0)))


def test_an_aim_of_other_actions_is_refused():
    learner = uc.Hybrid(secondary=like(lambda x: x[:, :1]))
    with pytest.raises(SettingError, match=r"secondary: got actions of shape \(80, 1\)"):
        uc.ParametricPolicy(uc.Affine(), learner).fit(STATES, ACTIONS)


@pytest.mark.parametrize("name", ["towards", "damped", "sum"])
def test_an_aim_survives_the_file_of_its_policy(tmp_path, name):
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(secondary=AIMS[name])).fit(STATES, ACTIONS)
    uc.save(policy, tmp_path / "policy.npz")
    again = uc.load(tmp_path / "policy.npz")
    assert_array_equal(again(STATES), policy(STATES))
    assert_array_equal(again.fit(STATES, ACTIONS)(STATES), policy(STATES))

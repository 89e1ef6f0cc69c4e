"""Other aims where the demonstrations leave room (footnote 6)."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from conftest import POLICIES
from samples import draw
from unconstrain.base.errors import SettingError
from unconstrain.learners.secondary import damped, like, smooth, standard_risk, towards
from unconstrain.risks import inconsistency, vec

GOAL = np.array([0.4, -0.3])
AIMS = {
    "towards": towards(GOAL, 2.0),
    "damped": damped(0.5),
    "like": like(lambda x: np.sin(3 * x)),
    "smooth": smooth(),
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


ROBUST = [uc.Robust, uc.NoiseCorrected, uc.Likelihood, uc.Segments]
GROUPS = np.arange(80) // 10


@pytest.mark.parametrize("learner", ROBUST)
def test_the_robust_learners_follow_an_aim_where_nothing_is_known_and_only_there(learner):
    policy = uc.LocallyLinearPolicy(0.5, learner=learner()).fit(STATES, ACTIONS, groups=GROUPS)
    for aim, wanted in ((AIMS["towards"], -2.0 * (STATES - GOAL) @ NORMAL), (damped(1.0), 0.0), (smooth(), 0.0)):
        aimed = policy.with_learner(learner(secondary=aim))
        assert_array_equal(aimed.solution_.determined, policy.solution_.determined)
        assert_allclose(aimed(STATES) @ [0.8, -0.6], policy(STATES) @ [0.8, -0.6], atol=1e-10)
        assert_allclose(aimed(STATES) @ NORMAL, wanted, atol=1e-8)


def test_weights_move_in_no_more_directions_than_are_not_determined():
    data, rng = draw(samples=60), np.random.default_rng(2)
    policy = uc.ParametricPolicy(uc.KMeansRBF(9), uc.NoiseCorrected()).fit(
        data.states, data.actions, groups=data.groups
    )
    solution, d = policy.solution_, data.actions.shape[1]
    moved = []
    for _ in range(solution.directions):
        turn = rng.standard_normal((data.states.shape[1], d))
        aimed = policy.with_learner(uc.NoiseCorrected(secondary=like(lambda x, turn=turn: np.sin(3 * x @ turn))))
        moved.append(vec(aimed.solution_.weights - solution.weights)[0])
    sizes = np.linalg.svd(np.stack(moved), compute_uv=False)
    left = solution.directions - solution.determined[0]
    assert 0 < left < solution.directions
    assert (sizes[:left] > 1e-6).all()
    assert (sizes[left:] < 1e-10 * sizes[0]).all()


def test_where_there_is_one_fold_or_sums_alone_the_aim_is_followed_as_well():
    one = uc.ParametricPolicy(uc.Affine(), uc.Robust(secondary=AIMS["towards"])).fit(STATES, ACTIONS)
    sums = (
        uc.ParametricPolicy(uc.Affine(), "hybrid").fit(STATES, ACTIONS).with_learner(uc.Robust(secondary=damped(1.0)))
    )
    assert_allclose(one(STATES) @ NORMAL, -2.0 * (STATES - GOAL) @ NORMAL, atol=1e-6)
    assert_allclose(sums(STATES) @ NORMAL, 0.0, atol=1e-6)


def test_smooth_is_the_slope_along_what_was_shown():
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(secondary=smooth(3.0))).fit(STATES, ACTIONS, groups=GROUPS)
    training, spread = policy.training_, STATES.var(axis=0).sum()
    weights, samples = RNG.standard_normal((1, 2, 3)), training.samples
    found, sums = samples.predict(weights), 0.0
    for k in range(79):
        if samples.groups[k] == samples.groups[k + 1]:
            way = samples.states[k + 1] - samples.states[k]
            sums += spread * np.sum((found[k + 1] - found[k]) ** 2) / (way @ way)
    objective = smooth(3.0).on(training)(training.folds.whole)
    assert_allclose(objective(vec(weights)), 3.0 * sums, rtol=1e-4)


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


@pytest.mark.parametrize("learner", [uc.Hybrid, uc.Segments])
@pytest.mark.parametrize("name", ["towards", "damped", "smooth", "sum"])
def test_an_aim_survives_the_file_of_its_policy(tmp_path, learner, name):
    policy = uc.ParametricPolicy(uc.Affine(), learner(secondary=AIMS[name])).fit(STATES, ACTIONS)
    uc.save(policy, tmp_path / "policy.npz")
    again = uc.load(tmp_path / "policy.npz")
    assert_array_equal(again(STATES), policy(STATES))
    assert_array_equal(again.fit(STATES, ACTIONS)(STATES), policy(STATES))

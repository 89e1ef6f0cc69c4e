"""The estimators, as scikit-learn sees them and as a person does."""

import pickle
import warnings
from dataclasses import replace
from inspect import signature

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn import config_context
from sklearn.base import clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.exceptions import NotFittedError
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler
from sklearn.utils.estimator_checks import check_estimator

import naive
import unconstrain as uc
from samples import draw
from unconstrain.base.errors import InvalidDataError, SettingError, UnconstrainError
from unconstrain.paper.systems.limit_cycle import LimitCycle
from unconstrain.training.first_look import PLACING_SAMPLES

POLICIES = [uc.ParametricPolicy, uc.LocallyLinearPolicy]


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning", "ignore::FutureWarning")
def test_scikit_learn_has_nothing_to_complain_about(kind):
    results = check_estimator(kind(), on_skip=None, on_fail=None)
    assert len(results) > 40
    assert {(r["check_name"], str(r["exception"])) for r in results if r["status"] == "failed"} == set()
    assert {r["check_name"] for r in results if r["status"] == "skipped"} <= {"check_array_api_input"}
    assert {r["status"] for r in results} <= {"passed", "skipped"}


def test_a_pipeline_scales_states_and_fits(data):
    states = 1000 * data.states
    pipeline = make_pipeline(StandardScaler(), uc.ParametricPolicy(uc.NormalisedRBF.grid(-2, 2, 3)))
    pipeline.fit(states, data.actions)
    scaled = (states - states.mean(axis=0)) / states.std(axis=0)
    alone = uc.ParametricPolicy(uc.NormalisedRBF.grid(-2, 2, 3)).fit(scaled, data.actions)
    assert_allclose(pipeline.predict(states), alone.predict(scaled), atol=1e-10)


def test_a_pipeline_may_make_the_features(data):
    quadratic = make_pipeline(PolynomialFeatures(2, include_bias=False), uc.ParametricPolicy(uc.Affine(), uc.Direct()))
    x, y = data.states.T
    basis = np.column_stack([np.ones(len(x)), x, y, x**2, x * y, y**2])
    expected = basis @ np.linalg.lstsq(basis, data.actions)[0]
    assert_allclose(quadratic.fit(data.states, data.actions).predict(data.states), expected, atol=1e-9)


def test_any_function_of_states_is_a_feature_map(data):
    # scikit-learn's transformers refuse empty tables; a policy must not ask for one.
    polynomial = PolynomialFeatures(2).fit(data.states)
    policy = uc.ParametricPolicy(polynomial.transform, uc.Direct()).fit(data.states, data.actions)
    basis = polynomial.transform(data.states)
    assert_allclose(policy.predict(data.states), basis @ np.linalg.lstsq(basis, data.actions)[0], atol=1e-9)


def test_learners_and_widths_can_be_searched(data):
    grid = {"learner": [uc.Direct(), uc.Hybrid()], "variance": [0.3, 3.0]}
    search = GridSearchCV(uc.LocallyLinearPolicy(), grid, cv=GroupKFold(3)).fit(
        data.states, data.actions, groups=data.groups
    )
    assert search.best_params_["learner"] == uc.Hybrid()
    assert search.best_score_ == pytest.approx(search.cv_results_["mean_test_score"].max())


def test_whole_demonstrations_can_be_left_out_of_a_cross_validation(data):
    scores = cross_val_score(uc.ParametricPolicy(), data.states, data.actions, cv=GroupKFold(3), groups=data.groups)
    assert scores.shape == (3,)
    assert (scores > 0.5).all()


def test_it_works_inside_a_target_transformer(data):
    scaled = TransformedTargetRegressor(
        uc.ParametricPolicy(uc.Affine(), uc.Direct()), func=lambda y: 2 * y, inverse_func=lambda y: y / 2
    )
    plain = uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit(data.states, data.actions)
    assert_allclose(scaled.fit(data.states, data.actions).predict(data.states), plain.predict(data.states), atol=1e-9)


def test_a_pickled_policy_predicts_and_goes_on_learning(policy_of, data):
    policy = policy_of(uc.Hybrid()).fit(data.states[:60], data.actions[:60], groups=data.groups[:60])
    copy = pickle.loads(pickle.dumps(policy))
    assert_array_equal(copy.predict(data.states), policy.predict(data.states))
    for one in (policy, copy):
        one.partial_fit(data.states[60:], data.actions[60:], groups=data.groups[60:])
    assert_array_equal(copy.predict(data.states), policy.predict(data.states))


def test_a_clone_has_the_settings_and_nothing_learnt(policy, data):
    copy = clone(policy.fit(data.states, data.actions))
    assert copy.learner == policy.learner
    assert not hasattr(copy, "solution_")


def test_fitting_again_forgets(policy, data):
    other = draw(seed=9, dimensions=2)
    twice = (
        clone(policy).fit(other.states[:, :1], other.actions[:, 0])
        if policy.__class__ is uc.LocallyLinearPolicy
        else clone(policy).fit(other.states, other.actions)
    )
    fresh = clone(policy).fit(data.states, data.actions)
    assert_array_equal(twice.fit(data.states, data.actions).predict(data.states), fresh.predict(data.states))


def test_defaults_work(data):
    for kind in POLICIES:
        policy = kind().fit(data.states, data.actions)
        assert policy.score(data.states, data.actions) > 0.8


def test_a_flat_target_gives_flat_predictions(policy_of, data):
    flat = policy_of(uc.Hybrid()).fit(data.states, data.actions[:, 0])
    column = policy_of(uc.Hybrid()).fit(data.states, data.actions[:, :1])
    assert flat.predict(data.states).shape == (90,)
    assert column.predict(data.states).shape == flat(data.states).shape == (90, 1)
    assert_array_equal(flat.predict(data.states), column.predict(data.states)[:, 0])


def test_one_dimensional_actions_are_regressed(data):
    # In one dimension û is a sign: both objectives are the same.
    direct, hybrid, pure = (
        uc.ParametricPolicy(uc.Affine(), learner).fit(data.states, data.actions[:, 0]).predict(data.states)
        for learner in (uc.Direct(), uc.Hybrid(threshold=0.0), uc.Inconsistency())
    )
    assert_allclose(hybrid, direct, atol=1e-9)
    assert_allclose(pure, direct, atol=1e-9)


def test_a_long_table_is_predicted_in_blocks_as_in_one(policy_of, data):
    policy = policy_of(uc.Hybrid()).fit(data.states, data.actions)
    many = np.random.default_rng(0).uniform(-1, 1, (10_000, 2))
    assert_allclose(policy.predict(many)[[0, 4095, 4096, 9999]], policy.predict(many[[0, 4095, 4096, 9999]]))


def test_the_score_is_the_share_of_observed_motion_that_is_explained(data):
    policy = uc.ParametricPolicy().fit(data.states, data.actions)
    weights = np.random.default_rng(0).uniform(0, 1, 90)
    usual = np.sqrt(sum(w * u @ u for w, u in zip(weights, data.actions, strict=True)) / weights.sum())
    weights_by_speed = [
        w * min(1.0, np.linalg.norm(u) / (0.5 * usual)) ** 2 for w, u in zip(weights, data.actions, strict=True)
    ]
    missed = naive.inconsistency(data.actions, policy.predict(data.states), weights_by_speed)
    moved = sum(w * u @ u for w, u in zip(weights_by_speed, data.actions, strict=True))
    assert policy.score(data.states, data.actions, sample_weight=weights) == pytest.approx(1 - missed / moved)


def test_rest_does_not_spoil_the_score_of_the_true_policy():
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (400, 2))
    held = np.arange(400) % 2 == 0  # against a wall, where the policy pushes on, and what is recorded is noise
    actions = np.where(held[:, None], 0.0, -states) + 1e-3 * rng.standard_normal((400, 2))
    true = uc.ParametricPolicy(uc.Affine(), "direct").fit(states, -states)
    plain = 1 - naive.inconsistency(actions, -states, np.ones(400)) / (actions**2).sum()
    assert plain < 0.7
    assert true.score(states, actions) > 0.99
    wrong = uc.ParametricPolicy(uc.Affine(), "direct").fit(states, states)
    assert wrong.score(states, actions) < 0


def test_a_score_is_the_same_in_blocks_and_with_repetitions(data, monkeypatch):
    policy = uc.ParametricPolicy(uc.Affine(), "direct").fit(data.states, data.actions)
    actions = data.actions * np.logspace(-3, 0, 90)[:, None]
    times = np.arange(90) % 3
    whole = policy.score(data.states, actions, sample_weight=times)
    assert whole == pytest.approx(policy.score(np.repeat(data.states, times, 0), np.repeat(actions, times, 0)))
    monkeypatch.setattr("unconstrain.training.batches.BLOCK_ROWS", 7)
    assert whole == pytest.approx(policy.score(data.states, actions, sample_weight=times))


def test_a_score_of_no_motion_is_zero(data):
    policy = uc.ParametricPolicy().fit(data.states, data.actions)
    assert policy.score(data.states, np.zeros_like(data.actions)) == 0.0


def test_groups_reach_every_fit_of_a_search_and_of_a_cross_validation(data):
    seen = []

    class Told(uc.LocallyLinearPolicy):
        def fit(self, X, y, *, sample_weight=None, groups=None):
            seen.append(None if groups is None else len(set(groups)))
            return super().fit(X, y, sample_weight=sample_weight, groups=groups)

    told = {"X": data.states, "y": data.actions, "cv": GroupKFold(3), "groups": data.groups}
    cross_val_score(Told(learner="hybrid"), **told, params={"groups": data.groups})
    assert seen == [4, 4, 4]
    with config_context(enable_metadata_routing=True):
        policy = Told(learner="hybrid").set_fit_request(groups=True)
        grid = {"variance": [0.3, 3.0]}
        GridSearchCV(policy, grid, cv=GroupKFold(3)).fit(data.states, data.actions, groups=data.groups)
        assert seen[3:] == [4] * 6 + [6]
        make_pipeline(StandardScaler(), policy).fit(data.states, data.actions, groups=data.groups)
        assert seen[-1] == 6


@pytest.mark.parametrize("method", ["fit", "partial_fit", "score"])
def test_groups_are_never_taken_for_weights(data, method):
    demos = [uc.Demonstration(data.states[data.groups == g], data.actions[data.groups == g]) for g in range(6)]
    policy = uc.ParametricPolicy(learner="hybrid").fit(data.states, data.actions)
    with pytest.raises(SettingError, match=rf"{method}: got 3 arrays.*{method}\(states, actions, groups=groups\)"):
        getattr(policy, method)(*uc.stack(demos))
    assert list(signature(getattr(policy, method)).parameters)[:2] == ["X", "y"]
    getattr(policy, method)(X=data.states, y=data.actions, sample_weight=np.ones(90))


def test_groups_are_never_taken_for_weights_on_a_cluster(data):
    with pytest.raises(SettingError, match=r"fit\(states, actions, groups=groups\)"):
        uc.cluster.fit(uc.ParametricPolicy(learner="hybrid"), data.states, data.actions, data.groups)


def test_demonstrations_are_groups(data):
    demos = [uc.Demonstration(data.states[data.groups == g], data.actions[data.groups == g]) for g in range(6)]
    states, actions, groups = uc.stack(demos)
    one = uc.LocallyLinearPolicy(1.0).fit_demonstrations(demos)
    two = uc.LocallyLinearPolicy(1.0).fit(states, actions, groups=groups)
    assert_array_equal(one.predict(states), two.predict(states))


def test_tables_of_pandas_are_taken_with_their_names(data):
    X, y = pd.DataFrame(data.states, columns=["x", "y"]), pd.DataFrame(data.actions)
    policy = uc.ParametricPolicy().fit(X, y, groups=pd.Series(data.groups))
    assert list(policy.feature_names_in_) == ["x", "y"]
    plain = uc.ParametricPolicy().fit(data.states, data.actions, groups=data.groups)
    assert_array_equal(policy.predict(X), plain.predict(data.states))
    assert uc.ParametricPolicy().fit(X, y[0]).predict(X).shape == (90,)


def test_support_tells_how_far_from_the_data_a_state_is(data):
    there = np.array([[0.0, 0.0], [50.0, 0.0]])
    for policy in (uc.ParametricPolicy(), uc.LocallyLinearPolicy()):
        near, far = policy.fit(data.states, data.actions).support(there)
        assert near > 0.3
        assert far < 1e-12


@pytest.mark.parametrize("features", [uc.Affine(), uc.Polynomial()])
def test_features_without_a_place_have_no_support_and_no_roughness(data, features):
    policy = uc.ParametricPolicy(features).fit(data.states, data.actions)
    with pytest.raises(SettingError, match=rf"support: {type(features).__name__} has no support\(states\)"):
        policy.support(data.states)
    assert_array_equal(policy.training_.model.roughness(1, 6), np.zeros((1, 6, 6)))


def test_centres_may_be_given(data):
    policy = uc.LocallyLinearPolicy(centres=[[0, 0], [1, 1]]).fit(data.states, data.actions)
    assert_array_equal(policy.fields_.centres, [[0.0, 0.0], [1.0, 1.0]])
    assert policy.solution_.weights.shape == (2, 2, 3)


def test_only_so_many_samples_place_the_features():
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (2 * PLACING_SAMPLES + 1, 1))
    seen = []

    class Watching(uc.Affine):
        def place(self, states):
            seen.append(states)
            return super().place(states)

    policy = uc.ParametricPolicy(Watching(), uc.Direct())
    for order in (slice(None), slice(None, None, -1), rng.permutation(len(states))):
        policy.fit(states[order], states[order])
    assert len(seen[0]) == PLACING_SAMPLES
    assert np.isin(seen[0], states).all()
    assert_allclose(seen[0].mean(), 0.0, atol=4 / np.sqrt(3 * PLACING_SAMPLES))
    assert_array_equal(seen[0], seen[1])
    assert_array_equal(seen[0], seen[2])


def test_samples_without_weight_place_nothing(data):
    weights = np.ones(90)
    far = np.vstack([data.states, [[1e6, 1e6]]])
    policy = uc.ParametricPolicy().fit(far, np.vstack([data.actions, [[0, 0]]]), sample_weight=np.append(weights, 0.0))
    plain = uc.ParametricPolicy().fit(data.states, data.actions)
    assert_allclose(policy.predict(data.states), plain.predict(data.states), atol=1e-7)


def test_the_solution_says_what_was_determined(data):
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(threshold=0.0)).fit(data.states, data.actions)
    assert policy.solution_.determined_share == 1.0
    one = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(threshold=0.0)).fit(data.states[:1], data.actions[:1])
    assert one.solution_.determined_share == pytest.approx(1 / 6)


@pytest.mark.parametrize("method", ["predict", "score", "support", "with_learner"])
@pytest.mark.parametrize("kind", POLICIES)
def test_nothing_works_before_fitting(kind, method, data):
    arguments = {"score": (data.states, data.actions), "with_learner": (uc.Direct(),)}.get(method, (data.states,))
    with pytest.raises(NotFittedError, match="not fitted yet"):
        getattr(kind(), method)(*arguments)


class NoFeatures:
    """Something that is no feature map."""

    def __repr__(self):
        return "NoFeatures()"


@pytest.mark.parametrize(
    ("policy", "error", "sentence"),
    [
        (
            uc.ParametricPolicy(NoFeatures()),
            SettingError,
            r"features: got NoFeatures\(\), expected 'auto' or a function of states",
        ),
        (uc.ParametricPolicy(lambda x: x[:, 0]), SettingError, r"features: got an array of shape \(1,\) for 1 states"),
        (
            uc.ParametricPolicy(lambda x: np.ones((7, 2))),
            SettingError,
            r"features: got an array of shape \(7, 2\) for 1",
        ),
        (uc.ParametricPolicy(lambda x: x / 0), InvalidDataError, "features: found .*inf at row 0, column 0"),
        (uc.ParametricPolicy(uc.NormalisedRBF([[0.0]], 1.0)), InvalidDataError, "states: got 2 columns, expected 1 as"),
        (uc.LocallyLinearPolicy(centres=[[0, 0, 0]]), InvalidDataError, "states: got 2 columns, expected 3 as"),
        (uc.LocallyLinearPolicy(centres=[[0, 0], [1]]), InvalidDataError, "centres: the rows have different lengths"),
        (uc.LocallyLinearPolicy(variance=-1.0), SettingError, "variance: got -1.0, expected a number above 1e-100"),
        (
            uc.LocallyLinearPolicy(at_least=1.5),
            SettingError,
            "at_least: got 1.5, expected a membership between 0 and 1",
        ),
        (
            uc.ParametricPolicy(validation=uc.Folds(by="demonstration")),
            SettingError,
            "validation by demonstration: expected groups",
        ),
    ],
)
def test_settings_that_do_not_fit_the_data_are_named(policy, error, sentence, data):
    with np.errstate(divide="ignore", invalid="ignore"), pytest.raises(error, match=sentence):
        policy.fit(data.states, data.actions)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"y": np.ones((89, 2))}, "got 90 states and 89 actions"),
        ({"y": None}, "requires y to be passed, but the target y is None"),
        ({"sample_weight": np.ones(89)}, "sample_weight: got 89 values, expected 90"),
        ({"sample_weight": -np.ones(90)}, "sample_weight: got -1.0 at row 0"),
        ({"sample_weight": np.zeros(90)}, "got no sample that counts: there is none, or all weights are zero"),
        ({"groups": [1, 2]}, r"groups: got an array of shape \(2,\), expected 90"),
    ],
)
def test_arrays_that_do_not_fit_together_are_named(change, sentence, data):
    with pytest.raises(InvalidDataError, match=sentence):
        uc.ParametricPolicy().fit(**({"X": data.states, "y": data.actions} | change))


def test_a_later_batch_has_the_columns_of_the_first(data):
    policy = uc.ParametricPolicy().fit(data.states, data.actions)
    with pytest.raises(InvalidDataError, match="actions: got 1 columns, expected 2 as before"):
        policy.partial_fit(data.states, data.actions[:, 0])
    with pytest.raises(InvalidDataError, match="X has 1 features, but ParametricPolicy is expecting 2"):
        policy.partial_fit(data.states[:, :1], data.actions)


def test_a_batch_that_is_refused_changes_nothing(data):
    policy = uc.ParametricPolicy().fit(data.states, data.actions)
    before = policy.predict(data.states)
    with pytest.raises(UnconstrainError):
        policy.partial_fit(data.states, np.full((90, 2), np.nan))
    policy.with_learner(uc.Direct())
    assert_array_equal(policy.predict(data.states), before)


def test_the_held_out_score_is_that_of_refitting_without_each_demonstration():
    data = draw(noise=0.2, groups=4)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Inconsistency(), uc.Folds(4))
    policy.fit(data.states, data.actions, groups=data.groups)
    missed = 0.0
    for group in range(4):
        out = data.groups == group
        other = uc.ParametricPolicy(uc.Affine(), uc.Inconsistency()).fit(data.states[~out], data.actions[~out])
        r = np.linalg.norm(data.actions[out], axis=1)
        along = (data.actions[out] / r[:, None] * other.predict(data.states[out])).sum(axis=1)
        missed += ((r - along) ** 2).sum()
    assert_allclose(policy.held_out_score(), 1 - missed / (data.actions**2).sum())


def test_there_is_no_held_out_score_of_a_single_sample():
    assert np.isnan(uc.LocallyLinearPolicy().fit([[0.0, 1.0]], [[1.0, 2.0]]).held_out_score())


def test_speed_power_is_a_sample_weight():
    demos = uc.rollout(LimitCycle(), [[0.1, 0.9], [0.5, -0.5], [-1.0, 0.2]], 30, 0.05)
    states, actions, groups = uc.stack(demos)
    weighted = uc.LocallyLinearPolicy(None).fit_demonstrations(demos, speed_power=2.0)
    by_hand = uc.LocallyLinearPolicy(None, learner=uc.Hybrid()).fit(
        states, actions, sample_weight=(actions**2).sum(axis=1), groups=groups
    )
    assert_allclose(weighted.predict(states), by_hand.predict(states), rtol=1e-6, atol=1e-9)


def test_movements_that_are_fully_held_do_not_vote():
    true = np.array([[0.0, 1.0, 0.2], [-1.0, 0.1, 0.0], [0.3, 0.0, -0.5]])
    rng = np.random.default_rng(0)

    def wipe(constraint):
        return uc.rollout(lambda x: x @ true.T, rng.normal(size=3), 30, 0.05, constraint)

    free = [wipe(uc.constraints.Plane(rng.normal(size=3))) for _ in range(20)]
    held = [wipe(lambda x, t: np.eye(3)[None]) for _ in range(8)]
    nearly = [replace(demo, actions=demo.actions + 1e-17 * rng.normal(size=demo.actions.shape)) for demo in held]
    for learner in (uc.Inconsistency(), uc.Hybrid(alpha=0.0)):
        for demos in (free + held, free + nearly):
            assert uc.nupe(uc.ParametricPolicy(uc.Affine(), learner).fit_demonstrations(demos), free) < 1e-12


def test_a_stream_of_one_demonstration_at_a_time_holds_demonstrations_out():
    data = draw(noise=0.2, groups=4)
    whole = uc.ParametricPolicy(uc.Affine()).fit(data.states, data.actions, groups=data.groups)
    stream = uc.ParametricPolicy(whole.features_)
    for group in range(4):
        of = data.groups == group
        stream.partial_fit(data.states[of], data.actions[of], groups=data.groups[of])
    assert_allclose(stream.predict(data.states), whole.predict(data.states))


def test_a_first_batch_that_does_not_move_leaves_folds_for_the_next():
    data = draw(noise=0.2)
    policy = uc.ParametricPolicy(uc.Affine()).partial_fit(np.ones((1, data.states.shape[1])), data.actions[:1])
    policy.partial_fit(data.states, data.actions)
    assert sum(part.weight.any() for part in policy.training_.gathered.parts) > 5


def opposed(seed=0):
    """Strokes that go up and down at the same places: no policy explains one by the others."""
    x = np.linspace(0, 1, 30)
    states = np.concatenate([np.column_stack([x, 0.01 * k + 0 * x]) for k in range(6)])
    groups = np.repeat(np.arange(6), 30)
    return states, np.column_stack([0 * groups, 1.0 - 2.0 * (groups % 2)]), groups


def test_a_fit_that_explains_next_to_nothing_warns_once_and_notes_it():
    states, actions, groups = opposed()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        policy = uc.LocallyLinearPolicy(None).fit(states, actions, groups=groups)
    assert policy.held_out_score() < 0.2
    assert [one.category for one in said] == [UserWarning]
    assert str(said[0].message) == policy.solution_.notes[-1]
    assert "explains next to nothing of held-out motion" in policy.solution_.notes[-1]
    fine = uc.LocallyLinearPolicy(None).fit(states, np.abs(actions), groups=groups)  # warnings are errors here
    assert not any("next to nothing" in note for note in fine.solution_.notes)


def test_actions_that_are_all_zero_teach_nothing_and_that_is_said():
    states, actions, groups = opposed()
    with pytest.warns(UserWarning, match="No action is other than zero"):
        policy = uc.LocallyLinearPolicy(None).fit(states, 0.0 * actions, groups=groups)
    assert policy.solution_.notes[-1].startswith("No action is other than zero")


@pytest.mark.parametrize("learner", ["robust", "hybrid"])
def test_learning_on_from_a_file_warns_where_samples_are_missed(data, tmp_path, learner):
    uc.save(
        uc.LocallyLinearPolicy(learner=learner).fit(data.states, data.actions, groups=data.groups), tmp_path / "p.npz"
    )
    stored = uc.load(tmp_path / "p.npz")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for _ in range(2):
            stored.partial_fit(data.states, data.actions, groups=data.groups + 10)
    assert ["all is learnt from sums alone" in str(one.message) for one in said] == [True] * (learner == "robust")
    with pytest.raises(SettingError, match="anew on all, and not on from a stored policy"):
        stored.uncertainty(data.states[:1])


def test_learning_on_in_memory_keeps_what_it_knows(data):
    policy = uc.LocallyLinearPolicy().fit(data.states[:45], data.actions[:45], groups=data.groups[:45])
    policy.partial_fit(data.states[45:], data.actions[45:], groups=data.groups[45:])
    assert policy.uncertainty(data.states[:1]).total.shape == (1, 2)
    policy.with_learner("hybrid")  # asked for: no warning

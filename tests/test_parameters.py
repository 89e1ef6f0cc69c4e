"""Settings, and settings of settings, as scikit-learn reads and changes them; and what is abstract."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV

import samples
import unconstrain as uc

DATA = samples.draw()


def local():
    return uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid(alpha=0.1))


def parametric():
    return uc.ParametricPolicy(uc.KMeansRBF(9), uc.Hybrid(), uc.Folds(5))


def test_settings_of_settings_are_read_by_two_underscores():
    settings = local().get_params()
    assert settings["learner__alpha"] == 0.1
    assert settings["learner"] == uc.Hybrid(alpha=0.1)
    assert "learner__alpha" not in local().get_params(deep=False)
    assert parametric().get_params()["features__count"] == 9
    assert parametric().get_params()["validation__count"] == 5


def test_settings_of_settings_are_changed_by_two_underscores():
    policy = parametric().set_params(features__count=4, validation__count=3, learner__alpha=0.3)
    assert policy.features == uc.KMeansRBF(4)
    assert policy.validation == uc.Folds(3)
    assert policy.learner == uc.Hybrid(alpha=0.3)


def test_an_object_and_its_settings_are_changed_together():
    policy = local().set_params(learner__steps=5, learner=uc.Robust(), validation=uc.HeldOut(), validation__share=0.5)
    assert policy.learner == uc.Robust(steps=5)
    assert policy.validation == uc.HeldOut(0.5)


@pytest.mark.parametrize(
    ("policy", "changes", "sentence"),
    [
        (
            local(),
            {"lerner": 1},
            r"lerner: LocallyLinearPolicy has no such setting, expected one of variance, at_least",
        ),
        (local(), {"lerner__alpha": 1}, r"lerner: LocallyLinearPolicy has no such setting"),
        (local(), {"learner__alhpa": 1}, r"alhpa: Hybrid has no such setting, expected one of alpha, threshold"),
        (local(), {"learner__alpha": -1}, r"alpha: got -1, expected a number of at least 0.0"),
        (parametric(), {"validation__count": 1}, r"count: got 1, expected a whole number of at least 2"),
        (uc.ParametricPolicy(), {"learner__alpha": 1}, r"learner__alpha: learner is None, which has no settings"),
        (uc.ParametricPolicy(learner="hybrid"), {"learner__alpha": 1}, r"learner is 'hybrid', which has no settings"),
        (parametric(), {"features__count__x": 1}, r"count__x: count is 9, which has no settings"),
    ],
)
def test_what_is_refused_changes_nothing(policy, changes, sentence):
    before, learner = policy.get_params(), policy.learner
    for others in ({}, {"validation": uc.Folds(7)}):
        with pytest.raises(uc.errors.SettingError, match=sentence):
            policy.set_params(**others, **changes)
        assert policy.get_params() == before
        assert policy.learner is learner


def test_settings_change_what_was_learnt_only_with_the_next_fit():
    policy = local().fit(DATA.states, DATA.actions)
    solution = policy.solution_
    policy.set_params(learner__alpha=10.0)
    assert policy.solution_ is solution


def test_a_shared_learner_is_not_changed_for_others():
    learner = uc.Hybrid()
    one, other = uc.LocallyLinearPolicy(learner=learner), uc.ParametricPolicy(learner=learner)
    one.set_params(learner__alpha=0.7)
    assert other.learner is learner
    assert learner == uc.Hybrid()


def test_clones_do_not_share():
    policy = parametric()
    first, second = clone(policy), clone(policy)
    for name in ("features", "learner", "validation"):
        parts = [getattr(one, name) for one in (policy, first, second)]
        assert parts[0] == parts[1] == parts[2]
        assert len({id(part) for part in parts}) == 3


@pytest.mark.parametrize(
    ("policy", "grid"),
    [
        (local(), {"learner__alpha": [0.1, 1.0]}),
        (parametric(), {"features__count": [2, 5], "validation__count": [2]}),
        (local(), {"learner": ["hybrid", "direct"]}),
    ],
)
def test_a_grid_search_goes_over_settings_of_settings(policy, grid):
    found = GridSearchCV(policy, grid, cv=2).fit(DATA.states, DATA.actions)
    assert set(found.best_params_) == set(grid)
    assert np.isfinite(found.cv_results_["mean_test_score"]).all()
    assert found.best_estimator_.get_params()[next(iter(grid))] == found.best_params_[next(iter(grid))]


def test_a_learner_goes_by_its_name():
    for name, kind in {
        "robust": uc.Robust,
        "hybrid": uc.Hybrid,
        "inconsistency": uc.Inconsistency,
        "direct": uc.Direct,
    }.items():
        by_name, by_object = (
            uc.LocallyLinearPolicy(0.5, learner=learner).fit(DATA.states, DATA.actions) for learner in (name, kind())
        )
        np.testing.assert_array_equal(by_name.solution_.weights, by_object.solution_.weights)
        assert repr(by_name) == f"LocallyLinearPolicy(learner={name!r}, variance=0.5)"


@pytest.mark.parametrize("learner", ["robusst", 3, uc.Robust])
def test_what_is_no_learner_is_answered_with_those_that_there_are(learner):
    sentence = "learner: got .*, expected one of 'robust', 'hybrid', 'inconsistency', 'direct', or a Learner such as"
    with pytest.raises(uc.errors.SettingError, match=sentence):
        uc.LocallyLinearPolicy(learner=learner).fit(DATA.states, DATA.actions)


class Plain(uc.Learner):
    """Not a dataclass, with a setting."""

    def __init__(self, alpha=0.2):
        self.alpha = alpha

    def learn(self, training):
        return uc.Hybrid(alpha=self.alpha).learn(training)


def test_a_learner_of_ones_own_may_be_any_class():
    policy = clone(uc.ParametricPolicy(uc.Affine(), Plain())).set_params(learner__alpha=0.4)
    fitted = policy.fit(DATA.states, DATA.actions)
    expected = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(alpha=0.4)).fit(DATA.states, DATA.actions)
    np.testing.assert_array_equal(fitted.predict(DATA.states), expected.predict(DATA.states))


class LearnsNothing(uc.Learner):
    """Without ``learn``."""


class PlacesNothing(uc.policies.Policy):
    """Without ``place``."""


@pytest.mark.parametrize(
    ("kind", "method"),
    [(uc.Learner, "learn"), (LearnsNothing, "learn"), (uc.policies.Policy, "places"), (PlacesNothing, "places")],
)
def test_what_is_abstract_cannot_be_made(kind, method):
    sentence = f"Can't instantiate abstract class {kind.__name__} with(out an implementation for)? abstract method "
    with pytest.raises(TypeError, match=sentence + f"'?{method}'?$"):
        kind()

"""A call that fails leaves the estimator as it was, and a retry counts nothing twice."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

import unconstrain as uc
from samples import draw
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.training import Batch, is_typical

DATA = draw(samples=120, groups=6)
POLICIES = {
    "of samples": uc.LocallyLinearPolicy(learner=uc.NoiseCorrected()),
    "hybrid": uc.ParametricPolicy(uc.KMeansRBF(5), uc.Hybrid()),
}


class LearnsNothing(uc.Direct):
    """A learner that fails once everything is summed."""

    def learn(self, training):
        raise RuntimeError("as told")


class LearnsNaN(uc.Direct):
    """A learner whose sums overflow."""

    def learn(self, training):
        found = super().learn(training)
        return replace(found, weights=np.nan * found.weights)


def halves():
    return [(DATA.states[rows], DATA.actions[rows], None, DATA.groups[rows]) for rows in (slice(0, 60), slice(60, 120))]


def broken():
    """A stream that breaks off after it gave something."""
    yield halves()[0]
    raise OSError("the disk is gone")


class Twice:
    """What can be walked through again, and breaks off on one of the walks."""

    def __init__(self, fails_on):
        self.walks, self.fails_on = 0, fails_on

    def __iter__(self):
        self.walks += 1
        yield halves()[0]
        if self.walks == self.fails_on:
            raise OSError("the disk is gone")
        yield halves()[1]


class Lost:
    """Adds up parts once, and then is gone."""

    calls = 0

    def __call__(self, function, parts):
        self.calls += 1
        if self.calls > 1:
            raise OSError("no worker answers")
        return sum_of(map(function, parts))


FAILING = {
    "a batch with NaN": lambda policy: policy.partial_fit(np.full((5, 2), np.nan), np.ones((5, 2))),
    "other columns": lambda policy: policy.partial_fit(np.ones((5, 3)), np.ones((5, 2))),
    "a batch without groups": lambda policy: policy.partial_fit(DATA.states, DATA.actions),
    "a fit to NaN": lambda policy: policy.fit(np.full((5, 2), np.nan), np.ones((5, 2))),
    "a fit to weights of zero": lambda policy: policy.fit(DATA.states, DATA.actions, sample_weight=np.zeros(120)),
    "a generator": lambda policy: policy.fit_batches(broken()),
    "the first walk": lambda policy: policy.fit_batches(Twice(fails_on=1)),
    "the second walk": lambda policy: policy.fit_batches(Twice(fails_on=2)),
    "no batch": lambda policy: policy.fit_batches([]),
    "no demonstration": lambda policy: policy.fit_demonstrations([]),
    "a learner": lambda policy: policy.set_params(learner=LearnsNothing()).partial_fit(
        *halves()[0][:2], groups=halves()[0][3]
    ),
    "a learner in fit": lambda policy: policy.set_params(learner=LearnsNothing()).fit(
        *halves()[0][:2], groups=halves()[0][3]
    ),
    "what is not finite": lambda policy: policy.set_params(learner=LearnsNaN()).partial_fit(
        *halves()[0][:2], groups=halves()[0][3]
    ),
    "what is not finite in fit": lambda policy: policy.set_params(learner=LearnsNaN()).fit(
        *halves()[0][:2], groups=halves()[0][3]
    ),
    "a cluster that is lost after the first look": lambda policy: policy.fit_parts([halves()], Lost()),
    "parts": lambda policy: policy.fit_parts([halves(), broken()], lambda call, parts: sum_of(map(call, parts))),
}


def sum_of(parts):
    first, *rest = parts
    for part in rest:
        first = first + part
    return first


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.parametrize("failing", FAILING)
def test_a_call_that_fails_leaves_the_policy_as_it_was(kind, failing):
    policy = clone(POLICIES[kind]).partial_fit(*halves()[0][:2], groups=halves()[0][3])
    before, learner = vars(policy).copy(), policy.learner
    with pytest.raises((uc.UnconstrainError, OSError, RuntimeError)):
        FAILING[failing](policy)
    policy.learner = learner
    assert vars(policy).keys() == before.keys()
    assert all(value is before[name] for name, value in vars(policy).items())
    retried = policy.partial_fit(*halves()[1][:2], groups=halves()[1][3])
    expected = (
        clone(POLICIES[kind])
        .partial_fit(*halves()[0][:2], groups=halves()[0][3])
        .partial_fit(*halves()[1][:2], groups=halves()[1][3])
    )
    assert_array_equal(retried.predict(DATA.states), expected.predict(DATA.states))
    assert retried.moments_.weight.sum() == expected.moments_.weight.sum()


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.parametrize("failing", FAILING)
def test_a_first_call_that_fails_fixes_nothing(kind, failing):
    policy = clone(POLICIES[kind])
    learner, before = policy.learner, vars(policy).keys()
    if failing not in ("a batch without groups", "other columns"):  # these are good first batches
        with pytest.raises((uc.UnconstrainError, OSError, RuntimeError)):
            FAILING[failing](policy)
        policy.learner = learner
        assert vars(policy).keys() == before
        assert not hasattr(policy, "n_features_in_")
    scaled = (1000 * DATA.states, 1000 * DATA.actions, None, DATA.groups)
    assert_allclose(
        policy.partial_fit(*scaled[:2], groups=scaled[3]).predict(scaled[0]),
        clone(policy).fit(*scaled[:2], groups=scaled[3]).predict(scaled[0]),
    )


def test_what_is_not_finite_is_neither_saved_nor_exported(tmp_path):
    policy = clone(POLICIES["hybrid"]).fit(DATA.states, DATA.actions, groups=DATA.groups)
    policy.solution_ = replace(policy.solution_, weights=np.where(policy.solution_.weights > 0, np.inf, 0.0))
    for write in (partial(uc.save, policy), policy.export_c, policy.export_onnx):
        (tmp_path / "old").write_text("old")
        with pytest.raises(InvalidDataError, match=r"is not finite: NaN or infinity in \d+ of \d+ weights"):
            write(tmp_path / "old")
        assert (tmp_path / "old").read_text() == "old"


@pytest.mark.parametrize("unit", [1e-320, 1e-307, 1e300])
@pytest.mark.parametrize("kind", POLICIES)
def test_weights_in_any_unit_give_a_finite_policy_or_a_sentence(kind, unit):
    policy = clone(POLICIES[kind])
    try:
        policy.fit(DATA.states, DATA.actions, sample_weight=np.full(120, unit), groups=DATA.groups)
    except uc.UnconstrainError:
        assert not hasattr(policy, "solution_")
    else:
        assert np.isfinite(policy.predict(DATA.states)).all()


@pytest.mark.parametrize("scale", [1.0, 1000.0])
@pytest.mark.parametrize("kind", POLICIES)
def test_a_stream_that_begins_with_single_samples_waits_for_a_spread(kind, scale):
    states, actions = scale * DATA.states, scale * DATA.actions
    policy = clone(POLICIES[kind])
    for row in range(6):
        policy.partial_fit(states[row : row + 1], actions[row : row + 1], groups=DATA.groups[row : row + 1])
        assert np.isfinite(policy.predict(states)).all()
    policy.partial_fit(states[6:], actions[6:], groups=DATA.groups[6:])
    assert policy.moments_.weight.sum() > 0.2 * len(states)
    assert policy.score(states, actions) > 0.9
    [whole] = clone(policy).fit(states, actions, groups=DATA.groups).moments_.weight.sum(keepdims=True)
    assert policy.moments_.weight.sum() > 0.3 * whole


def test_a_generator_that_begins_with_single_samples_is_read_until_there_is_a_spread():
    rows = [slice(0, 1), slice(1, 2), slice(2, 3), slice(3, 120)]
    batches = [(1000 * DATA.states[r], 1000 * DATA.actions[r], None, DATA.groups[r]) for r in rows]
    policy = uc.LocallyLinearPolicy().fit_batches(iter(batches))
    assert policy.fields_.variance > 1000.0
    assert policy.score(1000 * DATA.states, 1000 * DATA.actions) > 0.9


def test_states_that_never_spread_are_learnt_from_all_the_same():
    policy = uc.LocallyLinearPolicy()
    for _ in range(3):
        policy.partial_fit(np.ones((4, 2)), np.full((4, 2), 0.5))
    assert_allclose(policy.predict(np.ones((1, 2))), [[0.5, 0.5]], atol=1e-6)
    assert policy.moments_.weight.sum() == 12.0


@pytest.mark.parametrize("learner", [uc.Robust(), uc.Likelihood(), uc.NoiseCorrected(), uc.Segments(), "robust"])
@pytest.mark.filterwarnings("ignore:row-order")
def test_speed_is_weighed_once_wherever_it_comes_from(learner, tmp_path):
    path = tmp_path / "a.csv"
    rows = "\n".join(",".join(map(repr, map(float, row))) for row in np.hstack([DATA.states, DATA.actions]))
    path.write_text(f"x,y,vx,vy\n{rows}\n")
    stream = uc.Stream(path, uc.preparation.Recipe(("x", "y"), ("vx", "vy")), speed_power=2.0)
    policy = uc.ParametricPolicy(uc.Affine(), learner)
    demonstration = uc.Demonstration(DATA.states, DATA.actions)
    for refused in (
        lambda: policy.fit_batches(stream),
        lambda: policy.fit_demonstrations([demonstration], speed_power=2.0),
    ):
        with pytest.raises(SettingError, match="weigh speed themselves"):
            refused()
    uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit_batches(stream)


def test_what_has_no_learn_is_refused_before_any_work():
    with pytest.raises(SettingError, match=r"learner: got 'hybird', expected one of 'robust'"):
        uc.ParametricPolicy(learner="hybird").fit(DATA.states, DATA.actions)
    with pytest.raises(InvalidDataError, match="no part"):
        uc.ParametricPolicy().fit_parts([], sum_of)


def typical(states, newest):
    """Whether states are enough of a stream, the last ``newest`` of which have just come."""
    return is_typical(Batch(states, states), newest)


class TestWhenAStreamIsTypical:
    def test_one_good_batch_is_enough_after_any_number_of_small_ones(self):
        states = np.random.default_rng(0).normal(size=(100, 2))
        assert typical(states, newest=100)
        assert not typical(states[:29], newest=29)
        assert typical(np.cumsum(np.ones((60, 2)), axis=0), newest=57)

    def test_samples_one_by_one_are_once_their_spread_has_settled(self):
        scattered = np.random.default_rng(0).normal(size=(60, 2))
        moving = np.column_stack([np.arange(999.0), np.zeros(999)])
        assert typical(scattered, newest=1)
        assert not typical(scattered[:20], newest=1)
        assert not typical(moving, newest=9)

    def test_nothing_waits_for_ever(self):
        assert typical(np.column_stack([np.arange(1000.0), np.zeros(1000)]), newest=1)
        assert typical(np.ones((1000, 2)), newest=1)
        assert not typical(np.ones((999, 2)), newest=1)

    def test_waiting_samples_are_held_once_and_never_stored(self, tmp_path):
        policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).partial_fit(DATA.states[:5], DATA.actions[:5])
        uc.save(policy, tmp_path / "waiting.npz")
        assert not hasattr(uc.load(tmp_path / "waiting.npz"), "_waiting")
        given = DATA.states[5:9].copy()
        policy.partial_fit(given, DATA.actions[5:9])
        given[:] = 1e6  # who gave it may use it again
        assert policy.partial_fit(DATA.states[9:], DATA.actions[9:]).moments_.weight.sum() == len(DATA.states)
        whole = uc.ParametricPolicy(policy.features_).fit(DATA.states, DATA.actions)
        assert_allclose(policy.moments_.gram, whole.moments_.gram, atol=1e-9)

    def test_groups_that_only_some_waiting_batches_name_count_for_none(self):
        policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).partial_fit(DATA.states[:5], DATA.actions[:5])
        policy.partial_fit(DATA.states[5:], DATA.actions[5:], groups=DATA.groups[5:])
        assert policy.training_.split.by == "sample"

    def test_weights_of_some_waiting_batches_are_ones_elsewhere(self):
        policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).partial_fit(DATA.states[:5], DATA.actions[:5])
        policy.partial_fit(DATA.states[5:], DATA.actions[5:], sample_weight=np.full(115, 2.0))
        assert policy.moments_.weight.sum() == 5.0 + 230.0

    def test_a_long_stream_of_single_samples_takes_no_longer_than_its_length_says(self):
        states = np.column_stack([np.arange(300.0), 0.3 * np.arange(300.0)])
        looked = []
        policy = uc.ParametricPolicy(uc.Affine(), Counts(looked))
        for row in range(300):
            policy.partial_fit(states[row : row + 1], states[row : row + 1])
        assert looked == list(range(1, 301))  # samples are summed in one piece, not one by one


class Counts(uc.Direct):
    """Notes the weight of what it learns from."""

    def __init__(self, seen):
        object.__setattr__(self, "seen", seen)

    def learn(self, training):
        self.seen.append(int(training.folds.whole.weight.sum()))
        return super().learn(training)

"""Whatever comes in: a clear error, or a finite policy that says what it knows."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csr_array
from sklearn.base import clone

import unconstrain as uc
from conftest import LEARNERS, POLICIES
from samples import draw
from unconstrain.base.errors import InvalidDataError, SettingError, UnconstrainError


def broken(table, row, column, value):
    table = table.copy()
    table[row, column] = value
    return table


# NaN, infinity, ragged, wrong dimension, empty: an error that says where

BAD_STATES = [
    (lambda X: broken(X, 7, 1, np.nan), "states: found nan at row 7, column 1"),
    (lambda X: broken(X, 7, 0, -np.inf), "states: found -inf at row 7, column 0"),
    (lambda X: broken(X, 3, 1, 1e200), r"states: found 1e\+200 at row 3, column 1, expected numbers up to 1e\+30"),
    (lambda X: [[1.0, 2.0], [1.0]], "states: the rows have different lengths"),
    (lambda X: X[:, 0], "Expected 2D array, got 1D array instead"),
    (lambda X: X[None], "Found array with dim 3"),
    (lambda X: X[:0], r"Found array with 0 sample\(s\)"),
    (lambda X: X[:, :0], r"Found array with 0 feature\(s\)"),
    (lambda X: [], r"states: got an array of shape \(0,\)"),
    (lambda X: [["a", "b"]], "states: got values that are not numbers"),
    (lambda X: X.astype(complex), "Complex data not supported"),
]

BAD_ACTIONS = [
    (lambda y: broken(y, 7, 1, np.nan), "actions: found nan at row 7, column 1"),
    (lambda y: broken(y, 7, 1, np.inf), "actions: found inf at row 7, column 1"),
    (lambda y: broken(y, 7, 1, -1e200), r"actions: found -1e\+200 at row 7, column 1, expected numbers up to"),
    (lambda y: [[1.0, 2.0], [1.0]], "actions: the rows have different lengths"),
    (lambda y: [1.0, [2.0, 3.0]], "actions: the rows have different lengths"),
    (lambda y: y[None], r"actions: got an array of shape \(1, 90, 2\), expected two dimensions"),
    (lambda y: y[:0], r"actions: got an empty array of shape \(0, 2\)"),
    (lambda y: [], r"actions: got an empty array of shape \(0, 1\)"),
    (lambda y: 1.0, r"actions: got an array of shape \(\), expected two dimensions"),
    (lambda y: y[:5], "got 90 states and 5 actions"),
    (lambda y: ["a"] * 90, "actions: got values that are not numbers"),
    (csr_array, "actions: got values that are not numbers"),
]


@pytest.mark.parametrize("kind", [uc.ParametricPolicy, uc.LocallyLinearPolicy])
@pytest.mark.parametrize(("spoil", "sentence"), BAD_STATES)
def test_states_that_cannot_be_learnt_from_are_named(kind, spoil, sentence, data):
    with pytest.raises(InvalidDataError, match=sentence):
        kind().fit(spoil(data.states), data.actions)
    with pytest.raises(InvalidDataError, match=sentence):
        kind(learner=uc.Direct()).fit(data.states, data.actions).predict(spoil(data.states))


@pytest.mark.parametrize(("spoil", "sentence"), BAD_ACTIONS)
def test_actions_that_cannot_be_learnt_from_are_named(spoil, sentence, data):
    with pytest.raises(InvalidDataError, match=sentence):
        uc.ParametricPolicy().fit(data.states, spoil(data.actions))


def test_sparse_states_are_refused_in_scikit_learn_s_words(data):
    with pytest.raises(TypeError, match="Sparse data was passed"):
        uc.ParametricPolicy().fit(csr_array(data.states), data.actions)


def test_among_demonstrations_the_bad_one_is_named(data):
    with pytest.raises(InvalidDataError, match="actions of 'take 2': found nan at row 4, column 1"):
        uc.ParametricPolicy().fit_demonstrations(
            [
                uc.Demonstration(data.states, data.actions, name="take 1"),
                uc.Demonstration(data.states, broken(data.actions, 4, 1, np.nan), name="take 2"),
            ]
        )


def test_groups_must_be_one_name_for_each_sample(data):
    with pytest.raises(InvalidDataError, match="groups: found nan at row 1"):
        uc.ParametricPolicy().fit(data.states[:3], data.actions[:3], groups=[0.0, np.nan, 1.0])


# Little to learn from: fits, and says what is determined

FAR = np.array([[0.0, 0.0], [1e3, -1e3], [1e12, 1e12], [-1e25, 0.0]])


def assert_finite(policy, states):
    if isinstance(of := policy.features_, uc.Polynomial):
        own = (states - of.centre) / of.scale
        states = of.centre + of.scale * np.sign(own) * np.abs(own) ** (1 / of.degree)  # whose features are as large
    assert np.isfinite(policy.solution_.weights).all()
    assert np.isfinite(policy.predict(states)).all()
    assert 0 <= policy.solution_.determined_share <= 1


def test_all_actions_zero_teach_to_stand_still(policy, data):
    policy.fit(data.states, np.zeros((90, 2)))
    assert_array_equal(policy.predict(data.states), np.zeros((90, 2)))
    if not isinstance(policy.learner, uc.Direct) and not getattr(policy.learner, "softness", 0):
        assert policy.solution_.determined_share == 0.0


@pytest.mark.parametrize("repetitions", [1, 7])
def test_one_state_teaches_what_happens_there(policy, repetitions):
    x, u = np.tile([[0.3, 0.1]], (repetitions, 1)), np.tile([[2.0, -1.0]], (repetitions, 1))
    policy.fit(x, u)
    assert_finite(policy, FAR)
    assert_allclose(policy.predict(x), u, atol=1e-6)
    if not isinstance(policy.learner, uc.Direct):
        assert (policy.solution_.determined <= 2).all()


def test_one_constrained_state_teaches_what_was_seen_of_it(policy_of):
    # Seen along (1, 0) and along (0, 1): together they determine both coordinates, though neither shows it.
    x = np.zeros((2, 2))
    policy = policy_of(uc.Inconsistency()).fit(x, np.array([[2.0, 0.0], [0.0, -1.0]]))
    assert_allclose(policy.predict(x[:1]), [[2.0, -1.0]], atol=1e-9)


def test_collinear_states_are_fitted_where_they_are(policy, data):
    line = np.outer(data.states[:, 0], [1.0, 2.0])
    actions = np.column_stack([line[:, 0], 1 - line[:, 0]])
    policy.fit(line, actions)
    assert_finite(policy, FAR)
    if isinstance(policy, uc.LocallyLinearPolicy) or isinstance(policy.features, uc.Affine):
        assert_allclose(policy.predict(line), actions, atol=1e-5)
    assert policy.solution_.determined_share < 1.0 or isinstance(policy.features, uc.NormalisedRBF | uc.KMeansRBF)


@pytest.mark.parametrize("learner", LEARNERS.values(), ids=LEARNERS)
def test_features_that_repeat_each_other_share_the_work(learner, data):
    # Least norm: a column three times over is the column once, scaled, whatever the learner.
    once = uc.ParametricPolicy(lambda x: np.sqrt(3) * np.column_stack([x, np.ones(len(x))]), learner)
    thrice = uc.ParametricPolicy(lambda x: np.tile(np.column_stack([x, np.ones(len(x))]), (1, 3)), learner)
    for policy in (once, thrice):
        policy.fit(data.states, data.actions)
    assert_allclose(thrice.predict(data.states), once.predict(data.states), atol=1e-6)
    assert thrice.solution_.determined == once.solution_.determined


def test_a_feature_that_is_always_zero_gets_no_weight(learner, data):
    policy = uc.ParametricPolicy(lambda x: np.column_stack([x, 0 * x[:, 0]]), learner).fit(data.states, data.actions)
    assert_allclose(policy.solution_.weights[0, :, 2], 0, atol=1e-12)


def test_more_features_than_samples_fit(learner):
    data = draw(samples=5)
    policy = uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 5), learner).fit(data.states, data.actions)
    assert_finite(policy, FAR)
    assert policy.solution_.determined[0] <= 10


@pytest.mark.parametrize("kind", ["affine", "cubic", "kmeans", "local"])
def test_a_state_column_that_never_moves_changes_nothing(kind, data):
    policy_of = POLICIES[kind]
    plain = policy_of(uc.Hybrid(threshold=1e-3)).fit(data.states, data.actions)
    for value in (0.0, 0.1, 1e6):
        wide = np.column_stack([data.states, np.full(90, value)])
        stuck = policy_of(uc.Hybrid(threshold=1e-3)).fit(wide, data.actions)
        assert_allclose(stuck.predict(wide), plain.predict(data.states), atol=1e-5)


def test_far_from_all_data_predictions_stay_finite(policy, data):
    assert_finite(policy.fit(data.states, data.actions), FAR)


def test_so_far_away_that_a_monomial_has_no_digits_left_is_refused(data):
    policy = uc.ParametricPolicy(uc.Polynomial(3), uc.Direct()).fit(data.states, data.actions)
    with pytest.raises(InvalidDataError, match=r"features: found .* at row 0, column 0, expected numbers up to 1e\+30"):
        policy.predict([[1e12, 0.0]])


def test_far_away_the_nearest_field_predicts(data):
    policy = uc.LocallyLinearPolicy(0.05).fit(data.states, data.actions)
    far = np.array([[1e4, 3e3]])
    nearest = ((policy.fields_.centres - far) ** 2).sum(axis=1).argmin()
    alone = policy.solution_.weights[nearest] @ policy.features_(far)[0]
    assert_allclose(policy.predict(far)[0], alone, rtol=1e-6)
    assert policy.support(far) == [0.0]


# The same numbers in another form

FORMS = {
    "lists": lambda a: a.tolist(),
    "read-only": lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    "column by column": np.asfortranarray,
    "every other row": lambda a: np.repeat(a, 2, axis=0)[::2],
    "backwards": lambda a: a[::-1].copy()[::-1],
    "objects": lambda a: a.astype(object),
    "big endian": lambda a: a.astype(">f8"),
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_the_form_of_the_numbers_does_not_matter(policy, form, data):
    plain = clone(policy).fit(data.states, data.actions).predict(data.states)
    other = (
        clone(policy)
        .fit(form(data.states), form(data.actions), sample_weight=form(np.ones(90)))
        .predict(form(data.states))
    )
    assert_allclose(other, plain, atol=1e-9)


def test_single_precision_costs_its_own_rounding_only(policy_of, data):
    # A threshold that is given: a choice between nearly equal scores may tip on the seventh digit.
    X, y = data.states.astype(np.float32), data.actions.astype(np.float32)
    single = policy_of(uc.Hybrid(threshold=1e-2)).fit(X, y)
    double = policy_of(uc.Hybrid(threshold=1e-2)).fit(data.states, data.actions)
    assert single.predict(X).dtype == np.float64
    assert_allclose(single.predict(X), double.predict(data.states), atol=1e-4)


@pytest.mark.parametrize("dtype", [np.int8, np.int64, np.uint16])
def test_integers_are_numbers(policy_of, dtype, data):
    X, y = np.round(10 * data.states + 20).astype(dtype), np.round(10 * data.actions + 50).astype(dtype)
    whole = policy_of(uc.Hybrid()).fit(X, y)
    real = policy_of(uc.Hybrid()).fit(X.astype(float), y.astype(float))
    assert_array_equal(whole.predict(X), real.predict(X.astype(float)))


def test_the_data_is_never_written_to(policy, data):
    tables = [a.copy() for a in (data.states, data.actions)]
    for table in tables:
        table.flags.writeable = False
    policy.fit(*tables).predict(tables[0])
    assert_array_equal(tables[0], data.states)


@pytest.mark.parametrize("unit", [1e-8, 1e-3, 1e8])
@pytest.mark.parametrize("kind", [uc.ParametricPolicy, uc.LocallyLinearPolicy])
def test_units_of_states_and_actions_do_not_matter(kind, unit, data, once):
    def predicted(states_unit):
        fitted = [
            kind(learner=one).fit(states_unit * data.states, data.actions / states_unit) for one in LEARNERS.values()
        ]
        return [states_unit * one.predict(states_unit * data.states) for one in fitted]

    plain = once(f"plain units {kind.__name__}", lambda: predicted(1.0))
    assert_allclose(predicted(unit), plain, atol=1e-5)


@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e-160, 1e-30, 1e29])
def test_actions_of_any_size_give_a_finite_policy(policy, size, data):
    policy.fit(data.states, size * data.actions)
    assert_finite(policy, data.states)
    assert np.abs(policy.predict(data.states)).max() < 100 * size


@pytest.mark.parametrize("size", [1e-300, 1e-100, 1e-30, 1e15, 1e29])
def test_states_of_any_size_give_a_finite_policy(size, data):
    for policy in (uc.ParametricPolicy(), uc.ParametricPolicy(uc.Affine()), uc.LocallyLinearPolicy()):
        assert_finite(policy.fit(size * data.states, data.actions), size * data.states)


@pytest.mark.parametrize("weight", [1e-300, 1e-30, 1e29])
def test_weights_of_any_size_give_a_finite_policy(policy, weight, data):
    policy.fit(data.states, data.actions, sample_weight=np.full(90, weight))
    assert_finite(policy, data.states)


def test_weights_of_very_different_size_give_a_finite_policy(policy, data):
    assert_finite(policy.fit(data.states, data.actions, sample_weight=np.logspace(-300, 10, 90)), data.states)


def test_a_single_wild_state_does_not_spoil_the_others(data):
    for policy in (uc.ParametricPolicy(), uc.LocallyLinearPolicy(), uc.LocallyLinearPolicy(0.1)):
        wild = np.vstack([data.states, [[1e6, -1e6]]])
        policy.fit(wild, np.vstack([data.actions, [[1.0, 1.0]]]))
        assert_finite(policy, wild)


# Anything at all

numbers = st.one_of(
    st.sampled_from([0.0, 1.0, -1.0, 0.1, 1e-8, 1e8, 5e-324, 1e-300, 1e-160, 1e30, -1e30]),
    st.floats(-2, 2),
    st.floats(-1e30, 1e30),
)


@st.composite
def tables(draw):
    samples, n, d = draw(st.integers(1, 12)), draw(st.integers(1, 3)), draw(st.integers(1, 3))
    return (
        draw(hnp.arrays(float, (samples, n), elements=numbers)),
        draw(hnp.arrays(float, (samples, d), elements=numbers)),
        draw(st.none() | st.lists(st.integers(0, 3), min_size=samples, max_size=samples)),
    )


@pytest.mark.parametrize("learner", LEARNERS.values(), ids=LEARNERS)
@pytest.mark.parametrize("kind", ["affine", "kmeans", "local"])
@given(table=tables())
@settings(max_examples=25)
def test_any_finite_data_gives_a_finite_policy(kind, learner, table):
    states, actions, groups = table
    policy = POLICIES[kind](learner)
    if kind == "local":
        policy.set_params(variance=None)
    policy.fit(states, actions, groups=groups)
    assert_finite(policy, states)


@given(hnp.arrays(float, (4, 2), elements=st.floats(allow_nan=True, allow_infinity=True, width=64)))
def test_any_data_at_all_gives_a_policy_or_our_own_error(table):
    policy = uc.ParametricPolicy(uc.Affine())
    if (np.abs(table) <= 1e30).all():
        assert_finite(policy.fit(table, table), table)
    else:
        with pytest.raises(UnconstrainError, match=r"states: found .* at row \d, column \d"):
            policy.fit(table, table)


@pytest.mark.parametrize("learner", [uc.Robust(), uc.Likelihood()], ids=["robust", "likelihood"])
@pytest.mark.parametrize("scale", [1e-300, 1e-170])
def test_a_batch_beside_which_the_first_is_nothing_is_refused_in_words(learner, scale):
    states = np.random.default_rng(0).normal(size=(20, 2))
    policy = uc.ParametricPolicy(uc.Affine(), learner).fit(states, scale * states)
    before = policy.predict(states)
    with pytest.raises(InvalidDataError, match="one unit for all batches"):
        policy.partial_fit(states, -1e29 * states)
    assert_array_equal(policy.predict(states), before)


def test_what_is_masked_is_refused_as_missing(policy, data):
    masked = np.ma.masked_greater(data.states, np.sort(data.states[:, 0])[-3])
    for X, y, of in ((masked, data.actions, "states"), (data.states, np.ma.masked_greater(data.actions, 0), "actions")):
        with pytest.raises(InvalidDataError, match=f"{of}: found nan at row"):
            clone(policy).fit(X, y)
    policy.fit(np.ma.masked_array(data.states), np.ma.masked_array(data.actions))  # nothing in it is masked
    plain = clone(policy).fit(data.states, data.actions)
    assert_array_equal(policy.predict(data.states), plain.predict(data.states))
    with pytest.raises(InvalidDataError, match="states: found nan at row"):
        policy.predict(masked)


@pytest.mark.parametrize(
    "table", [pd.DataFrame([[1.0, 2.0]]), pd.DataFrame([[1.0, 2.0]], columns=["x", "y"]), np.eye(2)]
)
def test_a_table_in_memory_is_no_path(table):
    for paths in (table, [table]):
        with pytest.raises(SettingError, match=r"paths: got \w+, expected paths; .* uc.Recording\(columns, values\)"):
            uc.read(paths)


def test_names_of_columns_may_be_one_text():
    assert uc.Recipe(states="x, y", actions="vx,vy") == uc.Recipe(states=("x", "y"), actions=("vx", "vy"))
    assert uc.Recipe(states="x").states == ("x",)
    with pytest.raises(SettingError, match="each once"):
        uc.Recipe(states="x,x")

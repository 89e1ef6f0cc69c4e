"""Arrays of other libraries give what NumPy gives, in their own library."""

import sys
from importlib import import_module

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import samples
import unconstrain as uc
from unconstrain.base.arrays import as_matrix, beside, is_foreign, namespace, on_host
from unconstrain.base.errors import InvalidDataError, MissingExtraError
from unconstrain.models.receptive_fields import ReceptiveFields
from unconstrain.risks.moments import gather
from unconstrain.risks.objectives import inconsistency, standard_risk
from unconstrain.risks.quadratic import Quadratic, lexicographic_path, minimum

LIBRARIES = {"strict": "array_api_strict", "torch": "torch"}
CENTRES = np.random.default_rng(0).uniform(-1, 1, (7, 2))


@pytest.fixture(params=LIBRARIES.values(), ids=LIBRARIES)
def library(request):
    """Each library, imported by the processes that test it alone: PyTorch takes seconds."""
    return import_module(request.param)


@pytest.fixture
def torch():
    """PyTorch."""
    return import_module("torch")


@pytest.fixture
def to(library):
    """From NumPy to each library."""
    return lambda array: library.asarray(np.array(array))


def assert_same(found, expected, tolerance=1e-12, *, foreign=True):
    assert is_foreign(found) == foreign
    assert_allclose(on_host(found), expected, rtol=tolerance, atol=tolerance * max(1.0, np.abs(expected).max()))


def states(rows=30):
    return np.random.default_rng(1).uniform(-1, 1, (rows, 2))


@pytest.mark.parametrize(
    "of",
    [
        uc.Affine(),
        uc.Affine(np.array([0.1, 0.2]), np.array([2.0, 0.5])),
        uc.Polynomial(3),
        uc.Polynomial(2, np.array([0.1, 0.2]), np.array([2.0, 0.5])),
        uc.NormalisedRBF(CENTRES, 0.3),
        uc.NormalisedRBF(CENTRES, 0.3).support,
        ReceptiveFields(CENTRES, 0.3).weights,
        ReceptiveFields(CENTRES, 0.3).shares,
        ReceptiveFields(CENTRES, 0.3).support,
    ],
    ids=["affine", "scaled", "cubic", "scaled quadratic", "rbf", "support", "weights", "shares", "field support"],
)
def test_features_and_fields(to, of):
    assert_same(of(to(states())), of(states()))


@pytest.mark.parametrize("models", [None, 1, 3])
def test_sums(to, models):
    rng = np.random.default_rng(2)
    features, actions = rng.standard_normal((40, 4)), rng.standard_normal((40, 2))
    actions[::9] = 0.0
    weights = None if models is None else rng.uniform(0, 1, (40, models))
    expected = gather(features, actions, weights)
    found = gather(to(features), to(actions), None if weights is None else to(weights))
    for mine, theirs in zip(found.sums, expected.sums, strict=True):
        assert_same(mine, theirs)
    for mine, theirs in zip(found.on_host().sums, expected.sums, strict=True):
        assert_same(mine, theirs, foreign=False)
    for mine, theirs in zip((found + 2.0 * found).sums, expected.sums, strict=True):
        assert_same(mine, 3 * theirs)


def test_float32_is_summed_in_float64(library):
    rng = np.random.default_rng(3)
    features, actions = (rng.uniform(0, 1, (5000, k)).astype(np.float32) for k in (3, 2))
    found = gather(*(library.asarray(part, dtype=library.float32) for part in (features, actions)))
    assert on_host(found.gram).dtype == np.float64
    assert_same(found.gram, gather(features.astype(float), actions.astype(float)).gram)


def problems(seed, rows, size=5):
    rng = np.random.default_rng(seed)
    A, b = rng.standard_normal((2, rows, size)), rng.standard_normal((2, rows, 1))
    return Quadratic(A.mT @ A, (A.mT @ b)[..., 0], (b * b).sum(axis=(1, 2)))


def moved(quadratic, to):
    return Quadratic(to(quadratic.hessian), to(quadratic.linear), to(quadratic.constant))


@pytest.mark.parametrize("rows", [3, 9], ids=["singular", "regular"])
def test_the_whole_path(to, rows):
    first, second = problems(4, rows), problems(5, rows)
    expected, found = lexicographic_path(first, second), lexicographic_path(moved(first, to), moved(second, to))
    assert_same(found.weights, expected.weights, 1e-8)
    splits = expected.split(0.1)
    assert_array_equal(on_host(found.split(0.1)), splits)
    assert_same(found.at(to(splits)), expected.at(splits), 1e-8)
    assert_same(found.threshold(to(splits)), expected.threshold(splits), 1e-8)
    assert_same(moved(second, to)(found.weights), second(expected.weights), 1e-8)
    assert_same(minimum(moved(second, to)), minimum(second), 1e-8)
    assert_same(lexicographic_path(moved(first, to)).weights, lexicographic_path(first).weights, 1e-8)


def test_objectives_of_sums(to):
    features, actions = states(), states()[:, ::-1] + 1.0
    expected, found = gather(features, actions), gather(to(features), to(actions))
    for objective in (inconsistency, standard_risk):
        assert_same(objective(found).hessian, objective(expected).hessian)
        assert_same(objective(found).linear, objective(expected).linear)


POLICIES = {
    "grid": lambda: uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 3), uc.Hybrid()),
    "affine": lambda: uc.ParametricPolicy(uc.Affine(), uc.Hybrid()),
    "cubic": lambda: uc.ParametricPolicy(uc.Polynomial(3), uc.Hybrid()),
    "kmeans": uc.ParametricPolicy,
    "local": lambda: uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid()),
}


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.parametrize("weighted", [False, True])
def test_a_policy_learns_and_predicts_as_from_numpy(to, kind, weighted):
    data = samples.draw()
    weights = np.arange(len(data.states)) % 3.0 if weighted else None
    expected = POLICIES[kind]().fit(data.states, data.actions, sample_weight=weights, groups=data.groups)
    moved_weights = None if weights is None else to(weights)
    found = POLICIES[kind]().fit(to(data.states), to(data.actions), sample_weight=moved_weights, groups=data.groups)
    assert_same(found.solution_.weights, expected.solution_.weights, 1e-8, foreign=False)
    assert_same(found.predict(to(data.states)), expected.predict(data.states), 1e-8)
    assert_same(found.predict(data.states), expected.predict(data.states), 1e-8, foreign=False)
    assert_same(found(to(data.states)), expected(data.states), 1e-8)
    assert_allclose(found.score(to(data.states), to(data.actions)), expected.score(data.states, data.actions))
    assert_allclose(found.step(data.states[0]), expected.step(data.states[0]), atol=1e-9)


def test_batches_of_different_libraries_add(torch):
    data = samples.draw()
    half = len(data.states) // 2
    expected = POLICIES["grid"]().partial_fit(data.states[:half], data.actions[:half])
    expected.partial_fit(data.states[half:], data.actions[half:])
    found = POLICIES["grid"]().partial_fit(data.states[:half], data.actions[:half])
    found.partial_fit(torch.asarray(data.states[half:]), data.actions[half:])  # the actions go to the states
    assert_same(found.solution_.weights, expected.solution_.weights, 1e-9, foreign=False)
    found.partial_fit(data.states[half:], torch.asarray(data.actions[half:]))
    assert found.moments_.weight == [len(data.states) + half]


def test_one_column_of_actions(to):
    data = samples.draw()
    policy = POLICIES["grid"]().fit(to(data.states), to(data.actions[:, 0]))
    assert policy.predict(to(data.states)).shape == (len(data.states),)
    assert policy(to(data.states)).shape == (len(data.states), 1)


def test_the_dtype_of_a_tensor_does_not_matter(torch):
    data = samples.draw()
    half = [torch.asarray(part, dtype=torch.float32) for part in (data.states, data.actions)]
    found = POLICIES["grid"]().fit(*half)
    expected = POLICIES["grid"]().fit(*(part.double() for part in half))
    assert_array_equal(found.solution_.weights, expected.solution_.weights)
    assert found.predict(half[0]).dtype == torch.float64


def test_bad_tensors_are_refused_in_our_words(to, torch):
    data = samples.draw()
    policy = POLICIES["grid"]()
    spoilt = data.states.copy()
    spoilt[4, 1] = np.nan
    with pytest.raises(InvalidDataError, match="states: found nan at row 4, column 1"):
        policy.fit(to(spoilt), to(data.actions))
    with pytest.raises(InvalidDataError, match="states: got an array of shape"):
        policy.fit(to(data.states[0]), to(data.actions))
    with pytest.raises(InvalidDataError, match="expected one action for each state"):
        policy.fit(to(data.states), to(data.actions[:5]))
    policy.fit(to(data.states), to(data.actions))
    with pytest.raises(InvalidDataError, match="expecting 2 features"):
        policy.predict(to(data.states[:, :1]))
    with pytest.raises(InvalidDataError, match="expected real numbers"):
        as_matrix(torch.zeros((2, 2), dtype=torch.complex128), "states")


def test_without_the_extra_an_error_names_it(torch, monkeypatch):
    monkeypatch.setitem(sys.modules, "array_api_compat", None)
    with pytest.raises(MissingExtraError, match=r"unconstrain\[arrays\]"):
        POLICIES["grid"]().fit(torch.zeros((3, 2)), torch.zeros((3, 2)))


def test_numpy_pays_nothing(torch):
    table = np.ones((2, 2))
    assert namespace(table) is np
    assert namespace([[1.0]]) is np
    assert beside(table, table) is table
    assert on_host(table) is table
    assert_array_equal(beside(table, torch.ones(1)), torch.ones((2, 2)))

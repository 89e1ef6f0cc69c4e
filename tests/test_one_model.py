"""One model for all states, around which fields measure support, says the same in C, JavaScript, ONNX and Python."""

import ctypes
import re
import subprocess
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from test_deployment import STRICT, session
from test_javascript import told
from unconstrain.deployment.description import digest
from unconstrain.models import Everywhere, choose_variance, cover

SPACES = {"angle": uc.spaces.Circle() * uc.spaces.Euclidean(1), "orientation": uc.spaces.Sphere()}
FEATURES = {"affine": uc.Affine(), "cubic": uc.Polynomial(3)}
UNITS = {"units": np.array([1000.0, 1.0])}


def drawn(of, width=1.0, count=300, seed=0):
    """States, far from zero where they are straight; of angles, of several turns."""
    rng = np.random.default_rng(seed)
    if of == "orientation":
        turns = rng.normal([2.0, 0.0, 0.0, 0.0], 0.5 * width, (count, 4))
        return turns / np.linalg.norm(turns, axis=1, keepdims=True)
    return np.array([0.5, 2.0]) + width * rng.uniform([-1, -1], [3, 1], (count, 2))


def wanted(of, states):
    if of == "orientation":
        return np.column_stack([states[:, 0] * states[:, 1], states[:, 2], states[:, 3] ** 2])
    x, y = np.sin(states[:, 0]), states[:, 1] - 2.0
    return np.column_stack([x - 2.0 * y + x * y**2, -x - y**3])


@contextmanager
def of_one_model(features):
    """Within it, locally linear policies take one model of these features."""

    def places(_, look):
        fields = cover(look.states, choose_variance(look.states))
        return {"": uc.Model(features.place(look.states), Everywhere(fields), look.embedding)}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uc.LocallyLinearPolicy, "places", places)
        yield


@cache
def made(kind, of):
    states, unit = drawn(of), UNITS.get(of, 1.0)
    with of_one_model(FEATURES[kind]):
        policy = uc.LocallyLinearPolicy(learner="direct", space=SPACES.get(of), scale=UNITS.get(of))
        return policy.fit(states * unit, wanted(of, states) * unit)


@pytest.fixture(params=FEATURES)
def kind(request):
    return request.param


@pytest.fixture(params=["flat", "units", "angle", "orientation"])
def of(request):
    return request.param


@pytest.fixture
def policy(kind, of):
    return made(kind, of)


@pytest.fixture
def near(of):
    return drawn(of, count=40, seed=1) * UNITS.get(of, 1.0)


@pytest.fixture
def far(of):
    return drawn(of, 30.0, count=40, seed=2) * UNITS.get(of, 1.0)


def assert_same(found, expected, rtol=1e-12):
    assert np.abs(np.asarray(found) - expected).max() <= rtol * np.abs(expected).max()


def test_it_is_one_map_and_as_many_kernels_as_fields(policy, near, far):
    form, coordinates = policy.closed_form(), policy.closed_form().embedding
    own = policy.scale_.states if policy.scale_ else 1.0
    assert form.sizes[2] == 1 < len(form.exponents) == len(policy.fields_.centres)
    assert form.blending is None
    assert_allclose(form.exponents[:, :-1] / form.precisions + form.origin, policy.fields_.centres * own, rtol=1e-9)
    assert (np.abs(policy.fields_.centres * own - form.origin) < form.reach).all()
    for at in (near, far):
        z = coordinates(at) - form.origin
        logs = (z @ form.exponents[:, :-1].T + form.exponents[:, -1]).max(axis=1) - 0.5 * z**2 @ form.precisions
        assert_allclose(np.exp(np.minimum(logs, 0.0)), policy.support(at), atol=1e-9)
    assert np.median(policy.support(near)) > 0.5


def test_a_step_is_a_prediction(policy, near, far):
    for at in (near, far):
        assert_same([policy.step(state) for state in at], policy(at))


@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
def test_c_says_the_same_and_tests_itself(policy, near, far, single, tmp_path):
    policy.export_c(tmp_path / "one.c", single=single)
    real = ctypes.c_float if single else ctypes.c_double
    for compiler in ("g++ -x c++ -std=c++11", "gcc -std=c99 -Wmissing-prototypes"):
        command = f"{compiler} {STRICT} -DONE_SELF_TEST -shared -fPIC one.c -lm -o one.so"
        subprocess.run(command.split(), cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "one.so"))
    assert library.main() == 0
    library.one_support.restype = real
    n, d = policy.n_features_in_, policy.n_outputs_
    limits = np.array(((real * 2) * n).in_dll(library, "one_limits"))
    assert ((limits[:, 0] <= near) & (near <= limits[:, 1])).all()
    sizes = np.linalg.norm(policy(near), axis=1)
    assert np.median(sizes) <= real.in_dll(library, "one_speed_limit").value <= 3 * sizes.max()
    for at in (near.astype(np.float32), far.astype(np.float32)):
        action, found, supported = (real * d)(), [], []
        for state in at.tolist():
            library.one_step((real * n)(*state), action)
            found.append(list(action))
            supported.append(library.one_support((real * n)(*state)))
        assert_same(found, policy(at), 1e-5 if single else 1e-12)
        assert_allclose(supported, policy.support(at), atol=2e-6 if single else 1e-9)


@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
def test_the_graph_says_the_same(policy, near, far, single, tmp_path):
    policy.export_onnx(tmp_path / "one.onnx", single=single)
    graph = session(tmp_path / "one.onnx")
    for at in (near, far):
        given = at.astype(np.float32 if single else np.float64)
        [found] = graph.run(["actions"], {"states": given})
        assert_same(found, policy(given), 1e-5 if single else 1e-12)


def test_javascript_says_the_same(policy, near, far, browser, tmp_path):
    for at in (near, far):
        found = told(browser, tmp_path, policy, at)
        assert_same(found["actions"], policy(at))
        assert_allclose(found["support"], policy.support(at), atol=1e-9)


def test_a_stored_one_is_the_same(policy, near, tmp_path):
    uc.save(policy, tmp_path / "one.npz")
    again = uc.load(tmp_path / "one.npz")
    assert_array_equal(again(near), policy(near))
    assert_array_equal(again.support(near), policy.support(near))
    assert digest(again.closed_form()) == digest(policy.closed_form())


def test_its_digest_knows_its_support(policy):
    form = policy.closed_form()
    assert digest(form) != digest(replace(form, exponents=form.exponents * (1 + 1e-15)))
    assert digest(form) != digest(replace(form, exponents=None, precisions=None))


@pytest.mark.parametrize("n", [2, 7])
def test_an_affine_one_is_as_small_in_c_as_a_parametric_one_and_its_support(n, tmp_path):
    states = np.random.default_rng(0).uniform(-1, 1, (300, n))
    sources = {}
    for policy in (uc.LocallyLinearPolicy(np.inf, learner="direct"), uc.ParametricPolicy(uc.Affine(), "direct")):
        policy.fit(states, states @ np.eye(n)[::-1] - states).export_c(tmp_path / "one.c")
        sources[type(policy)] = (tmp_path / "one.c").read_text()
    one, parametric = sources.values()
    supported = re.search(r"\nenum { ONE_KERNELS.*?return largest;\n}\n", one, re.DOTALL)[0]
    measured = re.search(r"\n/\* What one over the squared width.*?\n}\n", one, re.DOTALL)[0]
    assert len(one) <= len(parametric) + len(supported) + len(measured)


def test_features_with_kernels_of_their_own_measure_support_by_these():
    features, weights = uc.NormalisedRBF.grid(-1, 1, 3), np.ones((1, 2, 9))
    model = uc.Model(features, Everywhere(uc.ReceptiveFields([[0.0, 0.0]], 9.0)))
    assert_array_equal(model.formula(weights).exponents, features.closed_form(weights[0]).exponents)
    assert_array_equal(model.support(features.centres + 0.1), features.support(features.centres + 0.1))

"""What leaves the estimator says the same as the estimator: steps, C, ONNX."""

import copy
import ctypes
import pickle
import re
import shutil
import subprocess
import sys
import threading
from dataclasses import replace

import numpy as np
import onnxruntime
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.decomposition import PCA
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, MinMaxScaler, PolynomialFeatures, StandardScaler

import naive
import unconstrain as uc
from conftest import POLICIES
from samples import draw
from unconstrain.base.errors import InvalidDataError, MissingExtraError, SettingError
from unconstrain.deployment.c99 import c_source, export_c
from unconstrain.deployment.description import Description, digest
from unconstrain.deployment.stepping import stepper
from unconstrain.models import Everywhere

DATA = draw(noise=0.02)
FAR = [1.0, 3.0, 30.0, 1e3, 1e8]
"""Half-widths of the boxes that states are drawn from; the data is in the first."""


def circular(states):
    """Features that are Python code and nothing else."""
    return np.column_stack([np.sin(states[:, 0]), np.cos(states[:, 0]), states[:, 1]])


@pytest.fixture(scope="module", params=POLICIES, ids=POLICIES)
def policy(request):
    """Each kind of policy, fitted."""
    return POLICIES[request.param](uc.Hybrid()).fit(DATA.states, DATA.actions)


@pytest.fixture(scope="module")
def arm():
    """A locally linear policy of seven joints."""
    data = draw(samples=400, policy=lambda x: np.sin(x @ np.eye(7)[::-1]) + 0.1 * x, dimensions=7)
    centres = np.random.default_rng(1).uniform(-1, 1, (50, 7))
    return uc.LocallyLinearPolicy(2.0, centres=centres, learner=uc.Direct()).fit(data.states, data.actions)


def states(dimensions, width, count=40, seed=3):
    return np.random.default_rng(seed).uniform(-width, width, (count, dimensions))


def assert_same(found, policy, at, width):
    """Equal to rounding, which the exponents have in proportion to the distance."""
    expected = policy(at)
    assert np.isfinite(expected).all()
    assert_allclose(found, expected, rtol=0, atol=1e-11 * width * (1 + np.abs(expected).max()))


# Steps


@pytest.mark.parametrize("width", FAR)
def test_a_step_is_a_prediction(policy, arm, width):
    for one in (policy, arm):
        at = states(one.n_features_in_, width)
        assert_same(np.stack([one.step(x) for x in at]), one, at, width)


def test_a_step_is_the_formula_of_the_paper(arm):
    matrices = np.concatenate([arm.solution_.weights[..., :-1], arm.solution_.weights[..., -1:]], axis=2)
    shift = np.tile(np.eye(8), (50, 1, 1))
    shift[:, :7, 7] = arm.features_(arm.fields_.centres)[:, :7]  # from one origin to each centre
    at = states(7, 1.0, count=5)
    expected = naive.locally_linear(at, arm.fields_.centres, 2.0, matrices @ shift)
    assert_allclose([arm.step(x) for x in at], expected, atol=1e-10)


@given(
    seed=st.integers(0, 1000),
    degree=st.integers(1, 5),
    n=st.integers(1, 4),
    width=st.sampled_from(FAR),
    unit=st.sampled_from([1e-8, 1.0, 1e8]),
)
def test_a_step_of_a_polynomial_is_the_sum_of_its_monomials(seed, degree, n, width, unit):
    rng = np.random.default_rng(seed)
    placed = uc.Polynomial(degree).place(unit * rng.uniform(-1, 2, (20, n)))
    monomials = PolynomialFeatures(degree).fit(np.zeros((1, n)))
    order = sorted(range(monomials.n_output_features_), key=lambda term: tuple(-monomials.powers_[term]))
    weights, at = rng.standard_normal((3, len(order))), unit * rng.uniform(-width, width, (5, n))
    step = stepper(uc.Model(placed, Everywhere()), weights[None], n)
    terms = monomials.transform((at - placed.centre) / placed.scale)[:, order]
    error = np.abs([step(x, None) for x in at] - terms @ weights.T)
    assert (error <= 1e-14 * (np.abs(terms) @ np.abs(weights.T))).all()


def test_a_step_takes_lists_and_other_kinds_of_numbers(policy):
    expected = policy.predict([[0.25, -0.5]])[0]
    for x in ([0.25, -0.5], (0.25, -0.5), np.array([0.25, -0.5], np.float32), np.array([0.25, 9, -0.5])[::2]):
        assert_allclose(policy.step(x), expected, atol=1e-12)


@pytest.mark.parametrize("x", [0.5, [0.5], [[0.1, 0.2]], [[0.1], [0.2]], [0.1, 0.2, 0.3], "ab", None, ["a", "b"]])
def test_a_state_of_another_shape_is_refused(policy, x):
    with pytest.raises(InvalidDataError, match=r"step: got a state of shape .*, expected 2 numbers\."):
        policy.step(x)


def test_nan_gives_nan(policy):
    assert np.isnan(policy.step([np.nan, 0.0])).all()
    assert np.isfinite(policy.step([0.0, 0.0])).all()


def test_steps_do_not_share_their_results(policy):
    first = policy.step([0.1, 0.2])
    kept = first.copy()
    policy.step([-0.5, 0.9])
    assert_array_equal(first, kept)


def test_a_step_writes_where_it_is_told(policy):
    out = np.full(2, np.nan)
    assert policy.step([0.1, 0.2], out=out) is out
    assert_array_equal(out, policy.step([0.1, 0.2]))


def test_a_step_notices_that_more_was_learnt(policy):
    learner = copy.deepcopy(policy)
    x = np.array([0.3, 0.4])
    learner.step(x)
    learner.partial_fit(DATA.states[:20] + 0.05, -3.0 * DATA.actions[:20])
    assert_allclose(learner.step(x), learner.predict(x[None])[0], atol=1e-11)
    assert np.abs(learner.step(x) - policy.step(x)).max() > 1e-3
    learner.fit(DATA.states, 2.0 * DATA.actions)
    assert_allclose(learner.step(x), 2.0 * policy.step(x), rtol=1e-6)


def test_another_learner_steps_by_its_own_solution(policy):
    policy.step([0.3, 0.4])
    other = policy.with_learner(uc.Inconsistency())
    assert_allclose(other.step([0.3, 0.4]), other.predict([[0.3, 0.4]])[0], atol=1e-11)


def test_before_a_fit_there_is_no_step():
    with pytest.raises(NotFittedError):
        uc.LocallyLinearPolicy().step([0.0, 0.0])


def test_a_policy_of_one_number_steps_to_a_vector_of_one():
    flat = uc.ParametricPolicy(uc.Affine()).fit(DATA.states, DATA.actions[:, 0])
    assert flat.step([0.1, 0.2]).shape == (1,)
    assert_allclose(flat.step([0.1, 0.2]), flat.predict([[0.1, 0.2]]), atol=1e-12)


def test_features_of_your_own_step_too():
    own = uc.ParametricPolicy(circular, uc.Direct()).fit(DATA.states, DATA.actions)
    assert_allclose(own.step([0.1, 0.2]), own.predict([[0.1, 0.2]])[0], atol=1e-12)
    with pytest.raises(InvalidDataError, match="expected 2 numbers"):
        own.step([0.1])


def test_threads_do_not_disturb_each_other(arm):
    at = states(7, 1.0, count=300)
    expected = np.stack([arm.step(x) for x in at])
    found = [np.empty_like(expected) for _ in range(4)]

    def follow(into):
        for _ in range(5):
            for row, x in zip(into, at, strict=True):
                arm.step(x, out=row)

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=follow, args=(into,)) for into in found]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(before)
    for into in found:
        assert_array_equal(into, expected)


def test_a_policy_that_has_stepped_is_pickled_copied_and_saved(policy, tmp_path):
    policy.step([0.1, 0.2])
    uc.save(policy, tmp_path / "policy.npz")
    copies = pickle.loads(pickle.dumps(policy)), copy.deepcopy(policy)
    assert not any("_prepared" in vars(other) for other in copies)
    for other in (*copies, uc.load(tmp_path / "policy.npz")):
        assert_array_equal(other.step([0.1, 0.2]), policy.step([0.1, 0.2]))


# C


def compiled(policy, folder, name="policy", flags=()):
    """The exported policy as a function, compiled without a warning."""
    folder.mkdir(exist_ok=True)
    policy.export_c(folder / "policy.c", name)
    strict = ["gcc", "-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", *flags]
    subprocess.run([*strict, "-shared", "-fPIC", "policy.c", "-lm", "-o", "policy.so"], cwd=folder, check=True)
    test = [*strict, f"-D{name.upper()}_SELF_TEST", "policy.c", "-lm", "-o", "self_test"]
    subprocess.run(test, cwd=folder, check=True)
    step = getattr(ctypes.CDLL(str(folder / "policy.so")), f"{name}_step")
    step.restype = None
    vector = np.ctypeslib.ndpointer(np.float64, 1, flags="C")
    step.argtypes = [vector, vector]

    def call(x):
        action = np.full(policy.n_outputs_, np.nan)
        step(np.ascontiguousarray(x, np.float64), action)
        return action

    return call


def test_the_c_file_says_what_the_policy_says_inside_and_far_outside_and_tests_itself(policy, tmp_path):
    step = compiled(policy, tmp_path)
    done = subprocess.run([tmp_path / "self_test"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("largest error ")
    for width in FAR:
        at = states(2, width)
        assert_same(np.stack([step(x) for x in at]), policy, at, width)
    assert np.isnan(step([np.nan, 0.0])).all()


def test_the_c_file_of_an_arm(arm, tmp_path):
    step = compiled(arm, tmp_path, "left_arm", flags=["-Wconversion", "-Wmissing-prototypes", "-Wshadow"])
    for width in FAR:
        at = states(7, width)
        assert_same(np.stack([step(x) for x in at]), arm, at, width)


def test_the_c_file_and_the_graph_of_a_polynomial_of_many_states(tmp_path):
    data = draw(samples=400, policy=lambda x: np.sin(x @ np.eye(7)[::-1]) + 0.1 * x, dimensions=7)
    there = np.column_stack([data.states[:, :6], np.full(400, 0.1)])
    bent = uc.ParametricPolicy(uc.Polynomial(3), uc.Direct()).fit(there, data.actions)
    step = compiled(bent, tmp_path, "bent", flags=["-Wconversion", "-Wmissing-prototypes", "-Wshadow"])
    bent.export_onnx(tmp_path / "bent.onnx")
    graph = session(tmp_path / "bent.onnx")
    for width in FAR:
        at = states(7, width)
        allowed = 1e-14 * (np.abs(bent.features_(at)) @ np.abs(bent.solution_.weights[0].T))
        [drawn] = graph.run(["actions"], {"states": at})
        for found in (np.stack([step(x) for x in at]), np.stack([bent.step(x) for x in at]), drawn):
            assert (np.abs(found - bent.predict(at)) <= allowed).all()


def test_the_self_test_of_a_polynomial_finds_a_wrong_digit_in_its_lowest_terms_too(tmp_path):
    policy = POLICIES["cubic"](uc.Direct()).fit(DATA.states, DATA.actions)
    form = policy.closed_form()
    wrong = form.maps.copy()
    wrong[0, 0, (form.monomials == 2).sum(axis=1) == 2] *= 1 + 1e-6  # the linear ones
    export_c(replace(form, maps=wrong), policy, tmp_path / "wrong.c", "wrong", Description.of(form))
    subprocess.run(["gcc", "-std=c99", "-DWRONG_SELF_TEST", "wrong.c", "-lm", "-o", "test"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "test"], check=False, capture_output=True).returncode == 1


def test_the_self_test_of_a_c_file_finds_a_wrong_digit(arm, tmp_path):
    form = arm.closed_form()

    def wrong(at):
        actions = arm(at)
        actions[2, 3] += 1e-6
        return actions

    (tmp_path / "wrong.c").write_text(c_source(form, "wrong", wrong, Description.of(form)).source)
    subprocess.run(["gcc", "-std=c99", "-DWRONG_SELF_TEST", "wrong.c", "-lm", "-o", "test"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "test"], check=False, capture_output=True).returncode == 1


def test_constants_in_c_lose_no_digit(policy, tmp_path):
    policy.export_c(tmp_path / "policy.c")
    cells = re.findall(r"[-+.e0-9]+", (tmp_path / "policy.c").read_text(encoding="ascii"))
    written = {float(cell) for cell in cells if re.fullmatch(r"-?\d+\.?\d*(e[-+]\d+)?", cell)}
    form = policy.closed_form()
    for values in (form.origin, form.maps, *([] if form.exponents is None else [form.exponents])):
        assert set(np.ravel(values)) <= written


STRICT = "-O2 -Wall -Wextra -Wconversion -Wshadow -pedantic -Werror"


@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
@pytest.mark.parametrize("kind", ["affine", "cubic", "kmeans", "local", "arm"])
def test_support_limits_and_steps_of_c_and_of_cpp_are_those_of_the_policy(kind, single, arm, tmp_path):
    one = arm if kind == "arm" else POLICIES[kind](uc.Hybrid()).fit(DATA.states, DATA.actions)
    one.export_c(tmp_path / "its-own.c", single=single)
    for compiler in ("gcc -std=c99 -Wmissing-prototypes", "g++ -x c++ -std=c++11"):
        command = f"{compiler} {STRICT} -shared -fPIC its-own.c -lm -o its.so"
        subprocess.run(command.split(), cwd=tmp_path, check=True)
    library, real = ctypes.CDLL(str(tmp_path / "its.so")), ctypes.c_float if single else ctypes.c_double
    step, support = library.its_own_step, library.its_own_support
    support.restype = real
    n, d = one.n_features_in_, one.n_outputs_
    limits = np.array(((real * 2) * n).in_dll(library, "its_own_limits"))
    near, far = states(7, 1.0) if kind == "arm" else DATA.states, states(n, 1e3)
    assert ((limits[:, 0] <= near) & (near <= limits[:, 1])).all()
    most = real.in_dll(library, "its_own_speed_limit").value
    sizes = np.linalg.norm(one(near), axis=1)
    assert np.median(sizes) <= most <= 3 * sizes.max()
    for at in (near.astype(np.float32), far.astype(np.float32)):
        action = np.zeros((len(at), d), np.float32 if single else np.float64)
        for row, x in zip(action, at, strict=True):
            step((real * n)(*map(float, x)), row.ctypes.data_as(ctypes.POINTER(real)))
        found = [support((real * n)(*map(float, x))) for x in at]
        expected = one(at)
        assert np.abs(action - expected).max() <= (1e-5 if single else 1e-12) * np.abs(expected).max()
        if getattr(one.training_.model.fields, "support", None) or hasattr(one.features_, "support"):
            assert_allclose(found, one.support(at), atol=1e-6 if single else 1e-14)
        else:
            assert_array_equal(found, ((limits[:, 0] <= at) & (at <= limits[:, 1])).all(axis=1))


@pytest.mark.parametrize("kind", ["affine", "cubic", "kmeans", "local"])
@pytest.mark.parametrize("scale", [None, (0.5, 1.0)])
def test_the_speed_limit_cuts_no_demonstrated_motion_and_no_single_glitch_lifts_it(kind, scale, tmp_path):
    at, turn = np.random.default_rng(0).uniform(-1, 1, (400, 2)) ** 3, np.array([[-1.0, -2.0], [2.0, -1.0]])
    actions = 100.0 * at @ turn  # most of it is slow and in the middle
    glitch = actions * np.where(np.arange(400) == 7, 30.0, 1.0)[:, None]
    for moves in (actions, glitch):
        policy = POLICIES[kind](uc.Direct()).set_params(scale=scale).fit(at, moves)
        policy.export_c(tmp_path / "it.c")
        found = float(re.search(r"it_speed_limit = (\S+);", (tmp_path / "it.c").read_text())[1])
        most = np.linalg.norm(actions, axis=1).max()
        assert most <= found <= 6.0 * most


def test_the_header_says_what_the_numbers_are(policy, tmp_path):
    notes = {
        "recipe": {"states": ["x", "y"], "actions": None},
        "units": {"x": "mm"},
        "sources": "wipes/*.csv */ of ü",
        "nothing": None,
    }
    policy.export_c(tmp_path / "wipe.c", notes=notes)
    header = (tmp_path / "wipe.h").read_text()
    assert (tmp_path / "wipe.c").read_text().startswith(header)
    comment = header.split("*/")[0]
    form = policy.closed_form()
    for said in (
        "states: x (mm), y",
        "actions: vx, vy",
        "learnt by: Hybrid",
        f"subtracted inside: {form.origin[0]:.6g}, ",
        "sources: wipes/ *.csv * / of ü",
        f"sha256: {digest(form)}",
    ):
        assert said in comment
    assert "nothing" not in comment
    assert digest(form) != digest(replace(form, maps=form.maps * (1 + 1e-15)))
    subprocess.run(f"gcc -std=c99 {STRICT} -c wipe.c".split(), cwd=tmp_path, check=True)


@pytest.mark.parametrize(
    ("file", "name"),
    [("wipe", "wipe"), ("my-wipe 2", "my_wipe_2"), ("2nd", "policy_2nd"), ("ä", "policy"), ("__x", "x")],
)
def test_names_in_c_are_like_that_of_the_file(arm, tmp_path, file, name):
    arm.export_c(tmp_path / f"{file}.c")
    assert f"void {name}_step(" in (tmp_path / f"{file}.h").read_text()


def test_two_policies_are_linked_into_one_program_by_their_headers(arm, tmp_path):
    policy = POLICIES["grid"](uc.Hybrid()).fit(DATA.states, DATA.actions)
    policy.export_c(tmp_path / "wipe.c")
    arm.export_c(tmp_path / "polish.c", single=True)
    (tmp_path / "main.c").write_text(
        '#include "wipe.h"\n#include "polish.h"\n'
        "int main(void)\n{\n    double state[WIPE_STATES] = {0}, action[WIPE_ACTIONS];\n"
        "    float joints[POLISH_STATES] = {0}, turns[POLISH_ACTIONS];\n\n"
        "    wipe_step(state, action);\n    polish_step(joints, turns);\n"
        "    return polish_support(joints) <= 1 && wipe_support(state) <= 1 && polish_limits[0][0] < 0 ? 0 : 1;\n}\n"
    )
    for compiler in ("gcc -std=c99", "g++ -x c++ -std=c++11"):
        command = f"{compiler} {STRICT} main.c wipe.c polish.c -lm -o main"
        subprocess.run(command.split(), cwd=tmp_path, check=True)
        subprocess.run([tmp_path / "main"], check=True)


def test_a_header_is_no_place_for_the_source(arm, tmp_path):
    with pytest.raises(SettingError, match=r"such as wipe\.c"):
        arm.export_c(tmp_path / "wipe.h")
    assert not list(tmp_path.iterdir())


def test_what_is_too_large_for_a_float_is_said(tmp_path):
    fast = uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit(1e-12 * DATA.states, 1e28 * DATA.actions)
    with pytest.raises(SettingError, match="is too large for it"):
        fast.export_c(tmp_path / "fast.c", single=True)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["", "2nd", "my-policy", "a b", "ä"])
def test_a_name_that_c_does_not_know_is_refused(arm, tmp_path, name):
    with pytest.raises(SettingError, match="expected a name in C"):
        arm.export_c(tmp_path / "policy.c", name)
    assert not list(tmp_path.iterdir())


# ONNX


def session(path):
    return onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])


def test_the_onnx_graph_says_what_the_policy_says_inside_and_far_outside(policy, arm, tmp_path):
    for one in (policy, arm):
        one.export_onnx(tmp_path / "policy.onnx")
        graph = session(tmp_path / "policy.onnx")
        for width in FAR:
            at = states(one.n_features_in_, width)
            [found] = graph.run(["actions"], {"states": at})
            assert found.dtype == np.float64
            assert_same(found, one, at, width)
            [alone] = graph.run(["actions"], {"states": at[:1]})
            assert_same(alone, one, at[:1], width)


def test_a_graph_in_single_precision_takes_and_gives_it(policy, arm, tmp_path):
    for one in (policy, arm):
        one.export_onnx(tmp_path / "policy.onnx", single=True)
        graph = session(tmp_path / "policy.onnx")
        for width in FAR[:4]:
            at = states(one.n_features_in_, width).astype(np.float32)
            [found] = graph.run(["actions"], {"states": at})
            expected = one(at)
            assert found.dtype == np.float32
            assert np.abs(found - expected).max() <= 1e-5 * np.abs(expected).max()


def test_a_graph_says_what_the_numbers_are(arm, tmp_path):
    arm.export_onnx(tmp_path / "arm.onnx", notes={"recipe": {"states": [f"q{i}" for i in range(7)]}})
    said = session(tmp_path / "arm.onnx").get_modelmeta().custom_metadata_map
    assert said["states"] == "q0, q1, q2, q3, q4, q5, q6"
    assert said["sha256"] == digest(arm.closed_form())


def test_without_onnx_the_error_names_the_extra(policy, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'unconstrain\[onnx\]'"):
        policy.export_onnx(tmp_path / "policy.onnx")
    assert not list(tmp_path.iterdir())


# What can be exported


@pytest.mark.parametrize("export", ["export_c", "export_onnx"])
def test_features_that_are_code_are_refused_with_what_can_be_exported(tmp_path, export):
    own = uc.ParametricPolicy(circular, uc.Direct()).fit(DATA.states, DATA.actions)
    with pytest.raises(SettingError) as caught:
        getattr(own, export)(tmp_path / "file")
    assert "cannot export a policy on the features circular: they are Python code" in str(caught.value)
    assert "Affine, Polynomial, NormalisedRBF or KMeansRBF" in str(caught.value)


class Reversed:
    """Features of one's own that say their formula: the state from back to front, and one."""

    def __call__(self, states):
        return np.column_stack([states[:, ::-1], np.ones(len(states))])

    def closed_form(self, weights):
        n = weights.shape[1] - 1
        maps = np.column_stack([weights[:, :n][:, ::-1], weights[:, n]])
        return uc.ClosedForm(np.zeros(n), maps[None], None, np.ones(n))


def test_features_of_your_own_that_say_their_formula_can_be_exported(tmp_path):
    own = uc.ParametricPolicy(Reversed(), uc.Direct()).fit(DATA.states, DATA.actions)
    own.export_c(tmp_path / "policy.c")
    at = states(2, 5.0)
    assert_same(np.stack([own.step(x) for x in at]), own, at, 5.0)


def test_before_a_fit_there_is_nothing_to_export(tmp_path):
    with pytest.raises(NotFittedError):
        uc.LocallyLinearPolicy().export_c(tmp_path / "policy.c")


@given(
    unit=st.sampled_from([1e-8, 1e-3, 1.0, 1e8]),
    offset=st.sampled_from([0.0, 1.0, -50.0]),
    scale=st.sampled_from([1e-8, 1.0, 1e8]),
)
def test_units_and_offsets_do_not_matter_to_a_step(unit, offset, scale):
    at = unit * (DATA.states + offset)
    for make in POLICIES.values():
        one = make(uc.Direct())
        if "variance" in one.get_params():
            one.set_params(variance=0.5 * unit**2)
        if isinstance(one.get_params().get("features"), uc.NormalisedRBF):
            continue  # its centres are given in units
        one.fit(at, scale * DATA.actions)
        found = np.stack([one.step(x) for x in at[:5]])
        assert_allclose(found, one(at[:5]), rtol=0, atol=1e-9 * scale)


def test_several_policies_go_into_one_program(arm, policy, tmp_path):
    arm.export_c(tmp_path / "wipe.c", "wipe")
    policy.export_c(tmp_path / "polish.c", "polish")
    both = tmp_path / "both.c"
    both.write_text('#include "wipe.c"\n#include "polish.c"\n')
    strict = "gcc -std=c99 -Wall -Wextra -pedantic -Werror -c both.c"
    subprocess.run(strict.split(), cwd=tmp_path, check=True)


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs the C++ compiler g++")
def test_a_policy_compiled_as_cpp_is_called_from_c(policy, tmp_path):
    policy.export_c(tmp_path / "wipe.cpp", "wipe")
    (tmp_path / "main.c").write_text(
        "void wipe_step(const double state[2], double action[2]);\n"
        "int main(void) { double both[2] = {0.0, 0.0}; wipe_step(both, both); return 0; }\n"
    )
    for command in ("g++ -std=c++17 -c wipe.cpp", "gcc -std=c99 -c main.c", "g++ main.o wipe.o -lm -o main"):
        subprocess.run(command.split(), cwd=tmp_path, check=True)


# Pipelines


@pytest.mark.parametrize("kind", POLICIES)
@pytest.mark.parametrize("scaler", [(StandardScaler(),), (MinMaxScaler((-1, 1)), FunctionTransformer(np.negative))])
def test_a_scaler_and_a_policy_are_exported_as_one(kind, scaler, tmp_path):
    at = DATA.states * [1000.0, 1.0] + [50.0, -2.0]
    policy = POLICIES[kind](uc.Direct())
    pipeline = make_pipeline(*scaler, policy).fit(at, DATA.actions)
    one, form = pipeline[-1], pipeline[-1].closed_form(pipeline[:-1])
    one.export_c(tmp_path / "whole.c", scaler=pipeline[:-1])
    command = f"gcc -std=c99 {STRICT} -DWHOLE_SELF_TEST whole.c -lm -o test"
    subprocess.run(command.split(), cwd=tmp_path, check=True)
    subprocess.run([tmp_path / "test"], check=True)
    one.export_onnx(tmp_path / "whole.onnx", scaler=pipeline[:-1])
    [found] = session(tmp_path / "whole.onnx").run(["actions"], {"states": at})
    expected = pipeline.predict(at)
    assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert (form.reach > 0).all()


@pytest.mark.parametrize("scaler", [PCA(), PolynomialFeatures(2), FunctionTransformer(np.tanh)])
def test_what_does_more_than_to_shift_and_scale_is_refused(scaler):
    pipeline = make_pipeline(scaler, uc.ParametricPolicy(uc.Affine(), uc.Direct())).fit(DATA.states, DATA.actions)
    if pipeline[-1].n_features_in_ != 2:
        pipeline[-1].fit(DATA.states, DATA.actions)
    with pytest.raises(SettingError, match="does more than to shift and scale each of 2 states"):
        pipeline[-1].closed_form(pipeline[0])

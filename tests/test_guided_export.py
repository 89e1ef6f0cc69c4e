"""A policy that arrives says the same in C, C++, ONNX and JavaScript, free and under constraints."""

import ctypes
import re
import subprocess
from contextlib import nullcontext
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import unconstrain as uc
from test_cli import run
from test_deployment import STRICT, session
from test_javascript import in_page
from test_one_model import FEATURES, of_one_model
from unconstrain.base.errors import SettingError
from unconstrain.deployment.description import digest
from unconstrain.motion.orbit import Orbit

RNG = np.random.default_rng(0)
BY = np.array([0.2, -0.1, 0.3])


def spiral(states):
    return np.column_stack([-states[:, 0] - 2 * states[:, 1], 2 * states[:, 0] - states[:, 1], -0.5 * states[:, 2]])


def cycle(states):
    inward = 2.0 * (1.0 - np.hypot(*states[:, :2].T) / 0.5)[:, None]
    return inward * states * [1, 1, 0] + 2.0 * states[:, [1, 0, 2]] * [-1, 1, -0.5]


ROUND = uc.rollout(cycle, [[0.5, 0.0, 0.0], [0.0, 0.45, 0.02], [0.0, -0.55, 0.0]], 120, 0.05, method="rk4")
DOWN = uc.rollout(spiral, RNG.uniform(-0.6, 0.6, (6, 3)), 120, 0.05)
STATES = np.concatenate([BY + width * RNG.uniform(-1, 1, (30, 3)) for width in (0.01, 0.5, 30.0)])
STATES = STATES.astype(np.float32).astype(np.float64)
NORMALS = RNG.standard_normal((90, 3))
PROJECTIONS = uc.null_space_projection(NORMALS[:, None])


@cache
def learnt(kind):
    """A policy that goes round, far from what arrives at a goal, and is guided to one or stays; local or one model."""
    with of_one_model(FEATURES[kind]) if kind in FEATURES else nullcontext():
        policy = uc.LocallyLinearPolicy(None, learner="direct").fit_demonstrations(ROUND)
    aim = {"demonstrations": ROUND} if kind == "cycle" else {"goal": [0.05, 0.0, 0.0], "demonstrations": DOWN}
    return uc.Guided(policy, **aim).moved(BY)


@pytest.fixture(params=["goal", "cycle", *FEATURES])
def guided(request):
    return learnt(request.param)


def assert_same(free, held, guided, rtol):
    """Velocities where nothing constrains and on planes; of each the error is a share of its own size.

    What a cubic wants far away is a thousand times what guiding leaves of it, with the rounding of its own size.
    """
    rounding = 1e-14 * np.linalg.norm(guided.policy(STATES), axis=1) * (guided.closed_form().degree > 1)
    for found, expected in ((free, guided(STATES)), (held, uc.project(PROJECTIONS, guided.under(STATES, PROJECTIONS)))):
        sizes = np.linalg.norm(expected, axis=1)
        error = np.linalg.norm(np.asarray(found) - expected, axis=1)
        assert (error <= rtol * (sizes + 1e-3 * np.median(sizes)) + rounding).all()


def test_guiding_is_seen_in_what_is_exported(guided):
    assert np.linalg.norm(guided(STATES) - guided.policy(STATES), axis=1).max() > 0.1
    form = guided.closed_form()
    assert digest(form) != digest(replace(form, correction=None))


@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
@pytest.mark.parametrize("compiler", ["gcc -std=c99 -Wmissing-prototypes", "g++ -x c++ -std=c++11"], ids=["c", "cpp"])
def test_c_says_what_python_says(guided, single, compiler, tmp_path):
    guided.export_c(tmp_path / "arrive.c", single=single, notes={"recipe": {"states": ["x", "y", "z"]}})
    assert "guided: " in (tmp_path / "arrive.h").read_text()
    command = f"{compiler} {STRICT} -DARRIVE_SELF_TEST -shared -fPIC arrive.c -lm -o arrive.so"
    subprocess.run(command.split(), cwd=tmp_path, check=True)
    library, real = ctypes.CDLL(str(tmp_path / "arrive.so")), ctypes.c_float if single else ctypes.c_double

    def called(function, *given):
        *tables, out = ((real * np.size(each))(*np.ravel(each).tolist()) for each in (*given, given[0]))
        function(*tables, out)
        return np.array(out)

    free = [called(library.arrive_step, state) for state in STATES]
    held = [called(library.arrive_under, *both) for both in zip(STATES, PROJECTIONS, strict=True)]
    assert_same(free, held, guided, 1e-4 if single else 1e-12)
    assert library.main() == 0
    library.arrive_support.restype = real
    found = [library.arrive_support((real * 3)(*state)) for state in STATES.tolist()]
    assert_allclose(found, guided.policy.policy.support(STATES - BY), atol=1e-5 if single else 1e-12)
    over = (real * 3)(*STATES[0].tolist())
    library.arrive_step(over, over)
    assert_allclose(np.array(over), free[0], rtol=0, atol=0)


@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
def test_a_graph_says_what_python_says_and_takes_projections_where_they_are_given(guided, single, tmp_path):
    guided.export_onnx(tmp_path / "arrive.onnx", single=single)
    graph, kind = session(tmp_path / "arrive.onnx"), np.float32 if single else np.float64
    [free] = graph.run(["actions"], {"states": STATES.astype(kind)})
    [held] = graph.run(["actions"], {"states": STATES.astype(kind), "projections": PROJECTIONS.astype(kind)})
    assert_same(free, held, guided, 1e-4 if single else 1e-12)
    [one] = graph.run(["actions"], {"states": STATES[:1].astype(kind), "projections": PROJECTIONS[:1].astype(kind)})
    assert_allclose(one, held[:1], rtol=1e-5 if single else 1e-12)


def test_javascript_says_what_python_says(guided, browser, tmp_path):
    guided.export_javascript(tmp_path / "arrive.js")
    script = (tmp_path / "arrive.js").read_text("utf-8")
    script += "\nwindow.found = [states.map(policy), states.map((x, i) => under(x, projections[i]))];"
    free, held = in_page(browser, tmp_path, script, states=STATES.tolist(), projections=PROJECTIONS.tolist())
    assert_same(free, held, guided, 1e-12)


def test_a_stored_one_is_exported_by_command(guided, tmp_path):
    stored = tmp_path / "arrive.npz"
    uc.save(guided, stored, notes={"recipe": {"states": ["x", "y", "z"]}})
    for suffix in ("c", "onnx", "js"):
        assert f"arrive.{suffix}" in run("export", stored, "-o", tmp_path / f"arrive.{suffix}")
    run("export", stored, "--ros2", tmp_path / "arrive")
    assert "arrive_under" in (tmp_path / "arrive" / "include" / "arrive" / "arrive.h").read_text()
    assert "every state" in " ".join(run("info", stored, "--json").split())
    places = ("arrive.h", "arrive.js", "arrive/README.md", "arrive/scripts/arrive_loop.py")
    comments = [(tmp_path / name).read_text("utf-8") for name in places]
    for said in (*comments, run("info", stored), run("certify", stored)):
        plain = " ".join(re.sub(r"^( \*|#|-) ", "", said, flags=re.MULTILINE).split())
        told = "'unconstrain rollout' tells it; exported, 'under' takes its projection, and 'step' knows of none"
        assert f"that it is told of ({told})" in plain
        step = f"With steps of up to {guided.dt_:.3g} s, to which twice any delay counts, the cycle is wider"
        assert (step in plain) == isinstance(guided.aim_, Orbit)


def test_what_has_no_formula_is_said():
    demos = uc.rollout(spiral, [[1.0, 0.0, 0.0]], 120, 0.05)
    with pytest.raises(SettingError, match="which has no formula to export"):
        uc.Guided(spiral, demonstrations=demos).closed_form()
    with pytest.raises(SettingError, match="scaler: a guided policy is guided in the units of its own states"):
        learnt("goal").closed_form(scaler=object())

"""What runs in a page says and learns the same as Python; run in Chromium."""

import json
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from conftest import POLICIES
from samples import Samples, draw, samples_of, spiral
from unconstrain.base.errors import SettingError
from unconstrain.learners.robust import consistent
from unconstrain.learners.robust.segments import projections_of
from unconstrain.learners.robust.softened import softened

DATA = draw(noise=0.02)


def in_page(browser, tmp_path, script, **values):
    """Run a script of a page of its own, which puts what it finds into ``found``."""
    given = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in values.items())
    page = tmp_path / "page.html"
    page.write_text(f'<!doctype html><meta charset="utf-8"><script type="module">{given}{script}</script>')
    browser.get_log("browser")
    browser.get(page.as_uri())
    found = browser.execute_script("return window.found")
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    return found


def told(browser, tmp_path, policy, states):
    """Actions and support of the exported module."""
    path = tmp_path / "policy.js"
    policy.export_javascript(path)
    module = path.read_text("utf-8")
    script = module + "\nwindow.found = { actions: states.map(policy), support: states.map(support) };"
    return in_page(browser, tmp_path, script, states=np.asarray(states).tolist())


@pytest.fixture(scope="module", params=POLICIES, ids=POLICIES)
def policy(request):
    return POLICIES[request.param](uc.Hybrid()).fit(DATA.states, DATA.actions)


@pytest.mark.parametrize("width", [1.0, 30.0, 1e3])
def test_the_module_says_what_the_policy_says_inside_and_far_outside(policy, browser, tmp_path, width):
    states = np.random.default_rng(3).uniform(-width, width, (40, 2))
    found, expected = told(browser, tmp_path, policy, states), policy.predict(states)
    assert_allclose(found["actions"], expected, rtol=1e-9, atol=1e-9 * width * (1 + np.abs(expected).max()))
    try:
        assert_allclose(found["support"], policy.support(states), atol=1e-9)
    except SettingError:
        form = policy.closed_form()  # the box that an exported C file knows
        assert_array_equal(found["support"], (np.abs(states - form.origin) <= 2 * form.reach).all(axis=1))


def test_the_module_is_in_the_units_of_the_data(browser, tmp_path):
    states, actions = DATA.states * [1000.0, 1.0], DATA.actions * [1000.0, 1.0]
    policy = uc.LocallyLinearPolicy(0.5, scale=(1000.0, 1.0), learner=uc.Hybrid()).fit(states, actions)
    found = told(browser, tmp_path, policy, states[:30])
    assert_allclose(found["actions"], policy.predict(states[:30]), rtol=1e-9, atol=1e-9)
    assert_allclose(found["support"], policy.support(states[:30]), atol=1e-9)


@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
def test_the_module_knows_angles_and_orientations(browser, tmp_path, order):
    rng = np.random.default_rng(0)
    turns = rng.normal([2.0, 0.0, 0.0, 0.0], 1.0, (200, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    states = np.column_stack([rng.uniform(-1, 1, 200), rng.uniform(-3, 3, 200), turns])
    if order == "xyzw":
        states[:, 2:] = turns[:, [1, 2, 3, 0]]
    space = uc.spaces.Euclidean(1) * uc.spaces.Circle() * uc.spaces.Sphere(order)
    actions = np.column_stack([np.cos(states[:, 1]), states[:, 0], turns[:, 1:]])
    policy = uc.LocallyLinearPolicy(space=space, learner=uc.Direct()).fit(states, actions)
    states[:, 1] += 2 * np.pi
    found = told(browser, tmp_path, policy, states[:30])
    assert_allclose(found["actions"], policy.predict(states[:30]), atol=1e-9)
    assert_allclose(found["support"], policy.support(states[:30]), atol=1e-9)


def test_features_that_are_code_are_refused(tmp_path):
    own = uc.ParametricPolicy(lambda x: x, uc.Direct()).fit(DATA.states, DATA.actions)
    with pytest.raises(SettingError, match="they are Python code"):
        own.export_javascript(tmp_path / "policy.js")
    assert not list(tmp_path.iterdir())


LEARNING = (resources.files("unconstrain.pages") / "static" / "learning.js").read_text("utf-8")

LEARN = """
const features = learning.kernels(centres, variance);
for (const one of demonstrations) one.moments = learning.gather(features, one.states, one.actions);
const folds = demonstrations.map((one) => one.moments), hybrid = learning.hybrid(folds);
window.found = {
  direct: Array.from(learning.direct(learning.total(folds))),
  hybrid: Array.from(hybrid.weights),
  segments: Array.from(learning.segments(demonstrations).weights),
  thresholds: thresholds.map((each) => Array.from(hybrid.path.at(hybrid.path.split(each)))),
};
"""
SCENES = {
    "noisy": {"seed": 0, "samples": 240, "noise": 0.05},
    "clean": {"seed": 1, "samples": 240, "noise": 0.0},
    "free": {"seed": 2, "samples": 240, "noise": 0.02, "constrained": False},
}


@pytest.mark.parametrize(
    ("scene", "reach", "width"), [*((scene, 1.0, 1.0) for scene in SCENES), ("noisy", 3.0, 0.4), ("clean", 3.0, 0.4)]
)
def test_learning_in_the_page_gives_the_weights_of_python(browser, tmp_path, scene, reach, width):
    data, thresholds = draw(**SCENES[scene]), [0.0, 1e-6, 1e-3, 0.03, 1.0]
    kernels = uc.NormalisedRBF.grid(-reach, reach, 4, width=width)  # with a reach of 3 most kernels see nothing

    def learnt(learner):
        policy = uc.ParametricPolicy(kernels, learner, validation=uc.Folds(6))
        return policy.fit(data.states, data.actions, groups=data.groups)

    parts = [data.groups == group for group in range(6)]
    demonstrations = [{"states": data.states[p].tolist(), "actions": data.actions[p].tolist()} for p in parts]
    settings = {"centres": kernels.centres.tolist(), "variance": kernels.variance, "thresholds": thresholds}
    found = in_page(browser, tmp_path, LEARNING + LEARN, demonstrations=demonstrations, **settings)
    expected = {
        "direct": learnt(uc.Direct()),
        "hybrid": learnt(uc.Hybrid()),
        "segments": learnt(uc.Segments("groups")),
    }
    pairs = [(found[name], policy) for name, policy in expected.items()]
    pairs += zip(found["thresholds"], (learnt(uc.Hybrid(threshold=each)) for each in thresholds), strict=True)
    for weights, policy in pairs:
        wanted = policy.solution_.weights[0].T.ravel()
        assert_allclose(weights, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max(), err_msg=str(policy.learner))


COMPARE = """
const features = learning.kernels(centres, variance);
for (const one of demonstrations) one.moments = learning.gather(features, one.states, one.actions);
const { ways, taken } = learning.compared(demonstrations);
window.found = { taken: taken.name, missed: Object.fromEntries(ways.map((one) => [one.name, one.missed])) };
"""


def on_rails(alike):
    """Six smooth demonstrations, each on a rail of its own, or on one that turns on the way."""
    groups, times = np.repeat(range(6), 40), np.tile(np.linspace(0, 5, 40), 6)
    states = (0.3 + 0.12 * groups[:, None]) * np.column_stack([np.cos(times + groups), np.sin(times + groups)])
    angles = np.linspace(0.2, 2.9, 6)[groups] + (0.0 if alike else times)
    rails, wanted = np.column_stack([np.cos(angles), np.sin(angles)]), spiral(states)
    noise = 0.02 * np.random.default_rng(5).standard_normal(states.shape)
    return Samples(states, np.vecdot(wanted, rails)[:, None] * rails + noise, groups, wanted, np.empty(0))


@pytest.mark.parametrize("alike", [True, False], ids=["a rail each", "rails that turn"])
def test_the_page_compares_ways_to_learn_by_what_python_says_they_miss(browser, tmp_path, monkeypatch, alike):
    monkeypatch.setattr(consistent, "where_agreed", lambda *_: None)  # of which the page knows nothing
    data, kernels = on_rails(alike), uc.NormalisedRBF.grid(-1, 1, 4, width=1.0)
    parts = [data.groups == group for group in range(6)]
    demonstrations = [{"states": data.states[p].tolist(), "actions": data.actions[p].tolist()} for p in parts]
    settings = {"centres": kernels.centres.tolist(), "variance": kernels.variance}
    found = in_page(browser, tmp_path, LEARNING + COMPARE, demonstrations=demonstrations, **settings)
    samples = samples_of(data, features=kernels(data.states))
    samples = replace(samples, memberships=np.ones_like(samples.memberships))
    candidates = [*softened(samples), uc.Segments("groups").candidate(samples, None)[0]]
    seen = projections_of(data.actions, data.groups, np.full(240, 0.02**2))
    if not alike:
        seen = (
            data.actions[:, :, None] * data.actions[:, None, :] / np.vecdot(data.actions, data.actions)[:, None, None]
        )
    energy = (data.actions**2).sum()
    missed = {
        one.name: (np.einsum("nab,nb->na", seen, data.actions - one.held_out) ** 2).sum() / energy for one in candidates
    }
    assert found["missed"].keys() == {
        "direct",
        *(f"softened hybrid, {s}" for s in ("1", "0.1", "0.01", "0.001")),
        "segments",
    }
    assert_allclose(list(found["missed"].values()), [missed[name] for name in found["missed"]], rtol=1e-6)
    assert found["taken"] == min(found["missed"], key=found["missed"].get)
    assert (found["taken"] == "segments") == alike  # a rail that turns is none of the whole stroke

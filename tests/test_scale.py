"""Units of a policy's own: what is learnt inside them, what comes out in those of the data."""

import json
import pickle
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import samples
import unconstrain as uc
from conftest import LEARNERS, POLICIES, ROBUST
from test_cli import call, run, write
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.models import Scale
from unconstrain.models.scale import candidates

MM = np.array([1000.0, 1000.0, 1.0])
"""A policy that moves in metres and turns in radians, with its positions in millimetres."""


def turning(seed=0, demonstrations=12, steps=60):
    """Moves and turns towards a goal, behind one orthogonal constraint a demonstration, in metres and radians."""
    rng = np.random.default_rng(seed)
    pull = 0.4 * rng.normal(size=(3, 3)) - np.eye(3)
    made = []
    for number in range(demonstrations):
        x, normal = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        states, actions = [], []
        for _ in range(steps):
            wanted = pull @ x + 0.5 * np.sin(2 * np.roll(x, 1))
            states.append(x)
            actions.append(wanted - normal * (normal @ wanted))
            x = x + 0.03 * actions[-1]
        made.append(uc.Demonstration(states, actions, 0.03 * np.arange(steps), name=f"d{number}"))
    return made


def in_units(demonstrations, units):
    return [uc.Demonstration(one.states * units, one.actions * units, one.times) for one in demonstrations]


def rows(demonstrations):
    return uc.stack(demonstrations).states


@pytest.mark.parametrize("learner", [LEARNERS["hybrid"], LEARNERS["inconsistency"], ROBUST["robust"]])
@pytest.mark.parametrize("model", ["affine", "cubic", "kmeans", "local"])
def test_units_cost_nothing_where_their_scale_is_told(model, learner):
    demos = turning()
    plain = POLICIES[model](learner).fit_demonstrations(demos)
    scaled = POLICIES[model](learner).set_params(scale=MM).fit_demonstrations(in_units(demos, MM))
    states = rows(demos)[::7]
    size = np.abs(plain(states)).max()
    assert_allclose(scaled(states * MM) / MM, plain(states), atol=1e-7 * size)
    assert scaled.held_out_score() == pytest.approx(plain.held_out_score(), abs=1e-7)
    given = uc.stack(in_units(demos, MM))
    assert scaled.score(given.states, given.actions) == pytest.approx(plain.score(*uc.stack(demos)[:2]), abs=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_millimetres_beside_radians_are_found_and_cost_nothing(seed):
    demos = turning(seed)
    plain, blind, seeing = (
        uc.LocallyLinearPolicy(None, learner="hybrid", scale=scale).fit_demonstrations(in_units(demos, units))
        for scale, units in ((None, np.ones(3)), (None, MM), ("auto", MM))
    )
    assert_array_equal(seeing.scale_.states, MM)
    assert_array_equal(seeing.scale_.actions, MM)
    states = rows(demos)
    turns, expected = seeing(states * MM)[:, 2], plain(states)[:, 2]
    assert_allclose(turns, expected, atol=1e-8 * np.abs(expected).max())
    assert np.abs(blind(states * MM)[:, 2] - expected).max() > 0.1 * np.abs(expected).max()


def test_degrees_beside_metres_are_found_and_alike_columns_left_alone():
    demos, degrees = turning(3), np.array([1.0, 1.0, 180 / np.pi])
    policy = uc.LocallyLinearPolicy(None, learner="hybrid", scale="auto")
    assert_array_equal(policy.fit_demonstrations(in_units(demos, degrees)).scale_.states, degrees)
    assert policy.fit_demonstrations(demos).scale_ is None
    assert policy.fit_demonstrations(in_units(demos, np.full(3, 1000.0))).scale_ is None


def test_a_later_batch_that_is_unlike_in_the_scale_of_the_first_is_warned_of():
    metres, millimetres = uc.stack(turning(5)), uc.stack(in_units(turning(), MM))
    policy = uc.LocallyLinearPolicy(None, learner="hybrid", scale="auto")
    policy.partial_fit(*metres[:2], groups=metres.groups)
    with pytest.warns(UserWarning, match="scale: 'auto' was found on the first batch, and in a later one"):
        policy.partial_fit(*millimetres[:2], groups=millimetres.groups)
    alike = uc.LocallyLinearPolicy(None, learner="hybrid", scale="auto")
    for rows in np.array_split(np.arange(len(millimetres.states)), 6):  # warnings are errors here
        alike.partial_fit(millimetres.states[rows], millimetres.actions[rows], groups=millimetres.groups[rows])
    assert_array_equal(alike.scale_.states, MM)


def test_diagnose_takes_the_scale_of_fit(tmp_path):
    paths = [tmp_path / f"{number}.csv" for number in range(6)]
    for path, one in zip(paths, in_units(turning()[:6], MM), strict=True):
        write(path, "t,x,y,turn,vx,vy,vturn", np.column_stack([one.times, one.states, one.actions]))
    read = (*paths, "--state", "x,y,turn", "--action", "vx,vy,vturn", "--model", "affine", "--scale", "1000,1000,1")
    ran = call("diagnose", *read)
    assert "As one count 1000 of x, 1000 of y, 1 of turn" in ran.out
    assert "mixed-units" not in ran.err
    assert json.loads(run("diagnose", *read, "--json"))["regions"]


def test_a_scale_is_chosen_between_groups_of_columns_of_unlike_sizes():
    [only] = candidates(np.array([1.0, 0.0, 3.0]))
    assert_array_equal(only.scale, 1.0)
    scales = [tuple(one.scale) for one in candidates(np.array([300.0, 1.0, 5.0]))]
    assert (1000.0, 1.0, 1.0) in scales
    assert (1000.0, 1.0, 1000.0) in scales
    assert all(scale[1] == 1.0 for scale in scales)


def fitted(model="local", learner=None, **settings):
    demos = in_units(turning(), MM)
    policy = POLICIES[model](learner or uc.Hybrid()).set_params(scale=MM, **settings).fit_demonstrations(demos)
    return policy, rows(demos)[::9]


@pytest.mark.parametrize("model", ["affine", "cubic", "kmeans", "local"])
def test_steps_files_and_copies_are_in_the_units_of_the_data(model, tmp_path):
    policy, states = fitted(model)
    expected = policy(states)
    size = np.abs(expected).max(axis=0)
    assert_allclose([policy.step(state) for state in states] / size, expected / size, atol=1e-9)
    assert_allclose(uc.rollout(policy, states[0], 2, 0.1).actions[0] / size, expected[0] / size, atol=1e-9)
    uc.save(policy, tmp_path / "p.npz")
    for copy in (uc.load(tmp_path / "p.npz"), pickle.loads(pickle.dumps(policy))):
        assert_array_equal(copy(states), expected)
        assert_array_equal(copy.scale_.states, MM)
    policy.export_c(tmp_path / "p.c", "policy")
    subprocess.run(["cc", "-std=c99", "-DPOLICY_SELF_TEST", "-o", tmp_path / "p", tmp_path / "p.c", "-lm"], check=True)
    subprocess.run([tmp_path / "p"], check=True)


def test_steps_of_features_in_python_are_in_the_units_of_the_data():
    policy = uc.ParametricPolicy(lambda x: np.column_stack([x, np.cos(x)]), uc.Hybrid(), scale=MM)
    states = rows(in_units(turning(), MM))[::9]
    policy.fit_demonstrations(in_units(turning(), MM))
    assert_allclose([policy.step(state) for state in states], policy(states), rtol=1e-9)


def test_an_exported_graph_is_in_the_units_of_the_data(tmp_path):
    runtime = pytest.importorskip("onnxruntime")
    policy, states = fitted()
    policy.export_onnx(tmp_path / "p.onnx")
    [actions] = runtime.InferenceSession(tmp_path / "p.onnx").run(None, {"states": states})
    assert_allclose(actions, policy(states), rtol=1e-7, atol=1e-9 * np.abs(actions).max())


def test_uncertainty_support_and_diagnosis_are_in_the_units_of_the_data():
    demos = turning()
    plain = uc.LocallyLinearPolicy(0.5).fit_demonstrations(demos)
    scaled = uc.LocallyLinearPolicy(0.5, scale=MM).fit_demonstrations(in_units(demos, MM))
    states = rows(demos)[::9]
    assert_allclose(scaled.uncertainty(states * MM).total / MM, plain.uncertainty(states).total, rtol=1e-6)
    given = scaled.covariances(states * MM) / np.multiply.outer(MM, MM)
    assert_allclose(given, plain.covariances(states), rtol=1e-6, atol=1e-12)
    assert_allclose(scaled.support(states * MM), plain.support(states), rtol=1e-9)
    here, there = uc.evaluation.diagnose(plain, demos), uc.evaluation.diagnose(scaled, in_units(demos, MM))
    for mine, theirs in zip(here.regions, there.regions, strict=True):
        assert_allclose(theirs.state / MM, mine.state, rtol=1e-9)
        assert_allclose(theirs.centre / MM, mine.centre, rtol=1e-9)
        assert theirs.along == pytest.approx(mine.along, rel=1e-6, abs=1e-12)


def test_centres_of_fields_are_given_in_the_units_of_the_data():
    demos = turning()
    centres, states = rows(demos)[::60], rows(demos)[::9]
    plain = uc.LocallyLinearPolicy(0.5, centres=centres, learner="hybrid").fit_demonstrations(demos)
    scaled = uc.LocallyLinearPolicy(0.5, centres=centres * MM, learner="hybrid", scale=MM)
    scaled.fit_demonstrations(in_units(demos, MM))
    assert_allclose(scaled.fields_.centres, plain.fields_.centres, rtol=1e-12)
    assert_allclose(scaled(states * MM) / MM, plain(states), atol=1e-7 * np.abs(plain(states)).max())


def test_in_pieces_it_is_the_same():
    demos = in_units(turning(), MM)
    whole = uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid(), scale=MM).fit_demonstrations(demos)
    batches = [(one.states, one.actions, None, np.full(len(one), number)) for number, one in enumerate(demos)]
    streamed = uc.LocallyLinearPolicy(0.5, learner=uc.Hybrid(), scale=MM).fit_batches(batches)
    states = rows(demos)[::9]
    assert_allclose(streamed(states), whole(states), rtol=1e-6, atol=1e-6)


def test_actions_that_are_no_velocities_of_the_states_have_a_scale_of_their_own():
    data = samples.draw()
    states, actions = data.states * 1000.0, np.column_stack([data.actions, data.actions[:, :1]])
    numbers = [1000.0] * states.shape[1] + [1.0] * actions.shape[1]
    scaled = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(), scale=numbers).fit(states, actions, groups=data.groups)
    plain = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(data.states, actions, groups=data.groups)
    assert_allclose(scaled(states), plain(data.states), atol=1e-8)
    with pytest.raises(SettingError, match=r"scale: got 2 numbers, expected 5, one for each state and each action"):
        scaled.set_params(scale=(1.0, 2.0)).fit(states, actions)


@pytest.mark.parametrize("scale", [(1, 2), (1, 2, 0), (1, -1, 1), "all", ()])
def test_a_scale_that_makes_no_sense_is_refused(scale):
    with pytest.raises(SettingError, match="scale: "):
        uc.LocallyLinearPolicy(scale=scale).fit_demonstrations(turning())


def test_a_scale_that_is_not_finite_is_refused():
    with pytest.raises(InvalidDataError, match="scale"):
        uc.LocallyLinearPolicy(scale=(1, np.nan, 1)).fit_demonstrations(turning())


def test_a_cluster_takes_numbers_alone():
    policy = uc.LocallyLinearPolicy(None, learner=uc.Hybrid(), scale="auto")
    with pytest.raises(SettingError, match=r"scale: got 'auto', which looks at samples, and a cluster .* Take numbers"):
        policy.fit_parts([[]], lambda function, parts: function(*parts))


def test_a_closed_form_in_other_units_is_the_same_policy():
    scale = Scale(np.array([2.0, 0.5]), np.array([3.0, 4.0]))
    assert_allclose(scale.given(scale.action(np.ones((2, 2)))), 1.0)
    assert not scale.is_one
    assert Scale(np.ones(2), np.ones(2)).is_one


def _but_commands(said):
    """What was printed, without what may be typed next, which names the options that were given."""
    return [line for line in said.splitlines() if not line.startswith("    unconstrain ")]


def test_the_command_line_scales_and_says_so(tmp_path):
    files = []
    for one in in_units(turning(), MM):
        table = np.column_stack([np.arange(len(one)) * 0.03, one.states, one.actions])
        files.append(write(tmp_path / f"d{len(files)}.csv", "t,x,y,yaw,vx,vy,vyaw", table))
    output, plain = tmp_path / "p.npz", ("--learner", "hybrid", "--model", "affine")
    done = run("fit", *files, "-o", output, *plain, "--scale", "auto", "--strict")
    assert "As one count 1000 of x, 1000 of y, 1 of yaw, 1000 of vx" in done
    assert_array_equal(uc.load(output).scale_.states, MM)
    told = run("fit", *files, "-o", output, "--force", *plain, "--scale", "1000,1000,1")
    assert _but_commands(told) == _but_commands(done)
    unscaled = call("fit", *files, "-o", output, "--force", *plain)
    assert "As one" not in unscaled.out
    assert "mixed-units: 'd0', column 'yaw': " in unscaled.err
    assert "--scale auto levels them" in unscaled.err
    beside = call("fit", *files, "-o", output, "--force", *plain, "--scale", "auto", "--angle", "yaw")
    assert "As one" not in beside.out
    assert "Note: --scale auto: angles and orientations have none; give positions in metres." in beside.err
    wrong = call("fit", *files, "-o", output, "--force", "--scale", "1,2")
    assert wrong.code == 2
    assert "Error: --scale: got 2 numbers, expected 3, one for each state." in wrong.err

"""Angles and orientations as such: no jump of their numbers is one of the policy, from the file to exported code."""

import ctypes
import shutil
import subprocess
from contextlib import nullcontext
from functools import cache
from warnings import catch_warnings, simplefilter

import array_api_strict
import numpy as np
import onnxruntime
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import unconstrain as uc
from unconstrain import cli
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.models.spaces import ORDERS, Circle, Embedding, Euclidean, Product, Sphere

EVERYWHERE = np.linspace(-3 * np.pi, 3 * np.pi, 601)[:, None]
TURN = np.array([0.4, -1.1, 0.7])
"""An angular velocity in the frame of the body, rad/s."""

KINDS = {"local": uc.LocallyLinearPolicy, "rbf": uc.ParametricPolicy}
SPACES = {
    "circle": Circle(),
    "degrees": Circle(360.0),
    "sphere": Sphere(),
    "scalar last": Sphere("xyzw"),
    "product": Euclidean(2) * Sphere() * Circle(360.0) * Euclidean(),
}


def quaternions(rotations, order="wxyz"):
    return np.roll(rotations.as_quat(), 1 if order == "wxyz" else 0, axis=1)


def rotations(states):
    return Rotation.from_quat(np.roll(states, -1, axis=1))


def drawn(space, count=20, seed=0):
    """Random states; angles of several turns, both signs of quaternions."""
    rng = np.random.default_rng(seed)
    columns = []
    for factor in space.factors:
        if isinstance(factor, Circle):
            columns.append(rng.uniform(-2 * factor.turn, 2 * factor.turn, (count, 1)))
        elif isinstance(factor, Sphere):
            signs = rng.choice([-1.0, 1.0], (count, 1))
            columns.append(signs * quaternions(Rotation.random(count, random_state=rng), factor.order))
        else:
            columns.append(rng.normal(size=(count, factor.columns)))
    return np.concatenate(columns, axis=1)


def same_states(states):
    """The same states in other numbers: the product's quaternion of the other sign, its angle two turns further."""
    return states * [1, 1, -1, -1, -1, -1, 1, 1] + [0, 0, 0, 0, 0, 0, 720.0, 0]


@pytest.fixture(params=SPACES.values(), ids=SPACES)
def space(request):
    return request.param


# Spaces


@pytest.mark.parametrize("order", ORDERS)
def test_orientations_are_those_of_scipy(order):
    sphere, rng = Sphere(order), np.random.default_rng(1)
    one, other = Rotation.random(30, random_state=rng), Rotation.random(30, random_state=rng)
    q, p = -quaternions(one, order), quaternions(other, order)
    assert_allclose(np.sqrt(2) * sphere.coordinates(q), one.as_matrix().reshape(-1, 9), atol=1e-14)
    between = (other.inv() * one).as_rotvec()
    assert_allclose(sphere.difference(q, p), between, atol=1e-14)
    assert_allclose(sphere.step(p, between), quaternions(other * Rotation.from_rotvec(between), order), atol=1e-14)
    mean = quaternions(Rotation.concatenate([one[:4].mean()]), order)
    found = sphere.mean(q[:4])
    assert_allclose(found * np.sign(found @ mean[0]), mean, atol=1e-14)


def test_an_angle_is_wrapped_to_half_a_turn_and_compared_the_short_way():
    angle = np.array([[np.pi], [-np.pi], [3.0], [7.0]])
    assert_array_equal(Circle().step(angle, 0 * angle)[:2], [[np.pi], [np.pi]])
    assert_allclose(Circle().difference(np.array([[3.1]]), np.array([[-3.1]])), 6.2 - 2 * np.pi)
    assert_allclose(Circle(360.0).mean(np.array([[170.0], [-150.0]])), [[-170.0]])


def test_a_step_by_the_difference_arrives(space):
    start, goal = drawn(space, seed=1), drawn(space, seed=2)
    arrived = space.step(start, space.difference(goal, start))
    assert_allclose(space.coordinates(arrived), space.coordinates(goal), atol=1e-12)
    assert_allclose(space.coordinates(space.states(space.coordinates(goal))), space.coordinates(goal), atol=1e-12)


def test_chords_are_differences_to_first_order(space):
    states = drawn(space)
    ways = 1e-5 * np.random.default_rng(3).normal(size=(20, space.sizes[2]))
    before, after = space.coordinates(states), space.coordinates(space.step(states, ways))
    assert_allclose(np.linalg.norm(after - before, axis=1), np.linalg.norm(ways, axis=1), rtol=1e-4)


def test_axes_are_orthonormal_and_begin_with_tangents(space):
    states = drawn(space)
    ways = 1e-6 * np.random.default_rng(3).normal(size=(20, space.sizes[2]))
    points = space.coordinates(states)
    axes = space.axes(points)
    assert_allclose(axes @ axes.mT, np.tile(np.eye(axes.shape[1]), (20, 1, 1)), atol=1e-12)
    seen = np.einsum("mkz,mz->mk", axes, space.coordinates(space.step(states, ways)) - points)
    assert_allclose(np.sort(np.abs(seen))[:, -ways.shape[1] :], np.sort(np.abs(ways)), rtol=1e-3, atol=1e-11)


def test_coordinates_in_a_frame_do_not_depend_on_where_angles_begin():
    space = Circle() * Sphere()
    states, turned = drawn(space, seed=4), drawn(space, seed=4)
    turned[:, 0] += 2.0
    turned[:, 1:] = quaternions(Rotation.random(random_state=7) * rotations(states[:, 1:]))
    seen = [Embedding(space).seen_from(space.coordinates(part).mean(axis=0))(part) for part in (states, turned)]
    assert_allclose(*seen, atol=1e-13)


def test_coordinates_are_computed_in_any_array_library(space):
    states = drawn(space)
    there = Embedding(space)(array_api_strict.asarray(states))
    assert_allclose(np.asarray(there), space.coordinates(states), atol=1e-14)


def test_a_path_is_unrolled_into_one_whose_steps_are_the_differences():
    space, steps = Circle() * Sphere(), np.random.default_rng(5).normal(0, 0.3, (30, 4))
    states = [drawn(space, 1)]
    for step in steps:
        states.append(space.step(states[-1], step[None]))
    assert_allclose(np.diff(space.unrolled(np.concatenate(states)), axis=0), steps, atol=1e-12)


def test_a_space_of_one_column_serves_for_several():
    assert Circle().over(3) == Product((Circle(), Circle(), Circle())) == Circle() * Circle() * Circle()
    assert Euclidean().over(3) == Euclidean(3) == Euclidean() * Euclidean(2)
    assert Euclidean() * (Euclidean() * Circle()) == Euclidean(2) * Circle()
    with pytest.raises(InvalidDataError, match=r"got 3 columns, expected 4 as the space Sphere.* has. Name the space"):
        uc.LocallyLinearPolicy(space=Sphere()).fit(np.eye(3), np.eye(3))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sphere("zyxw"), "order: got 'zyxw', expected one of wxyz, xyzw."),
        (lambda: Circle(0.0), "turn: got 0.0, expected a number above 0"),
        (lambda: Sphere().coordinates(np.ones((2, 4))), "got a quaternion of length 2 at row 0, expected unit quat"),
        (lambda: uc.LocallyLinearPolicy(space="circle").fit([[0.0]], [[1.0]]), "space: got 'circle', expected one of"),
        (lambda: Sphere().coordinates(np.zeros((1, 4))), "got a quaternion of length 0 at row 0, expected unit quat"),
    ],
)
def test_what_is_no_angle_or_orientation_is_refused(make, said):
    with pytest.raises((SettingError, InvalidDataError), match=said):
        make()


# Cranks and turning bodies, from their recordings


def crank(start, unit=1.0, wrapped=True):
    times = np.arange(0.0, 2.0, 0.02)
    angle = start + times
    if wrapped:
        angle = (angle + np.pi) % (2 * np.pi) - np.pi
    return uc.Recording(("crank",), unit * angle[:, None], times, f"from {start:.2f}")


STARTS = np.random.default_rng(8).uniform(-np.pi, np.pi, 6)
CRANK = uc.Recipe(("crank",), differentiate="savgol", angles=("crank",))


@pytest.mark.parametrize("learner", ["robust", "hybrid"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("wrapped", [True, False])
def test_a_crank_turns_at_its_speed_everywhere(kind, learner, wrapped):
    demonstrations = uc.prepare([crank(start, wrapped=wrapped) for start in STARTS], CRANK)
    policy = KINDS[kind](learner=learner).fit_demonstrations(demonstrations)
    assert np.abs(policy.predict(EVERYWHERE) - 1.0).max() < 1e-9
    assert_allclose(policy.predict(EVERYWHERE + 2 * np.pi), policy.predict(EVERYWHERE), atol=1e-12)


def test_a_speed_that_depends_on_the_angle_closes_too():
    times = np.arange(0.0, 3.0, 0.02)[:, None]
    actions = [1.0 + 0.3 * np.sin(start + times) for start in STARTS]
    demos = [uc.Demonstration(start + times, u, space=Circle()) for start, u in zip(STARTS, actions, strict=True)]
    policy = uc.LocallyLinearPolicy().fit_demonstrations(demos)
    assert_allclose(policy.predict(EVERYWHERE), 1.0 + 0.3 * np.sin(EVERYWHERE), rtol=1e-6)
    straight = uc.LocallyLinearPolicy(space=Euclidean()).fit_demonstrations(demos)
    assert np.abs(straight.predict(EVERYWHERE) - policy.predict(EVERYWHERE)).max() > 0.1


def test_degrees_are_known_by_the_row_of_units_by_their_jumps_or_by_the_option():
    wrapped, straight = crank(3.0, 180 / np.pi), crank(0.0, 180 / np.pi)
    with_units = uc.Recording(straight.columns, straight.values, straight.times, units={"crank": "deg"})
    asked = uc.Recipe(("crank",), differentiate="savgol", angles=("crank",), degrees=("crank",))
    for recording, recipe in ((wrapped, CRANK), (with_units, CRANK), (straight, asked)):
        word = nullcontext() if recipe is asked else pytest.warns(match=r"crank is taken in radians; degrees=\(\)")
        with word:
            [demonstration] = uc.prepare(recording, recipe)
        assert demonstration.space == Circle()
        assert_allclose(demonstration.actions, 1.0)
    assert uc.prepare(crank(0.0, wrapped=False), CRANK)[0].space == Circle()


def test_degrees_that_are_said_to_be_none_are_a_warning():
    wrapped = crank(3.0, 180 / np.pi)
    told = uc.Recipe(("crank",), differentiate="savgol", angles=("crank",), degrees=())
    with pytest.warns(match="column 'crank': jumps by 360, as an angle in degrees does, and is taken for radians"):
        uc.prepare(wrapped, told)
    with catch_warnings():
        simplefilter("error")
        uc.prepare(crank(3.0), told)  # which is in radians


def turning(start, order="wxyz", flips=True):
    times = np.arange(0.0, 2.0, 0.02)
    table = quaternions(start * Rotation.from_rotvec(times[:, None] * TURN), order)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (len(times), 1)) if flips else 1.0
    return uc.Recording(tuple(f"q{letter}" for letter in order), signs * table, times)


@cache
def turned(kind, learner, order="wxyz"):
    """A policy of a body that turns at a constant angular velocity from eight orientations."""
    names = tuple(f"q{letter}" for letter in order)
    recipe = uc.Recipe(names, differentiate="savgol", quaternions=(names,))
    recordings = [turning(start, order) for start in Rotation.random(8, random_state=2)]
    return KINDS[kind](learner=learner).fit_demonstrations(uc.prepare(recordings, recipe))


@pytest.mark.parametrize("learner", ["robust", "hybrid"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_body_turns_at_its_angular_velocity_whatever_the_signs(kind, learner):
    states = drawn(Sphere(), 200)
    policy = turned(kind, learner)
    assert np.abs(policy.predict(states) - TURN).max() < 1e-3 * np.linalg.norm(TURN)
    assert_array_equal(policy.predict(-states), policy.predict(states))


def test_the_order_of_a_quaternion_is_that_of_its_names():
    states = drawn(Sphere("xyzw"), 50)
    assert np.abs(turned("local", "hybrid", "xyzw").predict(states) - TURN).max() < 1e-3


def test_a_recipe_names_space_and_directions_of_its_states():
    names = ("x", "qx", "qy", "qz", "qw", "yaw")
    recipe = uc.Recipe(names, angles=("yaw",), quaternions=(names[1:5],))
    assert recipe.space == Euclidean() * Sphere("xyzw") * Circle()
    assert recipe.directions == ("vx", "wqx", "wqy", "wqz", "vyaw")
    assert uc.Recipe(("x", "y")).space == Euclidean(2)
    apart = uc.Recipe(("qw", "x", "qx", "qy", "qz"), quaternions=(("qw", "qx", "qy", "qz"),))
    with pytest.raises(SettingError, match="expected the four columns side by side"):
        _ = apart.space


def test_states_relative_to_their_mean_are_so_in_the_space():
    names = ("qw", "qx", "qy", "qz")
    recipe = uc.Recipe(names, differentiate="savgol", quaternions=(names,), centre=True)
    with pytest.warns(match="hides a constant push"):
        [demonstration] = uc.prepare(turning(Rotation.random(random_state=1)), recipe)
    assert_allclose(np.abs(Sphere().mean(demonstration.states)), [[1.0, 0.0, 0.0, 0.0]], atol=1e-12)
    assert_allclose(demonstration.actions, np.tile(TURN, (100, 1)), atol=1e-9)


def test_demonstrations_of_different_spaces_are_not_learnt_from_together():
    angle = np.linspace(0.0, 1.0, 9)[:, None]
    pair = [uc.Demonstration(angle, angle, space=space) for space in (Circle(), Euclidean())]
    with pytest.raises(InvalidDataError, match=r"demonstration 1 .* is in the space Euclidean.* Prepare all by one"):
        uc.LocallyLinearPolicy().fit_demonstrations(pair)


# Under constraints


def harmonic(states):
    angle, x = states[:, 0], states[:, 1]
    return np.column_stack(
        [0.3 - np.sin(angle - 0.5), 0.4 * np.cos(angle) - 0.8 * x, 0.5 * np.sin(angle) - states[:, 2]]
    )


SHIFT = np.array([2.0, 0.0, 0.0])
GOAL = quaternions(Rotation.from_rotvec([[0.3, -0.2, 0.5]]))


def towards_goal(states):
    return -0.8 * Sphere().difference(states, GOAL)


@cache
def held(which, seed, count=20):
    """Demonstrations, each held along a random direction; of an orientation, about a random axis of the body."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 1, 3))
    if which == "angle":
        starts = np.column_stack([rng.uniform(-np.pi, np.pi, count), rng.uniform(-1, 1, (count, 2))])
        policy, space = harmonic, Circle() * Euclidean(2)
    else:
        starts = quaternions(rotations(GOAL) * Rotation.from_rotvec(rng.uniform(-1, 1, (count, 3))))
        policy, space = towards_goal, Sphere()
    constraints = [lambda x, t, normal=normal: np.tile(normal, (len(x), 1, 1)) for normal in normals]
    return uc.rollout(policy, starts, 25, 0.1, constraints, space=space)


def moved(which, change, seed=11):
    """The same demonstrations in other numbers."""
    return [
        uc.Demonstration(change(index, demo.states), demo.actions, demo.times, space=demo.space)
        for index, demo in enumerate(held(which, seed))
    ]


@cache
def learnt(which, kind, learner):
    return KINDS[kind](learner=learner).fit_demonstrations(held(which, 11))


@pytest.mark.parametrize("which", ["angle", "orientation"])
def test_a_policy_is_recovered_from_behind_constraints(which):
    policy, others = learnt(which, "local", "robust"), held(which, 12)
    assert uc.nupe(policy, others) < 0.01
    if which == "angle":  # sines are what local models on a circle hold exactly
        assert uc.nupe(policy, others) < 1e-12
    else:  # of orientations away from half a turn, rotation vectors are a chart in which this policy is nearly linear
        plain = [[_as_vectors(demo) for demo in held(which, seed)] for seed in (11, 12)]
        straight = uc.LocallyLinearPolicy(None).fit_demonstrations(plain[0])  # local models as well
        assert uc.nupe(policy, others) < 10.0 * uc.nupe(straight, plain[1])


def _as_vectors(demo):
    return uc.Demonstration(rotations(demo.states).as_rotvec(), demo.actions, demo.times, demo.truth)


@pytest.mark.parametrize("learner", ["robust", "hybrid"])
@pytest.mark.parametrize("kind", KINDS)
def test_it_does_not_matter_where_an_angle_begins(kind, learner):
    shifted = KINDS[kind](learner=learner).fit_demonstrations(moved("angle", lambda _, x: x + SHIFT))
    states = drawn(Circle() * Euclidean(2), 100)
    expected = learnt("angle", kind, learner).predict(states)
    assert_allclose(shifted.predict(states + SHIFT), expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("learner", ["robust", "hybrid"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_turn_of_the_world_changes_no_angular_velocity_in_the_body(kind, learner):
    turn = Rotation.from_rotvec([1.0, 2.0, -0.5])
    other = moved("orientation", lambda _, states: quaternions(turn * rotations(states)))
    states = held("orientation", 12)[0].states
    expected = learnt("orientation", kind, learner).predict(states)
    found = KINDS[kind](learner=learner).fit_demonstrations(other).predict(quaternions(turn * rotations(states)))
    assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("learner", ["robust", "hybrid"])
@pytest.mark.parametrize("kind", KINDS)
def test_the_sign_of_a_quaternion_changes_nothing(kind, learner):
    flipped = moved("orientation", lambda index, x: x * np.random.default_rng(index).choice([-1.0, 1.0], (len(x), 1)))
    policy = KINDS[kind](learner=learner).fit_demonstrations(flipped)
    states = held("orientation", 12)[0].states
    assert_array_equal(policy.predict(-states), learnt("orientation", kind, learner).predict(states))


@pytest.mark.parametrize(("features", "count"), [(uc.Affine(), 20), (uc.Polynomial(2), 20), ("auto", 9)])
def test_features_of_an_angle_see_its_cosine_and_sine(features, count):
    policy = uc.ParametricPolicy(features).fit_demonstrations(held("angle", 11)[:count])
    states = drawn(Circle() * Euclidean(2), 100)
    assert uc.nupe(policy, held("angle", 12)) < 1e-12
    assert_allclose(policy.predict(states + 2 * np.pi * SHIFT), policy.predict(states), atol=1e-9)


def test_widths_are_chosen_where_states_are_angles():
    policy = uc.LocallyLinearPolicy("auto", learner="hybrid").fit_demonstrations(held("angle", 11)[:3])
    states = drawn(Circle() * Euclidean(2), 100)
    assert_allclose(policy.predict(states + 2 * np.pi * SHIFT), policy.predict(states), atol=1e-9)


# In motion


def test_a_rollout_stays_in_the_space():
    policy = uc.ParametricPolicy(learner="direct", space=SPACES["product"])
    path = uc.rollout(policy.fit(*_anything()), drawn(SPACES["product"], 3), 200, 0.1, method="euler")
    for run in path:
        assert run.space == SPACES["product"]
        assert run.actions.shape == (200, 7)
        assert_allclose(np.linalg.norm(run.states[:, 2:6], axis=1), 1.0, atol=1e-12)
        assert (np.abs(run.states[1:, 6]) <= 180.0).all()
        assert_allclose(run.space.difference(run.states[1:], run.states[:-1]), 0.1 * run.actions[:-1], atol=1e-9)


def test_a_rollout_expects_an_action_for_each_direction():
    with pytest.raises(SettingError, match=r"expects actions that are velocities of the state, 3 in their space"):
        uc.rollout(lambda states: states, drawn(Sphere(), 1), 3, space=Sphere())


def test_near_the_data_is_near_across_the_jump():
    shown = np.linspace(2.5, np.pi, 20)[:, None]
    policy = uc.LocallyLinearPolicy(space=Circle()).fit(shown, np.ones_like(shown))
    assert uc.rollout(policy, [3.0], 5).space == Circle()
    assert_allclose(policy.support(np.array([[np.pi + 0.1]])), policy.support(np.array([[-np.pi + 0.1]])))


# Elsewhere


def _anything(count=400):
    """States of the product and actions that no space explains."""
    return drawn(SPACES["product"], count), np.random.default_rng(6).normal(size=(count, 7))


@cache
def anything(kind):
    made = {
        "local": lambda **settings: uc.LocallyLinearPolicy(3000.0, **settings),
        "rbf": uc.ParametricPolicy,
        "affine": lambda **settings: uc.ParametricPolicy(uc.Affine(), **settings),
        "quadratic": lambda **settings: uc.ParametricPolicy(uc.Polynomial(2), **settings),
    }
    return made[kind](learner="direct", space=SPACES["product"]).fit(*_anything())


@pytest.mark.parametrize("kind", ["local", "rbf", "affine", "quadratic"])
def test_steps_and_graphs_say_the_same_in_the_space(kind, tmp_path):
    policy, states = anything(kind), drawn(SPACES["product"], 50, seed=9)
    expected = policy.predict(states)
    assert_allclose([policy.step(state) for state in same_states(states)], expected, rtol=0, atol=1e-9)
    policy.export_onnx(tmp_path / "policy.onnx")
    session = onnxruntime.InferenceSession(tmp_path / "policy.onnx")
    [found] = session.run(["actions"], {"states": same_states(states)})
    assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("kind", ["local", "rbf", "affine", "quadratic"])
def test_the_c_file_says_the_same_in_the_space_and_tests_itself(kind, tmp_path):
    policy, states = anything(kind), drawn(SPACES["product"], 50, seed=9)
    policy.export_c(tmp_path / "policy.c")
    strict = ["cc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2", tmp_path / "policy.c", "-lm", "-o"]
    subprocess.run([*strict, tmp_path / "test", "-DPOLICY_SELF_TEST"], check=True)
    subprocess.run([tmp_path / "test"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([*strict, tmp_path / "policy.so", "-shared", "-fPIC"], check=True)
    step = ctypes.CDLL(str(tmp_path / "policy.so")).policy_step
    found, action = [], (ctypes.c_double * 7)()
    for state in same_states(states):
        step((ctypes.c_double * 8)(*state), action)
        found.append(list(action))
    assert_allclose(found, policy.predict(states), rtol=0, atol=1e-9)


def test_a_stored_policy_knows_its_space(tmp_path):
    policy = anything("local")
    uc.save(policy, tmp_path / "policy.npz")
    again = uc.load(tmp_path / "policy.npz")
    states = drawn(SPACES["product"], 50, seed=9)
    assert again.space_ == SPACES["product"]
    assert_array_equal(again.predict(states), policy.predict(states))


def test_batches_and_streams_are_learnt_from_in_the_space():
    states, actions = _anything()
    policy = uc.LocallyLinearPolicy(3000.0, learner="direct", space=SPACES["product"])
    halves = [(states[:200], actions[:200]), (states[200:], actions[200:])]
    at = drawn(SPACES["product"], 50, seed=9)
    assert_allclose(policy.fit_batches(halves).predict(at), anything("local").predict(at), atol=1e-9)
    policy = uc.LocallyLinearPolicy(3000.0, learner="direct", space=SPACES["product"])
    for half in halves:
        policy.partial_fit(*half)
    assert policy.space_ == SPACES["product"]


def run(*arguments):
    result = CliRunner().invoke(cli.main, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def test_the_command_line_gives_a_policy_its_space(tmp_path):
    files = []
    for index, start in enumerate(Rotation.random(4, random_state=3)):
        body, handle = turning(start, "xyzw"), crank(STARTS[index])
        table = np.column_stack([body.times, np.sin(body.times), body.values, handle.values])
        files.append(tmp_path / f"{index}.csv")
        np.savetxt(files[-1], table, delimiter=",", header="t,x,qx,qy,qz,qw,crank", comments="")
    turning_columns = ("--quaternion", "qx,qy,qz,qw", "--angle", "crank")
    columns = ("--state", "x,qx,qy,qz,qw,crank", "--differentiate", *turning_columns)
    saved = tmp_path / "policy.npz"
    said = run("fit", *files, *columns, "--learner", "direct", "--variance", "9", "-o", saved)
    assert "qw, crank (an angle) (qx, qy, qz, qw are an orientation) as states" in said
    assert uc.load(saved).space_ == Euclidean() * Sphere("xyzw") * Circle()
    state = np.r_[0.0, turning(Rotation.random(random_state=3), "xyzw", flips=False).values[50], 3.0]
    start = (f"--start={','.join(map(str, state))}", "--least-support", "0")  # of another demonstration in each part
    path = run("rollout", saved, *start, "--steps", "20").splitlines()
    assert path[0] == "t,x,qx,qy,qz,qw,crank (rad),vx,wqx,wqy,wqz,vcrank (rad/s)"
    rows = np.array([list(map(float, line.split(","))) for line in path[1:]])
    assert (rows[:, 6] <= np.pi).all()
    assert rows[-1, 6] < 0.0
    assert_allclose(rows[:, 8:], np.tile([*TURN, 1.0], (20, 1)), atol=1e-3)
    assert "normalised inconsistency" in run("score", saved, files[0])
    run("export", saved, "-o", tmp_path / "policy.c")
    assert "policy_rotation" in (tmp_path / "policy.c").read_text()
    run("diagnose", *files, *columns, "-o", tmp_path / "page.html")

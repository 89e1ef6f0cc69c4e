"""Roll-outs of policies that give accelerations, against mechanics."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import unconstrain as uc
from unconstrain.base.errors import SettingError
from unconstrain.motion.obstacles import Ellipsoid, Wall

PLANE = uc.constraints.Plane([0.6, 0.8])
STIFF = np.array([[-4.0, 1.0], [0.5, -3.0]])


def damped(states):
    """A spring that is not isotropic, and friction."""
    return states[:, :2] @ STIFF.T - 0.3 * states[:, 2:]


def falls(states):
    return np.tile([0.0, -9.81], (len(states), 1))


def on_circle(positions, times):
    return positions[:, None, :]


def exactly(slope, start, times):
    return solve_ivp(slope, (0.0, times[-1]), start, rtol=1e-11, atol=1e-11, t_eval=times).y


def test_a_free_movement_is_that_of_the_equation():
    start = [1.0, -0.5, 0.0, 2.0]
    run = uc.rollout(damped, start, 101, 0.02, method="rk4", order=2)
    exact = solve_ivp(
        lambda t, x: [*x[2:], *damped(x[None])[0]], (0, 2), start, rtol=1e-11, atol=1e-11, t_eval=run.times
    )
    assert_allclose(run.states, exact.y.T, atol=1e-6)
    assert_allclose(run.actions, damped(run.states), atol=1e-12)


def test_euler_s_steps_are_the_plain_loop():
    run = uc.rollout(damped, [1.0, -0.5, 0.8, -0.6], 20, 0.05, PLANE, method="euler", order=2)
    q, v = np.array([1.0, -0.5]), np.array([0.8, -0.6])
    N = np.eye(2) - np.outer(PLANE.normal, PLANE.normal)
    for state, action, wanted in zip(run.states, run.actions, run.truth.policy, strict=True):
        assert_allclose(state, [*q, *v], atol=1e-12)
        pi = damped(np.concatenate([q, v])[None])[0]
        assert_allclose(wanted, pi, atol=1e-12)
        assert_allclose(action, N @ pi, atol=1e-12)
        q, v = q + 0.05 * v, v + 0.05 * N @ pi


def test_on_a_circle_a_weight_is_a_pendulum():
    angle = 0.4
    run = uc.rollout(falls, [np.sin(angle), -np.cos(angle), 0.0, 0.0], 301, 0.01, on_circle, method="rk4", order=2)
    exact = exactly(lambda t, x: [x[1], -9.81 * np.sin(x[0])], [angle, 0.0], run.times)
    assert_allclose(run.states[:, :2], np.column_stack([np.sin(exact[0]), -np.cos(exact[0])]), atol=1e-6)
    tension = np.vecdot(run.actions, run.states[:, :2])
    assert_allclose(tension, -(exact[1] ** 2), atol=1e-5)  # centripetal: what N π leaves out


def test_a_bead_on_a_rod_that_turns_is_thrown_outwards():
    omega = 1.5

    def across(positions, times):
        return np.stack([-np.sin(omega * times), np.cos(omega * times)], axis=1)[:, None, :]

    def carried(positions, times):
        out = np.stack([np.cos(omega * times), np.sin(omega * times)], axis=1)
        return omega * np.vecdot(positions, out)[:, None]

    run = uc.rollout(
        lambda x: 0.0 * x[:, :2], [0.1, 0.0, 0.0, 0.15], 101, 0.02, across, task=carried, method="rk4", order=2
    )
    assert_allclose(np.linalg.norm(run.states[:, :2], axis=1), 0.1 * np.cosh(omega * run.times), rtol=1e-5)


def test_what_a_constraint_does_not_allow_is_lost_as_in_an_impact():
    switching = uc.constraints.SwitchingLine([[0.0, 1.0], [1.0, 0.0]], [0.5])
    how = {"constraint": switching, "method": "euler", "order": 2}
    run = uc.rollout(lambda x: np.tile([1.0, 2.0], (len(x), 1)), [0.0, 0.0, 3.0, 4.0], 11, 0.1, **how)
    assert_allclose(run.states[0, 2:], [3.0, 0.0])  # a start across the constraint
    assert_allclose(run.states[:6, 1], 0.0, atol=1e-12)
    assert_allclose(run.states[5, 2:], 0.0, atol=1e-12)  # along the old one
    assert_allclose(run.states[5:, 3], 2.0 * (run.times[5:] - 0.5), atol=1e-12)


def test_an_orientation_turns_on():
    space = uc.spaces.Sphere() * uc.spaces.Euclidean(3)
    spin = np.array([0.3, -0.4, 1.2])
    run = uc.rollout(lambda x: 0.0 * x[:, 4:], [1.0, 0, 0, 0, *spin], 11, 0.1, order=2, space=space)
    angle = np.linalg.norm(spin)
    assert_allclose(run.states[-1, :4], [np.cos(angle / 2), *(np.sin(angle / 2) * spin / angle)], atol=1e-12)


def test_accelerations_are_learnt_from_under_planes_and_followed_under_others():
    rng = np.random.default_rng(1)
    planes = [uc.constraints.Plane(normal) for normal in rng.normal(size=(12, 2))]
    shown = uc.rollout(damped, rng.uniform(-1, 1, (12, 4)), 60, 0.05, planes, order=2)
    learnt = uc.ParametricPolicy(uc.Affine(), learner="inconsistency").fit_demonstrations(shown)
    other = [uc.rollout(policy, [0.5, -0.3, 0.0, 0.0], 60, 0.05, PLANE, order=2).states for policy in (damped, learnt)]
    assert_allclose(*other, atol=1e-6)


@pytest.mark.parametrize("method", ["euler", "rk4"])
def test_no_movement_enters_an_obstacle_or_leaves_its_plane(method):
    rng = np.random.default_rng(3)
    rocks = [Ellipsoid(centre, rng.uniform(0.3, 0.7, 3)) for centre in rng.uniform(-1, 1, (3, 3))]
    starts, goal, plane = (
        rng.uniform(-1.5, 1.5, (60, 6)),
        rng.uniform(-0.5, 0.5, 3),
        uc.constraints.Plane([0.5, -0.3, 1]),
    )
    starts = starts[np.all([rock(starts[:, :3])[0] > 0.0 for rock in rocks], axis=0)]

    def spring(states):
        return 9.0 * (goal - states[:, :3]) - states[:, 3:]

    def depths(runs):
        return np.array([min(rock(run.states[:, :3])[0].min() for rock in rocks) for run in runs])

    settings = {"steps": 100, "dt": 0.1, "constraint": plane, "method": method, "order": 2}
    runs = uc.rollout(spring, starts, obstacles=rocks, **settings)
    assert depths(runs).min() > -1e-12
    assert (depths(uc.rollout(spring, starts, **settings)) < 0.0).sum() > 5
    for run in runs:
        assert_allclose((run.states[:, :3] - run.states[0, :3]) @ plane.normal, 0.0, atol=1e-9)


def test_an_obstacle_takes_the_velocity_into_it_and_leaves_the_rest():
    table = Wall([0.0, 0.0], [0.0, 1.0], 0.1)
    start = [0.0, 1.0, 2.0, 0.0]
    run = uc.rollout(falls, start, 200, 0.01, order=2, obstacles=[table])
    assert_allclose(run.states[:, 0], 2.0 * run.times, atol=1e-9)
    assert_allclose(run.states[:45], uc.rollout(falls, start, 45, 0.01, order=2).states, atol=1e-12)
    assert 0.0 < run.states[-1, 1] < 0.01
    assert abs(run.states[-1, 3]) < 0.01


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"start": [0.0, 0.0, 0.0]}, "order: got 2 for states of 3 directions, expected positions and velocities"),
        ({"order": 3}, "order: got 3, expected one of 1, 2"),
        ({"order": 1}, r"got actions of shape \(1, 2\) for states of shape \(1, 4\); order=2 follows accelerations"),
    ],
)
def test_what_cannot_be_is_said(change, sentence):
    with pytest.raises(SettingError, match=sentence):
        uc.rollout(**{"policy": damped, "start": [1.0, 0.0, 0.0, 0.0], "steps": 3, "order": 2} | change)

"""Obstacles: no movement enters, none leaves its constraint, and where nothing is in the way nothing changes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import unconstrain as uc
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.motion.obstacles import Ellipsoid, Wall, avoided

UNIT = Ellipsoid([0.0, 0.0], 1.0)


def scene(seed):
    """Some obstacles, starts outside of all, a policy that goes to a goal, and a plane."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    obstacles = [
        Ellipsoid(rng.uniform(-1, 1, n), rng.uniform(0.1, 1.0, n), np.linalg.qr(rng.normal(size=(n, n)))[0])
        for _ in range(rng.integers(1, 4))
    ] + [Wall(rng.normal(size=n), rng.normal(size=n), rng.uniform(0.1, 1.0)) for _ in range(rng.integers(0, 2))]
    starts, goal, turn = rng.uniform(-2.5, 2.5, (20, n)), rng.uniform(-1, 1, n), rng.normal(size=(n, n))
    starts = starts[np.all([obstacle(starts)[0] > 0.0 for obstacle in obstacles], axis=0)]
    plane = uc.constraints.Plane(rng.normal(size=n)) if rng.random() < 0.7 else None
    return obstacles, starts, lambda states: (states - goal) @ (turn - turn.T - np.eye(n)).T, plane


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32), st.floats(-3.0, -0.5), st.sampled_from(["euler", "rk4"]))
def test_no_movement_enters_an_obstacle_or_leaves_its_plane(seed, power, method):
    obstacles, starts, policy, plane = scene(seed)
    if not len(starts):
        return
    runs = np.stack(
        [run.states for run in uc.rollout(policy, starts, 40, 10.0**power, plane, obstacles=obstacles, method=method)]
    )
    size = max(1.0, np.abs(runs).max())
    for share in np.linspace(0.0, 1.0, 4):  # between the samples, too
        between = ((1.0 - share) * runs[:, :-1] + share * runs[:, 1:]).reshape(-1, runs.shape[2])
        assert all(obstacle(between)[0].min() >= -1e-9 * size for obstacle in obstacles)
    if plane is not None:
        assert np.abs((runs - runs[:, :1]) @ plane.normal).max() <= 1e-9 * size


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32))
def test_values_are_convex_and_gradients_are_their_slopes(seed):
    obstacles, starts, *_ = scene(seed)
    others, h = np.roll(starts, 1, axis=0), 1e-6
    for obstacle in obstacles:
        value, slope = obstacle(starts)
        assert (obstacle(others)[0] >= value + np.vecdot(slope, others - starts) - 1e-9).all()
        for axis, unit in enumerate(np.eye(starts.shape[1])):
            steep = (obstacle(starts + h * unit)[0] - obstacle(starts - h * unit)[0]) / (2.0 * h)
            assert_allclose(slope[:, axis], steep, atol=1e-6)


def test_velocities_are_those_of_the_modulation_matrix():
    # Khansari-Zadeh and Billard: M = E D E^-1, with Γ = ‖x‖² of the unit circle, where the obstacle is approached.
    state, wanted = np.array([1.2, -0.9]), np.array([-1.0, 0.3])
    normal, gamma = state / 1.5, 1.5**2
    E = np.column_stack([normal, [-normal[1], normal[0]]])
    D = np.diag([1.0 - 1.0 / gamma, 1.0 + 1.0 / gamma])
    assert_allclose(avoided([UNIT], state[None], wanted[None])[0], E @ D @ np.linalg.inv(E) @ wanted)
    away = avoided([UNIT], state[None], -wanted[None])[0]
    assert_allclose(away @ normal, -wanted @ normal)  # what leads away is not held back


def test_on_the_surface_nothing_leads_in_and_what_is_done_is_in_the_null_space():
    rng = np.random.default_rng(0)
    ball, normals = Ellipsoid(np.zeros(3), 1.0), rng.normal(size=(200, 1, 3))
    states = rng.normal(size=(200, 3))
    states /= np.linalg.norm(states, axis=1, keepdims=True)
    projections = uc.null_space_projection(normals)
    wanted = uc.project(projections, rng.normal(size=(200, 3)))
    done = avoided([ball], states, wanted, projections)
    assert (np.vecdot(done, states) >= -1e-12).all()
    assert_allclose(np.vecdot(done, normals[:, 0]), 0.0, atol=1e-12)


def test_a_step_asks_each_obstacle_once():
    asked = []

    def rock(states):
        asked.append(len(states))
        return UNIT(states)

    uc.rollout(np.negative, [[3.0, 1.0], [2.0, -2.0]], 20, 0.05, obstacles=[rock], method="euler")
    assert asked == [2] * 20


def test_far_from_all_obstacles_nothing_changes():
    far, wanted = np.array([[1e6, 0.0]]), np.array([[-1.0, 1.0]])
    assert_allclose(avoided([UNIT, Ellipsoid([0.0, 3.0], 0.5)], far, wanted), wanted, rtol=1e-9)


def test_a_guided_policy_gets_by_and_arrives():
    shown = uc.rollout(lambda x: -x, [[2.0, 0.3], [2.0, -0.3]], 200, 0.05)
    guided = uc.Guided(lambda x: -x, goal=[0.0, 0.0], demonstrations=shown)
    rock = Ellipsoid([1.0, 0.0], 0.4)
    by, against = uc.rollout(guided, [[2.0, 0.1], [2.0, 0.0]], 1000, 0.02, obstacles=[rock])
    assert rock(by.states)[0].min() >= -1e-12
    assert_allclose(by.states[-1], 0.0, atol=1e-3)
    assert_allclose(against.states[-1], [1.4, 0.0], atol=1e-3)  # straight at it nothing turns


@pytest.mark.parametrize(
    ("make", "error", "sentence"),
    [
        (lambda: Ellipsoid([0.0, 0.0], 0.0), SettingError, "radii: got 0.0, expected a number above 0"),
        (lambda: Ellipsoid([0.0, 0.0], [1.0, 1.0, 1.0]), InvalidDataError, "radii: got 3 values, expected 2"),
        (lambda: Ellipsoid([0.0, 0.0], 1.0, [[1.0, 1.0], [0.0, 1.0]]), SettingError, "axes: got .* at right angles"),
        (lambda: Wall([0.0, 0.0], [0.0, 0.0], 1.0), SettingError, "normal: got zeros"),
        (lambda: Wall([0.0], [1.0], 0.0), SettingError, "reach: got 0.0, expected a number above 0"),
        (
            lambda: uc.rollout(np.negative, [0.5, 0.0], obstacles=[UNIT]),
            InvalidDataError,
            "start: is inside obstacle 1 of",
        ),
        (
            lambda: uc.rollout(np.negative, [5.0], obstacles=[UNIT]),
            SettingError,
            "a place of 2 numbers for states of 1",
        ),
        (
            lambda: uc.rollout(np.negative, [1.0, 2.0], space=uc.spaces.Circle(), obstacles=[UNIT]),
            SettingError,
            "obstacles: states hold angles",
        ),
    ],
)
def test_what_is_no_obstacle_is_said(make, error, sentence):
    with pytest.raises(error, match=sentence):
        make()

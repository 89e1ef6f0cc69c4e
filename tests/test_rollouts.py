"""Following a policy under constraints."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from samples import draw
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.constraints.known import Plane, SwitchingLine
from unconstrain.paper.systems.limit_cycle import LimitCycle


def decay(states):
    return -states


def test_a_free_movement_by_euler_s_steps():
    demo = uc.rollout(decay, [1.0, -2.0], steps=50, dt=0.1, method="euler")
    assert_allclose(demo.states, np.array([1.0, -2.0]) * 0.9 ** np.arange(50)[:, None])
    assert_array_equal(demo.actions, -demo.states)
    assert_allclose(demo.times, 0.1 * np.arange(50))
    assert_array_equal(demo.truth.policy, demo.actions)
    assert_array_equal(demo.truth.projections, np.tile(np.eye(2), (50, 1, 1)))
    assert demo.name == "rollout"


def test_circles_keep_their_size_by_default():
    def circling(states):
        return states[:, ::-1] * [-1.0, 1.0]

    own, euler_s = (uc.rollout(circling, [1.0, 0.0], 200, 0.1, **how) for how in ({}, {"method": "euler"}))
    assert_allclose(np.linalg.norm(own.states[-1]), 1.0, atol=1e-3)
    assert np.linalg.norm(euler_s.states[-1]) > 2.0


def test_a_constrained_movement_is_the_plain_loop():
    policy, line = LimitCycle(), SwitchingLine([[1.0, 0.3], [-0.2, 1.0]], [0.2])
    demo = uc.rollout(policy, [0.5, 0.1], steps=30, dt=0.02, constraint=line, method="euler")
    x = np.array([0.5, 0.1])
    for k in range(30):
        A = np.array([[1.0, 0.3]]) if k < 10 else np.array([[-0.2, 1.0]])
        N = np.eye(2) - np.linalg.pinv(A) @ A
        assert_allclose(demo.states[k], x, atol=1e-12)
        assert_allclose(demo.truth.projections[k], N, atol=1e-12)
        assert_allclose(demo.actions[k], N @ policy(x[None])[0], atol=1e-12)
        x = x + 0.02 * demo.actions[k]


def test_a_constrained_movement_stays_on_its_plane():
    normal = np.array([1.0, 2.0, 2.0]) / 3
    demo = uc.rollout(lambda x: np.sin(5 * x) - x, [0.3, -0.2, 0.4], 100, 0.05, Plane(normal))
    assert_allclose(demo.states @ normal, demo.states[0] @ normal, atol=1e-12)


def test_several_starts_run_side_by_side():
    starts = np.array([[1.0, 0.0], [0.0, 1.0], [0.3, 0.3]])
    many = uc.rollout(LimitCycle(), starts, 20, constraint=Plane([1.0, 1.0]), name="toy")
    assert [demo.name for demo in many] == ["toy 1", "toy 2", "toy 3"]
    for start, demo in zip(starts, many, strict=True):
        alone = uc.rollout(LimitCycle(), start, 20, constraint=Plane([1.0, 1.0]))
        assert_allclose(demo.states, alone.states)
        assert_allclose(demo.actions, alone.actions)


def test_each_start_may_have_its_own_constraint():
    planes = [Plane([1.0, 0.0]), Plane([0.0, 1.0])]
    first, second = uc.rollout(LimitCycle(), [[1.0, 0.5], [0.5, 1.0]], 5, constraint=planes)
    assert_allclose(first.actions[:, 0], 0, atol=1e-15)
    assert_allclose(second.actions[:, 1], 0, atol=1e-15)


def test_a_learnt_policy_can_be_followed():
    data = draw(policy=LimitCycle(), samples=200)
    policy = uc.ParametricPolicy().fit(data.states, data.actions)
    true, learnt = (uc.rollout(p, [0.5, 0.0], 50) for p in (LimitCycle(), policy))
    assert_allclose(learnt.states, true.states, atol=0.1)


def test_the_start_is_not_touched():
    start = np.ones((2, 2))
    uc.rollout(decay, start, 3)
    assert_array_equal(start, np.ones((2, 2)))


@pytest.mark.parametrize(
    ("change", "error", "sentence"),
    [
        ({"steps": 0}, SettingError, "steps: got 0, expected a whole number of at least 1"),
        ({"steps": 2.5}, SettingError, "steps: got 2.5, expected a whole number of at least 1"),
        ({"dt": 0.0}, SettingError, "dt: got 0.0, expected a number above 0.0"),
        ({"start": [[1.0, 2.0], [1.0]]}, InvalidDataError, "start: the rows have different lengths"),
        ({"start": [np.nan, 1.0]}, InvalidDataError, "start: found nan at row 0"),
        ({"start": ["here", "there"]}, InvalidDataError, "start: got values that are not numbers"),
        (
            {"policy": lambda x: x[:, :1]},
            SettingError,
            r"policy: got actions of shape \(1, 1\) for states of shape \(1, 2\)",
        ),
        (
            {"constraint": [Plane([1.0, 0.0])] * 2},
            SettingError,
            "constraint: got 2 constraints for 1 starts, expected one for each",
        ),
        (
            {"constraint": Plane([1.0, 0.0, 0.0])},
            SettingError,
            r"constraint: got A of shape \(1, 1, 3\) for 1 states, expected \(1, k, 2\)",
        ),
        (
            {"constraint": lambda x, t: np.ones(2)},
            SettingError,
            r"constraint: got A of shape \(2,\) for 1 states, expected \(1, k, 2\)",
        ),
        ({"constraint": lambda x, t: np.full((1, 1, 2), np.nan)}, InvalidDataError, "constraint matrix: found NaN"),
        ({"policy": lambda x: np.full(x.shape, np.nan)}, InvalidDataError, "left the finite numbers at step 0"),
        ({"policy": lambda x: 1e10 * x}, InvalidDataError, "left the finite numbers at step 1: start nearer"),
        ({"policy": lambda x: np.full(x.shape, 1e308)}, InvalidDataError, "left the finite numbers at step 0"),
    ],
)
def test_what_cannot_be_followed_is_said_in_a_sentence(change, error, sentence):
    with pytest.raises(error, match=sentence):
        uc.rollout(**({"policy": decay, "start": [1.0, 2.0], "steps": 10, "dt": 1.0} | change))


TURN = np.array([[-0.1, -2.0], [2.0, -0.1]])


def test_better_steps_come_nearer_to_the_exact_movement():
    from scipy.linalg import expm

    exact = expm(TURN * 10.0) @ [1.0, 0.5]
    errors = {
        (method, dt): np.linalg.norm(
            uc.rollout(lambda x: x @ TURN.T, [1.0, 0.5], round(10 / dt) + 1, dt, method=method).states[-1] - exact
        )
        for method in ("euler", "rk4", "adaptive")
        for dt in (0.1, 0.05)
    }
    assert 10 < errors["rk4", 0.1] / errors["rk4", 0.05] < 20  # of fourth order: 16
    assert errors["rk4", 0.1] < 1e-2 * errors["euler", 0.1]
    assert errors["adaptive", 0.1] < 1e-5


def test_adaptive_steps_get_over_what_is_too_fast_for_others():
    stiff = uc.rollout(lambda x: -200.0 * x, [1.0], 4, 0.05, method="adaptive")
    assert np.abs(stiff.states[-1]) < 1e-6


def test_better_steps_stay_on_the_constraint_and_keep_its_truth():
    line = uc.constraints.Plane([0.6, 0.8])
    run = uc.rollout(lambda x: x @ TURN.T, [1.0, 0.5], 50, 0.05, line, method="rk4")
    assert_allclose(run.states @ [0.6, 0.8], 1.0, atol=1e-12)
    assert_allclose(run.truth.policy, run.states @ TURN.T)


def test_a_method_that_is_none_is_refused():
    with pytest.raises(SettingError, match="method: got 'heun', expected one of euler, rk4, adaptive"):
        uc.rollout(lambda x: -x, [1.0], method="heun")


# Where support ends


def leaves(states):
    """Outwards, at one unit per second."""
    return states / np.maximum(np.linalg.norm(states, axis=1, keepdims=True), 1e-9)


def local():
    """A policy that was learnt within a distance of one from the origin."""
    states = np.random.default_rng(0).uniform(-0.7, 0.7, (300, 2))
    return uc.LocallyLinearPolicy(variance=0.05, learner="direct").fit(states, leaves(states))


def test_a_movement_stops_where_nothing_was_demonstrated_and_says_when_where_and_why():
    policy = local()
    with pytest.warns(UserWarning, match=r"rollout stops after .* s at \(.*support below 0.001.*least_support=0"):
        run = uc.rollout(policy, [0.3, 0.1], 400, 0.02)
    whole = uc.rollout(policy, [0.3, 0.1], 400, 0.02, least_support=0.0)
    far = policy.support(whole.states) < 1e-3
    assert len(run) == far.argmax() > 0
    assert_array_equal(run.states, whole.states[: len(run)])
    assert_array_equal(run.actions, whole.actions[: len(run)])
    assert len(whole) == 400


def test_each_run_stops_for_itself():
    def turns(states):
        return np.where(states[:, :1] > 0.0, leaves(states), -states)

    policy = local()
    policy.predict, starts = turns, np.array([[0.2, 0.0], [-0.5, 0.1], [0.5, 0.5], [-0.1, 0.0]])
    with pytest.warns(UserWarning, match="2 of 4 roll-outs stop, the first, rollout 3, after"):
        runs = uc.rollout(policy, starts, 300, 0.02)
    assert len(runs[2]) < len(runs[0]) < 300 == len(runs[1]) == len(runs[3])
    for run, start in zip(runs[1::2], starts[1::2], strict=True):
        assert_allclose(run.states, uc.rollout(policy, start, 300, 0.02).states, atol=1e-12)


def test_a_start_far_from_the_data_is_followed_and_may_come_near():
    policy = local()
    policy.predict = lambda states: -states
    assert policy.support(np.array([[3.0, 0.0]])) < 1e-3
    with pytest.warns(uc.errors.SupportEndsWarning, match=r"nothing was demonstrated near \(3, 0\)"):
        assert len(uc.rollout(policy, [3.0, 0.0], 300, 0.02)) == 300


@pytest.mark.parametrize("features", [uc.Affine(), uc.Polynomial(3)])
def test_what_has_no_support_is_followed_until_it_diverges_which_is_no_bad_row_of_features(features):
    states = np.random.default_rng(0).uniform(-1, 1, (200, 2))
    policy = uc.ParametricPolicy(features, learner="direct").fit(states, 5.0 * states + states**3)
    with pytest.raises(uc.errors.DivergedError, match=r"after .* s, at \(.*\), the movement left the finite") as caught:
        uc.rollout(policy, [0.5, 0.5], 400, 0.1, method="rk4")
    part = caught.value.part
    assert 1 < len(part) < 400
    assert_array_equal(part.states, uc.rollout(policy, [0.5, 0.5], len(part), 0.1, method="rk4").states)

"""A cycle that attracts, on every plane through its inside, at the pace that was shown."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import unconstrain as uc
from unconstrain.base.errors import SettingError
from unconstrain.constraints.known import Plane
from unconstrain.motion.orbit import Orbit
from unconstrain.paper.experiments.arrival.cycles import measured

MIDDLE = np.array([0.2, -0.1, 0.3])
RATE = 2.0
TILTS = [[0.0, 0.0, 1.0], [0.3, 0.0, 1.0], [0.0, 0.3, 1.0], [-0.3, 0.0, 1.0], [0.0, -0.3, 1.0]]


def turning(states, attraction):
    x, y, z = (states - MIDDLE).T
    inward = attraction * (1.0 - np.hypot(x, y) / 0.5)
    return np.column_stack([inward * x - RATE * y, inward * y + RATE * x, -z])


def steady(states):
    """Round and round, and slowly outwards: what a learner makes of steady cycles."""
    return turning(states, 0.0) + 0.1 * (states - MIDDLE)


def circle(tilt):
    axes = np.linalg.svd(np.array([tilt]))[2][1:]
    return MIDDLE + 0.5 * axes[0]


SHOWN = uc.rollout(
    lambda states: turning(states, 2.0), [circle(t) for t in TILTS], 200, 0.05, [Plane(t) for t in TILTS], method="rk4"
)
RNG = np.random.default_rng(0)
NORMALS = RNG.standard_normal((100, 3)) * [0.3, 0.3, 0.0] + [0.0, 0.0, 1.0]
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
STARTS = RNG.uniform(-1.5, 1.5, (100, 3))
STARTS += MIDDLE - NORMALS * (np.vecdot(NORMALS, STARTS) - RNG.uniform(-0.05, 0.05, 100))[:, None]
"""On planes that pass the middle nearby."""


@pytest.fixture(scope="module")
def guided():
    return uc.Guided(steady, demonstrations=SHOWN)


def off(guided, states):
    return guided.potential_(states) - 0.5 * guided.aim_.radius**2


def test_cycles_are_found_where_demonstrations_repeat(guided):
    assert_allclose(guided.goal_, MIDDLE, atol=0.02)
    on = uc.stack(SHOWN).states
    assert np.abs(off(guided, on)).max() < 0.1 * 0.5 * guided.aim_.radius**2
    assert_allclose(guided.aim_.radius, 0.5, rtol=0.05)
    given = uc.Guided(steady, orbit=on)
    assert_array_equal(given.potential_(STARTS), guided.potential_(STARTS))


def test_under_any_plane_the_cycle_comes_nearer_at_every_step_from_both_sides(guided):
    runs = uc.rollout(guided, STARTS, 200, 0.08, lambda states, _: NORMALS[: len(states), None], method="rk4")
    begun = [off(guided, run.states[:1])[0] for run in runs]
    assert min(begun) < 0 < max(begun)
    for run in runs:
        far = np.abs(off(guided, run.states)) / guided.aim_.radius**2
        assert (np.diff(far)[far[:-1] > 5e-3] < 0).all()
        assert far[-1] < 5e-3


def test_radius_and_pace_stay_for_a_hundred_turns_where_the_policy_alone_leaves(guided):
    plane, start, normal = Plane(TILTS[1]), circle(TILTS[1]), np.array(TILTS[1])
    steps = int(105 * 2 * np.pi / RATE / 0.2)
    run = uc.rollout(guided, start, steps, 0.2, plane, method="rk4")
    whole, last, shown = (measured(each, normal, 0.2) for each in (run.states, run.states[-150:], SHOWN[1].states[::4]))
    assert whole["turns"] >= 100
    assert abs(last["radius"] / shown["radius"] - 1) < 0.03
    assert abs(last["pace"] / shown["pace"] - 1) < 0.03
    assert whole["drift"] < 0.002
    alone = uc.rollout(steady, start, 400, 0.2, plane, method="rk4")
    assert np.linalg.norm(alone.states[-1] - MIDDLE) > 5.0


def test_a_policy_that_stands_still_or_turns_back_is_turned_round():
    for policy in (lambda states: 0.0 * states, lambda states: -turning(states, 1.0)):
        guided = uc.Guided(policy, demonstrations=SHOWN)
        velocities = guided(SHOWN[0].states)
        along = np.vecdot(velocities, SHOWN[0].actions) / (SHOWN[0].actions ** 2).sum(axis=1)
        assert along.min() > 0.7


def test_strokes_that_go_round_have_a_goal_only_where_most_of_them_come_to_rest():
    def stopped(demo):
        slower = np.minimum(1.0, np.arange(len(demo))[::-1] / (len(demo) // 10))[:, None]
        return uc.Demonstration(demo.states, slower * demo.actions, demo.times)

    halves = [stopped(SHOWN[0]), stopped(SHOWN[0]), SHOWN[0], SHOWN[0]]
    assert isinstance(uc.Guided(steady, demonstrations=halves).aim_, Orbit)
    most = [*halves[:3], stopped(SHOWN[0])]
    with pytest.warns(UserWarning, match="at rest the policy goes on, at .* of its fastest: something"):
        guided = uc.Guided(steady, demonstrations=most)
    assert_allclose(guided.goal_, SHOWN[0].states[-1], atol=1e-9)


def test_where_a_plane_misses_the_cycle_the_nearest_place_is_reached(guided):
    run = uc.rollout(guided, MIDDLE + np.array([0.4, 0.0, 3.0]), 300, 0.1, Plane([0.0, 0.0, 1.0]), method="rk4")
    assert off(guided, run.states[-1:]) > 0
    assert np.linalg.norm(run.actions[-1]) < 1e-3 * np.linalg.norm(run.actions[0])
    assert np.linalg.norm(guided.potential_.gradient(run.states[-1:])[0, :2]) < 1e-3


def test_it_is_continuous_also_at_its_middle(guided):
    along = np.linspace(-1, 1, 20001)[:, None] * [1.0, 0.3, 0.0] + guided.goal_
    velocities = guided(along)
    assert np.abs(np.diff(velocities, axis=0)).max() < 0.02 * np.abs(velocities).max()


def test_a_step_is_the_prediction(guided):
    for state, velocity in zip(STARTS, guided(STARTS), strict=True):
        assert_allclose(guided.step(state), velocity, rtol=1e-9, atol=1e-12)


def test_units_do_not_matter(guided):
    scaled = [uc.Demonstration(1024.0 * d.states, 16.0 * d.actions, 64.0 * d.times) for d in SHOWN]
    other = uc.Guided(lambda x: 16.0 * steady(x / 1024.0), demonstrations=scaled)
    assert_allclose(other(1024.0 * STARTS), 16.0 * guided(STARTS), rtol=1e-9, atol=1e-9)


def test_it_survives_its_file(tmp_path):
    policy = uc.LocallyLinearPolicy(None, learner="direct").fit_demonstrations(SHOWN)
    guided = uc.Guided(policy, orbit="shown", demonstrations=SHOWN).moved([1.0, 0.0, 0.0])
    uc.save(guided, tmp_path / "guided.npz")
    assert_array_equal(uc.load(tmp_path / "guided.npz", uc.Guided)(STARTS), guided(STARTS))


def test_a_goal_and_a_cycle_are_two_things():
    with pytest.raises(SettingError, match="orbit: got one beside a goal"):
        uc.Guided(steady, goal=MIDDLE, orbit="shown", demonstrations=SHOWN)


def test_turns_take_as_long_as_those_shown_however_slow_the_policy_and_uneven_the_turns():
    rng = np.random.default_rng(1)
    times, tilted = 0.05 * np.arange(400), np.linalg.svd([[0.3, 0.0, 1.0]])[2][1:]
    angle = 2.0 * times + 0.3 * np.sin(2.0 * times)
    radius = 0.5 + 0.04 * np.sin(0.9 * times)  # people do not repeat themselves
    flat = radius[:, None] * np.column_stack([np.cos(angle), 0.8 * np.sin(angle)])
    velocities = np.gradient(flat, times, axis=0) + 0.15 * rng.standard_normal(flat.shape)
    shown = uc.Demonstration(flat @ tilted, velocities @ tilted, times)
    for share in (0.7, 1.3):
        guided = uc.Guided(lambda x, share=share: share * steady(x + MIDDLE), demonstrations=shown)
        run = uc.rollout(guided, shown.states[0], 250, 0.1, Plane([0.3, 0.0, 1.0]), method="rk4")
        both = (measured(each.states, np.array([0.3, 0.0, 1.0]), each.times[1]) for each in (run, shown))
        found, asked = (each["pace"] for each in both)
        assert abs(found / asked - 1) < 0.035


def wiped(scatter):
    """Ovals whose size varies by so much, at an even angle in time."""
    times = 0.05 * np.arange(600)
    size = 0.5 * (1.0 + scatter * np.sin(0.37 * times))
    flat = size[:, None] * np.column_stack([np.cos(2.0 * times), 0.7 * np.sin(2.0 * times)])
    return uc.Demonstration(flat, np.gradient(flat, times, axis=0), times)


def oval(narrower):
    """Round on ovals for ever, as wiped, or on narrower ones."""
    return lambda states: 2.0 * states[:, ::-1] * [-narrower / 0.7, 0.7 / narrower]


def parts(guided, states):
    """Shares of the motion that are correction, across the surface and along it."""
    slope, added = guided.potential_.gradient(states), guided.correction(states)
    across = np.vecdot(slope, added) / np.linalg.norm(slope, axis=1)
    along = np.sqrt(np.maximum((added**2).sum(axis=1) - across**2, 0.0))
    moved = np.linalg.norm(guided.policy(states), axis=1).sum()
    return np.abs(across).sum() / moved, along.sum() / moved


def test_within_the_scatter_of_what_was_shown_the_cycle_is_the_one_that_the_policy_keeps_to():
    for narrower in (1.0, 1.2, 1.4):
        shown = wiped(0.15)
        guided = uc.Guided(oval(narrower), orbit="shown", demonstrations=shown)
        across, along = parts(guided, shown.states)
        assert across < 0.04
        assert along < 0.01
        assert abs(np.sqrt(2.0 * guided.potential_(shown.states)).mean() / guided.aim_.radius - 1.0) < 0.01


def test_where_what_was_shown_does_not_scatter_the_cycle_is_that_whatever_the_policy():
    shown = wiped(0.0)
    for policy in (oval(1.4), lambda states: states + np.array([1.0, 0.0])):
        guided = uc.Guided(policy, orbit="shown", demonstrations=shown)
        assert np.abs(off(guided, shown.states)).max() < 0.01 * 0.5 * guided.aim_.radius**2


def test_what_keeps_to_the_cycle_as_shown_is_not_corrected_and_what_leaves_it_is():
    shown = wiped(0.0)
    for leaving, least, most in ((0.0, 0.0, 0.001), (0.1, 0.04, 0.1)):
        guided = uc.Guided(
            lambda states, leaving=leaving: oval(1.0)(states) + leaving * states, orbit="shown", demonstrations=shown
        )
        assert least <= sum(parts(guided, shown.states)) <= most


def test_a_pace_near_the_one_shown_is_left_and_one_that_is_far_from_it_is_not():
    shown, plane = wiped(0.0), np.eye(2)
    for share in (0.7, 0.99, 1.01, 1.3):
        guided = uc.Guided(lambda states, share=share: share * oval(1.0)(states), orbit="shown", demonstrations=shown)
        assert abs(guided.aim_.turning(guided.policy, plane) / 2.0 - 1.0) < 0.025
        assert (parts(guided, shown.states)[1] < 1e-6) == (abs(share - 1.0) < 0.02)


def test_v_comes_nearer_for_any_policy_on_any_plane_also_where_what_was_shown_scatters():
    rng = np.random.default_rng(2)
    scattered = [uc.Demonstration(d.states + 0.05 * rng.standard_normal(d.states.shape), d.actions) for d in SHOWN]
    for policy in (steady, lambda states: rng.standard_normal(states.shape)):
        guided = uc.Guided(policy, orbit="shown", demonstrations=scattered)
        assert uc.certify(guided, uc.stack(scattered).states).holds
        held = np.eye(3) - NORMALS[:, :, None] * NORMALS[:, None]
        moved = uc.project(held, guided.under(STARTS, held))
        nearer = off(guided, STARTS) * np.vecdot(guided.potential_.gradient(STARTS), moved)
        assert (nearer < 0.0).all()


@pytest.mark.parametrize(("step", "delay", "most"), [(1.0, 0, 0.03), (1 / 3, 1, 0.03), (0.2, 2, 0.03), (5.0, 0, 0.15)])
def test_by_steps_and_delays_the_cycle_is_wider_by_as_much_as_told(guided, step, delay, most):
    dt = step * guided.dt_
    x, waiting = circle(TILTS[0]).copy(), [np.zeros(3)] * delay
    heights = []
    for _ in range(int(6 * np.pi / RATE / dt)):
        waiting.append(guided.step(x))
        x = x + dt * waiting.pop(0)
        heights.append(guided.potential_(x[None])[0])
    wider = np.sqrt(2.0 * np.mean(heights[len(heights) // 2 :])) / guided.aim_.radius - 1.0
    assert most / 3 < wider < most


def test_held_by_a_plane_that_step_is_not_told_of_a_movement_ends_elsewhere_than_with_under():
    def down(states):
        return -states * [4.0, 1.0]

    guided = uc.Guided(down, goal=[0.0, 0.0], demonstrations=uc.rollout(down, np.eye(2), 60, 0.05))
    held, ends = uc.null_space_projection(np.array([[1.0, 1.0]])), []
    for told in (False, True):
        x = np.array([1.0, 0.5])
        for _ in range(4000):
            x = x + 0.5 * guided.dt_ * held @ (guided.under([x], held[None])[0] if told else guided.step(x))
        ends.append(x)
    assert_allclose(held @ guided.potential_.gradient(np.array([ends[1]]))[0], 0.0, atol=1e-6)
    assert np.diff(guided.potential_(np.array(ends)))[0] < -0.01 * guided.potential_(np.array(ends))[0]

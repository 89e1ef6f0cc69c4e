"""Simulated demonstrators with a known policy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from unconstrain import rollout
from unconstrain.paper.systems.arm import JointLimitAvoidance
from unconstrain.paper.systems.limit_cycle import LimitCycle
from unconstrain.paper.systems.wiping import HELD_OUT, PLATES, Plate, Strokes, WipingPolicy, demonstrate


def test_the_limit_cycle_is_the_paper_s_in_polar_coordinates():
    rng = np.random.default_rng(0)
    r, theta = rng.uniform(0.1, 1, 20), rng.uniform(-np.pi, np.pi, 20)
    states = np.column_stack([r * np.sin(theta), r * np.cos(theta)])
    r_dot, theta_dot = r * (0.5 - r**2), 1.0
    expected = np.column_stack(
        [
            r_dot * np.sin(theta) + r * np.cos(theta) * theta_dot,
            r_dot * np.cos(theta) - r * np.sin(theta) * theta_dot,
        ]
    )
    assert_allclose(LimitCycle()(states), expected, atol=1e-12)


@pytest.mark.parametrize("rho", [0.25, 0.5])
def test_all_movements_end_on_the_cycle_of_radius_root_rho(rho):
    demos = rollout(LimitCycle(rho=rho), [[0.01, 0.0], [1.0, 1.0]], 3000, 0.01)
    assert_allclose([np.linalg.norm(d.states[-1]) for d in demos], np.sqrt(rho), rtol=0.02)


def test_the_cycle_s_centre_is_at_rest():
    assert_array_equal(LimitCycle()(np.zeros((1, 2))), [[0.0, 0.0]])


def test_wiping_keeps_its_circle_and_turns_at_its_frequency():
    wipe = WipingPolicy(radius=0.2, frequency=0.5)
    angle = np.linspace(0, 2 * np.pi, 9)
    on = np.column_stack([0.2 * np.cos(angle), 0.2 * np.sin(angle), 0 * angle])
    along = np.column_stack([-np.sin(angle), np.cos(angle)])
    assert_allclose(wipe(on)[:, :2], 0.2 * 2 * np.pi * 0.5 * along, atol=1e-12)
    assert_allclose((wipe(0.5 * on)[:, :2] * on[:, :2]).sum(axis=1) > 0, True)
    assert_allclose((wipe(2 * on)[:, :2] * on[:, :2]).sum(axis=1) < 0, True)


def test_wiping_presses_down_and_returns_to_its_height():
    wipe = WipingPolicy(press=0.05, grip=2.0)
    assert wipe(np.zeros((1, 3)))[0, 2] == pytest.approx(-0.05)
    assert wipe(np.array([[0.0, 0.0, -0.1]]))[0, 2] == pytest.approx(0.2 - 0.05)


@pytest.mark.parametrize("plate", PLATES, ids=lambda plate: plate.name)
def test_a_plate_is_turned_about_x_and_then_about_y(plate):
    expected = Rotation.from_euler("xy", [plate.tilt_x, plate.tilt_y], degrees=True).as_matrix()
    assert_allclose(plate.rotation, expected, atol=1e-12)
    assert_allclose(plate.constraint.normal, expected[:, 2], atol=1e-12)


def test_plates_are_the_seven_of_the_paper():
    assert [plate.name for plate in PLATES[:2]] == ["flat", "+16° about x"]
    assert [(plate.tilt_x, plate.tilt_y) for plate in HELD_OUT] == [(0, 16), (0, -16)]
    assert Plate(1, 2).name == "+1° about x, +2° about y"


def test_a_demonstration_stays_on_its_plate_and_says_what_was_true():
    plate = Plate(16, 0)
    demo = demonstrate(
        plate,
        np.random.default_rng(0),
        strokes=Strokes(count=2, duration=4.0, noise=0.0, unsteadiness=0.0, dropped=0.0),
    )
    normal = plate.rotation[:, 2]
    assert_allclose(demo.states @ normal, 0, atol=1e-9)
    assert_allclose(demo.actions @ normal, 0, atol=1e-9)
    assert_allclose(demo.truth.policy, WipingPolicy()(demo.states))
    assert_allclose(demo.truth.projections[0], np.eye(3) - np.outer(normal, normal), atol=1e-12)
    assert demo.name == "+16° about x"
    assert_allclose(np.diff(demo.times), 0.05)
    # What was seen is what was wanted, as far as the plate lets it and the hand is steady.
    wanted = np.einsum("tij,tj->ti", demo.truth.projections, demo.truth.policy)
    assert np.sqrt(((demo.actions - wanted) ** 2).mean()) < 0.1 * np.sqrt((wanted**2).mean())


def test_a_seed_draws_the_same_demonstration_again():
    one, same, other = (
        demonstrate(PLATES[1], np.random.default_rng(s), strokes=Strokes(count=1, duration=2.0)) for s in (1, 1, 2)
    )
    assert_array_equal(one.states, same.states)
    assert np.abs(one.states - other.states[: len(one)]).max() > 0.01


def test_joint_limits_are_avoided_down_the_paper_s_potential():
    x, h = np.array([[-1.0, 0.3, 0.0, 2.0]]), 1e-6
    for j in range(4):
        step = h * np.eye(4)[j]
        slope = ((np.abs(x + step) ** 1.8).sum() - (np.abs(x - step) ** 1.8).sum()) / (2 * h)
        assert JointLimitAvoidance(gain=0.05, power=1.8)(x)[0, j] == pytest.approx(-0.05 * slope, abs=1e-6)

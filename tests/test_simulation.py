"""Wiping with contact: the scene is the arm's, the hand slides, the arm follows, and pictures show it."""

import io
import sys

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from unconstrain.base.errors import InvalidDataError, MissingExtraError, SettingError, UnconstrainError
from unconstrain.paper import simulation
from unconstrain.paper.figures import arms, plates
from unconstrain.paper.simulation import control, engine, pictures, postures, reproduction
from unconstrain.paper.simulation.postures import READY, postures_along
from unconstrain.paper.simulation.reproduction import centres
from unconstrain.paper.simulation.scene import LINK_MASSES, TOOL, arm_scene
from unconstrain.paper.systems.arm import LWR3
from unconstrain.paper.systems.wiping import HELD_OUT, PLATES, Plate, Strokes, WipingPolicy
from unconstrain.recordings.demonstration import Demonstration

SHORT = Strokes(count=2, duration=4.0)


@pytest.fixture(scope="module")
def wiped():
    """The true policy on the arm, on a plate tilted about y."""
    return simulation.wipe(WipingPolicy(), HELD_OUT[0], np.array([0.1, 0.0, 0.0]), 6.0)


def test_the_scene_s_arm_is_the_lwr():
    scene = arm_scene(PLATES[1])
    rng = np.random.default_rng(0)
    for posture in rng.uniform(LWR3.lower, LWR3.upper, (5, 7)):
        scene.data.qpos[:7] = posture
        mujoco.mj_forward(scene.model, scene.data)
        rotations, positions = LWR3.frames(posture[None])
        assert_allclose(scene.data.body("flange").xpos, positions[-1, :, 0], atol=1e-12)
        tip = positions[-1, :, 0] + TOOL * rotations[-1, :, 2, 0]
        assert_allclose(scene.face + scene.plate.centre, tip, atol=1e-12)
    assert_allclose(scene.model.jnt_range[:7], np.column_stack([LWR3.lower, LWR3.upper]))
    assert sum(LINK_MASSES) == pytest.approx(14.4)
    assert_allclose([scene.model.body(name).mass[0] for name in LWR3.names], LINK_MASSES)


@pytest.mark.parametrize("plate", [PLATES[0], PLATES[4], HELD_OUT[1]], ids=lambda plate: plate.name)
def test_contact_projects_what_the_hand_wants(plate):
    demo = simulation.demonstrate(plate, np.random.default_rng(0), strokes=SHORT)
    assert np.abs(demo.states @ plate.rotation[:, 2]).max() < 0.012  # the camera misses it by 2 mm, and the pad gives
    wanted = np.einsum("tij,tj->ti", demo.truth.projections, demo.truth.policy)
    assert ((demo.actions - wanted) ** 2).sum() < 0.15 * (wanted**2).sum()
    assert ((demo.actions - demo.truth.policy) ** 2).sum() > ((demo.actions - wanted) ** 2).sum()
    assert_allclose(np.diff(demo.times), 0.05)


def test_a_seed_draws_the_same_hand_again():
    one, same, other = (simulation.demonstrate(PLATES[0], np.random.default_rng(s), strokes=SHORT) for s in (1, 1, 2))
    assert_array_equal(one.states, same.states)
    assert np.abs(one.states[:30] - other.states[:30]).max() > 0.01


def test_postures_put_the_sponge_flat_on_every_point():
    plate = Plate(10.0, -8.0)
    angles = np.linspace(0.0, 2.0 * np.pi, 9)
    points = 0.1 * np.column_stack([np.cos(angles), np.sin(angles)]) @ plate.rotation[:, :2].T
    rest, postures = postures_along(points, plate)
    assert ((postures > LWR3.lower) & (postures < LWR3.upper)).all()
    rotations, positions = LWR3.frames(np.vstack([rest, postures]))
    tool = rotations[-1, :, 2].T
    assert_allclose(tool, np.tile(-plate.rotation[:, 2], (10, 1)), atol=0.02)
    face = positions[-1].T + TOOL * tool - plate.centre
    assert_allclose(face, np.vstack([np.zeros(3), points]), atol=1e-3)


@pytest.mark.parametrize(
    ("plate", "said"),
    [
        (Plate(0.0, 80.0), r"plate \+80° about y: out of the arm's reach.*with joint\d.* at the limit"),
        (Plate(0.0, 0.0, (2.0, 0.0, 0.3)), r"flat: out of the arm's reach\. At \(2\.00, 0\.00, 0\.30\) m .* cm away"),
    ],
)
def test_a_plate_out_of_reach_is_refused_with_the_reason(plate, said):
    with pytest.raises(SettingError, match=said):
        postures_along(np.zeros((1, 3)), plate)


def tool_tasks(posture, plate):
    """Jacobian of the sponge's face and of its tilt, straight from the arm's, shape (5, 7)."""
    jacobian, axis = LWR3.jacobian(posture[None])[0], -plate.rotation[:, 2]
    face = jacobian[:3] + TOOL * np.cross(jacobian[3:], axis, axis=0)
    return np.vstack([face, plate.rotation[:, :2].T @ jacobian[3:]])


def test_a_change_moves_the_face_and_returns_to_rest_in_what_that_leaves_free():
    plate = PLATES[1]
    posture, off, tilt = postures.Reach(plate, READY + np.r_[0.4, np.zeros(6)]).search(np.zeros(3))
    assert off < 1e-5
    assert tilt < 1e-4
    reach = postures.Reach(plate, READY, returning=0.1)
    reach.arm.update(posture)
    shift = np.array([1e-3, -2e-3, 5e-4])
    tasks = tool_tasks(posture, plate)
    inverse = np.linalg.pinv(tasks)
    free = (np.eye(7) - inverse @ tasks) @ (0.1 * (READY - posture))
    assert np.abs(free).max() > 0.01
    assert_allclose(reach.change(shift), inverse @ np.r_[shift, 0.0, 0.0] + free, atol=3e-4)


def test_a_joint_at_its_limit_stops_and_the_others_make_up_for_it():
    limit = LWR3.upper - np.radians(3.0)
    posture = np.array([limit[0], -0.5, 0.5, 1.4, 0.3, -1.1, 0.0])  # not in one plane: there too few could make up
    x, y, z = -LWR3.frames(posture[None])[0][-1, :, 2, 0]
    plate = Plate(float(np.degrees(-np.arcsin(y))), float(np.degrees(np.arctan2(x, z))))  # as the tool stands
    reach = postures.Reach(plate, posture)
    tasks = tool_tasks(posture, plate)
    wanted = np.r_[1e-3 * tasks[:3, 0], 0.0, 0.0]  # as the first joint would move the sponge
    change = reach.change(wanted[:3])
    assert abs(change[0]) < 1e-9
    assert_allclose(tasks @ change, wanted, atol=2e-5)
    for far in (-1e3, 1e3):
        assert (np.abs(posture + reach.change(np.full(3, far))) <= limit + 1e-6).all()


def test_the_arm_keeps_contact_and_follows_the_plan(wiped):
    found = wiped.measures()
    assert found["contact_share"] == 1.0
    assert found["force_sd"] < 0.15 * found["force_mean"]
    assert found["force_mean"] == pytest.approx(control.Gains().force, rel=0.05)
    assert found["path_error_m"] < 0.005
    assert found["drift_m"] < 0.005
    planned = Demonstration(wiped.planned[:-1], np.diff(wiped.planned, axis=0) / 0.01)
    normal = wiped.plate.rotation[:, 2]
    assert found["frequency"] == pytest.approx(reproduction.turning(planned, normal), rel=0.02)
    assert np.abs(wiped.positions @ normal).max() < 0.003
    assert ((wiped.postures > LWR3.lower) & (wiped.postures < LWR3.upper)).all()


@pytest.mark.parametrize("push", [0.1, 1e40])
def test_a_policy_that_leaves_the_plate_is_refused(push):
    with pytest.raises(SettingError, match=r"flat: the policy leaves it .* after [\d.]+ s"):
        simulation.wipe(lambda states: push * np.ones_like(states), PLATES[0], np.zeros(3), 5.0)


def test_turning_and_drift_of_a_circle_that_wanders():
    times = np.arange(0.0, 14.0, 0.01)
    angle = 2.0 * np.pi * 0.75 * times
    circle = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    movement = Demonstration(circle, 2.0 * np.pi * 0.75 * np.column_stack([-circle[:, 1], circle[:, 0], 0.0 * angle]))
    assert reproduction.turning(movement, np.array([0.0, 0.0, 1.0])) == pytest.approx(0.75, rel=1e-3)
    wandering = circle + np.column_stack([0.001 * times, 0.0 * times, 0.0 * times])
    middles = centres(wandering, PLATES[0])
    assert len(middles) == 10
    assert middles[-1, 0] - middles[0, 0] == pytest.approx(9 * 0.001 / 0.75, rel=0.1)
    with pytest.raises(InvalidDataError, match="expected at least one"):
        centres(circle[:60], PLATES[0])


def test_pictures_show_the_arm_moving(wiped):
    frames = pictures.film(wiped, seconds=0.5, width=160, height=120)
    assert len(frames) == 7
    assert all(frame.shape == (120, 160, 3) for frame in frames)
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 60
    moving = Image.open(io.BytesIO(pictures.animation(frames)))
    assert (moving.format, moving.size, moving.n_frames) == ("WEBP", (160, 120), 7)
    demo = simulation.demonstrate(wiped.plate, np.random.default_rng(0), strokes=SHORT)
    still = Image.open(io.BytesIO(pictures.strip(demo, wiped, count=2, width=80, height=60)))
    assert (still.format, still.size) == ("WEBP", (160, 120))
    assert np.asarray(still).std() > 10


def test_the_sponge_leaves_a_trail(wiped):
    trails = [wiped.positions[:1], wiped.positions[:160:4]]
    without, with_trail = pictures._shots("arm", wiped.plate, wiped.postures[[0, 0]], trails, 160, 120)
    assert (without != with_trail).any()


def test_without_graphics_the_arm_is_lines(wiped, monkeypatch):
    monkeypatch.setattr(pictures, "backend", lambda: None)
    with pytest.raises(UnconstrainError, match="neither EGL nor OSMesa works"):
        pictures.film(wiped)
    monkeypatch.setattr(pictures, "backend", lambda: "nonsense")
    with pytest.raises(UnconstrainError, match="cannot be drawn here"):
        pictures.film(wiped, seconds=0.2)
    _, joints = LWR3.frames(wiped.postures[:2])
    quad = plates.Quad.around(wiped.positions, wiped.plate.rotation[:, 2])
    drawn = Image.open(io.BytesIO(arms.arm_on_plate(np.moveaxis(joints, -1, 0), wiped.positions, quad)))
    assert drawn.format == "PNG"
    assert np.asarray(drawn).std() > 5


def test_the_first_backend_that_works_is_taken(monkeypatch):
    for working, found in (({"egl", "osmesa"}, "egl"), ({"osmesa"}, "osmesa"), (set(), None)):
        engine.backend.cache_clear()
        monkeypatch.setattr(engine, "_works", working.__contains__)
        monkeypatch.setattr(sys, "platform", "linux")
        assert engine.backend() == found
    engine.backend.cache_clear()
    monkeypatch.setattr(sys, "platform", "darwin")
    assert engine.backend() == ""
    engine.backend.cache_clear()


def test_without_the_engine_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match="sim"):
        arm_scene(PLATES[0])
    monkeypatch.setitem(sys.modules, "mink", None)
    with pytest.raises(MissingExtraError, match=r"mink.*sim"):
        postures_along(np.zeros((1, 3)), PLATES[0])

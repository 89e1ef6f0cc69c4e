"""Kinematics of serial arms, against the textbook's matrices, finite differences and MuJoCo."""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from unconstrain.base.errors import InvalidDataError, ReadError, SettingError
from unconstrain.constraints.known import JacobianRows
from unconstrain.paper.systems.arm import LWR3, Arm
from unconstrain.risks.projection import null_space_projection

LWR3_TABLE = (
    np.zeros(7),
    np.pi / 2 * np.array([1, -1, -1, 1, 1, -1, 0]),
    np.array([0.3105, 0, 0.40, 0, 0.39, 0, 0.078]),
)
SOME_TABLE = tuple(np.random.default_rng(0).uniform(-1, 1, (3, 4)))

URDF = """<?xml version="1.0"?>
<robot name="crane">
  <link name="world"/><link name="column"/><link name="boom"/><link name="trolley"/><link name="hook"/>
  <link name="lamp"/>
  <link name="buoy"/>
  <joint name="pedestal" type="fixed">
    <parent link="world"/><child link="column"/><origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 0.3"/>
  </joint>
  <joint name="slew" type="continuous">
    <parent link="column"/><child link="boom"/><origin xyz="0 0 1" rpy="0 0.4 0"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="travel" type="prismatic">
    <parent link="boom"/><child link="trolley"/><origin xyz="0.5 0 0.1" rpy="0.2 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-0.3" upper="0.7" effort="1" velocity="1"/>
  </joint>
  <joint name="swing" type="revolute">
    <parent link="trolley"/><child link="hook"/><origin xyz="0 0.1 -0.4"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-1" upper="1.5" effort="1" velocity="1"/>
  </joint>
  <joint name="bracket" type="fixed"><parent link="boom"/><child link="lamp"/><origin xyz="0 0 0.2"/></joint>
  <joint name="mooring" type="floating"><parent link="column"/><child link="buoy"/></joint>
</robot>
"""


def denavit_hartenberg(table, posture):
    """The tip's homogeneous matrix, as the textbook multiplies it."""
    frame = np.eye(4)
    for q, a, alpha, d in zip(posture, *table, strict=True):
        frame = frame @ np.array(
            [
                [np.cos(q), -np.sin(q) * np.cos(alpha), np.sin(q) * np.sin(alpha), a * np.cos(q)],
                [np.sin(q), np.cos(q) * np.cos(alpha), -np.cos(q) * np.sin(alpha), a * np.sin(q)],
                [0, np.sin(alpha), np.cos(alpha), d],
                [0, 0, 0, 1],
            ]
        )
    return frame


def mujoco_tip_and_jacobian(arm, posture):
    """The same chain as nested bodies of a physics engine."""
    body = ""
    for j, (origin, axis) in enumerate(zip(arm.origins, arm.axes, strict=False)):
        x, y, z, w = Rotation.from_matrix(origin[:3, :3]).as_quat().tolist()
        pose = f'pos="{" ".join(map(repr, origin[:3, 3].tolist()))}" quat="{w!r} {x!r} {y!r} {z!r}"'
        kind = "slide" if arm.slides is not None and arm.slides[j] else "hinge"
        body += f'<body {pose}><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        body += f'<joint type="{kind}" axis="{" ".join(map(repr, axis.tolist()))}"/>'
    tip = " ".join(map(repr, arm.origins[-1][:3, 3].tolist()))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody>{body}<site name="tip" pos="{tip}"/>{"</body>" * arm.joints}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qpos[:] = posture
    mujoco.mj_forward(model, data)
    linear, angular = np.zeros((3, arm.joints)), np.zeros((3, arm.joints))
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "tip")
    mujoco.mj_jacSite(model, data, linear, angular, site)
    return data.site_xpos[site].copy(), np.vstack([linear, angular])


@pytest.fixture
def crane(tmp_path):
    path = tmp_path / "crane.urdf"
    path.write_text(URDF)
    return path


@pytest.mark.parametrize("table", [LWR3_TABLE, SOME_TABLE], ids=["LWR-III", "some arm"])
def test_the_tip_is_where_the_textbook_s_matrices_put_it(table):
    arm = Arm.from_dh(*table, np.ones(len(table[0])))
    postures = np.random.default_rng(1).uniform(-2, 2, (20, arm.joints))
    rotations, positions = arm.frames(postures)
    for t, posture in enumerate(postures):
        tip = denavit_hartenberg(table, posture)
        assert_allclose(rotations[-1][..., t], tip[:3, :3], atol=1e-13)
        assert_allclose(positions[-1][:, t], tip[:3, 3], atol=1e-13)


@pytest.mark.parametrize("table", [LWR3_TABLE, SOME_TABLE], ids=["LWR-III", "some arm"])
def test_a_jacobian_is_the_derivative_of_the_tip(table):
    posture, h = np.random.default_rng(2).uniform(-2, 2, len(table[0])), 1e-6
    (J,) = Arm.from_dh(*table, np.ones(len(posture))).jacobian(posture[None])
    for j, step in enumerate(h * np.eye(len(posture))):
        ahead, behind = denavit_hartenberg(table, posture + step), denavit_hartenberg(table, posture - step)
        turn = Rotation.from_matrix(ahead[:3, :3] @ behind[:3, :3].T).as_rotvec() / (2 * h)
        assert_allclose(J[:3, j], (ahead[:3, 3] - behind[:3, 3]) / (2 * h), atol=1e-8)
        assert_allclose(J[3:, j], turn, atol=1e-8)


def test_kinematics_agree_with_a_physics_engine():
    postures = np.random.default_rng(3).uniform(LWR3.lower, LWR3.upper, (20, 7))
    jacobians, (_, positions) = LWR3.jacobian(postures), LWR3.frames(postures)
    for t, posture in enumerate(postures):
        tip, jacobian = mujoco_tip_and_jacobian(LWR3, posture)
        assert_allclose(positions[-1][:, t], tip, atol=1e-12)
        assert_allclose(jacobians[t], jacobian, atol=1e-12)


def test_the_light_weight_robot_stretches_straight_up():
    _, positions = LWR3.frames(np.zeros((1, 7)))
    assert_allclose(positions[-1][:, 0], [0, 0, 0.3105 + 0.40 + 0.39 + 0.078], atol=1e-12)
    assert_allclose(np.degrees(LWR3.upper), [170, 120, 170, 120, 170, 120, 170])
    assert_allclose(LWR3.lower, -LWR3.upper)


@pytest.mark.parametrize("bend", [0.0, 1e-13, 1e-4, 0.5])
def test_a_stretched_arm_is_free_where_its_jacobian_loses_rank(bend):
    posture = np.full((1, 7), bend)
    for rows in range(1, 7):
        matrix = JacobianRows(LWR3.jacobian, tuple(range(rows)))(posture, np.zeros(1))
        free = null_space(matrix[0], rcond=1e-9)
        assert_allclose(null_space_projection(matrix)[0], free @ free.T, atol=1e-6)
    expected = 7 - np.linalg.matrix_rank(LWR3.jacobian(posture)[0], tol=1e-9)
    assert round(np.trace(null_space_projection(LWR3.jacobian(posture))[0])) == expected
    assert (expected > 1) == (bend < 1e-9)


def test_an_arm_is_read_from_urdf_with_its_limits(crane):
    arm = Arm.from_urdf(crane, "hook")
    assert arm.names == ("slew", "travel", "swing")
    assert_allclose(arm.lower, [-np.inf, -0.3, -1.0])
    assert_allclose(arm.upper, [np.inf, 0.7, 1.5])
    assert arm.slides.tolist() == [False, True, False]


def test_an_arm_from_urdf_moves_as_the_engine_says(crane):
    arm = Arm.from_urdf(crane, "hook")
    for posture in np.random.default_rng(4).uniform(-0.3, 0.7, (5, 3)):
        tip, jacobian = mujoco_tip_and_jacobian(arm, posture)
        assert_allclose(arm.frames(posture[None])[1][-1][:, 0], tip, atol=1e-12)
        assert_allclose(arm.jacobian(posture[None])[0], jacobian, atol=1e-12)


def test_the_pedestal_of_an_urdf_counts(crane):
    slewed = Arm.from_urdf(crane, "boom")
    column = Rotation.from_euler("xyz", [0.1, -0.2, 0.3])
    expected = np.add([0.1, 0.2, 0.3], column.apply([0, 0, 1]))
    assert_allclose(slewed.frames(np.zeros((1, 1)))[1][-1][:, 0], expected, atol=1e-12)
    from_column = Arm.from_urdf(crane, "boom", base="column")
    assert_allclose(from_column.frames(np.zeros((1, 1)))[1][-1][:, 0], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("tip", "base", "sentence"),
    [
        ("hand", None, "has no link 'hand'; it has boom, buoy, column, hook, lamp, trolley, world"),
        ("hook", "moon", "has no link 'moon'"),
        ("hook", "lamp", "'lamp' is not on the way from the root to 'hook', but on another branch"),
        ("buoy", None, "joint 'mooring' on the way to 'buoy' is floating; expected only fixed, revolute"),
        ("column", None, "no joint moves between the base and 'column'"),
    ],
)
def test_a_chain_that_cannot_be_taken_from_an_urdf_is_said_in_a_sentence(crane, tip, base, sentence):
    with pytest.raises(SettingError, match=sentence):
        Arm.from_urdf(crane, tip, base)


@pytest.mark.parametrize("content", ["", "no xml", "<html></html>", "<robot"])
def test_what_is_no_urdf_is_said_to_be_none(tmp_path, content):
    path = tmp_path / "broken.urdf"
    path.write_text(content)
    with pytest.raises((ReadError, SettingError), match="broken"):
        Arm.from_urdf(path, "tip")


def test_a_missing_urdf_is_said_to_be_missing(tmp_path):
    with pytest.raises(ReadError, match=r"none\.urdf"):
        Arm.from_urdf(tmp_path / "none.urdf", "tip")


def test_an_arm_has_one_angle_for_each_joint():
    with pytest.raises(SettingError, match=r"postures: got shape \(1, 6\), expected \(samples, 7 joints\)"):
        LWR3.frames(np.zeros((1, 6)))
    with pytest.raises(InvalidDataError, match="alpha: got 3 values, expected 2"):
        Arm.from_dh([0, 0], [0, 0, 0], [1, 1], [1, 1])


GRIPPER = """<robot name="hand"><link name="base"/><link name="palm"/><link name="finger"/><link name="thumb"/>
<joint name="wrist" type="revolute"><parent link="base"/><child link="palm"/><axis xyz="{axis}"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="close" type="prismatic"><parent link="palm"/><child link="finger"/><axis xyz="0 1 0"/>
<limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
<joint name="follow" type="prismatic"><parent link="palm"/><child link="thumb"/><axis xyz="{other}"/>
<limit lower="0" upper="0.04" effort="1" velocity="1"/><mimic joint="close"/></joint></robot>"""


def hand_file(folder, axis="0 0 1", other="0 -1 0"):
    path = folder / "hand.urdf"
    path.write_text(GRIPPER.format(axis=axis, other=other))
    return path


def test_what_is_not_on_the_way_to_the_tip_does_not_matter(tmp_path):
    path = hand_file(tmp_path, other="0 0 0")
    assert Arm.from_urdf(path, "palm").names == ("wrist",)
    assert Arm.from_urdf(path, "finger").names == ("wrist", "close")
    with pytest.raises(SettingError, match="joint 'follow' on the way to 'thumb' mimics another one"):
        Arm.from_urdf(path, "thumb")


def test_a_joint_without_an_axis_is_refused_and_gives_no_nan(tmp_path):
    with pytest.raises(ReadError, match=r"joint 'wrist' on the way to 'palm' has the axis \[0.0, 0.0, 0.0\], expected"):
        Arm.from_urdf(hand_file(tmp_path, axis="0 0 0"), "palm")

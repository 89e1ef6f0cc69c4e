"""An arm whose hand was held on planes, which are curved in joint angles: what is compared of it, and how it is run."""

import json

import numpy as np
import pytest

import unconstrain as uc
from test_cli import refused, run, write
from unconstrain.paper.systems.arm import Arm

HEAD = "t [s],a,b,c,va,vb,vc"
ROBOT = """<robot name="three"><link name="base"/><link name="turret"/><link name="upper"/><link name="lower"/>
  <link name="hand"/>
  <joint name="a" type="continuous"><parent link="base"/><child link="turret"/><axis xyz="0 0 1"/></joint>
  <joint name="b" type="continuous"><parent link="turret"/><child link="upper"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/></joint>
  <joint name="c" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 1 0"/></joint>
  <joint name="d" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0 0 0.35"/></joint>
</robot>"""


def reach(q):
    """Joint velocities that end at one posture, the joints in turn."""
    off = q - [0.2, 0.6, 1.2]
    turned = off @ np.array([[-0.6, 0.5, 0.0], [-0.5, -0.6, 0.0], [0.0, 0.0, -0.8]])
    return turned + np.column_stack([np.zeros(len(q)), 0.2 * np.sin(2.0 * off[:, 2]), -0.25 * off[:, 0] * off[:, 1]])


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A folder with a robot, and movements of it, each with its hand on a plane of its own, and one that is free."""
    place, rng = tmp_path_factory.mktemp("arm"), np.random.default_rng(1)
    (place / "robot.urdf").write_text(ROBOT)
    jacobian = Arm.from_urdf(place / "robot.urdf", "hand").jacobian
    np.save(place / "normals.npy", normals := rng.standard_normal((8, 3)))
    for k, normal in enumerate(normals):
        start = np.array([0.2, 0.6, 1.2]) + rng.uniform([-0.9, -0.6, -0.7], [0.9, 0.6, 0.7])
        held = (lambda q, t, normal=normal: normal @ jacobian(q)[:, None, :3]) if k else None
        one = uc.rollout(reach, start, 150, 0.04, held)
        noisy = [one.states + 3e-4 * rng.standard_normal((150, 3)), one.actions + 4e-3 * rng.standard_normal((150, 3))]
        write(place / f"{k}.csv", HEAD, np.column_stack([one.times, *noisy]))
    run("fit", place / "*.csv", "--model", "affine", "-o", place / "p.npz")
    return place


def words(said):
    return " ".join(said.split())


def test_angles_that_only_look_flat_are_not_run_as_on_a_plane(arm, tmp_path):
    """In joint angles the planes are curved: kept in flat ones, runs were too large and too small."""
    found = json.loads(run("fit", arm / "*.csv", "--model", "affine", "-o", tmp_path / "p.npz", "--json"))
    said, doubt = found["verdict"]["said"], found["verdict"]["doubt"]
    assert "it keeps size, as far as compared (" in said
    assert " of 8 demonstrations; what held the others, if anything, they do not tell well enough)" in said
    assert "size over time" not in doubt
    judged = words(run("score", arm / "p.npz", arm / "*.csv"))
    assert " demonstrations that look flat (on a line, in a plane), round or free, size " in judged
    assert "turn out" not in judged
    assert "turn out" not in words(run("info", arm / "p.npz"))


def test_an_arm_is_run_with_its_hand_on_a_plane(arm, tmp_path):
    robot = Arm.from_urdf(arm / "robot.urdf", "hand")
    asked = ("rollout", arm / "p.npz", "--start", "0.5,0.4,1.0", "--steps", 200, "-o", tmp_path / "path.csv", "--force")
    hand = ("--jacobian", arm / "robot.urdf", "--tip", "hand")
    normals = np.array([[0.0, 0.0, 1.0], [1.0, 2.0, -0.5]])
    for normal in normals:
        said = words(run(*asked, "--plane", ",".join(map(str, normal)), *hand))
        assert "The plane that its hand keeps to passes through the start." in said
        path = np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1)
        at = robot.frames(path[:, 1:4])[1][-1].T
        way = np.linalg.norm(np.diff(at, axis=0), axis=1).sum()
        assert way > 0.05
        assert np.ptp(at @ normal) / np.linalg.norm(normal) < 1e-3 * way
    said = words(run(*asked, "--plane", "0,0,1"))  # of joint velocities: the last joint stands still
    assert "The plane passes through the start." in said
    assert np.ptp(np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1)[:, 3]) < 1e-9


def test_what_is_known_to_have_held_a_hand_is_scored(arm):
    """The first of two normals is the one that held it."""
    hand = ("--jacobian", arm / "robot.urdf", "--tip", "hand", "--json")
    normal = np.load(arm / "normals.npy")[2]
    scores = [
        json.loads(run("score", arm / "p.npz", arm / "2.csv", "--plane", ",".join(map(str, one)), *hand))["all"]
        for one in (normal, np.roll(normal, 1))
    ]
    assert scores[0]["npoe"] < 1e-2 < 0.1 < scores[1]["npoe"]


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (("--plane", "0,1", "--tip", "hand"), "--plane: got 2 numbers, expected 3, a normal in the frame of its base."),
        (("--plane", "0,0,0", "--tip", "hand"), "--plane: got [0.0, 0.0, 0.0], expected a vector that is not zero."),
        (
            ("--tip", "hand"),
            "--jacobian: got no --plane, expected that of the hand; a --constraint knows its own robot",
        ),
        (("--plane", "0,0,1"), "--jacobian and --tip belong together"),
        (("--plane", "0,0,1", "--tip", "upper"), "got 3 states and 3 actions, expected angles and velocities of 2 joi"),
    ],
)
@pytest.mark.parametrize("command", ["rollout", "score"])
def test_what_cannot_be_the_plane_of_a_hand_is_refused(arm, command, given, why):
    last = ("--start", "0.5,0.4,1.0") if command == "rollout" else (arm / "0.csv",)
    assert why in refused(command, arm / "p.npz", *last, "--jacobian", arm / "robot.urdf", *given)


def test_angles_less_their_mean_have_no_hand(arm, tmp_path):
    run("fit", arm / "*.csv", "--model", "affine", "--centre", "-o", tmp_path / "p.npz")
    hand = ("--plane", "0,0,1", "--jacobian", arm / "robot.urdf", "--tip", "hand")
    assert "3 states relative to a mean" in refused("rollout", tmp_path / "p.npz", "--start", "0,0,0", *hand)

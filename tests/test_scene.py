"""Demonstrations, policy and constraint for rerun, and live in the browser, with the robot."""

import base64
import itertools
import json
import re
import signal
import subprocess
import sys
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
import rerun as rr
import viser
from numpy.testing import assert_allclose
from selenium.webdriver.support.ui import WebDriverWait

import unconstrain as uc
from seen import on_a_phone
from test_cli import environment, refused, run
from test_constraint_command import ROBOT, write
from test_look import wipes
from unconstrain.pages import live
from unconstrain.pages.scene import BEYOND, Movement, Scene

READING = ("--state", "x,y,z", "--differentiate")
JOINTS = ("--state", "a,b", "--differentiate")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings of positions, and what was learnt from them; a robot and recordings of its joints."""
    place = tmp_path_factory.mktemp("scene")
    for index, table in enumerate(wipes(4)[::3]):
        np.savetxt(place / f"wipe {index}.csv", table, delimiter=",", header="t,x,y,z", comments="")
        joints = table[:, [0, 1, 2]]
        np.savetxt(place / f"arm_{index}.csv", joints, delimiter=",", header="t,a,b", comments="")
    run("fit", place / "wipe *.csv", *READING, "--learner", "direct", "-o", place / "policy.npz")
    run("constraint", place / "wipe 0.csv", *READING, "-o", place / "constraint.npz")
    (place / "robot.urdf").write_text(ROBOT)
    return place


@pytest.fixture
def scene(folder):
    """Positions and a policy of them."""
    states = uc.Recipe(states=("x", "y", "z"), differentiate="savgol")
    demos = uc.prepare(uc.read(sorted(folder.glob("wipe *.csv"))), states)
    return Scene(demos, "xyz", states.directions, uc.load(folder / "policy.npz"))


@pytest.fixture
def server():
    """Of viser, on a free port."""
    started = viser.ViserServer(host="127.0.0.1", verbose=False)
    yield started
    started.stop()


@pytest.fixture
def frames(monkeypatch):
    """Somebody presses Ctrl-C after a few frames."""
    count = itertools.count(1)

    def shown(seconds):
        if next(count) % 5 == 0:
            raise KeyboardInterrupt

    monkeypatch.setattr(live, "time", SimpleNamespace(sleep=shown))


def stored(path):
    """By entity, the column of each component, and of time."""
    found = {}
    for chunk in rr.chunk.RrdReader(path).stream():
        batch = chunk.to_record_batch()
        found[str(chunk.entity_path)] = dict(zip(batch.schema.names, batch.columns, strict=True))
    return found


def numbers(column):
    return np.array([np.squeeze(np.array(row.as_py(), float)) for row in column])


def test_a_recording_for_rerun_holds_what_there_is(folder, scene, tmp_path):
    files = (folder / "wipe *.csv", folder / "policy.npz", folder / "constraint.npz")
    said = run("look", *files, "-o", tmp_path / "look.html", "--rrd", tmp_path / "all.rrd")
    assert f"rerun: {tmp_path / 'all.rrd'}" in said
    found = stored(tmp_path / "all.rrd")
    assert {re.sub(r"\\?wipe\\? \d", "NAME", path) for path in found} >= {
        "/constraint",
        "/demonstrations/NAME",
        "/demonstrations/NAME/x",
        "/demonstrations/NAME/vz",
        "/policy/NAME/support",
    }
    for demo in scene.demonstrations:
        name = rr.escape_entity_path_part(demo.name)
        assert_allclose(numbers(found[f"/demonstrations/{name}"]["Points3D:positions"]), demo.states, atol=1e-6)
        assert_allclose(numbers(found[f"/demonstrations/{name}/y"]["Scalars:scalars"]), demo.states[:, 1])
        assert_allclose(numbers(found[f"/demonstrations/{name}/vx"]["Scalars:scalars"]), demo.actions[:, 0])
        passed = np.array([each.as_py().total_seconds() for each in found[f"/demonstrations/{name}"]["time"]])
        assert_allclose(passed, demo.times - demo.times[0], atol=1e-6)
        step = float(np.median(np.diff(demo.times)))
        track = uc.rollout(scene.policy, demo.states[0], len(demo), step, method="rk4")
        shown = numbers(found[f"/policy/{name}"]["Points3D:positions"])
        assert_allclose(shown, track.states[: len(shown)], atol=1e-5)


def test_a_movement_is_followed_a_quarter_of_the_extent_beyond_the_data(scene):
    away = scene._replace(policy=uc.LocallyLinearPolicy(0.1, learner=uc.Direct()).fit(
        np.linspace(0, 1, 50)[:, None] * np.ones(3), np.ones((50, 3))))  # fmt: skip
    track, support = away.follow(np.ones(3), 400, 0.01)
    extent = max(np.ptp(np.vstack([demo.states for demo in scene.demonstrations]), axis=0))
    lost = track.states[support < 1e-3]
    assert 0.9 * BEYOND * extent < np.linalg.norm(lost[-1] - lost[0]) <= BEYOND * extent
    assert scene.follow(scene.demonstrations[0].states[0], 50, 0.01).track.states.shape == (50, 3)


def test_without_what_it_needs_nothing_is_begun(folder, tmp_path, monkeypatch):
    for module, asked in (("rerun", ("--rrd", tmp_path / "a.rrd")), ("viser", ("--live",))):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, module, None)
            said = refused("look", folder / "wipe 0.csv", *READING, *asked, "-o", tmp_path / "look.html")
            assert f"this needs '{module}'" in said
    assert not list(tmp_path.iterdir())


def test_a_robot_belongs_to_its_joints(folder, tmp_path):
    there = ("-o", tmp_path / "look.html")
    robot = ("--robot", folder / "robot.urdf", "--tip", "hand")
    assert "belong together" in refused("look", folder / "arm_0.csv", *robot[:2], *there)
    assert "the page shows the states as they are" in refused("look", folder / "arm_0.csv", *robot, *there)
    said = refused("look", folder / "wipe 0.csv", *READING, *robot, "--rrd", tmp_path / "a.rrd", *there)
    assert said == "--robot: has 2 joints on the way to 'hand', got 3 states."
    run("look", folder / "arm_0.csv", *JOINTS, *robot, "--rrd", tmp_path / "a.rrd", *there)
    table = np.loadtxt(folder / "arm_0.csv", delimiter=",", skiprows=1)
    a, b = table[:, 1], table[:, 1] + table[:, 2]
    hand = np.column_stack([np.cos(a) + np.cos(b), np.sin(a) + np.sin(b), np.zeros(len(a))])
    assert_allclose(numbers(stored(tmp_path / "a.rrd")["/demonstrations/arm_0"]["Points3D:positions"]), hand, atol=1e-5)


def test_live_moves_and_ends_with_ctrl_c(folder, frames, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = run("look", folder / "wipe *.csv", folder / "policy.npz", folder / "constraint.npz", "--live")
    assert re.search(r"live: http://127\.0\.0\.1:\d+ \(Ctrl-C ends it\)", said)
    assert not list(tmp_path.iterdir())
    robot = ("--robot", folder / "robot.urdf", "--tip", "hand")
    run("look", folder / "arm_*.csv", *JOINTS, *robot, "--live")


def test_live_keeps_to_a_plane_and_to_a_start(scene, server):
    shown = live.Live(server, scene, None)
    shown._held.value, shown._tilt.value, shown._turn.value = True, 30, 90
    shown._grip.position = (0.5, 0.1, 0.2)
    states = shown._follow()
    normal = np.array([0.0, 0.5, np.sqrt(0.75)])
    assert_allclose(states[0], [0.5, 0.1, 0.2])
    assert_allclose((states - states[0]) @ normal, 0.0, atol=1e-9)
    shown._begin.value = "2: wipe 1"
    shown._begin_anew(None)
    assert_allclose(shown._follow()[0], scene.demonstrations[1].states[0], atol=1e-6)


def test_far_from_all_data_the_movement_is_grey_and_dashed(scene, server, monkeypatch):
    track = uc.Demonstration(np.linspace(0, 1, 41)[:, None] * np.ones(3), np.ones((41, 3)), 0.1 * np.arange(41))
    near = np.where(np.arange(41) < 20, 1.0, 0.0)
    monkeypatch.setattr(Scene, "follow", lambda *_: Movement(track, near))
    shown, drawn = live.Live(server, scene, None), {}
    monkeypatch.setattr(shown, "_lines", lambda name, points, colours, _: drawn.update({name: (points, colours)}))
    shown._follow()
    points, colours = drawn["/movement"]
    grey, rows = (colours[:, 0] == live.GREY).all(axis=1), np.rint(40 * points[:, 0, 0])
    assert_allclose(rows[~grey], np.arange(20))
    assert set(rows[grey]) < set(range(20, 40))
    assert 0.4 <= len(rows[grey]) / 20 <= 0.6


def test_the_joints_of_a_robot_are_those_of_the_states(folder, server):
    arm = uc.systems.arm.Arm.from_urdf(folder / "robot.urdf", "hand")
    demo = uc.Demonstration([[0.3, 0.4], [0.5, 0.6]], np.ones((2, 2)))
    shown = live.Live(server, Scene([demo], "ab", ("va", "vb"), arm=arm), str(folder / "robot.urdf"))
    shown._pose(demo.states[1])
    placed = shown._robot._urdf.get_transform("hand")[:3, 3]
    assert_allclose(placed, shown._scene.places(demo.states[1:])[0], atol=1e-9)


def told(page):
    """What a page of demonstrations has to show."""
    return json.loads(re.search(r"const shown = (.*);", page.read_text())[1])


def test_who_looks_without_a_policy_sees_what_was_free(tmp_path):
    rng = np.random.default_rng(4)
    for number in range(6):
        states = rng.uniform(-1, 1, (200, 2))
        wanted = states @ [[-1.0, 1.0], [-1.0, -1.0]]
        along = np.array([np.cos(number), np.sin(number)])
        actions = wanted if number < 2 else np.outer(wanted @ along, along)
        write(tmp_path / f"{number}.csv", "t,x,y,vx,vy", [0.1 * np.arange(200), states, actions])
    run("look", tmp_path / "*.csv", "-o", tmp_path / "look.html")
    shown = told(tmp_path / "look.html")
    means = [
        one["free"]["low"] + (one["free"]["high"] - one["free"]["low"]) * np.mean(sixteenths(one)) / 65535
        for one in shown["demonstrations"]
    ]
    assert shown["quick"]
    assert min(means[:2]) > 0.8 > 0.2 > max(means[2:])
    run("look", tmp_path / "[01].csv", "-o", tmp_path / "two.html")  # too few to tell
    assert [one["free"] for one in told(tmp_path / "two.html")["demonstrations"]] == [None, None]


def sixteenths(one):
    return np.frombuffer(base64.b64decode(one["free"]["bits"]), "<u2")


def test_what_held_the_hand_of_an_arm_is_drawn_along_its_joints(folder, tmp_path):
    robot = uc.systems.arm.Arm.from_urdf(folder / "robot.urdf", "hand")
    rng = np.random.default_rng(3)
    for number in range(3):
        postures, wanted = rng.uniform(0.3, 1.8, (60, 2)), rng.standard_normal((60, 2))
        free = uc.null_space_projection(robot.jacobian(postures)[:, :1])
        write(tmp_path / f"{number}.csv", "t,a,b,va,vb", [0.1 * np.arange(60), postures, uc.project(free, wanted)])
    hand = ("--jacobian", folder / "robot.urdf", "--tip", "hand")
    run("constraint", tmp_path / "*.csv", *hand, "-o", tmp_path / "c.npz")
    run("look", tmp_path / "*.csv", tmp_path / "c.npz", "-o", tmp_path / "look.html")
    patches = told(tmp_path / "look.html")["patches"]
    assert len(patches) > 10
    for patch in patches:
        rows = robot.jacobian(np.array([patch["at"]]))[:, :1]
        assert_allclose(rows[0] @ np.transpose(patch["free"]), 0.0, atol=1e-6)


def heard():
    """Ctrl-C is heard, though the tests themselves may run where it is not, in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def ended(command):
    """A command that is running, and is no more in the end, whatever happens."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment(), preexec_fn=heard) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
def test_a_browser_sees_it_live(folder, browser):
    command = [sys.executable, "-m", "unconstrain", "look", folder / "wipe 0.csv", folder / "policy.npz", "--live"]
    with ended(command) as process:
        address = next(found[0] for line in process.stdout if (found := re.search(r"http://\S+\d", line)))
        browser.get_log("browser")
        with on_a_phone(browser, 320, 240):  # few pixels, drawn without a graphics card
            browser.get(address)
            seen = "return document.body.innerText.includes('Start of') && !!document.querySelector('canvas')"
            WebDriverWait(browser, 120).until(lambda _: browser.execute_script(seen))
            browser.get("about:blank")
        assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0

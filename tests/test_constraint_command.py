"""``unconstrain constraint``, its file and its page, and the commands that take the file."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose
from scipy.ndimage import gaussian_filter1d

import unconstrain as uc
from seen import below
from unconstrain import cli
from unconstrain.base.errors import ModelFileError, SettingError
from unconstrain.pages.constraint import constraint_page
from unconstrain.paper.systems.arm import Arm

NORMAL = np.array([0.0, 0.6, 0.8])


def call(*args):
    result = CliRunner().invoke(cli.main, list(map(str, args)), prog_name="unconstrain")
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def run(*args):
    result = call(*args)
    assert result.exit_code == 0, result.stderr
    return result.stdout


def refused(*args):
    result = call(*args)
    assert result.exit_code == 2
    return result.stderr


def write(path, head, columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=head, comments="")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four demonstrations on one plane, whose directions cross; and a policy that wants to leave it."""
    folder = tmp_path_factory.mktemp("held")
    rng = np.random.default_rng(0)
    for k in range(4):
        states, wanted = rng.uniform(-1, 1, (60, 3)), rng.standard_normal((60, 3))
        actions = wanted - np.outer(wanted @ NORMAL, NORMAL)
        write(folder / f"wipe_{k}.csv", "t,x,y,z,vx,vy,vz", [0.1 * np.arange(60), states, actions])
    policy = uc.ParametricPolicy(uc.Affine(), learner="direct").fit(states, -states)
    uc.save(policy, folder / "wipe.npz", {"recipe": {"states": ["x", "y", "z"], "actions": ["vx", "vy", "vz"]}})
    said = run("constraint", folder / "wipe_*.csv", "-o", folder / "plate.npz", "--report", folder / "plate.html")
    (folder / "said.txt").write_text(said)
    return folder


def test_it_says_what_was_held_and_how_its_form_was_chosen(folder):
    lines = below((folder / "said.txt").read_text()).splitlines()
    assert lines[0] == "Learnt from x, y, z as states and vx, vy, vz as actions."
    assert lines[1] == "Learnt: 1 of 3 directions held, by constant features."
    assert lines[2].startswith("Noise and misfit along them are about ")
    assert [line.split()[0] for line in lines[3:8]] == ["features", "constant", "affine", "quadratic", "rbf"]
    assert lines[8:] == [f"constraint: {folder / 'plate.npz'}", f"report: {folder / 'plate.html'}"]


def test_its_file_holds_the_constraint_and_no_sample(folder):
    found = uc.load(folder / "plate.npz", uc.LearntConstraint)
    assert_allclose(np.abs(found(np.zeros((1, 3)))[0, 0]), NORMAL, atol=1e-9)
    assert not hasattr(found, "evidence_")
    with pytest.raises(SettingError, match="was stored, without what it was learnt from"):
        found.partial_fit(np.ones((3, 3)), np.ones((3, 3)))
    with pytest.raises(ModelFileError, match="holds a learnt constraint, expected a policy"):
        uc.load(folder / "plate.npz")
    assert "holds a policy, expected a learnt constraint" in refused(
        "score", folder / "wipe.npz", folder / "wipe_0.csv", "--constraint", folder / "wipe.npz"
    )


@pytest.mark.parametrize("features", ["affine", "quadratic", "rbf"])
def test_every_form_survives_its_file(features, tmp_path):
    rng = np.random.default_rng(1)
    directions = rng.standard_normal((200, 3))
    points = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    constraint = uc.LearntConstraint(features).fit(points, np.cross(points, rng.standard_normal((200, 3))))
    surface = uc.LearntConstraint("quadratic").fit(points)
    for found in (constraint, surface):
        uc.save(found, tmp_path / "c.npz")
        again = uc.load(tmp_path / "c.npz", uc.LearntConstraint)
        assert_allclose(again.projection(points), found.projection(points))
        assert (again.rank_, again.noise_, again.choice_.doubts) == (found.rank_, found.noise_, found.choice_.doubts)


def test_score_takes_it(folder):
    scored = ("score", folder / "wipe.npz", folder / "wipe_0.csv")
    by_plane = json.loads(run(*scored, "--plane", "0,3,4", "--json"))["all"]
    learnt = json.loads(run(*scored, "--constraint", folder / "plate.npz", "--json"))["all"]
    assert learnt["ncpe"] == pytest.approx(by_plane["ncpe"])
    assert learnt["npoe"] == pytest.approx(0.0, abs=1e-15)
    assert below(run(*scored, "--constraint", folder / "plate.npz")).splitlines()[0].split()[-2:] == ["nPOE", "nCPE"]


def test_rollout_takes_it(folder):
    start = (folder / "wipe.npz", "--start", "0.1,0.2,0.3", "--steps", 5)
    free, by_plane, learnt = (
        np.genfromtxt(run("rollout", *start, *held).splitlines(), delimiter=",", skip_header=1)
        for held in ((), ("--plane", "0,3,4"), ("--constraint", folder / "plate.npz"))
    )
    assert_allclose(learnt, by_plane, atol=1e-7)
    assert np.abs(free - learnt).max() > 1e-3


def test_a_task_is_followed(tmp_path):
    rng = np.random.default_rng(2)
    for k in range(3):
        states, wanted = rng.uniform(-1, 1, (60, 2)), rng.standard_normal(60)
        write(tmp_path / f"{k}.csv", "t,x,y,vx,vy", [0.1 * np.arange(60), states, wanted, 0.5 - states[:, 1]])
    run("constraint", tmp_path / "*.csv", "--features", "affine", "--with-task", "-o", tmp_path / "task.npz")
    run("fit", tmp_path / "*.csv", "--model", "linear", "--learner", "direct", "-o", tmp_path / "p.npz")
    out = run("rollout", tmp_path / "p.npz", "--start", "0.2,0", "--steps", 4, "--constraint", tmp_path / "task.npz")
    path = np.genfromtxt(out.splitlines(), delimiter=",", skip_header=1)
    assert_allclose(path[:, 4], 0.5 - path[:, 2], atol=1e-6)


ROBOT = """<robot name="two">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="hand"/>
  <joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
  <joint name="b" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="c" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="1 0 0"/></joint>
</robot>"""


def test_an_arm_is_held_by_its_hand(tmp_path):
    (tmp_path / "robot.urdf").write_text(ROBOT)
    rng = np.random.default_rng(3)
    arm = Arm.from_urdf(tmp_path / "robot.urdf", "hand")
    for k in range(4):
        postures, wanted = rng.uniform(0.3, 1.8, (60, 2)), rng.standard_normal((60, 2))
        free = uc.null_space_projection(arm.jacobian(postures)[:, :1])
        write(tmp_path / f"{k}.csv", "t,a,b,va,vb", [0.1 * np.arange(60), postures, uc.project(free, wanted)])
    options = ("--jacobian", tmp_path / "robot.urdf", "--tip", "hand", "-o", tmp_path / "c.npz")
    said = run("constraint", tmp_path / "*.csv", *options)
    assert "1 of 2 directions held, by constant features." in said
    found = uc.load(tmp_path / "c.npz", uc.LearntConstraint)
    assert_allclose(found.projection(postures), free, atol=1e-9)
    code = "import unconstrain as uc; print(uc.load('c.npz', uc.LearntConstraint).rank_)"  # where nothing is imported
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False,
                          env=os.environ | {"PYTHONPATH": str(Path(uc.__file__).parents[1])})  # fmt: skip
    assert (done.stdout, done.stderr) == ("1\n", "")
    said = refused("constraint", tmp_path / "*.csv", "--tip", "hand", "-o", tmp_path / "d.npz")
    assert "--jacobian and --tip belong together" in said


def test_positions_alone_show_a_surface(tmp_path):
    rng = np.random.default_rng(4)
    turns = rng.uniform(0, 2 * np.pi, 300)
    write(tmp_path / "rim.csv", "t,x,y", [0.02 * np.arange(300), np.cos(turns), np.sin(turns)])
    said = run("constraint", tmp_path / "rim.csv", "--state", "x,y", "--differentiate", "--surface",
               "--features", "quadratic", "-o", tmp_path / "c.npz")  # fmt: skip
    assert "(unit of the states)" in said
    assert "positions alone show neither" in refused(
        "constraint", tmp_path / "rim.csv", "--surface", "--with-task", "-o", tmp_path / "d.npz"
    )


def test_one_constraint_at_a_time_and_of_the_right_size(folder, tmp_path):
    start = ("rollout", folder / "wipe.npz", "--start", "0,0,0")
    assert "got --constraint too, expected one of them" in refused(
        *start, "--plane", "0,3,4", "--constraint", folder / "plate.npz"
    )
    states = np.random.default_rng(5).uniform(-1, 1, (50, 2))
    uc.save(uc.LearntConstraint("constant").fit(states, states * [1.0, 0.0]), tmp_path / "flat.npz")
    said = refused(*start, "--constraint", tmp_path / "flat.npz")
    assert "flat.npz: holds 2 actions at 2 states, expected 3 at 3." in said
    turned = ("--state", "y,x,z", "--action", "vy,vx,vz", "-o", tmp_path / "turned.npz")
    run("constraint", folder / "wipe_0.csv", *turned)
    said = refused(*start, "--constraint", tmp_path / "turned.npz")
    assert "turned.npz: is of y, x, z, expected x, y, z, as the policy." in said


def test_what_is_decided_is_said_and_nothing_to_learn_from_is_refused(folder, tmp_path):
    nothing = ("constraint", folder / "wipe_0.csv", "--leave-out", "wipe_0", "-o", tmp_path / "none.npz")
    assert "no demonstration is left to read" in refused(*nothing)
    time, columns = 0.02 * np.arange(201), ("a", "b", "a_next", "b_next")
    states = np.degrees(np.column_stack([np.sin(time), 0.5 * np.sin(time)]))
    write(tmp_path / "to.csv", ",".join(("t", *columns)), [time[:-1], states[:-1], states[1:]])
    columns = ("--state", "a,b", "--action", "a_next,b_next", "--degrees", ",".join(columns))
    result = call("constraint", tmp_path / "to.csv", *columns, "--features", "constant", "-o", tmp_path / "to.npz")
    assert "are the states to come, so the velocity of the states is learnt" in result.stderr
    assert "1 of 2 directions held" in result.stdout


def test_its_page_draws_held_directions_where_states_are(folder):
    page = (folder / "plate.html").read_text()
    assert "1 of 3" in page
    assert "held directions" in page
    states = np.random.default_rng(6).uniform(-1, 1, (80, 2))
    demo = uc.Demonstration(states, states * [1.0, 0.0])
    page = constraint_page([uc.LearntConstraint().fit(states, demo.actions)], [demo], "flat")
    assert "What the data does not tell" in page
    assert "a free policy that is a function of the state looks the same" in page


def test_it_names_the_mechanism_of_a_door(tmp_path):
    for number in range(3):
        angle = 0.3 + 0.1 * number + 0.6 * (1 - np.cos(np.linspace(0, np.pi, 120)))
        noise = 1e-3 * np.random.default_rng(number).normal(size=(120, 2))
        hand = np.column_stack([0.41 + 0.71 * np.cos(angle), -0.12 + 0.71 * np.sin(angle)]) + noise
        table = np.column_stack([np.linspace(0, 3, 120), hand])
        np.savetxt(tmp_path / f"door_{number}.csv", table, delimiter=",", header="t,x,y", comments="")
    paths, page = sorted(tmp_path.glob("*.csv")), tmp_path / "door.html"
    said = run("constraint", *paths, "-o", tmp_path / "door.npz", "--report", page)
    [line] = [line for line in said.splitlines() if line.startswith("Mechanism")]
    assert "a circle (hinge) about (0.41" in line
    assert "radius 0.7099 ± 0.0014" in line
    assert "The mechanism" in page.read_text()
    assert "radius 0.7099" in page.read_text()


TILTS = (0.0, 0.4, -0.4)


@pytest.fixture(scope="module")
def tilted(tmp_path_factory):
    """Three plates of other tilts, in mm, wiped once each."""
    folder = tmp_path_factory.mktemp("tilted")
    rng, time = np.random.default_rng(0), np.linspace(0, 4.5, 80)
    for number, tilt in enumerate(TILTS):
        flat = np.column_stack([100 * np.cos(3 * time), 120 * np.sin(2 * time)])
        plate = flat @ [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)]] + rng.standard_normal((80, 3))
        write(folder / f"plate_{number}.csv", "t [s],x [mm],y [mm],z [mm]", [time, plate])
    return folder


def test_plates_of_other_tilts_have_a_constraint_each_and_a_table(tilted, tmp_path):
    order = ("constraint", tilted, "-o", tmp_path / "p.npz", "--report", tmp_path / "p.html")
    said = run(*order)
    assert "1 of 3 directions were held, others in each of 3 demonstrations" in said
    assert "Record what is missing" not in said
    [line] = [line for line in said.splitlines() if line.startswith("Mechanism: ")]
    assert "a plane for each of 3 demonstrations, against" in line
    assert line.rstrip().endswith(":1 (10:1 are odds for what is first).")
    rows = [line.split() for line in said.splitlines() if line.startswith("plate_")]
    assert_allclose([float(row[row.index("plane") + 1].rstrip("°")) for row in rows], np.degrees(np.abs(TILTS)), atol=1)
    for number, tilt in enumerate(TILTS):
        found = uc.load(tmp_path / f"p_plate_{number}.npz", uc.LearntConstraint)
        assert abs(found(np.zeros((1, 3)))[0, 0] @ [0.0, -np.sin(tilt), np.cos(tilt)]) > 0.99
    assert not (tmp_path / "p.npz").exists()
    assert "p_plate_0.npz: is there; give another name, or --force" in refused(*order[:-2])
    page = (tmp_path / "p.html").read_text()
    assert page.count("1 of 3, plane") == 3
    assert "angle of normal to z axis" in page


def test_one_plate_has_one_constraint_in_the_unit_of_its_file_and_of_no_other(tilted, tmp_path, monkeypatch):
    said = run("constraint", tilted / "plate_1.csv", "-o", tmp_path / "p.npz")
    assert "Mechanism: a plane through (" in said
    assert "(± is half of a 95 % interval, 10:1 are odds for what is first)." in " ".join(said.split())
    text = (tilted / "plate_1.csv").read_text().replace(" [mm]", "")
    (tmp_path / "none.csv").write_text(text)
    assert "Mechanism, if these are positions: a plane through (" in run(
        "constraint", tmp_path / "none.csv", "-o", tmp_path / "n.npz"
    )
    (tmp_path / "mixed.csv").write_text(text.replace("x,y,z", "x [mm],y [m],z [rad]"))
    mixed = call("constraint", tmp_path / "mixed.csv", "-o", tmp_path / "m.npz")
    assert "no mechanism is named: the columns are in mm, m, rad, expected one unit of length" in mixed.stderr
    assert "Mechanism" not in mixed.stdout
    monkeypatch.setattr(uc.constraints, "identify", lambda *_, **__: SimpleNamespace(kind="point"))
    still = call("constraint", tmp_path / "none.csv", "-o", tmp_path / "s.npz")
    assert "positions keep to a point, which would hold every motion; 'none' moves least." in still.stderr


@pytest.fixture(scope="module")
def falling(tmp_path_factory):
    """Six free strokes that fall towards one goal, each on a plane of its own, which nothing held."""
    folder = tmp_path_factory.mktemp("falling")
    rng, step = np.random.default_rng(0), 0.01
    for number in range(6):
        path = [rng.uniform(-0.4, 0.4, 3)]
        for _ in range(300):
            x, y, z = path[-1]
            path.append(path[-1] - step * np.array([x, y, np.clip(4.0 * (z - 0.3 * np.hypot(x, y)), -0.6, 0.6)]))
        states = np.array(path)[::2] + 2e-4 * rng.standard_normal((151, 3))
        velocities = np.gradient(states, 2 * step, axis=0)
        write(folder / f"fall_{number}.csv", "t,x,y,z,vx,vy,vz", [2 * step * np.arange(151), states, velocities])
    return folder


@pytest.mark.parametrize("actions", [("--differentiate",), ("--action", "vx,vy,vz")])
def test_free_strokes_that_are_flat_are_not_called_held(falling, tmp_path, actions):
    order = ("constraint", falling, "--state", "x,y,z", *actions, "--features", "constant", "-o", tmp_path / "c.npz")
    said = run(*order)
    assert said.startswith("! Whether anything was held cannot be told: free strokes that turn as little")
    assert "1 of 3, constant" in said  # each by itself looks held
    assert " hold to mechanisms" not in said.replace("None of the 6 files hold to mechanisms", "")
    assert run("info", tmp_path / "c_fall_1.npz").startswith("! Whether anything was held cannot be told")


def strokes_to(folder, ways):
    """Straight strokes, by name the direction of each, from places that differ."""
    rng, time = np.random.default_rng(0), np.linspace(0, 3, 150)
    for name, way in ways.items():
        along = 0.25 * (1 - np.cos(np.pi * time / 3))[:, None] * np.array(way) / np.linalg.norm(way)
        states = rng.uniform(-0.3, 0.3, 3) + along + 1e-3 * rng.standard_normal((150, 3))
        write(folder / f"{name}.csv", "t,x [m],y [m],z [m]", [time, states])
    return folder


def test_rails_that_differ_are_doubted_and_strokes_that_share_no_direction_are_named(tmp_path):
    rails = {f"rail_{number}": (0.0, 1.0, 0.0) for number in range(3)}
    free = {"free_0": (0.1, 1.0, 0.2), "free_1": (-0.1, 1.0, -0.2)}
    said = run("constraint", strokes_to(tmp_path, rails | free), "-o", tmp_path / "c.npz")
    assert said.startswith("!")
    assert "a line for each of 5 demonstrations" in said
    assert "Maybe free, as no other has an axis of that direction: free_0, free_1." in " ".join(said.split())


def test_rails_of_one_direction_leave_nothing_that_may_be_free(tmp_path):
    rails = {f"rail_{number}": (0.0, 1.0, 0.0) for number in range(4)}
    said = run("constraint", strokes_to(tmp_path, rails), "-o", tmp_path / "c.npz")
    assert "Maybe free" not in said
    assert "Demonstrations differ" not in said


def test_doors_and_drawers_have_a_kind_each_in_the_table(tmp_path):
    rng, time = np.random.default_rng(0), np.linspace(0, 3, 400)
    strokes_to(tmp_path, {"drawer_0": (0.0, 1.0, 0.0), "drawer_1": (1.0, 1.0, 0.3)})
    for number in range(2):
        angle = number + 0.6 * (1 - np.cos(np.pi * time / 3))
        hand = np.column_stack([0.7 * np.cos(angle), 0.7 * np.sin(angle), 0 * angle]) + number
        columns = [time, hand + 1e-3 * rng.standard_normal((400, 3))]
        write(tmp_path / f"door_{number}.csv", "t,x [m],y [m],z [m]", columns)
    said = run("constraint", tmp_path, "-o", tmp_path / "c.npz")
    rows = {line.split()[0]: line for line in said.splitlines() if line.startswith(("door_", "drawer_"))}
    assert said.startswith("! Demonstrations differ: circle for 2, line for 2 of 4 demonstrations")
    assert all(" circle " in rows[name] and " 0.7" in rows[name] for name in ("door_0", "door_1"))
    assert all(" line " in rows[name] and " m" not in rows[name] for name in ("drawer_0", "drawer_1"))


def test_mechanisms_that_differ_are_told_by_name(tilted, tmp_path):
    paths = [tilted / "plate_0.csv", tilted / "plate_1.csv"]
    told = json.loads(run("constraint", *paths, "--features", "constant", "-o", tmp_path / "p.npz", "--json"))
    assert told["mechanism"].startswith("a plane for each of 2 demonstrations, against")
    assert list(told["mechanisms"]) == list(told["each"]) == ["plate_0", "plate_1"]
    assert all(text.startswith("a plane through") for text in told["mechanisms"].values())
    assert [one["rank"] for one in told["each"].values()] == [1, 1]


def test_where_each_was_held_in_its_own_way_the_options_that_fit_each_are_named(tmp_path):
    head = "trial,t," + ",".join([*(f"q{i}" for i in range(4)), *(f"v{i}" for i in range(4))])
    learn = "--state", "q0,q1,q2,q3", "--action", "v0,v1,v2,v3", "-o", tmp_path / "c.npz"
    for name in ("flat", "curved"):
        rng, tables = np.random.default_rng(0), []
        for trial in range(3):
            states, wanted, mixed = (rng.uniform(-1, 1, shape) for shape in ((80, 4), (80, 4), (4, 4)))
            normals = np.sin(6.0 * states @ mixed) if name == "curved" else np.tile(mixed[0], (80, 1))
            along = np.vecdot(wanted, normals) / np.vecdot(normals, normals)
            actions = wanted - along[:, None] * normals
            tables.append(np.column_stack([np.full(80, trial), 0.1 * np.arange(80), states, actions]))
        write(tmp_path / f"{name}.csv", head, [np.vstack(tables)])
    said = " ".join(refused("constraint", tmp_path / "curved.csv", *learn).split())
    assert (
        "constraints differ by demonstration: fit each by itself (its file alone, or --episodes with its name)" in said
    )
    assert said.endswith("and of joint angles that a hand's constraint holds, with --jacobian.")
    assert "by itself (its file" not in run("constraint", tmp_path / "flat.csv", *learn)


def to_a_cycle(folder, rails=0):
    """Five free hands that come onto one circle from inside and outside, and some more on straight rails, in m."""
    rng, files = np.random.default_rng(3), []
    for number, start in enumerate([0.04, 0.2, 0.06, 0.19, 0.05] + rails * [0.15]):
        turn, aside = rng.uniform(0, 2 * np.pi), rng.uniform(0.8, 2.0)
        at, way = (size * np.array([np.cos(way), np.sin(way)]) for size, way in ((start, turn), (1.0, turn + aside)))
        path = [at]
        for _ in range(400 if number < 5 else 200):
            size = np.hypot(*path[-1])
            step = 0.015 * max(1 - (size / 0.12) ** 2, -3) * path[-1] + 0.018 * np.array([-path[-1][1], path[-1][0]])
            path.append(path[-1] + (step if number < 5 else way * (way @ step)))
        hand = np.array(path) + 5e-4 * rng.standard_normal((len(path), 2))
        write(folder / f"hand_{number}.csv", "t,x [m],y [m]", [0.01 * np.arange(len(path)), hand])
        files.append(f"hand_{number}")
    return files


def test_a_cycle_that_free_hands_come_onto_is_no_hinge(tmp_path):
    to_a_cycle(tmp_path)
    said = run("constraint", tmp_path, "-o", tmp_path / "c.npz")
    assert "Mechanism: a movement that nothing holds, against a circle" in said
    assert "hinge" not in said
    alone = run("constraint", tmp_path / "hand_1.csv", "-o", tmp_path / "a.npz")
    assert "Mechanism: a movement that nothing holds, against a circle" in alone


def test_free_hands_among_rails_are_named_and_what_comes_next_leaves_them_out(tmp_path):
    names = to_a_cycle(tmp_path, rails=3)
    said = run("constraint", tmp_path, "-o", tmp_path / "c.npz")
    lines = [line for line in said.splitlines() if line.startswith("hand_")]
    assert [" free " in line for line in lines] == [number < 5 for number in range(8)]
    assert [" held " in line for line in lines] == [number >= 5 for number in range(8)]
    assert said.startswith("! Demonstrations differ: free for 5, held for 3 of 8 demonstrations")
    assert f"with --leave-out {','.join(names[:5])}." in " ".join(said.split())
    assert "Maybe free" not in said
    left = run(
        "constraint", *sorted(tmp_path.glob("*.csv")), "--leave-out", ",".join(names[:5]), "-o", tmp_path / "r.npz"
    )
    assert "Demonstrations differ" not in left
    assert "Shape of the path, held or not: a line for each of 3 demonstrations" in left


def wiped_once(path, seed):
    """One stroke towards the middle of a tilted plate, by a hand that varies, in mm: its velocities are half noise."""
    rng, step = np.random.default_rng(seed), 0.0125
    size, turn, varied = rng.uniform(80, 160), rng.uniform(0, 6.28), np.zeros(2)
    at, seen = size * np.array([np.cos(turn), np.sin(turn)]), []
    for _ in range(420):
        seen.append(at)
        wanted = (160 * np.array([-at[1], at[0]]) - 70 * at) / np.hypot(np.hypot(*at), 60)
        varied = varied * (1 - step / 0.3) + 0.04 * np.sqrt(step / 0.15) * rng.standard_normal(2)
        at = at + step * (wanted + np.hypot(*wanted) * varied)
    plate = np.pad(seen, ((24, 60), (0, 0)), "edge") @ [[1, 0, 0], [0, np.cos(0.6), np.sin(0.6)]]
    sensor = gaussian_filter1d(rng.standard_normal((len(plate), 3)), 2, axis=0)
    write(path, "t [s],x [mm],y [mm],z [mm]", [step * np.arange(len(plate)), plate + 0.9 * sensor / sensor.std(axis=0)])
    return path


def test_what_is_learnt_of_one_recording_holds_no_more_than_its_plane_as_among_others(tmp_path):
    files = [wiped_once(tmp_path / f"w{seed}.csv", seed) for seed in (44, 34)]
    alone = [json.loads(run("constraint", one, "-o", tmp_path / f"{one.stem}.npz", "--json")) for one in files]
    assert [one["mechanism"].partition(" through")[0] for one in alone] == 2 * ["a plane"]
    assert [one["rank"] for one in alone] == 2 * [1]
    told = json.loads(run("constraint", *files, "-o", tmp_path / "all.npz", "--json"))
    assert {one["rank"] for one in told["each"].values() or [told]} == {1}
    asked = run("constraint", files[0], "--features", "affine", "-o", tmp_path / "a.npz", "--json")
    assert json.loads(asked)["rank"] == 2  # as asked for


def wiping(rng, normal, samples=250, noise=1e-3):
    """Somebody wipes a plate of its own tilt in loops that wander."""
    turn, begun = np.linspace(0, 6 * np.pi, samples), rng.uniform(0, 6, 2)
    loops = np.column_stack([0.2 * np.cos(turn) + 0.03 * np.sin(0.37 * turn + begun[0]),
                             0.12 * np.sin(turn) + 0.05 * np.cos(0.61 * turn + begun[1])])  # fmt: skip
    up = np.array(normal) / np.linalg.norm(normal)
    across = np.cross([0.0, 1.0, 0.0], up) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], up))
    return loops @ np.stack([across, np.cross(up, across)]) + noise * rng.standard_normal((samples, 3))


def waving(rng, samples=250):
    """The same loops in the air, on a cylinder but for a little more than noise: alone they look held."""
    turn = np.linspace(0, 6 * np.pi, samples)
    path = [0.2 * np.cos(turn), 0.12 * np.sin(turn), 0.02 * np.sin(2 * turn + 1) + 0.02 * np.cos(0.5 * turn)]
    return np.column_stack(path) + 1e-3 * rng.standard_normal((samples, 3))


@pytest.mark.parametrize("last", ["in the air", "on a plate", "on a plate, by another sensor"])
def test_one_that_nothing_holds_is_told_among_plates_of_other_tilts_and_makes_nothing_else_of_them(tmp_path, last):
    rng = np.random.default_rng(0)
    for k in range(6):
        normal = (0.4 * np.cos(k), 0.4 * np.sin(k), 1.0)
        write(tmp_path / f"plate{k}.csv", "t,x,y,z", [0.02 * np.arange(250), wiping(rng, normal)])
    noise = 2e-3 if "sensor" in last else 1e-3
    seventh = waving(rng) if last == "in the air" else wiping(rng, (0.3, 0.1, 1.0), noise=noise)
    write(tmp_path / "other.csv", "t,x,y,z", [0.02 * np.arange(250), seventh])
    said = run("constraint", tmp_path / "*.csv", "--state", "x,y,z", "--differentiate", "-o", tmp_path / "c.npz")
    if last != "in the air":
        assert "a plane for each of 7 demonstrations, against nothing held" in said
        return
    assert "Demonstrations differ: free for 1, plane for 6 of 7 demonstrations" in " ".join(said.split())
    assert "in each of 7" not in said
    assert "--leave-out other" in said
    assert [line.split()[0] for line in said.splitlines() if " free " in line and "of 3" in line] == ["other"]


@pytest.mark.parametrize(("radius", "flat"), [(40.0, True), (25.0, True), (0.5, False)])
def test_a_plane_is_decided_where_only_a_sphere_too_large_to_matter_does_as_well(tmp_path, radius, flat):
    normal = np.array([0.0, 0.3, 1.0]) / np.linalg.norm([0.0, 0.3, 1.0])
    stroke = wiping(np.random.default_rng(1), normal, 400)
    bent = stroke + np.outer((stroke**2).sum(axis=1) / (2 * radius), normal)
    write(tmp_path / "one.csv", "t,x,y,z", [0.02 * np.arange(400), bent])
    said = run("constraint", tmp_path / "one.csv", "--state", "x,y,z", "--differentiate", "-o", tmp_path / "c.npz")
    assert ("a plane through" in said) == ("or a sphere so large that it looks flat (" in said) == flat
    assert "undecided" not in said
    assert "Positions do not decide it" not in said


def pot(path, radius=0.06, seed=0):
    """Round a pot and down along its wall, nearly in circles at one height in the end."""
    rng, time = np.random.default_rng(seed), np.linspace(0, 5, 400)
    angle, height = 3.0 * time, -0.05 * np.exp(-time)
    states = np.column_stack([0.45 + radius * np.cos(angle), 0.05 + radius * np.sin(angle), 0.2 + height])
    write(path, "t,x,y,z", [time, states + 5e-4 * rng.standard_normal((400, 3))])
    return path


COLUMNS = ("--state", "x,y,z", "--differentiate")


def off_the_wall(path):
    """The share of the radial direction that a stored constraint lets pass about the pot."""
    angle = np.linspace(0, 6, 50)
    out = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    held = uc.load(path, uc.LearntConstraint).projection([0.45, 0.05, 0.2] + 0.06 * out)
    return np.median(np.linalg.norm((held @ out[:, :, None])[:, :, 0], axis=1))


def test_what_is_learnt_on_the_wall_of_a_pot_holds_it_and_a_roll_out_stays_there(tmp_path):
    pot(tmp_path / "pot.csv")
    said = " ".join(run("constraint", tmp_path / "pot.csv", *COLUMNS, "-o", tmp_path / "c.npz").split())
    assert said.startswith("! 1 of 3 directions were held, by a cylinder. It was passed one way only, so velocities")
    assert "The file holds to the mechanism, a cylinder: 1 of 3 directions." in said
    assert off_the_wall(tmp_path / "c.npz") < 0.1
    assert json.loads(run("info", tmp_path / "c.npz", "--json"))["held"] == "1 of 3 directions"
    run("fit", pot(tmp_path / "wide.csv", 0.07, 1), pot(tmp_path / "mid.csv", 0.06, 2), *COLUMNS, "--learner",
        "direct", "-o", tmp_path / "p.npz")  # fmt: skip
    way = ("--start", "0.51,0.05,0.2", "--steps", 200, "--least-support", 0, "-o", tmp_path / "path.csv")
    run("rollout", tmp_path / "p.npz", *way, "--constraint", tmp_path / "c.npz")
    path = np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1)
    assert_allclose(np.hypot(path[:, 1] - 0.45, path[:, 2] - 0.05), 0.06, atol=2e-3)


def test_features_that_contradict_the_mechanism_make_no_good_constraint(tmp_path, tilted):
    order = ("constraint", pot(tmp_path / "pot.csv"), *COLUMNS, "--features", "constant", "-o", tmp_path / "c.npz")
    run(*order)
    assert off_the_wall(tmp_path / "c.npz") > 0.9
    for said in (run(*order, "--force"), run("info", tmp_path / "c.npz")):
        assert said.startswith("!")
        assert "positions keep to a cylinder, and what was learnt lets pass" in " ".join(said.split())
    flat = run("constraint", tilted / "plate_1.csv", "--features", "constant", "-o", tmp_path / "p.npz")
    assert "lets pass" not in flat


def test_a_surface_is_learnt_by_features_that_vary_without_being_told(tmp_path):
    order = ("constraint", pot(tmp_path / "pot.csv"), *COLUMNS, "--surface", "-o", tmp_path / "s.npz")
    run(*order)
    assert off_the_wall(tmp_path / "s.npz") < 0.1
    assert "got 'constant', and the height above a surface varies" in refused(
        *order, "--features", "constant", "--force"
    )


def test_what_free_strokes_may_do_is_a_doubt_of_the_constraint_in_python_too(falling, tilted):
    def doubts(place):
        [demo] = uc.prepare(uc.read(place), uc.Recipe(states=uc.read(place)[0].columns[:3], differentiate="savgol"))
        return " ".join(uc.LearntConstraint("constant").fit(demo.states, demo.actions).choice_.doubts)

    assert "Free strokes that turn as little keep to a surface of their own, too" in doubts(falling / "fall_1.csv")
    assert "Free strokes" not in doubts(tilted / "plate_1.csv")


def test_a_table_claims_nothing_that_the_verdict_does_not(falling, tilted, tmp_path):
    said = run("constraint", falling, *COLUMNS, "-o", tmp_path / "c.npz")
    assert "looks held" in said
    assert "Shape of the path, held or not" in said
    assert "Mechanism" not in said
    assert "nothing held" not in said
    sure = run("constraint", tilted / "plate_1.csv", "-o", tmp_path / "p.npz")
    assert "Mechanism: a plane" in sure


def test_one_that_keeps_to_nothing_exactly_leaves_the_others_their_mechanism(tmp_path):
    time = np.linspace(0, 5, 400)
    pot(tmp_path / "pot_0.csv", 0.1 + 0.01 * (time / 5))
    pot(tmp_path / "pot_1.csv", 0.06, 1)
    for number, tilt in enumerate((0.2, 0.4, -0.3, 0.6, -0.5)):
        flat = np.column_stack([0.1 * np.cos(3 * time), 0.07 * np.sin(3 * time) * (1 + time / 9)])
        states = [0.45, 0.05, 0.2] + flat @ [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)]]
        states += 5e-4 * np.random.default_rng(number).standard_normal((400, 3))
        write(tmp_path / f"plane_{number}.csv", "t,x,y,z", [time, states])
    said = run("constraint", tmp_path, *COLUMNS, "-o", tmp_path / "c.npz")
    rows = {line.split()[0]: line for line in said.splitlines() if line.startswith(("pot_", "plane_"))}
    assert sum("1 of 3" in line and " plane " in line for line in rows.values()) == 5
    assert "1 of 3, cylinder" in rows["pot_1"]


AXIS, AWAY = np.array([0.48, 0.6, 0.64]), np.array([0.8, 0.0, -0.6])
AHEAD = np.cross(AXIS, AWAY)


def on_a(kind, samples=300, seed=0):
    """One stroke on a mechanism about AXIS through the origin, 0.5 mm of noise, and how far off it positions are."""
    time, noise = np.linspace(0, 1, samples), 5e-4 * np.random.default_rng(seed).standard_normal((samples, 3))
    turn = {"hinge": 0.8, "pot": 12.0}.get(kind, 0.0) * (1 - np.cos(np.pi * time)) / 2
    if kind in ("leg", "knob"):
        turn = (2.2 if kind == "leg" else 2.5) * (1 - np.cos(np.pi * time)) / 2
    round_ = 0.7 * (np.outer(np.cos(turn), AWAY) + np.outer(np.sin(turn), AHEAD))
    up = 0.9 * np.sin(np.pi * (1 - np.cos(np.pi * time)))[:, None]
    way, bow = 0.4 * (1 - np.cos(np.pi * time)) / 2, 0.05 * np.sin(2 * np.pi * time)
    states = {
        "hinge": round_,
        "pot": round_ + np.outer(0.3 * time**2, AXIS),
        "leg": round_ + np.outer(0.5 * np.sin(2 * np.pi * time), AXIS),
        "knob": np.cos(up) * round_ + 0.7 * np.sin(up) * AXIS,
        "drawer": np.outer(way, AXIS),
        "window": np.outer(way, AHEAD) + np.outer(bow, AWAY),
    }[kind]

    def off(places):
        along, across = places @ AXIS, places - np.outer(places @ AXIS, AXIS)
        ball = abs(np.linalg.norm(places, axis=1) - 0.7)
        apart = {"window": abs(along), "drawer": np.linalg.norm(across, axis=1), "knob": ball}
        wall = abs(np.linalg.norm(across, axis=1) - 0.7)
        return apart.get(kind, np.maximum(wall, abs(along) * (kind == "hinge"))).max()

    return np.column_stack([3 * time, states + noise]), states[0], off


@pytest.fixture(scope="module")
def drifting(tmp_path_factory):
    """A policy that goes everywhere: along no mechanism of these tests alone."""
    states = np.random.default_rng(0).uniform(-1, 1, (100, 3))
    path = tmp_path_factory.mktemp("policy") / "p.npz"
    uc.save(uc.ParametricPolicy(uc.Affine(), "direct").fit(states, 0.2 * np.roll(states, 1, axis=1) + 0.3), path)
    return path


HEAD = "t,x,y,z"
STAYS = {"hinge": "a circle (hinge): 2", "drawer": "a line: 2", "window": "a plane: 1", "pot": "a cylinder: 1"}
STAYS |= {"leg": "a cylinder: 1", "knob": "a sphere: 1"}  # of one short stroke, as free ones may look


@pytest.mark.parametrize("kind", STAYS)
def test_the_file_of_one_stroke_is_its_mechanism_and_a_roll_out_stays_on_it(kind, drifting, tmp_path):
    rows, start, off = on_a(kind)
    one = write(tmp_path / "one.csv", HEAD, [rows])
    told = run("constraint", one, *COLUMNS, "-o", tmp_path / "c.npz"), run("info", tmp_path / "c.npz")
    for said in told:
        assert f"The file holds to the mechanism, {STAYS[kind]} of 3 directions." in " ".join(said.split())
    assert f"a learnt constraint: {STAYS[kind].partition(':')[0]}" in told[1]
    held, way = ("--constraint", tmp_path / "c.npz"), ("--start", ",".join(f"{one:.9f}" for one in start))
    run("rollout", drifting, *held, *way, "--least-support", 0, "--steps", 100, "-o", tmp_path / "path.csv")
    path = np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1)[:, 1:4]
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() > 0.1
    assert off(path) < 1e-3
    loaded = uc.load(tmp_path / "c.npz", uc.LearntConstraint)
    moved = uc.rollout(uc.load(drifting), start, 100, 0.02, loaded, least_support=0.0)
    assert_allclose(moved.states, path, atol=1e-6)
    scored = json.loads(run("score", drifting, one, *COLUMNS, *held, "--json"))["all"]
    assert scored["npoe"] < 0.02
    run("look", one, tmp_path / "c.npz", "-o", tmp_path / "look.html")
    shown = json.loads(re.search(r"const shown = (.*);\n", (tmp_path / "look.html").read_text("utf-8"))[1])
    assert {len(patch["free"]) for patch in shown["patches"]} == {3 - int(STAYS[kind][-1])}


@pytest.mark.parametrize("how", [("--features", "affine"), ("--with-task",), ("--surface",)])
@pytest.mark.parametrize("kind", ["window", "knob"])
def test_what_was_asked_for_is_in_the_file_in_place_of_the_mechanism_and_how_to_have_that_is_said(how, kind, tmp_path):
    one = write(tmp_path / "one.csv", HEAD, [on_a(kind)[0]])
    said = " ".join(run("constraint", one, *COLUMNS, *how, "-o", tmp_path / "c.npz").split())
    assert "The file holds to what was learnt, by" in said
    assert f"Learnt without {how[0]}, it holds to the mechanism." in said
    assert "name the --features" not in said
    assert uc.load(tmp_path / "c.npz", uc.LearntConstraint).mechanism_ is None


@pytest.mark.parametrize(("kind", "why"), [("knob", "each state was passed one way"), ("window", "free strokes that")])
def test_a_file_of_a_mechanism_that_may_be_of_a_free_stroke_says_so_and_that_nothing_is_missing(kind, why, tmp_path):
    one, file = write(tmp_path / "one.csv", HEAD, [on_a(kind)[0]]), tmp_path / "c.npz"
    told = json.loads(run("constraint", one, *COLUMNS, "-o", file, "--json"))["verdict"]
    assert told["mark"] == "doubtful"
    assert told["said"].startswith(f"Whether anything was held cannot be told by one demonstration alone: {why}")
    assert told["doubt"] == "That 1 of 3 are held."
    assert told["next"].startswith("Use it with --constraint of 'rollout' or 'score', which follow the mechanism.")
    assert json.loads(run("info", file, "--json"))["verdict"] == told


@pytest.mark.parametrize("waves", [0, 9], ids=["as a screw", "up and down"])
def test_what_comes_next_is_one_where_the_file_holds_to_a_mechanism_that_positions_show(waves, tmp_path):
    rows = on_a("pot")[0]
    rows[:, 1:] += np.outer(0.3 * np.sin(waves * rows[:, 0] / 3), AXIS)
    one = write(tmp_path / "one.csv", HEAD, [rows])
    told = json.loads(run("constraint", one, *COLUMNS, "-o", tmp_path / "c.npz", "--json"))["verdict"]
    assert told["said"].startswith("1 of 3 directions were held")
    assert told["next"] == "Use it with --constraint of 'rollout' or 'score', which follow the mechanism."
    assert "name the features" not in told["doubt"]


def test_what_holds_all_alike_is_learnt_in_common_and_how_to_have_one_mechanism_is_said(tmp_path):
    strokes_to(tmp_path, {f"rail_{number}": (0.0, 1.0, 0.0) for number in range(3)})
    for which in ((), ("--episodes", "rail_0")):
        said = " ".join(run("constraint", tmp_path / "*.csv", *which, "-o", tmp_path / "c.npz", "--force").split())
        assert ("Learnt of one alone, with --episodes, it holds to the mechanism." in said) == (not which)
        assert ("The file holds to the mechanism, a line" in said) == bool(which)


def falls(seed):
    """A free stroke to a goal and a little round it, which turns too little to tell what holds it."""
    rng, goal, axis = np.random.default_rng(seed), np.array([0.45, 0.1, 1.05]), np.array([0.25, 0.15, 0.95])
    at = goal + 0.6 * (way := rng.standard_normal(3)) / np.linalg.norm(way)
    seen = []
    for _ in range(400):
        seen.append(at)
        d = at - goal
        at = at + 0.01 * (-0.7 * d + 0.55 * np.cross(axis, d)) / np.sqrt(1 + (d @ d) / 0.36)
    return np.column_stack([0.01 * np.arange(400), seen + 6e-4 * rng.standard_normal((400, 3))])


@pytest.mark.parametrize(("seed", "decided"), [(2, True), (3, False)])
def test_a_free_stroke_that_happens_to_be_on_a_surface_is_no_sure_constraint(seed, decided, tmp_path):
    said = run("constraint", write(tmp_path / "one.csv", HEAD, [falls(seed)]), *COLUMNS, "-o", tmp_path / "c.npz")
    assert "a cylinder about" in said
    assert said.startswith("! Whether anything was held cannot be told by one demonstration alone")
    assert "Do not trust: That 1 of 3 are held." in said
    assert "it holds to the mechanism" not in " ".join(said.split())
    assert ("The file holds to the mechanism, a cylinder" in " ".join(said.split())) == decided
    assert (uc.load(tmp_path / "c.npz", uc.LearntConstraint).mechanism_ is not None) == decided


def test_where_positions_say_that_nothing_held_it_the_file_is_no_constraint_to_be_used(tmp_path):
    to_a_cycle(tmp_path)
    for files, who in ((["hand_1.csv"], "it"), (["hand_1.csv", "hand_2.csv"], "all of them")):
        paths = [tmp_path / one for one in files]
        order = ("constraint", *paths, "-o", tmp_path / "c.npz", "--force", "--json")
        told = json.loads(run(*order))
        assert told["mechanism"].startswith("a movement that nothing holds, against")
        assert told["verdict"]["said"].startswith(f"Positions say that nothing held {who}. ")
        assert told["verdict"]["next"].startswith("Do not use it as a constraint, if these are positions.")
        assert ("Learn it of each alone" in told["verdict"]["next"]) == (len(files) > 1)
    run("constraint", tmp_path / "hand_1.csv", "-o", tmp_path / "c.npz", "--force")
    said = " ".join(run("info", tmp_path / "c.npz").split())
    assert said.startswith("! Positions say that nothing held it. The file holds to what was learnt, by quadratic")
    run("fit", tmp_path / "hand_1.csv", tmp_path / "hand_2.csv", "--learner", "direct", "-o", tmp_path / "p.npz")
    way = ("--start", "0.1,0.1", "--steps", 3, "--constraint", tmp_path / "c.npz")
    assert "c.npz: Positions say that nothing held it." in call("rollout", tmp_path / "p.npz", *way).stderr
    several = ("constraint", *(tmp_path / f"hand_{number}.csv" for number in range(5)), "-o", tmp_path / "s.npz")
    assert run(*several).startswith("! Positions say that nothing held all of them. ")
    assert "nothing held" not in run("info", tmp_path / "s_hand_1.npz").split("\n\n")[0]  # that is not of each
    undecided = write(tmp_path / "one.csv", HEAD, [falls(0)])
    assert "nothing held it" not in run("constraint", undecided, *COLUMNS, "-o", tmp_path / "u.npz").split("\n\n")[0]


def test_doors_windows_and_a_free_stroke_have_a_file_each_and_the_verdict_counts_as_the_table(tmp_path):
    for number in range(2):
        for kind in ("hinge", "window"):
            rows = on_a(kind, seed=number)[0] @ np.eye(4)[[0, *np.roll([1, 2, 3], number)]]
            write(tmp_path / f"{kind}_{number}.csv", HEAD, [np.add(rows, [0, number, 0, 0])])
    write(tmp_path / "free_0.csv", HEAD, [falls(0)])
    said = run("constraint", tmp_path / "*.csv", *COLUMNS, "-o", tmp_path / "c.npz")
    rows = {line.split()[0]: line for line in said.splitlines() if line.startswith(("hinge_", "window_", "free_"))}
    assert all("2 of 3, circle" in rows[f"hinge_{number}"] for number in range(2))
    assert all("1 of 3, plane" in rows[f"window_{number}"] for number in range(2))
    assert ", plane" not in rows["free_0"]
    assert ", cylinder" not in rows["free_0"]
    assert "Do not trust: That 1 to 2 of 3 are held." in said
    assert "4 of the 5 files hold to mechanisms, the others to what was learnt." in " ".join(said.split())


def test_a_mechanism_that_was_saved_in_python_is_a_constraint_of_the_commands(drifting, tmp_path):
    rows, start, off = on_a("hinge")
    uc.save(uc.constraints.identify(rows[:, 1:]).mechanism, tmp_path / "m.npz")
    held, way = ("--constraint", tmp_path / "m.npz"), ("--start", ",".join(map(str, start)), "--least-support", 0)
    run("rollout", drifting, *held, *way, "--steps", 50, "-o", tmp_path / "path.csv")
    assert off(np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1)[:, 1:4]) < 2e-3
    said = run("info", tmp_path / "m.npz")
    assert "2 of 3 directions" in said
    assert "a mechanism: a circle (hinge)" in said
    one = write(tmp_path / "one.csv", HEAD, [rows])
    run("look", one, tmp_path / "m.npz", *COLUMNS, "-o", tmp_path / "look.html")
    flat = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    uc.save(uc.ParametricPolicy(uc.Affine(), "direct").fit(flat, flat), tmp_path / "flat.npz")
    said = refused("rollout", tmp_path / "flat.npz", "--start", "0,0", *held)
    assert "m.npz: holds 3 actions at 3 states, expected 2 at 2." in said


def test_a_printed_direction_can_be_copied_it_is_rounded_by_far_less_than_its_margin(tmp_path):
    write(tmp_path / "one.csv", "t,x [m],y [m],z [m]", [on_a("drawer", 2000)[0]])
    said = " ".join(run("constraint", tmp_path / "one.csv", "-o", tmp_path / "c.npz").split())
    printed, margin = re.search(r"along \((.*?)\) ± ([\d.]+)°", said).groups()
    way, axis = (
        np.array([float(one) for one in printed.split(",")]),
        uc.load(tmp_path / "c.npz", uc.LearntConstraint).mechanism_.axis,
    )
    assert np.degrees(np.linalg.norm(np.cross(way, axis))) < 0.15 * float(margin)
    assert re.search(r"a line through \(.*?\) m ± [\d.]+ mm along", said)

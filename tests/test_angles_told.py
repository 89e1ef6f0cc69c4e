"""Angles from the recordings to the robot: in which unit they are, and which columns were taken for none."""

import json
import shlex

import numpy as np
import pytest

from test_cli import call, run, write
from test_newcomer import LINEAR, stroke, text

STATES = ("--state", "x,y,heading", "--differentiate", "--angle", "heading")


def turning(number):
    """Time, position in mm, and an angle in degrees that jumps by 360 as it passes half a turn."""
    rows = stroke(number)
    heading = 150.0 + 20.0 * number + 60.0 * (1.0 - np.exp(-rows[:, 0])) + 0.1 * rows[:, 1]
    return np.column_stack([rows, (heading + 180.0) % 360.0 - 180.0])


def recorded(place, head="t,x,y,heading", count=4, made=turning):
    place.mkdir(exist_ok=True)
    for k in range(count):
        write(place / f"w{k}.csv", head, made(k))
    return place


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """Strokes with an angle in degrees, and a policy learnt from them."""
    folder = recorded(tmp_path_factory.mktemp("angles") / "w")
    run("fit", folder, *STATES, *LINEAR, "-o", folder.parent / "p.npz")
    return folder


# The unit of what was learnt


def test_everything_that_is_made_of_a_policy_says_that_it_takes_radians(turned, tmp_path):
    policy = turned.parent / "p.npz"
    run("export", policy, "-o", tmp_path / "p.c")
    run("export", policy, "-o", tmp_path / "p.js")
    run("export", policy, "--ros2", tmp_path / "p")
    files = ["p.c", "p.h", "p.js", "p/README.md", "p/src/p.c", "p/scripts/p_loop.py"]
    for said in [run("info", policy), *((tmp_path / one).read_text() for one in files)]:
        said = " ".join(said.replace(":", " ").split())
        assert "states x, y, heading (rad)" in said
        assert "actions vx, vy, vheading (rad/s)" in said
        assert "recorded in degrees heading" in said
    compile((tmp_path / "p/scripts/p_loop.py").read_text(), "loop", "exec")


@pytest.mark.parametrize(
    ("head", "states", "actions"),
    [
        ("t,x [m],y [m],heading [deg]", "x [m], y [m], heading (rad)", "vx [m/s], vy [m/s], vheading (rad/s)"),
        ("t,x [m],y [m],heading [rad]", "x [m], y [m], heading [rad]", "vx [m/s], vy [m/s], vheading [rad/s]"),
    ],
)
def test_so_it_does_where_the_name_of_a_column_says_another_unit(tmp_path, head, states, actions):
    folder = recorded(tmp_path / "w", head, made=lambda k: turning(k) * [1, 1, 1, 1 if "deg" in head else np.pi / 180])
    run("fit", folder, *STATES, *LINEAR, "-o", tmp_path / "p.npz")
    told = json.loads(run("info", tmp_path / "p.npz", "--json"))
    assert (", ".join(told["states"]), ", ".join(told["actions"])) == (states, actions)
    assert told["recorded in degrees"] == ["heading [deg]"] * ("deg" in head)


def test_degrees_where_the_unit_says_radians_are_not_converted_and_that_is_said(tmp_path):
    folder = recorded(tmp_path / "w", "t,x,y,heading [rad]", made=lambda k: turning(k) * [1, 1, 1, np.pi / 180])
    given = "fit", folder, *STATES, *LINEAR, "-o", tmp_path / "p.npz"
    assert "heading [rad] is in radians, as its unit says" in text(call(*given, "--degrees", "heading"))
    assert "as its unit says" not in text(call(*given, "--force"))


def test_a_start_in_degrees_is_told_and_one_in_radians_is_not(turned, tmp_path):
    given = "rollout", turned.parent / "p.npz", "--least-support", 0, "--steps", 3, "-o", tmp_path / "r.csv", "--force"
    said = text(call(*given, "--start", "0,0,98.61"))
    assert "98.61 is far outside radians, which the policy takes for heading; if it is in degrees" in said
    assert "that is 1.721" in said
    assert "radians" not in text(call(*given, "--start", "98.61,0,1.721"))


def test_a_goal_in_degrees_is_told_and_one_in_radians_is_not(tmp_path):
    times, goal = np.linspace(0.0, 4.0, 80)[:, None], np.array([30.0, 45.0])
    for k, begin in enumerate(((90.0, 20.0), (40.0, -70.0), (-60.0, 50.0), (10.0, 80.0))):
        states = goal + (begin - goal) * np.exp(-times)
        write(tmp_path / f"j{k}.csv", "t,q1 [deg],q2 [deg]", np.hstack([times, states]))
    fit = ("fit", tmp_path, *LINEAR, "-o", tmp_path.parent / "goal.npz", "--force", "--guided")
    said = text(call(*fit, "30,45"))
    assert "--guided: 30 is far outside radians, which the policy takes for q1 [deg]; if it is in degrees" in said
    assert "that is 0.5236" in said
    assert "that is 0.7854" in said
    assert "far outside radians" not in text(call(*fit, "0.5236,0.7854"))
    assert "far outside radians" not in text(call(*fit, "auto"))


def test_a_movement_says_its_unit_and_is_scored_as_what_it_is(turned, tmp_path):
    moved, policy = tmp_path / "r.csv", turned.parent / "p.npz"
    run("rollout", policy, "--start", "0,0,1.721", "--least-support", 0, "-o", moved)
    assert moved.read_text().startswith("t,x,y,heading (rad),vx,vy,vheading (rad/s)\n")
    assert json.loads(run("score", policy, moved, "--json"))["rows"][0]["explains"] > 0.999


# Columns that are left out


@pytest.mark.parametrize(
    "head", ["t,x,y,heading", "stamp,x,y,theta", "t,x [m],y [m],yaw [deg]", "t,pos_x,pos_y,phi", "t,x,y,gripper"]
)
def test_an_angle_that_is_left_out_is_told_by_its_name_or_its_jumps_and_taken_in_as_said(tmp_path, head):
    name = head.split(",")[-1]
    said = run("inspect", folder := recorded(tmp_path / "w", head))
    assert said.startswith("! ")
    assert "angle-unused" in said
    assert f"column {name!r}: looks like an angle, and is left out; take it in with" in said
    [typed] = [line for line in said.splitlines() if line.startswith("    unconstrain fit ")]
    assert "angle-unused" in text(call("fit", folder, *LINEAR, "-o", tmp_path / "p.npz"))
    given = [tmp_path / "q.npz" if one == "policy.npz" else one for one in shlex.split(typed)[1:]]
    told = text(call(*given, *LINEAR))
    assert f"{name} (an angle) as states" in told
    assert f"{name} in radians" in told
    assert "unused" not in told


def test_an_angle_in_radians_is_not_taken_for_degrees(tmp_path):
    folder = recorded(tmp_path / "w", "t,x,y,theta", made=lambda k: turning(k) * [1, 1, 1, np.pi / 180])
    assert "take it in with --angle theta.\n" in run("inspect", folder)


def test_other_columns_that_move_are_a_note_and_clocks_counts_flags_and_constants_are_not(tmp_path):
    def made(number):
        rows = stroke(number)
        count, n = np.arange(len(rows)), len(rows)
        return np.column_stack([rows, count, 1e3 + rows[:, 0], count > 20, np.full(n, 7.5), np.sin(0.1 * count)])

    folder = recorded(tmp_path / "w", "t,x,y,frame,ticks,touch,status,force", made=made)
    said = run("inspect", folder)
    assert "angle-unused" not in said
    assert (
        "unused: 'w0': force and 4 more, at rest or counts, left out; name with --state what makes the state." in said
    )
    assert "unused: 'w0': force and 4 more" in text(call("fit", folder, *LINEAR, "-o", tmp_path / "p.npz"))
    assert "unused" not in text(call("inspect", folder, "--state", "x,y", "--differentiate"))
    assert "unused" not in text(call("inspect", recorded(tmp_path / "v", "t,x,y", made=stroke)))


# What a turn does to checks


def nearby(number, wound=False, size=1.0):
    """Along one path, the angle near half a turn; ``wound``, of one recording beyond it, so from the other side."""
    rng, t = np.random.default_rng(number), np.linspace(0, 2, 80)
    angle = 179 + rng.uniform(-0.5, 0.5) + 0.3 * np.sin(3 * t + rng.uniform(0, 6)) - 358 * (wound and number == 3)
    table = np.column_stack([t, np.sin(t), t**2 / 3 - t, angle])
    table[:, 1:3] = size * (table[:, 1:3] + 0.03 * rng.standard_normal(2))
    return table


def test_an_angle_on_another_turn_is_no_sign_that_is_turned(tmp_path):
    folder = recorded(tmp_path / "w", count=6, made=lambda k: nearby(k, wound=True))
    assert "columns-differ" not in text(call("inspect", folder, *STATES, "--degrees", "heading"))
    upside = recorded(tmp_path / "v", count=6, made=lambda k: nearby(k) * ([1, 1, -1, 1] if k == 3 else 1))
    assert "columns-differ: 'w3', column 'y'" in text(call("inspect", upside, *STATES, "--degrees", "heading"))
    plain = recorded(tmp_path / "w", "t,x,y,z", count=6, made=lambda k: nearby(k, wound=True))
    assert "columns-differ: 'w3', column 'z'" in text(call("inspect", plain, "--state", "x,y,z", "--differentiate"))


def test_no_scale_is_proposed_beside_angles_which_have_none(tmp_path):
    folder = recorded(tmp_path / "w", made=lambda k: turning(k) * [1, 1000, 1, 1])
    for given in (STATES, ("--state", "x,y,heading", "--differentiate"), ()):
        said = text(call("inspect", folder, *given))
        assert "mixed-units" in said
        assert "--angle heading" in said
        assert "--scale auto -o" not in said
    assert "angles have no scale: give positions in metres" in text(call("inspect", folder, *STATES))
    assert "--scale auto -o" in text(call("inspect", folder, "--state", "x,y", "--differentiate"))


# A tracker that saw nothing yet, or no more


@pytest.mark.parametrize(
    ("rows", "value", "row"), [(slice(0, 8), 0.0, 0), (slice(-8, None), 0.0, 72), (slice(-8, None), -500.0, 72)]
)
def test_one_value_at_an_end_is_lost_sight_and_no_seam_and_is_left_out_as_said(tmp_path, rows, value, row):
    def made(number):
        table = stroke(number, 80)
        table[rows, 1:] = value if number == 2 else table[rows, 1:]
        return table

    said = run("inspect", recorded(tmp_path / "w", "t,x,y", made=made))
    assert f"glitch: 'w2', row {row} " in said
    assert "8 samples far off their neighbours, all too many in a row to repair" in said
    assert "--glitches drop leaves them out. They repeat one value, as where a tracker lost sight." in said
    assert "fit " + str(tmp_path / "w") + " --glitches drop -o policy.npz" in said
    assert "seam" not in said
    given = "fit", tmp_path / "w", *LINEAR, "--glitches", "drop", "-o", tmp_path / "p.npz"
    assert "4 demonstrations, 312 samples" in (told := text(call(*given)))
    assert "seam" not in told
    assert "glitch:" not in told


def test_rest_at_the_origin_from_which_it_moves_on_is_neither_and_a_jump_between_strokes_is_a_seam(tmp_path):
    def made(number):
        table = stroke(number, 80)
        table[:, 1:] -= table[-1 if number == 1 else 0, 1:]
        still = np.column_stack([0.05 * np.arange(8), np.zeros((8, 2))])
        return (
            np.vstack([still, table + np.array([0.4, 0, 0])])
            if number != 1
            else np.vstack([table, still + np.array([4.0, 0, 0])])
        )

    said = run("inspect", recorded(tmp_path / "w", "t,x,y", made=made))
    assert "glitch" not in said
    assert "seam" not in said
    two = np.vstack([stroke(0, 80), stroke(1, 80) + np.array([4.0, 300, 0])])
    told = run("inspect", write(tmp_path / "two.csv", "t,x,y", two), "--state", "x,y", "--differentiate")
    assert "seam: 'two', row 80" in told
    assert "lost sight" not in told


def test_the_page_of_recordings_in_degrees_has_radians(tmp_path):
    folder = recorded(tmp_path / "w", "t,x [m],y [m],heading [deg]")
    run("look", folder, *STATES, "-o", tmp_path / "look.html")
    assert '"units":["m","m","rad"]' in (tmp_path / "look.html").read_text()

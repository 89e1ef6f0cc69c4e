"""What somebody meets whose files are not as they seem: what is said, of which line, and what to type."""

import json
import re
import shlex
import shutil
import warnings
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

import unconstrain as uc
from test_cli import call, refused, run, write
from test_formats import workbook
from test_newcomer import LINEAR, stroke, text
from unconstrain.pages import replays

READ = ("--state", "x,y", "--by", "savgol")


@pytest.fixture
def bare(tmp_path):
    """Four strokes without a header."""
    for k in range(4):
        np.savetxt(tmp_path / f"w{k}.csv", stroke(k), delimiter=",")
    return tmp_path


# The clock


def test_a_first_column_that_rises_as_a_clock_is_told_and_the_command_that_follows_takes_it_for_one(bare):
    said = text(call("inspect", bare))
    assert "column 'column1': rises steadily, as a clock: if it is one, say --time column1;" in said
    assert "--state column2,column3 --time column1 --differentiate" in said
    assert "--state column2,column3" in text(call("inspect", bare, "--state", "column1,column2"))
    assert "clock-untold" not in text(call("inspect", bare, "--time", "column1"))
    write(bare / "w0.csv", "x,y,z", stroke(0)[:, [1, 2, 0]])  # neither is what rises elsewhere
    assert "clock-untold" not in text(call("inspect", bare / "w0.csv"))
    grid = np.column_stack([np.linspace(0, 1, 40), *np.random.default_rng(0).normal(size=(3, 40))])
    assert "clock-untold" not in text(call("inspect", write(bare / "w0.csv", "x,y,vx,vy", grid)))  # one that is named


def test_a_count_of_rows_that_is_told_as_the_time_is_answered_with_the_column_that_tells_it(tmp_path):
    counted = np.column_stack([np.arange(1000.0, 1040.0), stroke(0)])
    file = write(tmp_path / "w.csv", "seq,stamp,x,y", counted)
    said = text(call("inspect", file, *READ, "--time", "seq"))
    assert "counts rows, one by one, so it tells no time; name one that does with --time stamp." in said
    assert "--time-unit" not in said
    [typed] = re.findall(r"Then: unconstrain (fit .*) -o policy.npz", said)
    assert "--time stamp" in typed
    assert "seq" not in typed
    assert "clock-unit" not in text(call("inspect", file, *READ, "--time", "stamp"))
    alone = text(call("inspect", write(tmp_path / "v.csv", "seq,x,y", counted[:, [0, 2, 3]]), *READ, "--time", "seq"))
    assert "1 samples a second; if all are so, say the unit" in alone


def test_that_nothing_tells_the_time_is_said_before_fit_refuses(tmp_path):
    file = write(tmp_path / "w.csv", "x,y", stroke(0)[:, 1:])
    said = text(call("inspect", file))
    assert "fit needs to know more" in said or "Nothing tells the time, which velocities take" in said
    assert "--rate HZ" in said
    assert "Nothing tells the time" not in text(call("inspect", file, "--rate", 20))


# Encoders


def arrival(counts, seam=False, rest=0):
    """Four joints (T, 5), the first hardly moved, that come slowly to a goal, in counts of an encoder of so many."""
    clock = np.arange(2400) * 0.004
    joints = [0.0012, 0.05, 0.08, 0.05] * np.exp(-clock[:, None] * [0.45, 0.5, 0.4, 0.45])
    joints[1000:] += 0.02 * seam
    joints = np.insert(joints, [600] * rest, joints[600], axis=0)
    joints = np.round((joints + 0.4) * counts / (2 * np.pi)) * 2 * np.pi / counts
    return np.column_stack([np.arange(len(joints)) * 0.004, joints])


@pytest.mark.parametrize("bits", [12, 14])
def test_single_counts_of_an_encoder_are_no_jumps_and_a_slow_arrival_is_no_pause(tmp_path, bits):
    how = ("--state", "q0,q1,q2,q3", "--differentiate")
    for kind, given in {"plain": {}, "seam": {"seam": True}, "rest": {"rest": 800}}.items():
        file = write(tmp_path / f"{kind}.csv", "t,q0,q1,q2,q3", arrival(2**bits, **given))
        [found] = json.loads(call("inspect", file, *how, "--json").out)["demonstrations"]
        codes = {one["code"] for one in found["warnings"]}
        assert ("seam" in codes) == (kind == "seam")
        assert ("pause" in codes) == (kind == "rest")


# Rows without numbers


def warned_of(file, *how):
    """Codes with the rows that a look at one recording warns of."""
    [found] = json.loads(run("inspect", file, *how, "--json"))["demonstrations"]
    return {one["code"]: one["row"] for one in found["warnings"] if one["code"] != "few-demonstrations"}


def test_rows_without_numbers_are_left_out_as_rows_that_the_clock_misses(tmp_path):
    whole = [stroke(k, jitter=0.0) for k in range(4)]
    empty, absent = whole[0].copy(), np.delete(whole[0], slice(12, 22), axis=0)
    empty[12:22, 1:] = np.nan
    policies = []
    for name, first in {"empty": empty, "absent": absent}.items():
        (tmp_path / name).mkdir()
        files = [write(tmp_path / name / f"w{k}.csv", "t,x,y", one) for k, one in enumerate([first, *whole[1:]])]
        said = text(call("inspect", *files, *READ))
        assert said.startswith("✔ 4 demonstrations, nothing odd but gaps in time")
        typed = re.search(r"Next: unconstrain (fit .* -o) policy.npz", said)[1]
        ran = call(*shlex.split(typed), tmp_path / f"{name}.npz", *LINEAR)
        assert ran.code == 0
        assert ("empty-cells: 'w0', row 12 (line 14): 10 rows without numbers in x, y" in text(ran)) == (
            name == "empty"
        )
        assert "clock-gap: 'w0'" in text(ran)
        policies.append(uc.load(tmp_path / f"{name}.npz"))
        told = warned_of(files[0], *READ)
        assert told == ({"empty-cells": 12, "clock-gap": 22} if name == "empty" else {"clock-gap": 12})
    assert np.array_equal(*(policy.predict(whole[1][:, 1:]) for policy in policies))
    strict = call("fit", tmp_path / "empty", *READ, *LINEAR, "-o", tmp_path / "p.npz", "--strict")
    assert strict.code == 2
    assert not (tmp_path / "p.npz").exists()


def test_rows_without_numbers_are_refused_where_no_clock_shows_that_they_are_missing(tmp_path):
    rows = np.column_stack([stroke(0)[:, 1:], stroke(1)[:, 1:]])
    rows[12, 0] = np.nan
    file, how = write(tmp_path / "w.csv", "x,y,vx,vy", rows), ("--state", "x,y", "--action", "vx,vy")
    assert "column 'x': found nan" in refused("fit", file, *how, "-o", tmp_path / "p.npz")
    assert warned_of(file, *how) == {"missing": 12}
    assert warned_of(file, *how, "--rate", "20") == {"empty-cells": 12}


@pytest.mark.parametrize("absent", [3, 7])
def test_rows_that_are_missing_among_regular_stamps_are_said_and_counted_in_one_way(tmp_path, absent):
    rows = np.delete(stroke(0, jitter=0.0), slice(12, 12 + absent), axis=0)
    [found] = json.loads(run("inspect", write(tmp_path / "w.csv", "t,x,y", rows), *READ, "--json"))["demonstrations"]
    codes = {one["code"] for one in found["warnings"]}
    notes = {one["code"]: one["message"] for one in found["notes"]}
    assert len(found["gaps"]) == ("clock-gap" in codes) == (absent > 4)
    assert ("rows-missing" in notes) == (absent == 3)
    assert "3 rows are missing" in notes.get("rows-missing", "3 rows are missing")
    assert "irregular" not in notes
    assert found["jitter"] < 0.001
    jittered = write(tmp_path / "w.csv", "t,x,y", stroke(0, jitter=0.2))
    assert "irregular: 'w': time stamps are irregular" in text(call("inspect", jittered, *READ))


@pytest.mark.parametrize("seed", [1, 2])
def test_strokes_on_plates_that_are_tilted_a_little_are_not_taken_for_free(tmp_path, seed):
    """Four free strokes to a place and sixteen on plates, as positions that a tracker sees to 0.3 mm."""
    rng, goal, time, written = np.random.default_rng(seed), np.array([20.0, -10.0, 30.0]), np.arange(150) * 0.02, []
    for k in range(20):
        tilt, way = np.radians(rng.uniform(0, 10)), rng.uniform(0, 2 * np.pi)
        normal = np.array([np.sin(tilt) * np.cos(way), np.sin(tilt) * np.sin(way), np.cos(tilt)])
        onto = np.eye(3) - (k >= 4) * np.outer(normal, normal)
        start = rng.uniform(-120, 120, 3)
        path = goal + start - np.outer(1.0 - np.exp(-time), onto @ start) + 0.3 * rng.standard_normal((150, 3))
        written.append(write(tmp_path / f"s{k:02}.csv", "t,x,y,z", np.column_stack([time, path])))
    run("fit", *written, "--state", "x,y,z", "--differentiate", "-o", tmp_path / "p.npz")
    policy = uc.load(tmp_path / "p.npz")
    at = goal + rng.uniform(-80, 80, (200, 3))
    assert np.linalg.norm(policy.predict(at) - goal + at) < 0.4 * np.linalg.norm(at - goal)
    assert policy.solution_.free_share < 0.5


def test_a_row_without_its_time_is_named_as_any_other(tmp_path):
    rows = stroke(0)
    rows[12, 0] = np.nan
    file, other = write(tmp_path / "w.csv", "t,x,y", rows), write(tmp_path / "v.csv", "t,x,y", stroke(1))
    said = text(call("inspect", file, *READ))
    assert "missing: 'w', row 12 (line 14): 1 row without numbers in time" in said
    assert "does not increase" not in said
    said = refused("fit", file, other, *READ, "-o", tmp_path / "p.npz")
    assert said.startswith(f"{file}, row 12 (line 14), column 'time': found nan")
    assert said.endswith("Or leave it out: --leave-out w")


def test_one_row_without_numbers_makes_no_clock_irregular(tmp_path):
    rows = stroke(0)
    rows[12, 1] = np.nan
    assert "irregular" not in text(call("inspect", write(tmp_path / "w.csv", "t,x,y", rows), *READ))


# Lines


@pytest.mark.parametrize("kind", ["comments", "groups", "blank lines", "Excel"])
def test_messages_name_the_line_of_the_file(tmp_path, kind):
    rows = stroke(0).tolist()
    table = [[*map(str, row)] for row in rows]
    lines = ["t,x,y", *map(",".join, table)]
    if kind == "comments":
        lines[5:5] = ["# looked away", "# and back"]
        lines = ["# today", *lines]
    elif kind == "groups":
        lines = ["demo,t,x,y", *(f"{name},{line}" for name in "ab" for line in lines[1:])]
    elif kind == "blank lines":
        lines = [*lines, "", *lines[1:]]
    at = len(lines) - 3
    lines[at] = lines[at].rpartition(",")[0] + ","
    file = tmp_path / "w.csv"
    file.write_text("\n".join(lines) + "\n")
    if kind == "Excel":
        cells = [line.split(",") for line in lines]
        typed = [[float(cell) if cell else None for cell in line] for line in cells[1:]]
        file = workbook(tmp_path / "w.xlsx", Messung=[cells[0], *typed])
    assert f"(line {at + 1}): 1 row without numbers in y" in text(call("fit", file, *READ, "-o", tmp_path / "p.npz"))
    assert f"(line {at + 1}): 1 row without numbers in y" in text(call("inspect", file, *READ))


def test_lines_are_those_of_each_row_however_a_text_is_read(tmp_path):
    rows = np.column_stack([np.arange(200_000) * 0.01, np.random.default_rng(0).normal(size=200_000)])
    np.savetxt(tmp_path / "plain.csv", rows, fmt="%.6f", delimiter=",", header="t,x", comments="")
    text_ = (tmp_path / "plain.csv").read_text()
    (tmp_path / "odd.csv").write_text(text_.replace("\n1999.5", "\n# here\n1999.5", 1))
    [plain] = uc.read(tmp_path / "plain.csv")
    [odd] = uc.read(tmp_path / "odd.csv")
    assert plain.lines.tolist() == list(range(2, 200_002))
    assert odd.lines.tolist() == [*range(2, 199_952), *range(199_953, 200_003)]


# What cannot be learnt from, and files that differ


def resting(number):
    """A stroke that does not begin."""
    return np.column_stack([stroke(0)[:, 0], np.tile(stroke(number)[0, 1:], (40, 1))])


@pytest.mark.parametrize("how", ["at rest", "short", "empty cells"])
def test_a_recording_that_ends_a_fit_is_named_with_what_leaves_it_out_and_then_fit_goes_on(tmp_path, how):
    for k in range(4):
        write(tmp_path / f"w{k}.csv", "t,x,y", stroke(k))
    odd = {"at rest": resting(5), "short": stroke(5)[:3], "empty cells": stroke(5)}[how]
    odd[2:, 1] = np.nan if how == "empty cells" else odd[2:, 1]
    write(tmp_path / "odd one.csv", "t,x,y", odd)
    asked = (tmp_path, *READ, "--still", "0.5")
    fit = (*asked, "--model", "affine", "-o", tmp_path / "p.npz")
    assert refused("fit", *fit).endswith(" Or leave it out: --leave-out 'odd one'")
    assert refused("fit", *fit, "--leave-out", "w1").endswith(" --leave-out 'w1,odd one'")
    said = text(call("inspect", *asked))
    assert "--leave-out 'odd one' -o policy.npz" in said
    run("fit", *fit, "--leave-out", "odd one")


@pytest.mark.parametrize("name", ["cannot tell states", "a' has b", "w, x: 1"])
def test_what_a_file_is_called_does_not_change_what_cures_it(tmp_path, name):
    write(tmp_path / "w0.csv", "t,x,y", stroke(0))
    odd = stroke(1)
    odd[3, 0] = np.nan
    file = write(tmp_path / f"{name}.csv", "t,x,y", odd)
    said = refused("fit", tmp_path, *READ, "-o", tmp_path / "p.npz")
    assert said.startswith(f"{file}, row 3 (line 5), column 'time': found nan")
    assert said.endswith(f" Or leave it out: --leave-out {shlex.quote(name)}")
    said = refused("fit", tmp_path, "--state", "x,z", "--differentiate", "-o", tmp_path / "p.npz")
    assert "has no column 'z'" in said
    assert "--leave-out" not in said


@pytest.mark.parametrize(
    ("asked", "near"),
    [
        ("X,Y", "'x [m]' or 'y [m]'"),
        ("pos_x,y", "'x [m]'"),
        ("x (m),y", "'x [m]'"),
        ("hand.x,hand.y", "'x [m]' or 'y [m]'"),
        ("x_pos,y", ""),
        ("joint_1,y", ""),
    ],
)
def test_a_column_is_asked_after_whatever_its_case_its_unit_or_what_stands_before_it(tmp_path, asked, near):
    file = write(tmp_path / "w.csv", "t [s],x [m],y [m]", stroke(0))
    said = refused("fit", file, "--state", asked, "--differentiate", "-o", tmp_path / "p.npz")
    assert said.endswith(f"Did you mean {near}?" if near else "it has x [m], y [m].")


def test_states_without_actions_are_not_cured_by_leaving_a_file_out(tmp_path):
    for k in range(2):
        write(tmp_path / f"s{k}.csv", "t,a,b", stroke(k))
    said = refused("fit", tmp_path, "--state", "a,b", "-o", tmp_path / "p.npz")
    assert said.startswith(f"{tmp_path / 's0.csv'}: cannot tell the actions from its columns a, b.")
    assert said.endswith(" 'unconstrain inspect' proposes a command.")
    assert "--differentiate -o policy.npz" in text(call("inspect", tmp_path, "--state", "a,b"))


def test_inspect_counts_what_still_leaves(tmp_path):
    rows = stroke(0)
    begins = np.vstack([np.tile(rows[0], (20, 1)), rows])
    begins[:, 0] = 0.05 * np.arange(60)
    write(tmp_path / "a.csv", "t,x,y", begins)
    write(tmp_path / "b.csv", "t,x,y", resting(5))
    demonstration = uc.prepare(uc.read(tmp_path / "a.csv"), uc.Recipe(("x", "y"), differentiate="savgol", still=0.5))
    left = len(demonstration[0])
    assert 35 < left < 55
    found = json.loads(run("inspect", tmp_path, *READ, "--still", "0.5", "--json"))["demonstrations"]
    assert [one["left"] for one in found] == [left, 0]
    said = run("inspect", tmp_path, *READ, "--still", "0.5")
    assert "left by --still" in said
    assert f"{left} of 60" in said
    found = json.loads(run("inspect", tmp_path, *READ, "--json"))["demonstrations"]
    assert [one["left"] for one in found] == [None, None]


@pytest.mark.parametrize("odd", ["columns", "clock", "size"])
def test_of_two_files_that_differ_both_are_named_and_none_is_left_out(tmp_path, odd):
    rows = stroke(1) * {"columns": [1, 1, 1], "clock": [1000, 1, 1], "size": [1, 1000, 1000]}[odd]
    write(tmp_path / "a.csv", "t,x,y", stroke(0))
    write(tmp_path / "b.csv", "t,x,yy" if odd == "columns" else "t,x,y", rows)
    said = text(call("inspect", tmp_path))
    assert "--leave-out" not in said
    told = {
        "columns": "'a' has columns x, y, 'b' x, yy, and which are right cannot be told",
        "clock": "'b' have 0.02 samples a second, 'a' 20, as in another unit of time, and as many",
        "size": "times larger than 'a', as in another unit, and as many: convert those that are wrong",
    }[odd]
    assert told in said


def test_one_of_several_files_with_another_column_is_left_out_and_compared_with_none(tmp_path):
    for k in range(4):
        write(
            tmp_path / f"w{k}.csv",
            "t,x,y" if k < 3 else "t,x,y1,z",
            np.hstack([stroke(k), stroke(k)[:, 1 : 1 + k // 3]]),
        )
    assert "--leave-out w3" in text(call("inspect", tmp_path))


@pytest.mark.parametrize(("command", "code"), [("fit", 2), ("diagnose", 2), ("inspect", 0), ("look", 0)])
def test_fewer_samples_than_tell_any_policy_are_refused(tmp_path, command, code):
    file = write(tmp_path / "w.csv", "t,x,y,vx,vy", np.hstack([stroke(0)[:2], stroke(0)[:2, 1:]]))
    output = {"fit": ("-o", tmp_path / "p.npz"), "look": ("-o", tmp_path / "l.html")}.get(command, ())
    ran = call(command, file, "--state", "x,y", "--action", "vx,vy", *output)
    assert ran.code == code
    assert ("got 2 samples in all, expected at least 3" in ran.err) == bool(code)
    assert not (tmp_path / "p.npz").exists()


def test_a_cycle_that_was_not_shown_is_refused_with_what_shows_one(tmp_path):
    for k in range(3):
        t = np.linspace(0, 4, 81)
        at = np.exp(-1.5 * t)[:, None] * [100.0, 30.0 * (k + 1)]
        write(tmp_path / f"w{k}.csv", "t,x,y", np.column_stack([t, at]))
    said = refused("fit", tmp_path, *READ, "--guided", "cycle", "-o", tmp_path / "p.npz")
    assert said.startswith("--guided: demonstrations make 0.16 turns in the mean, and no cycle is near them.")
    assert "record whole rounds; or guide it to a goal, or not at all" in said
    turn = np.linspace(0, 2 * np.pi, 81)
    write(tmp_path / "round.csv", "t,x,y", np.column_stack([t, 50 * np.cos(turn), 50 * np.sin(turn)]))
    said = refused("fit", tmp_path, *READ, "--guided", "cycle", "-o", tmp_path / "p.npz")
    assert (
        "record whole rounds, or learn from the 1 alone that make a cycle (--episodes round); or guide it to a goal"
        in said
    )


@pytest.mark.parametrize(("seconds", "doubted"), [(1.9, True), (6.0, False)])
def test_a_goal_that_few_came_near_and_still_in_motion_is_doubted(tmp_path, seconds, doubted):
    for k in range(8):
        t = np.linspace(0, seconds if k < 3 else 0.7, 60)
        start = [100 * np.cos(2 * np.pi * k / 8), 100 * np.sin(2 * np.pi * k / 8)]
        write(tmp_path / f"w{k}.csv", "t,x,y", np.column_stack([t, np.exp(-t)[:, None] * start]))
    ran = call("fit", tmp_path, *READ, *LINEAR, "--guided", "auto", "-o", tmp_path / "p.npz")
    assert "Right where every movement is to end there" in text(ran)
    said = "--guided: 3 of 8 demonstrations end near it, still at 2"
    assert (said in text(ran)) == doubted
    assert ("they show no goal. Record movements to their end, or give the goal with --guided." in text(ran)) == doubted
    recipe = uc.Recipe(states=("x", "y"), differentiate="savgol")
    with warnings.catch_warnings(action="ignore"):
        demos = uc.prepare(uc.read(sorted(tmp_path.glob("w*.csv"))), recipe)
    advice = replays.guides(uc.load(tmp_path / "p.npz", uc.Guided).policy, demos)  # where a policy strays
    assert advice == ("goal" if doubted else "auto")


@pytest.mark.parametrize(
    ("columns", "why"),
    [
        (lambda v: v, ""),
        (lambda v: 1000 * v, "the actions are not the velocities of the states, as far as these tell"),
        (lambda v: v[:, ::-1], "the actions are not the velocities of the states, as far as these tell"),
        (lambda v: v[:, :1], "1 actions are not the velocities of 2 states"),
    ],
    ids=["velocities", "other unit", "swapped", "one"],
)
def test_recorded_velocities_are_run_from_the_same_starts_and_what_is_not_run_says_why(tmp_path, columns, why):
    for k in range(4):
        table = stroke(k)
        moves = columns(np.gradient(table[:, 1:], table[:, 0], axis=0))
        write(tmp_path / f"w{k}.csv", f"t,x,y,{'vx,vy'[: 3 * moves.shape[1] - 1]}", np.hstack([table, moves]))
    asked = "--state", "x,y", "--action", "vx,vy" if moves.shape[1] > 1 else "vx"
    said = text(call("fit", tmp_path, *asked, *LINEAR, "-o", tmp_path / "p.npz"))
    assert ("Run from the same starts: size" in said) == ("And run from the same starts, " in said) == (not why)
    assert ("Its size and pace over time: not run from the same starts, as " in said) == bool(why)
    assert why in said


# Samples far off their neighbours


@pytest.fixture
def jumping(tmp_path):
    """Write six strokes, in one of which some rows from the 15th on are nought, as where a tracker is lost."""

    def written(rows):
        for k in range(6):
            table = stroke(k, 80) + np.array([0.0, 300.0, 200.0])
            table[15 : 15 + rows * (k == 2), 1:] = 0.0
            write(tmp_path / f"w{k}.csv", "t,x,y", table)
        return "fit", tmp_path, *READ, "--model", "affine", "--force", "-o", tmp_path.parent / "p.npz"

    return written


def learnt(*fit):
    """What a policy learnt by a command predicts where it was shown, and how it was judged."""
    verdict = json.loads(run(*fit, "--json"))["verdict"]
    return uc.load(fit[fit.index("-o") + 1]).predict([[250.0, 200.0], [300.0, 260.0]]), verdict


@pytest.mark.parametrize("rows", [1, 3])
def test_few_samples_far_off_their_neighbours_spoil_no_fit_and_are_told(jumping, rows):
    clean, well = learnt(*jumping(0))
    assert "glitch" not in text(call(*jumping(0)))
    fit = jumping(rows)
    found, verdict = learnt(*fit)
    assert np.abs(found - clean).max() < 0.02 * np.abs(clean).max()
    assert verdict["mark"] == well["mark"]
    assert "glitches" not in verdict["said"] + verdict["next"]
    said = text(call(*fit))
    assert "glitch: 'w2', row 15 (line 17), column 'x': " in said
    assert (
        "repaired by a straight line; --glitches keep takes what was recorded, --glitches drop leaves it out." in said
    )
    strict = call(*fit, "--strict")
    assert strict.code == 2
    assert "--strict: not as it seems (glitch)" in text(strict)
    proposed = text(call("inspect", *fit[1:4]))
    assert "repaired by a straight line" in proposed
    assert "--glitches" not in proposed.partition("demonstration samples")[0]
    for cure in ("repair", "drop"):
        assert "glitch" not in text(call(*fit, "--glitches", cure))
    spoilt, verdict = learnt(*fit, "--glitches", "keep")
    assert np.abs(spoilt - clean).max() > 0.2 * np.abs(clean).max()
    assert "samples of 'w2' jump far off their neighbours and back (glitches)" in verdict["said"]
    assert verdict["mark"] != "good"
    assert "--glitches repair" in text(call("inspect", *fit[1:4], "--glitches", "keep"))


def test_many_samples_in_a_row_far_off_their_neighbours_are_kept_and_to_be_dropped(jumping):
    clean, _ = learnt(*jumping(0))
    fit = jumping(8)
    assert "8 samples far off their neighbours, all too many in a row to repair: kept;" in text(call(*fit))
    _, verdict = learnt(*fit)
    assert "samples of 'w2' jump far off their neighbours" in verdict["said"]
    assert verdict["next"].startswith("Add --glitches drop")
    assert "--glitches drop -o policy.npz" in text(call("inspect", *fit[1:4]))
    found, verdict = learnt(*fit, "--glitches", "drop")
    assert np.abs(found - clean).max() < 0.02 * np.abs(clean).max()
    assert "glitches" not in verdict["said"]


def test_values_that_change_every_fifth_row_only_are_said_with_what_smooths_them(tmp_path):
    fine = [np.column_stack([0.02 * np.arange(200), stroke(k, 200)[:, 1:]]) for k in range(4)]
    for k, rows in enumerate(fine):
        held = np.column_stack([rows[:, 0], rows[np.arange(200) // 5 * 5, 1:]])
        write(tmp_path / f"held{k}.csv", "t,x,y", held)
        write(tmp_path / f"kept{k}.csv", "t,x,y", held[::5])
        write(tmp_path / f"fine{k}.csv", "t,x,y", rows)
    said = "stale: 'held0': changes every 5 rows only, as where a sensor is slower than the clock"
    shown = run("inspect", tmp_path / "held*.csv", *READ)
    assert said in text(call("inspect", tmp_path / "held*.csv", *READ))
    words_ = command_of(shown)[1:-1]
    assert dict(pairwise(words_))["--by"] == "kalman"
    assert "stale" not in text(call(*words_, tmp_path / "p.npz", *LINEAR))
    assert said in text(call("fit", tmp_path / "held*.csv", *READ, *LINEAR, "-o", tmp_path / "q.npz"))
    for others in ("kept*.csv", "fine*.csv"):
        assert "stale" not in text(call("inspect", tmp_path / others, *READ))


# Angles, and the command that comes next


def turning(number, start, per_second=30.0, length=60):
    """Times, a place, and an angle in degrees from -180 to 180 that begins somewhere."""
    times = 0.05 * np.arange(length)
    return np.column_stack([times, 50 * np.sin(times + number), (start + per_second * times + 180) % 360 - 180])


def command_of(shown):
    """Words of the fit that inspect proposes."""
    return shlex.split(next(line for line in shown.splitlines() if "unconstrain fit " in line).split("Next: ")[-1])


def test_the_command_that_comes_next_has_each_cure_that_the_notes_name(tmp_path):
    for k in range(4):
        rows = np.column_stack([turning(k, 120 + 10 * k), turning(k, 100 + 40 * k)[:, 2]])
        write(tmp_path / f"a{k}.csv", "t,x,roll,yaw", rows * [1000, 1, 1, 1])
    typed = (tmp_path / "a*.csv", "--state", "x,roll,yaw", "--time-unit", "s", "--angle", "roll")
    shown = run("inspect", *typed, "--differentiate")
    _, *words_ = command_of(shown)
    options = dict(pairwise(words_))
    assert (options["--angle"], options["--degrees"], options["--time-unit"]) == ("roll,yaw", "roll,yaw", "ms")
    assert words_.count("--time-unit") == words_.count("--angle") == 1
    assert "and is taken for a plain number, so that each jump counts as motion; for an angle, say" in text(
        call("inspect", *typed, "--differentiate")
    )
    ran = call(*words_[:-1], tmp_path / "p.npz", *LINEAR)
    assert "angle-wrap" not in ran.err
    assert "clock-unit" not in ran.err
    for k in range(4):
        write(tmp_path / f"steady{k}.csv", "t,x,yaw", turning(k, -60))
    plain = command_of(run("inspect", tmp_path / "steady*.csv", "--state", "x,yaw", "--differentiate"))
    assert not {"--angle", "--degrees", "--time-unit"} & {*plain}


def test_an_angle_in_degrees_that_a_later_file_alone_shows_is_said_with_its_cure(tmp_path):
    for k, start in enumerate((-60, 120, 130)):
        write(tmp_path / f"a{k}.csv", "t,x,yaw", turning(k, start))
    asked = (tmp_path / "a*.csv", "--state", "x,yaw", "--differentiate", "--angle", "yaw")
    fit = (*asked, *LINEAR, "-o", tmp_path / "p.npz", "--force")
    told = "column 'yaw': jumps by 360, as an angle in degrees does, and is taken for radians; if it is in degrees, say"
    assert f"{told} --degrees yaw." in text(call("inspect", *asked))
    assert f"{told} --degrees yaw." in text(call("fit", *fit))
    assert "--degrees" in command_of(run("inspect", *asked))
    assert told not in text(call("fit", *fit, "--degrees", "yaw"))
    assert told not in text(call("fit", *fit, "--leave-out", "a0"))  # the first tells it then


def test_recordings_that_are_the_same_are_counted_and_left_out_as_said(tmp_path):
    for k in range(4):
        write(tmp_path / f"w{k}.csv", "t,x,y", stroke(k))
    asked, fit = (tmp_path / "*.csv", *READ), (*LINEAR, "-o", tmp_path / "p.npz", "--force")
    assert "same-recording" not in text(call("inspect", *asked)) + text(call("fit", *asked, *fit))
    shutil.copy(tmp_path / "w0.csv", tmp_path / "copy.csv")
    with (tmp_path / "w3.csv").open() as file:  # written otherwise
        (tmp_path / "other.csv").write_text(file.read().replace(",", ";"))
    said = "'copy' and 'w0', 'other' and 'w3' hold the same recording, which counts more than once"
    shown = text(call("inspect", *asked))
    assert shown.count(said) == 1
    assert shown.startswith("! 2 of 6 demonstrations not as it should be: same recording.")
    assert f"same-recording: 'copy': {said}" in shown
    assert "--leave-out copy,other -o" in shown
    assert text(call("fit", *asked, *fit)).count(said) == 1
    assert "same-recording" not in text(call("inspect", *asked, "--leave-out", "copy,other"))
    assert "not as it seems (same-recording)" in call("fit", *asked, *fit, "--strict").err
    assert "same-recording" not in call("fit", *asked, *fit, "--strict", "--leave-out", "copy,other").err


def rounds(before, after, noise=0.2, highest=None, seed=0):
    """A round in five seconds at 50 Hz, between rests of so many seconds, with noise of a tracker in mm."""
    turn = np.concatenate([np.zeros(round(50 * before)), np.arange(250) / 250, np.ones(round(50 * after))])
    states = 80.0 * np.column_stack([np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn), 0.0 * turn])
    return np.column_stack([0.02 * np.arange(len(turn)), states + shaking(states.shape, noise, highest, seed)])


def shaking(shape, noise, highest=None, seed=0):
    """Noise of 50 Hz, white or, as motion capture gives it, filtered forth and back at so many Hz."""
    white = np.random.default_rng(seed).standard_normal((shape[0] + 200, *shape[1:]))
    found = white if highest is None else filtfilt(*butter(2, highest / 25.0), white, axis=0)
    return noise * found[100:-100] / (1.0 if highest is None else found[100:-100].std(axis=0))


@pytest.mark.parametrize(("before", "after"), [(0.6, 0.7), (0.6, 0.0), (0.0, 0.7), (0.0, 0.0)])
def test_rest_at_both_ends_is_left_out_and_told(tmp_path, before, after):
    path = write(tmp_path / "r.csv", "t,x [mm],y [mm],z [mm]", rounds(before, after))
    said = text(call("inspect", path, "--state", "x,y,z", "--differentiate"))
    assert ("before it starts" in said) == bool(before)
    assert ("at its end" in said) == bool(after)
    assert ("left out (--pauses keep where that is its goal)." in said) == bool(after)
    head = "t,x [mm],y [mm],z [mm]"
    more = [write(tmp_path / f"{k}.csv", head, rounds(before, after) * [1.0, 1.1, k, 1.0]) for k in (1, 2)]
    noted = "nothing odd: ready to learn from (rest is noted)."
    assert (noted in text(call("inspect", path, *more, "--state", "x,y,z", "--differentiate"))) == bool(before + after)
    asked = uc.Recipe(("x", "y", "z"), differentiate="savgol")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        [moving], [all_] = (uc.prepare(uc.read(path), replace(asked, pauses=pauses)) for pauses in ("drop", "keep"))
    assert abs(len(moving) - 250) <= 20
    assert len(all_) == round(250 + 50 * (before + after))
    kept = text(call("inspect", path, "--state", "x,y,z", "--differentiate", "--pauses", "keep"))
    assert ("learnt as rest there." in kept) == bool(before + after)


def test_a_goal_that_is_come_to_slowly_is_no_rest_at_the_end(tmp_path):
    times = 0.02 * np.arange(300)
    for rate in (1.0, 2.0, 4.0):
        table = np.column_stack([times, np.exp(-rate * times)[:, None] * [100.0, 50.0, 20.0]])
        table[:, 1:] += 0.2 * np.random.default_rng(0).standard_normal((300, 3))
        path = write(tmp_path / "r.csv", "t,x,y,z", table)
        assert "rest: " not in text(call("inspect", path, "--state", "x,y,z", "--differentiate"))


@pytest.mark.parametrize("noise", [0.05, 0.8])
@pytest.mark.parametrize("highest", [6.0, 10.0, 18.0])
def test_rest_is_seen_whatever_the_spectrum_of_the_noise(tmp_path, noise, highest):
    for before, after in ((1.0, 1.5), (0.0, 0.0)):
        table = rounds(before, after, noise, highest)
        path = write(tmp_path / "r.csv", "t,x [mm],y [mm],z [mm]", table)
        said = text(call("inspect", path, "--state", "x,y,z", "--differentiate"))
        assert "stop: " not in said
        assert ("rest: " in said) == bool(before)
        if before:
            first, last = map(float, re.search(r"\((\S+) s\) before it .*?\((\S+) s\) at its end", said).groups())
            assert abs(first - before) < 0.2
            assert abs(last - after) < 0.2


@pytest.mark.parametrize("noise", [0.05, 0.8])
@pytest.mark.parametrize("still", [0.0, 1.5])
def test_a_pause_is_left_out_whole_whatever_the_spectrum_of_the_noise(tmp_path, noise, still):
    turn = 0.02 * np.concatenate([np.arange(125), np.full(round(50 * still), 125), np.arange(125, 250)])
    way = 80.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    for seed in range(3):
        table = np.column_stack([0.02 * np.arange(len(way)), way + shaking(way.shape, noise, 10.0, seed)])
        said = text(call("inspect", write(tmp_path / "r.csv", "t,x,y", table), *READ))
        found = re.search(r"stands still for (\d+) of \d+ rows .* in the middle", said)
        assert bool(found) == bool(still)
        assert not found or abs(int(found[1]) - 75) < 8


@pytest.mark.parametrize("noise", [0.05, 0.8])
@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
def test_a_goal_that_is_come_to_slowly_is_neither_rest_nor_a_stop_whatever_the_noise(tmp_path, noise, rate):
    times = 0.02 * np.arange(300)
    for seed in range(4):
        way = np.exp(-rate * times)[:, None] * [100.0, 50.0, 0.0] + shaking((300, 3), noise, 8.0, seed)
        path = write(tmp_path / "r.csv", "t,x,y,z", np.column_stack([times, way]))
        said = text(call("inspect", path, "--state", "x,y,z", "--differentiate"))
        assert "rest: " not in said
        assert "stop: " not in said


# Units, columns and signs of actions, and of joints


def moving(tmp_path, way=lambda u: u, count=4, names="x,y,vx,vy", of=range(4)):
    """Strokes with velocities, in some of them changed; files."""
    files = []
    for k in range(count):
        rows = stroke(k, 60)
        velocities = np.gradient(rows[:, 1:], 0.05, axis=0)
        table = np.hstack([rows, way(velocities) if k in of else velocities])
        files.append(write(tmp_path / f"m{k}.csv", f"t,{names}", table))
    return files


@pytest.mark.parametrize(
    ("way", "told", "then"),
    [
        (lambda u: 1000 * u, "all actions are 1000 times the change of the states in the same time", "--by savgol"),
        (lambda u: u / 100, "all actions are 0.01 times the change of the states in the same time", "--by savgol"),
        (lambda u: u * [1, 1000], "'vy' is 1000 times the change of 'y' in the same time", "--by savgol"),
        (lambda u: u[:, ::-1], "'vx' is the change of 'y', 'vy' is the change of 'x'", "--action vy,vx"),
    ],
)
def test_velocities_of_another_unit_or_column_are_told_with_the_command_that_takes_others(tmp_path, way, told, then):
    files = moving(tmp_path, way)
    said = text(call("inspect", *files))
    assert "4 of 4 demonstrations not as it should be: not velocities." in said
    assert told in said
    assert f" {then} -o policy.npz" in said
    shown = call("fit", *files, *LINEAR, "-o", tmp_path / "p.npz")
    assert shown.out[0] in "!✖"
    assert "Actions are not the velocities of the states, as the notes say" in text(shown)
    cured = text(call("fit", *files, *then.split(), *LINEAR, "-o", tmp_path / "q.npz"))
    assert "not-velocities" not in cured
    assert "as the notes say" not in cured
    assert "not-velocities" not in text(call("inspect", *files, "--action-is", "velocity"))


@pytest.mark.parametrize("way", [lambda u: u, lambda u: 3 * u, lambda u: np.gradient(u, 0.05, axis=0)])
def test_velocities_commands_and_accelerations_are_taken_as_they_are(tmp_path, way):
    files = moving(tmp_path, way)
    assert "not-velocities" not in text(call("inspect", *files))
    assert "as the notes say" not in text(call("fit", *files, *LINEAR, "-o", tmp_path / "p.npz"))


@pytest.mark.parametrize(("of", "every"), [(range(4), True), ([1], False)])
def test_where_every_stroke_moves_against_its_actions_the_states_are_differentiated(tmp_path, of, every):
    said = text(call("inspect", *moving(tmp_path, lambda u: -u, of=of)))
    assert "reversed: 'm" in said
    assert "where all do, take the velocity of the states, --by, or turn the sign" in said
    assert (" --by savgol -o policy.npz" in said) == every


def joints(tmp_path, turn, names="j1,j2,j3,j4", count=3):
    time, rng, files = 0.02 * np.arange(100), np.random.default_rng(0), []
    for k in range(count):
        end = rng.uniform(-1, 1, 4) * turn
        table = np.column_stack([time, end * np.exp(-time)[:, None] * rng.uniform(0.9, 1.1, 4)])
        files.append(write(tmp_path / f"{names[0]}{k}.csv", f"t,{names}", table))
    return files


def test_numbered_joints_are_states_and_told_where_they_look_like_degrees(tmp_path):
    said = text(call("inspect", *joints(tmp_path, 120.0)))
    assert "looks like degrees, and are taken for radians; if they are degrees, say --degrees j1,j2,j3,j4." in said
    assert "--degrees j1,j2,j3,j4 -o policy.npz" in said
    assert "degrees" not in text(call("inspect", *joints(tmp_path, 1.2)))


def test_of_a_numbered_family_all_columns_are_proposed(tmp_path):
    said = text(call("inspect", *joints(tmp_path, 1.0, "force,a1,a2,a3")))
    assert "--state a1,a2,a3 --differentiate" in said
    assert "--state a,b,c --differentiate" in text(call("inspect", *joints(tmp_path, 1.0, "a,b,c,d")))


@pytest.mark.parametrize(("typed", "meant"), [("j1-j3", "j1..j3"), ("j1 j2 j3", "j1,j2,j3"), ("j1;j2", "j1,j2")])
def test_how_several_columns_are_written_is_told(tmp_path, typed, meant):
    [file] = joints(tmp_path, 1.0, count=1)
    assert f"Write {meant}." in refused("fit", file, "--state", typed, "--differentiate", "-o", tmp_path / "p.npz")
    assert "Write" not in refused("fit", file, "--state", "j1-j9", "--differentiate", "-o", tmp_path / "p.npz")
    assert "or j1..j7" in text(call("fit", "--help"))


@pytest.mark.parametrize(("unit", "scale"), [("[mm]", "1000.0"), ("[cm]", "100.0"), ("[deg]", "57.29578"), ("", "1.0")])
def test_a_ros_2_package_tells_its_messages_and_the_scale_of_its_unit(tmp_path, unit, scale):
    names = [f"{name} {unit}".strip() for name in "abc"]
    options = ("--state", ",".join(names), "--by", "savgol", "--degrees", "none", *LINEAR)
    files = joints(tmp_path, 1.0, ",".join([*names, "w"]))
    run("fit", *files, *options, "-o", tmp_path / "p.npz")
    said = text(call("export", tmp_path / "p.npz", "--ros2", tmp_path / "node"))
    kind = "pose (a [" if unit in ("[mm]", "[cm]") else "joints (set 'joints' in its config"
    assert f"messages: {kind}" in said
    assert ("100.0 for centimetres, 57.29578 for degrees" in said) == (not unit)
    assert f"scale: {scale} " in (tmp_path / "node" / "config" / "node.yaml").read_text()
    told = json.loads(run("export", tmp_path / "p.npz", "--ros2", tmp_path / "n", "--messages", "pose", "--json"))
    assert told["messages"] == "pose"


def test_one_file_in_millimetres_among_others_in_centimetres_is_named_and_did_move(tmp_path):
    files = [write(tmp_path / f"s{k}.csv", "t,x,y", stroke(k) * [1, 0.1, 0.1]) for k in range(6)]
    ring = np.linspace(0, 6, 40)
    turned = np.column_stack([0.05 * np.arange(40), 15.0 * np.cos(ring), 15.0 * np.sin(ring)])
    large = write(tmp_path / "large.csv", "t,x,y", turned * [1, 10, 10])
    said = text(call("inspect", *files, large))
    assert "unit-differs: 'large', column 'x': is 10 times larger than 's0', 's1'" in said
    assert "--leave-out large -o policy.npz" in said
    assert "unit-differs" not in text(call("inspect", *files, write(tmp_path / "own.csv", "t,x,y", turned)))
    run("fit", *files, "--model", "cubic", "--learner", "direct", "-o", tmp_path / "p.npz")
    shown = text(call("score", tmp_path / "p.npz", large))
    assert "learnt far from most of these states: another task, or other units?" in shown
    assert "hardly moved" not in shown


def test_what_moves_hardly_more_than_its_noise_is_not_said_to_stand_still(tmp_path):
    rows = stroke(0)
    rows[:, 1:] = 100.0 + np.random.default_rng(0).standard_normal((40, 2)) + np.linspace(0, 1, 40)[:, None]
    said = text(call("inspect", write(tmp_path / "still.csv", "t,x,y", rows), *READ))
    assert "at-rest: 'still': moves hardly more than its noise, if at all; leave it out with --leave-out." in said


def test_fewer_actions_than_states_are_noted_by_fit(tmp_path):
    files = moving(tmp_path)
    some = ("--state", "x,y", "--action", "vx", *LINEAR, "-o", tmp_path / "p.npz")
    less = "Note: 1 action for 3 states: no velocities, which 'rollout' and a ROS 2 node need"
    assert less in text(call("fit", *files, *some, "--force", "--state", "x,y,vy"))
    assert "no velocities" not in text(call("fit", *files, *some, "--force"))  # such as accelerations of half of them
    assert "no velocities" not in text(call("fit", *files, *some, "--force", "--action", "vx,vy"))


def test_stamps_in_milliseconds_are_marked_and_their_rounding_is_no_other_fault(tmp_path):
    for k in range(3):
        rows = stroke(k)
        rows[:, 0] = np.round(np.arange(40) * 1000 / 60.0)
        write(tmp_path / f"s{k}.csv", "t,x,y", rows)
    said = run("inspect", tmp_path, *READ)
    assert "clock-unit" in said
    assert re.search(r"s0 +40 +650\.00 s\? +0\.1 Hz\? ", said)
    assert "irregular" not in said
    said = run("inspect", tmp_path, *READ, "--time-unit", "ms")
    assert re.search(r"s0 +40 +0\.65 s +58\.8 Hz ", said)


# What is to be written


def test_an_output_that_is_there_and_a_file_that_is_not_are_told_together(tmp_path):
    [file] = moving(tmp_path, count=1)
    there = write(tmp_path / "p.npz", "", [])
    said = refused("fit", file, tmp_path / "lost.csv", "-o", there)
    assert (
        said
        == f"{there}: is there; give another name, or --force to replace it. And {tmp_path}/lost.csv: no such file."
    )
    assert refused("fit", file, "-o", there).endswith("or --force to replace it.")


@pytest.mark.parametrize("name", ["q.npz.gz", "q.gz"])
def test_a_name_with_two_suffixes_is_corrected_to_one(tmp_path, name):
    [file] = moving(tmp_path, count=1)
    assert refused("fit", file, "-o", tmp_path / name).endswith(f"name it {tmp_path}/q.npz.")


@pytest.mark.parametrize("name", ["p.pkl", "p.PICKLE", "p.joblib"])
def test_nothing_is_saved_under_the_name_of_a_pickle(tmp_path, name):
    policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [2.0]])
    with pytest.raises(uc.UnconstrainError, match=r"nothing here writes pickles, .*; name it \.npz"):
        uc.save(policy, tmp_path / name)
    assert not (tmp_path / name).exists()


def test_a_verdict_says_in_words_what_is_not_as_it_should_be(tmp_path):
    rows = np.vstack([stroke(0), np.add(stroke(1), [2.0, 500.0, 0.0])])
    write(tmp_path / "g.csv", "t,x,y", rows)
    said = text(call("inspect", tmp_path / "g.csv", *READ))
    assert "! 1 of 1 demonstration not as it should be: " in said
    verdict = said.partition("should be: ")[2].partition(".")[0]
    assert "jumps to another place" in verdict
    assert "seam" not in verdict
    assert "seam: " in said  # which options and programs go by


def trials(*numbers, seconds=3.0):
    """Rows of trial, time and place, of winding movements to one place, each of a start of its own."""
    times = np.arange(0.0, seconds, 0.02)
    rows = []
    for k in numbers:
        turn = np.exp((-0.9 + 2.0j) * times + 1j * k) * (80.0 + 5.0 * k)
        rows += [[f"s{k}", t, z.real, z.imag] for t, z in zip(times, turn, strict=True)]
    return rows


def test_score_knows_what_was_learnt_from_in_another_file_and_scores_it_apart(tmp_path):
    head, how = "trial,t,x,y", ("--group", "trial", "--state", "x,y", "--by", "savgol", *LINEAR)
    run("fit", write(tmp_path / "train.csv", head, trials(1, 2, 3, 4)), *how, "-o", tmp_path / "p.npz")
    mixed = write(tmp_path / "export.csv", head, trials(9, 2, 3, 5))
    ran = call("score", tmp_path / "p.npz", mixed)
    assert "it learnt from 2 of 4 demonstrations, scored apart: this judges the others" in text(ran)
    table = re.findall(r"^(s\d|learnt from|held out) ", ran.out, re.MULTILINE)
    assert table == ["s2", "s3", "learnt from", "s9", "s5", "held out"]
    found = json.loads(run("score", tmp_path / "p.npz", mixed, "--json"))
    assert found["learnt_from"] == ["s2", "s3"]
    assert [one["demonstration"] for one in found["rows"]] == ["s9", "s5"]
    assert [one["demonstration"] for one in found["learnt"]] == ["s2", "s3", "learnt from"]
    new = write(tmp_path / "new.csv", head, trials(9, 5))
    alone = json.loads(run("score", tmp_path / "p.npz", new, "--json"))
    assert (alone["learnt_from"], alone["learnt"]) == ([], [])
    assert {**found["all"], "demonstration": "all"} == alone["all"]
    assert "learnt from" not in text(call("score", tmp_path / "p.npz", new))
    other = ("score", tmp_path / "p.npz", mixed, "--window", "0.3", "--json")  # as recorded, however it is prepared
    assert json.loads(run(*other))["learnt_from"] == ["s2", "s3"]
    notes = uc.storage.load_notes(tmp_path / "p.npz")
    old = {name: note for name, note in notes.items() if name != "contents"}
    uc.save(uc.load(tmp_path / "p.npz"), tmp_path / "old.npz", old)
    assert json.loads(run("score", tmp_path / "old.npz", mixed, "--json"))["learnt_from"] == []
    again = json.loads(run("score", tmp_path / "old.npz", tmp_path / "train.csv", "--json"))
    assert again["learnt_from"] == ["s1", "s2", "s3", "s4"]


def test_what_was_learnt_from_in_blocks_is_known_again_whole(tmp_path, monkeypatch):
    rows = [
        [t, z.real, z.imag] for k in range(3) for t, z in [(0.1 * j, (k + 1) * np.exp(0.1j * j)) for j in range(40)]
    ]
    table = np.array(rows)
    file = write(tmp_path / "w.csv", "t,x,y,vx,vy", np.column_stack([table[:40], -table[:40, 1:]]))
    monkeypatch.setattr("unconstrain.recordings.readers.text.BLOCK_ROWS", 7, raising=False)
    stream = uc.Stream(file, uc.Recipe(states=("x", "y"), actions=("vx", "vy")))
    assert len(list(stream)) >= 1
    [recording] = uc.read(file)
    assert stream.contents == [recording.content(stream.recipe).hexdigest()]


def test_a_wrong_group_whose_rows_are_mixed_is_answered_with_the_column_that_tells_apart(tmp_path):
    rows = [[int(name[1:]), *row, "rail" if int(name[1:]) % 2 else "free"] for name, *row in trials(1, 2, 3, 4)]
    file = write(tmp_path / "all.csv", "trial,t,x,y,kind", rows)
    how = ("--state", "x,y", "--by", "savgol", *LINEAR, "-o", tmp_path / "p.npz")
    said = refused("fit", file, "--group", "kind", *how)
    assert said.startswith("Column 'trial' has 4 values, a stroke each by its jumps: give --group trial. As it is: ")
    shown = run("inspect", file, "--group", "kind")
    assert re.search(r"^ +unconstrain inspect \S+all\.csv --group trial$", shown, re.MULTILINE)
    sorted_ = run("fit", file, "--group", "kind", "--sort", *how)
    assert re.search(r"^ +unconstrain inspect \S+all\.csv .*--sort$", sorted_, re.MULTILINE)
    assert "several-in-one" not in text(call("fit", file, "--group", "trial", *how, "--force"))
    halves = [[*row, int(row[0] > "s2")] for row in trials(1, 2, 3, 4)]  # each in one piece
    assert "several-in-one" not in run(
        "inspect", write(tmp_path / "halves.csv", "n,t,x,y,half", halves), "--group", "half"
    )


def test_a_page_of_several_files_is_called_by_how_many_they_are(tmp_path):
    files = [write(tmp_path / f"w{k}.csv", "trial,t,x,y", trials(k)) for k in range(3)]
    how = ("--state", "x,y", "--by", "savgol", "--variance", "inf", "-o", tmp_path / "d.html", "--force")
    for given, title in ((files, "Diagnosis of w0.csv and 2 more"), (files[1:2], "Diagnosis of w1.csv")):
        call("diagnose", *given, *how)
        assert f"<title>{title}</title>" in (tmp_path / "d.html").read_text("utf-8")


def test_a_cycle_drawn_from_few_whole_rounds_is_doubted_and_the_command_for_these_works(tmp_path):
    turns = np.linspace(0.0, 2 * np.pi, 150)
    rows = [[f"r{k}", 0.02 * j, 50 * np.cos(a + k), 50 * np.sin(a + k)] for k in range(3) for j, a in enumerate(turns)]
    slow = 1.0 - (1.0 - np.linspace(0.0, 1.0, 150)) ** 3  # which come to rest in places of their own
    rows += [
        [f"r{k}", 0.02 * j, 50 * np.cos(a), 50 * np.sin(a)]
        for k, part in enumerate((0.3, 0.55, 0.2), 3)
        for j, a in enumerate(2.0 * k + part * turns[-1] * slow)
    ]
    file, how = write(tmp_path / "all.csv", "trial,t,x,y", rows), ("--state", "x,y", "--by", "savgol", *LINEAR)
    ran = call("fit", file, *how, "--guided", "cycle", "-o", tmp_path / "all.npz")
    assert ran.code == 0
    said = text(call("certify", tmp_path / "all.npz"))
    assert said.startswith("! ")
    assert "But only 50% of the demonstrations that its cycle was drawn from go all the way round." in said
    assert ". the " not in said
    run("fit", file, *how, "--episodes", "r0,r1,r2", "--guided", "cycle", "-o", tmp_path / "three.npz")
    said = text(call("certify", tmp_path / "three.npz"))
    assert said.startswith("✔ ")
    refusal = refused("fit", file, *how, "--guided", "auto", "-o", tmp_path / "auto.npz")
    assert "learn from the 3 alone that make a cycle (--episodes r0,r1,r2), or pass --guided" in refusal
    command = refusal.partition(" These alone: unconstrain ")[2]
    assert call(*shlex.split(command)).code == 0


@pytest.mark.parametrize(("under", "said"), [(-0.06, "misses more than all"), (0.4, "explains 40%")])
def test_a_score_under_a_constraint_begins_with_what_a_held_robot_does(under, said):
    found = uc.evaluation.verdicts.of_score(0.45, 3, under).said
    assert found.startswith(f"In all directions left free by the constraint given, the policy {said} of the variance")
    along = "Along the recorded motion alone, it explains 45% of held-out motion, if none of it was learnt from: poor."
    assert found.endswith(along)
    assert uc.evaluation.verdicts.of_score(0.45, 3).said.startswith("The policy explains 45%")


def test_what_diagnose_calls_told_is_what_it_says_of_uncertainty(tmp_path):
    demos, rng = [], np.random.default_rng(0)
    for k in range(3):
        states = rng.uniform(-1.0, 1.0, (40, 2)) + 0.3 * k
        demos.append(uc.Demonstration(states, -states + 0.05 * rng.standard_normal(states.shape)))
    policy = uc.LocallyLinearPolicy(learner=uc.Robust()).fit_demonstrations(demos)
    found, (states, actions, _) = uc.evaluation.diagnose(policy, demos), uc.stack(demos)
    spread, typical = policy.uncertainty(states), np.sqrt((actions**2).sum(axis=1).mean())
    open_, noise = (np.linalg.norm(one, axis=1) for one in (spread.undetermined, spread.from_noise))
    told = (open_ <= 0.1 * typical) | ((open_ < noise) & (noise < typical))
    assert found.states_determined == pytest.approx(told.mean())
    doubt = uc.evaluation.verdicts.of_diagnosis(found).doubt
    assert doubt.startswith("Where none tells it in some direction") == (found.told_together < 1.0)


# Stands between demonstrations


def session(count, still=60, carried=100, noise=0.3, seed=0):
    """Clock and positions, mm at 100 Hz, of strokes along a line each, stands, and ways back; its stands."""
    rng, parts, stands, rows = np.random.default_rng(seed), [], [], 0
    starts = rng.uniform(-150, 150, (count, 2))
    ends = starts + 120 * np.array([[np.cos(angle), np.sin(angle)] for angle in np.pi * np.arange(count) / count])
    share = np.linspace(0, 1, carried)[:, None]
    smooth = share**3 * (10 - 15 * share + 6 * share**2)
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        stroked = start + (end - start) * (1 - np.exp(-3 * np.linspace(0, 1, 150)))[:, None]
        back = stroked[-1] + (starts[(number + 1) % count] - stroked[-1]) * smooth
        moved = [np.repeat(stroked[:1], still, 0), stroked, np.repeat(stroked[-1:], still, 0), back]
        bounds = rows + np.cumsum([0, *map(len, moved)])
        stands += [(bounds[0], bounds[1]), (bounds[2], bounds[3])]
        parts, rows = [*parts, *moved], bounds[4]
    path = np.concatenate(parts[:-1])
    path += noise * rng.standard_normal(path.shape)
    return np.column_stack([0.01 * np.arange(len(path)), path]), stands[1:-1]


def spans_of(file, *more):
    [found] = json.loads(call("inspect", file, *more, "--json").out)["demonstrations"]
    return [span for one in found["warnings"] if one["code"] == "pause" for span in one["spans"]]


def test_each_stand_is_told_once_and_the_same_however_long_the_recording_is(tmp_path):
    table, stands = session(8)
    every = spans_of(write(tmp_path / "long.csv", "t,x,y", table))
    assert len(every) == len(stands)
    for (first, last), (start, end) in zip(every, stands, strict=True):
        assert start - 45 < first < start + 15  # strokes end slowly
        assert end - 15 < last < end + 25
    for rows in (900, 1500, 2000):
        some = spans_of(write(tmp_path / "some.csv", "t,x,y", table[:rows]))
        away = rows - 420
        assert [one for one in some if one[1] < away] == [one for one in every if one[1] < away]
    moving = table[60 + np.arange(150)]
    assert not spans_of(write(tmp_path / "one.csv", "t,x,y", moving))


def test_a_session_is_cut_where_it_stands_still_and_its_strokes_are_learnt(tmp_path):
    table, _ = session(6)
    file, between = write(tmp_path / "long.csv", "t,x,y", table), [f"long.{2 * k}" for k in range(1, 6)]
    said = text(call("inspect", file))
    assert "If demonstrations are between, cut it there: --pauses cut." in said
    assert f"unconstrain fit {file} --pauses cut -o policy.npz" in said
    cut = ("--pauses", "cut", "--leave-out", ",".join(between))
    found = json.loads(call("inspect", file, *cut, "--json").out)["demonstrations"]
    assert [one["name"] for one in found] == [f"long.{2 * k + 1}" for k in range(6)]
    assert all(abs(one["samples"] - 150) < 90 for one in found[1:-1])
    assert not [odd for one in found for odd in one["warnings"] if odd["code"] == "pause"]
    assert "no demonstration is called 'long.99'" in refused(
        "inspect", file, "--pauses", "cut", "--leave-out", "long.99"
    )
    policy = tmp_path / "policy.npz"
    quick = ("--model", "affine", "--learner", "direct")
    learnt = json.loads(call("fit", file, *cut, *quick, "-o", policy, "--json").out)
    assert learnt["demonstrations"] == 6
    scored = json.loads(call("score", policy, file, *cut[2:], "--json").out)  # cut as what it learnt from
    assert [one["demonstration"] for one in scored["rows"]] == [one["name"] for one in found]
    assert scored["learnt_from"] == [one["name"] for one in found]
    assert len(json.loads(call("diagnose", file, *cut, *quick[:2], "--json").out)["movements"]) == 6
    assert run("constraint", file, *cut, "-o", tmp_path / "held.npz")
    looked = json.loads(call("look", file, *cut, "-o", tmp_path / "look.html", "--json").out)
    assert looked["demonstrations"] == 6


@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_one_recording_that_stands_still_is_to_be_cut_there_and_one_that_does_not_is_not(tmp_path, command):
    table, _ = session(2)
    more = ("--learner", "direct", "-o", tmp_path / "p.npz", "--force") if command == "fit" else ()
    for rows, cut in ((table, True), (table[70:200], False)):
        said = text(call(command, write(tmp_path / "w.csv", "t,x,y", rows), "--model", "affine", *more))
        assert (f"unconstrain {command} {tmp_path / 'w.csv'} " in said) == cut
        assert ("--pauses cut" in said) == cut


def test_pieces_that_hardly_move_are_left_out_with_a_word(tmp_path):
    table, _ = session(4)
    still = table[-1, 1:] + np.clip(np.arange(-80, 140) / 60, 0, 1)[:, None] * [6, 0]
    still += 0.3 * np.random.default_rng(1).standard_normal(still.shape)
    path = np.concatenate([table[:, 1:], still, table[::-1, 1:] + [6, 0]])
    rows = np.column_stack([0.01 * np.arange(len(path)), path])
    every = json.loads(call("inspect", write(tmp_path / "w.csv", "t,x,y", rows), "--pauses", "cut", "--json").out)
    notes = [one["message"] for each in every["demonstrations"] for one in each["notes"] if one["code"] == "cut"]
    assert len(every["demonstrations"]) == 14
    assert "1 more hardly moved, and are left out." in notes[0]
    kept = call("inspect", write(tmp_path / "v.csv", "t,x,y", table), "--pauses", "cut").out
    assert "hardly moved" not in kept
    assert "cut where it stands still, into v.1 to v.7" in kept


def test_the_time_line_of_a_look_has_each_stand_and_its_command_a_pattern(tmp_path):
    table, stands = session(4)
    for k in range(4):
        write(tmp_path / f"w{k}.csv", "t,x,y", table)
    for pauses, left_out in (("drop", True), ("keep", False)):
        run("look", tmp_path / "*.csv", "--pauses", pauses, "-o", tmp_path / "look.html", "--force")
        page = (tmp_path / "look.html").read_text("utf-8")
        marks = re.findall(r'{"code": ?"pause", ?"message": ?"[^"]*", ?"start": ?([\d.]+), ?"length": ?([\d.]+)', page)
        assert len(marks) == 4 * len(stands)
        assert all((float(length) > 0.3) == left_out for _, length in marks)
        assert f"unconstrain fit '{tmp_path}/*.csv'" in page


@pytest.mark.parametrize(("jitter", "told"), [(0.05, False), (0.3, True)])
def test_jitter_is_said_where_it_matters_by_inspect_and_fit_alike(tmp_path, jitter, told):
    for k in range(3):
        np.savetxt(tmp_path / f"w{k}.csv", stroke(k, jitter=jitter), delimiter=",", header="t,x,y", comments="")
    for ran in (call("inspect", tmp_path), call("fit", tmp_path, *READ, "-o", tmp_path / "p.npz", "--force")):
        assert ("irregular" in text(ran)) == told


def turns(number, tilt, unit=1.0):
    """Time, and rounds on a plane of some tilt, in metres or another unit."""
    time = np.linspace(0, 4, 200)
    flat = np.column_stack([0.1 * np.cos(3 * time), (0.06 + 0.01 * number) * np.sin(3 * time)])
    states = [0.4, 0.1, 0.2] + flat @ [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)]]
    return np.column_stack([time, unit * (states + 2e-4 * np.random.default_rng(number).standard_normal((200, 3)))])


def test_a_clock_that_is_named_as_a_state_is_said_to_be_one(tmp_path):
    write(tmp_path / "a.csv", "stamp,px,py,pz", turns(0, 0.1))
    said = refused("fit", tmp_path / "a.csv", "--state", "stamp,px,py", "--differentiate", "-o", tmp_path / "p.npz")
    assert "A clock such as 'stamp' is read as the time and is no state: leave it out." in said
    other = refused("fit", tmp_path / "a.csv", "--state", "qx,px,py", "--differentiate", "-o", tmp_path / "p.npz")
    assert "A clock such as" not in other


@pytest.mark.parametrize(("names", "known"), [("x_mm,y_mm,z_mm", True), ("pos_x,pos_y,pos_z", True), ("a,b,c", False)])
def test_positions_are_guessed_with_a_unit_at_the_end_of_their_names(tmp_path, names, known):
    write(tmp_path / "a.csv", f"t,{names}", turns(0, 0.1))
    order = ("constraint", tmp_path / "a.csv", "-o", tmp_path / "c.npz")
    if not known:
        assert "cannot tell states and actions" in refused(*order)
    else:
        assert f"Learnt from {names.replace(',', ', ')} as states and their velocity" in run(*order)


def test_a_column_that_is_asked_for_without_its_unit_is_named_with_it(tmp_path):
    write(tmp_path / "a.csv", "t,x_mm,y_mm,z_mm", turns(0, 0.1))
    for asked, said in ((("x", "y", "z"), True), (("force", "y_mm"), False)):
        with pytest.raises(uc.UnconstrainError) as caught:
            uc.prepare(uc.read(tmp_path / "a.csv"), uc.Recipe(states=asked, differentiate="savgol"))
        assert ("Did you mean 'x_mm' or 'y_mm' or 'z_mm'?" in str(caught.value)) == said


@pytest.mark.parametrize(("moves", "named"), [(True, "x,y"), (False, "x,y"), (True, "x,y,z")])
@pytest.mark.parametrize("command", ["fit", "diagnose", "constraint"])
def test_a_position_that_stands_still_in_the_first_recording_alone_is_not_forgotten(tmp_path, command, moves, named):
    for k in range(4):
        rows = turns(k, 0.0)
        rows[:, 3] += 0.5 * np.sin(rows[:, 0] + k) * (moves and k > 0)
        write(tmp_path / f"w{k}.csv", "t,x,y,z", rows)
    how = {"fit": (*LINEAR, "-o", tmp_path / "p.npz"), "diagnose": ("--model", "affine")}
    how = how.get(command, ("-o", tmp_path / "c.npz"))
    said = text(call(command, tmp_path / "w*.csv", "--state", named, *how))  # --differentiate goes without saying
    forgotten = moves and named == "x,y"
    assert ("unused: 'w1', column 'z': moves by" in said) == forgotten
    assert ("is not taken: --state x,y,z if the task depends on it." in said) == forgotten
    assert ("Note: unused: the same of 'w2', 'w3', 3 in all." in said) == forgotten


def test_inspect_says_of_some_of_the_positions_what_fit_does_with_them(tmp_path):
    for k in range(3):
        write(tmp_path / f"w{k}.csv", "t,x,y,z,a", np.insert(turns(k, 0.1), 4, k, axis=1))
    said = text(call("inspect", tmp_path, "--state", "x,y"))
    assert "fit uses x, y as states and their velocity" in said
    learnt = text(call("fit", tmp_path, "--state", "x,y", *LINEAR, "-o", tmp_path / "p.npz"))
    assert "Learnt from x, y as states and their velocity" in learnt
    for command in (("inspect", tmp_path / "w*.csv"), ("fit", tmp_path / "w*.csv", "-o", tmp_path / "q.npz")):
        assert "cannot tell the actions" in text(call(*command, "--state", "x,a"))  # which is no position


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_millimetres_among_metres_are_said_to_be_and_make_no_common_plane(tmp_path, unit):
    for number in range(4):
        rows = turns(number, 0.2 * number * (unit > 1), unit if number == 3 else 1.0)
        write(tmp_path / f"w{number}.csv", "t,x,y,z", rows)
    said = text(call("fit", tmp_path, "--state", "x,y,z", "--differentiate", "--learner", "direct", "-o",
                     tmp_path / "p.npz"))  # fmt: skip
    assert ("is about 1000 (metres and millimetres) times larger than" in said) == (unit > 1)
    assert ("All demonstrations lie on one plane" in said) == (unit == 1)


@pytest.mark.parametrize(
    ("head", "size", "asked", "said"),
    [
        ("px,py,pz", 0.2, "--state px,py", "too, and is not taken: --state px,py,pz if the task"),
        (
            "x_mm,y_mm,z_mm",
            90.0,
            "--state x_mm,y_mm",
            "is not taken: --state x_mm,y_mm,z_mm if the task depends on it.",
        ),
        ("px,py,pz", 0.001, "--state px,py", ""),  # stands still, but for noise
        ("px,py,pz", np.nan, "--state px,py", ""),
        ("px,py,pz", 0.2, "--state px,py,pz", ""),
        ("px,py,pz", 0.2, "--state px,py --action pz", ""),
        ("px,py,fz", 0.2, "--state px,py", ""),  # a force
        ("x,y,z,vx,vy", 0.2, "", ""),  # guessed
    ],
)
def test_a_position_that_moves_beside_those_that_are_named_is_not_left_out_unsaid(tmp_path, head, size, asked, said):
    time, rng = 0.02 * np.arange(100), np.random.default_rng(0)
    for k in range(3):
        across = np.sin(3 * time + k) + 0.01 * rng.standard_normal(100)
        rows = np.column_stack([time, np.cos(2 * time + k), np.sin(2 * time - k), size * across])
        more = np.gradient(rows[:, 1:3], time, axis=0)[:, : 2 * ("vx" in head)]
        write(tmp_path / f"d{k}.csv", f"t,{head}", np.column_stack([rows, more]))
    how = *asked.split(), *["--differentiate"] * ("--action" not in asked and "vx" not in head)
    told = text(call("fit", tmp_path, *how, *LINEAR, "-o", tmp_path / "p.npz"))
    assert ("too, and is not taken" in told) == bool(said)
    assert said in told
    shown = text(call("inspect", tmp_path / "d*.csv", *how))
    assert ("too, and is not taken" in shown) == bool(said)

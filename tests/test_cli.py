"""The command line as its users meet it: what it prints, what it writes, how it says no."""

import cProfile
import csv
import io
import json
import os
import pickle
import pstats
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet
import pytest
import scipy.linalg
from click.testing import CliRunner
from numpy.testing import assert_allclose

import unconstrain as uc
from recorded import needs_rim
from seen import below
from unconstrain import cli, storage
from unconstrain.base.display import percent
from unconstrain.base.errors import MissingExtraError
from unconstrain.cli import fitting, rolling
from unconstrain.evaluation.verdicts import Mark
from unconstrain.paper import commands, experiments
from unconstrain.paper import pages as report
from unconstrain.paper.experiments import table1, washing
from unconstrain.paper.pages import washing_arm

A = np.array([[-0.5, 2.0], [-1.5, -0.3]])
b = np.array([0.2, -0.1])
"""The policy of the recordings, u = A x + b, known to none of the commands."""

DT = 0.05


class Ran:
    """A command that has run: its exit code and its two streams."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err


def call(*args):
    """Run a command in this process, for speed."""
    result = CliRunner().invoke(cli.main, list(map(str, args)), prog_name="unconstrain")
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return Ran(result.exit_code, result.stdout, result.stderr)


def run(*args):
    """Run a command that has to succeed; returns what it printed."""
    ran = call(*args)
    assert ran.code == 0, ran.err
    return ran.out


def refused(*args):
    """Run a command that has to refuse; returns its one sentence."""
    ran = call(*args)
    assert ran.code == 2
    assert not ran.out
    [said] = [line for line in ran.err.splitlines() if line.startswith("Error: ")]
    assert ran.err.splitlines()[-1] == said
    return said.removeprefix("Error: ")


def environment(**more):
    """The package under test, for a process of its own."""
    package = str(Path(uc.__file__).parents[1])
    return os.environ | {"PYTHONPATH": package, "OPENBLAS_NUM_THREADS": "1", "COLUMNS": "80", **more}


def shell(command, cwd=None, **more):
    """Run a line of shell in which ``unconstrain`` is the command."""
    line = f'unconstrain() {{ "{sys.executable}" -m unconstrain "$@"; }}; {command}'
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, cwd=cwd, env=environment(**more), check=False, timeout=120
    )
    return Ran(done.returncode, done.stdout, done.stderr)


# Recordings


def record(start, steps=40, free=False, seed=0):
    """Times, states and actions of the policy behind a random line that changes half-way."""
    rng = np.random.default_rng(seed)
    state, rows = np.array(start, dtype=float), []
    for step in range(steps):
        if step in (0, steps // 2):
            normal = rng.standard_normal(2)
            normal /= np.linalg.norm(normal)
        action = A @ state + b
        if not free:
            action = action - normal * (normal @ action)
        rows.append([step * DT, *state, *action])
        state = state + DT * action
    return np.array(rows)


def write(path, head, rows):
    """A CSV file with all digits."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(head.split(","))
        writer.writerows([[value if isinstance(value, str) else repr(float(value)) for value in row] for row in rows])
    return path


STARTS = np.random.default_rng(3).uniform(-1, 1, (8, 2))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Eight recordings, one in each file, and a policy learnt from them."""
    folder = tmp_path_factory.mktemp("recordings")
    for number, start in enumerate(STARTS):
        write(folder / f"swing_{number}.csv", "t,x,y,vx,vy", record(start, seed=number))
    run("fit", folder / "swing_*.csv", "--model", "linear", "-o", folder / "swing.npz")
    return folder


@pytest.fixture(scope="module")
def files(folder):
    return sorted(folder.glob("swing_*.csv"))


@pytest.fixture(scope="module")
def policy(folder):
    return folder / "swing.npz"


def learnt(path):
    """What the linear policy in a file says: its A and b, from three states."""
    at = storage.load(path)(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    return np.column_stack([at[1] - at[0], at[2] - at[0]]), at[0]


def assert_learnt_the_policy(path, tolerance=1e-6):
    found_A, found_b = learnt(path)
    assert_allclose(found_A, A, atol=tolerance)
    assert_allclose(found_b, b, atol=tolerance)


# Help


COMMANDS = [
    "inspect",
    "diagnose",
    "fit",
    "constraint",
    "score",
    "rollout",
    "export",
    "reproduce",
    "demo",
    "look",
    "play",
    "certify",
    "convert",
    "doctor",
    "example",
    "info",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example_and_fits_a_terminal(command):
    said = run(command, "--help")
    assert f"\n  Example:\n    unconstrain {command} " in said
    assert max(map(len, said.splitlines())) <= 80
    assert run(command, "-h") == said


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_prints_json(command):
    assert re.search(r"^  --json +Print JSON\.$", run(command, "--help"), re.MULTILINE)


TELLING = {
    "inspect": ("HERE/swing_*.csv",),
    "look": ("HERE/swing_*.csv", "-o", "look.html"),
    "play": ("-o", "play.html"),
    "certify": ("HERE/swing.npz",),
    "example": ("wiping",),
    "convert": ("HERE/swing_*.csv", "all.parquet"),
    "doctor": (),
}


@pytest.mark.parametrize("command", TELLING)
def test_json_has_the_verdict_that_is_printed(command, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [command, *(word.replace("HERE", str(folder)) for word in TELLING[command])]
    said = call(*words, "--json")
    told = json.loads(said.out)
    written = [*tmp_path.iterdir()]
    assert all(str(one.name) in said.out for one in written)
    again = call(*words, *["--force"] * bool(written))
    assert again.code == said.code == 0
    verdict = uc.evaluation.verdicts.Verdict(**told["verdict"] | {"mark": Mark[told["verdict"]["mark"].upper()]})
    assert again.out.startswith("\n".join(verdict.lines()))


def test_json_says_from_where_a_policy_does_not_arrive_and_how_much_was_looked_at(folder, policy, tmp_path):
    states = np.random.default_rng(0).uniform(-1, 1, (40, 2))
    storage.save(uc.ParametricPolicy(uc.Affine(), "direct").fit(states, 0.5 * states), tmp_path / "leaves.npz")
    ran = call("certify", tmp_path / "leaves.npz", "--json")
    found = json.loads(ran.out)
    assert (ran.code, found["holds"], found["verdict"]["mark"], len(found["start"])) == (3, False, "bad", 2)
    assert json.loads(run("certify", policy, "--json"))["holds"]
    found = json.loads(run("look", folder / "swing_*.csv", policy, "-o", tmp_path / "l.html", "--json"))
    assert (found["demonstrations"], found["page"]) == (8, str(tmp_path / "l.html"))
    assert found["about"][0].startswith("policy: ")


def test_help_of_all_names_each_command_in_a_whole_sentence():
    said = run("--help")
    for command in COMMANDS:
        [line] = [line for line in said.splitlines() if line.startswith(f"  {command} ")]
        assert line.endswith("."), line
        assert not line.endswith("..."), line
    for example in ("demo", "inspect *.csv", "fit *.csv -o policy.npz"):
        assert f"\n  unconstrain {example}   " in said
    assert max(map(len, said.splitlines())) <= 80


def test_defaults_that_help_says_are_those_of_the_library():
    said = " ".join(run("fit", "--help").split())
    assert f"savgol, seconds; {uc.Recipe().window_s} by default" in said
    assert f"threshold, {uc.Hybrid().alpha} by default" in said
    for option, default in (
        ("pauses", uc.Recipe().pauses),
        ("seams", uc.Recipe().seams),
        ("glitches", uc.Recipe().glitches),
    ):
        assert re.search(rf"--{option} \[[^]]*\] [^[]*\[default: {default}\]", said)


def test_examples_use_options_that_exist():
    for name in COMMANDS:
        command = cli.main.commands[name]
        known = {option for parameter in command.params for option in parameter.opts}
        assert {word for word in command.epilog.split() if word.startswith("-")} <= known


def test_importing_the_command_line_imports_nothing_heavy():
    code = "import sys, unconstrain.cli; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment(), check=True)
    heavy = {"numpy", "scipy", "sklearn", "joblib", "pandas", "matplotlib", "rich", "mink", "mujoco", "pooch"}
    assert not heavy & set(done.stdout.split())


def test_each_experiment_that_exists_can_be_asked_for():
    said = run("reproduce", "--help")
    assert f"{{{'|'.join(experiments.NAMES)}}}" in said.replace("\n", "").replace(" ", "")


def test_the_module_can_be_run(folder):
    ran = shell("unconstrain --help", folder)
    assert ran.code == 0
    assert ran.out.startswith("Usage: unconstrain [OPTIONS] COMMAND [ARGS]...")


def test_without_a_command_it_shows_how_to_go_on(folder):
    ran = shell("unconstrain", folder)
    assert ran.code == 2
    assert "unconstrain inspect *.csv" in ran.out + ran.err


# inspect


def test_inspect_shows_a_line_for_each_demonstration(files):
    lines = below(run("inspect", *files)).splitlines()
    assert lines[0].split("  ")[0] == "demonstration"
    assert lines[1].split() == ["swing_0", "40", "1.95", "s", "20.0", "Hz", "0.0%", "none", "none", "0"]
    assert [line.split()[0] for line in lines[1:9]] == [f"swing_{number}" for number in range(8)]
    assert lines[9] == "columns: x, y, vx, vy"
    assert lines[10] == "fit uses x, y as states and vx, vy as actions."
    assert max(map(len, lines)) <= 80


def test_inspect_finds_what_is_wrong(tmp_path):
    rows = [[step * 0.1, step, 1.0, 0.0 if step in (2, 3) else 1.0, 0.0] for step in range(30)]
    for row in rows[20:]:
        row[0] += 2.0
    rows[5][2] = float("nan")
    rows[8][0] = rows[7][0]
    write(tmp_path / "odd.csv", "t,x,y,vx,vy", rows)
    said = run("inspect", tmp_path / "odd.csv")
    assert "2.10 s at 1.90 s" in said
    assert "y: 1" in said
    assert below(said).splitlines()[1].split()[-1] == "2"
    assert "'odd': time does not increase at row 8." in said


def test_inspect_prints_json_for_programs(files):
    found = json.loads(run("inspect", *files, "--json"))["demonstrations"]
    assert [one["name"] for one in found] == [f"swing_{number}" for number in range(8)]
    assert found[0]["columns"] == ["x", "y", "vx", "vy"]
    assert found[0]["samples"] == 40
    assert found[0]["rate_hz"] == pytest.approx(20.0)
    assert found[0]["duration_s"] == pytest.approx(1.95)
    assert found[0]["gaps"] == []
    assert found[0]["zero_actions"] == 0


@pytest.mark.parametrize("first", ["", "demo,"])
def test_inspect_looks_at_each_of_many_columns_a_few_times(tmp_path, first):
    columns, words = 4000, ["wipe"] if first else []
    rows = [[*words, *[0.01 * at] * columns] for at in range(50)]
    write(tmp_path / "wide.csv", first + ",".join(f"s{at}" for at in range(columns)), rows)
    with cProfile.Profile() as profile:
        said = run("inspect", tmp_path / "wide.csv")
    assert pstats.Stats(profile).total_calls < 140 * columns  # what is imported first, too
    assert "its columns s0, s1, " in " ".join(said.split())
    assert "s29 and 3970 more. Say which with --state" in " ".join(said.split())


def test_inspect_shows_columns_that_fit_cannot_guess(tmp_path):
    write(tmp_path / "odd.csv", "left,right,up", [[1, 2, 3], [4, 5, 6]])
    said = run("inspect", tmp_path / "odd.csv")
    assert "columns: left, right, up\n" in said
    told = " ".join(said.split())
    assert "fit needs to know more: 'odd': cannot tell states and actions from its columns left, right, up." in told
    assert "Say which with --state and --action, or take" in told
    assert re.search(
        r"\n    unconstrain fit \S+odd\.csv --state left,right,up --rate HZ --differentiate -o policy\.npz\n", said
    )


def test_inspect_counts_many_gaps(tmp_path):
    times = np.arange(60) * 0.1 + 3.0 * (np.arange(60) // 10)
    write(tmp_path / "gaps.csv", "t,x,y", np.column_stack([times, times, times]))
    assert "and 2 more" in run("inspect", tmp_path / "gaps.csv")


# fit


def test_fit_finds_the_policy_behind_random_constraints(policy):
    assert_learnt_the_policy(policy)


def test_direct_learning_does_not(files, tmp_path):
    run("fit", *files, "--model", "linear", "--learner", "direct", "-o", tmp_path / "p.npz")
    found, _ = learnt(tmp_path / "p.npz")
    assert np.abs(found - A).max() > 0.1


def test_fit_says_what_it_did(files, tmp_path):
    lines = below(run("fit", *files, "--model", "linear", "--learner", "hybrid", "-o", tmp_path / "p.npz")).splitlines()
    assert lines[:3] == [
        "Learnt from x, y as states and vx, vy as actions.",
        "8 demonstrations, 320 samples.",
        "The inconsistency determined 100% of 6 weight directions.",
    ]
    assert re.fullmatch(r"Share of the motion explained, .*: 1 on the training data, 1 where held out\.", lines[3])
    assert lines[4].startswith("Run from the same starts: for 1 of 8 demonstrations that look flat ")
    assert lines[5:] == [f"policy: {tmp_path / 'p.npz'}"]


@pytest.mark.parametrize("command", ["fit", "constraint"])
def test_what_is_learnt_goes_to_a_file_that_is_called_so(files, tmp_path, command):
    said = refused(command, *files, "-o", tmp_path / "p.csv")
    assert said == f"{tmp_path / 'p.csv'}: what is learnt is written as .npz; name it {tmp_path / 'p.npz'}."
    assert not (tmp_path / "p.csv").exists()


@pytest.mark.parametrize(
    ("units", "more", "said"),
    [
        (" [mm]; [mm]; [mm/s]; [mm/s]", (), " mm/s on each action;"),
        (" [mm]; [rad]; [mm/s]; [rad/s]", (), " on each action, in its unit;"),
        (" [mm]; [mm]; [mm/s]; [mm/s]", ("--scale", "1000,1000"), " on each action, in its unit;"),
    ],
)
def test_fit_says_the_unit_of_noise_where_actions_have_one(files, tmp_path, units, more, said):
    head = ",".join(f"{name}{unit}" for name, unit in zip(("x", "y", "vx", "vy"), units.split(";"), strict=True))
    for path in files:
        (tmp_path / path.name).write_text(path.read_text().replace("x,y,vx,vy", head, 1))
    asked = ("--state", "x,y", "--action", "vx,vy", "--model", "linear", *more, "-o", tmp_path / "p.npz")
    assert re.search(rf"misfit are about [\d.e+-]+{re.escape(said)}", run("fit", *tmp_path.glob("*.csv"), *asked))


def test_fit_says_how_the_default_learner_went(files, tmp_path):
    said = below(run("fit", *files, "--model", "linear", "-o", tmp_path / "p.npz")).splitlines()[2]
    assert re.fullmatch(
        r"Learnt as .*: .*\. Estimated squared error of other ways to learn, as times that of this \(more is worse\): "
        r".* \('fit -v' lists all\)\. "
        r"Noise and misfit are about \S+ on each action, in its unit; 'unconstrain diagnose' says what looks free\.",
        said,
    )


def test_options_of_the_hybrid_mean_the_hybrid(files, tmp_path):
    for option in (("--alpha", "auto"), ("--alpha", 0.3), ("--softness", 0.1)):
        run("fit", *files, "--model", "linear", *option, "-o", tmp_path / "p.npz", "--force")
        learner = storage.load(tmp_path / "p.npz").learner
        assert isinstance(learner, uc.Hybrid)
        assert getattr(learner, option[0].removeprefix("--")) == option[1]
    assert "auto" in call("fit", *files, "--alpha", "much", "-o", tmp_path / "p.npz").err


@pytest.mark.slow
def test_a_cluster_computes_no_samples(files, tmp_path):
    learner = ("--learner", "robust", "--scheduler", "tcp://nowhere:1")  # learns from sums there
    assert "nothing answers" in refused("fit", *files, *learner, "-o", tmp_path / "p.npz")


@pytest.mark.parametrize("learner", cli.LEARNERS)
@pytest.mark.parametrize("model", fitting.MODELS)
def test_each_model_takes_each_learner(files, tmp_path, model, learner):
    said = run("fit", *files[:4], "--model", model, "--learner", learner, "-o", tmp_path / "p.npz")
    assert ("one affine model for all states" in said) == (model == "local")  # as these movements are
    assert ("The inconsistency determined" in said) == (learner in ("hybrid", "inconsistency"))
    assert ("says what looks free" in said) == (learner == "robust")
    assert type(storage.load(tmp_path / "p.npz").learner).__name__.lower() == learner


@pytest.mark.parametrize(
    ("model", "features"), [("linear", 3), ("affine", 3), ("quadratic", 6), ("cubic", 10), ("rbf", 25)]
)
def test_each_model_has_features_of_its_own(files, tmp_path, model, features):
    run("fit", *files, "--model", model, "--learner", "direct", "-o", tmp_path / "p.npz")
    assert storage.load(tmp_path / "p.npz").solution_.weights.shape == (1, 2, features)


def test_what_is_missed_where_held_out_is_the_verdict(tmp_path):
    rng = np.random.default_rng(0)
    for k in range(4):  # nothing in common
        write(tmp_path / f"{k}.csv", "t,x,y,vx,vy", np.column_stack([np.arange(60), rng.standard_normal((60, 4))]))
    given = ["fit", str(tmp_path / "*.csv"), "-o", str(tmp_path / "p.npz"), "--model", "rbf"]
    result = CliRunner().invoke(cli.main, [*given, "--learner", "inconsistency"])
    assert result.exit_code == 0
    assert result.stdout.startswith("✖ The policy misses held-out motion by more than"), result.output
    assert "or they have too little in common" in " ".join(result.stdout.split())


def test_a_folder_that_is_called_as_a_setting_is_named_and_no_option(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in ("goal", "start"):
        Path(name).mkdir()
        result = CliRunner().invoke(cli.main, ["fit", name, "-o", "p.npz"])
        assert (result.exit_code, result.stderr.splitlines()[-1][: len(name) + 9]) == (2, f"Error: {name}: ")


def test_what_info_says_fits_eighty_columns(policy):
    lines = run("info", policy).splitlines()
    assert max(len(line) for line in lines if "unconstrain score" not in line) <= 80  # which is copied


def test_a_policy_is_no_recording(policy, tmp_path):
    said = refused("fit", policy, "-o", tmp_path / "p.npz")
    assert said.endswith("is a policy that was saved, not recordings to learn from.")


def test_settings_reach_the_policy(files, tmp_path):
    run(
        "fit",
        *files,
        "--variance",
        0.3,
        "--alpha",
        0.05,
        "--folds",
        4,
        "--hold-out",
        "sample",
        "-o",
        tmp_path / "p.npz",
    )
    found = storage.load(tmp_path / "p.npz")
    assert (found.variance, found.learner) == (0.3, uc.Hybrid(alpha=0.05))
    assert found.validation == uc.Folds(4, by="sample")
    run("fit", *files, "--model", "rbf", "--centres", 9, "--softness", 0.1, "-o", tmp_path / "p.npz", "--force")
    found = storage.load(tmp_path / "p.npz")
    assert (found.features, found.learner) == (uc.KMeansRBF(9), uc.Hybrid(softness=0.1, threshold=0.0))


def test_the_width_of_the_local_models_is_chosen_and_told(tmp_path):
    spots = np.random.default_rng(0).uniform(-1.0, 1.0, (4, 40, 2))
    for number, xy in enumerate(spots):
        rows = np.column_stack([xy, np.sin(6.0 * xy)])
        np.savetxt(tmp_path / f"{number}.csv", rows, delimiter=",", header="x,y,u,v", comments="")
    columns = (*sorted(tmp_path.glob("*.csv")), "--state", "x,y", "--action", "u,v")
    said = run("fit", *columns, "-o", tmp_path / "p.npz")
    found, widest = storage.load(tmp_path / "p.npz").fields_, uc.LocallyLinearPolicy(None, learner="direct")
    states, actions = np.concatenate(spots), np.sin(6.0 * np.concatenate(spots))
    assert found.variance < widest.fit(states, actions).fields_.variance
    assert f"local models of σ² {found.variance:.4g}" in said
    assert f"local models of σ² {found.variance:.4g}" in run("info", tmp_path / "p.npz")


def test_a_pattern_is_expanded_where_the_shell_did_not(folder, tmp_path):
    assert "8 demonstrations" in run("fit", folder / "swing_?.csv", "--model", "linear", "-o", tmp_path / "p.npz")


@pytest.mark.parametrize(("column", "option"), [("demo", ()), ("person", ("--group", "person"))])
def test_one_file_can_hold_many_demonstrations(tmp_path, column, option):
    rows = [[f"no {k}", *row] for k, start in enumerate(STARTS) for row in record(start, seed=k)]
    write(tmp_path / "all.csv", f"{column},t,x,y,vx,vy", rows)
    assert "8 demonstrations, 320" in run(
        "fit", tmp_path / "all.csv", *option, "--model", "linear", "-o", tmp_path / "p.npz"
    )
    assert_learnt_the_policy(tmp_path / "p.npz")
    lines = below(run("score", tmp_path / "p.npz", tmp_path / "all.csv")).splitlines()
    assert [line.split("  ")[0] for line in lines[1:10]] == [*(f"no {k}" for k in range(8)), "all"]


def test_columns_can_be_named(tmp_path):
    for k, start in enumerate(STARTS):
        write(tmp_path / f"{k}.csv", "clock,p,q,force,dp,dq", np.insert(record(start, seed=k), 3, 7.0, axis=1))
    named = ("--state", "p,q", "--action", "dp, dq", "--time", "clock")
    run("fit", tmp_path / "*.csv", *named, "--model", "linear", "-o", tmp_path / "p.npz")
    assert_learnt_the_policy(tmp_path / "p.npz")
    assert run("rollout", tmp_path / "p.npz", "--start", "0,0", "--steps", 1).splitlines()[0] == "t,p,q,vp,vq"


def circle(tmp_path, rate=100.0):
    """Two turns at one radian a second, at several radii: u = (−y, x)."""
    times = np.arange(0.0, 4 * np.pi, 1 / rate)
    for k, radius in enumerate((0.5, 1.0, 1.5)):
        track = radius * np.column_stack([np.cos(times), np.sin(times)])
        write(tmp_path / f"circle_{k}.csv", "t,x,y", np.column_stack([times, track]))
    return tmp_path / "circle_*.csv"


@pytest.mark.parametrize("how", [(), ("--differentiate",), ("--by", "central"), ("--by", "savgol", "--window", 0.1)])
def test_velocities_are_found_from_positions(tmp_path, how):
    said = run("fit", circle(tmp_path), *how, "--model", "linear", "-o", tmp_path / "p.npz")
    method = "central differences" if "central" in how else "savgol, 0.11 s" if 0.1 in how else "savgol, 0.25 s"
    assert f"x, y as states and their velocity ({method}) as actions." in said
    found_A, found_b = learnt(tmp_path / "p.npz")
    assert_allclose(found_A, [[0, -1], [1, 0]], atol=1e-3)
    assert_allclose(found_b, 0, atol=1e-3)


def test_rate_resamples(tmp_path):
    said = run("fit", circle(tmp_path), "--rate", 10, "--model", "linear", "-o", tmp_path / "p.npz")
    assert f"3 demonstrations, {3 * 126} samples" in said  # 4π s at 10 Hz, with both ends
    assert_allclose(learnt(tmp_path / "p.npz")[0], [[0, -1], [1, 0]], atol=2e-3)


def test_centre_takes_positions_from_the_mean(tmp_path):
    for k, at in enumerate([(5.0, -3.0), (0.0, 9.0), (1.0, 1.0)]):
        times = np.arange(0.0, 2 * np.pi, 0.01)
        track = np.array(at) + np.column_stack([np.cos(times), np.sin(times)])
        write(tmp_path / f"{k}.csv", "t,x,y", np.column_stack([times, track]))
    run("fit", tmp_path / "*.csv", "--centre", "--model", "linear", "-o", tmp_path / "p.npz")
    assert_allclose(learnt(tmp_path / "p.npz")[0], [[0, -1], [1, 0]], atol=1e-2)


def test_archives_are_read(tmp_path):
    rows = np.concatenate([record(start, seed=k) for k, start in enumerate(STARTS)])
    groups = np.repeat([f"demo {k}" for k in range(8)], 40)
    np.savez(tmp_path / "all.npz", states=rows[:, 1:3], actions=rows[:, 3:], times=rows[:, 0], groups=groups)
    assert "8 demonstrations" in run("fit", tmp_path / "all.npz", "--model", "linear", "-o", tmp_path / "p.npz")
    assert_learnt_the_policy(tmp_path / "p.npz")


def test_what_was_repaired_is_said_in_a_note(tmp_path):
    pattern = circle(tmp_path)
    track = np.loadtxt(tmp_path / "circle_0.csv", delimiter=",", skiprows=1)
    track[600:, 0] += 3.0
    write(tmp_path / "circle_0.csv", "t,x,y", track)
    ran = call("fit", pattern, "--model", "linear", "-o", tmp_path / "p.npz")
    assert ran.code == 0
    [note] = [line for line in ran.err.splitlines() if line.startswith("Note: ")]
    said = (
        "Note: clock-gap: 'circle_0', row 600 (line 602): 1 gap in the time stamps, the longest 3.01 s after 5.99 s; "
    )
    assert note.startswith(said)


def test_fit_writes_a_report_too(files, tmp_path):
    said = run("fit", *files, "--model", "linear", "-o", tmp_path / "p.npz", "--report", tmp_path / "p.html")
    assert f"report: {tmp_path / 'p.html'}" in said
    assert "<html" in (tmp_path / "p.html").read_text(encoding="utf-8")


def test_fit_and_inspect_read_parquet_and_hdf5(folder, policy, tmp_path):
    for number, start in enumerate(STARTS):
        table = dict(zip(("t", "x", "y", "vx", "vy"), record(start, seed=number).T, strict=True))
        pyarrow.parquet.write_table(pyarrow.table(table), tmp_path / f"swing_{number}.parquet")
        with h5py.File(tmp_path / f"swing_{number}.h5", "w") as file:
            for name, values in table.items():
                file[name] = values
    for suffix in ("parquet", "h5"):
        pattern = tmp_path / f"swing_*.{suffix}"
        surveyed = json.loads(run("inspect", pattern, "--json"))["demonstrations"]
        assert [found["name"] for found in surveyed] == [f"swing_{number}" for number in range(8)]
        learnt_here = tmp_path / f"{suffix}.npz"
        assert "8 demonstrations, 320 samples." in run("fit", pattern, "--model", "linear", "-o", learnt_here)
        assert_allclose(np.hstack([*learnt(learnt_here)[0]]), np.hstack([*learnt(policy)[0]]), atol=1e-12)


def test_a_report_of_more_than_memory_shows_its_beginning(folder, tmp_path, monkeypatch):
    from unconstrain.recordings import streams

    stream = uc.Stream(sorted(folder.glob("swing_*.csv")))
    assert len(stream.beginning()) == 8
    monkeypatch.setattr(streams, "HELD_BYTES", 3000)
    assert len(uc.Stream(stream.paths).beginning()) == 2


def test_inspect_asks_what_was_meant_by_a_column_that_a_file_lacks(tmp_path):
    for name, columns in (("a", "t,x,y"), ("b", "t,x,Y")):
        rows = "\n".join(f"{0.1 * i:.1f},{i},{i % 5}" for i in range(30))
        (tmp_path / f"{name}.csv").write_text(f"{columns}\n{rows}\n")
    said = run("inspect", tmp_path / "a.csv", tmp_path / "b.csv", "--state", "x,y", "--differentiate")
    assert "'b' has no column 'y'; it has x, Y. Did you mean 'Y'?" in " ".join(said.split())


def test_the_beginning_is_kept_of_what_was_read(folder, monkeypatch):
    from unconstrain.recordings import streams

    monkeypatch.setattr(streams, "HELD_BYTES", 3000)
    stream = uc.Stream(sorted(folder.glob("swing_*.csv")))
    before = stream.beginning()
    for _ in stream:
        pass
    monkeypatch.setattr(streams, "read_blocks", None)  # nothing is read again
    for one, again in zip(before, stream.beginning(), strict=True):
        assert_allclose(one.states, again.states, rtol=0)


# score


def test_score_prints_a_line_for_each_demonstration_and_all(policy, files):
    said = run("score", policy, *files[:2])
    assert said.startswith("! The policy explains 100% of the motion, but it learnt from 2 of 2\n")
    lines = below(said).splitlines()
    assert lines[0].split("  ")[0] == "demonstration"
    rows = [re.split("  +", line.strip()) for line in lines[:4]]
    assert [row[:3] for row in rows] == [
        ["demonstration", "samples", "explains"],
        ["swing_0", "40", "100%"], ["swing_1", "40", "100%"], ["all", "80", "100%"],
    ]  # fmt: skip
    assert max(float(row[3]) for row in rows[1:]) < 1e-12
    legend = [line.split(":")[0] for line in lines[4:]]
    assert legend == ["explains", "normalised inconsistency"]  # what each is


def test_the_table_of_score_says_the_share_of_its_verdict_where_slow_samples_count_less(tmp_path):
    rows = record((0.3, 0.5), free=True)
    write(tmp_path / "free.csv", "t,x,y,vx,vy", rows)
    run("fit", tmp_path / "free.csv", "--model", "linear", "--learner", "direct", "-o", tmp_path / "p.npz")
    rows[-10:, 3:] = 1e-6 * np.random.default_rng(0).normal(size=(10, 2))  # noise, as it rests
    write(tmp_path / "rests.csv", "t,x,y,vx,vy", rows)
    found = json.loads(run("score", tmp_path / "p.npz", tmp_path / "rests.csv", "--json"))
    [row] = found["rows"]
    assert f"explains {percent(row['explains'])} of" in found["verdict"]["said"]
    assert row["explains"] > 1 - row["ninc"] + 0.05


def test_score_is_the_inconsistency_by_hand(files, tmp_path):
    run("fit", *files, "--model", "linear", "--learner", "direct", "-o", tmp_path / "p.npz")
    found = json.loads(run("score", tmp_path / "p.npz", files[0], "--json"))
    found_A, found_b = learnt(tmp_path / "p.npz")
    rows = np.loadtxt(files[0], delimiter=",", skiprows=1)
    missed = 0.0
    for row in rows:
        state, action = row[1:3], row[3:]
        length = np.linalg.norm(action)
        missed += (length - action @ (found_A @ state + found_b) / length) ** 2
    variance = len(rows) * rows[:, 3:].var(axis=0).sum()
    assert found["rows"][0] | {"explains": 1} == {
        "demonstration": "swing_0", "samples": 40, "fast": 40, "explains": 1, "ninc": pytest.approx(missed / variance)
    }  # fmt: skip
    assert found["all"]["ninc"] == pytest.approx(missed / variance)
    assert found["policy"] == str(tmp_path / "p.npz")


def test_score_with_a_plane_is_the_constrained_error_by_hand(policy, tmp_path):
    normal = np.array([0.6, 0.8])
    rows = record((0.3, 0.5), free=True)
    rows[:, 3:] -= np.outer(rows[:, 3:] @ normal, normal)
    rows[:, 3:] += 0.1 * np.array([-0.8, 0.6])  # a mistake along the plane, of length 0.1 at each sample
    write(tmp_path / "held.csv", "t,x,y,vx,vy", rows)
    variance = rows[:, 3:].var(axis=0).sum()
    said = below(run("score", policy, tmp_path / "held.csv", "--plane", "3,4"))  # of any length
    assert said.splitlines()[0].split()[-1] == "nCPE"
    assert float(said.splitlines()[1].split()[-1]) == pytest.approx(0.01 / variance, rel=1e-3)
    assert json.loads(run("score", policy, tmp_path / "held.csv", "--plane", "3,4", "--json"))["all"]["ncpe"] == (
        pytest.approx(0.01 / variance)
    )


def test_score_prepares_recordings_as_fit_did(tmp_path):
    pattern = circle(tmp_path)
    run("fit", pattern, "--by", "central", "--rate", 10, "--model", "linear", "-o", tmp_path / "p.npz")
    assert json.loads(run("score", tmp_path / "p.npz", pattern, "--json"))["rows"][0]["samples"] == 126


def test_a_policy_saved_from_python_can_be_scored(files, tmp_path):
    demos = uc.prepare(uc.read(files))
    uc.save(uc.ParametricPolicy(uc.Affine()).fit_demonstrations(demos), tmp_path / "p.npz")
    said = run("score", tmp_path / "p.npz", files[0])
    assert said.startswith("✔ The policy explains 100% of held-out motion, if none of it was learnt from:\n")
    assert below(said).splitlines()[1].startswith("swing_0")


# rollout


def table(text):
    """Head and numbers of a CSV text."""
    head, *rows = csv.reader(io.StringIO(text))
    return head, np.array(rows, dtype=float)


def test_rollout_follows_the_policy_by_euler_steps(policy):
    asked = ("rollout", policy, "--start", "0.5,-0.25", "--steps", 30, "--dt", 0.1, "--method", "euler")
    head, rows = table(run(*asked))
    assert head == ["t", "x", "y", "vx", "vy"]
    state = np.array([0.5, -0.25])
    for step, row in enumerate(rows):
        action = A @ state + b
        assert_allclose(row, [0.1 * step, *state, *action], atol=1e-6)
        state = state + 0.1 * action
    assert len(rows) == 30


def test_rollout_by_default_is_where_the_policy_goes_and_not_where_long_steps_do(policy):
    _, rows = table(run("rollout", policy, "--start", "0.5,-0.25", "--steps", 30, "--dt", 0.1))
    flow = scipy.linalg.expm(0.1 * np.block([[A, b[:, None]], [np.zeros((1, 3))]]))
    state = np.array([0.5, -0.25, 1.0])
    for row in rows:
        assert_allclose(row[1:3], state[:2], atol=2e-5)
        state = flow @ state


def test_rollout_stays_on_a_plane(policy):
    normal = np.array([1.0, 2.0])
    _, free = table(run("rollout", policy, "--start", "0.5,0.1", "--steps", 100))
    _, held = table(run("rollout", policy, "--start", "0.5,0.1", "--steps", 100, "--plane", "1,2"))
    assert np.abs((free[:, 1:3] - [0.5, 0.1]) @ normal).max() > 0.1
    assert_allclose((held[:, 1:3] - [0.5, 0.1]) @ normal, 0, atol=1e-8)
    assert_allclose(held[:, 3:] @ normal, 0, atol=1e-8)
    along = np.array([2.0, -1.0]) / np.sqrt(5)
    assert_allclose(held[:, 3:] @ along, (held[:, 1:3] @ A.T + b) @ along, atol=1e-6)  # u = N π


def test_rollout_writes_what_it_would_print(policy, tmp_path):
    printed = run("rollout", policy, "--start", "0.5,0", "--steps", 5)
    assert run("rollout", policy, "--start", "0.5,0", "--steps", 5, "-o", "-") == printed
    said = run("rollout", policy, "--start", "0.5,0", "--steps", 5, "-o", tmp_path / "path.csv")
    assert said.startswith("✔ Near demonstrations for all 0.08 s: supported.\n")
    assert said.endswith(f"movement: {tmp_path / 'path.csv'}\n")
    assert (tmp_path / "path.csv").read_text() == printed


def test_a_negative_start_is_a_number_and_no_option(policy):
    _, rows = table(run("rollout", policy, "--start", "-0.5,-1e-3", "--steps", 1))
    assert_allclose(rows[0, 1:3], [-0.5, -1e-3])


def test_a_rollout_can_be_learnt_from(policy, tmp_path):
    for k, start in enumerate(["0.5,0", "-0.5,0.5", "0.2,-0.9"]):
        run("rollout", policy, "--start", start, "-o", tmp_path / f"{k}.csv")
    run("fit", tmp_path / "?.csv", "--model", "linear", "-o", tmp_path / "again.npz")
    assert_learnt_the_policy(tmp_path / "again.npz", 1e-4)


def test_a_movement_far_from_the_data_is_noted(files, tmp_path):
    run("fit", *files, "-o", tmp_path / "p.npz")
    near = call("rollout", tmp_path / "p.npz", "--start", f"{STARTS[0][0]},{STARTS[0][1]}", "--steps", 3)
    far = call("rollout", tmp_path / "p.npz", "--start", "90,0", "--steps", 3, "--least-support", 0)
    assert near.code == 0
    assert near.err.startswith("✔ Near demonstrations for all 0.04 s")
    assert far.code == 0
    assert far.err.startswith("✖ No demonstration passes near for 100% of the time, first at 0.00 s:")
    assert len(far.out.splitlines()) == 4


def test_a_movement_stops_where_support_ends_unless_told_to_go_on(files, tmp_path):
    run("fit", *files, "--learner", "direct", "-o", tmp_path / "p.npz")
    start = ("rollout", tmp_path / "p.npz", "--start", f"{STARTS[0][0]},{STARTS[0][1]}", "--steps", 60, "--dt", 1.0)
    _, whole = table(run(*start, "--least-support", 0))  # steps that are much too long
    cut = call(*start, "-o", tmp_path / "path.csv")
    assert cut.code == 0
    assert cut.out.startswith("! rollout stops after ")
    _, part = table((tmp_path / "path.csv").read_text())
    assert 0 < len(part) < len(whole) == 60
    assert_allclose(part, whole[: len(part)])
    told = json.loads(run(*start, "--json"))
    assert "stops after" in told["verdict"]["said"]
    assert len(told["rows"]) == len(part)


def test_a_movement_that_diverges_is_written_up_to_there(policy, tmp_path):
    said = refused("rollout", policy, "--start", "1,0", "--dt", 100, "-o", tmp_path / "path.csv")
    assert re.match(r"after .* s, at \(.*\), the movement left the finite numbers at step", said)
    _, part = table((tmp_path / "path.csv").read_text())
    assert 1 < len(part) < 200


def test_rollout_goes_round_what_is_in_the_way(policy):
    start = ("rollout", policy, "--start", "0.9,0.9", "--steps", 200, "--method", "rk4")
    _, free = table(run(*start))
    at = free[60, 1:3]
    for size, radii in (("0.1", 0.1), ("0.1,0.2", [0.1, 0.2])):
        _, round_ = table(run(*start, "--obstacle", f"{at[0]},{at[1]},{size}", "--obstacle", "5,5,1"))
        assert np.linalg.norm((free[:, 1:3] - at) / radii, axis=1).min() < 1
        assert np.linalg.norm((round_[:, 1:3] - at) / radii, axis=1).min() >= 1 - 1e-7
        assert_allclose(round_[-1, 1:3], free[-1, 1:3], atol=0.2)  # it gets by
    assert "--obstacle: got 2 numbers, expected 2 of a centre, then a radius or 2 radii." in refused(
        *start, "--obstacle", "1,2"
    )


def test_accelerations_are_followed_with_order_2(tmp_path):
    rng = np.random.default_rng(0)
    rows = np.column_stack([0.1 * np.arange(60), rng.uniform(-1, 1, (60, 2))])
    write(tmp_path / "one.csv", "t,q,v,a", np.column_stack([rows, -2.0 * rows[:, 1] - 0.5 * rows[:, 2]]))
    fit = ("fit", tmp_path / "one.csv", "--state", "q,v", "--action", "a", "--model", "linear", "--learner", "direct")
    run(*fit, "-o", tmp_path / "p.npz")
    asked = ("--start", "1,0", "--order", 2, "--steps", 40, "--dt", 0.1, "--method", "euler")
    head, path = table(run("rollout", tmp_path / "p.npz", *asked))
    assert head == ["t", "q", "v", "a"]
    q, v = 1.0, 0.0
    for row in path:
        assert_allclose(row[1:], [q, v, -2.0 * q - 0.5 * v], atol=1e-6)
        q, v = q + 0.1 * v, v + 0.1 * row[3]


# export


@pytest.mark.parametrize("name", ["swing.c", "swing.ONNX", "swing.js"])
def test_export_writes_what_its_suffix_says(policy, tmp_path, name):
    said = run("export", policy, "-o", tmp_path / name)
    assert str(tmp_path / name) in said
    assert (tmp_path / "swing.h").exists() == (f"header: {tmp_path / 'swing.h'}" in said) == (name == "swing.c")
    exported = (tmp_path / name).read_bytes()
    assert (b"void swing_step(const double state[2], double action[2]);" in exported) == (name == "swing.c")


def test_export_calls_the_c_function_as_told(policy, tmp_path):
    run("export", policy, "-o", tmp_path / "swing.c", "--name", "left")
    assert "void left_step(" in (tmp_path / "swing.c").read_text()
    assert "states: x, y" in (tmp_path / "swing.h").read_text()
    assert "swing.c: is there" in refused("export", policy, "-o", tmp_path / "swing.c")
    (tmp_path / "swing.c").unlink()
    assert "swing.h: is there" in refused("export", policy, "-o", tmp_path / "swing.c")
    run("export", policy, "-o", tmp_path / "swing.c", "--float", "--force")
    assert "void swing_step(const float state[2], float action[2]);" in (tmp_path / "swing.h").read_text()


def test_export_writes_a_package_for_ros(policy, tmp_path):
    said = run("export", policy, "--ros2", tmp_path / "swing", "--messages", "joints")
    assert said.startswith("✔ The policy explains ")
    assert said.endswith(f"ROS 2 package: {tmp_path / 'swing'}\n")
    assert 'joints: ["x", "y"]' in (tmp_path / "swing" / "config" / "swing.yaml").read_text()
    assert "swing: is there" in refused("export", policy, "--ros2", tmp_path / "swing")
    assert "expected three of each" in refused("export", policy, "--ros2", tmp_path / "other", "--messages", "pose")
    assert "double precision" in refused("export", policy, "--ros2", tmp_path / "other", "--float")
    assert "got nothing to write to" in refused("export", policy)
    assert not (tmp_path / "other").exists()


def test_no_package_commands_accelerations_as_velocities(tmp_path):
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (40, 4))
    reach = uc.ParametricPolicy(uc.Affine(), "direct").fit(states, -states[:, :2] - states[:, 2:])
    recipe = {"states": ["x", "y", "vx", "vy"], "actions": ["ax", "ay"]}
    storage.save(reach, tmp_path / "reach.npz", {"recipe": recipe})
    said = refused("export", tmp_path / "reach.npz", "--ros2", tmp_path / "reach", "--messages", "joints")
    assert said.startswith(
        "--ros2: got 4 states (x, y, vx, vy) and 2 actions (ax, ay), expected positions and their vel"
    )
    assert not (tmp_path / "reach").exists()
    run("export", tmp_path / "reach.npz", "-o", tmp_path / "reach.c")
    assert "actions: ax, ay" in (tmp_path / "reach.c").read_text()


def test_export_as_json_says_the_same(policy, tmp_path):
    told = json.loads(run("export", policy, "-o", tmp_path / "swing.c", "--json"))
    assert {"C source": str(tmp_path / "swing.c"), "header": str(tmp_path / "swing.h")}.items() <= told.items()
    assert told["verdict"]["mark"] == json.loads(run("info", policy, "--json"))["verdict"]["mark"] == "good"
    assert f"-DSWING_SELF_TEST {tmp_path / 'swing.c'}" in told["verdict"]["next"]


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
@pytest.mark.parametrize(
    ("file", "named", "name"),
    [
        ("plate-wipe.c", (), "plate_wipe"),
        ("a.b.c", (), "a_b"),
        ("two words.c", (), "two_words"),
        ("9-9.c", (), "policy_9_9"),
        ("swing.c", ("--name", "Left"), "Left"),
    ],
)
def test_the_printed_self_test_runs_whatever_the_file_is_called(policy, tmp_path, monkeypatch, file, named, name):
    monkeypatch.chdir(tmp_path)
    said = run("export", policy, "-o", file, *named)
    assert f"Stop the robot where {name}_support() is near 0." in " ".join(said.split())
    assert f"double {name}_support(" in (tmp_path / file).read_text()
    command = next(line for line in said.splitlines() if line.strip().startswith("cc -std=c99"))
    subprocess.run(["sh", "-c", command], cwd=tmp_path, check=True, capture_output=True)


@pytest.mark.parametrize("file", ["plate-wipe", "a.b", "two words", "9-9"])
def test_what_is_printed_of_other_targets_names_nothing_that_is_not_there(policy, tmp_path, monkeypatch, file):
    monkeypatch.chdir(tmp_path)
    told = json.loads(run("export", policy, "-o", f"{file}.js", "--ros2", file, "--json"))
    assert told["verdict"]["next"] == "Import 'policy' and 'support' from it."
    assert "export const { policy, support, under } =" in (tmp_path / f"{file}.js").read_text()
    assert f"'scale' in {file}/config makes them" in told["verdict"]["doubt"]
    assert "scale:" in "".join(one.read_text() for one in (tmp_path / file / "config").iterdir())


def test_export_refuses_other_suffixes_and_names_where_there_are_none(policy, tmp_path):
    assert refused("export", policy, "-o", tmp_path / "swing.h").endswith(
        "got the suffix '.h', expected .c for C source, .onnx for an ONNX graph, or .js for a JavaScript module."
    )
    assert refused("export", policy, "-o", tmp_path / "swing.onnx", "--name", "left").startswith("--name: belongs to C")
    assert "expected a name in C" in refused("export", policy, "-o", tmp_path / "swing.c", "--name", "a b")
    assert "there is no folder" in refused("export", policy, "-o", tmp_path / "missing" / "swing.c")
    assert not list(tmp_path.iterdir())


# Wrong input


def bad(folder, what):
    """A recording that cannot be learnt from."""
    path = folder / f"{what}.csv"
    rows = [[f"{value:.6f}" for value in row] for row in record((0.5, 0.5))]
    if what == "hole":
        rows[7][0] = ""
    if what == "nan":
        rows[7][0] = "nan"
    if what == "word":
        rows[7][2] = "left"
    if what == "backwards":
        rows[7][0] = "-1"
    write(path, "t,x,y,vx,vy", rows)
    return path


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda at: at / "none.csv", "{at}/none.csv: no such file, expected the path of a file."),
        (lambda at: at / "none_*.csv", "{at}/none_*.csv: no such file, expected the path of a file."),
        (lambda at: at, "{at}: a folder without a file to read."),
        (
            lambda at: bad(at, "hole"),
            (
                "{at}/hole.csv, row 7 (line 9), column 'time': found nan (1 such cell in the selected columns), "
                "expected finite numbers. Remove or repair these rows first."
            ),
        ),
        (
            lambda at: bad(at, "nan"),
            (
                "{at}/nan.csv, row 7 (line 9), column 'time': found nan (1 such cell in the selected columns), "
                "expected finite numbers. Remove or repair these rows first."
            ),
        ),
        (
            lambda at: bad(at, "word"),
            "{at}/word.csv, line 9, column 'y': got 'left', expected a number as elsewhere in this column.",
        ),
        (
            lambda at: bad(at, "backwards"),
            (
                "{at}/backwards.csv, row 7 (line 9): got time -1 s after 0.3 s, expected later ones. "
                "Sort the rows (--sort), or split the file where a new recording begins."
            ),
        ),
    ],
    ids=["missing", "pattern", "folder", "hole", "nan", "word", "backwards"],
)
def test_a_recording_that_cannot_be_used_is_refused_in_one_sentence(tmp_path, make, sentence):
    said = refused("fit", make(tmp_path), "-o", tmp_path / "p.npz")
    assert said == sentence.format(at=tmp_path)
    assert not (tmp_path / "p.npz").exists()


def test_garbage_is_refused(tmp_path):
    garbage = np.random.default_rng(0).bytes(5000)
    for name in ("garbage", "garbage.csv", "garbage.npz"):
        (tmp_path / name).write_bytes(garbage)
        for command in (("fit", "-o", tmp_path / "p.npz"), ("inspect",)):
            assert refused(*command, tmp_path / name).startswith(f"{tmp_path / name}: ")


def test_an_empty_file_and_one_without_rows_are_refused(tmp_path):
    (tmp_path / "empty.csv").touch()
    (tmp_path / "head.csv").write_text("t,x,y\n")
    assert refused("inspect", tmp_path / "empty.csv").endswith(
        "the file is empty, expected a header and rows of numbers."
    )
    assert "a header but no rows" in refused("inspect", tmp_path / "head.csv")


@pytest.mark.parametrize(
    "option", [("--state", "x,z"), ("--state", "x,y", "--action", "z"), ("--state", "z", "--by", "savgol")]
)
def test_an_unknown_column_is_answered_with_those_there_are(files, tmp_path, option):
    said = refused("fit", *files, *option, "-o", tmp_path / "p.npz")
    cure = " Name those of this file with --state and --action, or all of its columns with --columns."
    assert said == f"{files[0]} has no column 'z'; it has x, y, vx, vy.{cure * (option[1] == 'z')}"


@pytest.mark.parametrize("option", ["--group", "--time"])
def test_an_unknown_group_or_time_is_answered_with_the_columns_there_are(files, tmp_path, option):
    said = refused("fit", files[0], option, "z", "-o", tmp_path / "p.npz")
    assert said.startswith(f"{files[0]}: no column 'z' for {option[2:]}; it has t, x, y, vx, vy.")
    assert said.endswith("or --group none where each file is one.") == (option == "--group")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--rate", "-3"), "--rate: got -3.0, expected a number above 0."),
        (("--rate", "nan"), "--rate: got nan, expected a number above 0."),
        (("--rate", "fast"), "Invalid value for '--rate': 'fast' is not a valid float."),
        (("--window", "0"), "--window: got 0.0, expected a number above 0."),
        (("--variance", "0"), "--variance: got 0.0, expected a number above "),
        (("--folds", "1"), "Invalid value for '--folds': 1 is not in the range x>=2."),
        (("--alpha", "-1"), "--alpha: got -1.0, expected a number of at least 0.0."),
        (("--softness", "inf"), "--softness: got inf, expected a number of at least 0.0."),
        (
            ("--model", "deep"),
            "Invalid value for '--model': 'deep' is not one of 'local', 'rbf', 'auto', 'affine', 'quadratic', ",
        ),
        (
            ("--learner", "direct", "--alpha", "1"),
            "--alpha: belongs to the hybrid learner, got --learner direct.",
        ),
        (
            ("--learner", "inconsistency", "--softness", "1"),
            "--softness: belongs to the hybrid learner, got --learner inconsistency.",
        ),
        (
            ("--alpha", "0.1", "--softness", "0.1"),
            "--alpha: got --softness too, expected one of them; a softened split has no threshold to choose.",
        ),
        (("--centres", "9"), "--centres: belongs to --model rbf, got --model local."),
        (("--model", "rbf", "--variance", "1"), "--variance: belongs to --model local, got --model rbf."),
        (
            ("--action", "vx,vy", "--differentiate"),
            "--action: got columns, and --differentiate or --by too; give one or the other.",
        ),
    ],
)
def test_a_wrong_setting_is_refused_in_one_sentence(files, tmp_path, options, sentence):
    assert refused("fit", *files, *options, "-o", tmp_path / "p.npz").startswith(sentence)
    assert not list(tmp_path.iterdir())


def test_a_recording_is_never_overwritten_by_its_policy(files, tmp_path):
    path = tmp_path / "swing.csv"
    path.write_bytes(files[0].read_bytes())
    for options in (("-o", path), ("-o", tmp_path / "p.npz", "--report", path)):
        said = refused("fit", path, *options)
        assert said == f"{path}: is one of the files to read; give another name to write to."
    assert path.read_bytes() == files[0].read_bytes()


def test_a_place_that_cannot_be_written_to_is_named(files, policy, tmp_path):
    away = tmp_path / "none" / "x"
    for command in (("fit", files[0]), ("rollout", policy, "--start", "0,0")):
        assert refused(*command, "-o", away) == f"{away}: cannot be written (there is no folder {away.parent})."
    assert "is a directory" in refused("rollout", policy, "--start", "0,0", "-o", tmp_path)
    assert "is a directory" in refused("fit", files[0], "-o", tmp_path)


@pytest.mark.parametrize("command", [("score", "{policy}", "{file}"), ("rollout", "{policy}", "--start", "0,0")])
def test_a_policy_file_that_is_not_ours_is_refused(files, tmp_path, command):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "run"),)

    (tmp_path / "pickle.npz").write_bytes(pickle.dumps(Trap()))
    np.savez(tmp_path / "other.npz", states=np.array([["no", "numbers"]]))
    uc.save(uc.LocallyLinearPolicy(), tmp_path / "new.npz")
    for name, sentence in (
        ("none.npz", "no such file, expected a policy file."),
        ("", "a folder, expected a policy file."),
        ("pickle.npz", "is no policy file, or a damaged one. Expected a file that 'unconstrain fit' or save() wrote."),
        ("other.npz", "was not written by unconstrain. Expected a file that 'unconstrain fit' or save() wrote."),
        ("new.npz", "holds a policy that is not fitted. Fit it before saving."),
    ):
        path = tmp_path / name
        said = refused(*(word.format(policy=path, file=files[0]) for word in command))
        assert said == f"{path}: {sentence}"
    assert refused(*(word.format(policy=files[0], file=files[0]) for word in command)).startswith(
        f"{files[0]}: is a recording, not a policy. "
    )
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--start", "1"), "--start: got 1 numbers, expected 2, one for each state."),
        (("--start", "1,2,3"), "--start: got 3 numbers, expected 2, one for each state."),
        (
            ("--start", "1,two"),
            "Invalid value for '--start': got '1,two', expected finite numbers separated by commas, such as 0.1,0,-2.",
        ),
        (
            ("--start", "1,nan"),
            "Invalid value for '--start': got '1,nan', expected finite numbers separated by commas, such as 0.1,0,-2.",
        ),
        (("--start", "0,0", "--plane", "1,0,0"), "--plane: got 3 numbers, expected 2, one for each action."),
        (("--start", "0,0", "--dt", "0"), "--dt: got 0.0, expected a number above 0.0."),
        (("--start", "0,0", "--steps", "0"), "Invalid value for '--steps': 0 is not in the range x>=1."),
        ((), "Missing option '--start'."),
    ],
)
def test_a_rollout_that_makes_no_sense_is_refused(policy, tmp_path, options, sentence):
    assert refused("rollout", policy, *options, "-o", tmp_path / "path.csv") == sentence
    assert not list(tmp_path.iterdir())


def test_a_plane_without_a_direction_is_refused(policy, files):
    for command in (("rollout", policy, "--start", "0,0"), ("score", policy, files[0])):
        assert refused(*command, "--plane", "0,0").startswith("--plane: got [")


def test_a_plane_of_other_dimension_than_the_actions_is_refused(policy, files):
    said = refused("score", policy, files[0], "--plane", "1,0,0")
    assert said == "--plane: got 3 numbers, expected 2, one for each action."


def test_a_rollout_that_runs_away_is_refused(policy, tmp_path):
    refused("rollout", policy, "--start", "1e90,0", "--dt", 1e90, "-o", tmp_path / "path.csv")
    assert not list(tmp_path.iterdir())


def test_a_recording_of_other_columns_is_refused_by_score(policy, tmp_path):
    write(tmp_path / "other.csv", "t,a,b", [[0, 1, 2], [1, 2, 3]])
    said = refused("score", policy, tmp_path / "other.csv")
    assert said == f"{tmp_path}/other.csv has no column 'x', 'y', 'vx', 'vy'; it has a, b."


def test_columns_that_are_called_otherwise_are_told_with_what_helps(policy, tmp_path):
    swing, cure = np.random.default_rng(0).standard_normal((40, 4)), "Name those of this file with --state and --action"
    np.savez(tmp_path / "swing.npz", positions=swing[:, :2], velocities=swing[:, 2:], times=DT * np.arange(40))
    asked = ("score", policy, tmp_path / "swing.npz")
    assert f"; it has positions1, positions2, velocities1, velocities2. {cure}, or all of its" in refused(*asked)
    assert "swing" in run(*asked, "--state", "positions1,positions2", "--action", "velocities1,velocities2")
    assert "swing" in run(*asked, "--columns", "x,y,vx,vy,t")
    assert cure not in refused(*asked, "--state", "positions1,x", "--action", "velocities1,velocities2")


def test_actions_that_are_no_velocities_cannot_be_rolled_out(tmp_path):
    rows = record((0.5, 0.5))
    write(tmp_path / "one.csv", "t,x,y,u", rows[:, :4])
    run("fit", tmp_path / "one.csv", "--state", "x,y", "--action", "u", "--model", "linear", "-o", tmp_path / "p.npz")
    said = refused("rollout", tmp_path / "p.npz", "--start", "0.5,0.5")
    assert said.endswith("a rollout expects actions that are velocities of the state.")


# In a terminal


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (OSError(28, "No space left on device", "/full"), "/full: No space left on device."),
        (OSError("the disk is gone"), "the disk is gone"),
    ],
)
def test_trouble_with_the_file_system_is_told_in_one_sentence(policy, tmp_path, monkeypatch, error, sentence):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(rolling, "write", fail)
    assert refused("rollout", policy, "--start", "0,0", "-o", tmp_path / "path.csv") == sentence


def test_no_traceback_in_a_process_of_its_own(folder):
    ran = shell("unconstrain fit none.csv -o p.npz", folder)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "Error: none.csv: no such file, expected the path of a file.\n"


def test_a_closed_pipe_is_no_error_to_see(folder):
    for command, head in (
        ("rollout swing.npz --start 0.5,0 --steps 3000 2>verdict.txt", "t,x,y,vx,vy\n"),
        ("inspect swing_*.csv --json", "{\n"),
    ):
        ran = shell(f"unconstrain {command} | head -1", folder)
        assert (ran.code, ran.out, ran.err) == (0, head, "")


def test_tables_do_not_wrap_in_a_terminal_of_80_columns(folder):
    if not (Path("/usr/bin/script").exists() and sys.platform == "linux"):
        pytest.skip("no script(1) of util-linux to be a terminal")
    line = f"'{sys.executable}' -m unconstrain inspect swing_*.csv"
    done = subprocess.run(
        ["script", "-qec", f"stty cols 80; {line}", "/dev/null"],
        capture_output=True,
        text=True,
        cwd=folder,
        env=environment(TERM="xterm"),
        check=True,
    )
    rows = [row for row in done.stdout.splitlines() if row.startswith("swing_")]
    assert [len(row.split()) for row in rows] == [10] * 8


# reproduce and demo


@pytest.fixture(scope="module")
def table1_of_two(tmp_path_factory):
    """The JSON of two trials of table 1, and what was printed."""
    out = tmp_path_factory.mktemp("table1")
    said = run("reproduce", "table1", "--trials", 2, "--workers", 1, "--out", out)
    return (out / "table1.json").read_text(), said, out


def test_reproduce_writes_numbers_and_a_page(table1_of_two):
    text, said, out = table1_of_two
    assert sorted(path.name for path in out.iterdir()) == ["table1.html", "table1.json"]
    assert said.endswith(f"numbers: {out / 'table1.json'}\nreport:  {out / 'table1.html'}\n")
    found = json.loads(text)
    assert found["settings"]["trials"] == 2
    assert found["settings"]["seed"] == 0
    assert len(found["rows"]) == 8
    assert "<html" in (out / "table1.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("kept", [".json", ".html"])
@pytest.mark.parametrize(
    ("command", "name"), [(("reproduce", "table1", "--trials", 1), "table1"), (("demo",), "washing")]
)
def test_results_that_are_there_are_replaced_only_with_force(tmp_path, monkeypatch, command, name, kept):
    began = []
    for one in ("reproduce", "demo"):
        monkeypatch.setattr(commands, one, lambda *_, **__: began.append(1))
    taken = tmp_path / f"{name}{kept}"
    call(*command, "--out", tmp_path)
    taken.write_text("mine")
    said = refused(*command, "--out", tmp_path)
    assert said == f"{taken}: is there; give another name, or --force to replace it."
    assert len(began) == 1
    assert call(*command, "--out", tmp_path, "--force").code == 0
    assert len(began) == 2


def test_reproduce_prints_a_table_for_80_columns(table1_of_two):
    _, said, _ = table1_of_two
    assert said.startswith(("! Reproduced: in part", "✔ Reproduced: yes"))
    lines = below(said).splitlines()
    assert lines[0].split() == ["method", "constr.", "nUPE", "nCPE", "norm.", "incon."]
    assert [line.split()[:2] for line in lines[1:9]] == [
        [method, data] for method in ("direct", "inconsistency", "hybrid", "truncated") for data in ("none", "random")
    ]
    assert max(map(len, lines[:9])) <= 80


def test_the_printed_means_are_those_in_the_file(table1_of_two):
    text, said, _ = table1_of_two
    for line, row in zip(below(said).splitlines()[1:9], json.loads(text)["rows"], strict=True):
        assert float(line.split()[2]) == pytest.approx(row["nupe_mean"], rel=0.05)
        assert line.split()[3] == "±"


@pytest.mark.slow
def test_numbers_do_not_depend_on_workers(table1_of_two, tmp_path):
    run("reproduce", "table1", "--trials", 2, "--workers", 2, "--out", tmp_path)
    assert (tmp_path / "table1.json").read_text() == table1_of_two[0]


def test_another_seed_gives_other_numbers(table1_of_two, tmp_path):
    run("reproduce", "table1", "--trials", 2, "--workers", 1, "--seed", 1, "--out", tmp_path)
    found, other = json.loads((tmp_path / "table1.json").read_text()), json.loads(table1_of_two[0])
    assert found["settings"] == other["settings"] | {"seed": 1}
    assert all(a["nupe_mean"] != b["nupe_mean"] for a, b in zip(found["rows"], other["rows"], strict=True))


def test_without_matplotlib_the_trials_are_kept_for_later(tmp_path, monkeypatch):
    def missing(*_):
        raise MissingExtraError("this needs 'matplotlib', which is not installed.")

    monkeypatch.setattr(report, "write", missing)
    ran = call("reproduce", "table1", "--trials", 1, "--workers", 1, "--out", tmp_path)
    assert ran.code == 0
    assert "hybrid, none: nUPE " in ran.out
    assert ran.err == "No report: this needs 'matplotlib', which is not installed.\n"
    assert [path.name for path in tmp_path.iterdir()] == [".table1.trials"]


def test_an_interrupted_run_goes_on_where_it_stopped(table1_of_two, tmp_path, monkeypatch):
    calls = []

    def interrupted(*args):
        if len(calls) == 3:
            raise KeyboardInterrupt
        calls.append(args)
        return whole(*args)

    whole = table1.trial
    arguments = ("reproduce", "table1", "--trials", 2, "--workers", 1, "--out", tmp_path)
    monkeypatch.setattr(table1, "trial", interrupted)
    ended = call(*arguments)
    kept = tmp_path / ".table1.trials"
    assert (ended.code, ended.out) == (130, "")
    said = f"Error: interrupted. What was finished is kept in {kept}; the same command goes on from there.\n"
    *progress, last = ended.err.splitlines(keepends=True)
    assert last == said
    assert all(re.fullmatch(r"table1: \d of 4 \.\.\. \(\d+ s\)\n", line) for line in progress)  # where it took long
    assert kept.exists()
    assert not (tmp_path / "table1.json").exists()
    monkeypatch.setattr(table1, "trial", lambda *args: calls.append(args) or whole(*args))
    run(*arguments)
    assert len(calls) == 4  # two data sets free and two constrained, none of them twice
    assert (tmp_path / "table1.json").read_text() == table1_of_two[0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["table1.html", "table1.json"]


@pytest.mark.parametrize("name", ["figure4"])
def test_an_experiment_of_a_single_data_set_takes_no_trials(name, tmp_path):
    assert refused("reproduce", name, "--trials", 3, "--out", tmp_path) == f"--trials: {name} is a single data set."
    assert not list(tmp_path.iterdir())


def test_figure4_writes_its_rows(tmp_path):
    run("reproduce", "figure4", "--workers", 1, "--out", tmp_path)
    assert len(json.loads((tmp_path / "figure4.json").read_text())["rows"]) == 6


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("table9",), "Invalid value for "),
        (("table1", "--workers", "0"), "--workers: got 0, expected a number of processes, or -1 for one on each core."),
        (("table1", "--trials", "0"), "Invalid value for '--trials': 0 is not in the range x>=1."),
        (("table1", "--seed", "-1"), "Invalid value for '--seed': -1 is not in the range x>=0."),
    ],
)
def test_an_experiment_that_cannot_be_run_is_refused(tmp_path, options, sentence):
    said = refused("reproduce", *options, "--out", tmp_path)
    assert said.startswith(sentence)
    if options == ("table9",):
        assert all(repr(name) in said for name in experiments.NAMES)
    assert not list(tmp_path.iterdir())


def test_results_cannot_go_into_a_file(tmp_path):
    (tmp_path / "taken").touch()
    for command in (("reproduce", "table1", "--trials", 1), ("demo",)):
        said = refused(*command, "--out", tmp_path / "taken")
        assert said == f"Invalid value for '--out': Directory '{tmp_path / 'taken'}' is a file."


def demonstrated_with(result, *options):
    """What the demo says of an experiment that ran with its settings, and with a short film."""

    def known(settings, workers, progress):
        assert (replace(settings, steps=result.settings.steps), workers) == (result.settings, 1)
        progress(1, 1)
        return result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(washing, "run", known)
        patch.setattr(washing_arm, "film", lambda wipe, _, film=washing_arm.film: film(wipe, 0.5))
        return run("demo", *options)


@pytest.fixture(scope="module")
def demonstrated(tmp_path_factory, washed):
    """What the demo says and writes."""
    out = tmp_path_factory.mktemp("demo")
    return demonstrated_with(washed(), "--out", out), out


@pytest.mark.slow
def test_demo_washes_a_car_and_says_how_well(demonstrated):
    said, out = demonstrated
    assert re.match(r"✔ On surfaces that nobody showed it, the default learner misses 0\.\d\d% of the", said)
    lines = below(said).splitlines()
    assert lines[0].split() == ["method", "surface", "seen", "nCPE", "nUPE"]
    assert "Seven plates were wiped, five to learn from, two to be tested on." in lines
    assert any(line.startswith("nCPE on unseen surfaces, mean: direct ") for line in lines)
    assert lines[-1] == f"report:  {out / 'washing.html'}"
    assert max(map(len, lines[:23])) <= 80
    assert sum(line.startswith("the arm on ") and "contact 100.0%" in line for line in lines) == 3


@pytest.mark.slow
def test_demo_writes_a_row_for_each_method_and_surface(demonstrated):
    found = json.loads((demonstrated[1] / "washing.json").read_text())
    assert {(row["method"], row["surface"]) for row in found["rows"]} == {
        (method, surface)
        for method in ("direct", "inconsistency", "hybrid", "robust")
        for surface in (
            [
                "flat",
                *(f"{sign}{angle}° about x" for sign in "+-" for angle in (16, 27)),
                "+16° about y",
                "-16° about y",
            ]
        )
    }
    assert {row["surface"] for row in found["rows"] if not row["seen"]} == {"+16° about y", "-16° about y"}
    assert all(row["ncpe"] <= row["nupe"] for row in found["rows"])


@needs_rim
@pytest.mark.slow
def test_demo_learns_from_real_recordings(washed_rim, tmp_path):
    said = demonstrated_with(washed_rim, "--real", "--out", tmp_path)
    assert "nCPE on unseen surfaces with the plane normals, mean: direct " in said
    rows = json.loads((tmp_path / "washing.json").read_text())["rows"]
    assert {(row["surface"], row["normal"]) for row in rows} == {
        (tilt, normal) for tilt in ("flat", "tilt40", "tilt66", "tilt67") for normal in ("plane", "tool")
    }
    assert all(row["nupe"] is None and row["seen"] is False for row in rows)
    assert "the arm on -12° about x, +24° about y (unseen): contact 100.0%" in said


def test_demo_says_where_it_looked_for_recordings(tmp_path, monkeypatch):
    for name in ("UNCONSTRAIN_DATA", "HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    said = refused("demo", "--real", "--out", tmp_path / "out")
    assert said.startswith(f"demos_rim_processed_data.mat is not on this machine (looked in {tmp_path}/demos_rim")
    assert "set UNCONSTRAIN_DATA to a folder" in said
    assert said.endswith("On the command line, --download allows it.")
    assert not list(tmp_path.iterdir())


def test_inspect_says_how_a_file_was_read(tmp_path):
    (tmp_path / "a.csv").write_text("".join(f"{k} {k % 7} {k}\n" for k in range(9)))
    said = run("inspect", tmp_path / "a.csv")
    assert "'a': it has no header, so its columns are called column1, column2, column3; name them" in said
    [found] = json.loads(run("inspect", tmp_path / "a.csv", "--json"))["demonstrations"]
    assert [note["code"] for note in found["notes"]] == ["no-header"]
    assert "column" not in run("inspect", tmp_path / "a.csv", "--columns", "t,x,y").partition("columns:")[2]


def test_doctor_finds_everything_that_the_tests_need():
    found = {one["what"]: one for one in json.loads(run("doctor", "--json"))["found"]}
    extras = ("viz", "data", "formats", "arm", "sim", "onnx", "rerun", "live", "cluster", "arrays")
    assert list(found) == ["Python", *extras, "graphics"]
    assert found["graphics"]["found"] in ("egl", "osmesa", "the system's own")
    assert all(one["fix"] == "" for one in found.values())
    assert run("doctor").startswith("✔ Everything is there.\n")


def test_doctor_tells_how_to_fix_what_is_missing(monkeypatch):
    from unconstrain.paper import simulation

    doctor = import_module("unconstrain.cli.doctor")  # beside the command of this name

    versions = {"jinja2": None}
    monkeypatch.setattr(doctor, "_version", lambda package: versions.get(package, "1.0"))
    monkeypatch.setattr(simulation, "backend", lambda: None)
    fixes = {one.what: one.fix for one in doctor.examine()}
    assert fixes["viz"] == "pip install 'unconstrain[viz]'"
    assert fixes["graphics"] == "apt-get install libegl1 libegl-mesa0"
    said = run("doctor").splitlines()
    assert said[0] == "! 2 of 12 are missing something."
    assert [line.strip() for line in said[2:4]] == list(filter(None, fixes.values()))  # each on a line, to be pasted
    assert max(map(len, said)) <= 100
    versions["mujoco"] = None
    assert {one.what: one.found for one in doctor.examine()}["graphics"] == "needs sim"
    versions.pop("mujoco")
    monkeypatch.setattr(simulation, "backend", lambda: "")
    assert {one.what: one.found for one in doctor.examine()}["graphics"] == "the system's own"


def test_demo_refuses_a_plate_that_the_arm_does_not_reach(tmp_path):
    said = refused("demo", "--plate", "0,80", "--out", tmp_path / "out")
    assert said.startswith("plate +80° about y: out of the arm's reach. At (")
    assert refused("demo", "--plate", "10", "--out", tmp_path) == (
        "--plate: got 1 numbers, expected two, the tilts about x and y in degrees."
    )


def test_fit_and_diagnose_name_the_sample_that_looks_wrong(tmp_path):
    rng = np.random.default_rng(4)
    for index in range(4):
        time, start = 0.05 * np.arange(40), rng.uniform(0, 2 * np.pi)
        states = np.column_stack([np.cos(start + time), np.sin(start + time)])
        actions = np.column_stack([-states[:, 1], states[:, 0]]) + 0.01 * rng.standard_normal(states.shape)
        actions[11] += 4.0 * (index == 2)
        table = np.column_stack([time, states, actions])
        np.savetxt(tmp_path / f"cup_{index}.csv", table, delimiter=",", header="time,x,y,vx,vy", comments="")
    files = [str(path) for path in sorted(tmp_path.glob("*.csv"))]
    columns = ["--state", "x,y", "--action", "vx,vy", "--model", "linear"]
    said = f"1 sample looks wrong beside the neighbours in time, and counted nothing: {files[2]} row 11 (0.55 s)."
    fitted = CliRunner().invoke(cli.main, ["fit", *files, *columns, "-o", str(tmp_path / "policy.npz")])
    assert f"Note: {said}" in fitted.stderr
    assert said in CliRunner().invoke(cli.main, ["diagnose", *files, *columns]).stdout
    found = json.loads(CliRunner().invoke(cli.main, ["diagnose", *files, *columns, "--json"]).stdout)
    [suspect] = found["suspects"]
    assert suspect == {"demonstration": "cup_2", "sample": 12, "time": pytest.approx(0.55), "file": files[2], "row": 11}


def test_a_topic_of_a_file_without_any_is_refused(files):
    assert refused("inspect", files[0], "--topic", "/joint_states").startswith(f"--topic: {files[0]} has none")

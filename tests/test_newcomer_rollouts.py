"""What a newcomer is told about how a policy moves: size and pace beside what was demonstrated, planes, support."""

import json

import numpy as np
import pytest

import unconstrain as uc
from test_cli import run, write
from unconstrain.cli.replaying import replayed
from unconstrain.evaluation.verdicts import Mark, Verdict, of_replays

MM = dict.fromkeys("xyz", "mm")
HEAD = "t [s],x [mm],y [mm],z [mm]"


class Ovals:
    """The policy that was meant, or one whose ovals are of another size or pace."""

    n_features_in_ = 3

    def __init__(self, size=1.0, pace=1.0):
        self.size, self.pace = size, pace

    def __call__(self, states):
        x, y, z = np.asarray(states).T / self.size
        room = 1.2 * (1 - (x / 80) ** 2 - (y / 40) ** 2)
        return self.size * self.pace * np.column_stack([room * x - 3.6 * y, room * y + 0.9 * x, -1.5 * z])


def oval(number, seconds=8.0, **how):
    """Times and positions with 1 mm of noise, 100 Hz: round an oval of 80 by 40 mm on a plate of its own tilt."""
    rng = np.random.default_rng(number)
    plane = uc.constraints.Plane(rng.standard_normal(3) * [0.1, 0.1, 0.0] + [0.0, 0.0, 1.0])
    plate, turn = np.eye(3) - np.outer(plane.normal, plane.normal), rng.uniform(0, 2 * np.pi)
    start = rng.uniform(0.7, 1.2) * plate @ [80 * np.cos(turn), 40 * np.sin(turn), 0.0]
    done = uc.rollout(Ovals(**how), start, round(100 * seconds), 0.01, plane, method="rk4")
    return np.column_stack([done.times, done.states + rng.standard_normal(done.states.shape)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Ovals to be scored on, and policies learnt from others, as large and fast as these or not."""
    place = tmp_path_factory.mktemp("ovals")
    for k in range(3, 6):
        write(place / f"held_{k}.csv", HEAD, oval(k))
    for name, how in {"same": {}, "slow": {"pace": 0.7}}.items():
        files = [write(place / f"{name}_{k}.csv", HEAD, oval(k, **how)) for k in range(10, 14)]
        run("fit", *files, "--state", "x,y,z", "--differentiate", "--learner", "hybrid", "-o", place / f"{name}.npz")
    return place


def score(folder, name):
    held = sorted(folder.glob("held_*.csv"))
    return json.loads(run("score", folder / f"{name}.npz", *held, "--json"))


def judged(folder, **how):
    recipe = uc.Recipe(states=("x", "y", "z"), differentiate="savgol")
    demos = uc.prepare(uc.read(str(folder / "held_*.csv")), recipe)
    return replayed(Verdict(Mark.GOOD, "Explains 98% of it: good."), Ovals(**how), demos, recipe, None, MM)


NEARLY = [{}, {"size": 1.1}, {"pace": 0.9}]
OTHERWISE = [{"size": 1.4}, {"size": 0.7}, {"pace": 1.4}, {"pace": 0.7}]


@pytest.mark.parametrize(
    ("how", "near", "mark", "words"),
    [(how, {"abs": 0.05}, Mark.GOOD, " mm away on average") for how in NEARLY]
    + [(how, {"rel": 0.1}, Mark.DOUBTFUL, "of half of them is off by") for how in OTHERWISE],
)
def test_ovals_of_another_size_or_pace_are_no_good_however_much_they_explain(folder, how, near, mark, words):
    verdict, found = judged(folder, **how)
    assert found["extent"] == pytest.approx(how.get("size", 1.0), **near)
    assert found["pace"] == pytest.approx(how.get("pace", 1.0), **near)
    assert verdict.mark is mark
    assert words in verdict.said


def test_a_policy_that_leaves_the_finite_numbers_does_not_pass_in_silence(folder):
    verdict, found = judged(folder, pace=-500.0)
    assert found is None
    assert verdict.mark is Mark.DOUBTFUL
    assert "But run from the same starts it leaves the finite numbers." in verdict.said


def test_a_score_says_that_what_was_learnt_is_too_slow(folder):
    found = score(folder, "slow")
    assert found["replayed"]["pace"] == pytest.approx(0.7, rel=0.15)
    assert found["verdict"]["mark"] != "good"


def test_a_roll_out_on_a_plane_says_that_the_plane_passes_through_the_start(folder, tmp_path):
    how = ("--start", "60,10,0", "--steps", 20, "-o", tmp_path / "path.csv", "--force")
    assert "passes through the start" in " ".join(run("rollout", folder / "same.npz", *how, "--plane", "0,0,1").split())
    assert "passes through the start" not in " ".join(run("rollout", folder / "same.npz", *how).split())


def test_a_policy_without_support_is_judged_in_words(folder, tmp_path):
    learnt = ("--state", "x,y,z", "--differentiate", "--model", "affine", "--learner", "direct")
    run("fit", *sorted(folder.glob("same_*.csv")), *learnt, "-o", tmp_path / "affine.npz")
    said = run("rollout", tmp_path / "affine.npz", "--start", "60,10,0", "-o", tmp_path / "path.csv")
    assert "cannot be told" in " ".join(said.split())


def test_an_export_says_what_support_is_called(folder, tmp_path):
    assert "wipe_support()" in " ".join(run("export", folder / "same.npz", "-o", tmp_path / "wipe.c").split())


def test_strokes_that_are_too_large_are_not_outweighed_by_others_that_are_too_small():
    found = of_replays(Verdict(Mark.GOOD, "Good."), np.array([0.6, 0.7, 1.0, 1.5, 1.7]), np.full(5, np.nan), "3 mm")
    assert found.mark is Mark.DOUBTFUL
    assert "size 1.00 times" in found.said
    assert "size of half of them is off by 50% or more" in found.said

"""What somebody meets who has only the README and files of their own: each message leads on."""

import html
import json
import re
import shlex
import shutil
import warnings

import click
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

import unconstrain as uc
from test_cli import call, refused, run, write
from test_formats import workbook
from unconstrain.base.display import listening
from unconstrain.cli import informing, looking, progress
from unconstrain.pages import fit as fit_page

HEAD = "Zeit [s],X [mm],Y [mm]"
LINEAR = ("--model", "linear", "--learner", "direct")


def stroke(number, samples=40, jitter=0.0):
    """Times and positions on a line of its own, mm, towards the middle and round it."""
    rng = np.random.default_rng(number)
    along, at = rng.standard_normal(2), rng.uniform(-100, 100, 2)
    along /= np.linalg.norm(along)
    times = 0.05 * (np.arange(samples) + jitter * rng.uniform(-1, 1, samples))
    rows = []
    for step in np.diff(times, append=times[-1]):
        rows.append(at.copy())
        at += step * along * (along @ np.array([-at[0] - 2 * at[1], 2 * at[0] - at[1]]))
    return np.column_stack([times, rows])


def strokes(name, count=4):
    """Rows of several strokes on one clock that goes on, each with its name before it."""
    return [[name(k), row[0] + 10 * k, *row[1:]] for k in range(count) for row in stroke(k)]


def text(ran):
    """What was printed, without the ends of lines."""
    return " ".join((ran.out + ran.err).split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six strokes in a folder, and in a folder in it two to be tested on; a policy learnt from the six."""
    place = tmp_path_factory.mktemp("newcomer") / "wischen"
    (place / "unseen").mkdir(parents=True)
    for k in range(8):
        write(place / ("unseen" if k > 5 else "") / f"w{k}.csv", HEAD, stroke(k))
    run("fit", place, "-o", place.parent / "p.npz")
    return place


@pytest.fixture(scope="module")
def policy(folder):
    return folder.parent / "p.npz"


# One file with many strokes


def words(k):
    return f"Strich {k}"


@pytest.fixture(params=["words", "numbers", "Excel", "archive"])
def one_file(request, tmp_path):
    """Four strokes in one file, told apart by the column ``Strich`` alone."""
    rows = strokes(words if request.param in ("words", "Excel") else int)
    if request.param == "Excel":
        return workbook(tmp_path / "alle.xlsx", Messung=[["Strich", *HEAD.split(",")], *rows])
    if request.param == "archive":
        columns = dict(zip(("Strich", "t", "x", "y"), np.array(rows).T, strict=True))
        np.savez(tmp_path / "alle.npz", **columns)
        return tmp_path / "alle.npz"
    return write(tmp_path / "alle.csv", f"Strich,{HEAD}", rows)


@pytest.mark.parametrize("command", ["diagnose", "fit", "constraint", "look"])
def test_every_command_that_reads_names_the_column_that_tells_strokes_apart(tmp_path, command):
    one_file = write(tmp_path / "alle.csv", f"Strich,{HEAD}", strokes(words))
    states = ("--state", "X,Y", "--differentiate")
    output = {"fit": (*LINEAR, "-o", "p.npz"), "constraint": ("-o", "c.npz"), "look": ("-o", "look.html")}
    given = [tmp_path / one if str(one).partition(".")[2] else one for one in output.get(command, ())]
    said = text(call(command, one_file, *states, *given))
    assert "column 'Strich': has 4 values" in said
    assert "give --group Strich" in said


def test_so_does_every_kind_of_file_and_with_that_column_they_are_the_strokes(one_file):
    states = "x,y" if one_file.suffix == ".npz" else "X,Y"
    shown = run("inspect", one_file, "--state", states, "--differentiate")
    assert "column 'Strich': has 4 values, a stroke each by its jumps: give --group Strich." in shown
    assert shown.startswith("! 1 of 1 demonstration not as it should be: several in one")
    found = json.loads(run("inspect", one_file, "--group", "Strich", "--json"))["demonstrations"]
    assert [one["samples"] for one in found] == [40] * 4
    assert not any(one["code"] == "several-in-one" for each in found for one in each["warnings"])


def test_what_comes_next_is_typed_as_this_was(tmp_path):
    file = write(tmp_path / "alle.csv", f"Strich,{HEAD}", strokes(words, 6))
    few = text(call("inspect", file))
    assert "not as it should be: several in one. Next:" in few
    assert "clock-gap" not in few  # it has the same cause
    assert re.search(r"by the column 'Strich': unconstrain inspect \S+alle\.csv --group Strich ", few)
    shown = text(call("inspect", file, "--group", "Strich", "--state", "X,Y", "--by", "savgol", "--sort"))
    then = "--state X,Y --by savgol --sort --group Strich -o policy.npz"
    assert re.search(rf"Next: unconstrain fit .*alle\.csv {then}", shown)


@pytest.mark.parametrize("how", ["--differentiate", "--by kalman"])
def test_what_comes_next_differentiates_as_it_was_typed(folder, tmp_path, how):
    files = [folder / f"w{k}.csv" for k in range(3)]
    run("fit", *files, "--state", "X,Y", *how.split(), "--model", "affine", "-o", tmp_path / "p.npz")
    for said in (text(call("info", tmp_path / "p.npz")), text(call("score", tmp_path / "p.npz", folder / "unseen"))):
        assert f" RECORDINGS.csv --state 'X [mm],Y [mm]' {how} " in f"{said} "
        assert "--by savgol" not in said


def test_many_files_are_a_pattern_that_stands_for_just_these(folder):
    each = sorted(folder.glob("*.csv"))
    for files, typed in ((each, shlex.quote(f"{folder}/*.csv")), (each[:4], shlex.join(map(str, each[:4])))):
        assert f" unconstrain fit {typed} -o policy.npz\n" in run("inspect", *files)


def test_a_file_of_a_constraint_says_which_mechanism_was_named(tmp_path):
    rng = np.random.default_rng(0)
    times = np.arange(0, 2, 0.02)
    angles = 0.2 + 0.6 * (1 - np.cos(np.pi * times / 2))
    arc = 0.8 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]) + rng.normal(0, 3e-4, (len(times), 3))
    door = write(tmp_path / "door.csv", "t [s],x [m],y [m],z [m]", np.column_stack([times, arc]))
    told = json.loads(run("constraint", door, "-o", tmp_path / "c.npz", "--json"))
    assert "a circle (hinge)" in told["mechanism"]
    assert json.loads(run("info", tmp_path / "c.npz", "--json"))["mechanism"] == told["mechanism"]
    assert "The file holds to the mechanism, a circle (hinge)" in " ".join(
        run("constraint", door, "-o", tmp_path / "c.npz", "--force").split()
    )


def test_a_score_under_a_constraint_says_what_else_counts(folder, policy):
    assert "Noise, and motion faster or slower" in text(call("score", policy, folder / "unseen", "--plane", "1,1"))
    assert "Noise, and motion faster or slower" not in text(call("score", policy, folder / "unseen"))


def test_diagnose_says_why_fit_may_be_content_and_what_its_columns_are(folder):
    said = text(call("diagnose", folder / "w0.csv", folder / "w1.csv", folder / "w2.csv", "--model", "affine"))
    assert said.startswith(("!", "✖"))
    assert "'fit' and 'score' may still explain much" in said
    assert "may be off by: of a typical action" in said


def test_what_sums_cannot_tell_is_said_without_words_of_this_house(folder):
    recordings = uc.read(folder / "w[0-5].csv")
    policy = uc.LocallyLinearPolicy(None, learner="hybrid").fit_demonstrations(uc.prepare(recordings))
    with pytest.raises(uc.errors.UnconstrainError, match=r"^noise: .* learnt from sums,") as found:
        policy.solution_.noise  # noqa: B018
    assert "belief" not in str(found.value)


def test_a_column_of_words_is_listed_and_is_no_state(tmp_path):
    file = write(tmp_path / "a.csv", f"Person,{HEAD}", [["Anna", *row] for row in stroke(0)])
    assert "--group can take demonstrations apart by: Person" in run("inspect", file)
    said = refused("fit", file, "--state", "Person", "-o", tmp_path / "p.npz")
    assert "it has X [mm], Y [mm], and of words, for --group, Person." in said
    assert said.endswith("Did you mean 'Person'?") is False
    assert "Did you mean 'Person'?" in refused("inspect", file, "--group", "Persn")


@pytest.mark.parametrize("name", [lambda row: f"phase {row // 10}", lambda row: row // 10, lambda row: row % 2])
def test_phases_of_one_movement_are_not_taken_for_strokes(tmp_path, name):
    file = write(tmp_path / "a.csv", f"Phase,{HEAD}", [[name(k), *row] for k, row in enumerate(stroke(0))])
    assert "several-in-one" not in run("inspect", file, "--state", "X,Y", "--differentiate")


def test_fit_counts_the_values_that_a_column_has_in_the_whole_table(tmp_path):
    file = write(tmp_path / "a.csv", f"Strich,{HEAD},vX,vY", [[*row, 1.0, row[2]] for row in strokes(words)])
    columns = ("--state", "X,Y", "--action", "vX,vY", *LINEAR)
    said = call("fit", file, *columns, "-o", tmp_path / "p.npz").err
    assert "column 'Strich': has 4 values" in said


def test_what_fit_has_to_be_told_is_the_verdict_of_inspect(tmp_path):
    for k in range(3):
        write(tmp_path / f"{k}.csv", "t,links,rechts", stroke(k))
    lines = " ".join(run("inspect", tmp_path).split())
    assert lines.startswith(
        "! 3 demonstrations, nothing odd, but fit needs to know more. Next: '0': cannot tell states"
    )


# Names that are none, and folders


@pytest.mark.parametrize("command", ["inspect", "diagnose", "fit", "score", "look", "convert"])
def test_leaving_out_what_is_not_there_is_an_error(folder, policy, tmp_path, command):
    output = {"fit": ("-o", tmp_path / "p.npz"), "look": ("-o", tmp_path / "l.html")}.get(command, ())
    before = (policy,) if command == "score" else ()
    after = (tmp_path / "to.csv",) if command == "convert" else ()
    said = refused(command, *before, folder / "w[01].csv", *after, "--leave-out", "W1,w9", *output)
    assert "--leave-out: no demonstration is called 'W1', 'w9'; there are 'w0', 'w1'." in said
    assert said.endswith("Did you mean 'w1'?")
    assert not list(tmp_path.iterdir())


def test_a_folder_stands_for_its_own_files_and_says_what_lies_below(folder, tmp_path):
    ran = call("inspect", folder, "--json")
    assert [one["name"] for one in json.loads(ran.out)["demonstrations"]] == [f"w{k}" for k in range(6)]
    assert ran.err == (
        f"Note: {folder}: 6 files read. Folders in it (unseen) hold 2 more .csv; '{folder}/**/*.csv' reads all.\n"
    )
    every = call("inspect", f"{folder}/**/*.csv", "--json")
    names = [one["name"] for one in json.loads(every.out)["demonstrations"]]
    assert names == ["w6", "w7", *(f"w{k}" for k in range(6))]
    assert every.err == ""
    shutil.copytree(folder, tmp_path / "alles" / "wischen")
    said = refused("inspect", tmp_path / "alles")
    assert "without a file to read. Folders in it (wischen) hold 8 more .csv" in said


def test_what_holds_of_many_recordings_is_said_once_and_counted(tmp_path):
    for k in range(4):
        write(tmp_path / f"w{k}.csv", HEAD, stroke(k, jitter=0.2))
    ran = call("fit", tmp_path, *LINEAR, "-o", tmp_path.parent / "jittery.npz")
    first, others = [line for line in ran.err.splitlines() if "irregular" in line]
    assert first.startswith(
        "Note: irregular: 'w0': time stamps are irregular, so it is resampled to its median rate of"
    )
    assert others == "Note: irregular: the same of 'w1', 'w2', 'w3', 4 in all."
    shown = run("inspect", tmp_path)
    assert f"{first.removeprefix('Note: ')}\n  the same of 'w1', 'w2', 'w3', 4 in all\n" in shown


# Score


def test_score_says_what_was_learnt_from(folder, policy):
    new = json.loads(run("score", policy, folder / "unseen", "--json"))
    assert new["learnt_from"] == []
    assert "held-out motion: " in new["verdict"]["said"]
    mixed = json.loads(run("score", policy, folder / "w1.csv", folder / "unseen" / "w6.csv", "--json"))
    assert mixed["learnt_from"] == ["w1"]
    assert mixed["verdict"]["mark"] == "doubtful"
    assert "it learnt from 1 of 2 demonstrations" in mixed["verdict"]["said"]


def test_a_stroke_that_hardly_moves_has_no_score_and_spoils_no_mean(folder, policy, tmp_path):
    moving, rows = folder / "unseen" / "w6.csv", stroke(6)
    rows[:, 1:] = rows[0, 1:] + 1e-4 * np.random.default_rng(0).standard_normal((40, 2))
    still = write(tmp_path / "still.csv", HEAD, rows)
    shown = call("score", policy, moving, still)
    assert re.search(r"^still +hardly moved: no score *$", shown.out, re.MULTILINE)
    assert "Note: still hardly moved, beside what the policy does there: no score." in shown.err
    both, one = (json.loads(run("score", policy, *of, "--json")) for of in ((moving, still), (moving,)))
    assert (both["hardly_moved"], one["hardly_moved"]) == (["still"], [])
    assert (both["all"], both["verdict"]) == (one["all"], one["verdict"])
    rows = stroke(6)
    rows[:, 1:] = rows[::-1, 1:] * [1.0, -1.0]  # which moves, but another way
    shown = call("score", policy, moving, write(tmp_path / "other.csv", HEAD, rows))
    assert re.search(r"^other +40 of 40 +worse than standing still ", shown.out, re.MULTILINE)
    assert "hardly moved" not in text(shown)


def test_a_stroke_of_too_few_samples_has_no_score_and_stops_no_other(folder, policy, tmp_path):
    moving, rows = folder / "unseen" / "w7.csv", stroke(6)
    rows[:, 1:] = rows[0, 1:] + 0.1 * (rows[:, 1:] - rows[0, 1:])
    slow = write(tmp_path / "slow.csv", HEAD, rows)
    states = ("X [mm]", "Y [mm]")
    [demo] = uc.prepare(uc.read([slow]), uc.Recipe(states=states, differentiate="savgol"))
    *_, second, fastest = np.sort(np.linalg.norm(demo.actions, axis=1))
    still = ("--still", (second + fastest) / 2)
    shown = call("score", policy, moving, slow, *still)
    assert re.search(r"^slow +too short: no score *$", shown.out, re.MULTILINE)
    both, one = (json.loads(run("score", policy, *of, *still, "--json")) for of in ((moving, slow), (moving,)))
    assert (both["too_short"], one["too_short"]) == (["slow"], [])
    assert both["rows"] == one["rows"]
    assert "no demonstration has 5 samples or more" in refused("score", policy, slow, *still)


def test_motion_at_one_pace_is_scored_though_nothing_normalises_its_inconsistency(tmp_path):
    rows = [[k / 10, k / 10, 0, 1, 0] for k in range(20)]
    line = write(tmp_path / "line.csv", "t,x,y,vx,vy", rows)
    run("fit", line, "--action", "vx,vy", *LINEAR, "-o", tmp_path / "p.npz")
    [row] = json.loads(run("score", tmp_path / "p.npz", line, "--json"))["rows"]
    assert row["ninc"] is None
    assert row["explains"] == pytest.approx(1.0)


def test_samples_slower_than_the_noise_of_their_positions_spoil_no_score(folder, policy, tmp_path):
    rows = stroke(8, 160)  # which comes to rest
    exact = write(tmp_path / "exact.csv", HEAD, rows)
    rows[:, 1:] = rows[:, 1:].round()
    whole = write(tmp_path / "whole.csv", HEAD, rows)
    (true, _), (found, verdict) = (
        (told["rows"][0], told["verdict"])
        for told in (json.loads(run("score", policy, one, "--json")) for one in (exact, whole))
    )
    assert (true["fast"], true["samples"]) == (160, 160)
    assert 5 <= found["fast"] < 80
    assert found["explains"] == pytest.approx(true["explains"], abs=0.1)
    assert verdict["mark"] == "good"
    assert f" {found['fast']} of 160 " in call("score", policy, whole).out
    rows[:, 1:] = rows[::-1, 1:] * [1.0, -1.0]  # another way
    other = write(tmp_path / "other.csv", HEAD, rows)
    assert json.loads(run("score", policy, other, "--json"))["rows"][0]["explains"] < 0


def test_what_is_slow_beside_its_noise_throughout_is_not_judged_alone(folder, policy, tmp_path):
    moving, rows = folder / "unseen" / "w6.csv", stroke(7)
    rows[:, 1:] += 3.0 * np.random.default_rng(0).standard_normal((40, 2))
    noisy = write(tmp_path / "noisy.csv", HEAD, rows)
    shown = call("score", policy, moving, noisy)
    assert re.search(r"^noisy +\d of 40 +slow: cannot be judged ", shown.out, re.MULTILINE)
    assert "'noisy' alone" not in text(shown)
    alone = json.loads(run("score", policy, noisy, "--json"))["verdict"]
    assert alone["mark"] == "doubtful"
    assert alone["said"].startswith("Too slow to be judged: all is below ten times its noise.")


@pytest.mark.parametrize(("chosen", "which"), [("local", r"\d+ local models of σ² \S+"), ("affine", r"Affine\(.*\)")])
def test_auto_names_the_model_it_took_be_it_local_or_features(folder, tmp_path, monkeypatch, chosen, which):
    every = uc.Model.to_choose_from
    monkeypatch.setattr(uc.Model, "to_choose_from", lambda *of: {chosen: every(*of)[chosen]})
    monkeypatch.setattr(uc.LocallyLinearPolicy, "held_out_score", lambda _: -1.0)
    files = folder / "w1.csv", folder / "w2.csv", folder / "w3.csv"
    said = text(call("fit", *files, "--learner", "direct", "--model", "auto", "-o", tmp_path / "p.npz"))
    told = re.search(rf"Features of least estimated error: ({which})\. Sh", said)
    assert told[1] == json.loads(run("info", tmp_path / "p.npz", "--json"))["model"]


@pytest.mark.parametrize(("told", "said"), [(1.0000000000000069, "1"), (0.84375123456, "0.843751")])
def test_shares_in_comments_of_exports_are_rounded(folder, tmp_path, told, said):
    run("fit", folder / "w1.csv", folder / "w2.csv", *LINEAR, "-o", tmp_path / "p.npz")
    uc.save(uc.load(tmp_path / "p.npz"), tmp_path / "p.npz", {"determined share of states": told})
    run("export", tmp_path / "p.npz", "-o", tmp_path / "p.c")
    assert f"determined share of states: {said}\n" in (tmp_path / "p.h").read_text()


@pytest.mark.parametrize(("explained", "kind"), [(1.0, "LocallyLinearPolicy"), (-1e9, "ParametricPolicy")])
def test_auto_takes_the_default_model_where_that_explains_more_held_out(folder, tmp_path, monkeypatch, explained, kind):
    monkeypatch.setattr(uc.LocallyLinearPolicy, "held_out_score", lambda _: explained)
    run("fit", folder / "w1.csv", folder / "w2.csv", folder / "w3.csv", "--model", "auto", "-o", tmp_path / "p.npz")
    assert json.loads(run("info", tmp_path / "p.npz", "--json"))["holds"] == kind


@pytest.mark.parametrize(
    ("how", "which"),
    [
        ((), "one affine model for all states"),
        (("--variance", "2e4"), "local models of σ² 2e+04"),
        (("--model", "cubic"), "Polynomial(degree=3"),
    ],
)
def test_the_page_of_a_fit_says_which_model_was_taken_as_info_does(folder, tmp_path, how, which):
    run("fit", folder, *how, "-o", tmp_path / "p.npz", "--report", tmp_path / "p.html")
    model = json.loads(run("info", tmp_path / "p.npz", "--json"))["model"]
    assert which in model
    assert f"A policy of {model} by the " in " ".join((tmp_path / "p.html").read_text("utf-8").split())


def test_files_of_which_nobody_said_what_is_what_are_not_to_be_left_out(tmp_path):
    for k in range(2):
        write(tmp_path / f"s{k}.csv", "t,a,b", stroke(k))
    said = refused("look", tmp_path / "s0.csv", tmp_path / "s1.csv", "-o", tmp_path / "l.html")
    assert said.endswith("with --by savgol. 'unconstrain inspect' proposes a command.")
    assert "--leave-out" not in said


def test_fit_prints_the_shares_that_its_json_holds(folder, tmp_path):
    how = ("fit", folder / "w1.csv", folder / "w2.csv", folder / "w3.csv", *LINEAR, "-o", tmp_path / "p.npz", "--force")
    found = json.loads(run(*how, "--json"))
    said = f"explained, where slow samples count less, as in the verdict: {found['training']:.4g} on the training data"
    assert f"{said}, {found['held_out']:.4g} where held out." in text(call(*how))


def test_what_turns_the_other_way_has_no_negative_pace():
    told = uc.evaluation.verdicts.size_and_pace(np.ones(3), np.array([-0.33, -0.5, 0.8]))
    assert "pace 0.33 times the other way (3 runs: 0.50 the other way to 0.80) the demonstrated" in told
    assert "the other way" not in uc.evaluation.verdicts.size_and_pace(np.ones(2), np.array([0.33, 0.5]))


def test_a_score_says_that_motion_along_the_recorded_actions_alone_is_judged_but_where_a_constraint_is_given(
    folder, policy
):
    said = "Only motion along the recorded actions is judged; what held these recordings, given with --plane or"
    assert said in text(call("score", policy, folder / "unseen"))
    assert said not in text(call("score", policy, folder / "unseen", "--plane", "1,1"))


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (("--variance", "inf"), "a policy: one affine model for all states"),
        (("--variance", "3000"), r"a policy: \d+ local models of σ² 3000"),
        (("--variance", "inf", "--guided", "0,0"), "a guided policy: one affine model for all states"),
    ],
)
def test_info_begins_with_the_models_that_fit_spoke_of(folder, tmp_path, typed, said):
    told = run("fit", folder, "--learner", "direct", *typed, "-o", tmp_path / "p.npz")
    [shown] = re.findall(r"^holds +(.*?) *$", run("info", tmp_path / "p.npz"), re.MULTILINE)
    assert re.fullmatch(said, shown)
    assert shown.partition(": ")[2] in told


def test_it_knows_files_by_what_is_in_them(folder, policy, tmp_path):
    shutil.copy(folder / "w1.csv", tmp_path)
    shutil.copy(folder / "unseen" / "w6.csv", tmp_path / "w2.csv")
    assert json.loads(run("score", policy, tmp_path, "--json"))["learnt_from"] == ["w1"]
    assert "digests" not in run("info", policy)


def test_strokes_that_were_left_out_of_the_same_file_were_not_learnt_from(tmp_path):
    file = write(tmp_path / "alle.csv", f"Strich,{HEAD}", strokes(words, 5))
    fit = ("fit", file, "--group", "Strich", *LINEAR)
    run(*fit, "--leave-out", "Strich 4", "-o", tmp_path / "p.npz")
    found = json.loads(run("score", tmp_path / "p.npz", file, "--json"))
    assert found["learnt_from"] == [words(k) for k in range(4)]
    held_out = ("score", tmp_path / "p.npz", file, "--leave-out", ",".join(map(words, range(4))), "--json")
    assert json.loads(run(*held_out))["learnt_from"] == []


def test_score_and_look_read_as_told_where_files_are_not_as_those_learnt_from(tmp_path):
    learnt = write(tmp_path / "alle.csv", f"Strich,{HEAD}", strokes(words))
    other = write(tmp_path / "neu.csv", f"Zug,{HEAD}", strokes(words))
    plain = write(tmp_path / "eins.csv", HEAD, stroke(9))
    run("fit", learnt, "--group", "Strich", *LINEAR, "-o", tmp_path / "p.npz")
    score = ("score", tmp_path / "p.npz")
    assert "no column 'Strich' for group; it has Zeit [s], X [mm], Y [mm]. Give another, or --group none" in refused(
        *score, plain
    )
    assert [one["samples"] for one in json.loads(run(*score, other, "--group", "Zug", "--json"))["rows"]] == [40] * 4
    assert len(json.loads(run(*score, plain, "--group", "none", "--json"))["rows"]) == 1
    page = ("look", other, tmp_path / "p.npz", "-o", tmp_path / "look.html")
    assert "4 demonstrations, 160 samples" in run(*page, "--group", "Zug")
    run("look", learnt, tmp_path / "p.npz", "-o", tmp_path / "again.html")
    assert "--group Strich" in (tmp_path / "again.html").read_text()


def test_abbreviations_are_told_below_the_table(folder, policy):
    lines = run("score", policy, folder / "unseen", "--plane", "1,1").splitlines()
    assert [line.partition(":")[0] for line in lines[-3:]] == ["nCPE", "nPOE", "Run from the same starts"]
    assert "nCPE:" not in run("score", policy, folder / "unseen")


# Roll-outs


def test_what_no_recording_tells_is_the_spread_that_the_constraint_lets_through(folder):
    demos = uc.prepare(uc.read(folder / "w[0-5].csv"))
    policy = uc.LocallyLinearPolicy(learner=uc.NoiseCorrected()).fit_demonstrations(demos)
    plane = uc.constraints.Plane([1.0, 2.0])
    path = uc.rollout(policy, demos[0].states[0], steps=20, constraint=plane)
    free = np.array([2.0, -1.0]) / np.sqrt(5.0)  # the one direction that is left
    wanted = np.mean([np.sum(action**2) for action in policy.predict(path.states)]) ** 0.5
    expected = []
    for state in path.states:
        spread = float(free @ policy.covariances(state[None])[0] @ free) ** 0.5
        noise = float(np.sum(policy.uncertainty(state[None]).from_noise ** 2)) ** 0.5
        expected.append(0.0 if spread < noise else spread / wanted)
    assert max(expected) > 0
    assert_allclose(uc.evaluation.diagnosis.untold(policy, path), expected)
    direct = policy.with_learner(uc.Direct())
    assert uc.evaluation.diagnosis.untold(direct, path) is None


def test_a_movement_where_the_policy_is_not_determined_is_not_supported(folder, policy, tmp_path):
    """Two strokes along one line: across it nothing was seen."""
    x, y = stroke(0)[10, 1:]
    along = stroke(0)[11, 1:] - stroke(0)[10, 1:]
    for k in range(3):
        write(tmp_path / f"{k}.csv", HEAD, stroke(0))
    run("fit", tmp_path, "-o", tmp_path.parent / "one_line.npz")
    start = ("--start", f"{x},{y}", "--steps", 5, "-o", tmp_path / "path.csv", "--force")
    for plane, open_ in (((along[1], -along[0]), False), (along, True)):
        ran = call("rollout", tmp_path.parent / "one_line.npz", *start, "--plane", f"{plane[0]},{plane[1]}")
        assert ran.code == 0
        assert ran.out.startswith("! Near demonstrations")
        assert ("fewer than 3 tell the policy" in text(ran)) == open_
        assert "as 'fit' said, recordings tell too little: at 100% of the recorded states no" in text(ran)
    one_line = tmp_path.parent / "one_line.npz"  # what all recordings together tell, as fit notes it, is no doubt
    noted = {informing.TOLD: 1.0, informing.MARK: "good"}
    uc.save(uc.load(one_line), one_line, uc.storage.load_notes(one_line) | noted)
    assert run("rollout", one_line, *start, "--plane", f"{along[0]},{along[1]}").startswith("✔ Near demonstrations")


def test_a_start_where_nothing_was_demonstrated_is_refused_unless_told_to_go_on(policy, tmp_path):
    start = ("rollout", policy, "--start", "900,0", "--steps", 3, "-o", tmp_path / "path.csv")
    assert re.fullmatch(
        r"--start: nothing was demonstrated near 900, 0 \(support .*\)\. .* --least-support 0\.", refused(*start)
    )
    assert not list(tmp_path.iterdir())
    assert run(*start, "--least-support", 0).startswith("✖ No demonstration passes near for 100% of the time")


def test_a_movement_that_ends_for_want_of_support_warns_by_a_class_of_its_own(policy):
    learnt = uc.load(policy)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        uc.rollout(lambda x: np.ones_like(x), [0.0, 0.0], steps=3)
        learnt.predict = lambda states: np.full_like(states, 1000.0)
        uc.rollout(learnt, stroke(0)[5, 1:], steps=200)
    assert [one.category for one in said] == [uc.errors.SupportEndsWarning]


@pytest.mark.parametrize("starts", [[900.0, 0.0], [[900.0, 0.0], [0.0, 900.0]]])
def test_a_start_without_support_is_warned_of_in_python(policy, starts):
    learnt, near = uc.load(policy), stroke(0)[5, 1:]
    first = 2 - np.ndim(starts)
    with pytest.warns(
        uc.errors.SupportEndsWarning, match=r"\(900, 0\) \(support [^)]*\): what follows is a guess"
    ) as said:
        uc.rollout(learnt, starts if first else [*starts, near], steps=3)
    assert len(said) == 1
    assert ("near 2 of 3 starts, the first" in str(said[0].message)) != bool(first)
    uc.rollout(learnt, starts, steps=3, least_support=0.0)  # warnings are errors here
    uc.rollout(learnt, near, steps=3)


def test_the_verdict_speaks_of_obstacles(folder, policy, tmp_path):
    track = stroke(0)
    x, y = track[5, 1:]
    at = track[5, 1:] + 1.2 * (track[30, 1:] - track[5, 1:])
    radius = 0.4 * np.linalg.norm(at - track[5, 1:])
    ball = ("--obstacle", f"{at[0]},{at[1]},{radius}")
    told = json.loads(run("rollout", policy, "--start", f"{x},{y}", *ball, "--obstacle", "900,900,1", "--json"))
    states = np.array(told["rows"])[:, 1:3]
    nearest = np.linalg.norm(states - at, axis=1).min() / radius - 1.0
    assert f"It keeps clear of 2 obstacles, at the nearest of number 1 by {nearest:.0%} of" in told["verdict"]["said"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--plane", "0,0"), "--plane: got [0.0, 0.0], expected a vector that is not zero."),
        (("--obstacle", "1,1,-2"), "--obstacle: got -2.0, expected a number above 0.0."),
        (("--obstacle", "{start},5"), "--start: is inside obstacle 1 of 1; expected a start outside of all."),
        (("--dt", "-1"), "--dt: got -1.0, expected a number above 0.0."),
    ],
)
def test_what_cannot_be_begins_with_its_option(policy, options, said):
    start = ",".join(map(str, stroke(0)[5, 1:]))
    assert refused("rollout", policy, "--start", start, *(one.format(start=start) for one in options)) == said


# To write and to look


def test_a_folder_that_is_missing_is_named(policy, tmp_path):
    said = refused("export", policy, "-o", tmp_path / "nodir" / "x.c")
    assert said == f"{tmp_path}/nodir/x.c: cannot be written (there is no folder {tmp_path}/nodir)."


def test_a_policy_alone_is_no_look_and_says_what_to_add(policy, tmp_path):
    said = refused("look", policy, "-o", tmp_path / "look.html")
    assert said == f"{policy}: holds no recording to look at; add some: unconstrain look {policy} wipe_*.csv"


def test_look_and_play_begin_with_a_verdict(folder, tmp_path):
    assert run("look", folder / "w[0-5].csv", "-o", tmp_path / "a.html").startswith("✔ 6 demonstrations, nothing odd")
    few = run("look", folder / "w0.csv", "-o", tmp_path / "b.html")
    assert few.startswith("! 1 of 1 demonstration not as it should be: few demonstrations.")
    assert "few-demonstrations" in (tmp_path / "b.html").read_text()
    assert run("play", "-o", tmp_path / "c.html").startswith("✔ A page to draw on")


def test_a_live_look_listens_where_it_is_told(folder, tmp_path, monkeypatch):
    pytest.importorskip("viser")
    heard = []

    def echo(said, **how):
        heard.append(said)
        if said.startswith("live: "):
            raise KeyboardInterrupt

    monkeypatch.setattr(looking.click, "echo", echo)
    call("look", folder / "w0.csv", "--live", "--port", 18765)
    monkeypatch.setattr(looking.click, "echo", click.utils.echo)
    assert "live: http://127.0.0.1:18765 (Ctrl-C ends it)" in heard
    assert "--port: belongs to --live" in refused("look", folder / "w0.csv", "--port", 1, "-o", tmp_path / "l.html")


# Errors: whose they are, in words of who types


MANY = ("--state", "X,Y", "--differentiate", *LINEAR)


@pytest.mark.parametrize("command", ["fit", "diagnose", "score", "constraint", "convert"])
def test_what_is_wrong_with_one_of_several_files_names_it(folder, policy, tmp_path, command):
    bad = write(tmp_path / "w1.csv", HEAD.replace("Y", "Q"), stroke(1))
    before, after = {"score": ((policy,), ()), "convert": ((), (tmp_path / "to.csv",))}.get(command, ((), ()))
    output = ("-o", tmp_path / "p.npz") if command in ("fit", "constraint") else ()
    model = ("--model", "affine") if command == "diagnose" else LINEAR if command == "fit" else ()
    if command == "fit":  # where a file lacks what others have is the next test's
        bad = write(tmp_path / "w1.csv", HEAD, [*stroke(1)[:9], [np.nan, 0.45, 1.0], *stroke(1)[10:]])
    states = ("--state", "X,Y") + (() if command == "convert" else ("--differentiate",))
    said = refused(command, *before, folder / "w0.csv", bad, *after, *states, *model, *output)
    assert said.startswith(f"{bad}, row 9 (line 11), column 'time" if command == "fit" else f"{bad} has no column ")


def test_a_stroke_of_a_table_is_named_with_its_table(tmp_path):
    rows = strokes(words)
    good = write(tmp_path / "a.csv", f"Strich,{HEAD}", [[f"A {row[0]}", *row[1:]] for row in rows])
    rows[50][1] = np.nan
    bad = write(tmp_path / "b.csv", f"Strich,{HEAD}", rows)
    said = refused("fit", good, bad, "--group", "Strich", *MANY, "-o", tmp_path / "p.npz")
    assert said.startswith(f"'Strich 1' of {bad}, row 10 (line 52), column 'time")


@pytest.mark.parametrize(
    ("said", "typed"),
    [
        ("leave_out: no 'a'.", "--leave-out: no 'a'."),
        ("a.bag: say which with topic=: b.", "a.bag: say which with --topic: b."),
        ("check episodes=, task= and leave_out=.", "check --episodes, --task and --leave-out."),
        ("An affine policy (ParametricPolicy(Affine())).", "An affine policy (--model affine)."),
        ("max_gap_s: got -1.", "--max-gap: got -1."),
        ("angle='x', angles=('a', 'b') or sort=True.", "--angle x, --angle a,b or --sort."),
        (
            "tell them apart with group=, or cut with seams='cut'.",
            "tell them apart with --group, or cut with --seams cut.",
        ),
        ("Fit with learner=Robust(), or order=2.", "Fit with --learner robust, or --order 2."),
        ("rate=5.csv: group=, 'time=3' of it=4", "rate=5.csv: --group, 'time=3' of it=4"),
        ("with time=, or angles=('yaw (deg)',).", "with --time, or --angle 'yaw (deg)'."),
        ("give group='Strich', degrees=() or steps=.", "give --group Strich, --degrees none or --steps."),
    ],
)
def test_settings_are_said_as_options_but_for_names_of_files(said, typed, monkeypatch, tmp_path):
    def fail(*_, **__):
        warnings.warn(said, UserWarning, stacklevel=1)
        raise uc.errors.SettingError(said)

    monkeypatch.setattr(uc.preparation, "survey_set", fail)
    ran = call("inspect", write(tmp_path / "a.csv", HEAD, stroke(0)))
    assert ran.err == f"Note: {typed}\nError: {typed}\n"


@pytest.mark.parametrize(
    ("option", "value", "meant"),
    [
        ("--time-unit", "mss", "'s', 'ms', 'us', 'ns'. Did you mean 'ms'?"),
        ("--time-unit", "Milliseconds", "Did you mean 'ms'?"),
        ("--time-unit", "µs", "Did you mean 'us'?"),
        ("--time-unit", "fortnight", "'ns'."),
        ("--model", "afine", "Did you mean 'affine'?"),
        ("--scale", "aut", "expected auto, none, or numbers separated by commas, such as 1000,1."),
    ],
)
def test_a_value_that_is_none_is_answered_with_what_was_meant(folder, tmp_path, option, value, meant):
    assert refused("fit", folder, option, value, "-o", tmp_path / "p.npz").endswith(meant)


def test_what_comes_next_has_columns_that_are_there_and_leaves_out_what_is_in_another_unit(tmp_path):
    for k in range(4):
        write(tmp_path / f"w{k}.csv", "t,x,y", stroke(k + 1) * np.array([1, *[1e4 if k == 3 else 1.0] * 2]))
    for typed, then in (
        (("--state", "x,yy", "--action", "vx"), "--state x,y --differentiate"),
        (("--state", "x,y", "--leave-out", "w0"), "--state x,y --leave-out w0,w3"),
        (("--state", "x,y", "--leave-out", "w3"), "--state x,y --leave-out w3"),
    ):
        assert f"unconstrain fit {tmp_path} {then} -o policy.npz\n" in run("inspect", tmp_path, *typed)


def test_a_guess_at_the_states_is_a_command_that_runs(tmp_path):
    axes = [f"{side} {axis} [mm]" for side in ("linker 'Arm'", "rechts") for axis in "xyz"]
    for k in range(4):
        rows = np.column_stack([stroke(k), stroke(k)[:, 1:], stroke(k + 4)[:, 1:]])
        write(tmp_path / f"Weg {k}.csv", ",".join(["t", *axes]), rows)
    shown = run("inspect", *sorted(tmp_path.glob("*.csv")))
    assert "A guess, to be corrected:" in " ".join(shown.split())
    [command] = [line for line in shown.splitlines() if line.startswith("    unconstrain fit ")]
    _, *words_ = shlex.split(command)
    run(*words_[:-1], tmp_path / "p.npz", *LINEAR)
    assert json.loads(run("info", tmp_path / "p.npz", "--json"))["states"] == axes[:3]


def test_what_few_demonstrations_show_says_where_to_record_and_what_lists_all_places(folder, tmp_path):
    ran = run("fit", folder, "--leave-out", "w5", "--model", "cubic", "-o", tmp_path / "p.npz")
    assert re.search(r"least\s+is\s+known,\s+held\s+in\s+other\s+ways:\s+near\s+\(X\s+\[mm\]\s+=", ran)
    assert f"\n    unconstrain diagnose {folder} --leave-out w5 --model cubic\n" in ran


def test_a_long_fit_says_how_long_it_will_take(folder, tmp_path, monkeypatch):
    clock = iter(np.arange(0.0, 1e4, 3.0))
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(clock)))
    said = text(call("fit", folder, "--model", "affine", "-o", tmp_path / "p.npz"))
    assert said.count("Note: this may take minutes; '--learner hybrid' takes less.") == 1


class TestFilesOfAnotherKind:
    """What a file is instead is said, and what to do with it."""

    def test_files_of_score_the_wrong_way_round_come_back_as_they_have_to_be(self, folder, policy):
        said = refused("score", folder / "w0.csv", policy, folder / "w1.csv")
        assert said == (
            f"{folder / 'w0.csv'}: is a recording, not a policy. The policy comes first: unconstrain score {policy} "
            f"{folder / 'w0.csv'} {folder / 'w1.csv'}"
        )

    @pytest.mark.parametrize("command", [["info"], ["certify"], ["score", "w1.csv"], ["rollout", "--start", "0,0"]])
    def test_a_recording_is_no_policy(self, folder, command):
        more = [folder / word if word.endswith(".csv") else word for word in command[1:]]
        said = refused(command[0], folder / "w0.csv", *more)
        assert said.startswith(f"{folder / 'w0.csv'}: is a recording, not a policy. 'unconstrain inspect' says what")

    def test_a_damaged_policy_is_no_recording(self, policy, tmp_path):
        (tmp_path / "half.npz").write_bytes(policy.read_bytes()[:2000])
        assert refused("info", tmp_path / "half.npz").startswith(f"{tmp_path / 'half.npz'}: is no policy file, or a ")

    def test_a_learnt_constraint_goes_beside_a_policy(self, folder, tmp_path):
        held = tmp_path / "held.npz"
        assert run("constraint", folder / "w0.csv", "-o", held)
        said = "holds a learnt constraint, expected a policy. Give it beside a policy, as --constraint of rollout."
        assert refused("rollout", held, "--start", "0,0") == f"{held}: {said}"
        assert re.search(r"^holds +a learnt constraint", run("info", held), re.MULTILINE)
        assert json.loads(run("info", held, "--json"))["holds"] == "LearntConstraint"


@pytest.mark.parametrize("command", ["inspect", "fit", "diagnose"])
@pytest.mark.parametrize("name", ["w9", "w9.v2"])
def test_a_broken_file_is_left_out_by_its_name(folder, tmp_path, command, name):
    for k in range(4):
        shutil.copy(folder / f"w{k}.csv", tmp_path)
    broken = tmp_path / f"{name}.csv"
    broken.write_text("garbage\n")
    more = ("--model", "affine") if command != "inspect" else ()
    asked = (command, *sorted(tmp_path.glob("*.csv")), *more, *(["-o", tmp_path / "p.npz"] if command == "fit" else []))
    assert refused(*asked).startswith(f"{broken}: a header but no rows")
    assert refused(*asked, "--leave-out", "w8").startswith(f"{broken}: a header but no rows")
    assert "3 demonstrations" in run(*asked, "--leave-out", f"{name},w3") or command == "inspect"
    told = json.loads(run(*asked, "--leave-out", f"{name},w3", "--json", *(["--force"] if command == "fit" else [])))
    used = told.get("demonstrations", 3)
    assert used == 3 or [one["name"] for one in used] == ["w0", "w1", "w2"]


def test_a_rollout_that_is_printed_ends_with_its_verdict(policy, tmp_path):
    asked = ("rollout", policy, "--start", "50,50", "--steps", 5)
    printed = call(*asked)
    written = run(*asked, "-o", tmp_path / "path.csv")
    assert printed.out == (tmp_path / "path.csv").read_text()
    assert printed.err.strip()
    assert printed.err.strip() == written.partition("\nmovement: ")[0].strip()


def test_a_good_verdict_of_a_printed_rollout_is_not_kept_back(tmp_path):
    swings = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    uc.save(uc.LocallyLinearPolicy(None, learner="direct").fit(swings, -swings), tmp_path / "p.npz")
    assert call("rollout", tmp_path / "p.npz", "--start", "0.2,0.2", "--steps", 3).err.startswith("✔ ")


def test_names_of_candidates_are_explained_where_they_stand(folder, policy, tmp_path):
    said = run("fit", folder, "-v", "-o", tmp_path / "p.npz")
    assert "('fit -v' lists all)" in said
    rows = re.findall(r"^(direct|segments|softened hybrid, 1) +\S+ +(\S.*?) *$", said, re.MULTILINE)
    words = uc.evaluation.diagnosis.in_words
    assert dict(rows) == {name: words(name) for name in ("direct", "segments", "softened hybrid, 1")}
    assert words("softened hybrid, 1") == words("softened hybrid") != ""
    known = uc.load(policy).solution_.method
    assert re.search(rf"^learnt as, in words +{re.escape(words(known))} *$", run("info", policy), re.MULTILINE)


def test_regions_of_a_diagnosis_are_one_number_each(folder):
    few = [folder / f"w{k}.csv" for k in range(3)]
    said = " ".join(run("diagnose", *few, "-v").split())
    report = ("-o", folder.parent / "d.html", "--force")
    whole = json.loads(run("diagnose", *few, "--json", *report))
    told = whole["regions"]
    assert whole["verdict"]["next"].partition("'")[0] in html.unescape(report[1].read_text("utf-8"))
    open_ = "Where none tells it in some direction"
    assert f"Do not trust: {open_ if whole['told_together'] < 1 else 'States that nobody came near.'}" in said
    assert all(f"{name}: " in said for name in ("told by all", "told by three", "may be off by", "moved by"))
    assert all(isinstance(one[name], float) for one in told for name in ("determined", "together", "along"))


def test_a_report_says_that_it_learns_again(folder, tmp_path):
    heard = []
    policy = uc.ParametricPolicy(uc.Affine())
    demos = uc.prepare(uc.read(folder / "w*.csv"), uc.Recipe(states=("X", "Y"), differentiate="savgol"))
    policy.fit_demonstrations(demos)
    with listening(lambda *told: heard.append(told)):
        fit_page.policy_page(policy, demos, "A page")
    assert heard == [("report: learning again, each time without some demonstrations:", k, 5) for k in range(1, 6)]


def test_where_nothing_is_left_to_record_no_places_are_listed(tmp_path):
    rng = np.random.default_rng(0)
    for k in range(8):  # free, to a goal from everywhere, in spirals
        start, turn = rng.uniform(-1, 1, 2), np.array([[-1.0, 2.0], [-2.0, -1.0]])
        states = np.stack([expm(0.05 * step * turn) @ start for step in range(60)])
        actions = 0.01 * rng.standard_normal((60, 2)) + states @ turn.T
        write(tmp_path / f"{k}.csv", "t,x,y,vx,vy", np.column_stack([0.05 * np.arange(60), states, actions]))
    asked = ("diagnose", tmp_path / "*.csv", "--state", "x,y", "--action", "vx,vy", "--model", "affine")
    said = run(*asked)
    assert "No place needs another demonstration" in said
    assert "places where least is known" not in said
    assert "places where least is known" in run(*asked, "-v")
    told = run(*asked, "--leave-out", "2,3,4,5,6,7")
    assert "No place needs another demonstration" not in told
    assert "places where least is known" in told


def reaches(folder, count, bend=0.0):
    """Files of free strokes to a goal from everywhere, in spirals, whose policy is affine where it is not bent."""
    rng, times = np.random.default_rng(0), 0.05 * np.arange(60)
    for k in range(count):
        policy = lambda x: x @ np.array([[-1.0, -2.0], [2.0, -1.0]]) - bend * x * np.abs(x)  # noqa: E731
        done = uc.rollout(policy, rng.uniform(-1, 1, 2), 60, 0.05)
        rows = np.column_stack([times, done.states, done.actions + 0.01 * rng.standard_normal((60, 2))])
        write(folder / f"{k}.csv", "t,x,y,vx,vy", rows)
    return folder / "*.csv", "--state", "x,y", "--action", "vx,vy", "--model"


@pytest.mark.parametrize("bend", [0.0, 8.0])
def test_what_a_model_misses_beyond_noise_is_told_apart_from_what_recordings_leave_open(tmp_path, bend):
    how = reaches(tmp_path, 8, bend)
    said = text(call("diagnose", *how, "affine"))
    judged = said.partition("Next: ")[0]
    assert bool(re.search(r"The model: beyond noise it misses \d+% of a typical action on average", judged)) == bool(
        bend
    )
    assert ("Another --model of 'fit' may miss less, or more: compare by 'score' on" in said) == bool(bend)
    assert bool(re.search(r"changes from sample to sample; the rest is what the model", said)) == bool(bend)
    if "No place needs another" in said:
        assert ("; none cures that the model misses" in said) == bool(bend)


@pytest.mark.parametrize("count", [16, 18])
def test_a_diagnosis_lists_all_demonstrations_where_they_are_few_and_else_the_ends_of_all(tmp_path, count):
    asked = ("diagnose", *reaches(tmp_path, count), "affine")
    row = r"^(\d+) +60 +(?:free|constrained|either|undecided) +[<>]?\d+% +[<>]?\d+%"
    said, all_ = run(*asked), run(*asked, "-v")
    listed = re.findall(row, said, re.MULTILINE)
    assert len(listed) == len({*listed}) == 16
    assert ("(-v lists 2 more, between):" in said) == (count == 18)
    assert len({*re.findall(row, all_, re.MULTILINE)}) == count
    assert "more, between" not in all_


def test_help_says_for_what_a_robot_can_be_shown():
    assert "With --live or --rrd: states are joint angles of this robot" in " ".join(run("look", "--help").split())

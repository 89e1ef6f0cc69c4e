"""What commands say to who has only the documentation: figures that agree, and commands that can be copied."""

import html
import json
import re
import shlex
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import onnxruntime
import pytest

import unconstrain as uc
from test_cli import call, run, write
from test_newcomer import text
from unconstrain.cli import main, reading, rolling
from unconstrain.cli.informing import TOLD
from unconstrain.evaluation import diagnosis, metrics, verdicts
from unconstrain.evaluation.diagnosis import places
from unconstrain.pages.constraint import constraint_page

TURN = np.array([[-1.0, 0.5], [-0.5, -1.0]])
RECIPE = uc.Recipe(states=("x", "y"), differentiate="savgol")
FREE = ("--state", "x,y", "--by", "savgol", "--model", "affine")


def strokes(folder, noise=0.0, held=True, count=6, rest=0.0, samples=150):
    """Files of strokes towards (0, 0), most under a line of their own, seen with some noise, at 50 Hz, in metres."""
    rng, files = np.random.default_rng(3), []
    folder.mkdir(exist_ok=True)
    for k in range(count):
        at, way = (0.3 * np.array([np.cos(angle), np.sin(angle)]) for angle in (2 * k, 2 * k + 0.5))
        way, seen = way / np.linalg.norm(way), []
        onto = np.outer(way, way) if held and k % 3 else np.eye(2)
        still = round(rest / 0.02)
        for step in range(samples + still):
            seen.append(at + noise * rng.standard_normal(2))
            at = at + 0.02 * (onto @ TURN @ at) * (step >= still)
        times = 0.02 * np.arange(len(seen))
        files.append(write(folder / f"d{k}.csv", "t,x [m],y [m]", np.column_stack([times, seen])))
    return files


def true(states):
    return states @ TURN.T


# What of a miss is noise


@pytest.mark.parametrize("held", [True, False], ids=["held", "free"])
@pytest.mark.parametrize("noise", [0.0, 3e-4, 1e-3])
def test_what_noise_alone_makes_a_policy_miss_is_what_the_true_one_misses(tmp_path, noise, held):
    demos = uc.prepare(uc.read([*map(str, strokes(tmp_path / "a", noise, held))]), RECIPE)
    missed, motion = metrics.along_motion(true, demos)
    assert metrics.missed_for_noise(true, demos) == pytest.approx(np.sqrt(missed / motion), rel=0.3, abs=0.015)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_fit_score_and_info_say_how_much_of_what_is_missed_is_noise(tmp_path, noise):
    files = strokes(tmp_path / "a", noise, held=False)
    said = [text(call("fit", *files[:5], *FREE, "-o", tmp_path / "p.npz"))]
    said += [text(call("info", tmp_path / "p.npz")), text(call("score", tmp_path / "p.npz", files[5]))]
    for one in said:
        found = re.search(
            r"misses (<?\d+)% of a typical action( \(noise, which turns slow motion, makes that (\d+)% or mor)?", one
        )
        assert bool(found[2]) == (noise > 0)
        if noise:
            assert 0.5 * int(found[1]) <= int(found[3]) <= int(found[1])
    alone = json.loads(run("fit", *files[:5], *FREE, "-o", tmp_path / "p.npz", "--force", "--json"))["noise_alone"]
    assert (alone > 0.03) == (noise > 0)


def test_what_is_far_more_than_is_missed_is_not_called_noise():
    """Constraints that change at every sample look like noise by differences in time."""
    assert verdicts.misses(0.99, 0.5) == "misses 10% of a typical action"
    assert verdicts.misses(0.99, 0.11).endswith("(noise, which turns slow motion, makes that 10% or more)")
    assert verdicts.misses(0.99, 0.001) == "misses 10% of a typical action"


# Places to record that are apart


def test_places_that_are_nearly_one_are_one_row(tmp_path):
    files = strokes(tmp_path / "a", 1e-3, count=4)
    asked = ("diagnose", *files, *FREE[:4])
    regions = json.loads(run(*asked, "--json"))["regions"]
    assert [one["along"] for one in regions] == sorted((one["along"] for one in regions), reverse=True)
    said, every = (
        run(*asked, *more).partition("largest first:\n")[2].partition("told by all:")[0] for more in ((), ("-v",))
    )
    states = np.array([one["state"] for one in regions])
    rows = [[float(each) for each in line.split()[:2]] for line in said.splitlines()[2:] if line.strip()]
    apart = np.abs(np.subtract.outer(rows, rows).diagonal(0, 1, 3)) / np.ptp(states, axis=0)
    assert 2 <= len(rows) < len([line for line in every.splitlines()[2:] if line.strip()]) == len(regions)
    near = (apart.max(axis=2) < 0.09)[np.triu_indices(len(rows), 1)]
    ways = [[float(each) for each in line.split()[-3:-1]] for line in said.splitlines()[2:] if line.strip()]
    alike = np.abs(np.array(ways) @ np.array(ways).T)[np.triu_indices(len(rows), 1)]
    assert not (near & (alike > 0.75)).any()


def test_of_two_places_that_are_open_along_other_directions_none_is_left_out():
    def region(state, direction, along):
        return uc.evaluation.diagnosis.Region(state, 9, 0.0, 0.0, along, state, "a", direction, along, ())

    first, same, across, far = (
        region((0.0, 0.0), (1.0, 0.0), 0.9),
        region((0.05, 0.0), (-0.9, 0.4), 0.8),
        region((0.0, 0.05), (0.0, 1.0), 0.7),
        region((1.0, 1.0), (1.0, 0.0), 0.6),
    )
    assert places([first, same, across, far]) == [first, across, far]
    assert places([first]) == [first]


@pytest.mark.parametrize("along", [0.05, 0.4])
def test_a_spread_that_noise_hides_is_not_called_low(tmp_path, along):
    demos = uc.prepare(uc.read([*map(str, strokes(tmp_path / "a", 1e-3))]), RECIPE)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit_demonstrations(demos)
    found = uc.evaluation.diagnose(policy, demos)
    told = tuple(replace(one, determined=1.0, along=along) for one in found.regions)
    [said] = [one for one in diagnosis.sentences(replace(found, regions=told), "xy", "xy") if one.startswith("Every")]
    assert ("though 40% of a typical action may be off" in said) == (along > 0.1)


# The page of a fit


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Of seven strokes, of which the sixth goes wrong; and of the same with too many samples to learn again."""
    place, pages = tmp_path_factory.mktemp("said"), {}
    for name, samples in (("few", 120), ("many", 800)):
        strokes(place / name, 3e-4, held=False, count=7, samples=samples)
        wrong = np.loadtxt(place / name / "d5.csv", delimiter=",", skiprows=1)
        wrong[:, 1:] = wrong[:, 1:] @ [[0.9, 0.6], [-0.6, 0.9]] + 0.1 * np.sin(3 * wrong[:, :1])
        write(place / name / "d5.csv", "t,x [m],y [m]", wrong)
        run("fit", place / name, *FREE, "-o", place / f"{name}.npz", "--report", place / f"{name}.html")
        pages[name] = (place / f"{name}.html").read_text("utf-8")
    return pages


def test_the_page_draws_what_is_explained_worst_and_says_so(page):
    for name, where in (("few", "explained worst where held out"), ("many", "explained worst, the worst first")):
        plain = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page[name])).split())
        assert f"The 4 of 7 demonstrations that are {where}" in plain
        drawn = page[name].partition("Predicted and observed actions")[2].partition("Errors and support")[0]
        assert re.findall(r">\s*(d\d)\s*<", drawn)[0] == "d5"


def test_the_column_of_what_is_held_out_is_filled_or_not_there(page):
    tables = {name: one.partition("Errors and support")[2].partition("</table>")[0] for name, one in page.items()}
    rows = [
        re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL)
        for row in re.findall(r"<tr>(.*?)</tr>", tables["few"], re.DOTALL)
    ]
    heads = {name: " ".join(re.findall(r"<th[^>]*>(.*?)</th>", one, re.DOTALL)) for name, one in tables.items()}
    assert "held out" in heads["few"]
    assert "held out" not in heads["many"]
    assert "–" not in "".join(each for row in rows for each in row)


# Size and pace


@pytest.mark.parametrize(("last", "kept"), [(1.05, "it keeps size and pace"), (1.29, "it nearly keeps size and pace")])
def test_what_is_said_of_size_and_pace_agrees_with_the_figures_beside_it(last, kept):
    given = np.ones(4), np.ones(4), [1.0, 1.0, 1.0, last]
    assert verdicts.moves(*given) == (kept, [])
    told = verdicts.size_and_pace(*given, apart="3 mm")
    assert ("; none beyond 0.83 to 1.20 times" in told) == (last < 1.2)
    assert ("; beyond 0.83 to 1.20 times: last round over first of 1 of 4" in told) == (last > 1.2)


@pytest.mark.parametrize("ratio", [0.81, 0.8249, 0.826, 0.8334, 0.84, 1.0, 1.2, 1.2049, 1.206])
def test_the_bounds_that_are_printed_are_those_that_ratios_as_printed_are_judged_by(ratio):
    told = verdicts.size_and_pace(np.array([1.0, 1.0, 1.0, ratio]), np.full(4, np.nan), apart="3 mm")
    beyond = not 0.83 <= float(f"{ratio:.2f}") <= 1.2
    assert told.endswith(
        "; beyond 0.83 to 1.20 times: size of 1 of 4" if beyond else "; none beyond 0.83 to 1.20 times"
    )


# How commands end


@pytest.mark.parametrize(
    ("command", "code", "mark", "said"),
    [
        ("rollout local.npz --start 0.2,0.1 -o out.csv", 0, None, "passes near|Near dem"),
        ("rollout away.npz --start 0.2,0.1 --steps 2000 -o out.csv", 0, "doubtful", "stops after"),
        ("rollout away.npz --start 9,9 -o out.csv", 2, None, "nothing was demonstrated near"),
        ("score p.npz other", 0, "bad", "poor"),
        ("certify p.npz", 0, "good", "guaranteed"),
        ("certify away.npz", 3, "bad", "nothing is guaranteed|do not end|diverge|away"),
        ("inspect nowhere.csv", 2, None, "nowhere.csv"),
    ],
)
def test_the_exit_code_says_whether_it_was_done_and_the_verdict_how_good_it_is(
    work, monkeypatch, command, code, mark, said
):
    monkeypatch.chdir(work)
    words = [*shlex.split(command), *["--force"] * ("-o" in command)]
    ran = call(*words)
    assert ran.code == code, ran.err
    assert re.search(said, text(ran))
    if mark is not None:
        assert json.loads(call(*words, "--json").out)["verdict"]["mark"] == mark
    assert "uc.Guided" not in text(ran)
    assert ("fit with --guided auto, or go on with --least-support 0" in text(ran)) == ("stops" in said)


def test_the_rule_of_exit_codes_is_in_the_help():
    said = " ".join(call("--help").out.split())
    assert "Exit codes: 0 done, whatever the verdict says" in said
    assert "3 certify guarantees nothing" in said


# Rest, and several guides


@pytest.mark.parametrize("rest", [0.0, 0.6])
def test_a_look_notes_rest_beside_the_demonstration_that_rests(tmp_path, rest):
    strokes(tmp_path / "a", rest=rest)
    run("look", tmp_path / "a", *FREE[:4], "-o", tmp_path / "look.html")
    page = (tmp_path / "look.html").read_text("utf-8")
    assert ("before it starts, left out (--pauses keep)" in page) == (rest > 0)


def test_of_several_doors_the_table_says_where_each_has_its_hinge(tmp_path):
    turn = 0.2 + 0.9 * (1 - np.cos(np.pi * np.arange(0, 4, 0.02) / 4))
    rng, doors = np.random.default_rng(0), {"a": (0.0, 0.0, 0.8), "b": (2.0, 1.0, 0.6)}
    for name, (x, y, size) in doors.items():
        for number in range(2):
            arc = np.column_stack([x + size * np.cos(turn), y + size * np.sin(turn), 0.9 + 0 * turn])
            arc += 3e-4 * rng.standard_normal(arc.shape)
            table = np.column_stack([0.02 * np.arange(len(arc)), arc])
            write(tmp_path / f"{name}{number}.csv", "t [s],x [m],y [m],z [m]", table)
    said = run("constraint", tmp_path, "--state", "x,y,z", "--by", "savgol", "-o", tmp_path / "c.npz")
    rows = [" ".join(line.split()) for line in said.splitlines()]
    for name, at in (("a", "0.000, 0.000, 0.900"), ("b", "2.000, 1.000, 0.900")):
        for number in range(2):
            [row] = [one for one in rows if one.startswith(f"{name}{number} ")]
            assert f"{doors[name][2]:g} m {at}" in row


# Commands that can be copied


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    place = tmp_path_factory.mktemp("copied")
    strokes(place / "in ways", 1e-3)
    strokes(place / "few", 1e-3, count=2)
    strokes(place / "new", 1e-3, count=1)
    run("fit", place / "in ways", *FREE[:4], "-o", place / "p.npz")
    run("fit", place / "in ways", *FREE[:4], "--guided", "auto", "-o", place / "g.npz")
    run("constraint", place / "in ways" / "d1.csv", *FREE[:4], "-o", place / "c.npz")
    for name, turned in (("other", [[0, 9], [9, 0]]), ("apart", [[-1, 0], [0, -1]])):
        (place / name).mkdir()
        for one in (place / "in ways").iterdir():
            rows = np.loadtxt(one, delimiter=",", skiprows=1)
            rows[:, 1:] = (rows[:, 1:] @ turned)[:: -1 if name == "apart" else 1]
            write(place / name / one.name, "t,x [m],y [m]", rows)
    run("fit", place / "apart", *FREE[:4], "--model", "rbf", "--learner", "direct", "-o", place / "away.npz")
    run("fit", place / "in ways", *FREE[:4], "--model", "rbf", "-o", place / "local.npz")
    return place


PLACES = {"NEW.csv": "new", "RECORDINGS.csv": "in ways", "POLICY.npz": "p.npz", "GOAL": "0,0", "HZ": "50"}
"""What stands for what is not known, and what it may be."""

COMMANDS = [
    "inspect 'in ways'",
    "inspect 'in ways/d0.csv' --state x,y",
    "look 'in ways' --by savgol",
    "diagnose 'in ways' --by savgol",
    "fit 'in ways' --by savgol -o new.npz",
    "fit few --by savgol -o new.npz",
    "fit 'in ways' --by savgol --model cubic --learner direct -o new.npz",
    "score p.npz new",
    "score p.npz 'in ways'",
    "rollout p.npz --start 0.2,0.1 -o out.csv",
    "rollout p.npz --start 0.2,0.1 --plane 1,1 -o out.csv",
    "certify p.npz",
    "certify q.npz",
    "constraint 'in ways' --by savgol -o held.npz",
    "constraint 'in ways/d1.csv' --by savgol -o held.npz",
    "info p.npz",
    "info g.npz",
    "info c.npz",
    "export p.npz -o made.c",
    "convert 'in ways' all.parquet",
    "convert 'in ways' all.csv",
    "example 'first files'",
    "play -o play.html",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_what_comes_next_runs_as_it_is_printed(work, tmp_path, monkeypatch, command):
    for one in work.iterdir():
        (tmp_path / one.name).symlink_to(one)
    monkeypatch.chdir(tmp_path)
    if "q.npz" in command:
        run("fit", "in ways", "--by", "savgol", "--model", "cubic", "--learner", "direct", "-o", "q.npz")
    told = call(*shlex.split(command))
    after = (told.out + told.err).partition("  Next: ")[2].partition("\n\n")[0].splitlines()
    assert not re.search(r"uc\.\w|least_support=|\w=[^c]", " ".join(after))
    copied = [line.strip() for line in after if line.strip().startswith("unconstrain ")]
    named = {*re.findall(r"'unconstrain (\w+)", " ".join(line.strip() for line in after))}
    assert named <= {line.split()[1] for line in copied}
    for line in copied:
        there = [name for name in PLACES if name in line]
        assert len({*there} - {"GOAL"}) <= 1
        words = [PLACES.get(word, word) for word in shlex.split(line)[1:]]
        ran = call(*words)
        assert ran.code in (0, 3), (line, ran.err)


OTHER = {
    "states": ("x", "y"),
    "actions": ("vx", "vy"),
    "differentiate": "kalman",
    "window_s": 0.1,
    "order": 2,
    "rate": 62.5,
    "trim": (0.5, 0.0),
    "still": 24.0,
    "centre": True,
    "max_gap_s": 0.125,
    "sort": True,
    "angles": ("x",),
    "degrees": ("x", "y"),
    "quaternions": (("a", "b", "c", "d"), ("e", "f", "g", "h")),
    "rotation_vectors": (("a", "b", "c"),),
    "glitches": "drop",
    "seams": "cut",
    "pauses": "keep",
    "action_is": "delta",
    "group": "stroke",
    "time": "clock",
    "time_unit": "ms",
    "columns": ("t", "x", "y"),
    "topic": "/arm",
}
"""Of each setting that reads and prepares files a value that it does not have by default."""


def test_every_setting_that_reads_and_prepares_has_another_value_here():
    assert {*OTHER} == {one.name for one in fields(uc.Recipe)} | {*uc.readers.Reading().roles}
    plain = {**vars(uc.Recipe()), **uc.readers.Reading().roles}
    assert all(plain[name] != value for name, value in OTHER.items())


@pytest.mark.parametrize("name", OTHER)
def test_a_printed_command_reads_and_prepares_as_what_the_policy_was_learnt_from(work, tmp_path, name):
    other = {"states": tuple("abcdefgh") if "quat" in name else ("x", "y"), name: OTHER[name]}
    roles = {} if name in vars(uc.Recipe()) else {name: other.pop(name)}
    recipe = replace(uc.Recipe(**({} if name == "actions" else {"differentiate": "savgol"})), **other)
    uc.save(uc.load(work / "p.npz"), tmp_path / "q.npz", {"recipe": recipe.to_dict(), TOLD: 0.2, **roles})
    [line] = [one.strip() for one in run("info", tmp_path / "q.npz").splitlines() if " diagnose REC" in one]
    _, command, *words = shlex.split(line)
    given = main.commands[command].make_context(command, words, help_option_names=["-h", "--help"]).params
    assert reading.recipe_of(**given) == recipe
    assert {**reading.reading_of(**given).roles} == {**uc.readers.Reading(**roles).roles}
    plain = {one for one in OTHER if one not in other and one not in roles} - {"differentiate"}
    words_of_others = {f"--{reading.OPTIONS.get(one, one).replace('_', '-')}" for one in plain}
    assert not words_of_others & {*words}


@pytest.mark.parametrize("more", [(), ("--window", "0.1", "--still", "0.02")], ids=["as the policy", "but for some"])
def test_a_look_at_a_policy_copies_the_command_that_reads_as_it_did(work, tmp_path, monkeypatch, more):
    """Strokes without a clock in one file, at 50 Hz, of which rest at an end is left out."""
    rows = [np.loadtxt(one, delimiter=",", skiprows=1) for one in sorted((work / "in ways").iterdir())]
    write(tmp_path / "all.csv", "n,x,y", np.vstack([np.insert(one[:, 1:], 0, k, axis=1) for k, one in enumerate(rows)]))
    monkeypatch.chdir(tmp_path)
    how = ("--state", "x,y", "--rate", "50", "--still", "0.01", "--group", "n")
    run("fit", "all.csv", "--differentiate", *how, "-o", "p.npz")
    run("look", "p.npz", "all.csv", *more, "-o", "look.html")
    [line] = re.findall(r'"(unconstrain fit [^"]*)","-o policy.npz"', (tmp_path / "look.html").read_text("utf-8"))
    words = [word for word in shlex.split(line) if word != "--differentiate"]
    options = dict(zip(words[3::2], words[4::2], strict=True))
    assert options == dict(zip(how[::2], how[1::2], strict=True)) | dict(zip(more[::2], more[1::2], strict=True))
    assert len(words) == 3 + 2 * len(options)
    run(*shlex.split(line)[1:], "-o", "again.npz")
    stored = [uc.storage.load_notes(one)["recipe"] for one in ("p.npz", "again.npz")]
    assert stored[1] == stored[0] | ({"window_s": 0.1, "still": 0.02} if more else {})


# What a guided policy is said to be


@pytest.mark.parametrize(("off", "kept"), [(0, True), (1, True), (2, False)])
def test_size_is_nearly_kept_where_a_quarter_is_off_at_most(off, kept):
    said, strays = verdicts.moves(np.r_[np.full(off, 1.3), np.ones(6 - off)], np.ones(6))
    assert (not strays) == kept
    assert said == ("it keeps size and pace", "it nearly keeps size and pace", "2 of 6 go round too large")[off]


@pytest.fixture(scope="module")
def rounds(tmp_path_factory):
    """Files of rounds on ovals with a dent, and a policy of them, guided or not."""
    place, now = tmp_path_factory.mktemp("rounds"), 0.02 * np.arange(400)
    for k in range(4):
        angle = 3.0 * now + k
        at = np.column_stack([0.3 * np.cos(angle), 0.2 * np.sin(angle) * (1 + 0.5 * np.cos(angle))]) * (1 + 0.02 * k)
        write(place / f"d{k}.csv", "t,x [m],y [m]", np.column_stack([now, at]))
    for name, more in (("p.npz", ()), ("g.npz", ("--guided", "cycle"))):
        run("fit", place / "*.csv", "--state", "x,y", "--by", "savgol", *more, "-o", place / name)
    return place


def test_a_guided_policy_is_headed_by_what_is_in_its_file(rounds):
    alone, guided = (json.loads(run("info", rounds / name, "--json")) for name in ("p.npz", "g.npz"))
    assert guided["explained held out"] < alone["explained held out"] - 0.005
    said, share = guided["verdict"]["said"], f"{guided['explained held out']:.0%}"
    assert f"The guided policy explains {share} of held-out motion" in said
    assert "Unguided it explains " in said
    assert "uided" not in alone["verdict"]["said"]
    missed = [round(100 * np.sqrt(1 - one["explained held out"])) for one in (alone, guided)]
    assert f"it misses {missed[1]}% of a typical action" in guided["verdict"]["trust"] or not guided["verdict"]["trust"]
    assert missed[1] > missed[0]
    certified = text(call("certify", rounds / "g.npz"))
    assert re.search(rf"is not guaranteed: .*he guided policy explains {share} of held-out motion", certified)
    assert not re.search(r"by V|\bV\b", certified)


def test_certify_proposes_the_guide_that_the_demonstrations_allow(rounds, work, tmp_path):
    assert uc.storage.load_notes(rounds / "p.npz")["can be guided to"] == "auto"
    assert "fit --guided auto'" in text(call("certify", rounds / "p.npz"))
    assert "movements go on, as on a cycle" in text(call("certify", rounds / "p.npz"))
    apart = tmp_path / "apart"  # reaches to places of their own
    apart.mkdir()
    for k, one in enumerate(sorted((work / "in ways").iterdir())):
        rows = np.loadtxt(one, delimiter=",", skiprows=1)
        write(
            apart / one.name,
            "t,x [mm],y [mm],z [mm]",
            np.column_stack([rows + np.array([0, 0.5 * k, 0]), 0.3 * rows[:, 1]]),
        )
    run("fit", apart, "--state", "x,y,z", "--by", "savgol", "--still", "0.001", "-o", tmp_path / "p.npz")
    said = text(call("certify", tmp_path / "p.npz"))
    if "guaranteed:" in said or "nothing is" in said:
        assert "GOAL: 3 numbers, of x [mm], y [mm], z [mm]." in said
        assert "--still 0.001 --guided GOAL -o guided.npz" in said
        assert "--guided auto" not in said


def test_a_score_says_on_which_recordings_it_ran(work):
    assert "un from the starts of these recordings, " in text(call("score", work / "p.npz", work / "in ways"))
    assert "un from the same starts, " in text(call("info", work / "p.npz"))


ODD = {
    "without time": ("x1,y1", slice(1, None)),
    "without head": ("", slice(None)),
    "other names": ("Zeit,tcp pos a,tcp pos b", slice(None)),
    "in milliseconds": ("time_ms,x,y", slice(None)),
    "one other": ("t,x,y", slice(None)),
    "one file": ("stroke,t,x,y", slice(None)),
}


@pytest.mark.parametrize("kind", ODD)
def test_what_inspect_proposes_runs_whatever_the_columns_are_called(tmp_path, monkeypatch, kind):
    tables = [np.loadtxt(one, delimiter=",", skiprows=1) for one in strokes(tmp_path / "plain", 1e-3, samples=80)]
    head, columns = ODD[kind]
    (tmp_path / kind).mkdir()
    monkeypatch.chdir(tmp_path)
    for k, table in enumerate(tables):
        table[:, 0] *= 1000 if kind == "in milliseconds" else 1
        own = head.replace("y", "yy") if (kind, k) == ("one other", 5) else head
        lines = [own] * bool(own) + [",".join(f"{each:.6g}" for each in row) for row in table[:, columns].tolist()]
        (tmp_path / kind / f"w{k}.csv").write_text("\n".join(lines))
    if kind == "one file":
        rows = [[f"stroke {k}", *row] for k, table in enumerate(tables) for row in table.tolist()]
        write(tmp_path / "one file.csv", head, rows)
    then = run("inspect", "one file.csv" if kind == "one file" else kind)
    [line] = [one.strip() for one in then.splitlines() if one.strip().removeprefix("Next: ").startswith("unconstrain ")]
    words = [PLACES.get(word, word) for word in shlex.split(line.removeprefix("Next: "))[1:]]
    assert call(*words).code == 0


# What all leave open comes first


def marked(tmp_path):
    """Strokes on one side that one way alone was open on, and on the other side those of one that crossed."""
    rng, files = np.random.default_rng(1), []
    for k in range(9):
        way = np.array([1.0, 0.0]) if k < 5 else np.array([np.cos(k), np.sin(k)])
        at, seen = np.array([-1.0 if k < 5 else 1.0, 0.0]) + rng.uniform(-0.4, 0.4, 2), []
        for _ in range(100):
            seen.append(at + 1e-4 * rng.standard_normal(2))
            at = at + 0.02 * np.outer(way, way) @ TURN @ (at + 0.3 * np.abs(at))
        times = 0.02 * np.arange(100)
        files.append(write(tmp_path / f"d{k}.csv", "t,x,y", np.column_stack([times, seen])))
    return files


def test_fit_and_diagnose_name_first_what_all_recordings_leave_open(tmp_path):
    files, asked = marked(tmp_path), ("--state", "x,y", "--by", "savgol")
    regions = json.loads(run("diagnose", *files, *asked, "--json"))["regions"]
    order = [(one["together"] >= 0.7, -one["along"]) for one in regions]
    assert order == sorted(order)
    assert sorted(order, key=lambda one: one[1]) != order  # as by the spread alone
    x, y = regions[0]["state"]
    assert regions[0]["together"] < 0.7
    said = text(call("fit", *files, *asked, "-o", tmp_path / "p.npz"))
    assert f"near (x = {x:.3g}, y = {y:.3g}), where '{regions[0]['demonstration']}' passed" in said


def test_what_is_said_of_a_fit_holds_no_share_that_nobody_can_act_on(tmp_path):
    files = strokes(tmp_path / "a", 1e-3)
    assert "always held" not in text(call("fit", *files, *FREE, "-o", tmp_path / "p.npz"))
    said = text(call("diagnose", *files, *FREE))
    shares = re.search(r"Of the samples (\d+)% look free \(nothing that .*\), (\d+)% held(?:, and of (\d+)%)?", said)
    assert sum(int(one or 0) for one in shares.groups()) == 100


# Units


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_a_file_that_says_another_unit_is_to_be_converted(tmp_path, unit):
    files = strokes(tmp_path / "a", 1e-3)
    other = files[3].read_text().replace("[m]", f"[{unit}]")
    files[3].write_text(other)
    ran = call("fit", *files, *FREE, "-o", tmp_path / "p.npz")
    assert ("d3.csv has 'x [mm]', not 'x [m]' as the others" in text(ran)) == (unit == "mm")
    assert (ran.code == 0) == (unit == "m")
    said = text(call("inspect", *files, *FREE[:4]))
    assert ("another unit; convert it." in said) == (unit == "mm")
    assert "Did you mean" not in said + text(ran)


@pytest.mark.parametrize("times", [1.0, 1e-3])
def test_units_that_differ_are_said_before_how_much_is_explained(tmp_path, times):
    files = strokes(tmp_path / "a", 1e-3)
    table = np.loadtxt(files[3], delimiter=",", skiprows=1)
    write(files[3], "t,x [m],y [m]", table * [1.0, times, times])
    verdict = json.loads(run("fit", *files, *FREE, "-o", tmp_path / "p.npz", "--json"))["verdict"]
    assert verdict["said"].startswith("Recordings are not all in one unit") == (times != 1.0)
    assert verdict["mark"] != "good" or times == 1.0


@pytest.mark.parametrize(("name", "more"), [("j{}_deg", ()), ("j{}_deg", ("--degrees", "j1_deg,j2_deg")), ("j{}", ())])
def test_joints_that_are_left_in_degrees_are_said_to_be(tmp_path, name, more):
    named = [name.format(k) for k in (1, 2)]
    files = strokes(tmp_path / "a", 1e-3)
    for one in files:
        one.write_text(one.read_text().replace("x [m],y [m]", ",".join(named)))
    ran = text(call("fit", *files, "--state", ",".join(named), *FREE[2:], *more, "-o", tmp_path / "p.npz"))
    assert ("j1_deg, j2_deg left in degrees" in ran) == (name == "j{}_deg" and not more)


# Numbers of trials


@pytest.mark.parametrize("name", ["versuch", "t2"])
def test_the_number_of_a_trial_is_no_state_and_tells_trials_apart(tmp_path, name):
    tables = [np.loadtxt(one, delimiter=",", skiprows=1) for one in strokes(tmp_path / "a", 1e-3, samples=60)]
    rows = [[k + 1 if name == "versuch" else row[1], *row, row[1] + 1] for k, one in enumerate(tables) for row in one]
    file = write(tmp_path / "all.csv", f"{name},t,j1_deg,j2_deg,volt", rows)
    said = text(call("inspect", file))
    assert ("--group versuch" in said) == (name == "versuch")
    assert "--state j1_deg,j2_deg " in said
    held = [[*row[1:4], 0.0] for row in rows]
    assert "--group" not in text(call("inspect", write(tmp_path / "held.csv", "t,j1_deg,j2_deg,flag", held)))


# Roll-outs among recordings


@pytest.mark.parametrize("others", ["recorded", "rolled out"])
def test_a_movement_that_was_rolled_out_is_not_learnt_from_without_a_word(tmp_path, others):
    files = strokes(tmp_path / "a", 1e-3)
    run("fit", *files, *FREE, "-o", tmp_path / "p.npz")
    rolled = tmp_path / "roll.csv"
    call("rollout", tmp_path / "p.npz", "--start", "0.25,0.1", "-o", rolled)
    table = np.loadtxt(rolled, delimiter=",", skiprows=1)
    copies = [
        write(tmp_path / f"r{k}.csv", "t,x [m],y [m],vx [m/s],vy [m/s]", table * [1, *[1.2 + k / 9] * 4])
        for k in range(5)
    ]
    files = files if others == "recorded" else copies
    ran = json.loads(run("fit", *files, rolled, *FREE[:4], "-o", tmp_path / "q.npz", "--json"))["verdict"]
    assert ("A movement that was rolled out is learnt from" in ran["said"]) == (others == "recorded")
    said = text(call("inspect", *files, rolled, *FREE[:4]))
    assert ("--leave-out roll" in said) == (others == "recorded")
    assert "rolled-out" not in text(call("inspect", *files, *FREE[:4]))


# Exports


@pytest.mark.parametrize(
    ("names", "kind"),
    [("tcp_along,tcp_across,tcp_up", "pose"), ("q1,q2,q3", "joints"), ("a_deg,b_deg,c_deg", "joints")],
)
def test_a_package_says_what_its_messages_hold_and_what_is_to_be_set(tmp_path, names, kind):
    states = names.split(",")
    unit = "" if "deg" in names else "mm"
    rng, files = np.random.default_rng(0), []
    for k in range(4):
        path = rng.uniform(-9, 9, 3) * np.exp(-0.05 * np.arange(60))[:, None]
        head = ",".join(f"{name} [{unit}]" if unit else name for name in states)
        files.append(write(tmp_path / f"w{k}.csv", f"t,{head}", np.column_stack([0.05 * np.arange(60), path])))
    run("fit", *files, "--state", names, "--by", "savgol", "--model", "affine", "-o", tmp_path / "p.npz")
    said, readme = text(call("export", tmp_path / "p.npz", "--ros2", tmp_path / "ros")), tmp_path / "ros" / "README.md"
    page = " ".join(readme.read_text("utf-8").split())
    assert f"messages: {kind} (" in said
    assert ("as x, y, z; --messages joints" in said) == (kind == "pose")
    assert ("to the robot's own names" in said) == (kind == "joints")
    assert ("Set `joints` to the names of the robot's own joints" in page) == (kind == "joints")
    assert "such as [elbow_joint, wrist_joint]" in page or kind == "pose"


def test_an_export_repeats_the_verdict_of_its_policy_and_what_to_do_first(tmp_path):
    bad, good = marked(tmp_path), strokes(tmp_path / "b", 1e-4, held=False)
    for files in (bad, good):
        ways = ("--state", "x,y", "--by", "savgol") if files is bad else FREE
        run("fit", *files, *ways, "-o", tmp_path / "p.npz", "--force")
        mark = json.loads(run("info", tmp_path / "p.npz", "--json"))["verdict"]["mark"]
        assert (mark == "bad") == (files is bad)
        said = text(call("export", tmp_path / "p.npz", "--ros2", tmp_path / "r", "-o", tmp_path / "p.c", "--force"))
        page = " ".join((tmp_path / "r" / "README.md").read_text("utf-8").split())
        head = " ".join((tmp_path / "p.h").read_text("utf-8").replace("*", "").split())
        assert ("It is not to be trusted as it is" in said) == (mark == "bad")
        for one in (page, head):
            assert f"verdict: {mark}. " in one
            assert "Do not trust: States far from all data" in one
            assert "run from the same starts: " not in one


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("model", ["local", "rbf", "quadratic"])
def test_the_graph_gives_the_support_of_each_state(tmp_path, model, single):
    files, rng = strokes(tmp_path / "a", 1e-3), np.random.default_rng(0)
    run("fit", *files, *FREE[:4], "--model", model, "--learner", "direct", "-o", tmp_path / "p.npz")
    call("export", tmp_path / "p.npz", "-o", tmp_path / "p.onnx", *["--float"] * single)
    graph = onnxruntime.InferenceSession(tmp_path / "p.onnx", providers=["CPUExecutionProvider"])
    states = np.vstack([rng.uniform(-0.4, 0.4, (50, 2)), [[1000.0, 1000.0]]]).astype(
        np.float32 if single else np.float64
    )
    [found] = graph.run(["support"], {"states": states})
    expected = uc.load(tmp_path / "p.npz", uc.Policy).closed_form().support(states)
    assert found.shape == (51,)
    assert found.dtype == states.dtype
    np.testing.assert_allclose(found, expected, atol=1e-4 if single else 1e-9)
    assert found[-1] == 0.0 < found.max()


# Pages


def test_pages_are_called_by_what_they_are_and_lead_on(tmp_path):
    files = strokes(tmp_path / "a", 1e-3, samples=60)
    run("fit", *files, *FREE, "-o", tmp_path / "p.npz", "--report", tmp_path / "f.html")
    run("diagnose", *files, *FREE, "-o", tmp_path / "d.html")
    titles = [re.search("<title>(.*?)</title>", (tmp_path / one).read_text("utf-8"))[1] for one in ("f.html", "d.html")]
    assert titles[0].startswith("The policy p")
    assert titles[1].startswith("Diagnosis of d0.csv")
    for more in ((), (tmp_path / "p.npz",)):
        run("look", *files, *more, *FREE[:4], "-o", tmp_path / "l.html", "--force")
        page = (tmp_path / "l.html").read_text("utf-8")
        assert ("Tilt the plane, and begin at the next start" in page) == bool(more)
        assert ("Leave out what should not be learnt from" in page) == (not more)
        assert "What looks odd" not in page


# What is said is so


@pytest.mark.parametrize(
    ("rate", "said"), [(0.03, "it slows down towards it; about 32 more --steps"), (0.0, "it rests")]
)
def test_what_still_comes_nearer_to_a_goal_is_not_said_to_rest(rate, said):
    far = 0.5 * np.exp(-rate * np.arange(100.0))
    states, actions = np.column_stack([far, 0.0 * far]), np.column_stack([-rate * far, 0.0 * far])
    actions[0] = 10.0
    moving = SimpleNamespace(aim_=object.__new__(uc.motion.descent.Descent), goal_=np.zeros(2))
    ends = rolling._off_goal(moving, uc.Demonstration(states, actions), "", "m")
    assert ends.startswith(f" It ends {far[-1]:.3g} m from the goal: {said}")


def test_a_score_says_that_recordings_leave_where_the_policy_was_learnt_if_it_misses_there(work, tmp_path):
    run("fit", work / "in ways", *FREE[:4], "-o", tmp_path / "p.npz")
    times, ahead = 0.02 * np.arange(150), np.linspace(0.0, 1.0, 150)
    rows = np.column_stack([times, 0.6 + ahead, 0.7 + 0.5 * ahead])
    away = write(tmp_path / "away.csv", "t,x [m],y [m]", rows)
    said = text(call("score", tmp_path / "p.npz", away))
    assert "as these recordings leave where it was learnt, at 100% of their samples." in said
    assert "Next: Demonstrate where they go, too" in said
    assert "leave where it was learnt" not in text(call("score", tmp_path / "p.npz", work / "new"))


def test_what_is_missed_of_whole_demonstrations_is_in_the_headline():
    found, little, plain = (verdicts.of_explained(0.995, 8, left_out=share) for share in (0.66, 0.05, 0.0))
    alike = "if one model holds for all; where demonstrations that were held alike are left out together, it explains"
    much = f"{alike} 34% of them"
    assert found.said.endswith(f"{much}: good along recorded motion, and no further.")
    none = verdicts.of_explained(0.995, 8, 0.36, left_out=1.2).said
    assert none.startswith("Recordings tell too little: ")
    assert f"{alike} nothing of them: good along recorded" in none
    assert none.count("too little") == 1
    assert little.said.endswith("if one model holds for all: good.")
    assert [one.mark.name for one in (found, little)] == ["DOUBTFUL", "GOOD"]
    assert "held-out" not in found.said
    assert plain.said == "The policy explains >99% of held-out motion: good."


def test_an_export_says_in_short_what_fit_said(work, tmp_path):
    said = text(call("export", work / "p.npz", "-o", tmp_path / "p.c"))
    assert (
        "('unconstrain info' says all.) Do not trust: States far from all data, where its support is near 0. N" in said
    )
    assert "Trust: Directions" not in said
    assert "Trust: Directions" in text(call("info", work / "p.npz"))


def test_of_a_surface_it_is_said_that_positions_alone_are_learnt_from_and_why_of_that_form(work, tmp_path):
    asked = "constraint", work / "in ways" / "d1.csv", *FREE[:4], "-o", tmp_path / "c.npz", "--force"
    said, told = text(call(*asked, "--surface")), json.loads(run(*asked, "--surface", "--json"))
    assert "Learnt from x [m], y [m] alone, as positions on a surface." in said
    assert "alone, as positions" not in text(call(*asked))
    shares = told["candidates"]
    assert ("Taken: " in said) == (shares[told["features"]] > min(shares.values()))


def test_a_table_without_lengths_has_no_caption_about_them():
    states = np.random.default_rng(0).uniform(-1, 1, (60, 3)) * [1.0, 1.0, 0.0]
    held = uc.LearntConstraint("constant").fit(states, np.roll(states, 1, axis=0) - states)
    for head, cell in ((("demonstration", "angle"), "3.1°"), (("demonstration", "radius"), "0.2 m")):
        rows = [["a", cell]]
        page = constraint_page([held], [uc.Demonstration(states, states)], "A", None, (), (head, rows))
        assert ("Lengths in the unit of the columns" in page) == ("radius" in head)
        assert "95 % intervals" not in page

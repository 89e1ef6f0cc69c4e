"""What commands say to who has only the documentation: figures that agree, and commands that can be copied."""

import html
import json
import re
import shlex
from dataclasses import replace

import numpy as np
import pytest

import unconstrain as uc
from test_cli import call, run, write
from test_newcomer import text
from unconstrain.evaluation import diagnosis, metrics, verdicts
from unconstrain.evaluation.diagnosis import places

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
            r"misses (<?\d+)% of a typical action( \(noise in the recorded actions alone: (\d+)% or mor)?", one
        )
        assert bool(found[2]) == (noise > 0)
        if noise:
            assert 0.5 * int(found[1]) <= int(found[3]) <= int(found[1])
    alone = json.loads(run("fit", *files[:5], *FREE, "-o", tmp_path / "p.npz", "--force", "--json"))["noise_alone"]
    assert (alone > 0.03) == (noise > 0)


def test_what_is_far_more_than_is_missed_is_not_called_noise():
    """Constraints that change at every sample look like noise by differences in time."""
    assert verdicts.misses(0.99, 0.5) == "misses 10% of a typical action"
    assert verdicts.misses(0.99, 0.11).endswith("(noise in the recorded actions alone: 10% or more)")
    assert verdicts.misses(0.99, 0.001) == "misses 10% of a typical action"


# Places to record that are apart


def test_places_that_are_nearly_one_are_one_row(tmp_path):
    files = strokes(tmp_path / "a", 1e-3)
    asked = ("diagnose", *files, *FREE[:4])
    regions = json.loads(run(*asked, "--json"))["regions"]
    assert [one["along"] for one in regions] == sorted((one["along"] for one in regions), reverse=True)
    said, every = (run(*asked, *more).partition("largest first:\n")[2].partition("told:")[0] for more in ((), ("-v",)))
    states = np.array([one["state"] for one in regions])
    rows = [[float(each) for each in line.split()[:2]] for line in said.splitlines()[3:] if line.strip()]
    apart = np.abs(np.subtract.outer(rows, rows).diagonal(0, 1, 3)) / np.ptp(states, axis=0)
    assert 2 <= len(rows) < len([line for line in every.splitlines()[3:] if line.strip()]) == len(regions)
    near = (apart.max(axis=2) < 0.09)[np.triu_indices(len(rows), 1)]
    ways = [[float(each) for each in line.split()[-3:-1]] for line in said.splitlines()[3:] if line.strip()]
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
    assert ("; none more than 20% off" in told) == (last < 1.2)
    assert ("; more than 20% off: last round over first of 1 of 4" in told) == (last > 1.2)


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
        assert len(there) <= 1
        words = [PLACES.get(word, word) for word in shlex.split(line)[1:]]
        ran = call(*words)
        assert ran.code in (0, 3), (line, ran.err)


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

"""What is said of numbers: signs and words agree, and nothing is claimed that data cannot tell."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

import unconstrain as uc
from samples import PLATES, off_everywhere, on_plates, turning
from seen import below
from unconstrain import cli
from unconstrain.base.errors import InvalidDataError
from unconstrain.evaluation import diagnosis, verdicts
from unconstrain.evaluation.marks import FAIR, GOOD, Mark
from unconstrain.recordings import Recording

shares = st.floats(-1.0, 1.0)


def call(*args):
    return CliRunner().invoke(cli.main, list(map(str, args)), prog_name="unconstrain")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three recordings of one swing, what was learnt from them, and what held one of them."""
    folder = tmp_path_factory.mktemp("judged")
    times = np.arange(0.0, 2.0, 0.05)
    for number in range(3):
        states = np.column_stack([np.cos(times + number), np.sin(times + number)]) + 0.1 * number
        table = np.column_stack([times, states, -states[:, 1], states[:, 0]])
        np.savetxt(folder / f"swing_{number}.csv", table, delimiter=",", header="t,x,y,vx,vy", comments="")
    files = sorted(folder.glob("*.csv"))
    learnt = call("fit", *files, "--model", "affine", "-o", folder / "p.npz", "--json")
    assert learnt.exit_code == 0, learnt.stderr
    (folder / "fit.json").write_text(learnt.stdout)
    assert call("constraint", files[0], "-o", folder / "c.npz").exit_code == 0
    return folder


class TestMarks:
    @given(shares, st.integers(diagnosis.ENOUGH, 20))
    def test_a_sign_goes_with_its_word(self, share, count):
        for found in (verdicts.of_explained(share, count), verdicts.of_score(share, count)):
            word = {Mark.GOOD: "good", Mark.DOUBTFUL: "fair", Mark.BAD: "poor"}[found.mark]
            assert found.said.endswith(f": {word}.")
            assert found.lines()[0].startswith(found.mark.value)

    @given(shares, shares)
    def test_a_score_is_as_good_as_the_worse_of_what_is_known(self, share, under):
        found, alone = verdicts.of_score(share, 9, under), verdicts.of_score(min(share, under), 9)
        assert (found.mark, found.said.split(": ")[-1]) == (alone.mark, alone.said.split(": ")[-1])
        assert "--plane" not in found.doubt

    def test_how_many_directions_were_held_is_a_bound_where_demonstrations_disagree(self):
        def held(rank, wound=None):
            known = {"doubts": (), "lacking": (), "several": True, "one_way": False, "wound": wound}
            return SimpleNamespace(rank_=rank, choice_=SimpleNamespace(held_out=0.01, actions=4, **known))

        sure, unsure = verdicts.of_constraint(held(1), held(1)), verdicts.of_constraint(held(3), held(1), held(2))
        assert sure.said.startswith("1 of 4 directions were held, others in each of 2 demonstrations; ")
        assert unsure.said.startswith(
            "At most 1 of 4 directions were held, others in each of 3 demonstrations (in some up"
        )
        assert (sure.mark, unsure.mark) == (Mark.GOOD, Mark.DOUBTFUL)
        alone = held(1)
        assert verdicts.of_constraint(alone, shown=False).mark is Mark.DOUBTFUL
        alone.choice_.several, alone.choice_.one_way = False, True
        alike, known = verdicts.of_constraint(alone), verdicts.of_constraint(alone, shown=True)
        assert (alike.mark, alike.said[:40]) == (Mark.DOUBTFUL, "Whether anything was held cannot be told")
        assert known.said.startswith("1 of 4 directions were held")
        little = verdicts.of_constraint(held(1, False), held(1, False))
        assert (little.mark, little.said[:40]) == (Mark.DOUBTFUL, "Whether anything was held cannot be told")
        assert verdicts.of_constraint(held(1, True), held(1, True)) == sure
        assert verdicts.of_constraint(held(1, False)).mark is Mark.GOOD  # several tell it together
        assert "'diagnose' compares several with one policy, which may tell that they were held." in alike.next
        assert "by one demonstration alone" in alike.said
        assert "alone" not in little.said + little.next
        both = verdicts.of_constraint(alone, alone, shown=True)
        assert ["from several" in one.next for one in (known, both)] == [True, False]

    def test_one_constraint_for_all_is_supposed_where_much_moves_along_it(self):
        for missed, much in ((0.12, True), (0.02, False)):
            known = {"doubts": (), "lacking": (), "several": True, "one_way": False, "wound": None}
            choice = SimpleNamespace(held_out=missed, actions=2, **known)
            found = verdicts.of_constraint(SimpleNamespace(rank_=1, choice_=choice))
            assert found.said.startswith("If one constraint held all: 1 of 2 directions were held;") == much
            assert found.next.startswith("Learn it of each alone" if much else "Use it with --constraint")

    def test_a_bad_recording_is_not_hidden_by_many_good_ones(self):
        good, usual = verdicts.of_score(0.97, 20), {f"a_{number}": 0.98 for number in range(18)}
        found = verdicts.of_worst(good, usual | {"bad": 0.2, "worse": -3.0})
        assert (good.mark, found.mark) == (Mark.GOOD, Mark.DOUBTFUL)
        assert "But it misses 'worse' alone by more than that motion itself, and 'bad' little better." in found.said
        assert "But it explains 20% of 'bad' alone." in verdicts.of_worst(good, usual | {"bad": 0.2}).said
        assert verdicts.of_worst(good, usual | {"fair": 0.75}) == good
        assert verdicts.of_worst(good, dict.fromkeys("abcd", 0.5)) == good  # none is worse than the others

    def test_a_command_that_comes_next_can_be_copied(self):
        command = f"unconstrain fit {'a  b ' * 30}-o policy.npz"
        for text in (command, f"{'Read the notes. ' * 9}Then:\n{command}"):
            *prose, last = verdicts.Verdict(Mark.GOOD, "said", next=text).lines()
            assert last.strip().removeprefix("Next: ") == command
            assert max(map(len, prose)) <= 80

    @given(shares, shares)
    def test_who_explains_more_is_not_judged_worse(self, one, other):
        order = [Mark.BAD, Mark.DOUBTFUL, Mark.GOOD]
        less, more = (order.index(verdicts.of_explained(share, 5).mark) for share in sorted((one, other)))
        assert less <= more

    @pytest.mark.parametrize(("share", "mark"), [(GOOD, Mark.GOOD), (FAIR, Mark.DOUBTFUL), (0.69, Mark.BAD)])
    def test_thresholds_are_those_that_are_written_down(self, share, mark):
        assert verdicts.of_explained(share, 5).mark is mark

    @given(shares, st.integers(0, diagnosis.ENOUGH - 1))
    def test_fewer_than_three_demonstrations_give_no_verdict(self, share, count):
        found = verdicts.of_explained(share, count)
        assert found.mark is Mark.DOUBTFUL
        assert "no verdict" in found.said
        assert not any(word in found.said for word in ("good", "fair", "poor"))
        assert "of the recorded states" not in verdicts.of_explained(share, count, 0.5).doubt
        said = "at 50% of the recorded states no recording tells"
        found = verdicts.of_explained(share, 3, 0.5)
        share = round(share, 2)  # as it is said
        assert said in (found.said if share >= FAIR else found.doubt)
        assert found.said.startswith("Recordings tell too little: " if share >= FAIR else "The policy ")
        assert "at 15% of the recorded states no recording tells" in verdicts.of_explained(share, 3, 0.85).doubt

    @given(st.text(max_size=300), st.text(max_size=300))
    def test_lines_fit_a_terminal_and_say_everything(self, said, trust):
        lines = verdicts.Verdict(Mark.GOOD, f"a {said}", trust).lines()
        assert "".join(said.split()) in "".join("".join(lines).split())
        assert all(len(line) <= 80 for line in lines)


class TestSupport:
    def test_a_movement_near_all_data_is_supported(self):
        assert verdicts.of_support(np.ones(3), np.arange(3.0)).mark is Mark.GOOD

    def test_where_support_ends_is_said_in_seconds(self):
        found = verdicts.of_support(np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.5, 1.0]))
        assert (found.mark, found.trust) == (Mark.DOUBTFUL, "")  # what is near may be far off
        assert found.doubt == "All from 1.00 s on: where none passes, and after it."
        told = verdicts.of_support(np.ones(3), np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.4, 0.0]))
        assert told.doubt == "Directions that fewer than 3 demonstrations tell, from 0.50 s on."
        small = verdicts.of_support(np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.5, 1.0]), np.zeros(3))
        ended = verdicts.of_early_end(small, "It stops. Go on.")
        assert (ended.trust, ended.next) == ("The first 1.00 s.", "Go on.")
        assert ended.said.startswith("It stops. No demonstration passes near for 33% of the time, first at 1.00 s")

    @pytest.mark.parametrize(
        ("rows", "least", "mark", "begins", "doubt"),
        [
            ([0, 1], 0.5, Mark.GOOD, "Near demonstrations for all 399.00 s but the first 2 s: supported.", ""),
            ([0, 1], 0.0, Mark.DOUBTFUL, "No demonstration passes near for", "Where none passes (first at 0.00 s)."),
            ([200], 0.5, Mark.DOUBTFUL, "No demonstration passes near for", "Where none passes (first at 200.00 s)."),
            (range(20), 0.5, Mark.DOUBTFUL, "No demonst", "Where none passes (first at 0.00 s)."),
            (range(99, 199), 0.5, Mark.DOUBTFUL, "No", "All from 99.00 s on: where none passes, and after it."),
            ([399], 0.5, Mark.DOUBTFUL, "No", "All from 399.00 s on: where none passes, and after it."),
        ],
    )
    def test_a_moment_far_from_demonstrations_does_not_spoil_all_that_comes_after(
        self, rows, least, mark, begins, doubt
    ):
        support = np.ones(400)
        support[list(rows)] = least
        found = verdicts.of_support(support, np.arange(400.0))
        assert (found.mark, found.doubt) == (mark, doubt)
        assert found.said.startswith(begins)

    def test_how_far_a_movement_may_be_off_is_said_of_its_middle(self):
        for off, said in (([0.0, 0.3, 0.3, 30.0], "about 30% of"), ([9.0, 9.0, 9.0, 10.0], "as much as")):
            found = verdicts.of_support(np.ones(4), np.arange(4.0), np.array(off))
            assert (
                f"all coordinates together, may be off by {said} its typical one on this way, a standard" in found.said
            )
            assert found.said.endswith("most at 3.00 s.")

    def test_a_run_through_the_middle_of_a_circle_is_where_nobody_was(self, tmp_path):
        turn = np.linspace(0.0, 2 * np.pi, 200)
        states, actions = (np.column_stack([a(turn), b(turn)]) for a, b in ((np.cos, np.sin), (np.sin, np.cos)))
        policy = uc.LocallyLinearPolicy(learner="direct").fit(states, actions * [-1.0, 1.0])
        uc.save(policy, tmp_path / "p.npz", {"determined share of states": 1.0})
        said = " ".join(call("info", tmp_path / "p.npz").stdout.split())
        assert "not run from its starts yet; 'unconstrain score' does" in said
        for start, sign in (("1,0", "✔ Near demonstrations for all"), ("0.1,0", "! No demonstration passes near for")):
            ran = call("rollout", tmp_path / "p.npz", "--start", start, "--steps", 20)
            assert ran.stderr.startswith(sign)


class TestInfo:
    def told(self, path):
        return json.loads(call("info", path, "--json").stdout)

    def test_a_policy_says_what_it_is(self, folder):
        told = self.told(folder / "p.npz")
        assert told["states"] == ["x", "y"]
        assert told["sources"] == ["swing_0.csv", "swing_1.csv", "swing_2.csv"]
        assert (told["holds"], told["learner"], told["centring"]) == ("ParametricPolicy", "Robust", "none")
        assert told["date"].endswith("+00:00")

    def test_names_come_with_their_units(self, tmp_path):
        policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [2.0]])
        notes = {"recipe": uc.Recipe(("x",), None, "savgol").to_dict(), "units": {"x": "mm"}}
        uc.save(policy, tmp_path / "p.npz", notes)
        told = self.told(tmp_path / "p.npz")
        assert (told["states"], told["actions"]) == (["x (mm)"], ["vx (mm/s)"])

    def test_so_does_a_constraint(self, folder):
        told = self.told(folder / "c.npz")
        assert (told["holds"], told["held"]) == ("LearntConstraint", "1 of 2 directions")
        assert told["sources"] == ["swing_0.csv"]

    def test_a_person_reads_a_verdict_first(self, folder):
        said = call("info", folder / "p.npz").stdout
        assert "swing_2.csv" in below(said)

    def test_a_policy_of_python_says_what_it_can(self, tmp_path):
        uc.save(uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [2.0]]), tmp_path / "p.npz")
        assert self.told(tmp_path / "p.npz")["learner"] == "direct"
        uc.save(uc.ParametricPolicy(), tmp_path / "q.npz")
        assert call("info", tmp_path / "q.npz").stdout.startswith("✖ Not fitted: it cannot predict.")

    def test_what_is_no_policy_is_refused(self, folder):
        ran = call("info", folder / "swing_0.csv")
        assert (ran.exit_code, ran.stdout) == (2, "")
        assert "swing_0.csv: is a recording, not a policy. " in ran.stderr


@pytest.mark.parametrize(("told", "mark"), [(0.79, "!"), (0.81, "✔"), (None, "✔")])
def test_a_check_mark_takes_states_that_recordings_tell(folder, tmp_path, told, mark):
    """Of strokes whose policy was off by less than a tenth at least 0.9 were told, of others 0.71."""
    states = np.random.default_rng(0).uniform(-1, 1, (90, 2))
    learnt = uc.ParametricPolicy(uc.Affine(), "direct").fit(states, -states, groups=np.repeat([0, 1, 2], 30))
    uc.save(learnt, tmp_path / "p.npz", {"determined share of states": told})
    said = " ".join(call("info", tmp_path / "p.npz").stdout.split())
    assert said.startswith(mark)
    lead = "! Recordings tell too little: at 21% of the recorded states no recording tells the policy in some direction"
    lead += ", for this model."
    assert said.startswith(lead) == (mark == "!")
    assert ("'unconstrain diagnose' says what to record." in said) == (mark == "!")


def test_what_explains_fairly_and_is_not_told_is_no_use():
    found = verdicts.of_explained(0.8, 24, 0.0, "Record more there.")
    assert (found.mark, found.next) == (Mark.BAD, "Record more there.")
    assert verdicts.of_explained(0.1, 24, 0.0).said == "The policy explains 10% of held-out motion: poor."
    assert found.said.startswith("Recordings tell too little: at 100% of the recorded states")
    assert verdicts.of_explained(0.8, 24, 0.75).mark is verdicts.of_explained(0.8, 24, 1.0).mark is Mark.DOUBTFUL
    assert verdicts.of_explained(0.95, 24, 0.0).mark is Mark.DOUBTFUL
    assert verdicts.of_score(0.8, 5, 0.8, told=0.0).mark is Mark.DOUBTFUL  # judged under what held it


def test_fit_and_score_agree_on_a_policy_that_is_not_told_across(folder, tmp_path):
    rows = (folder / "swing_0.csv").read_text().splitlines()[:-1]  # not quite what was learnt from
    again = (tmp_path / "again.csv").write_text("\n".join(rows)) and tmp_path / "again.csv"
    said = json.loads(call("score", folder / "p.npz", again, "--json").stdout)["verdict"]
    assert said["mark"] == "doubtful"
    assert "held-out motion: good along the motion, but across it" in said["said"]
    assert verdicts.of_score(1.0, 5, told=0.5).mark is Mark.DOUBTFUL
    assert verdicts.of_score(1.0, 5, told=0.9).mark is Mark.GOOD
    under = verdicts.of_score(1.0, 5, 0.95, told=0.5)  # which says nothing of other constraints
    assert under.mark is Mark.DOUBTFUL
    assert ": good under this one, but of movement under others recordings tell too little." in under.said
    assert "under other constraints: at 50% of the recorded states no recording tells the policy" in under.doubt
    assert verdicts.of_score(1.0, 5, 0.95, told=0.96).mark is Mark.GOOD


@pytest.mark.parametrize(("tilts", "mark"), [((0.0,) * 6, "doubtful"), ((0.0, 0.6, -0.6, 0.4, -0.4, 0.2), "good")])
def test_a_score_stands_as_well_with_the_plane_as_without_and_as_the_policy_is(tmp_path, tilts, mark):
    times, rng = np.arange(0.0, 3.0, 0.05), np.random.default_rng(1)
    true = np.array([[-1.0, 0.8, 0.0], [-0.8, -1.0, 0.0], [0.0, 0.0, -1.2]])
    for number, tilt in enumerate((*tilts, 0.0)):  # the last is scored on
        normal = np.array([np.sin(tilt) * np.cos(number), np.sin(tilt) * np.sin(number), np.cos(tilt)])
        slides, start = (np.eye(3) - np.outer(normal, normal)) @ true, rng.uniform(-1, 1, 3)
        path = np.array([expm(slides * time) @ start for time in times]) + rng.normal(0, 2e-4, (60, 3))
        table = np.column_stack([times, path])
        np.savetxt(tmp_path / f"w{number}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    files = [tmp_path / f"w{number}.csv" for number in range(6)]
    assert call("fit", *files, "--model", "affine", "-o", tmp_path / "p.npz").exit_code == 0
    asked = ("score", tmp_path / "p.npz", tmp_path / "w6.csv", "--json")
    assert [json.loads(call(*asked, *more).stdout)["verdict"]["mark"] for more in ((), ("--plane", "0,0,1"))] == [
        mark
    ] * 2
    states = rng.uniform(-1, 1, (200, 3))
    missed = ((uc.load(tmp_path / "p.npz")(states) - states @ true.T) ** 2).sum() / ((states @ true.T) ** 2).sum()
    assert (missed < 0.05) == (mark == "good")


@pytest.mark.parametrize(("times", "said"), [(1000, "metres"), (1 / 900, "metres"), (60, "degrees"), (1, ""), (9, "")])
def test_recordings_in_another_unit_are_called_so(folder, tmp_path, times, said):
    table = np.loadtxt(folder / "swing_0.csv", delimiter=",", skiprows=1) * [1.0, *[times] * 4]
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="t,x,y,vx,vy", comments="")
    found = json.loads(call("score", folder / "p.npz", tmp_path / "a.csv", "--json").stdout)["verdict"]
    assert found["said"].startswith("Recordings are ") == bool(said)
    assert said in found["said"]


def test_a_guided_policy_is_judged_by_what_guiding_leaves():
    good, spoilt = (verdicts.of_explained(0.96, 5, learnt=0.99, lost=lost) for lost in (0.02, 0.1))
    alone = "Unguided it explains 96%, and misses 20% of a typical action; what guiding takes is of what it was fitted "
    alone += "to, and says nothing of new starts."
    assert good.said == f"The guided policy explains 94% of held-out motion: good. {alone}"
    assert spoilt.said == f"The guided policy explains 86% of held-out motion: fair. {alone}"
    assert "it misses 24% of a typical action" in good.trust
    assert (good.mark, spoilt.mark) == (Mark.GOOD, Mark.DOUBTFUL)
    assert "--guided" not in good.next
    assert spoilt.next.startswith("Fit without --guided")
    assert verdicts.of_explained(0.96, 2, lost=0.1).said.endswith(alone)
    for share in (0.95, 0.8, 0.3):  # guides were fitted to what they explain
        for lost in (0.0, 0.004):
            found, alone = verdicts.of_explained(share, 5, lost=lost), verdicts.of_explained(share, 5)
            assert "Unguided it explains about as much;" in found.said
            assert found.mark is alone.mark
            assert "uided" not in alone.said


@pytest.mark.parametrize("share", [0.8949, 0.8951, 0.8998, 0.9, 0.6951, 0.6949])
def test_words_agree_with_the_figures_beside_them(share):
    said, word = verdicts.of_explained(share, 5).said.split()[2:4], verdicts.of_explained(share, 5).said.split()[-1]
    figure = int(said[1].rstrip("%"))
    assert word == ("good." if figure >= 90 else "fair." if figure >= 70 else "poor.")
    assert verdicts.of_score(share, 5).said.split()[-1] == word


def test_what_is_missed_by_more_than_all_is_said_in_words_with_a_cause():
    for found in (verdicts.of_explained(-2.4, 5), verdicts.of_score(-2.4, 5), verdicts.of_score(-9.0, 5, -9.0)):
        assert "misses held-out motion by more than that motion itself" in found.said
        assert "%" not in found.said
    assert "units may be wrong" in verdicts.of_explained(-2.4, 5, learnt=0.5).next
    assert "go where no other does" in verdicts.of_explained(-2.4, 5, learnt=0.95).next


def test_score_names_the_recording_that_is_explained_far_worse(folder, tmp_path):
    table = np.loadtxt(folder / "swing_1.csv", delimiter=",", skiprows=1)
    against = np.column_stack([table[:, :3], -table[:, 3:]])
    np.savetxt(tmp_path / "against.csv", against, delimiter=",", header="t,x,y,vx,vy", comments="")
    others = [tmp_path / f"swing_{number}.csv" for number in range(3)]
    for other in others:  # not quite what was learnt from
        other.write_text("\n".join((folder / other.name).read_text().splitlines()[:-1]))
    said = " ".join(call("score", folder / "p.npz", *others, tmp_path / "against.csv").stdout.split())
    assert "it misses 'against' alone by more than that motion itself" in said
    assert " alone" not in call("score", folder / "p.npz", *others).stdout


def test_a_fit_tells_programs_what_it_tells_people(folder):
    told = json.loads((folder / "fit.json").read_text())
    assert told["verdict"]["mark"] == "doubtful"  # one circle three times: nothing was seen across it
    assert told["verdict"]["said"].endswith(
        "motion: good along the motion, but across it recordings tell too little. Run from the same starts, it keeps "
        "size."
    )
    assert told["held_out"] == pytest.approx(1.0, abs=1e-6)
    assert (told["demonstrations"], told["samples"]) == (3, 120)
    assert told["policy"].endswith("p.npz")


@pytest.mark.parametrize("name", ["p.pkl", "p.PICKLE", "p.joblib"])
def test_nothing_is_written_as_a_pickle(folder, name):
    ran = call("fit", folder / "swing_0.csv", "-o", folder / name)
    assert (ran.exit_code, (folder / name).exists()) == (2, False)
    assert "name it .npz" in ran.stderr


@pytest.mark.parametrize(("asked", "meant"), [("X", "'x'"), ("posx", "'pos_x'"), ("velocity_y", "'velocity_x'")])
def test_a_column_that_is_not_there_has_a_neighbour(asked, meant):
    recording = Recording(("x", "pos_x", "velocity_x"), np.zeros((2, 3)), name="a")
    with pytest.raises(InvalidDataError, match=f"Did you mean {meant}"):
        recording.select([asked])


def test_what_is_like_nothing_has_none():
    with pytest.raises(InvalidDataError, match=r"no column 'force'; it has x, y\. Name those of this file"):
        Recording(("x", "y"), np.zeros((2, 2)), name="a").select(["force"])


def test_a_score_tells_what_recordings_show_in_all_directions_of_their_planes():
    found, none = verdicts.of_score(0.97, 4), np.full(4, np.nan)
    motion = np.array([1.0, 1.0, 2.0, 9.0])
    fine, poor = (
        verdicts.of_planes(found, share + np.array([0.02, -0.02, 0.0, np.nan]), motion) for share in (0.95, 0.6)
    )
    assert verdicts.of_planes(found, none, motion) == found
    assert (fine.mark, fine.said) == (found.mark, found.said)
    assert fine.trust.endswith(
        "In all directions left free by the planes that 3 of 4 demonstrations kept to, the policy explains 95% of the "
        "motion (said first: along the recorded motion alone)."
    )
    assert (poor.mark, poor.trust) == (Mark.DOUBTFUL, found.trust)
    assert poor.said.endswith(
        "But in all directions left free by the planes that 3 of 4 demonstrations kept to, the policy explains 60% of "
        "the motion (said first: along the recorded motion alone), unless more than a plane held them."
    )
    assert (
        "left free by the plane that it kept to, the policy explains"
        in verdicts.of_planes(found, np.array([0.95]), motion[:1]).trust
    )


def test_the_command_scores_recordings_in_their_planes(tmp_path):
    policy = uc.ParametricPolicy(uc.Affine(), uc.Direct())
    states = np.random.default_rng(0).uniform(-1, 1, (40, 3))
    for name, moved in (("right", turning), ("off", off_everywhere)):
        uc.storage.save(policy.fit(states, moved(states)), tmp_path / f"{name}.npz")
    for place, demo in enumerate(on_plates(PLATES, turning)):
        table = np.column_stack([np.arange(60), demo.states, demo.actions])
        np.savetxt(tmp_path / f"{place}.csv", table, delimiter=",", header="t,x,y,z,vx,vy,vz", comments="")
    files = [tmp_path / f"{place}.csv" for place in range(3)]
    options = ["--state", "x,y,z", "--action", "vx,vy,vz", "--json"]
    right, wrong = (
        json.loads(call("score", tmp_path / f"{name}.npz", *files, *options).stdout) for name in ("right", "off")
    )
    assert right["in_planes"] == pytest.approx([1.0] * 3)
    assert max(wrong["in_planes"]) < 0.9
    assert "unless more than a plane held them" in wrong["verdict"]["said"]
    assert "In all directions left free by the planes that 3 of 3" in right["verdict"]["trust"]
    known = json.loads(call("score", tmp_path / "off.npz", files[0], *options, "--plane", "0,0,1").stdout)
    assert "plane held" not in known["verdict"]["said"]  # it is given


def test_the_share_that_fit_prints_is_the_score_in_python(tmp_path):
    rng, times = np.random.default_rng(0), np.arange(0.0, 4.0, 0.05)
    for number in range(4):
        start = [np.cos(number), np.sin(number)]
        states = np.exp(-3.0 * times)[:, None] * start  # most of the time at rest, where noise is all there is
        table = np.column_stack([times, states, -3.0 * states + 1e-3 * rng.standard_normal(states.shape)])
        np.savetxt(tmp_path / f"{number}.csv", table, delimiter=",", header="t,x,y,vx,vy", comments="")
    files = sorted(tmp_path.glob("*.csv"))
    told = json.loads(call("fit", *files, "--model", "affine", "-o", tmp_path / "p.npz", "--json").stdout)
    demos = uc.prepare(uc.read(files), uc.Recipe(states=("x", "y"), actions=("vx", "vy")))
    states, actions, _ = uc.stack(demos)
    assert uc.load(tmp_path / "p.npz").score(states, actions) == pytest.approx(told["training"], abs=1e-6)
    assert told["training"] > 0.999

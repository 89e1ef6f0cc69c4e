"""What ``unconstrain diagnose`` says of recordings: noise, what is not known, what to record next."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import unconstrain as uc
from seen import on_a_phone, opened, width_of
from test_cli import call, refused, run, write
from test_report import References
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.evaluation import verdicts
from unconstrain.evaluation.diagnosis import Diagnosis, about_recordings, diagnose, nowhere, sentences, to_record
from unconstrain.evaluation.marks import WELL
from unconstrain.pages import diagnosis, fit

TURN = np.array([[-0.3, 1.0], [-1.0, -0.3]])


def movements(seed=0, noise=0.02, count=12, steps=30, held=None):
    """Every second one free, the others behind a random line; in the quarter plane ``held`` along x only."""
    rng = np.random.default_rng(seed)
    demos = []
    for index in range(count):
        states = np.cumsum(rng.normal(0, 0.05, (steps, 2)), axis=0) + rng.uniform(-1, 1, 2)
        actions = states @ TURN.T + [0.2, -0.1]
        normal = rng.standard_normal(2)
        normal /= np.linalg.norm(normal)
        if index % 2:
            actions -= np.outer(actions @ normal, normal)
        if held is not None:
            inside = (states > held).all(axis=1)
            actions[inside, 1] = 0.0
        demos.append(uc.Demonstration(states, actions + noise * rng.standard_normal(actions.shape), name=f"d{index}"))
    return demos


@pytest.fixture(scope="module")
def fitted():
    demos = movements()
    return uc.LocallyLinearPolicy(learner=uc.Robust()).fit_demonstrations(demos), demos


def csv_of(path, demos, d=2):
    head = ",".join(["demo", "t", "x", "y", "vx", "vy"][: 4 + d])
    rows = [
        [demo.name, 0.1 * at, *state, *action[:d]]
        for demo in demos
        for at, (state, action) in enumerate(zip(demo.states, demo.actions, strict=True))
    ]
    return write(path, head, rows)


AS_NAMED = ("--group", "demo", "--time", "t", "--state", "x,y")
MOTION = ("--action", "vx,vy")


class TestCovariances:
    @pytest.mark.parametrize("kind", ["one model", "local models"])
    def test_their_diagonal_is_the_spread_that_uncertainty_says(self, kind):
        demos = movements()
        policy = uc.ParametricPolicy() if kind == "one model" else uc.LocallyLinearPolicy(variance=0.3)
        policy.set_params(learner=uc.Robust()).fit_demonstrations(demos)
        states = np.random.default_rng(1).uniform(-2, 2, (20, 2))
        found = policy.covariances(states)
        assert_allclose(np.sqrt(np.einsum("naa->na", found)), policy.uncertainty(states).undetermined, rtol=1e-9)
        assert np.linalg.eigvalsh(found).min() >= -1e-12 * found.max()
        assert_allclose(found, found.swapaxes(1, 2), atol=1e-12 * found.max())

    def test_of_one_model_they_are_features_times_covariance_times_features(self):
        policy = uc.ParametricPolicy(learner=uc.Robust()).fit_demonstrations(movements())
        state = np.array([[0.3, -0.2]])
        jacobian = np.kron(policy.features_(state), np.eye(2))  # weights are laid out by columns
        [found] = policy.covariances(state)
        assert_allclose(found, jacobian @ policy.solution_.belief.undetermined[0] @ jacobian.T, rtol=1e-8)


class TestWhatIsFound:
    def test_shares_are_those_of_the_spreads(self, fitted):
        policy, demos = fitted
        found = diagnose(policy, demos)
        states, actions, _ = uc.stack(demos)
        typical = np.sqrt((actions**2).sum(axis=1).mean())
        spread = policy.uncertainty(states)
        open_, noise = (np.linalg.norm(one, axis=1) / typical for one in (spread.undetermined, spread.from_noise))
        assert_allclose(found.undetermined, open_)
        assert found.states_determined == np.mean((open_ < noise) | (open_ < 0.1))
        assert found.noise_share == pytest.approx(np.sqrt(2) * policy.solution_.noise / typical)
        assert sum(one.samples for one in found.regions) == sum(one.samples for one in found.movements) == len(states)

    def test_the_first_region_holds_the_least_known_state(self, fitted):
        policy, demos = fitted
        found = diagnose(policy, demos)
        states = uc.stack(demos).states
        assert_allclose(found.regions[0].state, states[found.undetermined.argmax()])
        assert np.linalg.norm(found.regions[0].direction) == pytest.approx(1.0)
        assert np.dot(found.regions[0].direction, policy(states[[found.undetermined.argmax()]])[0]) >= 0

    def test_what_is_held_everywhere_in_a_region_is_what_to_leave_free(self):
        demos = movements(seed=2, count=30, held=0.3)
        policy = uc.LocallyLinearPolicy(variance=0.1, learner=uc.Robust()).fit_demonstrations(demos)
        found = diagnose(policy, demos)
        inside = (uc.stack(demos).states > 0.3).all(axis=1)
        assert found.undetermined[inside].mean() > 1.5 * found.undetermined[~inside].mean()
        held = [one for one in found.regions if min(one.state) > 0.3 and one.along > 0.1]
        assert any(abs(one.direction[1]) > 0.9 and len(one.shown_by) < 3 for one in held)

    def test_free_demonstrations_look_freer(self, fitted):
        found = diagnose(*fitted)
        free = np.array([one.free for one in found.movements])
        assert free[::2].min() > 0.4  # a constraint that takes less than the noise looks free, too
        assert free[::2].mean() > free[1::2].mean() + 0.2

    def test_demonstrations_of_one_name_are_told_apart(self, fitted):
        policy, demos = fitted
        found = diagnose(policy, [replace(one, name="wipe") for one in demos])
        assert len({one.name for one in found.movements}) == len(demos)

    def test_of_other_demonstrations_nothing_is_said_about_freedom(self, fitted):
        policy, demos = fitted
        found = diagnose(policy, demos[:3])
        assert found.free is None
        assert all(one.free is None for one in found.movements)

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (
                {"method": "likelihood"},
                "Learnt as likelihood: each sample free, or held in directions none of which need stay held over",
            ),
            (
                {
                    "method": "softened hybrid, 0.1",
                    "candidates": {"direct": 0.3, "softened hybrid, 0.1": 0.1, "softened hybrid, 1": 0.2},
                },
                "of other ways to learn, as times that of this (more is worse): direct 3 ('fit -v' lists all).",
            ),
            (
                {"method": "direct", "candidates": {"direct": 1e-9, "hybrid": 1.0}},
                "worse): hybrid over 1,000 (",
            ),
            ({"noise_share": 0.5}, "So much noise makes the following unreliable."),
            (
                {"noise_share": 0.2, "noise": 1.0, "jitter": 0.1},
                "what the model does not follow, fast parts that --window smooths, or people who vary.",
            ),
            ({"noise_share": 0.2, "noise": 1.0, "jitter": 0.1}, "Only 0.1 of it (2%) changes from sample to sample"),
            (
                {"undecided_share": 0.4},
                "and of 40% recordings cannot tell: they were free or always held in the same way",
            ),
        ],
    )
    def test_each_finding_has_its_words(self, fitted, change, said):
        found = replace(diagnose(*fitted), **change)
        assert said in " ".join(sentences(found, ["x", "y"], ["vx", "vy"]))

    @pytest.mark.parametrize("looks", ["free", "constrained"])
    def test_where_a_stroke_looks_free_others_are_asked_for_last(self, fitted, looks):
        """It tells what is across it; that of one that was held is open."""
        found, (one, other, *_) = (whole := diagnose(*fitted)), whole.movements
        kinds = tuple(replace(each, looks=looks if each is one else "constrained") for each in whole.movements)
        open_ = [
            replace(whole.regions[0], demonstration=each.name, together=0.0, determined=0.0) for each in (one, other)
        ]
        places = replace(open_[0], along=2.0, state=(1.0, 2.0)), replace(open_[1], along=1.0, state=(3.0, 4.0))
        found = replace(whole, movements=kinds, regions=(*places, replace(places[0], together=1.0)))
        first, then = places[::-1] if looks == "free" else places
        assert verdicts.ranked(found) == [first, then, found.regions[2]]
        place = "(x = 3, y = 4)" if looks == "free" else "(x = 1, y = 2)"
        assert f"Near {place}" in " ".join(sentences(found, ["x", "y"], ["vx", "vy"]))
        assert to_record(found, ["x", "y"], ["vx", "vy"]).startswith(f"Demonstrate around {place}")

    def test_what_is_determined_everywhere_is_not_said_to_be_open_anywhere(self, fitted):
        found = diagnose(*fitted)
        sure = replace(found, regions=tuple(replace(one, determined=1.0) for one in found.regions))
        said = " ".join(sentences(sure, ["x", "y"], ["vx", "vy"]))
        assert "Every recorded state is determined, as far as noise lets it be told." in said
        for together, rest in ((1.0, "it hangs on one or two"), (0.5, "none tells it in some direction")):
            left = verdicts.of_diagnosis(replace(found, told_together=together, states_determined=0.5)).said
            assert f"at 50% of their states three demonstrations or more tell the policy and at 50% {rest}: " in left

    @given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
    def test_shares_of_the_states_make_up_all_of_them_best_first(self, fitted, three, together):
        found = replace(diagnose(*fitted), states_determined=min(three, together), told_together=max(three, together))
        said = verdicts.shares_told(found)
        order = [said.find(words) for words in ("three demonstrations or more", "hangs on one", "none tells")]
        assert (known := [at for at in order if at >= 0]) == sorted(known)
        if not re.search("[<>]", said):
            assert sum(map(int, re.findall(r"(\d+)%", said))) in (99, 100, 101)  # by parts below one in a hundred

    @pytest.mark.parametrize(("shown", "more"), [((), "three"), (("d3",), "two"), (("d3", "d4"), "one")])
    def test_who_moved_a_little_along_what_is_open_is_not_said_to_have_moved_along_it(self, fitted, shown, more):
        found = diagnose(*fitted)
        open_ = replace(found, regions=(replace(found.regions[0], determined=0.0, shown_by=shown),))
        said = " ".join(sentences(open_, ["x", "y"], ["vx", "vy"]))
        assert re.search(
            rf"Near \(x .*\) nobody moved along \(vx .* by more than noise.*: record {more} more there\.", said
        )
        assert ("noise but 'd3'" in said) == bool(shown) == ("with a part of the motion" in said)

    def test_each_state_says_how_many_tell_it(self, fitted):
        found = diagnose(*fitted)
        assert found.told.shape == found.undetermined.shape
        assert (found.told == 2).mean() == pytest.approx(found.states_determined)
        assert (found.told > 0).mean() == pytest.approx(found.told_together)
        assert "told" not in found.to_json()

    @pytest.mark.parametrize("along", [0.05, 0.55])
    def test_what_is_told_only_as_noise_leaves_more_open_is_said_and_the_first_place_comes_next(self, fitted, along):
        found = diagnose(*fitted)
        wide = replace(found.regions[0], along=along, determined=1.0)
        found = replace(found, states_determined=1.0, regions=(wide, *found.regions[1:]), planes=0)
        told = verdicts.of_diagnosis(found, "Demonstrate there.")
        assert ("; at the place that comes next, up to 55%, where noise leaves more open." in told.trust) == (
            along > 0.1
        )
        then = "Demonstrate there. The list below has more places." if along > 0.1 else "Demonstrate where nobody was."
        assert told.next == then

    def test_a_learner_without_candidates_has_nothing_compared(self):
        demos = movements()
        policy = uc.ParametricPolicy(learner=uc.NoiseCorrected()).fit_demonstrations(demos)
        found = diagnose(policy, demos)
        assert "Nothing was compared" in " ".join(sentences(found, ["x", "y"], ["vx", "vy"]))
        assert "Nothing was compared" in diagnosis.diagnosis_page(found, demos, "A page", ["x", "y"], ["vx", "vy"])

    def test_another_learner_is_told_what_to_do(self, fitted):
        with pytest.raises(SettingError, match=r"Fit with learner=Robust\(\)"):
            diagnose(uc.ParametricPolicy(learner=uc.Hybrid()).fit_demonstrations(fitted[1]), fitted[1])

    @given(st.integers(1, 4), st.integers(1, 3), st.integers(1, 3), st.sampled_from([0.0, 1e-9, 1.0]))
    def test_it_finds_something_or_says_why_not(self, samples, n, d, size):
        rng = np.random.default_rng([samples, n, d])
        demo = uc.Demonstration(rng.standard_normal((samples, n)), size * rng.standard_normal((samples, d)))
        policy = uc.LocallyLinearPolicy(learner=uc.Robust()).fit_demonstrations([demo])
        try:
            found = diagnose(policy, [demo])
        except InvalidDataError as error:
            assert "expected" in str(error)  # noqa: PT017 - either is right
        else:
            assert isinstance(found, Diagnosis)
            assert all(map(len, sentences(found, ["x"] * n, ["v"] * d)))
            assert json.loads(json.dumps(found.to_json(), allow_nan=False))


class TestCommand:
    def test_it_says_what_it_found_and_writes_a_page(self, tmp_path):
        data, page = csv_of(tmp_path / "a.csv", movements()), tmp_path / "a.html"
        said = run("diagnose", data, *AS_NAMED, *MOTION, "--model", "linear", "-o", page)
        for words in (
            "12 demonstrations, 360 samples",
            "Noise and misfit: ",
            "Learnt as likelihood: ",
            "Estimated squared error of other ways to learn, as times that of this (more is worse): ",
            "Trust: The policy at these states, to about ",
            "Next: Demonstrate where nobody was.",
        ):
            assert words in " ".join(said.split())
        references = References()
        references.feed(page.read_text("utf-8"))
        assert references.found == []

    def test_json_holds_what_is_said(self, tmp_path):
        data = csv_of(tmp_path / "a.csv", movements())
        found = json.loads(run("diagnose", data, *AS_NAMED, *MOTION, "--json"))
        assert found["actions"] == ["vx", "vy"]
        assert {one["name"] for one in found["movements"]} == {f"d{index}" for index in range(12)}
        assert found["regions"][0].keys() >= {"state", "direction", "along"}

    @pytest.mark.parametrize(
        ("demos", "d", "words"),
        [
            ([uc.Demonstration(np.ones((1, 2)), np.ones((1, 2)), name="one")], 2, "got 1 sample in all, expected at"),
            (movements(), 1, "got one action column"),
            ([replace(one, actions=0 * one.actions) for one in movements()], 2, "all actions are zero"),
        ],
        ids=["one sample", "one action", "at rest"],
    )
    def test_what_cannot_be_diagnosed_is_said_in_one_sentence(self, tmp_path, demos, d, words):
        data = csv_of(tmp_path / "a.csv", demos, d)
        motion = "vx,vy" if d == 2 else "vx"
        assert words in refused("diagnose", data, *AS_NAMED, "--action", motion)

    def test_it_does_not_write_over_what_it_reads(self, tmp_path):
        data = csv_of(tmp_path / "a.csv", movements())
        assert "is one of the files" in refused("diagnose", data, *AS_NAMED, *MOTION, "-o", data)

    def test_velocities_are_named_after_their_states(self, tmp_path):
        data = csv_of(tmp_path / "a.csv", movements(count=4))
        ran = call("diagnose", data, *AS_NAMED, "--differentiate", "--window", "0.8", "--json")
        assert ran.code == 0, ran.err
        assert json.loads(ran.out)["actions"] == ["vx", "vy"]


class TestPage:
    def test_a_page_draws_all_its_pictures(self, fitted, browser, tmp_path):
        policy, demos = fitted
        evil = "<script>alert(1)</script>"
        named = [replace(demo, name=evil) for demo in demos]
        for found in (diagnose(policy, named), replace(diagnose(policy, named), told=np.ones(360, int))):
            page = diagnosis.diagnosis_page(found, named, "A diagnosis", ["x", evil], ["vx", "vy"])
            assert evil not in page
            told = found.told.min() == 2  # nothing to draw on the map
            assert ("Nowhere: three demonstrations or more tell the policy at every recorded state." in page) == told
            assert len(opened(browser, page, tmp_path)) == 2 - told

    def test_the_chart_draws_those_of_which_it_can_be_told(self, fitted):
        found = diagnose(*fitted)
        assert {one.looks for one in found.movements} == {"free", "constrained"}
        for kept in (len(found.movements), 5, 0):
            looks = [one.looks if index < kept else "untold" for index, one in enumerate(found.movements)]
            some = [replace(one, looks=how) for one, how in zip(found.movements, looks, strict=True)]
            page = diagnosis.diagnosis_page(
                replace(found, movements=tuple(some)), fitted[1], "A page", ["x", "y"], ["vx", "vy"]
            )
            left = len(found.movements) - kept
            assert (f"Of {left} more it cannot be told" in page) == (0 < left < len(found.movements))
            assert ("Of no demonstration this can be told" in page) == (kept == 0)
            assert ('id="free"' in page) == (kept > 0)

    def test_a_page_fits_on_a_phone(self, fitted, browser, tmp_path):
        policy, demos = fitted
        page = diagnosis.diagnosis_page(diagnose(policy, demos), demos, "A diagnosis", ["x", "y"], ["vx", "vy"])
        with on_a_phone(browser, 400, 800):
            assert all(graph["wide"] <= 400 for graph in opened(browser, page, tmp_path))
            assert width_of(browser) <= 400

    def test_the_page_of_a_robust_fit_says_what_is_not_known(self, fitted, browser, tmp_path):
        few = uc.LocallyLinearPolicy(learner=uc.Robust()).fit_demonstrations(fitted[1][:3]), fitted[1][:3]
        for policy, demos in (fitted, few):  # as diagnose says it of the same
            page, more = (
                fit.policy_page(policy, demos, "A policy"),
                uc.evaluation.diagnosis.needs_more(diagnose(policy, demos)),
            )
            assert "What the demonstrations do not tell" in page
            assert ("known" in [one["id"] for one in opened(browser, page, tmp_path)]) == more == (demos is few[1])
            assert ("No place needs another demonstration" in page) == (not more)
            assert ("Demonstrate around" in page) == more

    def test_a_fit_of_which_nothing_can_be_said_says_so(self):
        demos = [replace(one, actions=one.actions[:, :1]) for one in movements()]
        policy = uc.ParametricPolicy(learner=uc.Robust()).fit_demonstrations(demos)
        assert "Nothing can be said about that: got one action column" in fit.policy_page(policy, demos, "A policy")


# What is shared by fit and diagnose: five strokes of a cycle that attracts, where the truth is known


def cycling(states):
    """Round the unit circle, and down to its plane."""
    flat = states[:, :2]
    room = 1.0 - (flat**2).sum(axis=1, keepdims=True)
    return np.column_stack([room * flat + flat[:, ::-1] * [-1.0, 1.0], -states[:, 2]])


def five_strokes(kind, seed):
    """Each on a plane of its own; all on planes parallel to one; or each far from the others."""
    rng, demos = np.random.default_rng(seed), []
    normals = rng.standard_normal((5, 3)) + np.array([0.0, 0.0, 2.0 * (kind == "own planes")])
    for k, normal in enumerate(normals if kind != "one plane" else [[0.0, 0.3, 1.0]] * 5):
        plane, away = uc.constraints.Plane(normal), np.array([20.0 * k * (kind == "far apart"), 0.0, 0.0])
        start = np.array([np.cos(k), np.sin(k), 0.0]) + 0.1 * rng.standard_normal(3) + away
        if kind == "one plane":
            start -= plane.normal * (plane.normal @ start)
        run = uc.rollout(lambda states, away=away: cycling(states - away), start, 150, 0.04, plane, name=f"s{k}")
        demos.append(replace(run, actions=run.actions + 0.01 * rng.standard_normal(run.actions.shape)))
    return demos


@pytest.mark.parametrize("seed", [0, 1, 2, 4])
@pytest.mark.parametrize("kind", ["own planes", "one plane", "far apart"])
@pytest.mark.parametrize("variance", ["auto", None])
def test_what_fit_and_diagnose_call_told_is_told(variance, kind, seed):
    demos = five_strokes(kind, seed)
    policy = uc.LocallyLinearPolicy(variance).fit_demonstrations(demos)
    found, told = diagnose(policy, demos), uc.evaluation.diagnosis.states_told(policy)
    assert found.told_together == pytest.approx(told)
    states, wanted = uc.stack(demos).states, np.vstack([one.truth.policy for one in demos])
    missed = np.sqrt(((policy(states) - wanted) ** 2).sum() / (wanted**2).sum())
    fit, whole = verdicts.of_explained(policy.held_out_score(), 5, told), verdicts.of_diagnosis(found)
    said = about_recordings(fit, demos, uc.Recipe(("x", "y", "z"), still=1.0), np.zeros_like)
    assert ("Each demonstration lies on a plane of its own, up to " in said.trust) == (kind == "own planes")
    assert ("All demonstrations lie on one plane or parallel ones, of normal (x = " in said.doubt) == (
        kind == "one plane"
    )
    assert ("as all lie on one plane" in whole.said) == (kind == "one plane")
    if kind == "own planes":
        assert missed < 0.3
        widest = uc.LocallyLinearPolicy(None, learner="direct").fit_demonstrations(demos).variance_
        narrow = policy.variance_ != widest  # one model is too stiff, and one or two are in narrow fields
        assert told > 0.5 or narrow or missed > 0.2, "what is wrong by more may be told less"
        little, fair = told < verdicts.PARTLY, policy.held_out_score() < verdicts.GOOD
        assert (fit.mark is verdicts.Mark.BAD) == (little and fair)
        assert ("across" in fit.said) == (told < WELL)
        assert little or whole.mark is not verdicts.Mark.BAD
        hangs = "enough only if none of these went wrong" in whole.said
        assert hangs == (told >= WELL and found.states_determined < verdicts.PARTLY)
    else:
        assert told < 0.05 < 0.2 < missed
        assert whole.mark is verdicts.Mark.BAD
        assert fit.mark is not verdicts.Mark.GOOD
        poor = policy.held_out_score() < verdicts.FAIR
        assert "at 100% of the recorded states no recording tells" in (fit.doubt if poor else fit.said)


def test_strokes_on_planes_of_their_own_are_not_called_bad_recordings(fitted):
    found = replace(diagnose(*fitted), states_determined=0.0, told_together=0.0, noise_share=0.0)
    assert verdicts.of_diagnosis(replace(found, planes=0)).mark is verdicts.Mark.BAD
    own = verdicts.of_diagnosis(replace(found, planes=12))
    assert own.mark is verdicts.Mark.DOUBTFUL
    assert own.said.startswith("Recordings: at 0% of their states")
    assert own.said.endswith("too little for this model to be sure, though each lies on a plane of its own.")


def stroke(start, end, rest, name):
    """From a place to another, then at rest there for some samples."""
    speed = np.r_[np.full(60, 1.0), np.full(rest, 0.001)]
    way = np.subtract(end, start) / 60.0
    return uc.Demonstration(start + np.cumsum(speed)[:, None] * way, speed[:, None] * way, name=name)


CROSSING = [stroke((-1, 0), (1, 0), 0, "by"), stroke((0, -1), (0, 0), 40, "held"), stroke((1, 1), (-1, 1), 0, "on")]
TO_A_GOAL = [stroke(start, (0, 0), 40, "to") for start in ((1, 0), (0, 1), (-1, 0), (0, -1))]


def test_motion_about_one_place_is_said_to_show_nothing_that_points_there():
    angle, fair = np.linspace(0.0, 1.2, 60), verdicts.Verdict(verdicts.Mark.DOUBTFUL, "Fair.")
    swings = [radius * np.column_stack([np.cos(angle), np.sin(angle)]) for radius in (0.64, 0.65, 0.66)]
    doors = [uc.Demonstration(path + np.array([1.0, 0.5]), np.gradient(path, 0.02, axis=0)) for path in swings]
    said = about_recordings(fair, doors, uc.Recipe(("x [m]", "y [m]"), still=0.1), np.ones_like)
    assert said.doubt.startswith("All motion is about (x [m] = 0.999, y [m] = 0.499), as of a door about its hinge: ")
    lines = [uc.Demonstration(one.states, one.actions[:1] * np.ones((60, 1))) for one in doors]
    assert "hinge" not in about_recordings(fair, lines, uc.Recipe(("x", "y"), still=0.1), np.ones_like).doubt


@pytest.mark.parametrize("model", [uc.ParametricPolicy(uc.Affine()), uc.LocallyLinearPolicy()], ids=["affine", "local"])
def test_regions_that_all_recordings_tell_are_not_doubted_for_being_shown_by_few(model):
    demos, truth = [], np.array([[-1.0, -0.8, 0.0], [0.6, -1.4, 0.1], [0.0, 0.2, -1.1]])
    rng = np.random.default_rng(0)
    for _ in range(12):
        start, plane = rng.uniform(-0.35, 0.35, 3), uc.constraints.Plane(rng.normal(size=3))
        path = uc.rollout(lambda x: x @ truth.T, start, 125, 0.02, plane)
        demos.append(replace(path, actions=path.actions + 1e-3 * rng.standard_normal((125, 3)), truth=None))
    found, states = diagnose(policy := model.fit_demonstrations(demos), demos), uc.stack(demos).states
    wanted = states @ truth.T
    off = np.linalg.norm(policy(states) - wanted, axis=1) / np.sqrt((wanted**2).sum(axis=1).mean())
    assert np.median(off) < 0.03  # the truth is known to a few hundredths
    doubted = sum(region.together < verdicts.PARTLY for region in found.regions)
    assert doubted < 0.3 * sum(len(region.shown_by) < 3 for region in found.regions)
    said = verdicts.of_diagnosis(found)
    open_ = found.told_together < 1.0
    assert said.doubt.startswith("Where none tells it in some direction" if open_ else "States that nobody")
    assert ("none tells it in some direction" in said.said) == open_
    assert ("it hangs on one or two" in said.said) == (found.told_together > found.states_determined + 1e-9)


@pytest.mark.parametrize(
    ("demos", "policy", "doubt", "advised"),
    [
        (
            CROSSING,
            np.zeros_like,
            "The policy rests near (x = 0, y = 0.000667), where 'held' came to rest and others",
            True,
        ),
        (CROSSING, np.ones_like, "", False),
        (
            CROSSING[1:],
            np.zeros_like,
            "'held' ended slower than 20% of a usual speed where no other moves on: whether something stopped it",
            False,
        ),
        (CROSSING[1:2], np.zeros_like, "'held' ended slower than 20% of a usual speed", False),
        (TO_A_GOAL, np.zeros_like, "", False),
        (
            CROSSING + [stroke(start, (0.5, 0.7), 40, "to") for start in ((1, 0), (0, 1))] * 2,
            np.zeros_like,
            "The",
            False,
        ),
    ],
)
def test_where_a_policy_rests_by_mistake_is_told_and_trimmed_only_where_no_goal_is_lost(demos, policy, doubt, advised):
    poor = verdicts.Verdict(verdicts.Mark.BAD, "Poor.", next="Look.")
    said = about_recordings(poor, demos, uc.Recipe(("x", "y")), policy)
    assert said.doubt.startswith(doubt)
    assert bool(said.doubt) == bool(doubt)
    assert said.next == ("--still 0.0067 leaves out rest at an end. Look." if advised else "Look.")
    assert about_recordings(poor, demos, uc.Recipe(("x", "y"), still=0.1), policy) == poor


@pytest.mark.parametrize(("rest", "last"), [(40, 0.001), (40, 0.5), (0, 1.0)])
@pytest.mark.parametrize("never", [False, True])
def test_rest_is_named_where_noise_makes_the_last_samples_fast_or_nothing_moved_at_all(rest, last, never):
    held = stroke((0, -1), (0, 0), rest, "held")
    held.actions[-2:] *= last / held.actions[-1:].max() / 60.0  # as a filter makes them at an end
    demos = [CROSSING[2], held, *[stroke((2, 2), (2.001, 2), 0, "never")] * never]
    poor = verdicts.Verdict(verdicts.Mark.BAD, "Poor.", next="Look.")
    said = about_recordings(poor, demos, uc.Recipe(("x", "y")), lambda states: np.full_like(states, 0.2 / 60.0))
    names = ["'held'"] * bool(rest) + ["'never'"] * never
    assert said.doubt.startswith(f"{', '.join(names)} ended slower" if names else "")
    assert bool(said.doubt) == bool(names)
    assert ("if so, --still 0.0067 leaves that out." in said.doubt) == (names == ["'held'"])


def test_where_most_come_to_rest_that_is_a_goal_and_not_to_be_left_out():
    places = [(1, 0), (0, 1), (-1, 0)]
    demos = [stroke(place, (0.5 * place[0] + 0.1, 0.5 * place[1]), 40, f"rests {place}") for place in places]
    poor = verdicts.Verdict(verdicts.Mark.BAD, "Poor.", next="Look.")
    said = about_recordings(poor, demos, uc.Recipe(("x", "y")), np.ones_like)
    assert said.next == "Look."


@pytest.mark.parametrize(("count", "told"), [(2, False), (3, True)])
def test_two_demonstrations_tell_nothing_together(count, told):
    rng, demos = np.random.default_rng(0), []
    for _ in range(count):
        states, ways = rng.uniform(-1, 1, (200, 2)), rng.standard_normal((200, 2))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        wanted = states @ TURN.T + [0.2, -0.1]
        demos.append(uc.Demonstration(states, ways * np.vecdot(ways, wanted)[:, None]))
    found = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit_demonstrations(demos)
    assert (found.solution_.believed.told_together > 0.9) == told


@pytest.mark.parametrize(("jitter", "share", "missed"), [(0.3, 0.2, True), (0.9, 0.2, False), (0.3, 0.05, False)])
def test_misfit_is_said_where_it_is_most_of_what_is_missed_and_not_small(fitted, jitter, share, missed):
    found = replace(diagnose(*fitted), noise=1.0, jitter=jitter, noise_share=share)
    judged = verdicts.of_diagnosis(found)
    assert ("beyond noise it misses 19% of a typical action" in judged.doubt) == missed
    assert ("Another --model" in judged.next) == missed
    assert ("none cures that the model misses 19%" in nowhere(found)) == missed

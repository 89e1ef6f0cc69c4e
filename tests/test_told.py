"""What is told of fits, scores and roll-outs can be acted on, and comes where it must alone."""

import re
import shlex
import warnings
from html import unescape

import numpy as np
import pytest

import unconstrain as uc
from test_cli import call, run, write
from unconstrain.pages import fit as fit_page

DOUBTFUL = uc.evaluation.verdicts.Mark.DOUBTFUL


def words(said):
    """Without the ends of lines."""
    return " ".join(said.split())


def page_of(path):
    """The text of a page, without its pictures."""
    bare = re.sub(r"<svg.*?</svg>", " ", path.read_text("utf-8"), flags=re.DOTALL)
    return words(unescape(re.sub("<[^>]+>", " ", bare)))


def planar(folder):
    """Files of joint angles and their velocities, and the robot that they are of."""
    links = "".join(f'<link name="{name}"/>' for name in ("base", "upper", "hand"))
    joints = "".join(
        f'<joint name="{one}" type="continuous"><parent link="{one}"/><child link="{two}"/>'
        f'<origin xyz="{length} 0 0"/><axis xyz="0 0 1"/></joint>'
        for one, two, length in (("base", "upper", 0.0), ("upper", "hand", 1.0))
    )
    (folder / "arm.urdf").write_text(f'<robot name="planar">{links}{joints}</robot>')
    starts = np.random.default_rng(0).uniform(-1, 1, (5, 2))
    for k, one in enumerate(uc.rollout(lambda q: -q, starts, 60, 0.05)):
        write(folder / f"{k}.csv", "t,a,b,va,vb", np.column_stack([one.times, one.states, one.actions]))
    return ("--jacobian", folder / "arm.urdf", "--tip", "hand")


def test_the_look_that_a_fit_with_a_jacobian_names_runs(tmp_path, monkeypatch):
    known, both = planar(tmp_path), "Look ('unconstrain look'); 'unconstrain fit --guided auto' keeps it."
    judged = uc.evaluation.verdicts.Verdict(DOUBTFUL, "So.", next=both)
    monkeypatch.setattr(uc.evaluation.verdicts, "of_explained", lambda *_, **__: judged)
    monkeypatch.chdir(tmp_path)
    said = run("fit", tmp_path / "*.csv", *known, "--model", "affine", "-o", tmp_path / "p.npz")
    [look] = re.findall(r"^ *unconstrain (look .*)", said, flags=re.MULTILINE)
    assert "--tip" not in look
    assert "page: look.html" in run(*shlex.split(look))
    [again] = re.findall(r"^ *unconstrain (fit .*)", said, flags=re.MULTILINE)
    assert "--tip hand --guided auto" in again
    assert "policy: guided.npz" in run(*shlex.split(again), "--model", "affine")


def strokes(folder, count=5):
    """Files of turns about one middle, each on a plane of its own."""
    rng = np.random.default_rng(1)
    for k in range(count):
        plane = uc.constraints.Plane(rng.normal(size=3) * [0.4, 0.4, 0.0] + [0.0, 0.0, 1.0])
        start = plane_start(plane.normal, 1.3 * k)
        done = uc.rollout(lambda x: x @ TURN.T, start, 120, 0.03, plane, method="rk4")
        write(folder / f"r{k}.csv", "t,x,y,z", np.column_stack([done.times, done.states]))
    return folder / "r*.csv"


TURN = np.array([[-0.1, -1.0, 0.0], [1.0, -0.1, 0.0], [0.0, 0.0, -1.0]])


def plane_start(normal, angle):
    at = np.array([np.cos(angle), np.sin(angle), 0.0])
    return at - normal * (at @ normal) / (normal @ normal)


READ = ("--state", "x,y,z", "--differentiate", "--learner", "direct")


@pytest.mark.parametrize(("model", "leaves"), [(("--variance", "0.01"), True), (("--model", "affine"), False)])
def test_the_page_of_a_fit_marks_what_is_extrapolated_on_a_new_plane_and_gives_its_command(tmp_path, model, leaves):
    files, page = strokes(tmp_path), tmp_path / "p.html"
    run("fit", files, *READ, *model, "-o", tmp_path / "p.npz", "--report", page)
    said, drawn = page_of(page), page.read_text("utf-8")
    assert ('data-key="extrapolated"' in drawn) == leaves
    command = re.search(r"The one under the plane is unconstrain (rollout POLICY\.npz .*? --steps \d+) ?\.", said)[1]
    command = command.replace("POLICY.npz", str(tmp_path / "p.npz"))
    ran = words(run(*shlex.split(command), "--least-support", 0, "-o", tmp_path / "out.csv"))
    told = re.search(r"No demonstration passes near for (\S+) of the time", ran)
    assert bool(told) == leaves
    assert (f"near the one under the plane for {told[1]} of the time, where" in said) if leaves else True
    assert ("is grey and dashed: extrapolated" in said) == leaves


def test_the_page_of_a_fit_says_why_nothing_was_held_out_for_each(tmp_path, monkeypatch):
    files, page = strokes(tmp_path, 3), tmp_path / "p.html"
    asked = ("fit", files, *READ, "--model", "affine", "-o", tmp_path / "p.npz", "--report", page, "--force")
    run(*asked)
    assert "Nothing was held out" not in page_of(page)
    assert "a fifth held out" in page_of(page)
    monkeypatch.setattr(fit_page, "MOST_REFITTED", 300)
    run(*asked)
    said = page_of(page)
    assert "Nothing was held out for each demonstration: that is done of up to 300 samples, and there are 360." in said
    assert "is of all together" in said
    run(*asked, "--episodes", "r0")
    assert "Nothing was held out, as this takes two demonstrations." in page_of(page)


def notes_of(states, actions, groups):
    with warnings.catch_warnings(action="ignore"):
        policy = uc.LocallyLinearPolicy(0.05).fit(states, actions, groups=groups)
    assert policy.held_out_score() < 0.2
    return policy.solution_.notes[-1]


def test_a_fit_that_explains_little_says_whether_columns_or_demonstrations_are_to_blame():
    x, groups = np.linspace(0, 1, 30), np.repeat(np.arange(6), 30)
    states = np.concatenate([np.column_stack([x, 0.01 * k + 0 * x]) for k in range(6)])
    said = notes_of(states, np.column_stack([0 * groups, 1.0 - 2.0 * (groups % 2)]), groups)
    assert "look at columns, units, and what tells demonstrations apart (groups= in Python, --group typed)" in said
    far = states + np.column_stack([0 * groups, 5.0 * groups])
    angle = 2.1 * groups
    said = notes_of(far, np.column_stack([np.cos(angle), np.sin(angle)]), groups)
    assert ", but 100% of what it learnt from: demonstrations have too little in common. Demonstrate between" in said
    assert "columns" not in said


def logged(folder, name, start, noise, slow=1.0, seed=0):
    """Positions on a way that turns inwards, and velocities with noise, as a robot logs them."""
    done = uc.rollout(lambda x: slow * x @ TURN[:2, :2].T, start, 150, 0.02, method="rk4")
    seen = done.actions + noise * np.random.default_rng(seed).standard_normal(done.actions.shape)
    return write(folder / f"{name}.csv", "t,x,y,vx,vy", np.column_stack([done.times, done.states, seen]))


def test_what_recordings_that_leave_where_a_policy_was_learnt_miss_for_noise_is_not_put_down_to_that(tmp_path):
    files = [logged(tmp_path, f"a{k}", [np.cos(2.0 * k), np.sin(2.0 * k)], 0.01, seed=k) for k in range(4)]
    columns = ("--state", "x,y", "--action", "vx,vy")
    run("fit", *files, *columns, "--learner", "direct", "--model", "affine", "-o", tmp_path / "p.npz")
    apart = "as these recordings leave where it was learnt"
    noisy = logged(tmp_path, "noisy", [30.0, 0.0], 9.0)
    wrong = logged(tmp_path, "wrong", [30.0, 0.0], 9.0, slow=2.0)
    for file, said in ((noisy, False), (wrong, True)):
        for held in ((), ("--plane", "1,0")):
            found = words(call("score", tmp_path / "p.npz", file, *held).out)
            assert (apart in found) == said, found


def test_which_samples_are_fast_is_said_only_where_noise_is_known(tmp_path):
    files = [logged(tmp_path, f"a{k}", [np.cos(2.0 * k), np.sin(2.0 * k)], 0.01, seed=k) for k in range(4)]
    for columns, head in ((("--action", "vx,vy"), "samples"), (("--by", "kalman"), "fast samples")):
        run("fit", *files, "--state", "x,y", *columns, "--model", "affine", "-o", tmp_path / "p.npz", "--force")
        said = run("score", tmp_path / "p.npz", files[0])
        assert re.search(r"^demonstration +(.*?)  ", said, flags=re.MULTILINE)[1] == head
        assert bool(re.search(r"\d of 150", said)) == (head == "fast samples")
        assert ("fast samples: of ten times" in said) == (head == "fast samples")
        assert ("explains (fast)  normalised inconsistency (noise too)" in said) == (head == "fast samples")


def test_a_round_of_a_guided_cycle_takes_the_time_that_is_promised_however_fast_its_policy_is():
    now, round_ = np.linspace(0.0, 8.0, 400), np.array([[0.0, 1.0], [-1.0, 0.0]])
    states = np.column_stack([np.cos(now), np.sin(now)])
    orbit = uc.Guided(lambda x: x @ round_, demonstrations=[uc.Demonstration(states, states @ round_, now)]).aim_
    assert "a round takes the time learnt of that plane, within 11%" in words(orbit.promise)
    assert "pace" not in orbit.promise

    def takes(turn):
        """Seconds of the last of two rounds and a half or more, by when it is on the cycle."""
        wanted = lambda x: (x - orbit.potential.goal) @ turn  # noqa: E731
        moved = uc.rollout(lambda x: orbit.guided(x, wanted(x)), [1.0, 0.0], 1800, 0.01, method="rk4")
        angle = np.abs(np.unwrap(np.arctan2(*moved.states.T[::-1])))
        return moved.times[-1] - np.interp(angle[-1] - 2 * np.pi, angle, moved.times)

    learnt = takes(orbit.turn.T)
    assert takes(round_) == pytest.approx(2 * np.pi, rel=0.03)  # as that which was shown
    assert [takes(share * round_) / learnt for share in (0.2, 5.0, -1.0)] == pytest.approx([1.11, 0.91, 1.11], abs=0.01)


@pytest.mark.parametrize(("dent", "strays"), [(0.4, True), (0.0, False)])
def test_guided_runs_that_stray_far_more_than_unguided_ones_are_in_the_verdict(tmp_path, dent, strays):
    """A surface without dents cuts off those that were shown."""
    now = 0.02 * np.arange(300)
    for k in range(4):
        angle = 3 * now + 1.6 * k
        far = (1 + dent * np.cos(2 * angle)) * (1 + 0.01 * k)
        write(tmp_path / f"d{k}.csv", "t,x,y", np.column_stack([now, far * np.cos(angle), far * np.sin(angle)]))
    how = "--by", "savgol", "--variance", "0.02", "--learner", "direct"
    said = words(run("fit", tmp_path / "*.csv", *how, "--guided", "cycle", "-o", tmp_path / "g.npz"))
    found = re.search(r"But guided, it strays up to (\S+) \S+ .*?paths, unguided (\S+) at most\.", said)
    assert bool(found) == said.startswith("!") == strays
    told = words(run("info", tmp_path / "g.npz"))
    assert ("But run from the same starts, it strays up to" in told) == strays
    if found:
        assert float(found[1]) > 3 * float(found[2])
        assert "Next: Fit without --guided, which does better" in said
        assert "leave that out (--trim 1,0: of each the first second)" in said


def test_a_start_that_is_refused_is_farther_than_one_that_no_demonstration_passes_near(tmp_path):
    files = [logged(tmp_path, f"a{k}", [np.cos(2.0 * k), np.sin(2.0 * k)], 0.01, seed=k) for k in range(4)]
    columns = ("--state", "x,y", "--action", "vx,vy", "--variance", "0.05")
    run("fit", *files, *columns, "-o", tmp_path / "p.npz")
    policy, far = uc.load(tmp_path / "p.npz"), np.linspace(1.0, 4.0, 301)
    support = policy.support(np.column_stack([far, 0 * far]))
    for least, most, code in ((0.6, 1.0, 0), (0.01, 0.3, 0), (0.0, 0.0005, 2)):
        at = far[(support > least) & (support < most)][0]
        ran = call("rollout", tmp_path / "p.npz", "--start", f"{at},0", "--steps", 2)
        assert ran.code == code
        assert ("No demonstration passes near for" in words(ran.err)) == (code == 0 and most < 0.6)
        assert ("nothing was demonstrated near" in ran.err) == (code == 2)
    told = words(run("rollout", "--help"))
    assert "no longer support it (--least-support); a start there is refused, unless the policy is guided." in told
    assert '"no demonstration passes near" is not as far' in told
    assert "Of joints, in the space of their velocities; with --jacobian three, in that of the hand." in told


@pytest.mark.parametrize(("speed", "cut"), [(0.48, True), (0.32, False)])
def test_rest_after_an_end_is_left_out_where_two_fifths_of_a_usual_speed_come_before(tmp_path, speed, cut):
    slower = np.r_[np.ones(400), np.linspace(1.0, speed, 100), np.full(40, speed), np.zeros(60)]  # of 100 Hz
    rng, far = np.random.default_rng(0), np.cumsum(0.01 * slower)
    for k in range(3):
        at = np.column_stack([far, np.sin(2 * far) + 0.1 * k]) + 1e-4 * rng.standard_normal((600, 2))
        write(tmp_path / f"e{k}.csv", "t,x,y", np.column_stack([0.01 * np.arange(600), at]))
    said = words(run("inspect", tmp_path / "*.csv", "--by", "savgol"))
    assert bool(re.search(r"rest: 'e0': stands still for \d+ of 600 rows .* at its end, left out", said)) == cut, said

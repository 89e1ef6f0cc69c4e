"""A policy that arrives, free and under any constraint."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import check_grad, minimize

import unconstrain as uc
from recorded import needs_data
from unconstrain.base.display import percent
from unconstrain.base.errors import InvalidDataError, ModelFileError, SettingError
from unconstrain.cli import main
from unconstrain.constraints.known import Plane, SwitchingLine
from unconstrain.evaluation.verdicts import GOOD as WELL
from unconstrain.motion.orbit import Orbit
from unconstrain.motion.potential import descended, excess, steepest
from unconstrain.paper.datasets.handwriting import SHAPES, load_handwriting

GOAL = np.array([0.3, -0.2, 0.1])
STARTS = np.random.default_rng(3).uniform(-2, 2, (40, 3))


def spiral(states):
    """Turns about an axis while it goes down: not what a straight potential would do."""
    z = states - GOAL
    return np.column_stack([-z[:, 0] - 2 * z[:, 1], 2 * z[:, 0] - z[:, 1], -0.5 * z[:, 2]])


def drifting(states):
    """As shown near the goal, and away from it for ever elsewhere."""
    away = np.linalg.norm(states - GOAL, axis=1, keepdims=True)
    return spiral(states) * (1 - 0.5 * away**2) + 0.05


SHOWN = uc.rollout(spiral, STARTS[:6] / 3, 120, 0.05, method="euler")


@pytest.fixture(scope="module")
def guided():
    return uc.Guided(drifting, GOAL, demonstrations=SHOWN, dt=0.02)


@pytest.fixture(scope="module")
def learnt():
    """A fitted policy, guided by the demonstrations that it has kept."""
    return uc.Guided(uc.LocallyLinearPolicy().fit_demonstrations(SHOWN))


def least_on_plane(potential, start, normal):
    basis = np.linalg.svd(normal[None])[2][1:]
    return minimize(lambda y: potential((start + y @ basis)[None])[0], np.zeros(2), tol=1e-10).fun


def test_every_movement_arrives(guided):
    assert (drifting(STARTS) * (STARTS - GOAL)).sum(axis=1).max() > 1.0
    for run in uc.rollout(guided, STARTS, 4000, guided.dt_, method="euler"):
        assert_allclose(run.states[-1], GOAL, atol=1e-3)


@pytest.mark.parametrize("factor", [0.1, 1.0])
def test_the_potential_falls_at_every_step_and_movements_end_where_it_is_least_on_their_plane(guided, factor):
    normals = np.random.default_rng(4).standard_normal((40, 3))
    planes = [Plane(normal) for normal in normals]
    steps = 2000 if factor == 1.0 else 300
    runs = uc.rollout(guided, STARTS, steps, factor * guided.dt_, planes, method="euler")
    for run, normal in zip(runs, normals, strict=True):
        level = guided.potential_(run.states)
        moving = level[:-1] > level[-1] * (1 + 1e-9)
        assert moving[0]
        assert (np.diff(level)[moving] < 0).all()
        assert np.ptp(run.states @ normal) < 1e-9
        if factor == 1.0:
            assert level[-1] <= least_on_plane(guided.potential_, run.states[0], normal) + 1e-5 * level[0]


def test_v_falls_as_much_as_the_ball_says_whatever_the_policy_wants():
    rng = np.random.default_rng(5)
    for size in (1e-6, 1.0, 1e6):
        wild = uc.Guided(lambda x, size=size: size * rng.standard_normal(x.shape), GOAL, demonstrations=SHOWN)
        velocities, slope = wild(STARTS), wild.potential_.gradient(STARTS)
        half = np.linalg.norm(slope, axis=1) / 2
        radius = np.maximum(half - wild.aim_.pace, half / 2)
        fall, least = -np.vecdot(slope, velocities), (velocities**2).sum(axis=1) + half**2 - radius**2
        assert (fall >= least * (1 - 1e-9)).all()


def test_what_leads_across_goes_to_the_nearest_that_is_allowed_and_what_leads_up_is_mirrored(guided):
    slope = guided.potential_.gradient(STARTS)
    half = np.linalg.norm(slope, axis=1, keepdims=True) / 2
    radius, centre = np.maximum(half - guided.aim_.pace, half / 2), -slope / 2
    across = 0.3 * half * np.cross(slope / (2 * half), [0.0, 0.6, 0.8])
    assert_allclose(
        guided.aim_.guided(STARTS, across),
        centre + radius * (across - centre) / np.linalg.norm(across - centre, axis=1, keepdims=True),
        atol=1e-12,
    )
    up = 1e4 * guided.aim_.pace * slope / (2 * half)
    share = np.maximum(2 * radius / np.linalg.norm(up - centre, axis=1, keepdims=True) - 1, 0.0)
    assert_allclose(guided.aim_.guided(STARTS, up), centre + share * (up - centre), rtol=1e-3, atol=1e-3 * half.max())


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_sharpest_bend_is_that_of_slopes_of_one_half_space(n):
    rng = np.random.default_rng(n)
    slopes, weights = rng.standard_normal((12, n)), rng.uniform(0.5, 1.0, 12)
    slopes /= np.linalg.norm(slopes, axis=1, keepdims=True)
    felt = [(slopes @ z >= 0) * weights for z in rng.standard_normal((20000, n))]
    bends = [np.linalg.eigvalsh((share * slopes.T) @ slopes)[-1] for share in np.unique(felt, axis=0)]
    assert_allclose(steepest(slopes, weights), max(bends) if n > 1 else weights.sum())


def test_what_is_allowed_is_not_touched_and_near_the_edge_little(guided):
    wanted, now = drifting(STARTS / 3), guided(STARTS / 3)
    assert_array_equal(guided(SHOWN[0].states[:5]).shape, (5, 3))
    same = (wanted == now).all(axis=1)
    assert 0 < same.sum() < len(same)
    along = STARTS[0] + np.linspace(0, 1, 20001)[:, None] * (STARTS[1] - STARTS[0])
    assert np.abs(np.diff(guided(along), axis=0)).max() < 0.02 * np.abs(guided(along)).max()


def test_a_correction_is_in_the_null_space(guided):
    projections = np.tile(uc.null_space_projection(np.array([[1.0, 2.0, -1.0]])), (40, 1, 1))
    correction = guided.under(STARTS, projections) - drifting(STARTS)
    assert np.abs(correction).max() > 0.1
    assert_allclose(uc.project(projections, correction), correction, atol=1e-10)
    assert_allclose(guided.under(STARTS, np.tile(np.eye(3), (40, 1, 1))), guided(STARTS))


def test_a_constraint_that_switches_is_followed_too(guided):
    line = SwitchingLine([[1.0, 0.3, 0.0], [0.0, 1.0, 1.0]], [0.2])
    run = uc.rollout(guided, STARTS[0], 200, guided.dt_, line)
    assert (np.diff(guided.potential_(run.states)) <= 1e-15).all()


def test_the_demonstrated_motion_is_hardly_corrected(learnt):
    states = uc.stack(SHOWN).states
    assert np.linalg.norm(learnt.correction(states)) < 0.05 * np.linalg.norm(learnt.policy(states))
    assert_allclose(learnt.goal_, GOAL, atol=0.04)


def test_units_do_not_matter(guided):
    length, time = 1024.0, 64.0  # powers of two: the same digits all the way
    scaled = [uc.Demonstration(length * d.states, length / time * d.actions, time * d.times) for d in SHOWN]
    other = uc.Guided(
        lambda x: length / time * drifting(x / length), length * GOAL, demonstrations=scaled, dt=time * 0.02
    )
    assert_allclose(other(length * STARTS), length / time * guided(STARTS), rtol=1e-3, atol=1e-3 * length / time)
    assert_allclose(other.dt_, time * guided.dt_, rtol=1e-3)


def test_a_step_is_the_prediction(guided, learnt):
    for policy in (guided, learnt):
        out = np.empty(3)
        for state, velocity in zip(STARTS, policy(STARTS), strict=True):
            assert_allclose(policy.step(state), velocity, rtol=1e-9, atol=1e-12)
            assert policy.step(list(state), out) is out
            assert_allclose(out, velocity, rtol=1e-9, atol=1e-12)


def test_a_longer_step_can_be_asked_for(guided):
    by_itself = uc.Guided(drifting, GOAL, demonstrations=SHOWN).dt_
    assert by_itself < 1.0
    assert guided.dt_ >= 0.02
    assert_allclose(uc.Guided(drifting, GOAL, demonstrations=SHOWN, dt=100.0).dt_, 100.0)
    assert by_itself / 10 <= uc.Guided(drifting, GOAL, demonstrations=SHOWN, dt=by_itself / 10).dt_ < by_itself


def test_shorter_steps_need_less_correction():
    states = uc.stack(SHOWN).states
    costs = [
        np.linalg.norm(uc.Guided(drifting, GOAL, demonstrations=SHOWN, dt=dt).correction(states)) for dt in (0.1, 0.01)
    ]
    assert costs[1] < 0.5 * costs[0]


def test_what_was_learnt_can_be_moved(learnt):
    by = np.array([1.0, -2.0, 0.5])
    elsewhere = learnt.moved(by)
    assert_allclose(elsewhere(STARTS + by), learnt(STARTS), atol=1e-12)
    assert_allclose(elsewhere.step(STARTS[0] + by), learnt.step(STARTS[0]), atol=1e-12)
    assert_allclose(elsewhere.goal_, learnt.goal_ + by)
    assert_allclose(uc.rollout(elsewhere, STARTS[0], 2000, 0.02).states[-1], learnt.goal_ + by, atol=1e-2)


@pytest.mark.parametrize("states", [[[0.0, 0.0]], [[1.0, 0.0]], [[0.0, 0.0], [1.0, 1.0]]])
def test_what_was_shown_may_be_hardly_anything(states):
    rest = uc.Demonstration(states, np.zeros_like(states))
    guided = uc.Guided(lambda x: np.ones(x.shape), [0.0, 0.0], demonstrations=rest)
    level = guided.potential_(uc.rollout(guided, [3.0, -1.0], 200, guided.dt_ / 2).states)
    assert (np.diff(level)[level[:-1] > 1e-20] < 0).all()
    assert level[-1] < level[0]


def test_it_survives_its_file(learnt, tmp_path):
    uc.save(learnt, tmp_path / "guided.npz")
    again = uc.load(tmp_path / "guided.npz", uc.Guided)
    assert_array_equal(again(STARTS), learnt(STARTS))
    assert_array_equal(again.step(STARTS[0]), learnt.step(STARTS[0]))
    assert (again.dt_, again.aim_.pace) == (learnt.dt_, learnt.aim_.pace)
    with pytest.raises(ModelFileError, match=r"expected a policy\. .* uc\.load\(path, uc\.Guided\)"):
        uc.load(tmp_path / "guided.npz")


def test_the_slope_of_v_and_of_what_it_is_learnt_by_are_those_of_finite_differences(guided):
    potential, rng = guided.potential_, np.random.default_rng(6)
    assert check_grad(lambda x: potential(x[None])[0], lambda x: potential.gradient(x[None])[0], STARTS[0]) < 1e-5
    for velocity, state in zip(3 * rng.standard_normal((30, 1, 3)), STARTS, strict=False):
        half, slope = (
            (lambda c, v=velocity: excess(v, c[None])[0][0] ** 2 / 2),
            lambda c, v=velocity: excess(v, c[None]),
        )
        assert check_grad(half, lambda c, slope=slope: slope(c)[1][0], state) < 1e-5


def test_a_potential_is_convex_and_least_at_the_goal():
    states, velocities, _ = uc.stack(SHOWN)
    potential = descended(states, velocities, GOAL)
    assert potential(GOAL[None])[0] == 0.0
    middle = potential((STARTS[::2] + STARTS[1::2]) / 2)
    assert (middle <= (potential(STARTS[::2]) + potential(STARTS[1::2])) / 2).all()
    assert (potential.weights < 0).any()
    assert potential.bends()[1].min() > -1e-9
    assert (potential.offsets >= 0).all()


@needs_data
@pytest.mark.parametrize("shape", ["Angle", "Multi_Models_3"])
def test_handwriting_arrives_from_everywhere_and_stays_as_it_was(monkeypatch, shape):
    from recorded import DATA

    monkeypatch.setenv("UNCONSTRAIN_DATA", str(DATA))
    demos = load_handwriting(shape)
    states, actions, _ = uc.stack(demos)
    policy = uc.LocallyLinearPolicy(None, learner="direct").fit_demonstrations(demos)
    guided = uc.Guided(policy, demonstrations=demos, dt=0.02)
    low, high = states.min(axis=0), states.max(axis=0)
    box = (low + high) / 2 + 1.5 * (np.random.default_rng(0).random((20, 2)) - 0.5) * (high - low)
    steps = int(4 * max(demo.times[-1] for demo in demos) / 0.02)
    runs = uc.rollout(guided, [*(demo.states[0] for demo in demos), *box], steps, 0.02)
    reach = 0.05 * np.linalg.norm(states, axis=1).max()
    assert max(np.linalg.norm(run.states[-1] - guided.goal_) for run in runs) < reach
    wanted, correction = policy(states), guided.correction(states)
    assert np.linalg.norm(correction, axis=1).sum() < 0.1 * np.linalg.norm(wanted, axis=1).sum()
    assert np.sum((wanted + correction - actions) ** 2) < 1.1 * np.sum((wanted - actions) ** 2)


@pytest.mark.parametrize(
    ("policy", "arguments", "error", "sentence"),
    [
        (drifting, {}, SettingError, "demonstrations: got none, and the policy has not kept its own"),
        (drifting, {"demonstrations": [d[:5] for d in SHOWN]}, SettingError, "goal: no demonstration ends at rest"),
        (
            np.zeros_like,  # rests at both ends
            {"demonstrations": [SHOWN[0], uc.Demonstration(SHOWN[1].states + 1, SHOWN[1].actions)]},
            InvalidDataError,
            "goal: demonstrations end at rest in places up to",
        ),
        (drifting, {"demonstrations": SHOWN, "goal": [0.0]}, InvalidDataError, "goal: got"),
        (drifting, {"demonstrations": SHOWN, "dt": 0.0}, SettingError, "dt: got 0.0"),
        (lambda x: x[:, :2], {"demonstrations": SHOWN}, SettingError, "Guided expects actions that are velocities"),
    ],
)
def test_what_cannot_be_guided_is_said(policy, arguments, error, sentence):
    with pytest.raises(error, match=sentence):
        uc.Guided(policy, **arguments)


def test_curved_states_are_refused():
    turns = uc.Demonstration([[0.1], [0.2], [0.3]], [[0.1], [0.05], [0.0]], space=uc.spaces.Circle())
    policy = uc.ParametricPolicy(uc.Affine(), learner="direct").fit_demonstrations(turns)
    with pytest.raises(SettingError, match="angles or orientations"):
        uc.Guided(policy, demonstrations=turns)


@pytest.fixture(scope="module")
def commands(tmp_path_factory):
    """Run a command in a folder of strokes that go to the goal, three of them held by planes, and come to rest."""
    folder = tmp_path_factory.mktemp("guided")
    normals = np.random.default_rng(5).normal(size=(3, 3))
    runs = [uc.rollout(spiral, start, 160, 0.05, name=f"free_{k}") for k, start in enumerate(STARTS[:3])]
    runs += [
        uc.rollout(spiral, STARTS[3 + k], 160, 0.05, Plane(each), name=f"held_{k}") for k, each in enumerate(normals)
    ]
    for one in runs:
        table = np.column_stack([one.times, one.states])
        np.savetxt(folder / f"{one.name}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    files = [str(folder / f"{one.name}.csv") for one in runs]

    def run(*args, status=0):
        filled = [
            part for arg in args for part in (files if arg == "FILES" else [str(arg).replace("HERE", str(folder))])
        ]
        ran = CliRunner().invoke(main, filled, prog_name="unconstrain")
        assert ran.exit_code == status, ran.output
        return ran.output

    return run


def flat(said):
    """Without the ends of lines."""
    return " ".join(said.split())


def test_commands_make_a_guided_policy_and_take_it(commands):
    learn = "fit", "FILES", "--state", "x,y,z", "--differentiate", "--model", "affine"
    said = commands(*learn, "--guided", "auto", "-o", "HERE/p.npz", "--report", "HERE/p.html")
    assert re.search(r"Guided: .* free at \(0\.[23]\d*, -0\.[12]\d*, (0\.1|0\.09)", said)  # not where planes stop it
    verdict, _, promise = said.partition("Guided:")
    assert "'unconstrain fit --guided" not in verdict
    assert "a velocity is added that leads down a bowl, fitted to the demonstrations, with its bottom" in promise
    assert "From every state, movements arrive" in commands("certify", "HERE/p.npz")
    assert "From every state, movements arrive" in flat(commands("info", "HERE/p.npz"))
    far = commands("rollout", "HERE/p.npz", "--start", "30,-20,10", "--steps", 1000)
    assert_allclose([*map(float, far.splitlines()[1000].split(","))][1:4], GOAL, atol=0.04)
    assert "from the goal" not in far
    rail = commands("rollout", "HERE/p.npz", "--start", "30,-20,10", "--steps", 1000, "--plane", "1,0,0")
    off = re.search(
        r"It ends (\S+) \(unit of the states\) from the goal: it rests there, as the plane holds it off", flat(rail)
    )
    last = [*map(float, rail.splitlines()[1000].split(","))][1:4]
    assert_allclose(float(off[1]), np.linalg.norm(np.subtract(last, GOAL)), rtol=0.02)
    for plane, holds in (((), ""), (("--plane", "1,0,0"), ", and may come to rest where the plane holds it off")):
        short = flat(commands("rollout", "HERE/p.npz", "--start", "30,-20,10", "--steps", 20, *plane))
        assert f"from the goal: it is still on its way (--steps){holds}." in short
    assert "explains" in commands("score", "HERE/p.npz", "FILES")
    commands("look", "HERE/p.npz", "FILES", "-o", "HERE/look.html")
    commands(*learn, "-o", "HERE/plain.npz")
    refused = commands("rollout", "HERE/plain.npz", "--start", "30,-20,10", status=2)
    assert "--start: nothing was demonstrated near" in refused


@pytest.mark.parametrize(
    ("to", "status", "said"),
    [
        ("0,0", 2, "--guided: got 2 values, expected 3"),
        ("there", 2, "Invalid value for '--guided': got 'there', expected finite numbers"),
        ("auto", 2, "--guided: demonstrations end at rest in places up to"),
    ],
)
def test_what_cannot_be_guided_to_is_said_by_the_option(commands, to, status, said):
    learn = "fit", "FILES", "--state", "x,y,z", "--differentiate", "--learner", "direct", "--model", "cubic"
    assert said in commands(*learn, "--guided", to, "-o", "HERE/none.npz", status=status)


@pytest.mark.parametrize(
    ("to", "until", "said"),
    [
        ("cycle", 100, "--guided: demonstrations make 0.0"),
        ("auto", 14, "--guided: no demonstration ends at rest"),
        ("0,0,0", 100, "--guided: got 3 values, expected 2"),
    ],
)
def test_what_no_policy_can_be_guided_to_is_said_before_it_is_learnt(monkeypatch, tmp_path, to, until, said):
    def learnt(*_):
        raise AssertionError("was learnt first")

    monkeypatch.setattr(uc.ParametricPolicy, "fit_batches", learnt)
    times, way = np.linspace(0.0, 3.0, 100), np.array([1.0, 0.5])
    for number in range(4):
        states = np.array([0.0, 3.0 * number]) + way * (1.0 - np.exp(-2.0 * times))[:, None]
        table = np.column_stack([times, states])[:until]
        np.savetxt(tmp_path / f"s_{number}.csv", table, delimiter=",", header="t,x,y", comments="")
    reading = "--state", "x,y", "--differentiate", "--model", "affine"
    output = "-o", str(tmp_path / "p.npz")
    ran = CliRunner().invoke(main, ["fit", str(tmp_path / "*.csv"), *reading, "--guided", to, *output])
    assert (ran.exit_code, said in ran.output) == (2, True), ran.output


def test_a_goal_is_where_the_policy_rests_most_though_planes_stop_others_near_it():
    planes = [Plane(each) for each in np.random.default_rng(6).normal(size=(4, 3))]
    starts = GOAL + 0.4 * np.random.default_rng(7).normal(size=(6, 3))
    held = [uc.rollout(spiral, start, 400, 0.05, plane) for start, plane in zip(starts[2:], planes, strict=True)]
    free = [uc.rollout(spiral, start, 400, 0.05) for start in starts[:2]]
    assert_allclose(uc.Guided(spiral, demonstrations=[*held, *free]).goal_, GOAL, atol=1e-3)


def around(states):
    """Goes round the unit circle, and falls onto it quickly."""
    radius = np.linalg.norm(states, axis=1, keepdims=True)
    return np.column_stack([-states[:, 1], states[:, 0]]) + 3.0 * (1.0 - radius) * states


@pytest.mark.parametrize(
    ("starts", "least", "most", "mark"),
    [
        ([[1.0, 0.0], [1.2, 0.0], [0.9, 0.0]], 0.0, 0.1, "good"),
        ([[3.0, 0.0], [0.0, 1.2], [-0.9, 0.1], [0.1, -1.0]], 0.3, 9.0, "bad"),  # one comes from far, and fast
    ],
)
def test_fit_and_info_judge_the_policy_as_it_is_guided(tmp_path, starts, least, most, mark):
    for number, run in enumerate(uc.rollout(around, starts, 150, 0.02)):
        table = np.column_stack([run.times, run.states, run.actions])
        np.savetxt(tmp_path / f"{number}.csv", table, delimiter=",", header="t,x,y,vx,vy", comments="")

    def told(*args):
        ran = CliRunner().invoke(main, [*args, "--json"])
        assert ran.exit_code == 0, ran.output
        return json.loads(ran.stdout)

    output = str(tmp_path / "p.npz")
    learn = "fit", str(tmp_path / "*.csv"), "--variance", "0.1", "--learner", "direct", "--force", "-o", output
    alone, found = told(*learn), told(*learn, "--guided", "cycle")
    assert alone["held_out"] > WELL
    assert least <= found["lost"] <= most
    assert_allclose(alone["training"] - found["training"], found["lost"], atol=0.01)
    assert_allclose(alone["held_out"] - found["held_out"], found["lost"])
    known = told("info", output)
    assert_allclose(known["explained held out"], found["held_out"], atol=1e-4)
    for one in (found, known):
        assert one["verdict"]["mark"] == mark
        share = percent(found["held_out"])
        assert one["verdict"]["said"].startswith(f"The guided policy explains {share} of held-out motion: ")
        assert f" Unguided it explains {percent(alone['held_out'])}, and misses " in one["verdict"]["said"]


@pytest.mark.parametrize(("start", "mark"), [(1.05, "good"), (1.4, "doubtful")])
def test_guides_that_retrace_what_they_were_fitted_to_make_no_doubtful_fit_a_good_one(tmp_path, start, mark):
    """Rounds that come in to a circle, which no linear policy keeps to; guided, it does."""
    for number, tilt in enumerate(([0.2, 0.0], [0.0, 0.3], [-0.2, 0.1], [0.1, -0.25])):
        at = [start * np.cos(number), start * np.sin(number), 0.0]
        run = uc.rollout(rounds, at, 200, 0.05, Plane([*tilt, 1.0]))
        table = np.column_stack([run.times, run.states])
        np.savetxt(tmp_path / f"{number}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    output = str(tmp_path / "p.npz")
    learn = "fit", str(tmp_path / "*.csv"), "--state", "x,y,z", "--differentiate", "--model", "linear", "-o", output
    ran = [
        CliRunner().invoke(main, [*arguments, "--json"])
        for arguments in (learn, (*learn, "--guided", "cycle", "--force"), ("info", output))
    ]
    alone, guided, known = [json.loads(one.stdout)["verdict"] for one in ran]
    assert [one["mark"] for one in (alone, guided, known)] == [mark] * 3
    assert "Unguided it explains about as much; what guiding takes is of what it was fitted to" in guided["said"]
    moves = "in the last round 4 of 4 go round too small" if mark == "doubtful" else "it keeps size and pace"
    unguided = "But unguided" if mark == "doubtful" else "Unguided"
    assert f"Run from the same starts, it keeps size and pace. {unguided}, {moves}." in guided["said"]
    assert f"un from the same starts, it keeps size and pace; unguided {moves}." in known["said"]
    figures = json.loads(ran[1].stdout)["ran"]
    assert re.search(
        r"^size 1\.0\d times .* recorded path; none beyond 0.83 to 1.20 times; unguided size .* recorded path", figures
    )
    assert "uided" not in alone["said"]
    assert "--guided" not in guided["next"]  # it is


def rounds(states):
    """Goes round the unit circle in x and y, and comes nearer to it slowly."""
    radius = np.linalg.norm(states[:, :2], axis=1, keepdims=True)
    flat = 2.0 * states[:, 1::-1] * [-1.0, 1.0] + 0.5 * (1.0 - radius) * states[:, :2]
    return np.hstack([flat, -states[:, 2:]])


def test_strokes_that_slow_down_but_end_in_motion_and_apart_show_no_goal():
    halves = uc.rollout(around, [[3.0, 0.0], [0.0, 1.2], [-0.9, 0.1], [0.1, -1.0]], 150, 0.02)
    speed = np.linalg.norm(halves[0].actions, axis=1)
    assert speed[-1] < 0.1 * speed.max()  # it began fast
    said = r"goal: no demonstration ends at rest, nor where another does, and they make 0\.\d\d turns in the mean"
    with pytest.raises(SettingError, match=said):
        uc.Guided.goes_round(halves)
    slowing = np.append(np.ones(110), np.zeros(40))[:, None]
    stopped = uc.Demonstration(halves[0].states, slowing * halves[0].actions)
    assert not uc.Guided.goes_round([stopped, *halves[1:]])


@needs_data
def test_all_that_was_written_shows_a_goal(monkeypatch):
    from recorded import DATA

    monkeypatch.setenv("UNCONSTRAIN_DATA", str(DATA))
    assert not any(uc.Guided.goes_round(load_handwriting(shape)) for shape in SHAPES)


def held_off(normals):
    """Movements on plates that pass the goal at some distance, and a policy that has learnt from them."""
    starts = GOAL + 0.5 * np.random.default_rng(8).uniform(-1, 1, (len(normals), 3))
    demos = [uc.rollout(spiral, x, 400, 0.025, Plane(n)) for x, n in zip(starts, normals, strict=True)]
    return demos, uc.ParametricPolicy(uc.Affine()).fit_demonstrations(demos)


def test_where_plates_held_movements_off_the_goal_it_is_where_the_policy_rests():
    demos, policy = held_off(np.random.default_rng(11).normal(size=(8, 3)))
    assert_allclose(uc.Guided(policy).goal_, GOAL, atol=0.01)
    with pytest.raises(InvalidDataError) as untold:
        uc.Guided(lambda states: policy(states), demonstrations=demos)
    assert re.search(r"give it with goal= \(the mean of their ends is goal=\(.*\)\)\.$", str(untold.value))


def near_the_goal(offsets):
    """Strokes to the goal, held by planes that pass it at small distances, and a policy learnt from them."""
    rng = np.random.default_rng(5)
    demos = []
    for off in offsets:
        normal = rng.normal(size=3) * [0.5, 0.5, 0.0] + [0.0, 0.0, 1.0]
        start = np.asarray(GOAL) + rng.uniform(-1, 1, 3)
        start += normal * (off - (start - GOAL) @ normal) / (normal @ normal)
        demos.append(uc.rollout(spiral, start, 400, 0.02, Plane(normal)))
    return demos, uc.LocallyLinearPolicy().fit_demonstrations(demos)


def test_the_goal_is_where_the_policy_rests_if_planes_held_ends_about_it():
    demos, policy = near_the_goal(np.array([-2.0, 1.0, 3.0, 2.0, -1.0, 3.0, 2.5, 3.0]) / 30)
    ends = np.array([demo.states[-1] for demo in demos])
    assert np.linalg.norm(ends.mean(axis=0) - GOAL) > 0.02
    assert_allclose(uc.Guided(policy, demonstrations=demos).goal_, GOAL, atol=2e-3)


def test_the_goal_is_where_all_ended_though_the_policy_rests_beside():
    shown = uc.rollout(spiral, STARTS, 400, 0.05)
    away = np.array([0.01, 0.0, 0.0])

    class Beside:
        """Rests beside the goal, and is sure of it."""

        covariances = staticmethod(lambda states: 1e-12 * np.eye(3)[None])
        __call__ = staticmethod(lambda states: spiral(states - away))

    goal = uc.Guided(Beside(), demonstrations=shown).goal_
    assert_allclose(goal, np.mean([demo.states[-1] for demo in shown], axis=0), atol=1e-9)


def test_where_the_policy_is_hardly_told_no_goal_is_proposed():
    demos, policy = held_off(np.random.default_rng(11).normal(size=(8, 3)))
    known = policy.covariances(GOAL[None])[0]
    policy.covariances = lambda states: [known + np.eye(3)]  # as much is open as it wants
    with pytest.raises(InvalidDataError, match=r"is told to within \d\S* only: record more, held in other ways\.$"):
        uc.Guided(policy, demonstrations=demos)


def test_where_no_cycle_is_found_the_strokes_are_named_and_not_the_rows(monkeypatch):
    def infinite(demos, policy):
        raise InvalidDataError("states: found inf at row 32, column 0")

    monkeypatch.setattr("unconstrain.motion.guided.encircled", infinite)
    said = r"orbit: demonstrations make \d\.\d\d turns in the mean, and no cycle is near them\. .* or not at all\.$"
    with pytest.raises(SettingError, match=said):
        uc.Guided(spiral, orbit="shown", demonstrations=SHOWN)


def stopped(folder, demos, rest):
    """Files of positions that end in a rest of so many samples, with noise as a tracker has it."""
    rng = np.random.default_rng(3)
    for number, demo in enumerate(demos):
        states = still(np.vstack([demo.states, np.repeat(demo.states[-1:], rest, axis=0)]))
        table = np.column_stack([0.02 * np.arange(len(states)), states + 0.002 * rng.standard_normal(states.shape)])
        np.savetxt(folder / f"s_{number}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    learn = "--state", "x,y,z", "--differentiate", "--model", "affine", "--learner", "direct"
    return "fit", str(folder / "*.csv"), *learn, "-o", str(folder / "p.npz")


def still(table):
    """With a third column of zeros, and so flat in space."""
    return np.pad(table, ((0, 0), (0, 1)))


def test_who_goes_round_and_then_stops_at_once_shows_a_cycle(tmp_path):
    demos = uc.rollout(around, [[1.0, 0.0], [0.0, 1.2], [-0.9, 0.1]], 400, 0.02)
    ran = CliRunner().invoke(main, [*stopped(tmp_path, demos, 50), "--guided", "auto"])
    assert ran.exit_code == 0, ran.output
    assert isinstance(uc.load(tmp_path / "p.npz", uc.Guided).aim_, Orbit)


def test_who_winds_down_to_several_places_is_told_of_both_options_and_the_verdict_recommends_what_works(tmp_path):
    def winding(states):
        return np.column_stack([-states[:, 0] - 4 * states[:, 1], 4 * states[:, 0] - states[:, 1]])

    runs = uc.rollout(winding, [[1.0, 0.0], [0.0, 1.2], [-0.9, 0.1]], 300, 0.02)
    demos = [replace(run, states=run.states + np.array([0.35 * k, 0.0])) for k, run in enumerate(runs)]
    learn = stopped(tmp_path, demos, 50)
    ran = CliRunner().invoke(main, [*learn, "--guided", "auto"])
    said = flat(ran.output)
    assert ran.exit_code == 2
    assert "one place; pass --guided its place, a number for each state, or --guided cycle" in said
    for name, show, advised in (("apart", demos, "--guided GOAL'"), ("one", runs, "--guided auto'")):
        folder = tmp_path / name
        folder.mkdir()
        assert CliRunner().invoke(main, stopped(folder, show, 50)).exit_code == 0
        states, velocities, _ = uc.stack(show)
        other = uc.ParametricPolicy(uc.Affine(), "direct").fit(still(states), 0.75 * still(velocities))
        uc.save(other, folder / "p.npz", uc.storage.load_notes(folder / "p.npz"))
        scored = CliRunner().invoke(main, ["score", str(folder / "p.npz"), str(folder / "s_*.csv"), "--json"])
        then = json.loads(scored.stdout)["verdict"]["next"]
        assert f"'unconstrain fit {advised}" in then

"""The default learner with the Jacobian of a task: which of its rows were held is found, and used where it explains."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import unconstrain as uc
from test_cli import refused, run, write
from unconstrain.learners.robust.held_rows import UNKNOWN, HeldRows
from unconstrain.learners.robust.noise import noise_by_differences
from unconstrain.paper.systems.arm import Arm

ARM = Arm.from_dh([1.0, 0.8, 0.6], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [2.0, 2.0, 2.0])
"""Three joints in a plane; of its hand's six coordinates, x, y and the turn about z can move."""


def planar(states):
    """Jacobian of x and y of the hand, (N, 2, 3)."""
    return ARM.jacobian(states)[:, :2]


def posture(states):
    return 0.6 * (np.array([0.4, -0.5, 0.8]) - states)


def demonstrate(held, count=24, noise=0.02, seed=1):
    """Demonstrations from any posture, each under rows of Λ J; ``held`` is Λ of each in turn, None where free."""
    rng = np.random.default_rng(seed)
    starts, demos = rng.uniform(-1.5, 1.5, (count, 3)), []
    for index, start in enumerate(starts):
        rows = held[index % len(held)]
        constraint = None if rows is None else (lambda x, t, rows=rows: np.asarray(rows) @ planar(x))
        demos += uc.rollout(posture, start[None], 40, 0.08, constraint)
    size = noise * np.sqrt(np.mean([np.mean(demo.actions**2) for demo in demos]))
    return [
        uc.Demonstration(demo.states, demo.actions + size * rng.standard_normal(demo.actions.shape), demo.times)
        for demo in demos
    ]


def learnt(demos, jacobian):
    return uc.LocallyLinearPolicy(learner=uc.Robust(jacobian=jacobian)).fit_demonstrations(demos)


def error(policy, seed=9):
    states = np.concatenate([demo.states for demo in demonstrate([None], seed=seed, noise=0.0)])
    return float(
        ((policy(states) - posture(states)) ** 2).sum() / ((posture(states) - posture(states).mean(0)) ** 2).sum()
    )


@pytest.fixture(scope="module")
def one_row():
    """All demonstrations hold the same oblique combination of x and y."""
    return demonstrate([[[0.8, 0.6]]])


def test_what_was_held_is_found_and_improves_the_policy(one_row):
    policy, without = learnt(one_row, planar), learnt(one_row, None)
    assert policy.solution_.method.startswith("rows of the Jacobian (within 0.5%) held: 1")
    assert error(policy) < 0.1 * error(without)
    assert error(policy) < 5e-3


SPATIAL = Arm.from_dh([0.0, 0.4, 0.35], [np.pi / 2, 0.0, 0.0], [0.3, 0.0, 0.0], [2.0, 2.0, 2.0])
PLACE = np.array([0.2, 0.6, 1.2])


def bent(states):
    """To a place, round about it."""
    e = PLACE - states
    return np.column_stack([0.6 * e[:, 0] + 0.5 * e[:, 1], 0.6 * e[:, 1] - 0.5 * e[:, 0], 0.7 * np.tanh(1.2 * e[:, 2])])


def on_tables(seed, count=10, free=0):
    """Movements with the hand on another table each time, the last of them free, with noise of two per cent."""
    rng = np.random.default_rng(seed)
    for index in range(count):
        normal, start = rng.normal(size=(1, 3)), PLACE + rng.uniform(-1, 1, 3) * [0.9, 0.6, 0.7]
        held = None if index >= count - free else lambda x, t, normal=normal: normal @ SPATIAL.jacobian(x)[:, :3]
        shown = uc.rollout(bent, start, 100, 0.05, held)
        noise = 0.02 * np.sqrt((shown.actions**2).mean()) * rng.normal(size=shown.actions.shape)
        yield uc.Demonstration(shown.states, shown.actions + noise, shown.times)


@pytest.mark.parametrize(("seed", "free"), [(1, 0), (3, 0), (3, 2)])
def test_rows_that_each_demonstration_held_alone_are_found(seed, free):
    demos, errors = list(on_tables(seed, free=free)), {}
    for jacobian in (SPATIAL.jacobian, None):
        policy = uc.ParametricPolicy(uc.Affine(), uc.Robust(jacobian=jacobian)).fit_demonstrations(demos)
        states = uc.stack(demos).states
        errors[policy.solution_.method] = np.linalg.norm(policy(states) - bent(states))
    (method, known), (_, unknown) = errors.items()
    assert method.startswith("own rows of the Jacobian (of ")
    assert known < 0.75 * unknown


@pytest.mark.parametrize(("seed", "first"), [(1, "free"), (4, "flat")])
def test_free_movements_of_an_arm_that_are_nearly_flat_are_not_said_to_be_held(seed, first):
    demos = list(on_tables(seed, free=2))
    found = uc.evaluation.diagnose(uc.ParametricPolicy(uc.Affine()).fit_demonstrations(demos), demos)
    assert [one.looks for one in found.movements] == 8 * ["constrained"] + [first, "free"]
    said = uc.evaluation.diagnosis.about_freedom(found)
    assert 0.75 < int(re.search(r"(\d+)% held", said)[1]) / 100 < 0.85
    assert ("recordings cannot tell" in said) == (first == "flat")


def test_much_noise_does_not_speak_against_the_right_kinematics():
    """Noise turns the directions of actions, by which a long policy looks worse than one that misses what is held."""
    demos = demonstrate([[[1.0, 0.0]]], noise=0.2)
    policy, without = learnt(demos, planar), learnt(demos, None)
    assert policy.solution_.method.startswith("rows of the Jacobian (within 0.5%) held: 1")
    assert error(policy) < 0.2 * error(without)


def test_the_rows_are_those_that_were_held_and_the_rank_is_right(one_row):
    states, actions, groups = uc.stack(one_row)
    _, groups = np.unique(groups, return_inverse=True)
    for noise in (1e-6, 1e-4):
        kinds = HeldRows(actions, planar(states), groups, noise).kinds(0.02)
        assert [len(rows) for rows in kinds.rows] == [1]
        direction = kinds.rows[0][0] / np.linalg.norm(kinds.rows[0][0])
        assert abs(direction @ [0.8, 0.6]) > 0.999
        assert (kinds.labels != UNKNOWN).all()


def test_demonstrations_of_two_kinds_and_free_ones_are_told_apart():
    demos = demonstrate([[[1.0, 0.0]], [[0.0, 1.0]], None], count=36)
    states, actions, groups = uc.stack(demos)
    _, groups = np.unique(groups, return_inverse=True)
    kinds = HeldRows(actions, planar(states), groups, noise_by_differences(actions, groups)).kinds(0.02)
    assert sorted(len(rows) for rows in kinds.rows) == [1, 1]
    first, second = (kinds.labels[0], kinds.labels[1])
    assert first != second
    expected = np.tile([first, second, UNKNOWN], 12)
    assert (kinds.labels == expected).all()
    policy = learnt(demos, planar)
    assert "of the Jacobian" in policy.solution_.method
    assert error(policy) < 1e-4


def test_projections_are_of_the_rows_held(one_row):
    states, actions, groups = uc.stack(one_row)
    _, groups = np.unique(groups, return_inverse=True)
    kinds = HeldRows(actions, planar(states), groups, 1e-6).kinds(0.02)
    N = kinds.projections(planar(states), groups)
    truth = uc.constraints.JacobianRows(lambda x: np.array([[0.8, 0.6]]) @ planar(x), (0,))(
        states, np.zeros(len(states))
    )
    assert_allclose(N @ N, N, atol=1e-12)
    leak = (truth @ N)[:, 0]
    assert np.linalg.norm(leak, axis=1).mean() < 0.02 * np.linalg.norm(truth[:, 0], axis=1).mean()


@pytest.mark.parametrize("noise", [0.02, 0.2])
@pytest.mark.parametrize("case", ["free", "wrong kinematics"])
def test_where_the_jacobian_explains_nothing_the_result_is_as_without(case, noise):
    ratios = []
    for seed in (1, 4) if noise > 0.1 else (1,):  # much noise hides which of two is a little better
        if case == "free":
            demos, jacobian = demonstrate([None], noise=noise, seed=seed), planar
        else:
            demos = demonstrate([[[0.8, 0.6]]], noise=noise, seed=seed)
            jacobian = lambda states: planar(np.roll(states, 1, axis=1) + 1.0)  # noqa: E731
        policy, without = learnt(demos, jacobian), learnt(demos, None)
        said = [note for note in policy.solution_.notes if note.startswith("The Jacobian that was given is not used: ")]
        assert bool(said) == (policy.solution_.method == without.solution_.method)
        assert not any("Jacobian" in note for note in without.solution_.notes)
        ratios.append(error(policy) / error(without))
    assert np.exp(np.log(ratios).mean()) < 1.01
    assert max(ratios) < 1.05


def test_a_jacobian_is_in_the_units_of_the_data_whatever_the_scale(one_row):
    units = np.array([180.0, 180.0, 1.0]) / np.pi  # two joints in degrees
    demos = [uc.Demonstration(one.states * units, one.actions * units, one.times) for one in one_row]
    policy = uc.LocallyLinearPolicy(learner=uc.Robust(jacobian=lambda q: planar(q / units) / units), scale=units)
    policy.fit_demonstrations(demos)
    plain, states = learnt(one_row, planar), one_row[0].states
    assert policy.solution_.method == plain.solution_.method
    assert_allclose(policy(states * units) / units, plain(states), atol=1e-6)


def test_a_demonstration_too_short_to_be_looked_at_is_of_no_kind(one_row):
    short = [one_row[0][:39], *one_row[1:9], one_row[9][:1]]  # of all rows, every second is looked at
    states, actions, groups = uc.stack(short)
    kinds = HeldRows(actions, planar(states), groups, 1e-4).kinds(0.02)
    assert kinds.labels.tolist() == [0] * 9 + [UNKNOWN]


def test_a_jacobian_of_another_shape_is_refused(one_row):
    with pytest.raises(
        uc.errors.InvalidDataError, match=r"jacobian: got an array of shape \(\d+, 3\), expected \(\d+, rows, 3"
    ):
        learnt(one_row, lambda states: states)
    with pytest.raises(uc.errors.InvalidDataError, match=r"jacobian: got an array of shape \(\d+, 0, 3\)"):
        learnt(one_row, lambda states: planar(states)[:, :0])
    with pytest.raises(uc.errors.InvalidDataError, match="jacobian: found NaN"):
        learnt(one_row, lambda states: np.full((len(states), 1, 3), np.nan))


def test_the_policy_is_stored_without_the_jacobian(one_row, tmp_path):
    policy = learnt(one_row, planar)
    uc.save(policy, tmp_path / "policy.npz")
    loaded = uc.load(tmp_path / "policy.npz")
    assert loaded.learner == uc.Robust()
    assert_allclose(loaded(one_row[0].states), policy(one_row[0].states))


def test_on_the_command_line_it_is_that_of_a_robot_file(tmp_path):
    links, lengths = ("base", "upper", "lower", "palm", "hand"), (0.0, 1.0, 0.8, 0.6)
    kinds = ("continuous",) * 3 + ("fixed",)
    joints = [
        f'<joint name="{one}" type="{kind}"><parent link="{one}"/><child link="{next_}"/>'
        f'<origin xyz="{length} 0 0"/><axis xyz="0 0 1"/></joint>'
        for one, next_, length, kind in zip(links, links[1:], lengths, kinds, strict=False)
    ]
    robot = "".join(f'<link name="{one}"/>' for one in links) + "".join(joints)
    (tmp_path / "robot.urdf").write_text(f'<robot name="planar">{robot}</robot>')
    for k, one in enumerate(demonstrate([[[0.8, 0.6]]], count=8)):
        write(tmp_path / f"{k}.csv", "t,a,b,c,va,vb,vc", np.column_stack([one.times, one.states, one.actions]))
    asked = ("fit", tmp_path / "*.csv", "--model", "affine", "-o", tmp_path / "p.npz", "--force")
    known = ("--jacobian", tmp_path / "robot.urdf", "--tip", "hand")
    assert "rows of the Jacobian" not in run(*asked)
    without = error(uc.load(tmp_path / "p.npz"))
    said = run(*asked, *known, "-v")
    assert "Learnt as rows of the Jacobian (within 0.5%) held: 1: with so many directions of the task held" in said
    assert all(
        line.strip().endswith("kind of demonstration") for line in said.splitlines() if line.startswith("rows of")
    )
    assert "is not used" not in said
    assert error(uc.load(tmp_path / "p.npz")) < 0.1 * without
    rng, starts = np.random.default_rng(0), "t,a,b,c,va,vb,vc"
    for k in range(8):  # held along a direction of joint angles, which is none of the hand's
        one = demonstrate([None], count=8, seed=5)[k]
        across = np.eye(3)[k % 3] + 0.1 * rng.standard_normal(3)
        held = uc.project(uc.null_space_projection(across[None, None]), one.actions)
        write(tmp_path / f"{k}.csv", starts, np.column_stack([one.times, one.states, held]))
    said = run(*asked, *known).splitlines()
    after = said[next(k for k, line in enumerate(said) if line.startswith("Learnt as")) + 1]
    assert "The Jacobian that was given is not used: " in after
    assert "is not used" not in run(*asked)
    assert "--jacobian and --tip belong together" in refused(*asked, *known[:2])
    assert "--jacobian: belongs to the robust learner, got --learner direct." in refused(
        *asked, *known, "--learner", "direct"
    )

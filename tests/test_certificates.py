"""What is guaranteed of motion, and what refutes it."""

import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose

import unconstrain as uc
from unconstrain.cli import main
from unconstrain.constraints.known import Plane

GOAL = np.array([0.3, -0.2, 0.1])
AROUND = GOAL + np.random.default_rng(0).uniform(-1, 1, (30, 3))


def inwards(states):
    return -(states - GOAL) * (1.0 + (states**2).sum(axis=1, keepdims=True) / 4)


def two_goals(states):
    """Each side of x = 0 has its own."""
    return np.column_stack([np.where(states[:, 0] > 0, 1.0, -1.0), np.zeros((len(states), 2))]) - states


SHOWN = uc.rollout(lambda states: -(states - GOAL), AROUND[:5], 100, 0.05, method="euler")
POLICY = uc.LocallyLinearPolicy(None, learner="direct").fit_demonstrations(SHOWN)


def cycle(states):
    return np.column_stack([-states[:, 1], states[:, 0], -states[:, 2]])


@pytest.mark.parametrize(
    "guided",
    [
        uc.Guided(two_goals, GOAL, demonstrations=SHOWN),
        uc.Guided(cycle, orbit=uc.rollout(cycle, [1.0, 0.0, 0.0], 130, 0.05, method="rk4").states),
    ],
    ids=["goal", "cycle"],
)
def test_what_is_guided_is_guaranteed_whatever_the_policy(guided):
    found = uc.certify(guided, AROUND)
    assert found.holds
    assert found.start is None
    assert "under any flat constraint" in found.said


@pytest.mark.parametrize("part", ["weights", "offsets"])
def test_a_potential_that_is_not_convex_is_found_out(part):
    guided = uc.Guided(two_goals, GOAL, demonstrations=SHOWN)
    wrong = {part: -np.abs(getattr(guided.potential_, part)) - 0.1}
    guided.aim_ = replace(guided.aim_, potential=replace(guided.potential_, **wrong))
    found = uc.certify(guided, AROUND)
    assert not found.holds
    assert found.said.startswith("not guaranteed: ")


@pytest.mark.parametrize(("back", "holds"), [(0.9, True), (1.1, False)])
def test_a_slope_may_be_taken_back_farther_out_but_not_more_than_it_is(back, holds):
    guided = uc.Guided(two_goals, GOAL, demonstrations=SHOWN)
    old, way = guided.potential_, np.array([[0.6, 0.0, 0.8]] * 2)
    new = {"directions": way, "offsets": [0.1, 0.4], "weights": old.weights[0] * np.array([1.0, -back])}
    parts = {name: np.concatenate([getattr(old, name), each]) for name, each in new.items()}
    guided.aim_ = replace(guided.aim_, potential=replace(old, **parts))
    assert uc.certify(guided, AROUND).holds == holds


def test_an_affine_policy_is_guaranteed_by_its_eigenvalues():
    turns = np.array([[-1.0, 3.0, 0.0], [-3.0, -0.5, 0.0], [0.0, 0.0, -2.0]])
    found = uc.certify(lambda states: (states - GOAL) @ turns.T, AROUND)
    assert found.holds
    assert "at 0.5 per second" in found.said


def test_an_affine_policy_that_does_not_contract_is_refuted_by_a_start_and_a_plane():
    # Stable when free: eigenvalues -1 and -1; on the plane along the diagonal it leaves.
    shear = np.array([[-1.0, 4.0], [0.0, -1.0]])

    def sheared(states):
        return states @ shear.T

    found = uc.certify(sheared, AROUND[:, :2])
    assert not found.holds
    run = uc.rollout(sheared, found.start, 200, 0.05, Plane(found.normal))
    assert np.linalg.norm(run.states[-1]) > 10 * np.linalg.norm(run.states[0])
    free = uc.rollout(sheared, found.start, 400, 0.05)
    assert_allclose(free.states[-1], 0.0, atol=1e-3)


def test_a_movement_that_does_not_arrive_is_a_counterexample():
    found = uc.certify(two_goals, AROUND)
    assert not found.holds
    plane = None if found.normal is None else Plane(found.normal)
    ends = [uc.rollout(two_goals, start, 400, 0.05, plane).states[-1] for start in (found.start, -found.start)]
    assert np.linalg.norm(ends[0] - ends[1]) > 0.5


def test_where_most_movements_end_is_told_and_that_they_end_nowhere():
    def seldom(states):
        return np.where(states[:, :1] > 1.0, two_goals(states / 2.0), inwards(states))

    assert "movements go on, as on a cycle" in uc.certify(lambda x: cycle(x) + 1e-3 * x**2, AROUND).said
    assert "movements do not end in one place" in uc.certify(lambda x: -0.1 * np.sin(9.0 * x), AROUND).said
    assert re.search(r"of 60 movements ([1-9]|1\d) do not end at \(0\.3", uc.certify(seldom, AROUND).said)


def test_nothing_is_promised_of_a_policy_that_only_seems_to_arrive():
    found = uc.certify(inwards, AROUND)
    assert not found.holds
    assert found.start is None
    assert "movements end in one place" in found.said


def test_ends_a_full_turn_apart_are_one_place(tmp_path):
    rng = np.random.default_rng(0)
    angles = rng.uniform(-3.0, 3.0, (200, 1))
    turns = uc.spaces.Circle()
    back = uc.LocallyLinearPolicy(None, learner="direct", space=turns).fit(angles, -np.sin(angles))
    found = uc.certify(back, np.array([[2.0], [8.0], [-7.0]]))
    assert "movements end in one place" in found.said
    halves = uc.LocallyLinearPolicy(None, learner="direct", space=turns).fit(angles, -np.sin(2 * angles))
    assert not uc.certify(halves, np.array([[2.0], [8.0]])).holds
    assert uc.certify(halves, np.array([[2.0], [8.0]])).start is not None
    uc.save(back, tmp_path / "turning.npz")
    told = CliRunner().invoke(main, ["certify", str(tmp_path / "turning.npz")])
    assert told.exit_code == 3
    assert "movements end in one place" in " ".join(told.output.split())


def test_on_the_command_line_the_exit_code_says_it(tmp_path):
    uc.save(uc.Guided(POLICY, demonstrations=SHOWN), tmp_path / "guided.npz")
    uc.save(POLICY, tmp_path / "plain.npz")
    good, bad, wrong = (
        CliRunner().invoke(main, ["certify", str(tmp_path / name)]) for name in ("guided.npz", "plain.npz", "none.npz")
    )
    assert (good.exit_code, bad.exit_code, wrong.exit_code) == (0, 3, 2)
    assert good.output.startswith("✔")
    flat = " ".join(bad.output.split())
    assert "From every state, movements arrive: free at (0.3" in " ".join(good.output.split())
    assert "Do not trust: A constraint that moves or is not told, or an obstacle," in good.output
    assert bad.output.startswith("✖")
    units = " Lengths are in the unit of the states, and all rates per second."
    assert all(units in " ".join(one.output.split()) for one in (good, bad))
    notes = {"recipe": {"states": ["x", "y", "z"], "differentiate": "savgol"}, "units": dict.fromkeys("xyz", "mm")}
    uc.save(uc.Guided(POLICY, demonstrations=SHOWN), tmp_path / "mm.npz", notes)
    assert "Lengths are in mm," in " ".join(
        CliRunner().invoke(main, ["certify", str(tmp_path / "mm.npz")]).output.split()
    )
    assert "guaranteed" in bad.output
    assert f"\n    unconstrain export {tmp_path / 'guided.npz'} -o policy.c\n" in good.output
    assert "Next: To run free (under a new constraint, compare it" in " ".join(good.output.split())
    assert "Next: 'unconstrain fit --guided cycle', if it is to go round, or 'unconstrain fit --guided GOAL'" in flat
    assert all(f"--guided {to} -o guided.npz" in bad.output for to in ("cycle", "GOAL"))
    assert not re.search(r"by V|V falls|as V", good.output)
    assert "That it moves as demonstrated is not guaranteed: 'unconstrain score'" in " ".join(good.output.split())

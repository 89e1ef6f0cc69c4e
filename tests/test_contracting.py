"""Learning with the guarantee inside: models that contract."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import minimize

import unconstrain as uc
from unconstrain.base.errors import MissingExtraError, SettingError
from unconstrain.constraints.known import Plane
from unconstrain.risks import inconsistency, standard_risk, vec

GOAL = np.array([0.3, -0.2, 0.1])
RNG = np.random.default_rng(0)
STATES = RNG.uniform(-1, 1, (300, 3))
FAR = GOAL + RNG.uniform(-3, 3, (40, 3))


def turning(states):
    """Leaves along the first axis, and turns the other way on each side of it."""
    z = states - GOAL
    turn = 2 * np.sign(z[:, 0])
    return np.column_stack([0.3 * z[:, 0], -z[:, 1] - turn * z[:, 2], turn * z[:, 1] - 0.2 * z[:, 2]])


def held(velocities):
    """Each third demonstration along each axis is held."""
    normals = np.eye(3)[np.arange(len(velocities)) // 10 % 3]
    return velocities - normals * np.vecdot(normals, velocities)[:, None]


GROUPS = np.arange(300) // 10


@pytest.fixture(scope="module")
def local():
    learner = uc.Contracting(rate=0.4, goal=GOAL, softness=0.1)
    return uc.LocallyLinearPolicy(0.5, learner=learner).fit(STATES, held(turning(STATES)), groups=GROUPS)


def affine(learner, states=STATES[:, :2], actions=None):
    velocities = held(turning(STATES))[:, :2] if actions is None else actions
    return uc.ParametricPolicy(uc.Affine(), learner).fit(states, velocities, groups=GROUPS)


def test_it_is_the_least_loss_among_those_that_contract():
    learner = uc.Contracting(rate=0.5, softness=0.2)
    policy = affine(learner)
    whole, unit = policy.training_.folds.whole, policy.training_.action_unit
    objective = inconsistency(whole) + 0.2 * standard_risk(whole)
    scale = policy.features_.scale

    def weights(free):
        """All Jacobians that contract: −(rate I + L Lᵀ) and a turn."""
        a, b, c, turn, *rest = free
        root = np.array([[a, 0.0], [b, c]])
        jacobian = -0.5 * np.eye(2) - root @ root.T + turn * np.array([[0.0, 1.0], [-1.0, 0.0]])
        return np.column_stack([jacobian * scale, rest])[None] / unit

    losses = [
        minimize(lambda free: objective(vec(weights(free)))[0], start, tol=1e-14).fun
        for start in np.random.default_rng(1).standard_normal((5, 6))
    ]
    assert_allclose(objective(vec(policy.solution_.weights / unit))[0], min(losses), rtol=1e-6)
    plain = affine(uc.Hybrid(threshold=0.0, softness=0.2))
    assert objective(vec(plain.solution_.weights / unit))[0] < 0.999 * min(losses)


def test_what_contracts_by_itself_is_learnt_as_by_the_hybrid():
    velocities = held(-2.0 * STATES @ np.array([[1.0, 0.4, 0.0], [-0.7, 1.0, 0.0], [0.0, 0.0, 1.0]]) + 0.3)
    contracting, plain = (
        uc.ParametricPolicy(uc.Affine(), learner).fit(STATES, velocities, groups=GROUPS)
        for learner in (uc.Contracting(rate=0.5, softness=0.0), uc.Hybrid(threshold=0.0))
    )
    assert_allclose(contracting(STATES), plain(STATES), atol=1e-5)
    assert contracting.solution_.method == "contracting"


def test_movements_of_one_model_come_together_on_every_plane():
    policy = uc.ParametricPolicy(uc.Affine(), uc.Contracting(0.4)).fit(STATES, held(turning(STATES)), groups=GROUPS)
    found = uc.certify(policy, STATES)
    assert found.holds
    assert "come together at 0.4 per second" in found.said
    plane = Plane([0.5, -0.3, 1.0])
    one, other = uc.rollout(policy, FAR[:2] - np.outer((FAR[:2] - 1) @ plane.normal, plane.normal), 300, 0.01, plane)
    apart = np.linalg.norm(one.states - other.states, axis=1)
    assert (apart[1:] <= apart[:-1] * (1 - 0.4 * 0.01 * 0.9)).all()


def test_blended_the_distance_to_the_goal_falls_everywhere(local):
    assert len(local.solution_.weights) > 5
    assert_allclose(local(GOAL[None]), 0.0, atol=1e-12)
    for states in (FAR, GOAL + 100 * (FAR - GOAL), GOAL + 1e-3 * (FAR - GOAL)):
        z = states - GOAL
        assert (np.vecdot(z, local(states)) <= -0.4 * np.vecdot(z, z) * (1 - 1e-6)).all()


def test_on_planes_through_the_goal_it_arrives_and_on_others_ends_as_near_as_is_said(local):
    said = uc.certify(local, STATES)
    assert said.holds
    assert "(0.3, -0.2, 0.1)" in said.said
    assert "at 0.4 per second" in said.said
    near = float(said.said.rsplit("within ", 1)[1].split()[0])
    normals = FAR[:6] / np.linalg.norm(FAR[:6], axis=1, keepdims=True)
    for off in (0.0, 0.5):
        starts = FAR[20:26] - normals * (np.vecdot(normals, FAR[20:26] - GOAL) - off)[:, None]
        for run, normal in zip(uc.rollout(local, starts, 1000, 0.02, list(map(Plane, normals))), normals, strict=True):
            assert np.linalg.norm(run.states[-1] - GOAL - off * normal) <= near * off + 1e-3


def test_a_blend_of_which_one_model_leaves_is_not_certified(local):
    other = uc.LocallyLinearPolicy(0.5, learner="direct").fit(STATES, turning(STATES))
    assert not uc.certify(other, STATES).holds


def test_it_survives_its_file(local, tmp_path):
    uc.save(local, tmp_path / "policy.npz")
    again = uc.load(tmp_path / "policy.npz")
    assert_array_equal(again(FAR), local(FAR))
    assert uc.certify(again, STATES).holds
    assert_allclose(again.fit(STATES, held(turning(STATES)), groups=GROUPS)(FAR), local(FAR))


def test_units_do_not_matter(local):
    learner = uc.Contracting(rate=0.4 / 60, goal=1e3 * GOAL, softness=0.1)
    other = uc.LocallyLinearPolicy(0.5e6, learner=learner)
    other.fit(1e3 * STATES, 1e3 / 60 * held(turning(STATES)), groups=GROUPS)
    assert_allclose(other(1e3 * FAR), 1e3 / 60 * local(FAR), atol=1e-3)


@pytest.mark.parametrize(
    ("policy", "sentence"),
    [
        (uc.LocallyLinearPolicy(0.5, learner=uc.Contracting()), "goal: got none for local models"),
        (uc.ParametricPolicy(uc.Polynomial(2), uc.Contracting()), "Contracting expects affine models"),
        (uc.ParametricPolicy(uc.Affine(), uc.Contracting(goal=[0.0, 0.0])), "goal: got"),
        (uc.ParametricPolicy(uc.Affine(), uc.Contracting(), scale=[1.0, 2.0, 3.0]), "scale: got one, and Contracting"),
    ],
)
def test_what_cannot_contract_is_said(policy, sentence):
    with pytest.raises(uc.UnconstrainError, match=sentence):
        policy.fit(STATES, turning(STATES))


@pytest.mark.parametrize("settings", [{"rate": 0.0}, {"softness": -1.0}])
def test_settings_are_checked(settings):
    with pytest.raises(SettingError):
        uc.Contracting(**settings)


def test_without_the_solver_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    with pytest.raises(MissingExtraError, match=r"unconstrain\[certify\]"):
        affine(uc.Contracting())

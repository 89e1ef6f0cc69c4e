"""How far a policy is from the truth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import naive
import unconstrain as uc
from samples import PLATES, draw, off_everywhere, on_plates, turning
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.constraints.known import Plane
from unconstrain.risks import along_motion


def demonstrations(seed=0, noise=0.0, groups=3):
    data = draw(seed, samples=30, noise=noise)
    pick = [data.groups % groups == g for g in range(groups)]
    return [
        uc.Demonstration(
            data.states[r], data.actions[r], truth=uc.Truth(data.policy[r], data.projections[r]), name=f"d{g}"
        )
        for g, r in enumerate(pick)
    ]


def guess(states):
    return np.column_stack([states[:, 0], 0.5 + 0 * states[:, 1]])


def loops(policy, demos):
    """UPE, CPE and inconsistency, one sample after the other."""
    free = constrained = inconsistent = 0.0
    for demo in demos:
        for x, u, pi, N in zip(demo.states, demo.actions, demo.truth.policy, demo.truth.projections, strict=True):
            error = pi - policy(x[None])[0]
            free += error @ error
            constrained += (N @ error) @ (N @ error)
            inconsistent += naive.inconsistency(u[None], policy(x[None]))
    return free, constrained, inconsistent


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_errors_are_those_of_plain_loops(noise):
    demos = demonstrations(noise=noise)
    free, constrained, inconsistent = loops(guess, demos)
    assert uc.upe(guess, demos) == pytest.approx(free)
    assert uc.cpe(guess, demos) == pytest.approx(constrained)
    assert uc.inconsistency(guess, demos) == pytest.approx(inconsistent)


def test_normalised_errors_are_divided_by_samples_and_variance():
    demos = demonstrations()
    pi = np.concatenate([demo.truth.policy for demo in demos])
    norm = len(pi) * (pi[:, 0].var() + pi[:, 1].var())
    for plain, normalised in ((uc.upe, uc.nupe), (uc.cpe, uc.ncpe), (uc.inconsistency, uc.ninconsistency)):
        assert normalised(guess, demos) == pytest.approx(plain(guess, demos) / norm)


@given(st.integers(0, 1000))
def test_they_are_ordered_sample_by_sample(seed):
    (demo,) = demonstrations(seed, groups=1)
    for n in range(len(demo)):
        one = demo[n : n + 1]
        assert uc.inconsistency(guess, one) <= uc.cpe(guess, one) + 1e-12
        assert uc.cpe(guess, one) <= uc.upe(guess, one) + 1e-12


def test_in_the_plane_behind_one_constraint_inconsistency_is_cpe():
    demos = demonstrations()
    assert uc.inconsistency(guess, demos) == pytest.approx(uc.cpe(guess, demos))


def test_the_true_policy_has_no_error():
    from samples import spiral

    for metric in (uc.nupe, uc.ncpe, uc.ninconsistency):
        assert_allclose(metric(spiral, demonstrations()), 0, atol=1e-20)


def test_the_mean_of_a_free_policy_has_an_error_of_one():
    (demo,) = demonstrations(groups=1)
    assert uc.nupe(lambda x: np.tile(demo.truth.policy.mean(axis=0), (len(x), 1)), demo) == pytest.approx(1.0)


def test_without_a_truth_a_constraint_tells_the_projection():
    rng = np.random.default_rng(0)
    states, wanted = rng.standard_normal((20, 3)), rng.standard_normal((20, 3))
    normal = np.array([0.0, 0.6, 0.8])
    N = np.eye(3) - np.outer(normal, normal)
    demo = uc.Demonstration(states, wanted @ N, np.arange(20.0))
    expected = sum(np.sum((u - N @ x) ** 2) for u, x in zip(demo.actions, states, strict=True))
    variance = demo.actions.var(axis=0).sum()
    assert uc.cpe(lambda x: x, demo, Plane(normal)) == pytest.approx(expected)
    assert uc.ncpe(lambda x: x, demo, Plane(normal)) == pytest.approx(expected / (20 * variance))
    assert uc.ninconsistency(lambda x: x, demo) == pytest.approx(
        naive.inconsistency(demo.actions, states) / (20 * variance)
    )


def test_a_constraint_goes_by_the_demonstration_s_clock():
    seen = []

    def constraint(states, times):
        seen.append(times)
        return np.zeros((len(states), 1, 2))

    states = np.random.default_rng(0).standard_normal((3, 2))
    uc.cpe(
        lambda x: x,
        [uc.Demonstration(states, states, [1, 2, 3]), uc.Demonstration(states, states, [4, 5, 6])],
        constraint,
    )
    assert_allclose(seen, [[1, 2, 3], [4, 5, 6]])


TIMELESS = {
    "plane": uc.constraints.Plane([1.0, 2.0]),
    "as many as there are times": lambda states, times: np.ones((len(times), 1, 2)),
    "by shape": lambda states, times: np.ones((*times.shape, 1, 2)),
}

TIMED = {
    "switching line": uc.constraints.SwitchingLine([[1.0, 0.0], [0.0, 1.0]], [0.5]),
    "aligned": uc.constraints.PolicyAligned(lambda states: states, [0.1, 0.2], 0.02),
    "comparison": lambda states, times: np.where((times < 1)[:, None, None], [[1.0, 0.0]], [[0.0, 1.0]]),
    "arithmetic": lambda states, times: np.stack([0.5 * times, 1 - times], axis=-1)[:, None, :],
    "function": lambda states, times: np.stack([np.sin(times), np.cos(times)], axis=-1)[:, None, :],
    "conversion": lambda states, times: np.eye(2)[(np.asarray(times) > 1).astype(int)][:, None, :],
    "method": lambda states, times: np.eye(2)[times.astype(int)][:, None, :],
    "loop": lambda states, times: np.array([[[1.0, time]] for time in times]),
    "first": lambda states, times: np.full((len(states), 1, 2), float(times[0])),
}


@pytest.mark.parametrize("constraint", TIMELESS.values(), ids=TIMELESS)
def test_a_constraint_that_does_not_read_times_needs_none(constraint):
    states = np.random.default_rng(0).standard_normal((3, 2))
    timed, untimed = uc.Demonstration(states, states, [0, 1, 2]), uc.Demonstration(states, states)
    assert uc.cpe(np.sin, untimed, constraint) == uc.cpe(np.sin, timed, constraint)


@pytest.mark.parametrize("constraint", TIMED.values(), ids=TIMED)
def test_a_constraint_that_reads_times_is_no_error_only_where_there_are_some(constraint):
    states = np.random.default_rng(0).standard_normal((3, 2))
    uc.cpe(np.sin, uc.Demonstration(states, states, [0, 1, 1]), constraint)
    with pytest.raises(InvalidDataError, match=r"'log' has no times, and the constraint depends on them: expected one"):
        uc.ncpe(np.sin, uc.Demonstration(states, states, name="log"), constraint)
    with pytest.raises(InvalidDataError, match=r"^a demonstration has no times, and"):
        uc.cpe(np.sin, uc.Demonstration(states, states), constraint)


def test_a_constraint_of_another_shape_is_refused():
    demo = uc.Demonstration(np.ones((3, 2)), np.ones((3, 2)))
    with pytest.raises(
        SettingError, match=r"constraint: got A of shape \(3, 1, 3\) for 3 states, expected \(3, k, 2\)"
    ):
        uc.cpe(np.sin, demo, uc.constraints.Plane([0, 0, 1]))


def test_a_policy_of_one_dimension_may_be_flat():
    demo = uc.Demonstration([[0.0], [1.0]], [[1.0], [3.0]])
    assert uc.inconsistency(lambda x: x[:, 0], demo) == pytest.approx(1.0 + 4.0)


@pytest.mark.parametrize("predict", [lambda x: x[:, :1], lambda x: x.T, lambda x: x.ravel(), lambda x: x[:-1]])
def test_actions_of_another_shape_are_refused_and_never_reshaped(predict):
    with pytest.raises(SettingError, match=r"policy: got actions of shape .* for 30 states, expected \(30, 2\)"):
        uc.inconsistency(predict, demonstrations())


def test_errors_that_need_the_truth_say_so():
    (known,) = demonstrations(groups=1)
    unknown = uc.Demonstration(known.states, known.actions, name="log")
    with pytest.raises(
        InvalidDataError, match=r"demonstration 1 \('log'\) has no truth, and this error needs the true"
    ):
        uc.nupe(guess, [known, unknown])
    with pytest.raises(InvalidDataError, match=r"'log' has no truth that tells how it was constrained"):
        uc.ncpe(guess, unknown)


@pytest.mark.parametrize("value", [0.0, 0.1, 1e8])
def test_a_policy_that_never_changes_cannot_normalise(value):
    demo = uc.Demonstration(np.arange(7.0)[:, None], np.full((7, 1), value))
    with pytest.raises(InvalidDataError, match="the policy is the same at every sample"):
        uc.ninconsistency(lambda x: x, demo)


@pytest.mark.parametrize("metric", [uc.upe, uc.cpe, uc.inconsistency, uc.nupe, uc.ncpe, uc.ninconsistency])
def test_no_demonstration_has_no_error(metric):
    with pytest.raises(InvalidDataError, match="got no demonstration, expected at least one"):
        metric(guess, [])


@pytest.mark.parametrize("metric", [uc.upe, uc.cpe, uc.inconsistency])
def test_demonstrations_of_different_width_are_refused(metric):
    (demo,) = demonstrations(groups=1)
    truth = uc.Truth(np.ones((2, 1)), np.ones((2, 1, 1)))
    odd = uc.Demonstration(np.ones((2, 1)), np.ones((2, 1)), truth=truth, name="odd")
    with pytest.raises(InvalidDataError, match=r"demonstration 1 \('odd'\) has 1 state and 1 action columns"):
        metric(guess, [demo, odd])


@pytest.mark.parametrize("resting", [0, 200])
def test_what_rests_against_something_does_not_count_by_its_noise(resting):
    """Against a plane the policy pushes on while only noise moves: in its direction nothing is missed."""
    rng = np.random.default_rng(0)
    moving = uc.rollout(lambda x: -x, [1.0, 0.5], 60, 0.05)
    noise = 0.01 * rng.standard_normal((resting, 2))
    states = np.vstack([moving.states, np.tile([1.0, 0.0], (resting, 1))])
    demo = uc.Demonstration(states, np.vstack([moving.actions, noise]))
    usual = float(np.sqrt((moving.actions**2).sum(axis=1).mean()))

    def explained(policy, **how):
        missed, motion = uc.evaluation.metrics.along_motion(policy, demo, **how)
        return 1.0 - missed / motion

    assert explained(lambda x: -x, usual=usual) > 0.95
    assert 0.85 < explained(lambda x: -0.7 * x, usual=usual) < 0.95
    assert explained(np.zeros_like, usual=usual) == 0.0
    assert (uc.ninconsistency(lambda x: -x, demo) > 0.5) == (resting > 0)  # which counts it


MATRIX, GOAL = np.array([[1.0, 0.2], [-0.1, 1.1]]), np.array([0.9, 0.8])


def towards_goal(states, degrees=0.0):
    """A policy of two joints; turned, a wrong one."""
    return -(states - GOAL) @ MATRIX.T @ rotation(degrees).T


def rotation(degrees):
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, -sine], [sine, cosine]])


def jacobian(joints):
    """Of the hand of a planar arm with links of 30 and 25 cm, (N, 2, 2)."""
    first, both = joints[:, 0], joints.sum(axis=1)
    along = 0.25 * np.stack([-np.sin(both), np.cos(both)], axis=1)
    return np.stack([0.3 * np.stack([-np.sin(first), np.cos(first)], axis=1) + along, along], axis=2)


def reaches(noise, seed=3):
    """Six movements along lines of the hand that leave little of the policy, from positions by differences."""
    rng = np.random.default_rng(seed)
    for side in (1, -1) * 3:
        start = GOAL + rng.uniform(0.3, 0.6, 2) * np.where(rng.random(2) < 0.5, -1, 1)
        normal = rotation(10 * side) @ jacobian(start[None])[0] @ towards_goal(start)
        line = normal / np.linalg.norm(normal)
        path = uc.rollout(towards_goal, start, 200, 0.02, lambda x, t, line=line: (line @ jacobian(x))[:, None])
        recorded = path.states + noise * rng.standard_normal(path.states.shape)
        actions = (recorded[2:] - recorded[:-2]) / 0.04
        yield uc.Demonstration(recorded[1:-1], actions, path.times[1:-1])


def explained(policy, demos, **how):
    missed, motion = uc.evaluation.metrics.along_motion(policy, demos, **how)
    return 1.0 - missed / motion


def test_what_is_slow_beside_the_noise_counts_less():
    demos = list(reaches(1e-3))
    actions = uc.stack(demos).actions
    assert explained(towards_goal, demos) > 0.7
    for degrees in (37.0, -37.0):
        assert explained(lambda x, by=degrees: towards_goal(x, by), demos) < -0.3
    missed, motion = along_motion(actions, towards_goal(uc.stack(demos).states))
    assert 1.0 - missed / motion < -0.3  # where the noise is not known
    silent = [replace(demo, noise=np.zeros(2)) for demo in demos]
    assert explained(towards_goal, silent) == pytest.approx(1.0 - missed / motion)


def test_without_noise_nothing_is_slow_beside_it():
    demos = list(reaches(1e-7))
    missed, motion = along_motion(uc.stack(demos).actions, towards_goal(uc.stack(demos).states, 37.0))
    assert explained(lambda x: towards_goal(x, 37.0), demos) == pytest.approx(1.0 - missed / motion)
    short = demos[0][:4]  # no differences to tell noise by
    assert explained(towards_goal, short) == pytest.approx(1.0, abs=1e-3)


def test_a_fit_counts_what_it_holds_out_in_the_same_way(monkeypatch):
    demos = list(reaches(1e-3))
    policy = uc.ParametricPolicy(uc.Affine(), uc.NoiseCorrected()).fit_demonstrations(demos)
    known = policy.held_out_score()
    monkeypatch.setattr("unconstrain.risks.projection.TURNED", 0.0)
    unknown = policy.fit_demonstrations(demos).held_out_score()
    assert known > unknown + 0.1


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_in_planes_of_their_own_all_errors_but_those_across_are_seen(noise):
    demos = on_plates(PLATES, turning, noise)
    shares = uc.evaluation.metrics.explained_in_planes(off_everywhere, demos)
    for demo, share, normal in zip(demos, shares, PLATES, strict=True):
        missed = uc.metrics.cpe(off_everywhere, demo, uc.constraints.Plane(normal)) / (demo.actions**2).sum()
        assert share == pytest.approx(1.0 - missed, abs=1e-3)
        assert share < 1.0 - uc.metrics.inconsistency(off_everywhere, demo) / (demo.actions**2).sum() - 0.02
        (alone,) = uc.evaluation.metrics.explained_in_planes(
            off_everywhere, [demo]
        )  # the policy itself leaves the plane
        assert alone == pytest.approx(share, abs=1e-3)
    assert uc.evaluation.metrics.explained_in_planes(turning, demos).min() > 1.0 - 10 * noise - 1e-9


@pytest.mark.parametrize(
    ("policy", "demos"),
    [
        (turning, on_plates([(0.0, 0.0, 1.0)], turning, 0.5)),  # noise hides whether it was held
        (lambda states: turning(states) * [1.0, 1.0, 0.0], on_plates([(0.0, 0.0, 1.0)], turning)),  # nobody leaves it
        (turning, [uc.Demonstration(np.eye(3), np.eye(3)[[0, 0, 0]])]),  # a line
        (turning, [uc.Demonstration(np.eye(3), turning(np.eye(3)))]),  # free
        (
            turning,
            [replace(one, space=uc.spaces.Euclidean(2) * uc.spaces.Circle()) for one in on_plates(PLATES, turning)],
        ),
    ],
)
def test_what_kept_to_no_plane_is_not_judged_in_one(policy, demos):
    assert np.isnan(uc.evaluation.metrics.explained_in_planes(policy, demos)).all()

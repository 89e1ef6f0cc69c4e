"""The formulas that learners which look at samples are made of, each against its naive twin."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import butter, filtfilt

import naive
import unconstrain as uc
from samples import draw, rotation, samples_of
from unconstrain.learners.hybrid import SOFTNESSES, chosen_softness
from unconstrain.learners.robust.choice import Comparison
from unconstrain.learners.robust.consistent import _nearest
from unconstrain.learners.robust.constants import ANGULAR_SPREADS
from unconstrain.learners.robust.likelihood import exceeds_error
from unconstrain.learners.robust.noise import (
    beyond_misfit,
    corrected,
    corrected_squares,
    correlation_time,
    lag_of_noise,
    noise_by_differences,
    noise_of_each,
)
from unconstrain.learners.robust.posterior import Posterior
from unconstrain.learners.robust.segments import (
    change_points,
    curved_projections,
    found_segments,
    held_throughout,
    projection_of,
    projections_of,
)
from unconstrain.learners.robust.smoothness import Smoothness
from unconstrain.learners.robust.softened import softened
from unconstrain.learners.robust.sphere import distances, e_step
from unconstrain.learners.thresholds import within_errors
from unconstrain.risks.moments import gather
from unconstrain.risks.objectives import vec
from unconstrain.risks.quadratic import Quadratic, minimum, softened_minima

seeds = st.integers(0, 2**32 - 1)


# The sphere


@given(seeds, st.integers(2, 7), st.integers(1, 6))
def test_every_projection_lies_on_the_sphere(seed, d, rank):
    rng = np.random.default_rng(seed)
    policy = rng.standard_normal((5, d))
    projections = uc.null_space_projection(rng.standard_normal((5, min(rank, d), d)))
    actions = uc.project(projections, policy)
    assert_allclose(distances(actions, policy).radial, 0.0, atol=1e-12)


@given(seeds, st.integers(2, 5))
def test_the_normal_is_minus_the_derivative_of_the_distance(seed, d):
    rng = np.random.default_rng(seed)
    actions, policy = rng.standard_normal((2, 4, d))
    step = 1e-6
    for axis in range(d):
        moved = [distances(actions, policy + sign * step * np.eye(d)[axis]).radial for sign in (1, -1)]
        assert_allclose(distances(actions, policy).normal[:, axis], -(moved[0] - moved[1]) / (2 * step), atol=1e-6)


def test_on_the_sphere_the_normal_is_the_action_over_the_policys_length():
    data = draw(noise=0.0)
    place = distances(data.actions, data.policy)
    assert_allclose(place.normal, data.actions / np.linalg.norm(data.policy, axis=1)[:, None], atol=1e-9)


@pytest.mark.parametrize("only", [0, 3, len(ANGULAR_SPREADS)])
def test_each_density_has_a_mass_of_one(only):
    axis = np.linspace(-2.5, 3.5, 601)  # two points for each standard deviation
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    policy = np.tile([1.0, 0.0], (len(points), 1))
    mixture = np.eye(len(ANGULAR_SPREADS) + 1)[only]
    found = e_step(points, policy, distances(points, policy), 0.02**2, mixture)
    mass = np.exp(found.log_likelihood).sum() * (axis[1] - axis[0]) ** 2
    assert_allclose(mass, 1.0, atol=0.03)
    near = found.log_likelihood > -100.0
    assert near.any()
    assert_allclose(found.components[near, only], 1.0)


def test_free_samples_and_constrained_ones_are_told_apart():
    policy = np.array([[1.0, 0.0], [1.0, 0.0]])
    actions = np.array([[1.01, 0.01], [0.5, 0.5]])
    mixture = np.full(len(ANGULAR_SPREADS) + 1, 1 / (len(ANGULAR_SPREADS) + 1))
    free = e_step(actions, policy, distances(actions, policy), 0.02**2, mixture).free
    assert free[0] > 0.3
    assert free[1] < 1e-6


# Noise


def test_corrected_moments_are_those_without_noise_on_average():
    data = draw(samples=4000, noise=0.0)
    phi, sigma = np.column_stack([data.states, np.ones(4000)]), 0.2
    rng = np.random.default_rng(0)
    found = []
    for _ in range(200):
        noisy = data.actions + sigma * rng.standard_normal(data.actions.shape)
        squares = (noisy**2).sum(axis=1)[:, None]
        plain = gather(phi, noisy)
        found.append([sums.ravel() for sums in corrected(gather(phi, noisy, squares), plain, sigma**2).sums])
    clean = gather(phi, data.actions, (data.actions**2).sum(axis=1)[:, None])
    for drawn, expected in zip(zip(*found, strict=True), clean.sums, strict=True):
        drawn = np.stack(drawn)
        error = drawn.std(axis=0, ddof=1) / np.sqrt(len(drawn))
        assert (np.abs(drawn.mean(axis=0) - expected.ravel()) < 5 * error + 1e-9).all()


def test_residuals_of_the_true_policy_have_one_variance_whatever_the_constraint():
    rng = np.random.default_rng(1)
    policy, sigma = np.array([0.6, -0.5, 0.9]), 0.05
    for held in (0, 1, 2):
        N = uc.null_space_projection(rng.standard_normal((held, 3))) if held else np.eye(3)
        u = N @ policy + sigma * rng.standard_normal((200_000, 3))
        residual = (u**2).sum(axis=1) - u @ policy - 3 * sigma**2
        assert abs(residual.mean()) < 1e-3
        assert_allclose(residual.var(), sigma**2 * policy @ policy + 6 * sigma**4, rtol=0.02)


def test_corrected_squares_are_those_without_noise_but_for_what_all_predictions_share():
    rng, d, sigma, draws = np.random.default_rng(5), 3, 0.4, 400_000
    policy, normal = np.array([1.0, -2.0, 0.5]), np.array([0.6, 0.0, 0.8])
    action = policy - normal * (normal @ policy)
    noisy = SimpleNamespace(actions=action + sigma * rng.standard_normal((draws, d)))
    for prediction in (policy, action, np.zeros(d), 2.0 * policy):
        found = corrected_squares(noisy, np.broadcast_to(prediction, (draws, d)), sigma**2)
        expected = (action @ (action - prediction)) ** 2 - 2 * d * sigma**4
        assert abs(found.mean() - expected) < 4.0 * found.std() / np.sqrt(draws)


def test_noise_shows_in_differences_and_a_switch_does_not():
    times = np.linspace(0, 3, 300)
    smooth = np.column_stack([np.sin(times), np.cos(times)])
    smooth[150:] *= 0.2
    noisy = smooth + 0.03 * np.random.default_rng(0).standard_normal(smooth.shape)
    groups = np.zeros(300, dtype=int)
    assert_allclose(np.sqrt(noise_by_differences(noisy, groups)), 0.03, rtol=0.15)
    assert noise_by_differences(smooth, groups) < 1e-12
    assert noise_by_differences(noisy[:4], groups[:4]) == np.inf
    assert noise_by_differences(noisy, np.arange(300)) == np.inf


def _filtered(rng, hertz, count=3000, d=2):
    """Noise of standard deviation one at 100 Hz, of which a filter left what is slower than so many hertz."""
    found = filtfilt(*butter(2, hertz, fs=100.0), rng.standard_normal((count, d)), axis=0)
    return found / found.std()


@pytest.mark.parametrize("hertz", [6.0, 10.0, 20.0])
@pytest.mark.parametrize("share", [0.03, 0.2])
def test_noise_that_neighbours_share_is_told_by_samples_farther_apart(hertz, share):
    times = np.arange(3000) / 100.0
    smooth = np.column_stack([np.sin(2.0 * times), np.cos(1.3 * times)])
    groups = np.arange(3000) // 500
    noisy = smooth + share * np.sqrt(0.5) * _filtered(np.random.default_rng(1), hertz)
    assert noise_by_differences(smooth, groups) < 1e-9  # not taken for noise, however smooth
    assert lag_of_noise(smooth, groups) == 1
    neighbours = (np.diff(noisy[:500], n=4, axis=0) ** 2).sum(axis=1)
    assert np.sqrt(np.median(neighbours) / 140.0) < 0.4 * share * np.sqrt(0.5)  # what neighbours show of it
    assert_allclose(np.sqrt(noise_by_differences(noisy, groups)), share * np.sqrt(0.5), rtol=0.35)
    assert_allclose(np.sqrt(noise_of_each(noisy, groups, 1.0)), share * np.sqrt(0.5), rtol=0.5)
    known = np.full(3000, 1e-3)  # from positions that were filtered before anybody saw them
    assert (noise_of_each(noisy, groups, 1.0, known) > 10 * known**2).all()


def test_white_noise_is_told_by_neighbours_and_known_noise_is_used_as_it_is():
    rng, groups = np.random.default_rng(2), np.arange(2000) // 400
    noisy = np.sin(np.arange(2000) / 40.0)[:, None] + 0.1 * rng.standard_normal((2000, 2))
    assert lag_of_noise(noisy, groups) == 1
    assert_allclose(noise_of_each(noisy, groups, 1.0, np.full(2000, 0.03)), 0.03**2)
    assert lag_of_noise(noisy[:3], groups[:3]) == lag_of_noise(noisy, np.arange(2000)) == 1


@pytest.mark.parametrize("rate", [50, 100, 250])
def test_noise_of_positions_that_were_differentiated_is_what_is_known_of_it(rate):
    rng, times = np.random.default_rng(3), np.arange(0, 8, 1 / rate)
    positions = np.column_stack([np.sin(2.0 * times), np.cos(1.3 * times)])
    actions, truth = (
        uc.preparation.differentiate(times, one)
        for one in (positions + 3e-3 * rng.standard_normal(positions.shape), positions)
    )
    known, groups = np.sqrt(((actions - truth) ** 2).mean()), np.zeros(len(times), dtype=int)
    assert_allclose(np.sqrt(noise_by_differences(actions, groups)), known, rtol=0.3)


def test_half_of_the_samples_constrained_at_random_is_not_the_noise_of_all():
    rng = np.random.default_rng(4)
    demos = [limit_cycle_of(rng, random) for random in (False, True) * 15]
    actions, groups = np.vstack(demos), np.repeat(np.arange(30), len(demos[0]))
    assert lag_of_noise(actions, groups) == 1


def limit_cycle_of(rng, random):
    """Forty actions round a cycle, along it or along directions at random."""
    angles = rng.uniform(0, 6) + np.arange(40) * 0.08
    actions = np.column_stack([-np.sin(angles), np.cos(angles)])
    along = rng.standard_normal((40, 2)) if random else actions
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return along * np.vecdot(along, actions)[:, None]


def test_correlation_time_of_known_processes():
    rng = np.random.default_rng(0)
    white = rng.standard_normal((20_000, 2))
    groups = np.arange(20_000) // 100
    assert correlation_time(white, groups) < 1.2
    slow = white.copy()
    for i in range(1, len(slow)):
        slow[i] = 0.6 * slow[i - 1] + white[i]
    assert_allclose(correlation_time(slow, np.zeros(20_000, dtype=int)), (1 + 0.6) / (1 - 0.6), rtol=0.15)
    assert correlation_time(np.zeros((10, 1)), np.zeros(10, dtype=int)) == 1.0


# What is believed of the weights


def random_quadratic(rng, size, models=2, rank=None):
    half = rng.standard_normal((models, size, rank or size))
    return Quadratic(half @ half.swapaxes(1, 2), rng.standard_normal((models, size)), np.ones(models))


@given(seeds, st.integers(1, 6))
def test_the_two_covariances_add_up_to_the_inverse(seed, rank):
    rng = np.random.default_rng(seed)
    evidence, prior = random_quadratic(rng, 6, rank=rank), random_quadratic(rng, 6)
    prior = Quadratic(prior.hessian + np.eye(6), prior.linear, prior.constant)
    from_noise, undetermined = Posterior(evidence, prior).covariances()
    inverse = np.linalg.inv(evidence.hessian + prior.hessian)
    assert_allclose(from_noise + undetermined, inverse, atol=1e-7 * np.abs(inverse).max())
    assert_allclose(from_noise, inverse @ evidence.hessian @ inverse, atol=1e-7 * np.abs(inverse).max())
    assert (Posterior(evidence, 1e-10 * prior).determined() == rank).all()


@given(seeds)
def test_softened_minima_are_those_of_each_sum(seed):
    rng = np.random.default_rng(seed)
    first, second = random_quadratic(rng, 5, rank=3), random_quadratic(rng, 5)
    softnesses = (1e-3, 0.1, 3.0)
    found = softened_minima(first, second, softnesses)
    for place, softness in enumerate(softnesses):
        expected = minimum(first + softness * second)
        assert_allclose(found[..., place], expected, atol=1e-4 * np.abs(expected).max())


def test_candidates_within_one_standard_error_of_the_best_are_as_good():
    best_is_first = np.array([[1.0, 1.1, 1.3], [2.0, 1.9, 2.3], [3.0, 3.1, 3.2]])
    assert within_errors(best_is_first).max() == 1
    assert within_errors(best_is_first[:, [0, 2]]).max() == 0
    assert within_errors(np.ones((4, 3))).max() == 2
    assert_array_equal(within_errors(np.ones((1, 3))), [0])  # of one round there is no standard error


@pytest.mark.parametrize(("errors", "chosen"), [(2.0, 0), (4.0, 2)])
def test_the_proposed_softness_is_taken_unless_held_out_data_clearly_objects(errors, chosen):
    """Columns: the proposal, the best, which is far from it, and one near it that is as good as the best."""
    best = np.array([1.0, 3.0, 2.0, 5.0])
    gap = np.array([-1.0, 1.0, -1.0, 1.0])
    worse = best + gap + errors * gap.std(ddof=1) / 2.0
    missed = np.column_stack([worse, best, best + 0.5 * gap + 0.01])
    assert _nearest(missed, np.array([0.0, -7.0, 2.0])) == chosen


def test_alpha_auto_is_a_softness():
    data = draw(samples=200)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(alpha="auto")).fit(
        data.states, data.actions, groups=data.groups
    )
    softness = chosen_softness(policy.training_.folds)
    assert softness in SOFTNESSES
    same = policy.with_learner(uc.Hybrid(softness=softness, threshold=0.0))
    assert_array_equal(policy.predict(data.states), same.predict(data.states))
    for wrong in ({"threshold": 0.1}, {"softness": 0.1}):
        with pytest.raises(uc.UnconstrainError, match="auto"):
            uc.Hybrid(alpha="auto", **wrong)


@pytest.mark.parametrize("models", [1, 3])
def test_risk_is_the_naive_sum(models):
    data = draw(samples=20)
    samples = samples_of(data, models=models)
    weights = np.random.default_rng(2).uniform(0.5, 2, 20)
    risk = samples.risk(data.actions, weights)
    for m in range(models):
        E0, g, H = naive.risk_terms(samples.features, data.actions, weights * samples.memberships[:, m])
        assert_allclose(risk.hessian[m], H, atol=1e-12)
        assert_allclose(risk.linear[m], g, atol=1e-12)
        assert_allclose(risk.constant[m], E0)


# Smoothness


def rough_samples(models=1):
    """Samples on a grid of kernels, which knows how rough weights are."""
    data, grid = draw(samples=60), uc.NormalisedRBF.grid(-1, 1, 4)
    samples = samples_of(data, features=grid(data.states), models=models)
    return replace(samples, roughness=np.tile(grid.roughness(), (models, 1, 1)))


def test_smoothness_is_the_naive_formula():
    samples, rng = rough_samples(models=2), np.random.default_rng(3)
    weights = rng.standard_normal((2, 2, 16))
    evidence, prior = random_quadratic(rng, 32), random_quadratic(rng, 32)
    found = Smoothness.of(samples).updated(weights, Posterior(evidence, prior), noise=0.5, unit=np.array([1.0, 0.1]))
    for m, unit in enumerate((1.0, 0.1)):
        R = samples.roughness[m]
        C = unit * np.linalg.inv(evidence.hessian[m] + prior.hessian[m])
        rough = sum(w @ R @ w for w in weights[m]) + np.trace(C @ np.kron(R, np.eye(2)))
        assert_allclose(found.precision[m], 0.5 * np.linalg.matrix_rank(R, tol=1e-8) * 2 / rough, rtol=1e-6)
    expected = [found.precision[m] * sum(w @ samples.roughness[m] @ w for w in weights[m]) for m in range(2)]
    assert_allclose(found.prior()(vec(weights)), expected)


def test_weights_that_are_drawn_tell_how_smooth_they_are():
    samples, rng = rough_samples(), np.random.default_rng(0)
    values, axes = np.linalg.eigh(samples.roughness[0])
    scale = np.where(values > 1e-8, 1.0 / np.sqrt(np.maximum(values, 1e-8)), 0.0)
    certain = Quadratic(1e9 * np.eye(32)[None], np.zeros((1, 32)), np.zeros(1))
    found = [
        Smoothness.of(samples)
        .updated(((rng.standard_normal((2, 16)) * scale) @ axes.T)[None] / 4.0, Posterior(certain, certain), noise=1.0)
        .precision[0]
        for _ in range(200)
    ]
    assert_allclose(1.0 / np.mean(1.0 / np.array(found)), 4.0**2, rtol=0.1)


def test_what_is_no_noise_is_not_smoothed():
    samples, rng = rough_samples(), np.random.default_rng(1)
    posterior = Posterior(random_quadratic(rng, 32, models=1), random_quadratic(rng, 32, models=1))
    assert Smoothness.of(samples).updated(rng.standard_normal((1, 2, 16)), posterior, noise=0.0).precision == 0.0


def test_one_fold_alone_does_not_make_an_end_more_probable():
    samples = samples_of(draw(samples=200), groups=np.arange(200) % 10)
    assert exceeds_error(samples, np.full(200, 0.1))
    assert not exceeds_error(samples, np.full(200, -0.1))
    assert not exceeds_error(samples, np.where(samples.folds == 3, 5.0, -0.1))


# Segments


def test_a_segments_projection_is_that_of_its_constraint():
    rng = np.random.default_rng(0)
    N = uc.null_space_projection(rng.standard_normal((1, 3)))
    actions = rng.standard_normal((40, 3)) @ N + 0.01 * rng.standard_normal((40, 3))
    assert_allclose(projection_of(actions, 0.01), N, atol=0.02)
    assert_allclose(projection_of(0.01 * rng.standard_normal((40, 3)), 0.01), 0.0)
    assert_allclose(projection_of(np.zeros((5, 3)), 0.0), 0.0)
    assert_allclose(projection_of(actions, 1e-4), np.eye(3), atol=1e-12)


@pytest.mark.parametrize("faint", [0.0, 0.01, 0.1, 1.0])
def test_who_was_always_held_shows_the_policy_along_all_other_directions(faint):
    """Along its third direction the motion is so much of that along the others: none, noise, some that counts, much."""
    rng, groups = np.random.default_rng(1), np.arange(400) // 200
    axes = np.stack([rotation(seed, 3) for seed in (2, 3)])
    actions = np.vecdot(axes[groups], (rng.standard_normal((400, 3)) * [1.0, 0.8, faint])[:, None])
    held, moved = held_throughout(actions, groups, np.full(400, 0.01**2))
    for action, group, is_held, projection in zip(actions, groups, held, moved, strict=True):
        assert is_held == (faint <= 0.01)
        plane, own = axes[group][:, :2] @ axes[group][:, :2].T, np.outer(action, action) / (action @ action)
        assert_allclose(projection, plane if is_held else own, atol=0.02)
    assert not held_throughout(actions[:200], groups[:200], np.full(200, 0.01**2))[0].any()  # none moved along more


def _over(surface: str, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States of a winding movement, its actions under a constraint of a kind, and the projections of that."""
    rng, angle = np.random.default_rng(seed), np.linspace(0.0, 9.0, 240)[:, None]
    states = np.sin(angle * rng.uniform(0.7, 1.3, 3) + rng.uniform(0.0, 6.0, 3))
    wished = np.column_stack([-states[:, 1], states[:, 0], 0.5 - states[:, 2]]) + rng.uniform(0.2, 0.6, 3)
    middle = np.array([0.5, -2.0, 0.3])
    normals = {
        "sphere": states - middle,
        "cylinder": (states - middle) * [1.0, 1.0, 0.0],
        "saddle": states * [0.6, -0.4, 0.0] + [0.0, 0.0, 1.0],
        "plane": np.tile([1.0, 2.0, 2.0], (240, 1)),
        "none": np.zeros((240, 3)),
        "wave": np.column_stack([np.sin(4.0 * states[:, 0]), np.cos(5.0 * states[:, 1]), np.sin(6.0 * states[:, 2])]),
    }[surface]
    N = uc.null_space_projection(normals[:, None])
    return states, uc.project(N, wished) + 0.003 * rng.standard_normal((240, 3)), N


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("surface", ["sphere", "cylinder", "saddle", "plane", "none", "wave"])
def test_a_direction_that_turns_with_the_state_is_found_where_it_is_affine_and_else_none(surface, seed):
    states, actions, N = _over(surface, seed)
    noise, groups = np.full(240, 0.006**2), np.zeros(240, dtype=int)
    flat = projections_of(actions, groups, noise)
    found = curved_projections(states, actions, groups, flat, noise)
    if surface in ("sphere", "cylinder", "saddle"):
        assert_allclose(flat[0], np.eye(3), atol=1e-12)
        assert_allclose(found, N, atol=0.1)
    else:
        assert_allclose(found, flat, atol=1e-12)
        assert_allclose(np.trace(flat[0]), 2.0 if surface == "plane" else 3.0)


def test_what_turns_with_the_state_does_not_depend_on_order_units_or_place():
    states, actions, _ = _over("sphere", 0)
    noise, groups = np.full(240, 0.006**2), np.zeros(240, dtype=int)
    order, turn = np.random.default_rng(1).permutation(240), rotation(3, 3)
    known = curved_projections(states, actions, groups, np.tile(np.eye(3), (240, 1, 1)), noise)
    for there, moved, sizes, back in (
        (states[order], actions[order], noise, known[order]),
        (100.0 * states + 7.0, 20.0 * actions, 400.0 * noise, known),
        (states * [1000.0, 1.0, 0.01], actions, noise, known),
        (np.column_stack([states, np.full(240, 0.1)]), actions, noise, known),
        (states @ turn.T, actions @ turn.T, noise, turn @ known @ turn.T),
    ):
        assert_allclose(
            curved_projections(there, moved, groups, np.tile(np.eye(3), (240, 1, 1)), sizes), back, atol=1e-7
        )


@pytest.mark.parametrize("size", [0.0, 5e-4])
def test_a_pot_at_one_speed_is_told_by_positions_as_velocities_do_not(size):
    turn, rng = np.linspace(0.0, 15.0, 500), np.random.default_rng(0)
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    path = np.column_stack([0.1 * around, 0.06 * np.cos(0.4 * turn)])
    actions = np.column_stack([-0.1 * around[:, 1], 0.1 * around[:, 0], -0.024 * np.sin(0.4 * turn)])
    actions += 2e-3 * rng.standard_normal(actions.shape)
    states = path + size * rng.standard_normal(path.shape)
    groups, noise, free = np.zeros(500, dtype=int), np.full(500, 4e-6), np.tile(np.eye(3), (500, 1, 1))
    N = uc.null_space_projection(np.column_stack([around, np.zeros(500)])[:, None])
    assert_allclose(projections_of(actions, groups, noise), free, atol=1e-9)
    assert_allclose(curved_projections(states, actions, groups, free, noise), N, atol=0.05)
    for other in (states[:, [1, 0, 2]], states * [3.0, 1.0, 1.0], np.hstack([states, states])):
        assert_allclose(curved_projections(other, actions, groups, free, noise), free)  # no positions of these


def test_noise_that_smoothing_hid_is_at_least_the_misfit():
    samples = samples_of(draw())
    least = 0.015**2 * (samples.actions**2).sum(axis=1).mean() / 2
    assert_allclose(beyond_misfit(np.array([0.0, 1.0]), samples), [least, 1.0])


# The choice


def on_planes(always):
    """Samples of eight demonstrations, each in one plane all the time or in others at every moment; their truth."""
    rng, count = np.random.default_rng(4), 240
    groups = np.arange(count) * 8 // count
    normals = rng.standard_normal((8, 3))[groups] if always else rng.standard_normal((count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    policy = np.array([1.0, 0.5, -1.0]) + rng.standard_normal((count, 3))
    actions = policy - normals * np.vecdot(normals, policy)[:, None]
    data = draw(samples=count, groups=8, dimensions=2)._replace(actions=actions, groups=groups)
    return samples_of(data), policy, normals


@pytest.mark.parametrize("always", [True, False])
def test_what_is_missed_across_the_action_is_seen_where_demonstrations_were_always_held(always):
    """Of two candidates, one misses what lies across each action, in the plane of its demonstration."""
    samples, policy, normals = on_planes(always)
    across = np.cross(samples.actions, normals)
    right = replace(softened(samples)[0], held_out=policy, softness=0.0)
    wrong = replace(right, name="wrong", held_out=policy + 0.5 * across)
    found = Comparison([right, wrong], np.zeros(len(samples)), samples).judged()
    assert found["direct"].loss == pytest.approx(0.0, abs=1e-12)
    assert found["wrong"].loss == pytest.approx(0.25 if always else 0.0, rel=0.5, abs=1e-12)


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_noise_makes_actions_longer_and_no_policy_that_is_too_long_the_best(noise):
    rng, count = np.random.default_rng(5), 3000
    data = draw(samples=count, groups=10)
    policy = np.array([0.8, -0.6]) + 0.1 * rng.standard_normal((count, 2))
    normals = rotation(1, 2)[:, 0] + 0.5 * rng.standard_normal((count, 2))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    actions = policy - normals * np.vecdot(normals, policy)[:, None] + noise * rng.standard_normal((count, 2))
    samples = samples_of(data._replace(actions=actions))
    right = replace(softened(samples)[0], held_out=policy, softness=0.0)
    others = [replace(right, name=str(times), held_out=times * policy) for times in (0.9, 1.05)]
    found = Comparison([right, *others], np.full(count, noise**2), samples).judged()
    assert found["direct"].loss < min(found["0.9"].loss, found["1.05"].loss)


def bias_shown(missed, other_missed, softness=np.inf, other_softness=0.0, by_segments=False):
    """What is shown of a candidate's bias by another at a distance from it, and what each misses, of unequal motion."""
    samples = samples_of(draw(samples=900, noise=0.0, groups=12))
    one = replace(softened(samples)[0], softness=softness)
    at, moved = one.weights.copy(), samples.actions * (1.0 - np.sqrt(missed))
    at[..., 0] += 0.7
    held_out = samples.actions * (1.0 - np.sqrt(other_missed))
    same = {"by_segments": by_segments, "softness": other_softness, "spread": 0.0}
    candidates = [replace(one, held_out=moved, spread=0.0, refits=one.weights[None].repeat(3, axis=0))]
    candidates.append(
        replace(one, name="other", weights=at, refits=at[None].repeat(3, axis=0), held_out=held_out, **same)
    )
    found = Comparison(candidates, np.zeros(len(samples)), samples).judged()
    return found["direct"].bias, found["other"].loss - found["direct"].loss


def test_who_misses_more_shows_a_bias_that_is_farther_than_it_may_be_wrong_itself():
    apart, _ = bias_shown(0.05, 0.05)
    assert apart > 0.3
    shown, more = bias_shown(0.05, 0.052)
    assert 1e-3 < more < 3e-3
    assert shown == pytest.approx(apart - 100.0 * more)
    assert apart - 100.0 * more < bias_shown(0.05, 0.052, by_segments=True)[0] < apart + 1e-9  # beyond chance only
    assert bias_shown(0.05, 0.04)[0] == pytest.approx(apart)
    assert bias_shown(0.05, 0.08)[0] == 0.0  # far less consistent


def test_who_is_as_soft_as_direct_regression_shows_no_more_bias_than_it_is_more_consistent():
    assert bias_shown(0.05, 0.05, 0.0, np.inf)[0] == 0.0
    shown, more = bias_shown(0.05, 0.04, 0.0, np.inf)
    assert shown == pytest.approx(-10.0 * more)
    assert bias_shown(0.05, 0.049, 0.0, np.inf)[0] == 0.0  # by less than a tenth
    assert bias_shown(0.05, 0.04, 0.0, 0.3)[0] == pytest.approx(bias_shown(0.05, 0.04)[0])  # of others, all of it
    assert bias_shown(0.05, 0.04, 0.3, 0.3)[0] == pytest.approx(bias_shown(0.05, 0.04)[0])  # who is as soft, all of it


def test_changes_of_the_constraint_are_found():
    rng = np.random.default_rng(3)
    wanted = np.column_stack([1 + 0.2 * rng.standard_normal(60), 0.5 + 0.2 * rng.standard_normal(60)])
    constraint = uc.constraints.SwitchingLine(np.array([[1.0, 0.2], [0.1, 1.0], [1.0, -1.0]]), np.array([20.0, 45.0]))
    N = uc.null_space_projection(constraint(wanted, np.arange(60.0)))
    actions = uc.project(N, wanted)
    assert_array_equal(change_points(actions, 1e-3), [20, 45])
    noisy = actions + 0.01 * rng.standard_normal(actions.shape)
    assert np.abs(change_points(noisy, 0.01) - [20, 45]).max() <= 1
    groups = np.repeat([0, 1], 30)
    labels = found_segments(actions, groups, 1e-3)
    assert_array_equal(np.flatnonzero(np.diff(labels)) + 1, [20, 30, 45])
    assert len(change_points(wanted, 1e-3)) == 0


def test_constrained_error_is_the_naive_sum():
    data = draw(samples=30, noise=0.0)
    samples, labels = samples_of(data), np.repeat([0, 1, 2], 10)
    weights = np.random.default_rng(5).standard_normal((1, 2, 3))
    predicted = samples.predict(weights)
    expected = 0.0
    for label in range(3):
        rows = labels == label
        N = projection_of(data.actions[rows], 0.2)
        expected += sum(
            w * (N @ u - N @ p) @ (N @ u - N @ p)
            for u, p, w in zip(data.actions[rows], predicted[rows], samples.memberships[rows, 0], strict=True)
        )
    N = projections_of(data.actions, labels, np.full(30, 0.2**2))
    assert_allclose(samples.constrained(N)(vec(weights)), expected)

"""Learners that look at the samples."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

import naive
import unconstrain as uc
from samples import draw, rotation, spiral
from unconstrain.experiments import regimes
from unconstrain.learners import SOFTNESSES, within_errors
from unconstrain.moments import gather
from unconstrain.objectives import inconsistency, standard_risk, vec
from unconstrain.quadratic import Quadratic, minimum, softened_minima
from unconstrain.robust import RobustSolution, Samples, consistent
from unconstrain.robust.likelihood import clearly_more
from unconstrain.robust.noise import corrected, correlation_time, noise_by_differences
from unconstrain.robust.posterior import Posterior
from unconstrain.robust.segments import change_points, constrained_error, found_segments, projection_of
from unconstrain.robust.smoothness import Smoothness
from unconstrain.robust.sphere import SPREADS, beliefs, distances

seeds = st.integers(0, 2**32 - 1)
LEARNERS = {
    "robust": uc.Robust(),
    "likelihood": uc.Likelihood(),
    "noise_corrected": uc.NoiseCorrected(),
    "segments": uc.Segments(),
}


@pytest.fixture(params=LEARNERS.values(), ids=LEARNERS)
def sampler(request):
    """Each learner that needs samples."""
    return request.param


def samples_of(data, groups=None, features=None, models=1):
    """Samples with plain features, one model unless told."""
    count = len(data.states)
    phi = np.column_stack([data.states, np.ones(count)]) if features is None else features
    rng = np.random.default_rng(0)
    share = rng.uniform(0.1, 1.0, (count, models))
    named = data.groups if groups is None else groups
    return Samples(
        phi,
        data.actions,
        np.ones(count),
        share,
        share / share.sum(axis=1, keepdims=True),
        named,
        np.unique(named, return_inverse=True)[1],
        np.tile(np.eye(phi.shape[1]), (models, 1, 1)),
        np.zeros((models, phi.shape[1], phi.shape[1])),
    )


def recorded(system="limit cycle", constraint="half", noise=0.05, seed=4200):
    """Demonstrations to learn from, and without noise to be tested on."""
    rng = np.random.default_rng(seed)
    training, test = regimes.demonstrate(system, constraint, rng)
    return regimes.with_noise(training, noise, rng), test


def on_grid(learner):
    return uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 6), learner, uc.Folds(by="demonstration"))


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


@pytest.mark.parametrize("only", [0, 3, len(SPREADS)])
def test_each_density_has_a_mass_of_one(only):
    axis = np.linspace(-2.5, 3.5, 1201)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    policy = np.tile([1.0, 0.0], (len(points), 1))
    mixture = np.eye(len(SPREADS) + 1)[only]
    found = beliefs(points, policy, distances(points, policy), 0.02**2, mixture)
    mass = np.exp(found.likelihood).sum() * (axis[1] - axis[0]) ** 2
    assert_allclose(mass, 1.0, atol=0.03)
    near = found.likelihood > -100.0
    assert near.any()
    assert_allclose(found.shares[near, only], 1.0)


def test_free_samples_and_constrained_ones_are_told_apart():
    policy = np.array([[1.0, 0.0], [1.0, 0.0]])
    actions = np.array([[1.01, 0.01], [0.5, 0.5]])
    mixture = np.full(len(SPREADS) + 1, 1 / (len(SPREADS) + 1))
    free = beliefs(actions, policy, distances(actions, policy), 0.02**2, mixture).free
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
    from_noise, undetermined = Posterior(evidence, prior).spreads()
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


def test_alpha_auto_is_a_softness():
    data = draw(samples=200)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(alpha="auto")).fit(
        data.states, data.actions, groups=data.groups
    )
    softness = uc.Hybrid(alpha="auto").chosen_softness(policy._folds)
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


def test_smooth_policies_are_nearer_to_the_truth_under_noise(monkeypatch):
    found = {}
    for smooth in (True, False):
        if not smooth:
            monkeypatch.setattr(uc.ParametricPolicy, "_roughness", lambda policy: None)
        for seed in (4201, 4202, 4203):
            training, test = recorded("pendulum", "half", 0.05, seed)
            policy = on_grid(uc.Robust()).fit_demonstrations(training)
            found.setdefault(smooth, []).append(np.log(uc.nupe(policy, test)))
    assert np.mean(found[True]) < np.mean(found[False]) - 0.2


def test_features_need_not_know_how_rough_they_are():
    training, test = recorded()
    grid = uc.NormalisedRBF.grid(-1, 1, 6)
    policy = uc.ParametricPolicy(lambda states: grid(states), uc.Robust()).fit_demonstrations(training)
    assert uc.nupe(policy, test) < 0.02


def test_one_fold_alone_does_not_make_an_end_more_probable():
    samples = samples_of(draw(samples=200), groups=np.arange(200) % 10)
    assert clearly_more(samples, np.full(200, 0.1))
    assert not clearly_more(samples, np.full(200, -0.1))
    assert not clearly_more(samples, np.where(samples.folds == 3, 5.0, -0.1))


# Segments


def test_a_segments_projection_is_that_of_its_constraint():
    rng = np.random.default_rng(0)
    N = uc.null_space_projection(rng.standard_normal((1, 3)))
    actions = rng.standard_normal((40, 3)) @ N + 0.01 * rng.standard_normal((40, 3))
    assert_allclose(projection_of(actions, 0.01), N, atol=0.02)
    assert_allclose(projection_of(0.01 * rng.standard_normal((40, 3)), 0.01), 0.0)
    assert_allclose(projection_of(np.zeros((5, 3)), 0.0), 0.0)
    assert_allclose(projection_of(actions, 1e-4), np.eye(3), atol=1e-12)


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
    assert_allclose(constrained_error(samples, labels, 0.2)(vec(weights)), expected)


# The learners


@pytest.mark.parametrize("system", ["limit cycle", "pendulum"])
@pytest.mark.parametrize("constraint", ["none", "random", "half", "0.3"])
def test_robust_holds_under_noise(system, constraint):
    training, test = recorded(system, constraint)
    robust = on_grid(uc.Robust()).fit_demonstrations(training)
    hybrid = robust.with_learner(uc.Hybrid(alpha=1e-2))
    assert uc.nupe(robust, test) < 1.3 * uc.nupe(hybrid, test)
    if constraint in ("random", "half"):
        assert uc.nupe(robust, test) < 0.5 * uc.nupe(hybrid, test)


def test_half_free_half_constrained_is_told_apart():
    training, test = recorded()
    policy = on_grid(uc.Robust()).fit_demonstrations(training)
    free = np.concatenate([np.full(len(d), np.allclose(d.truth.projections, np.eye(2))) for d in training])
    assert regimes.area_under_curve(policy.solution_.free, free) > 0.97
    assert uc.nupe(policy, test) < 0.005
    assert policy.solution_.method == "likelihood"
    assert 0.4 < policy.solution_.free_share < 0.6


def test_what_it_chose_from_is_kept():
    training, _ = recorded(noise=0.0)
    solution = on_grid(uc.Robust()).fit_demonstrations(training).solution_
    assert solution.candidates.keys() == solution.compared.keys() == {"noise-corrected", "likelihood"}
    assert_array_equal(solution.weights, solution.candidates[solution.method])
    assert not solution.refuted


def test_where_constraints_are_a_function_of_the_state_consistency_is_taken():
    rng = np.random.default_rng(17)
    training, test = regimes.demonstrate("arm", "1", rng)
    noisy = regimes.with_noise(training[:60], 0.05, rng)
    policy = uc.LocallyLinearPolicy(3.0, 0.7, learner=uc.Robust()).fit_demonstrations(noisy)
    assert policy.solution_.method == "noise-corrected"
    assert uc.nupe(policy, test) < 0.6 * uc.nupe(policy.with_learner(uc.Hybrid(alpha=1e-2)), test)
    assert uc.nupe(policy, test) < 0.6 * uc.nupe(policy.with_learner(uc.Likelihood()), test)


def test_free_linear_data_is_recovered(sampler):
    data = draw(samples=240, constrained=False, noise=0.0, policy=lambda x: x @ [[0.3, -1.0], [0.8, 0.2]] + [0.1, -0.4])
    policy = uc.ParametricPolicy(uc.Affine(), sampler).fit(data.states, data.actions, groups=data.groups)
    assert_allclose(policy.predict(data.states), data.policy, atol=1e-6)


@pytest.mark.parametrize("name", ["robust", "likelihood", "noise_corrected"])
def test_constrained_linear_data_is_recovered(name):  # with a constraint for each sample there are no segments
    sampler = LEARNERS[name]
    data = draw(samples=240, noise=0.0, policy=lambda x: x @ [[0.3, -1.0], [0.8, 0.2]] + [0.6, -0.9])
    policy = uc.ParametricPolicy(uc.Affine(), sampler).fit(data.states, data.actions, groups=data.groups)
    missed = ((policy.predict(data.states) - data.policy) ** 2).sum()
    assert missed < 1e-3 * ((data.policy - data.policy.mean(axis=0)) ** 2).sum()


def test_rotating_and_scaling_actions_does_so_to_the_policy(sampler):
    training, _ = recorded(seed=7)
    turn = 300.0 * rotation(3, 2)
    other = [replace(d, actions=d.actions @ turn.T, truth=None) for d in training]
    first, second = (on_grid(sampler).fit_demonstrations(of) for of in (training, other))
    states = np.concatenate([d.states for d in training])
    expected = first.predict(states) @ turn.T
    assert_allclose(second.predict(states), expected, atol=1e-3 * np.abs(expected).max())
    assert second.solution_.method == first.solution_.method


def test_batches_give_what_one_fit_gives(sampler):
    data = draw(samples=120)
    whole = uc.ParametricPolicy(uc.Affine(), sampler).fit(data.states, data.actions, groups=np.sort(data.groups))
    parts = clone(whole)
    for rows in (slice(0, 60), slice(60, None)):
        parts.partial_fit(data.states[rows], data.actions[rows], groups=np.sort(data.groups)[rows])
    assert_allclose(parts.predict(data.states), whole.predict(data.states), atol=1e-9)


def test_order_of_demonstrations_hardly_matters(sampler):
    training, _ = recorded(seed=9)
    states = np.concatenate([d.states for d in training])
    forwards, backwards = (on_grid(sampler).fit_demonstrations(of).predict(states) for of in (training, training[::-1]))
    assert ((forwards - backwards) ** 2).mean() < 1e-2 * forwards.var()


@pytest.mark.parametrize("kind", ["one", "zero", "few", "flat", "same state", "same action"])
def test_poor_data_gives_finite_policies(kind, sampler, policy_of):
    data = draw(samples=24)
    states, actions, groups = data.states, data.actions, data.groups
    if kind == "one":
        states, actions, groups = states[:1], actions[:1], groups[:1]
    elif kind == "few":
        states, actions, groups = states[:3], actions[:3], groups[:3]
    elif kind == "zero":
        actions = np.zeros_like(actions)
    elif kind == "flat":
        actions = actions[:, 0]
    elif kind == "same state":
        states = np.ones_like(states)
    else:
        actions = np.ones_like(actions)
    policy = policy_of(sampler).fit(states, actions, groups=groups)
    assert np.isfinite(policy.predict(states)).all()
    assert np.isfinite(np.concatenate(policy.uncertainty(states))).all()
    assert policy.solution_.free.shape == (len(states),)
    if kind == "zero":
        assert_allclose(policy.predict(states), 0.0, atol=1e-12)


def test_scales_far_from_one_give_the_same_policy(sampler):
    data = draw(samples=150)
    expected = uc.ParametricPolicy(uc.Affine(), sampler).fit(data.states, data.actions).predict(data.states)
    for scale in (1e-8, 1e8):
        policy = uc.ParametricPolicy(uc.Affine(), sampler).fit(data.states, scale * data.actions)
        assert_allclose(policy.predict(data.states) / scale, expected, atol=1e-5)


def test_a_known_noise_is_used():
    data = draw(samples=300, noise=0.1)
    states, actions = data.states, data.actions
    fits = [uc.ParametricPolicy(uc.Affine(), uc.NoiseCorrected(noise)).fit(states, actions) for noise in (0.0, 0.1)]
    assert np.abs(fits[0].predict(states) - fits[1].predict(states)).max() > 1e-4
    with pytest.raises(uc.UnconstrainError, match="noise"):
        uc.NoiseCorrected(-0.1)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: uc.Robust(steps=0), "steps"),
        (lambda: uc.Likelihood(most=0), "most"),
        (lambda: uc.Segments("each"), "labels"),
        (lambda: uc.Segments(noise=-1.0), "noise"),
    ],
)
def test_wrong_settings_are_refused(make, named):
    with pytest.raises(uc.UnconstrainError, match=named):
        make()


def test_a_policy_of_sums_says_that_it_has_no_samples(sampler):
    data = draw()
    policy = uc.ParametricPolicy(uc.Affine()).fit(data.states, data.actions)
    with pytest.raises(uc.UnconstrainError, match="from the start"):
        policy.with_learner(sampler)
    with pytest.raises(uc.UnconstrainError, match="Robust"):
        policy.uncertainty(data.states)


def test_what_was_learnt_survives_a_file(tmp_path, sampler, policy_of):
    data = draw(samples=80)
    policy = policy_of(sampler).fit(data.states, data.actions, groups=data.groups)
    uc.save(policy, tmp_path / "p.npz")
    again = uc.load(tmp_path / "p.npz")
    assert isinstance(again.solution_, RobustSolution)
    assert again.learner == sampler
    assert_array_equal(again.predict(data.states), policy.predict(data.states))
    assert_array_equal(again.uncertainty(data.states), policy.uncertainty(data.states))
    assert_array_equal(again.solution_.free, policy.solution_.free)
    assert again.held_out_score() == policy.held_out_score()
    with pytest.raises(uc.UnconstrainError, match="samples"):
        again.partial_fit(data.states, data.actions, groups=data.groups)
    assert np.isfinite(again.with_learner(uc.Hybrid()).predict(data.states)).all()


# What is not known


def test_intervals_hold_the_truth_as_often_as_they_say():
    held = []
    for seed in range(12):
        data = draw(seed, samples=200, noise=0.1, policy=lambda x: x @ [[0.3, -1.0], [0.8, 0.2]] + [0.6, -0.9])
        policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(data.states, data.actions, groups=data.groups)
        spread = policy.uncertainty(data.states)
        assert_allclose(spread.total, np.hypot(spread.from_noise, spread.undetermined))
        held.append(np.abs(policy.predict(data.states) - data.policy) <= 1.96 * spread.total)
    assert np.mean(held) > 0.85


def test_where_constraints_are_a_function_of_the_state_intervals_hold_the_truth(monkeypatch):
    rng = np.random.default_rng(20)
    training, test = regimes.demonstrate("arm", "1-2-3", rng)
    noisy = regimes.with_noise(training[:60], 0.05, rng)
    policy = uc.LocallyLinearPolicy(3.0, 0.7, learner=uc.NoiseCorrected()).fit_demonstrations(noisy)
    _, held = regimes._knowledge(policy, training[:60], test)
    assert held > 0.8
    monkeypatch.setattr(consistent, "_repeats", lambda time, samples: time)
    naively = policy.with_learner(uc.NoiseCorrected())  # what the model misses is taken to average out
    assert regimes._knowledge(naively, training[:60], test)[1] < held - 0.05


def test_what_no_action_shows_is_undetermined():
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (300, 2))
    wanted = spiral(states) + np.array([1.5, 1.0])
    actions = wanted * [1.0, 0.0] + 0.01 * rng.standard_normal((300, 2))  # nobody ever moves along the second axis
    policy = uc.ParametricPolicy(uc.Affine(), uc.NoiseCorrected()).fit(states, actions, groups=np.arange(300) // 30)
    spread = policy.uncertainty(states)
    assert np.median(spread.undetermined[:, 1]) > 5 * np.median(spread.undetermined[:, 0])
    assert np.median(spread.undetermined[:, 1]) > 0.1
    assert policy.solution_.determined_share < 1.0


def test_free_data_leaves_little_open():
    data = draw(samples=400, constrained=False, noise=0.02)
    policy = uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 3), uc.Robust()).fit(
        data.states, data.actions, groups=np.arange(400) // 40
    )
    spread = policy.uncertainty(data.states)
    assert np.median(spread.undetermined / spread.total) < 0.5
    assert np.median(spread.total) < 0.1 * np.abs(data.policy).mean()


def test_far_from_the_data_more_is_open():
    training, _ = recorded()
    policy = uc.LocallyLinearPolicy(0.2, learner=uc.Robust()).fit_demonstrations(training)
    inside = np.concatenate([d.states for d in training])
    assert policy.uncertainty(inside + 20.0).total.min() > np.median(policy.uncertainty(inside).total)


def test_standard_risk_of_the_moments_is_that_of_the_samples():
    data = draw(samples=50)
    samples = samples_of(data, models=2)
    mine = samples.risk(data.actions, np.ones(50))
    moments = samples.moments(data.actions, np.ones(50))
    for one, other in zip(
        (mine.hessian, mine.linear, mine.constant),
        (lambda q: (q.hessian, q.linear, q.constant))(standard_risk(moments)),
        strict=True,
    ):
        assert_allclose(one, other, atol=1e-10)
    assert inconsistency(moments).hessian.shape == mine.hessian.shape


# What a careful reader found


def test_where_no_sample_is_nothing_counts_as_known():
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 0, (400, 2))
    actions = spiral(states) + 0.02 * rng.standard_normal((400, 2))
    policy = uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 3, 8), uc.Robust())
    policy.fit(states, actions, groups=np.arange(400) // 40)
    inside, outside = policy.uncertainty([[-0.5, -0.5]]).total, policy.uncertainty([[2.0, 2.0]]).total
    assert outside.min() > 50 * inside.max()
    assert outside.min() > 1.0


def test_a_demonstration_at_rest_does_not_choose_the_softness():
    data = draw(samples=300, noise=0.002, policy=lambda x: x @ [[0.3, -1.0], [0.8, 0.2]] + [0.6, -0.9])
    still = 0.002 * np.random.default_rng(1).standard_normal((30, 2))
    states, actions = np.vstack([data.states, data.states[:30]]), np.vstack([data.actions, still])
    groups = np.concatenate([np.arange(300) // 30, np.full(30, 10)])
    moving = uc.ParametricPolicy(uc.Affine(), uc.Hybrid(alpha="auto"), uc.Folds(11)).fit(
        states[:300], actions[:300], groups=groups[:300]
    )
    both = clone(moving).fit(states, actions, groups=groups)
    assert both.learner.chosen_softness(both._folds) <= 10 * moving.learner.chosen_softness(moving._folds)


def test_a_common_factor_of_small_weights_changes_nothing(sampler):
    data = draw(samples=200)
    policy = uc.ParametricPolicy(uc.Affine(), sampler)
    once = clone(policy).fit(data.states, data.actions, np.full(200, 1.0), data.groups)
    small = clone(policy).fit(data.states, data.actions, np.full(200, 1 / 200), data.groups)
    assert_allclose(small.predict(data.states), once.predict(data.states), atol=1e-9)
    assert_allclose(small.uncertainty(data.states).total, once.uncertainty(data.states).total, rtol=1e-6)


def test_interleaved_demonstrations_are_put_in_order(sampler):
    training, _ = recorded(seed=11)
    states, actions, groups = uc.stack(training)
    order = np.argsort(np.concatenate([np.arange(len(d)) for d in training]), kind="stable")
    plain = on_grid(sampler).fit(states, actions, groups=groups)
    mixed = on_grid(sampler).fit(states[order], actions[order], groups=groups[order])
    error = ((plain.predict(states) - mixed.predict(states)) ** 2).mean()
    assert error < 0.02 * plain.predict(states).var()
    assert np.abs(mixed.solution_.free - plain.solution_.free[order]).mean() < 0.1


def test_a_buffer_that_is_used_again_does_no_harm():
    data = draw(samples=120)
    groups = np.arange(120) // 12
    plain = uc.ParametricPolicy(uc.Affine(), uc.Robust())
    buffered = clone(plain)
    states, actions = np.empty((60, 2)), np.empty((60, 2))
    for rows in (slice(0, 60), slice(60, None)):
        states[:], actions[:] = data.states[rows], data.actions[rows]
        plain.partial_fit(data.states[rows].copy(), data.actions[rows].copy(), groups=groups[rows])
        buffered.partial_fit(states, actions, groups=groups[rows])
    assert_array_equal(buffered.predict(data.states), plain.predict(data.states))


def test_samples_that_were_not_kept_in_between_are_missed():
    data = draw(samples=120)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(data.states, data.actions, groups=data.groups)
    hybrid = policy.with_learner(uc.Hybrid()).partial_fit(data.states, data.actions, groups=data.groups)
    with pytest.raises(uc.UnconstrainError, match="sums alone"):
        hybrid.with_learner(uc.Robust())


def test_a_refused_batch_leaves_no_trace():
    data = draw(samples=120)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Robust())
    policy.partial_fit(data.states, data.actions, groups=data.groups)
    with pytest.raises(uc.UnconstrainError, match="groups"):
        policy.partial_fit(data.states, data.actions)
    policy.partial_fit(data.states, data.actions, groups=data.groups)
    assert len(policy.solution_.free) == 240


def test_speed_is_not_counted_twice():
    training, _ = recorded()
    with pytest.raises(uc.UnconstrainError, match="weigh speed themselves"):
        on_grid(uc.Robust()).fit_demonstrations(training, speed_power=2.0)


def test_labels_by_group_need_groups():
    data = draw()
    with pytest.raises(uc.UnconstrainError, match="at least two"):
        uc.ParametricPolicy(uc.Affine(), uc.Segments("groups")).fit(data.states, data.actions)


def test_one_action_has_an_uncertainty():
    data = draw(samples=200, constrained=False, noise=0.1)
    policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(data.states, data.actions[:, 0])
    assert policy.uncertainty(data.states).total.min() > 1e-3
    assert 0.05 < policy.solution_.noise < 0.4

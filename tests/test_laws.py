"""What must hold whatever the learner and whatever the policy."""

from copy import deepcopy
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.base import clone

import naive
import unconstrain as uc
from conftest import LEARNERS, POLICIES, ROBUST
from samples import draw, rotation, seen
from unconstrain.risks import FoldedMoments, Moments, gather
from unconstrain.risks.objectives import inconsistency, standard_risk
from unconstrain.risks.quadratic import lexicographic_path

EVERY = ROBUST | LEARNERS


@pytest.fixture(params=EVERY.values(), ids=EVERY)
def learner(request):
    """Each learner in turn, the default first; those of the robust ones look at samples."""
    return request.param


@pytest.fixture(params=product(EVERY, POLICIES), ids="-".join)
def combination(request):
    """Names of each learner and policy in turn."""
    return request.param


@pytest.fixture
def policy(combination):
    """Each policy with each learner, not fitted."""
    name, kind = combination
    return POLICIES[kind](EVERY[name])


@cache
def learnt(name, kind, grouped=False):
    """A policy fitted to the samples that are the same everywhere here; not to be changed."""
    data = draw()
    return POLICIES[kind](EVERY[name]).fit(data.states, data.actions, groups=data.groups if grouped else None)


@pytest.fixture
def plain(combination):
    """The same, fitted without groups."""
    return learnt(*combination)


@pytest.fixture
def grouped(combination):
    """The same, fitted with groups."""
    return learnt(*combination, grouped=True)


FROM_SUMS = pytest.mark.parametrize("combination", list(product(LEARNERS, POLICIES)), ids="-".join)
"""Runs over learners that look at moments alone."""

FROM_SAMPLES = pytest.mark.parametrize("combination", list(product(ROBUST, POLICIES)), ids="-".join)
"""Runs over learners that look at samples."""


seeds = st.integers(0, 2**32 - 1)


def assert_same(actual, expected, tolerance=1e-6):
    """Equal to a share of the largest expected number."""
    assert_allclose(actual, expected, rtol=0, atol=tolerance * max(np.abs(expected).max(), 1e-300))


def assert_same_moments(actual, expected, tolerance=1e-11):
    for mine, theirs in zip(actual.sums, expected.sums, strict=True):
        assert_same(mine, theirs, tolerance)


def placed(policy, data):
    """The same policy with features and fields laid where these data have them, for good."""
    fitted = clone(policy).set_params(learner=uc.Direct()).fit(data.states, data.actions)
    if isinstance(policy, uc.LocallyLinearPolicy):
        return clone(policy).set_params(centres=fitted.fields_.centres, variance=fitted.fields_.variance)
    return clone(policy).set_params(features=fitted.features_)


def random_moments(seed, samples=8, d=2, p=3, models=1):
    rng = np.random.default_rng(seed)
    counts = rng.uniform(0, 1, (samples, models))
    return gather(rng.standard_normal((samples, p)), rng.standard_normal((samples, d)), counts)


# Moments


@given(seeds, st.integers(1, 3), st.permutations(range(5)))
def test_moments_add_in_any_order(seed, models, order):
    parts = [random_moments([seed, i], models=models) for i in range(5)]
    forwards, shuffled = parts[0], parts[order[0]]
    for part in parts[1:]:
        forwards = forwards + part
    for i in order[1:]:
        shuffled = shuffled + parts[i]
    assert_same_moments(shuffled, forwards)


@given(seeds, st.integers(1, 3), st.floats(0, 100))
def test_moments_scale_and_subtract(seed, models, factor):
    whole, part = random_moments([seed, 0], models=models), random_moments([seed, 1], models=models)
    assert_same_moments((whole + part) - part, whole)
    assert_same_moments(factor * whole + factor * part, (whole + part) * factor)


def test_moments_of_batches_add_up_to_moments_of_all(policy_of, data):
    policy = placed(policy_of(uc.Direct()), data)
    halves = [
        clone(policy).fit(data.states[half], data.actions[half]).moments_ for half in (slice(40), slice(40, None))
    ]
    assert_same_moments(halves[1] + halves[0], clone(policy).fit(data.states, data.actions).moments_)


@FROM_SUMS
def test_taking_a_fold_away_is_fitting_without_it(policy, data):
    policy = placed(policy, data)
    out = data.groups == 2
    whole = clone(policy).fit(data.states, data.actions).moments_
    fold = clone(policy).fit(data.states[out], data.actions[out]).moments_
    rest = clone(policy).fit(data.states[~out], data.actions[~out]).moments_
    assert_same_moments(whole - fold, rest)
    subtracted, refitted = (
        policy.learner.learn(seen(FoldedMoments((moments,), range(1)))) for moments in (whole - fold, rest)
    )
    assert_same(subtracted.weights, refitted.weights, 1e-4)


def test_validation_trains_on_all_folds_but_the_one_held_out(policy_of, data):
    policy = placed(policy_of(uc.Direct()), data).set_params(validation=uc.Folds(3, by="demonstration"))
    fitted = clone(policy).fit(data.states, data.actions, groups=data.groups).training_
    rounds, folds = fitted.gathered.rounds(), fitted.split.assign(data.states, data.groups)
    assert len(rounds) == 3
    assert all(np.ptp(folds[data.groups == demonstration]) == 0 for demonstration in range(6))
    assert_array_equal(np.bincount(folds), 30)
    for fold, (training, held_out) in enumerate(rounds):
        out = folds == fold
        for rows, moments in ((~out, training), (out, held_out)):
            refitted = clone(policy).fit(data.states[rows], data.actions[rows], groups=data.groups[rows])
            assert_same_moments(moments, refitted.moments_)


# Vectorised sums against the paper's


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("models", [1, 4])
def test_vectorised_sums_equal_loops_over_the_equations(d, models):
    rng = np.random.default_rng(d)
    features, actions = rng.standard_normal((30, 4)), rng.standard_normal((30, d))
    actions[[3, 17]] = 0.0
    counts = rng.uniform(0, 2, (30, models))
    moments = gather(features, actions, counts)
    primary, secondary = inconsistency(moments), standard_risk(moments)
    for m in range(models):
        E0, g, H = naive.inconsistency_terms(features, actions, counts[:, m])
        E02, linear, M = naive.risk_terms(features, actions, counts[:, m])
        for quadratic, expected in ((primary, (E0, g, H)), (secondary, (E02, linear, M))):
            assert_allclose(quadratic.constant[m], expected[0])
            assert_allclose(quadratic.linear[m], expected[1], atol=1e-12)
            assert_allclose(quadratic.hessian[m], expected[2], atol=1e-12)


@given(seeds)
def test_quadratics_are_the_errors_of_the_policy(seed):
    rng = np.random.default_rng(seed)
    features, actions, W = rng.standard_normal((12, 3)), rng.standard_normal((12, 2)), rng.standard_normal((2, 3))
    moments, w = gather(features, actions), W.ravel(order="F")[None]
    predicted = features @ W.T
    assert_allclose(inconsistency(moments)(w), naive.inconsistency(actions, predicted), rtol=1e-9)
    assert_allclose(standard_risk(moments)(w), naive.standard_risk(actions, predicted), rtol=1e-9)


def naive_solution(learner, features, actions, weights=None):
    """Each learner with a fixed threshold, as the paper has it; W and the number of directions determined."""
    _, g, H = naive.inconsistency_terms(features, actions, weights)
    _, m, M = naive.risk_terms(features, actions, weights)
    if isinstance(learner, uc.Direct):
        return naive.as_matrix(np.linalg.pinv(M, rcond=1e-12, hermitian=True) @ m, actions.shape[1])
    if isinstance(learner, uc.Hybrid):
        H, g = H + learner.softness * M, g + learner.softness * m
    eigenvalues = np.linalg.eigvalsh(H)
    undetermined = int((eigenvalues <= max(learner.threshold, 1e-10) * eigenvalues[-1]).sum())
    w = (
        naive.hybrid(H, g, M, m, undetermined)
        if isinstance(learner, uc.Hybrid)
        else naive.truncated(H, g, undetermined)
    )
    return naive.as_matrix(w, actions.shape[1])


FIXED = [
    uc.Direct(),
    uc.Inconsistency(),
    uc.Inconsistency(threshold=0.05),
    uc.Hybrid(threshold=0.0),
    uc.Hybrid(threshold=0.05),
    uc.Hybrid(threshold=0.02, softness=0.1),
]


@pytest.mark.parametrize("learner", FIXED, ids=str)
def test_the_parametric_policy_is_the_paper_s(learner, data):
    rbf = uc.NormalisedRBF.grid(-1, 1, 3)
    W = naive_solution(learner, naive.normalised_rbf(data.states, rbf.centres, rbf.variance), data.actions)
    there = np.random.default_rng(5).uniform(-1, 1, (20, 2))
    policy = uc.ParametricPolicy(rbf, learner).fit(data.states, data.actions)
    assert_same(policy.predict(there), naive.normalised_rbf(there, rbf.centres, rbf.variance) @ W.T)


@pytest.mark.parametrize("learner", FIXED, ids=str)
def test_the_locally_linear_policy_is_the_paper_s(learner, data):
    centres, variance = np.array([[-0.5, -0.5], [0.5, 0.0], [0.0, 0.7]]), 0.3
    matrices = []
    for c in centres:
        weights = np.array([naive.gaussian(x, c, variance) for x in data.states])
        local = np.column_stack([(data.states - c) / np.sqrt(variance), np.ones(len(data.states))])
        matrices.append(naive_solution(learner, local, data.actions, weights))
    there = np.random.default_rng(5).uniform(-1, 1, (20, 2))
    policy = uc.LocallyLinearPolicy(variance, centres=centres, learner=learner).fit(data.states, data.actions)
    assert_same(policy.predict(there), naive.locally_linear(there, centres, variance, matrices))


# The threshold path


@pytest.mark.parametrize("models", [1, 3])
@pytest.mark.parametrize("samples", [5, 40])
def test_the_path_equals_factoring_again_at_each_threshold(models, samples):
    rng = np.random.default_rng(samples)
    features, actions = rng.standard_normal((samples, 3)), rng.standard_normal((samples, 2))
    counts = rng.uniform(0.1, 1, (samples, models))
    moments = gather(features, actions, counts)
    path = lexicographic_path(inconsistency(moments), standard_risk(moments))
    pure = lexicographic_path(inconsistency(moments))
    assert path.weights.shape == (models, 6, 7)
    for m in range(models):
        _, g, H = naive.inconsistency_terms(features, actions, counts[:, m])
        _, linear, M = naive.risk_terms(features, actions, counts[:, m])
        assert path.lowest[m] == max(0, 6 - samples)
        for k in range(7):
            kept = max(k, path.lowest[m])
            assert_same(path.weights[m, :, k], naive.hybrid(H, g, M, linear, kept), 1e-7)
            assert_allclose(pure.weights[m, :, k], naive.truncated(H, g, kept), atol=1e-6)


def test_hybrid_that_determines_nothing_is_direct(policy_of, data):
    end, direct = (
        policy_of(learner).fit(data.states, data.actions) for learner in (uc.Hybrid(threshold=1.0), uc.Direct())
    )
    assert (end.solution_.determined == 0).all()
    assert_same(end.predict(data.states), direct.predict(data.states), 1e-9)


def test_hybrid_that_determines_all_it_can_is_the_inconsistency_where_that_decides(policy_of):
    data = draw(samples=200)
    end, pure = (
        policy_of(learner).fit(data.states, data.actions) for learner in (uc.Hybrid(threshold=0.0), uc.Inconsistency())
    )
    assert (end.solution_.determined == end.solution_.directions).all()
    assert_same(end.predict(data.states), pure.predict(data.states), 1e-9)


def test_hybrid_fills_what_the_inconsistency_leaves_open_with_the_standard_risk(policy_of):
    # Every action along x: the inconsistency knows nothing about y, and the risk says it does not move.
    data = draw(policy=lambda x: np.column_stack([1 + x[:, 0], 0 * x[:, 0]]), noise=0.0, constrained=False)
    end = policy_of(uc.Hybrid(threshold=0.0)).fit(data.states, data.actions)
    pure = policy_of(uc.Inconsistency()).fit(data.states, data.actions)
    assert (2 * end.solution_.determined <= end.solution_.directions).all()
    assert_same(end.predict(data.states)[:, 0], pure.predict(data.states)[:, 0], 1e-6)
    assert_allclose(end.predict(data.states)[:, 1], 0, atol=1e-9)


# Symmetries


def test_rotating_the_actions_rotates_the_policy(policy):
    data = draw(policy=lambda x: np.column_stack([x[:, 1], -x[:, 0], x[:, 0] * x[:, 1]]))
    R = rotation(3, 3)
    plain = clone(policy).fit(data.states, data.actions).predict(data.states)
    turned = clone(policy).fit(data.states, data.actions @ R.T).predict(data.states)
    assert_same(turned, plain @ R.T)


@pytest.mark.parametrize("factor", [-1e3, 1e-150, 1e25])
def test_scaling_the_actions_scales_the_policy(policy, plain, data, factor):
    scaled = clone(policy).fit(data.states, factor * data.actions).predict(data.states) / factor
    assert_same(scaled, plain.predict(data.states), exactness(policy))


def test_samples_at_rest_stay_at_rest_in_any_unit(policy, data):
    actions = data.actions * (np.arange(len(data.actions)) % 9 > 0)[:, None]
    plain = clone(policy).fit(data.states, actions, groups=data.groups).predict(data.states)
    for factor in (1e-20, 1e12):
        scaled = clone(policy).fit(data.states, factor * actions, groups=data.groups).predict(data.states) / factor
        assert_same(scaled, plain, exactness(policy))


def exactness(policy):
    """Segments hardly need any prior on this data: what rounding makes of it is 1e-6."""
    return 1e-5 if isinstance(policy.learner, uc.Segments) else 1e-9


@pytest.mark.parametrize("weight", [1e-310, 10.0, 1e29])
def test_scaling_all_weights_changes_nothing(policy, grouped, data, weight):
    weights = np.full(len(data.states), weight)
    heavy = clone(policy).fit(data.states, data.actions, sample_weight=weights, groups=data.groups)
    assert_same(heavy.predict(data.states), grouped.predict(data.states), 1e-9)
    assert_same_beliefs(heavy, grouped)


def test_units_and_origin_of_the_states_change_nothing(data):
    for policy in (uc.ParametricPolicy(uc.Affine()), uc.ParametricPolicy(), uc.LocallyLinearPolicy()):
        plain = clone(policy).fit(data.states, data.actions).predict(data.states)
        for factor, offset in ((1e-8, 0.0), (1e8, 0.0), (1.0, 1e6), (1e3, -1e3)):
            moved = factor * data.states + offset
            assert_same(clone(policy).fit(moved, data.actions).predict(moved), plain)


def test_the_order_of_samples_does_not_matter(policy, plain, data):
    order = np.random.default_rng(1).permutation(len(data.states))
    shuffled = clone(policy).fit(data.states[order], data.actions[order])
    assert_same(shuffled.predict(data.states), plain.predict(data.states), 1e-9)
    assert_same_beliefs(shuffled, plain, order)


def test_neither_order_nor_names_matter_where_groups_are_held_out(policy, grouped, data):
    order = np.random.default_rng(1).permutation(len(data.states))
    names = np.array(["f", "b", "d", "a", "e", "c"])[data.groups[order]]
    shuffled = clone(policy).fit(data.states[order], data.actions[order], groups=names)
    assert_same(shuffled.predict(data.states), grouped.predict(data.states), 1e-9)
    assert_same_beliefs(shuffled, grouped, order)


@pytest.mark.parametrize("folds", [3, 10], ids="{} folds".format)
def test_the_order_of_demonstrations_does_not_matter(policy, data, folds):
    policy.set_params(validation=uc.Folds(folds))
    grouped = clone(policy).fit(data.states, data.actions, groups=data.groups)
    order = np.argsort(np.array([4, 1, 5, 0, 3, 2])[data.groups], kind="stable")
    shuffled = clone(policy).fit(data.states[order], data.actions[order], groups=data.groups[order])
    assert_same(shuffled.predict(data.states), grouped.predict(data.states))
    assert_same_beliefs(shuffled, grouped, order)


def test_a_weight_of_zero_is_absence(policy, data):
    policy, counting = placed(policy, data), np.random.default_rng(4).integers(0, 3, len(data.states)) > 0
    with_zeros = clone(policy).fit(data.states, data.actions, sample_weight=counting.astype(float), groups=data.groups)
    without = clone(policy).fit(data.states[counting], data.actions[counting], groups=data.groups[counting])
    assert_same(with_zeros.predict(data.states), without.predict(data.states))
    assert_array_equal(with_zeros.solution_.determined, without.solution_.determined)
    assert_same_beliefs(without, with_zeros, counting)
    assert_same(with_zeros.held_out_score(), without.held_out_score())


def assert_same_beliefs(actual, expected, rows=slice(None)):
    """Of the samples at some rows, where the learner has any."""
    mine, theirs = actual.solution_.belief, expected.solution_.belief
    assert (mine is None) == (theirs is None)
    if mine is not None:
        for name in ("noise", "misfit", "free_share", "from_noise", "undetermined", "held_out_score"):
            assert_same(getattr(mine, name), getattr(theirs, name))
        assert_same(mine.free, theirs.free[rows])


def test_a_weight_is_the_same_as_a_repetition(policy, data):
    times = np.random.default_rng(4).integers(0, 4, len(data.states))
    weighted = clone(policy).fit(data.states, data.actions, sample_weight=times.astype(float), groups=data.groups)
    rows = np.repeat(np.arange(len(times)), times)
    repeated = clone(policy).fit(data.states[rows], data.actions[rows], groups=data.groups[rows])
    assert_same(weighted.predict(data.states), repeated.predict(data.states))
    assert_same_beliefs(repeated, weighted, rows)


def test_a_weight_is_the_same_as_a_repetition_where_samples_are_held_out(policy, data):
    times = np.random.default_rng(4).integers(0, 4, len(data.states))
    weighted = clone(policy).fit(data.states, data.actions, sample_weight=times.astype(float))
    rows = np.repeat(np.arange(len(times)), times)
    repeated = clone(policy).fit(data.states[rows], data.actions[rows])
    assert_same(weighted.predict(data.states), repeated.predict(data.states))


def test_the_unit_of_time_changes_nothing_but_the_unit(policy, data):
    """Actions are per second and times in seconds, or both by the millisecond."""
    seconds, milliseconds = (
        clone(policy).fit_demonstrations(
            [
                uc.Demonstration(data.states[rows], data.actions[rows] / unit, unit * 0.02 * np.arange(rows.sum()))
                for group in range(6)
                for rows in [data.groups == group]
            ]
        )
        for unit in (1.0, 1000.0)
    )
    assert_same(1000.0 * milliseconds.predict(data.states), seconds.predict(data.states))


# Truth


def test_free_linear_data_is_recovered_exactly(learner):
    W = np.array([[0.7, -1.2, 0.3], [0.4, 0.9, -2.0]])
    data = draw(policy=lambda x: np.column_stack([x, np.ones(len(x))]) @ W.T, noise=0.0, constrained=False)
    there = np.random.default_rng(9).uniform(-2, 2, (30, 2))
    for policy in (uc.ParametricPolicy(uc.Affine(), learner), uc.LocallyLinearPolicy(0.5, learner=learner)):
        policy.fit(data.states, data.actions)
        assert_allclose(policy.predict(there), np.column_stack([there, np.ones(30)]) @ W.T, atol=1e-5)


@pytest.mark.parametrize("learner", [uc.Inconsistency(), uc.Inconsistency(None), uc.Hybrid(), uc.Hybrid(threshold=0.0)])
def test_constrained_linear_data_is_recovered_by_consistency(learner):
    W = np.array([[0.7, -1.2, 0.3], [0.4, 0.9, -2.0]])
    data = draw(policy=lambda x: np.column_stack([x, np.ones(len(x))]) @ W.T, noise=0.0)
    policy = uc.ParametricPolicy(uc.Affine(), learner).fit(data.states, data.actions)
    assert_allclose(policy.predict(data.states), data.policy, atol=1e-6)
    assert policy.score(data.states, data.actions) == pytest.approx(1.0)


def test_direct_regression_is_least_squares(data):
    x = np.column_stack([data.states, np.ones(len(data.states))])
    expected = x @ np.linalg.lstsq(x, data.actions, rcond=None)[0]
    policy = uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit(data.states, data.actions)
    assert_allclose(policy.predict(data.states), expected, atol=1e-10)


def test_inconsistency_is_at_most_cpe_and_that_at_most_upe(plain, data):
    for n in range(0, len(data.states), 3):
        clean = data.projections[n] @ data.policy[n]
        one = uc.Demonstration(
            data.states[n : n + 1],
            clean[None],
            truth=uc.Truth(data.policy[n : n + 1], data.projections[n : n + 1]),
        )
        inconsistent, constrained, free = (f(plain, one) for f in (uc.inconsistency, uc.cpe, uc.upe))
        slack = 1e-12 * (1 + free)
        assert inconsistent <= constrained + slack
        assert constrained <= free + slack


# Streams and learners


@pytest.mark.parametrize("sizes", [(90,), (30, 60), (30, 1, 1, 58), (45, 45)])
@FROM_SUMS
def test_batches_are_the_same_as_all_at_once(policy, data, sizes):
    assert_same_in_batches(placed(policy, data), data, sizes)


@FROM_SAMPLES
def test_batches_of_samples_are_the_same_as_all_at_once(policy, data):
    assert_same_in_batches(placed(policy, data), data, (40, 50))


def assert_same_in_batches(policy, data, sizes):
    policy = policy.set_params(validation=uc.Folds(6, by="demonstration"))  # one each, in whatever order they are dealt
    whole = clone(policy).fit(data.states, data.actions, groups=data.groups)
    stream, stops = clone(policy), np.cumsum(sizes)
    for start, stop in zip(stops - sizes, stops, strict=True):
        stream.partial_fit(data.states[start:stop], data.actions[start:stop], groups=data.groups[start:stop])
    assert_same_moments(stream.moments_, whole.moments_)
    assert_same(stream.predict(data.states), whole.predict(data.states))


def test_a_batch_without_weight_changes_nothing(policy, plain, data):
    batches = [(data.states[rows], data.actions[rows]) for rows in (slice(0, 40), slice(40, 90))]
    expected = clone(policy).fit_batches(batches)
    idle = data.states[:7] + 5, data.actions[:7], np.zeros(7)
    assert_same(
        clone(policy).fit_batches([idle, batches[0], idle, batches[1]]).predict(data.states), expected(data.states)
    )
    assert_same(
        deepcopy(plain).partial_fit(*idle[:2], sample_weight=idle[2]).predict(data.states), plain.predict(data.states)
    )


def test_what_comes_after_the_first_batch_may_come_in_any_pieces_and_order(policy, data):
    pieces = clone(policy).fit(data.states[:50], data.actions[:50])
    once = deepcopy(pieces).partial_fit(data.states[50:], data.actions[50:])
    for rows in (slice(51, 90), slice(50, 51)):
        pieces.partial_fit(data.states[rows], data.actions[rows])
    assert_same(pieces.predict(data.states), once.predict(data.states))


@FROM_SUMS
def test_another_learner_on_the_same_moments_is_a_fresh_fit(combination, plain, data):
    assert_same_as_fresh(learnt("direct", combination[1]), plain)
    assert isinstance(plain.moments_, Moments)


@FROM_SAMPLES
def test_another_learner_on_the_same_samples_is_a_fresh_fit(combination, plain, data):
    assert_same_as_fresh(learnt("segments", combination[1]), plain)
    assert_same_as_fresh(plain, learnt("hybrid", combination[1]))


def assert_same_as_fresh(first, fresh):
    before = first.solution_.weights.copy()
    other = first.with_learner(fresh.learner)
    assert_array_equal(other.solution_.weights, fresh.solution_.weights)
    assert_array_equal(first.solution_.weights, before)
    assert other.learner == fresh.learner


def test_policies_that_share_moments_go_their_own_way_from_there(policy_of, data):
    policy = placed(policy_of(uc.Hybrid()), data).set_params(validation=uc.Folds(2, by="demonstration"))
    alone, first = (clone(policy).fit(data.states, data.actions, groups=data.groups) for _ in range(2))
    second = first.with_learner(uc.Hybrid())
    second.partial_fit(data.states[:5], data.actions[:5], groups=["new"] * 5)
    for one in (alone, first):
        one.partial_fit(data.states[:30], data.actions[:30], groups=["late"] * 30)
    assert_array_equal(first.predict(data.states), alone.predict(data.states))

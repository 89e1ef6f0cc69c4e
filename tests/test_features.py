"""Feature maps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.distance import cdist
from scipy.special import softmax
from sklearn.preprocessing import PolynomialFeatures

import naive
from unconstrain import Affine, KMeansRBF, NormalisedRBF, ParametricPolicy, Polynomial
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.models.features import Placeable, shares, squared_distances

seeds = st.integers(0, 1000)


def states(seed=0, samples=40, n=2):
    return np.random.default_rng(seed).uniform(-1, 1, (samples, n))


# Affine


def test_affine_features_are_the_state_and_one():
    assert_array_equal(Affine()(np.array([[2.0, 3.0], [4.0, 5.0]])), [[2.0, 3.0, 1.0], [4.0, 5.0, 1.0]])


def test_affine_features_are_centred_and_scaled():
    assert_array_equal(Affine(np.array([1.0, 2.0]), 2.0)(np.array([[3.0, 2.0]])), [[1.0, 0.0, 1.0]])


@pytest.mark.parametrize(("factor", "offset"), [(1.0, 0.0), (1e-8, 0.0), (1e8, 0.0), (1.0, 1e6)])
def test_placed_affine_features_have_mean_zero_and_spread_one(factor, offset):
    table = factor * states() + offset
    placed = Affine().place(table)(table)
    assert_allclose(placed[:, :2].mean(axis=0), 0, atol=1e-8)
    assert_allclose(placed[:, :2].std(axis=0), 1, rtol=1e-8)


def test_a_coordinate_that_does_not_move_is_not_blown_up():
    table = np.column_stack([states(n=1), np.full(40, 0.1)])
    assert np.abs(Affine().place(table)(table)).max() < 10


def test_affine_features_that_were_told_where_stay_there():
    told = Affine(centre=1.0)
    assert told.place(states()) is told
    assert isinstance(told, Placeable)


# Polynomials


def test_quadratic_features_are_products_of_the_state_and_one():
    assert_array_equal(Polynomial()(np.array([[2.0, 3.0]])), [[4.0, 6.0, 2.0, 9.0, 3.0, 1.0]])


@given(seeds, st.integers(1, 5), st.integers(1, 4))
def test_monomials_are_those_of_scikit_learn_in_lexicographic_order(seed, degree, n):
    there = states(seed, 10, n)
    theirs = PolynomialFeatures(degree).fit(there)
    order = sorted(range(theirs.n_output_features_), key=lambda term: tuple(-theirs.powers_[term]))
    assert_allclose(Polynomial(degree)(there), theirs.transform(there)[:, order], rtol=1e-14)


@pytest.mark.parametrize("told", [{}, {"centre": [0.5, 3.0], "scale": 2.0}])
def test_of_degree_one_they_are_affine_features(told):
    mine, affine = Polynomial(1, **told).place(states()), Affine(**told).place(states())
    assert_array_equal(mine(states(1)), affine(states(1)))


@pytest.mark.parametrize(("factor", "offset"), [(1.0, 0.0), (1e-8, 0.0), (1e8, 0.0), (1.0, 1e6)])
def test_placed_polynomials_do_not_depend_on_the_unit(factor, offset):
    placed = Polynomial(3).place(factor * states() + offset)
    assert_allclose(placed(factor * states(1) + offset), Polynomial(3).place(states())(states(1)), atol=1e-6)


def test_monomials_of_a_coordinate_that_does_not_move_are_not_blown_up():
    table = np.column_stack([states(n=1), np.full(40, 0.1)])
    assert np.abs(Polynomial(3).place(table)(table)).max() < 10


def test_polynomials_that_were_told_where_stay_there():
    placed = Polynomial(3, centre=1.0).place(states())
    assert (placed.degree, placed.centre, placed.scale) == (3, 1.0, 1.0)
    assert isinstance(placed, Placeable)


@pytest.mark.parametrize("degree", [2, 3])
def test_a_polynomial_is_learnt_exactly_from_free_movement(degree):
    def cubed(there):
        return (there @ np.array([[0.3, -1.0], [0.7, 0.4]]) + 0.2) ** degree

    policy = ParametricPolicy(Polynomial(degree), "direct").fit(states(), cubed(states()))
    assert_allclose(policy.predict(3 * states(1)), cubed(3 * states(1)), atol=1e-11)


@pytest.mark.parametrize(("degree", "most"), [(2, 61), (3, 20), (1, 1999)])
def test_more_than_two_thousand_monomials_are_refused(degree, most):
    assert Polynomial(degree)(np.ones((1, most))).shape[1] <= 2000
    with pytest.raises(SettingError, match=f"degree: got {degree} for states of {most + 1} columns, which have more"):
        Polynomial(degree)(np.ones((1, most + 1)))


def test_wide_states_are_refused_before_any_memory_is_taken():
    with pytest.raises(SettingError, match=r"Take a lower degree, fewer columns, or a LocallyLinearPolicy\."):
        ParametricPolicy(Polynomial(3)).fit(np.ones((2, 8000)), np.ones((2, 2)))


@pytest.mark.parametrize("degree", [0, -1, 1.5, "2", None])
def test_a_degree_is_a_whole_number_above_zero(degree):
    with pytest.raises(SettingError, match=r"degree: got .*, expected a whole number of at least 1"):
        Polynomial(degree)


def test_the_degree_is_a_setting_to_search_over():
    policy = ParametricPolicy(Polynomial()).set_params(features__degree=3)
    assert policy.get_params()["features__degree"] == 3
    assert policy.features(states()).shape == (40, 10)


# Normalised RBFs


@given(seeds)
def test_normalised_rbfs_are_the_paper_s(seed):
    rbf = NormalisedRBF(states(seed, 5), 0.3)
    there = states(seed + 1, 10)
    assert_allclose(rbf(there), naive.normalised_rbf(there, rbf.centres, 0.3), rtol=1e-9)


@given(seeds, st.floats(0, 99))
def test_shares_sum_to_one_however_far_away(seed, power):
    rbf = NormalisedRBF(states(seed, 5), 0.3)
    there = 10.0**power * states(seed + 1, 10)
    assert_allclose(rbf(there).sum(axis=1), 1)
    assert (rbf(there) >= 0).all()


@pytest.mark.parametrize("distance", [30.0, 1e6, 1e99])
def test_far_away_the_nearest_kernel_takes_everything(distance):
    rbf = NormalisedRBF(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), 0.1)
    far = distance * np.array([[1.0, 0.1], [0.1, 1.0], [-1.0, -1.0]])
    assert_allclose(rbf(far), np.eye(3)[[1, 2, 0]], atol=1e-10)


def test_shares_are_a_softmax_of_squared_distances():
    there, centres = states(0, 10, 3), states(1, 6, 3)
    expected = softmax(-cdist(there, centres, "sqeuclidean") / (2 * 0.2), axis=1)
    assert_allclose(shares(there, centres, 0.2), expected)


@pytest.mark.parametrize("offset", [0.0, 1e4, 1e8])
def test_a_large_common_offset_costs_no_digits(offset):
    there, centres = np.round(states(0, 10), 3), np.round(states(1, 6), 3)
    # What the offset itself rounds away is no error of the distances.
    moved, anchors = there + offset, centres + offset
    assert_allclose(
        squared_distances(moved, anchors), cdist(moved - offset, anchors - offset, "sqeuclidean"), atol=1e-6
    )
    assert_allclose(shares(moved, anchors, 0.3), shares(moved - offset, anchors - offset, 0.3), atol=1e-6)


@given(seeds)
def test_squared_distances_are_scipy_s_and_never_negative(seed):
    there, centres = states(seed, 7, 3), states(seed + 1, 4, 3)
    squared = squared_distances(np.vstack([there, centres]), centres)
    assert_allclose(squared[:7], cdist(there, centres, "sqeuclidean"), atol=1e-12)
    assert (squared >= 0).all()


def test_support_is_the_weight_of_the_nearest_kernel():
    rbf = NormalisedRBF(np.array([[0.0], [1.0]]), 0.5)
    assert_allclose(rbf.support(np.array([[0.0], [0.75], [1e9]])), [1.0, np.exp(-(0.25**2)), 0.0])


@pytest.mark.parametrize("function", [squared_distances, lambda x, c: shares(x, c, 1.0)])
def test_states_of_another_width_are_refused(function):
    with pytest.raises(InvalidDataError, match="states: got 3 columns, expected 2 as the centres have"):
        function(np.ones((1, 3)), np.ones((1, 2)))


@pytest.mark.parametrize(
    ("centres", "variance", "error", "sentence"),
    [
        ([[0.0]], 0.0, SettingError, "variance: got 0.0, expected a number above 1e-100"),
        ([[0.0]], np.nan, SettingError, "variance: got nan, expected a number above 1e-100"),
        ([0.0], 1.0, InvalidDataError, r"centres: got an array of shape \(1,\)"),
        ([[np.nan]], 1.0, InvalidDataError, "centres: found nan at row 0, column 0"),
    ],
)
def test_centres_and_variance_are_checked(centres, variance, error, sentence):
    with pytest.raises(error, match=sentence):
        NormalisedRBF(centres, variance)


# Grids


def test_a_grid_has_a_centre_at_each_crossing():
    rbf = NormalisedRBF.grid(-1, 1, 3)
    expected = [[x, y] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)]
    assert_array_equal(rbf.centres, expected)
    assert rbf.variance == 1.0


@pytest.mark.parametrize("scale", [1.0, 10.0, 1e3, 1e150])
@pytest.mark.parametrize(
    "grid", [NormalisedRBF.grid(-1, 1, 5), NormalisedRBF.grid([0, 1, -3], [1, 9, 3], [2, 3, 4], width=2.0)]
)
def test_kernels_on_a_grid_are_those_anywhere_in_another_order(grid, scale):
    """A grid is computed axis by axis; its centres in another order are no grid, and one by one."""
    rng = np.random.default_rng(0)
    order = rng.permutation(len(grid.centres))
    at = scale * rng.standard_normal((50, grid.centres.shape[1]))
    assert_allclose(grid(at)[:, order], NormalisedRBF(grid.centres[order], grid.variance)(at), rtol=1e-10, atol=1e-13)


def test_the_paper_s_grid_has_36_centres():
    assert NormalisedRBF.grid(-1, 1, 6).centres.shape == (36, 2)


def test_axes_may_differ():
    rbf = NormalisedRBF.grid([0, 0, 0], [1, 2, 3], [2, 3, 4], width=2.0)
    assert rbf.centres.shape == (24, 3)
    assert_array_equal(rbf.centres.max(axis=0), [1, 2, 3])
    assert rbf.variance == pytest.approx((2.0 * 1.0) ** 2)


def test_a_line_is_a_grid_of_one_dimension():
    assert_array_equal(NormalisedRBF.grid(0, 2, 3, dimensions=1).centres, [[0.0], [1.0], [2.0]])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((0, 1, 1), "got low=0, high=1, per_axis=1; expected low < high and a whole number of at least two centres"),
        ((1, 0, 3), "got low=1, high=0, per_axis=3; expected low < high"),
        ((0, np.nan, 3), "got low=0, high=nan, per_axis=3; expected low < high"),
        (([0, 0], [1, 1, 1], 3), "low, high and per_axis have 2, 3 and 1 values"),
    ],
)
def test_a_grid_that_cannot_be_is_refused(arguments, sentence):
    with pytest.raises(SettingError, match=sentence):
        NormalisedRBF.grid(*arguments)


def test_half_a_centre_on_an_axis_is_refused():
    with pytest.raises(
        SettingError, match=r"per_axis=2.5; expected low < high and a whole number of at least two centres"
    ):
        NormalisedRBF.grid(0, 1, 2.5)


def test_the_width_of_a_grid_is_positive():
    with pytest.raises(SettingError, match="width: got 0, expected a number above 0"):
        NormalisedRBF.grid(0, 1, 3, width=0)


# k-means


def test_centres_of_clusters_are_found_and_their_spacing_is_the_width():
    middles = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    table = np.vstack([middles + 1e-3 * move for move in states(0, 20)])
    rbf = NormalisedRBF.kmeans(table, 3, width=0.5)
    order = cdist(middles, rbf.centres).argmin(axis=1)
    assert_allclose(rbf.centres[order], middles, atol=1e-3)
    assert np.sqrt(rbf.variance) == pytest.approx(0.5 * np.mean([3.0, 4.0, 3.0]), rel=1e-3)


@pytest.mark.parametrize(("factor", "offset"), [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e6)])
def test_k_means_moves_with_the_data(factor, offset):
    plain = NormalisedRBF.kmeans(states(), 5)
    moved = NormalisedRBF.kmeans(factor * states() + offset, 5)
    assert_allclose(moved.centres, factor * plain.centres + offset, rtol=1e-6, atol=1e-7 * factor)
    assert moved.variance == pytest.approx(factor**2 * plain.variance, rel=1e-6)


@pytest.mark.parametrize("value", [0.0, 0.1, 1e8, -1e-8])
def test_states_that_are_all_the_same_have_one_centre(value):
    rbf = NormalisedRBF.kmeans(np.full((7, 2), value), 3)
    assert_array_equal(rbf.centres, [[value, value]])
    assert rbf.variance == 1.0


def test_there_are_no_more_centres_than_different_states():
    assert len(NormalisedRBF.kmeans(np.repeat([[0.0], [1.0], [5.0]], 10, axis=0), 8).centres) == 3


def test_one_centre_has_a_width_too():
    assert NormalisedRBF.kmeans(np.array([[-1.0], [1.0]]), 1).variance == 1.0


def test_states_that_differ_by_rounding_do_not_crowd_centres_together():
    table = np.append(1e-18 * np.arange(1, 40), 1.0)[:, None]
    rbf = NormalisedRBF.kmeans(table, 10)
    assert len(rbf.centres) == 2
    assert rbf.variance == pytest.approx(1.0)


def test_centres_are_laid_on_the_first_data():
    placed = KMeansRBF(5).place(states())
    assert isinstance(placed, NormalisedRBF)
    assert len(placed.centres) == 5
    assert isinstance(KMeansRBF(), Placeable)


@pytest.mark.parametrize(("samples", "centres"), [(1, 1), (3, 1), (8, 2), (40, 10)])
def test_there_is_at_most_one_centre_for_each_four_states(samples, centres):
    assert len(KMeansRBF(25).place(states(samples=samples)).centres) == centres


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [({"count": 0}, "count: got 0"), ({"count": 2.5}, "count: got 2.5"), ({"width": -1.0}, "width: got -1.0")],
)
def test_settings_of_k_means_are_checked(arguments, sentence):
    with pytest.raises(SettingError, match=sentence):
        NormalisedRBF.kmeans(states(), **({"count": 3} | arguments))


# Roughness


@pytest.mark.parametrize(
    "centres",
    [states(3, 12), NormalisedRBF.grid(-1, 2, 5).centres, states(4, 9, n=3), states(5, 5), states(6, 14, n=7)],
)
def test_roughness_is_what_neighbours_do_not_say(centres):
    values = np.random.default_rng(0).standard_normal(len(centres))
    measure = NormalisedRBF(centres, 0.3).roughness()
    assert_allclose(values @ measure @ values, naive.roughness(centres, values), rtol=1e-3)
    assert_allclose(measure, measure.T, atol=1e-12)


@given(seeds, st.sampled_from([1e-6, 1.0, 1e6]))
def test_of_affine_functions_there_is_none_whatever_the_unit(seed, unit):
    centres = unit * states(seed, 15)
    measure = NormalisedRBF(centres, unit**2).roughness()
    affine = centres @ [0.7, -1.3] / unit + 0.4
    bent = (centres[:, 0] / unit) ** 2
    assert affine @ measure @ affine < 1e-6  # a thousandth, squared: what the ridge of its regressions leaves
    assert bent @ measure @ bent > 1e-4
    assert_allclose(measure, NormalisedRBF(centres / unit, 1.0).roughness(), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("centres", [states(0, 1), states(0, 3), np.zeros((6, 2))])
def test_so_few_kernels_are_never_rough(centres):
    assert_array_equal(NormalisedRBF(centres, 1.0).roughness(), np.zeros((len(centres), len(centres))))

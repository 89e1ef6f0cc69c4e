"""The Kalman smoother against the recursions of Rauch, Tung and Striebel, and the noise that it says there is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import cho_solve_banded

import unconstrain as uc
from test_cli import run, write
from unconstrain.base.errors import InvalidDataError
from unconstrain.learners.robust.noise import noise_of_each
from unconstrain.recordings.preparation import Recipe, differentiate, prepare
from unconstrain.recordings.signals import smoothing

RNG = np.random.default_rng(0)
TIMES = 0.02 * np.arange(300)
CIRCLE = np.column_stack([np.cos(1.5 * TIMES), np.sin(1.5 * TIMES)])
SPEED = 1.5 * np.column_stack([-np.sin(1.5 * TIMES), np.cos(1.5 * TIMES)])


def noisy(size, seed=1):
    return CIRCLE + size * np.random.default_rng(seed).normal(size=CIRCLE.shape)


def recursions(steps, measured, ratio, prior=1e9):
    """Filter and smoother written from the textbook, with r = 1 and q = ratio; smoothed states, variances, log-density.

    A first state of finite variance stands in for one of which nothing is said.
    """

    def transition(t):
        spread = [[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]]
        return np.array([[1, t, t * t / 2], [0, 1, t], [0, 0, 1]]), ratio * np.array(spread)

    mean, spread, density = np.zeros(3), prior * np.eye(3), 0.0
    filtered, predicted = [], []
    for index, value in enumerate(measured):
        if index:
            forward, noise = transition(steps[index - 1])
            mean, spread = forward @ mean, forward @ spread @ forward.T + noise
        predicted.append((mean, spread))
        variance = spread[0, 0] + 1.0
        density -= 0.5 * (np.log(2 * np.pi * variance) + (value - mean[0]) ** 2 / variance)
        gain = spread[:, 0] / variance
        mean, spread = mean + gain * (value - mean[0]), spread - np.outer(gain, spread[0])
        filtered.append((mean, spread))
    means, spreads = [mean], [spread]
    for index in reversed(range(len(steps))):
        forward, _ = transition(steps[index])
        (mean, spread), (ahead, wide) = filtered[index], predicted[index + 1]
        gain = np.linalg.solve(wide, forward @ spread).T
        means.insert(0, mean + gain @ (means[0] - ahead))
        spreads.insert(0, spread + gain @ (spreads[0] - wide) @ gain.T)
    return np.array(means), np.array(spreads), density


@pytest.mark.parametrize("ratio", [1e-4, 1e-2, 1.0, 50.0])
def test_one_banded_system_is_the_filter_and_the_smoother(ratio):
    steps = RNG.uniform(0.4, 1.8, 24)
    measured = np.sin(0.4 * np.append(0, np.cumsum(steps))) + 0.1 * RNG.normal(size=25)
    means, spreads, _ = recursions(steps, measured, ratio)
    factor = smoothing._factor(smoothing._precision(steps), np.log(ratio))
    states = cho_solve_banded((factor, False), smoothing._measured(measured)).reshape(-1, 3)
    assert_allclose(states, means, atol=1e-5 * np.abs(means).max())
    places = ((np.arange(smoothing.PLACES) + 0.5) / smoothing.PLACES * 25).astype(int)
    assert smoothing._velocity_variance(factor, 25) == pytest.approx(spreads[places, 1, 1].mean(), rel=1e-4)


def test_the_noise_is_the_most_likely_one():
    measured = noisy(0.02)[:80, 0] - noisy(0.02)[:80, 0].mean()
    found = np.exp(smoothing._likeliest(smoothing._precision(np.ones(79)), measured))

    def profile(ratio):  # the noise that is likeliest beside a ratio scales the residual to one
        residual = smoothing._residual(
            measured,
            cho_solve_banded(
                (smoothing._factor(smoothing._precision(np.ones(79)), np.log(ratio)), False),
                smoothing._measured(measured),
            ),
        )
        scale = np.sqrt(residual / 77)
        return recursions(np.ones(79), measured / scale, ratio, 1e6 / scale**2)[2] - 77 * np.log(scale)

    best = profile(found)
    assert best >= max(profile(found * factor) for factor in (0.3, 0.7, 1.5, 3.0)) - 1e-2


@pytest.mark.parametrize("size", [1e-3, 1e-2, 5e-2])
def test_velocities_are_nearer_than_those_of_a_window_and_as_near_as_they_say(size):
    found = smoothing.kalman_velocities(TIMES, noisy(size))
    error = np.sqrt(((found.velocities - SPEED) ** 2).mean())
    assert error < 0.6 * np.sqrt(((differentiate(TIMES, noisy(size)) - SPEED) ** 2).mean())
    assert 0.4 < error / np.sqrt((found.deviations**2).mean()) < 1.3


def test_the_noise_of_a_movement_driven_by_white_jerk_is_calibrated():
    errors, said = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        state, states = np.zeros(3), []
        root = np.linalg.cholesky([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1]])
        for _ in range(200):
            states.append(state)
            state = np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]]) @ state + 0.01 * root @ rng.normal(size=3)
        track = np.array(states)
        found = smoothing.kalman_velocities(np.arange(200.0), track[:, :1] + rng.normal(size=(200, 1)))
        errors.append(((found.velocities[:, 0] - track[:, 1]) ** 2).mean())
        said.append(found.deviations[0] ** 2)
    assert np.sqrt(np.mean(errors) / np.mean(said)) == pytest.approx(1.0, abs=0.15)


def test_without_noise_it_is_exact_and_units_of_time_and_length_change_nothing():
    found = smoothing.kalman_velocities(TIMES, CIRCLE)
    assert_allclose(found.velocities, SPEED, atol=1e-3)
    other = smoothing.kalman_velocities(1e3 * TIMES, 1e-6 * noisy(0.01))
    plain = smoothing.kalman_velocities(TIMES, noisy(0.01))
    assert_allclose(1e9 * other.velocities, plain.velocities, atol=0.02 * plain.deviations.max())
    assert_allclose(1e9 * other.deviations, plain.deviations, rtol=1e-2)


def test_standing_still_and_straight_lines_have_no_velocity_to_doubt():
    track = np.column_stack([np.ones(50), 3.0 * TIMES[:50]])
    found = smoothing.kalman_velocities(TIMES[:50], track)
    assert_allclose(found.velocities, [[0.0, 3.0]] * 50, atol=1e-6)
    assert_allclose(found.deviations, 0.0, atol=1e-6)


def test_demonstrations_keep_their_noise():
    recordings = [uc.Recording(("x", "y"), noisy(size, 3), TIMES, f"{size}") for size in (0.01, 0.03)]
    quiet, loud = prepare(recordings, Recipe(("x", "y"), differentiate="kalman"))
    assert quiet.noise.shape == (2,)
    assert (2 * quiet.noise < loud.noise).all()
    assert_allclose(quiet.actions, smoothing.kalman_velocities(TIMES, noisy(0.01, 3)).velocities)
    assert_allclose(quiet[5:9].noise, quiet.noise)
    policy = uc.LocallyLinearPolicy(1.0).fit_demonstrations([quiet, loud])
    each = policy.training_.samples.noise * policy.training_.action_unit
    expected = np.sqrt((np.stack([quiet.noise, loud.noise]) ** 2).mean(axis=1))
    assert_allclose(np.unique(each.round(9)), expected.round(9))


@pytest.mark.parametrize("method", ["savgol", "central"])
@pytest.mark.parametrize("size", [0.003, 0.03])
def test_the_noise_of_velocities_is_that_of_positions_after_the_filter(method, size):
    """Of smoothed velocities differences of neighbours show a fraction of it, those of samples farther apart all."""
    exact, recipe = noisy(0.0, 3), Recipe(("x", "y"), differentiate=method)
    [found] = prepare(uc.Recording(("x", "y"), noisy(size, 3), TIMES), recipe)
    off = (found.actions - prepare(uc.Recording(("x", "y"), exact, TIMES), recipe)[0].actions)[10:-10]
    assert_allclose(found.noise, np.sqrt((off**2).mean(axis=0)), rtol=0.35)
    neighbours = np.sqrt((np.diff(found.actions, n=4, axis=0) ** 2).mean() / 70.0)
    assert neighbours < 0.5 * found.noise.mean() or method == "central"
    every = prepare([uc.Recording(("x", "y"), noisy(size, seed), TIMES) for seed in (3, 4)], recipe)
    _, actions, groups = uc.stack(every)
    by_differences = uc.learners.robust.noise_by_differences(actions, groups) ** 0.5
    if size < 0.01:  # more is not told from movement
        assert_allclose(by_differences, found.noise.mean(), rtol=0.35)


def test_positions_that_were_rounded_have_that_noise():
    coarse = np.round(noisy(0.0, 3), 2)
    [found] = prepare(uc.Recording(("x", "y"), coarse, TIMES), Recipe(("x", "y"), differentiate="central"))
    rounding = 0.01 / np.sqrt(12.0) * np.sqrt(0.5) / (TIMES[1] - TIMES[0])
    assert (found.noise > 0.99 * rounding).all()
    assert (found.noise < 3.0 * rounding).all()


def test_pieces_between_gaps_are_smoothed_by_themselves_at_stamps_of_any_distance():
    times = np.cumsum(np.random.default_rng(5).uniform(0.01, 0.03, 200))
    times[120:] += 4.0
    track = np.column_stack([np.cos(times), np.sin(times)])
    with pytest.warns(uc.preparation.PreparationWarning, match="clock-gap"):
        [found] = prepare(uc.Recording(("x", "y"), track, times, "w"), Recipe(("x", "y"), differentiate="kalman"))
    assert_allclose(found.times, times)
    assert_allclose(found.actions, np.column_stack([-np.sin(times), np.cos(times)]), atol=0.01)


def test_noise_that_is_known_is_taken():
    demos = [uc.Demonstration(noisy(0.0), SPEED, TIMES, noise=size) for size in (0.1, 0.2)]
    assert_allclose(demos[0].noise, [0.1, 0.1])
    samples = uc.LocallyLinearPolicy(1.0).fit_demonstrations(demos).training_.samples
    assert_allclose(
        np.unique(noise_of_each(samples.actions, samples.groups, 9.0, samples.noise)),
        np.unique(samples.noise) ** 2,
    )
    mixed = uc.LocallyLinearPolicy(1.0).fit_demonstrations([demos[0], uc.Demonstration(CIRCLE, SPEED, TIMES)])
    assert mixed.training_.samples.noise is None


@pytest.mark.parametrize("noise", [-1.0, np.nan, [1.0], [[1.0, 1.0]]])
def test_noise_that_makes_no_sense_is_refused(noise):
    with pytest.raises(InvalidDataError, match="noise"):
        uc.Demonstration(CIRCLE, SPEED, noise=noise)


def test_the_command_line_smooths(tmp_path):
    table = np.column_stack([TIMES, noisy(0.01)])
    file = write(tmp_path / "a.csv", "t,x,y", table)
    said = run("fit", file, "-o", tmp_path / "p.npz", "--by", "kalman")
    assert "x, y as states and their velocity (Kalman smoother) as actions" in said
    [batch] = uc.Stream(file, Recipe(differentiate="kalman"))
    assert batch.noise.shape == (300, 2)
    fast = uc.ParametricPolicy(uc.Affine()).fit_batches([batch]).training_.samples
    assert fast.noise is not None

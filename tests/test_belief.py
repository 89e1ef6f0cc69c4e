"""What is determined, what is free, and how far the truth may be: what the data shows, not what the prior says."""

from functools import cache
from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import unconstrain as uc
from unconstrain.evaluation.diagnosis import diagnose, sentences
from unconstrain.learners.robust.evidence import surely
from unconstrain.learners.robust.pivot import pivot_of

TURN = np.array([[-0.3, -1.5, 0.4], [1.5, -0.3, -0.6], [-0.4, 0.6, -0.3]])
SHIFT = np.array([0.4, -0.3, 0.5])
ALIKE = np.array([0.3, -0.2, 1.0])


def wanted(states):
    """A policy that turns about an axis of its own, so that its motion spans all three directions."""
    return states @ TURN.T + SHIFT


def bent(states):
    """One that no polynomial is: what far places are like tells nothing."""
    return wanted(states) + 0.5 * np.sin(3.0 * states)


@cache
def movements(normals, noise=0.05, seed=1):
    """One demonstration for each normal of a plane, or without a constraint where that is None."""
    rng = np.random.default_rng(seed)
    demos = []
    for index, normal in enumerate(normals):
        constraint = None if normal is None else uc.constraints.Plane(np.array(normal))
        demo = uc.rollout(wanted, rng.uniform(-1, 1, 3), 60, 0.05, constraint, name=f"d{index}")
        noisy = demo.actions + noise * rng.standard_normal(demo.actions.shape)
        demos.append(uc.Demonstration(demo.states, noisy, demo.times, name=demo.name))
    return demos


@cache
def learnt(normals, noise=0.05, seed=1):
    """An affine policy of :func:`movements`: twelve directions of the weights."""
    return uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit_demonstrations(movements(normals, noise, seed))


def planes(count, seed=1):
    """Normals drawn at random."""
    return tuple(map(tuple, np.random.default_rng(seed).standard_normal((count, 3))))


FREE = (None,) * 8
ONE_PLANE = (tuple(ALIKE),) * 8
BUT_ONE = (*ONE_PLANE[:3], (1.0, 0.5, -0.3), *ONE_PLANE[4:])


def along(policy, states, normal):
    """Error of the policy along a direction, and its standard deviation as the policy says, each (N,)."""
    normal = normal / np.linalg.norm(normal)
    spread = np.sqrt(np.einsum("a,nab,b->n", normal, policy.covariances(states), normal))
    return np.abs((policy(states) - wanted(states)) @ normal), spread


class TestDetermined:
    def test_free_motion_in_all_directions_determines_all_and_is_called_free(self):
        solution = learnt(FREE).solution_
        assert solution.determined == [12]
        assert solution.free_share > 0.9
        assert solution.free.mean() > 0.9

    def test_planes_at_random_determine_all(self):
        solution = learnt(planes(12)).solution_
        assert solution.determined == [12]
        assert solution.free_share < 0.2

    @pytest.mark.parametrize("noise", [0.0, 0.05, 0.1])
    def test_what_is_normal_to_the_plane_of_all_is_not_determined_whatever_the_noise(self, noise):
        assert 8 - (noise == 0.0) <= learnt(ONE_PLANE, noise).solution_.determined[0] <= 8

    def test_nor_is_what_one_demonstration_shows_alone(self):
        assert learnt(BUT_ONE).solution_.determined == [8]
        tilted = tuple(map(tuple, ALIKE + np.random.default_rng(3).standard_normal((12, 3))))
        assert learnt(tilted).solution_.determined == [12]

    def test_two_demonstrations_determine_nothing_surely(self):
        policy = learnt(planes(2))
        assert policy.solution_.determined == [0]
        spread = policy.uncertainty(uc.stack(movements(planes(2))).states)
        assert (spread.undetermined > spread.from_noise).all()


class TestFree:
    def test_what_may_have_been_held_in_the_same_way_is_not_called_free(self):
        solution = learnt(ONE_PLANE).solution_
        assert solution.free_share == 0.0
        assert solution.free.max() <= 0.5
        assert solution.belief.undecided_share > 0.8  # though every sample looks free

    def test_of_truly_free_data_next_to_nothing_is_undecided(self):
        assert learnt(FREE).solution_.belief.undecided_share < 0.1

    def test_one_recording_cannot_tell(self):
        [demo] = movements((None,))
        solution = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit_demonstrations([demo]).solution_
        assert solution.free_share == 0.0
        assert solution.free.max() <= 0.5


class TestIntervals:
    def test_along_what_nobody_showed_they_hold_the_truth(self):
        states = uc.stack(movements(ONE_PLANE)).states
        missed, spread = along(learnt(ONE_PLANE), states, ALIKE)
        assert np.mean(missed <= 1.96 * spread) > 0.85
        assert missed.mean() > 0.1  # there is something to hold

    def test_they_are_narrow_in_the_plane_that_all_showed(self):
        states = uc.stack(movements(ONE_PLANE)).states
        _, across = along(learnt(ONE_PLANE), states, np.cross(ALIKE, [1.0, 0.0, 0.0]))
        _, normal = along(learnt(ONE_PLANE), states, ALIKE)
        assert np.median(across) < 0.05 * np.median(normal)

    def test_where_determined_they_hold_the_truth_and_are_no_wider_than_they_must_be(self):
        shares, widths = [], []
        for seed in range(1, 7):
            states = uc.stack(movements(planes(8, seed), 0.1, seed)).states
            policy = learnt(planes(8, seed), 0.1, seed)
            spread, missed = policy.uncertainty(states), np.abs(policy(states) - wanted(states))
            known = spread.undetermined < spread.from_noise
            shares.append(np.mean((missed <= 1.96 * spread.total)[known]) if known.any() else np.nan)
            widths.append(np.median(spread.total) / np.sqrt(np.mean(missed**2)))
        assert 0.8 <= np.nanmean(shares) <= 1.0
        assert np.median(widths) < 6.0  # most of it is what is undetermined


class TestWithoutAnyTwo:
    def test_of_diagonal_parts_it_is_what_exceeds_without_the_two_largest(self):
        rng = np.random.default_rng(0)
        sizes = rng.exponential(1.0, (6, 8))
        least = float(np.median(np.sort(sizes, axis=0)[:-2].sum(axis=0)))
        basis = surely(np.stack([np.diag(one) for one in sizes]), least)
        kept = np.sort(sizes, axis=0)[:-2].sum(axis=0) > least
        assert_allclose(basis @ basis.T, np.diag(kept.astype(float)), atol=1e-12)

    def test_every_rest_exceeds_along_what_is_kept(self):
        rng = np.random.default_rng(1)
        roots = rng.standard_normal((7, 5, 3))
        parts = roots @ roots.swapaxes(1, 2)
        basis = surely(parts, 2.0)
        assert 0 < basis.shape[1] < 5
        for left_out in combinations(range(7), 2):
            rest = parts.sum(axis=0) - parts[list(left_out)].sum(axis=0)
            assert np.linalg.eigvalsh(basis.T @ rest @ basis).min() > 2.0

    def test_without_two_of_two_nothing_is_left(self):
        assert surely(np.stack([np.eye(3)] * 2), 0.0).shape == (3, 0)


class TestPlates:
    """Who is held in a plane all the time shows all components in it."""

    TILTS = ((0.2, 0.1), (0.1, 0.45), (-0.4, 0.4), (-0.25, -0.1), (-0.1, -0.45), (0.25, -0.2))

    def open_at(self, demos):
        """Median standard deviation of what is undetermined on each demonstration, as a share of a typical action."""
        policy = uc.LocallyLinearPolicy(learner=uc.Robust()).fit_demonstrations(demos)
        assert policy.solution_.method == "segments"
        typical = np.sqrt((uc.stack(demos).actions ** 2).sum(axis=1).mean())
        spread = [np.linalg.norm(policy.uncertainty(one.states).undetermined, axis=1) for one in demos]
        return np.array([np.median(one) for one in spread]) / typical

    def demonstrated(self, place, tilts, seed=0, policy=wanted):
        """Strokes about a place on plates of some tilts, with little noise."""
        rng, demos = np.random.default_rng(seed), []
        for tilt in tilts:
            plate = uc.constraints.Plane(np.array([*tilt, 1.0]))
            one = uc.rollout(policy, place + rng.uniform(-1, 1, 3), 120, 0.02, plate)
            noisy = one.actions + 0.01 * rng.standard_normal(one.actions.shape)
            demos.append(uc.Demonstration(one.states, noisy, one.times))
        return demos

    def test_six_plates_of_other_tilts_tell_the_policy_whichever_two_are_left_out(self):
        assert np.median(self.open_at(self.demonstrated(np.zeros(3), self.TILTS))) < 0.05

    def test_two_of_three_plates_do_not(self):
        assert self.open_at(self.demonstrated(np.zeros(3), self.TILTS[:3])).min() > 0.3

    def test_where_all_strokes_are_on_one_plate_what_points_out_of_it_stays_open(self):
        many = self.demonstrated(np.zeros(3), self.TILTS, policy=bent)
        open_ = self.open_at(many + self.demonstrated(np.array([4.0, 4.0, 0.5]), self.TILTS[:1] * 3, policy=bent))
        assert np.median(open_[:6]) < 0.05
        assert open_[6:].min() > 0.3

    TURNING = np.array([[-1.0, -0.8, -0.2], [0.8, -1.0, -0.5], [0.2, 0.5, -0.8]])

    def noisy(self, demos, share, rng):
        size = np.sqrt((uc.stack(demos).actions ** 2).mean())
        return [
            uc.Demonstration(d.states, d.actions + share * size * rng.standard_normal(d.actions.shape), d.times)
            for d in demos
        ]

    def test_cranks_about_one_place_in_planes_of_other_tilts_tell_nothing_towards_it(self):
        rng, demos = np.random.default_rng(1), []
        for _ in range(8):
            axis = np.append(rng.uniform(-0.15, 0.15, 2), 1.0)
            start = rng.uniform(-1, 1, 3)
            start -= (start @ axis) * axis / (axis @ axis)
            held = lambda x, t, axis=axis: np.stack([np.tile(axis, (len(x), 1)), x], axis=1)  # noqa: E731
            demos.append(uc.rollout(lambda x: x @ self.TURNING, start, 80, 0.03, held))
        demos = self.noisy(demos, 0.02, rng)
        policy = uc.ParametricPolicy(uc.Affine(), uc.Segments("groups")).fit_demonstrations(demos)
        spread = policy.uncertainty(uc.stack(demos).states)
        assert policy.solution_.determined[0] < 12
        assert (spread.undetermined > spread.from_noise).any(axis=1).mean() > 0.9

    def test_the_error_of_an_estimated_plane_shows_nothing_across_it(self):
        rng, plate, demos = np.random.default_rng(0), uc.constraints.Plane([0.3, 0.2, 1.0]), []
        for k in range(42):
            one = uc.rollout(lambda x: x @ self.TURNING, rng.uniform(-1, 1, 3), 80, 0.03, plate if k < 40 else None)
            demos += self.noisy([one], 0.05, rng)
        policy = uc.ParametricPolicy(uc.Affine(), uc.Robust())
        belief = policy.fit_demonstrations(demos).solution_.believed
        assert belief.told_together < 0.3  # 1.0 if what noise turned the plane by counted

    def test_what_never_moved_shows_nothing(self):
        rng, time = np.random.default_rng(1), np.linspace(0, 6, 80)
        states = [np.sin(rng.uniform(1.5, 4.0, 3) * time[:, None] + rng.uniform(0, 6, 3)) for _ in range(6)]
        demos = [uc.Demonstration(one, one @ self.TURNING, time) for one in states]
        rest = uc.Demonstration(np.tile(rng.uniform(-1, 1, 3), (60, 1)), np.zeros((60, 3)), np.arange(60) * 0.03)
        policy = uc.ParametricPolicy(uc.Affine(), uc.Segments("groups"))
        assert policy.fit_demonstrations([*demos, rest]).solution_.determined == [12]


def swung(seed, dimensions=2):
    """Doors that are opened about one hinge, held at radii that differ a little."""
    rng, found, time = np.random.default_rng(seed), [], np.arange(200) * 0.01
    for _ in range(6):
        radius = 0.65 + 0.01 * rng.standard_normal()
        angle = rng.uniform(-0.1, 0.1) + 1.3 * (1.0 - np.exp(-1.5 * time))
        path = HINGE + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        path = np.pad(path, ((0, 0), (0, dimensions - 2)), constant_values=0.8)
        actions = np.gradient(path, time, axis=0)
        actions += 0.03 * np.sqrt((actions**2).sum(axis=1).mean()) * rng.standard_normal(path.shape)
        found.append(uc.Demonstration(path, actions, times=time))
    return found


HINGE = np.array([1.0, 0.5])


class TestHinge:
    """All swing about one place: whoever was free to leave looks as who was not, though directions of motion turn."""

    @pytest.mark.parametrize("dimensions", [2, 3])
    @pytest.mark.parametrize("policy", [uc.LocallyLinearPolicy(), uc.ParametricPolicy()], ids=["local", "kernels"])
    def test_a_door_is_never_free_and_what_points_to_its_hinge_is_open(self, policy, dimensions):
        demos = swung(0, dimensions)
        states = uc.stack(demos).states
        believed = policy.fit_demonstrations(demos).solution_.believed
        assert (believed.free_share, believed.told_together) == (0.0, 0.0)
        outwards = states - np.pad(HINGE, (0, dimensions - 2), constant_values=0.8)
        outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
        open_ = np.sqrt(np.einsum("na,nab,nb->n", outwards, policy.covariances(states), outwards))
        assert np.median(open_) > 0.5 * np.sqrt((uc.stack(demos).actions ** 2).sum(axis=1).mean())

    @staticmethod
    def of_three(seed, free=0):
        """Ten demonstrations, the first of them free, the others about one of three hinges each."""
        rng = np.random.default_rng(seed)
        places = rng.uniform(-1.5, 1.5, (3, 2))
        often, far, demos = 2 * rng.uniform(1, 3), rng.uniform(0.3, 0.8), []

        def bent(x):
            aside = far * np.column_stack([np.sin(often * x[:, 1]), np.cos(often * x[:, 0]) - 1.0])
            return x @ [[-1.0, 1.5], [-1.5, -1.0]] + aside

        for k in range(10):
            about = None if k < free else lambda states, times, k=k: (states - places[k % 3])[:, None, :]
            one = uc.rollout(bent, rng.uniform(-1, 1, 2), 120, 0.025, about)
            noise = 0.02 * np.sqrt((one.actions**2).mean()) * rng.standard_normal(one.actions.shape)
            demos.append(uc.Demonstration(one.states, one.actions + noise, one.times))
        return demos

    @pytest.mark.parametrize("seed", [8, 10])
    def test_doors_about_several_hinges_are_not_free(self, seed):
        demos = self.of_three(seed)
        assert uc.LocallyLinearPolicy().fit_demonstrations(demos).solution_.believed.free_share < 0.01

    def test_who_is_free_beside_doors_is_found(self):
        demos = self.of_three(7, free=4)
        believed = uc.LocallyLinearPolicy().fit_demonstrations(demos).solution_.believed
        assert believed.free_share > 0.2
        assert believed.free[480:].mean() < 0.2 < 0.5 < believed.free[:480].mean()

    def test_the_hinge_is_found_to_centimetres(self):
        states, actions, _ = uc.stack(swung(1))
        assert_allclose(pivot_of(states, actions), HINGE, atol=0.03)

    def test_who_comes_nearer_too_is_no_door(self):
        starts = np.random.default_rng(0).uniform(-1.5, 1.5, (10, 2))
        demos = uc.rollout(lambda x: x @ [[-0.3, 2.0], [-2.0, -0.3]], starts, 300, 0.02)
        assert pivot_of(*uc.stack(demos)[:2]) is None

    def test_who_turns_at_all_distances_is_no_door(self):
        states = np.random.default_rng(0).uniform(-1, 1, (300, 2))
        assert pivot_of(states, states @ [[0, 1], [-1, 0]]) is None

    def test_rounds_on_plates_of_other_tilts_are_no_door(self):
        angle, tilts = np.linspace(0, 6, 200), [-0.3, 0.0, 0.3]
        flat = np.column_stack([np.cos(angle), np.sin(angle)])
        rounds = [flat @ [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)]] for tilt in tilts]
        turned = [np.column_stack([-flat[:, 1], flat[:, 0]]) @ [[1, 0, 0], [0, np.cos(t), np.sin(t)]] for t in tilts]
        assert pivot_of(np.vstack(rounds), np.vstack(turned)) is None
        assert_allclose(pivot_of(rounds[2], turned[2]), [0.0, 0.0, 0.0], atol=1e-9)

    def test_strokes_along_one_line_and_forces_of_other_sizes_have_no_hinge(self):
        rng = np.random.default_rng(0)
        along = rng.uniform(-1, 1, (300, 1)) * [[1.0, 0.5]]
        assert pivot_of(rng.uniform(-1, 1, (300, 2)), along) is None
        assert pivot_of(rng.uniform(-1, 1, (300, 3)), along) is None
        assert pivot_of(rng.uniform(-1, 1, (300, 2)), np.zeros((300, 2))) is None


class TestWords:
    @staticmethod
    def said(normals):
        found = diagnose(learnt(normals), movements(normals))
        return found, " ".join(sentences(found, ["x", "y", "z"], ["vx", "vy", "vz"]))

    def test_one_plane_for_all(self):
        found, said = self.said(ONE_PLANE)
        assert "nobody moved along" in said
        assert found.directions == 12
        assert found.directions_determined == pytest.approx(8 / 12)
        assert "were free or always held in the same way" in said
        assert "How 8 demonstrations look: 8 undecided (" in said
        assert abs(np.dot(found.regions[0].direction, ALIKE) / np.linalg.norm(ALIKE)) > 0.95

    def test_what_one_demonstration_shows_alone(self):
        found, _ = self.said(BUT_ONE)
        shown = {one.shown_by for one in found.regions}
        assert ("d3",) in shown
        worst = next(one for one in found.regions if one.shown_by == ("d3",))
        assert abs(np.dot(worst.direction, ALIKE) / np.linalg.norm(ALIKE)) > 0.9

    def test_free_motion(self):
        _, said = self.said(FREE)
        assert (
            "99% look free (nothing that shows above the noise held them), 1% held. How 8 demonstrations look: 8 free."
            in said
        )

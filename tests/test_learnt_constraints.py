"""Constraints that are learnt from what moved under them."""

import pickle

import numpy as np
import pytest
from array_api_strict import asarray as strict
from numpy.testing import assert_allclose, assert_array_equal

import held
import unconstrain as uc
from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.constraints import evidence, forms
from unconstrain.paper.systems.arm import LWR3
from unconstrain.training import Batch

LINE = np.array([[[0.6, 0.8]]])


def line(states, times=None):
    return np.broadcast_to(LINE, (len(states), 1, 2))


def selected(postures, times=None):
    return np.array([0.8, -0.6]) @ held.two_links(postures)[:, None]


def turned(postures, times=None):
    """Λ(q) J(q) with Λ affine in the posture."""
    rows = np.stack([1.0 + 0.5 * postures[:, 0], -postures[:, 1]], axis=1)[:, None]
    return rows @ held.two_links(postures)


def around(rng, count):
    return rng.uniform(0.3, 1.8, (count, 2))


def learnt(demos, features="auto", **settings):
    states, actions, groups = uc.stack(demos)
    return uc.LearntConstraint(features, **settings).fit(states, actions, groups=groups)


@pytest.mark.parametrize(
    ("constraint", "features", "jacobian", "most"),
    [
        (line, "constant", None, 1e-25),
        (line, "affine", None, 1e-25),
        (held.parabola, "affine", None, 1e-24),
        (held.parabola, "quadratic", None, 1e-23),
        (held.parabola, uc.NormalisedRBF.grid(-2.2, 2.2, 5), None, 1e-10),
        (selected, "constant", held.two_links, 1e-25),
        (turned, "affine", held.two_links, 1e-22),
        (line, "auto", None, 1e-25),
        (held.parabola, "auto", None, 1e-24),
    ],
    ids=lambda value: getattr(value, "__name__", None) or str(value)[:9],
)
def test_exact_data_gives_the_constraint_exactly(constraint, features, jacobian, most):
    rng = np.random.default_rng(0)
    starts = held.near_corners if jacobian is None else around
    train, test = (held.demonstrate(constraint, rng, starts=starts)[0] for _ in range(2))
    found = learnt(train, features, jacobian=jacobian)
    assert found.rank_ == 1
    assert uc.nppe(found, test) < most
    assert uc.npoe(found, test) < most


@pytest.mark.parametrize(("noise", "most"), [(0.05, 1e-4), (0.2, 2e-3)])
def test_of_noisy_data_the_simplest_form_that_is_as_good_is_taken_and_the_noise_found(noise, most):
    rng = np.random.default_rng(1)
    train, size = held.demonstrate(held.parabola, rng, count=100, noise=noise)
    test, _ = held.demonstrate(held.parabola, rng)
    found = learnt(train)
    assert found.choice_.name == "affine"
    assert set(found.choice_.candidates) == {"constant", "affine", "quadratic", "rbf"}
    assert uc.nppe(found, test) < most
    assert found.noise_ == pytest.approx(size, rel=0.06)


def test_kernels_under_noise_are_smoothed():
    rng = np.random.default_rng(2)
    train, _ = held.demonstrate(held.parabola, rng, noise=0.05)
    test, _ = held.demonstrate(held.parabola, rng)
    found = learnt(train, uc.NormalisedRBF.grid(-2.2, 2.2, 5))
    assert found.choice_.smoothness > 0.0
    assert uc.nppe(found, test) < 1e-3


@pytest.mark.parametrize("jacobian", [None, held.two_links], ids=["actions", "jacobian"])
@pytest.mark.parametrize("task", [False, True])
def test_sums_are_those_of_the_equations(jacobian, task):
    rng = np.random.default_rng(3)
    states, actions, weights = rng.normal(size=(9, 2)), rng.normal(size=(9, 2)), rng.uniform(1, 2, 9)
    form = forms.Form.of(uc.Polynomial(2), forms.Velocities(jacobian, task), states)
    pencil = evidence.gathered(form, Batch(states, actions, weights), np.arange(9) % 2)
    motion, size, weight = pencil.means([0, 1])
    first = second = 0.0
    for x, u, w in zip(states, actions, weights, strict=True):
        phi = uc.Polynomial(2)(x[None])[0]
        matrix = np.eye(2) if jacobian is None else jacobian(x[None])[0]
        moved = np.append(matrix @ u, -1.0) if task else matrix @ u
        matrix = np.vstack([matrix, np.zeros((1, 2))]) if task else matrix
        first += w * np.kron(np.outer(phi, phi), np.outer(moved, moved))
        second += w * np.kron(np.outer(phi, phi), matrix @ matrix.T)
    assert weight == pytest.approx(weights.sum())
    assert_allclose(motion, first / weight, atol=1e-12)
    assert_allclose(size, second / weight, atol=1e-12)


def test_coefficients_are_those_of_least_motion_at_a_fixed_size():
    """An independent reference: scipy's generalised eigenvectors of the sums of the equations."""
    from scipy.linalg import eigh

    rng = np.random.default_rng(4)
    states, actions, _, _ = held.drawn(held.parabola, rng, columns=2, noise=0.1)
    found = uc.LearntConstraint(uc.Affine()).fit(states, actions)
    design = (np.column_stack([states, np.ones(1000)])[:, :, None] * actions[:, None]).reshape(1000, -1)
    phi = np.column_stack([states, np.ones(1000)])
    values, vectors = eigh(design.T @ design, np.kron(phi.T @ phi, np.eye(2)))
    rows = np.einsum("ni,id->nd", phi, vectors[:, 0].reshape(3, 2))
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    apart = np.abs((found(states)[:, 0] * rows).sum(axis=1))
    assert_allclose(apart, 1.0, atol=1e-3)
    assert np.sqrt(values[0]) < found.noise_  # the smallest eigenvalue has been chosen for being small
    assert found.noise_ == pytest.approx(0.1, rel=0.05)


def test_a_projection_is_one_and_rows_are_orthonormal():
    states, actions, projections, _ = held.drawn(held.parabola, np.random.default_rng(5), columns=2)
    found = uc.LearntConstraint("affine").fit(states, actions)
    learnt_projections = found.projection(states)
    assert_allclose(learnt_projections, projections, atol=1e-9)
    assert_array_equal(learnt_projections, learnt_projections.mT)
    assert_allclose(np.linalg.norm(found(states, None), axis=2), 1.0)
    assert_allclose(uc.null_space_projection(found(states)), learnt_projections)


def test_the_rank_may_change_with_the_state():
    def corner(states, times=None):
        first = np.tile([0.0, 0.0, 1.0], (len(states), 1))
        second = np.where(states[:, :1] > 0, [1.0, 0.0, 0.0], 0.0)
        return np.stack([first, second], axis=1)

    def sides(states):
        return np.column_stack([states[:, 0] > 0, states[:, 0] <= 0]).astype(float)

    states, actions, projections, _ = held.drawn(corner, np.random.default_rng(6), noise=0.01)
    found = uc.LearntConstraint(sides).fit(states, actions)
    assert found.rank_ == 2
    assert_allclose(found.projection(states), projections, atol=0.02)


def test_more_directions_are_a_merit_only_where_movements_cross():
    def grooved(states, times=None):
        varying = np.column_stack([1.0 + 0.5 * states[:, 0], -states[:, 1], np.zeros(len(states))])
        return np.stack([np.tile([0.0, 0.0, 1.0], (len(states), 1)), varying], axis=1)

    states, actions, projections, _ = held.drawn(grooved, np.random.default_rng(25), noise=0.02)
    crossing = uc.LearntConstraint().fit(states, actions)
    assert (crossing.choice_.name, crossing.rank_, crossing.choice_.doubts) == ("affine", 2, ())
    assert_allclose(crossing.projection(states), projections, atol=0.05)
    plane = uc.constraints.Plane([0.0, 0.6, 0.8])
    one_way = uc.rollout(lambda x: -x, states[:30], 20, 0.1, plane)
    found = learnt(one_way)  # across a policy that is linear there is a linear direction
    assert (found.choice_.name, found.rank_) == ("constant", 1)
    assert learnt(one_way, "affine").rank_ == 2


def test_rank_is_of_the_arm_and_not_of_the_features():
    rng = np.random.default_rng(7)
    for rows in (1, 3, 5):
        select = np.linalg.qr(rng.standard_normal((6, 6)))[0][:rows]
        starts = np.radians([85, 60, 85, 60, 85, 60, 85]) * rng.uniform(-1, 1, (40, 7))
        demos = uc.rollout(lambda q: -q, starts, 25, 0.02, lambda q, t, select=select: select @ LWR3.jacobian(q))
        found = learnt(demos, "constant", jacobian=LWR3.jacobian)
        assert found.rank_ == rows
        assert uc.nppe(found, demos) < 1e-20


@pytest.mark.parametrize(("noise", "rank"), [(1e-3, 2), (3e-3, 2), (1e-2, 2), (1e-1, 1)])
def test_directions_are_held_though_their_noise_differs_but_not_where_they_move(noise, rank):
    rng = np.random.default_rng(9)
    states, actions = rng.standard_normal((1000, 4)), rng.standard_normal((1000, 4)) * [1.0, 1.0, 1e-3, noise]
    found = uc.LearntConstraint().fit(states, actions, np.arange(1000) // 100)
    assert found.rank_ == rank
    assert not found.choice_.doubts


@pytest.mark.parametrize("noise", [1e-3, 1e-2])
def test_a_direction_that_may_be_held_with_more_noise_is_said(noise):
    """A handle on a crank: two directions are held, but as it only ever turns one way, motion is a function of it."""
    rng = np.random.default_rng(10)
    angle, speed = rng.uniform(0.0, 6.0, 1000), rng.uniform(0.5, 1.5, (1000, 1))
    states = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), angle])
    ways = np.column_stack([-states[:, 1], states[:, 0], np.ones(1000)])
    actions = ways * speed + rng.standard_normal((1000, 3)) * [1e-3, noise, 1e-3]
    found = uc.LearntConstraint("affine").fit(states, actions, np.arange(1000) // 100)
    told = {1e-3: (2, "only one direction was seen"), 1e-2: (1, "One direction more moves by only")}
    assert (found.rank_, True) == (told[noise][0], told[noise][1] in " ".join(found.choice_.doubts))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_across_a_free_policy_that_is_a_function_of_the_state_nothing_is_surely_held(seed):
    """One direction in three varies with the state and looks held, though nothing was."""
    rng = np.random.default_rng(seed)

    def stirring(x):
        inwards = x[:, :2] * (1.0 - np.linalg.norm(x[:, :2], axis=1, keepdims=True))
        return np.hstack([x[:, 1::-1] * [-1.5, 1.5] + inwards, -x[:, 2:]])

    demos = uc.rollout(stirring, rng.uniform(-1.5, 1.5, (8, 3)), 150, 0.03)
    noisy = [uc.Demonstration(d.states, d.actions + 0.02 * rng.standard_normal(d.actions.shape)) for d in demos]
    states, actions, groups = uc.stack(noisy)
    found = uc.LearntConstraint().fit(states, actions, groups=groups)
    assert found.rank_ == 1
    assert "a free policy that is a function of the state looks the same" in " ".join(found.choice_.doubts)
    constant = uc.LearntConstraint().fit(*held.drawn(uc.constraints.Plane([0.0, 0.6, 0.8]), rng)[:2])
    assert (constant.choice_.name, constant.choice_.doubts) == ("constant", ())


@pytest.mark.parametrize("grouped", [True, False])
@pytest.mark.parametrize("features", ["affine", "rbf", "auto"])
def test_streamed_is_at_once(features, grouped):
    train, _ = held.demonstrate(held.parabola, np.random.default_rng(8), noise=0.05)
    states, actions, groups = uc.stack(train)
    named = groups if grouped else None
    at_once = uc.LearntConstraint(features).fit(states, actions, groups=named)
    parts = [
        (states[a : a + 130], actions[a : a + 130], None, groups[a : a + 130] if grouped else None)
        for a in range(0, 1000, 130)
    ]
    streamed = uc.LearntConstraint(features).fit_batches(parts)
    assert_allclose(streamed.projection(states), at_once.projection(states), atol=1e-10)
    assert streamed.noise_ == pytest.approx(at_once.noise_, rel=1e-10)
    growing = uc.LearntConstraint("affine")
    for part in parts:
        growing.partial_fit(part[0], part[1], groups=part[3])
    with pytest.raises(InvalidDataError, match="got 2 columns of states and 3 of actions, others than before"):
        growing.partial_fit(np.ones((3, 2)), np.ones((3, 3)), groups=[1, 1, 1] if grouped else None)
    generated = uc.LearntConstraint("affine").fit_batches(iter(parts))
    assert_allclose(generated.projection(states), growing.projection(states), atol=1e-10)


def test_order_units_and_copies_change_nothing():
    train, _ = held.demonstrate(held.parabola, np.random.default_rng(9), noise=0.05)
    states, actions, groups = uc.stack(train)
    found = uc.LearntConstraint("affine").fit(states, actions, groups=groups)
    expected = found.projection(states)
    order = np.random.default_rng(0).permutation(1000)
    shuffled = uc.LearntConstraint("affine").fit(states[order], actions[order], groups=groups[order])
    assert_allclose(shuffled.projection(states), expected, atol=1e-10)
    tiny = uc.LearntConstraint("affine").fit(states, 1e-200 * actions, groups=groups)
    assert_allclose(tiny.projection(states), expected, atol=1e-10)
    assert tiny.noise_ == pytest.approx(1e-200 * found.noise_)
    weighted = uc.LearntConstraint("affine").fit(states, actions, groups, np.full(1000, 2.0))
    twice = uc.LearntConstraint("affine").fit(*(np.concatenate([one, one]) for one in (states, actions, groups)))
    assert_allclose(weighted.projection(states), twice.projection(states), atol=1e-10)


def test_rotated_actions_rotate_the_constraint():
    states, actions, _, _ = held.drawn(held.parabola, np.random.default_rng(10), columns=2, noise=0.05)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    plain = uc.LearntConstraint("affine").fit(states, actions).projection(states)
    rotated = uc.LearntConstraint("affine").fit(states, actions @ turn.T).projection(states)
    assert_allclose(rotated, turn @ plain @ turn.T, atol=1e-9)


def test_arrays_of_another_library_serve():
    states, actions, _, _ = held.drawn(held.parabola, np.random.default_rng(11), columns=2, noise=0.05)
    plain = uc.LearntConstraint("affine").fit(states, actions)
    other = uc.LearntConstraint("affine").fit(strict(states), strict(actions))
    assert_allclose(other.projection(states), plain.projection(states), atol=1e-10)


def test_a_cluster_sends_sums():
    dask = pytest.importorskip("dask.array")
    train, _ = held.demonstrate(held.parabola, np.random.default_rng(12), noise=0.05)
    columns = uc.stack(train)
    found = uc.cluster.fit(
        uc.LearntConstraint("affine"), *(dask.from_array(column, chunks=250) for column in columns[:2]),
        groups=dask.from_array(columns[2], chunks=250),
    )  # fmt: skip
    assert_allclose(found.projection(columns[0]), learnt(train, "affine").projection(columns[0]), atol=1e-10)


@pytest.mark.parametrize(("noise", "off"), [(0.0, 1e-9), (0.05, 0.05)])
def test_a_task_is_learnt_with_the_constraint(noise, off):
    def tilted(states, times=None):
        return np.stack([1.0 + states[:, 0], -np.ones(len(states)), states[:, 1]], axis=1)[:, None]

    states, actions, projections, done = held.drawn(
        tilted, np.random.default_rng(13), task=lambda x: x[:, :1] - 0.5, noise=noise
    )
    found = uc.LearntConstraint("affine", task=True).fit(states, actions)
    assert_allclose(found.projection(states), projections, atol=off)
    again = np.einsum("nkd,nk->nd", found(states), found.target(states))
    assert_allclose(again, done, atol=off)
    path = uc.rollout(lambda x: np.zeros_like(x), [0.1, 0.2, 0.3], 5, 0.01, found, task=found.target)
    assert_allclose(path.actions, np.einsum("tkd,tk->td", found(path.states), found.target(path.states)), atol=1e-12)


def test_points_show_the_surface_that_they_lie_on():
    rng = np.random.default_rng(14)
    normals = rng.standard_normal((800, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = np.array([3.0, 0.0, 1.0]) + 2.0 * normals
    free = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    exact = uc.LearntConstraint().fit(points)
    assert exact.choice_.name == "quadratic"
    assert_allclose(exact.projection(points), free, atol=1e-9)
    noisy = uc.LearntConstraint().fit(points + 0.01 * rng.standard_normal(points.shape))
    assert noisy.noise_ == pytest.approx(0.01, rel=0.1)
    assert_allclose(noisy.projection(points), free, atol=0.02)


@pytest.mark.parametrize(("free", "rank"), [(2, 1), (1, 2)], ids=["plane", "line"])
def test_flat_points_are_no_double_sheet(free, rank):
    rng = np.random.default_rng(15)
    points = np.zeros((500, 3))
    points[:, :free] = rng.uniform(-1, 1, (500, free))
    found = uc.LearntConstraint().fit(points + 0.01 * rng.standard_normal(points.shape))
    assert (found.choice_.name, found.rank_) == ("affine", rank)
    assert found.noise_ == pytest.approx(0.01, rel=0.1)


def test_free_data_is_refused():
    rng = np.random.default_rng(16)
    with pytest.raises(InvalidDataError, match="no direction is held: along the best one"):
        uc.LearntConstraint().fit(rng.uniform(-1, 1, (500, 3)), rng.standard_normal((500, 3)))


def test_constraints_that_differ_between_demonstrations_are_refused():
    rng = np.random.default_rng(17)
    tables = [held.drawn(uc.constraints.Plane(rng.standard_normal(3)), rng, 40)[:2] for _ in range(15)]
    states, actions = map(np.concatenate, zip(*tables, strict=True))
    with pytest.raises(InvalidDataError, match=r"held: along|no function of the state holds"):
        uc.LearntConstraint().fit(states, actions, groups=np.repeat(np.arange(15), 40))


def test_what_one_policy_cannot_tell_is_said():
    train, _ = held.demonstrate(held.parabola, np.random.default_rng(18))
    assert "a free policy that is a function of the state looks the same" in learnt(train).choice_.doubts[0]
    rng = np.random.default_rng(19)
    tables = [held.drawn(uc.constraints.Plane([*0.25 * rng.standard_normal(2), 1.0]), rng, 40)[:2] for _ in range(15)]
    states, actions = map(np.concatenate, zip(*tables, strict=True))
    found = uc.LearntConstraint().fit(states, actions, groups=np.repeat(np.arange(15), 40))
    assert "or the constraint is not quite of this form, or differs between demonstrations" in found.choice_.doubts[-1]


@pytest.mark.parametrize("positions", [False, True], ids=["actions", "positions"])
def test_demonstrations_may_each_have_a_plane_of_their_own(positions):
    rng = np.random.default_rng(24)
    normals, tables = rng.standard_normal((5, 3)), []
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for normal in normals:
        points, wanted = rng.uniform(-1, 1, (2, 80, 3))
        points -= np.outer(points @ normal - 0.5, normal)
        tables.append((points, wanted - np.outer(wanted @ normal, normal)))
    states, actions = (
        np.concatenate(column) + 0.01 * rng.standard_normal((400, 3)) for column in zip(*tables, strict=True)
    )
    groups = np.repeat([f"plate {k}" for k in range(5)], 80)
    found = uc.LearntConstraint().fit_each(states, None if positions else actions, groups)
    assert list(found) == [f"plate {k}" for k in range(5)]
    for one, normal in zip(found.values(), normals, strict=True):
        assert (one.choice_.name, one.rank_) == ("affine" if positions else "constant", 1)
        assert abs(one(states[:1])[0, 0] @ normal) > 0.999
    actions[groups == "plate 3"] = rng.standard_normal((80, 3))
    if not positions:
        with pytest.raises(InvalidDataError, match="'plate 3': no direction is held in it"):
            uc.LearntConstraint().fit_each(states, actions, groups)


def wiped(tilts, rng, samples=60, noise=0.02):
    """Round strokes about the origin on plates that are tilted about x."""
    states, actions = [], []
    for tilt in tilts:
        turn = np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)]])
        points = rng.uniform(-1, 1, (samples, 2))
        states.append(points @ turn)
        actions.append(
            np.column_stack([-points[:, 1], points[:, 0]]) @ turn + noise * rng.standard_normal((samples, 3))
        )
    return np.concatenate(states), np.concatenate(actions), np.repeat(np.arange(len(tilts)), samples)


def test_each_demonstration_has_its_own_constraint_where_one_for_all_misses_more():
    tilts = [0.0, 0.3, -0.3, 0.5]
    states, actions, groups = wiped(tilts, np.random.default_rng(31))
    each = uc.LearntConstraint().differing(states, actions, groups)
    assert list(each) == list(range(4))
    for tilt, one in zip(tilts, each.values(), strict=True):
        assert (one.rank_, one.choice_.name) == (1, "constant")
        assert abs(one(states[:1])[0, 0] @ [0.0, -np.sin(tilt), np.cos(tilt)]) > 0.999


@pytest.mark.parametrize("count", [1, 4])
def test_what_is_alike_is_not_told_apart(count):
    states, actions, groups = wiped([0.3] * count, np.random.default_rng(32))
    assert uc.LearntConstraint().differing(states, actions, groups) == {}


def test_where_one_demonstration_is_free_there_is_not_one_for_each():
    rng = np.random.default_rng(33)
    states, actions, groups = wiped([0.0, 0.4, 0.8], rng)
    actions[groups == 1] = rng.standard_normal((60, 3))
    assert uc.LearntConstraint("constant").differing(states, actions, groups) == {}


def test_what_others_miss_is_what_moves_along_the_held_direction():
    states, actions, _ = wiped([0.0], np.random.default_rng(34), noise=0.0)
    found = uc.LearntConstraint("constant").fit(states, actions).choice_
    moved = actions + np.array([0.0, 0.0, 0.5])
    assert_allclose(found.missed(states, moved), 0.25 / ((moved**2).sum(axis=1).mean() / 3))


@pytest.mark.parametrize(
    ("settings", "data", "message"),
    [
        ({}, (np.ones((9, 2)), np.zeros((9, 2))), "all are zero, and what never moves does not tell"),
        ({}, (np.ones((9, 2)), np.ones((9, 2))), "got 1 different sample for 6 coefficients"),
        ({}, (np.full((9, 2), np.nan), np.ones((9, 2))), "states: found nan at row 0, column 0"),
        ({}, (np.ones((9, 2)), np.ones((8, 2))), "got 9 states and 8 actions"),
        ({"features": "constant"}, (np.eye(2),), "the height above a surface varies: 'affine' is a plane"),
        ({"features": "cubic"}, (np.ones((9, 2)), np.ones((9, 2))), "got 'cubic', expected a feature map, 'auto', or"),
        (
            {"jacobian": lambda q: q},
            (np.ones((9, 2)), np.ones((9, 2))),
            r"jacobian: got an array of shape \(1, 2\)",
        ),
        (
            {"jacobian": lambda q: np.ones((len(q), 1, 3))},
            (np.ones((9, 2)), np.ones((9, 2))),
            "a column for each",
        ),
    ],
    ids=["at rest", "one sample", "nan", "lengths", "flat", "name", "jacobian", "columns"],
)
def test_bad_input_is_refused_in_words_and_changes_nothing(settings, data, message):
    states, actions, _, _ = held.drawn(held.parabola, np.random.default_rng(20), columns=2)
    found = uc.LearntConstraint("affine").fit(states, actions)
    before = pickle.dumps(found.choice_)
    found.set_params(**settings)
    with pytest.raises((InvalidDataError, SettingError), match=message):
        found.fit(*data)
    assert pickle.dumps(found.choice_) == before


def test_what_was_not_learnt_is_not_guessed():
    with pytest.raises(SettingError, match="has learnt nothing yet"):
        uc.LearntConstraint().projection(np.ones((2, 2)))
    states, actions, _, _ = held.drawn(held.parabola, np.random.default_rng(21), columns=2)
    found = uc.LearntConstraint("affine").fit(states, actions)
    with pytest.raises(SettingError, match="learnt without one"):
        found.target(states)
    with pytest.raises(InvalidDataError, match="states: got 3 columns, expected 2 as fitted"):
        found.projection(np.ones((2, 3)))
    assert repr(found) == f"LearntConstraint(affine, 1 direction of 2 held, noise={found.noise_:.3g})"
    assert repr(uc.LearntConstraint()) == "LearntConstraint(features='auto')"


@pytest.mark.parametrize("bias", [0.0, 0.5], ids=["centred", "biased"])
def test_a_varying_task_shows_what_is_orthogonal_to_it(bias):
    rng = np.random.default_rng(22)
    states = rng.uniform(-1, 1, (500, 2))
    component = held.circling(states) @ (np.eye(2) - LINE[0].T @ LINE[0])
    actions = component + (rng.uniform(-1, 1, (500, 1)) + bias) * LINE[0]
    found = uc.constraints.null_space_component(states, actions, features=uc.Affine())
    assert_allclose(found(states), component, atol=1e-3)
    known = uc.constraints.null_space_component(states, actions, uc.constraints.Plane(LINE[0, 0]), uc.Affine())
    assert_allclose(known(states), component, atol=1e-12)
    demo = uc.Demonstration(states, actions)
    assert uc.metrics.nnpe(known, demo) < 1e-24
    assert (
        uc.metrics.nnpe(lambda x: actions @ LINE[0].T @ LINE[0] + 0.0 * x, demo) < 1e-24
    )  # anything along u does as well


def test_a_component_needs_movement():
    with pytest.raises(InvalidDataError, match="got 3 states and 2 actions"):
        uc.constraints.null_space_component(np.ones((3, 2)), np.ones((2, 2)))
    with pytest.raises(InvalidDataError, match="all are zero, expected movement"):
        uc.constraints.null_space_component(np.ones((3, 2)), np.zeros((3, 2)))


def test_errors_of_constraints_are_those_of_the_equations():
    rng = np.random.default_rng(23)
    demos, _ = held.demonstrate(line, rng, count=3, noise=0.1)
    wrong = uc.constraints.Plane([1.0, 0.2])
    normal = np.array([1.0, 0.2]) / np.hypot(1.0, 0.2)
    policy = np.concatenate([demo.truth.policy for demo in demos])
    actions = uc.stack(demos).actions
    true, said = np.eye(2) - LINE[0].T @ LINE[0], np.eye(2) - np.outer(normal, normal)
    missed = sum(np.sum(((true - said) @ p) ** 2) for p in policy) / len(policy)
    taken = sum(np.sum((u - said @ u) ** 2) for u in actions) / len(actions)
    assert uc.nppe(wrong, demos) == pytest.approx(missed / policy.var(axis=0).sum())
    assert uc.npoe(wrong, demos) == pytest.approx(taken / actions.var(axis=0).sum())
    assert uc.npoe(wrong, [uc.Demonstration(demo.states, demo.actions) for demo in demos]) == uc.npoe(wrong, demos)


def test_a_task_has_a_value_for_each_row():
    with pytest.raises(SettingError, match=r"got b of shape \(1, 2\) for A of shape \(1, 1, 2\)"):
        uc.rollout(held.attracted, [1.0, 0.0], 2, 0.1, line, task=lambda x, t: np.ones((1, 2)))
    path = uc.rollout(held.attracted, [1.0, 0.0], 4, 0.1, line, task=lambda x, t: np.full((len(x), 1), 0.25))
    assert_allclose(path.actions @ LINE[0, 0], 0.25)
    assert_allclose(path.actions - 0.25 * LINE[0], path.truth.policy @ path.truth.projections[0], atol=1e-12)


def awkward(rng):
    """States, actions and groups of any size, some of them constant, at rest, far away, huge or tiny."""
    samples, columns, actions = rng.choice([1, 2, 3, 5, 8, 20, 60]), rng.integers(1, 4), rng.integers(1, 4)
    states, moves = rng.standard_normal((samples, columns)), rng.standard_normal((samples, actions))
    kind = rng.integers(0, 7)
    states *= {1: 0.0, 2: 10.0 ** rng.integers(-300, 29)}.get(kind, 1.0)
    states += 1e6 * (kind == 3)
    moves *= {4: 10.0 ** rng.integers(-300, 29)}.get(kind, 1.0)
    moves[rng.random(samples) < 0.6 * (kind == 5)] = 0.0
    moves[:, -1] *= kind != 6
    return states, None if rng.random() < 0.2 else moves, rng.integers(0, 4, samples) if rng.random() < 0.5 else None


def test_any_finite_data_gives_a_projection_or_one_of_our_errors():
    rng, learnt_something = np.random.default_rng(26), 0
    for _ in range(150):
        states, moves, groups = awkward(rng)
        try:
            found = uc.LearntConstraint(rng.choice(["auto", "constant", "affine", "quadratic"])).fit(
                states, moves, groups
            )
        except uc.UnconstrainError:
            continue
        learnt_something += 1
        projections = found.projection(states + 0.1)
        assert_allclose(projections @ projections, projections, atol=1e-9)
        assert np.isfinite(found.noise_)
    assert learnt_something > 10

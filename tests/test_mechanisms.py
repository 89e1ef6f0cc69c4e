"""Mechanisms with names: found in movements, with odds and intervals that can be trusted."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import unconstrain as uc
from recorded import DATA, needs_rim
from unconstrain.base.errors import InvalidDataError, ModelFileError
from unconstrain.constraints import identify
from unconstrain.constraints.mechanisms import Mechanism
from unconstrain.constraints.mechanisms.fitting import fit
from unconstrain.constraints.mechanisms.fitting import noise as one_noise
from unconstrain.constraints.mechanisms.identify import _track
from unconstrain.constraints.mechanisms.kinds import Circle, Cylinder, FlatCircle, Line, Plane, Point, Screw, Sphere
from unconstrain.constraints.mechanisms.mechanism import frame_of, on_one_side
from unconstrain.constraints.mechanisms.tied import Hinge, Slider, TurningScrew
from unconstrain.constraints.mechanisms.track import Track, correlation_time
from unconstrain.paper.experiments.mechanisms import (
    FREE,
    KINDS,
    inside,
    mean_normal,
    mechanisms,
    normals,
    simulate,
    strokes,
)

AT, FRAME = np.array([0.3, -0.2, 0.5]), np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
FRAME = FRAME * np.sign(np.linalg.det(FRAME))
PLACED = {
    kind.__name__: kind(centre=AT, frame=FRAME, radius=0.4, pitch=0.05)
    for kind in (Point, Line, Plane, Circle, Sphere, Cylinder, Screw)
}


def noise(shape, seed=0, size=2e-3):
    return size * np.random.default_rng(seed).standard_normal(shape)


def arc(degrees, samples=400, radius=0.71, seed=0):
    """Back and forth on a circle about (0.41, -0.12)."""
    angle = np.radians(degrees) / 2 * np.sin(np.linspace(0, 7, samples))
    exact = [0.41, -0.12] + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return exact + noise(exact.shape, seed)


FLAT = {"FlatCircle": FlatCircle(centre=AT[:2], frame=np.eye(2), radius=0.4)}
TIED = {kind.__name__: kind(centre=AT, frame=FRAME, radius=0.4, pitch=0.05) for kind in (Slider, Hinge, TurningScrew)}


@pytest.mark.parametrize("mechanism", (EVERY := PLACED | FLAT | TIED).values(), ids=EVERY)
def test_a_mechanism_is_the_same_after_a_way_through_a_file(mechanism, tmp_path):
    sure = replace(mechanism, covariance=1e-6 * np.eye(mechanism.count), unit="m", quantile=2.1)
    uc.save(sure, tmp_path / "m.npz")
    again = uc.load(tmp_path / "m.npz", Mechanism)
    states = sure.centre + noise((20, len(sure.centre)), size=1.0)
    assert type(again) is type(mechanism)
    assert_allclose(again(states, np.zeros(20)), mechanism(states, np.zeros(20)), atol=1e-15)
    assert again.rank == np.linalg.matrix_rank(mechanism(states[:1], np.zeros(1))[0])
    assert again.sentence == sure.sentence
    assert "±" in again.sentence


@pytest.mark.parametrize("change", [{"centre": np.ones(2)}, {"radius": "far"}, {"frame": np.full((3, 3), np.nan)}])
def test_a_file_that_holds_no_mechanism_is_refused(change, tmp_path):
    uc.save(replace(PLACED["Circle"], **change), tmp_path / "m.npz")
    with pytest.raises(ModelFileError, match="the policy in it is not complete"):
        uc.load(tmp_path / "m.npz", Mechanism)


def test_a_file_of_a_mechanism_is_no_policy_and_says_where_it_belongs(tmp_path):
    uc.save(PLACED["Circle"], tmp_path / "m.npz")
    with pytest.raises(ModelFileError, match="holds a mechanism, expected a policy"):
        uc.load(tmp_path / "m.npz")


@pytest.mark.parametrize("mechanism", PLACED.values(), ids=PLACED)
def test_whoever_follows_a_mechanism_as_a_constraint_stays_on_it(mechanism):
    start = AT + 0.4 * FRAME[1] if mechanism.radius and mechanism.kind not in ("point", "line", "plane") else AT
    moved = uc.rollout(lambda states: np.roll(states, 1, axis=1) + 0.3, start, 300, 1e-3, mechanism)
    held = constraint_distance(mechanism, moved.states)
    assert held < 1e-3  # Euler steps leave what bends by their square
    assert np.linalg.norm(moved.actions, axis=1).max() > 0 or mechanism.kind == "point"


def constraint_distance(mechanism, positions):
    """By hand, from the definition of each kind."""
    offset = positions - AT
    height, (first, second) = offset @ FRAME[0], FRAME[1:] @ offset.T
    distance, angle = np.hypot(first, second), np.unwrap(np.arctan2(second, first))
    apart = {
        "point": np.linalg.norm(offset, axis=1),
        "line": distance,
        "plane": height,
        "circle": np.hypot(height, distance - 0.4),
        "sphere": np.linalg.norm(offset, axis=1) - 0.4,
        "cylinder": distance - 0.4,
        "screw": np.hypot(height - 0.05 * angle, distance - 0.4),
    }
    return np.abs(apart[mechanism.kind]).max()


@pytest.mark.parametrize("mechanism", PLACED.values(), ids=PLACED)
def test_rows_are_orthonormal_and_as_many_as_the_dimensions_that_are_lost(mechanism):
    rows = mechanism(AT + noise((5, 3), size=1.0), np.zeros(5))
    lost = {"point": 3, "line": 2, "plane": 1, "circle": 2, "sphere": 1, "cylinder": 1, "screw": 2}[mechanism.kind]
    assert_allclose(rows @ rows.swapaxes(1, 2), np.broadcast_to(np.eye(lost), (5, lost, lost)), atol=1e-12)


@pytest.mark.parametrize("name", KINDS)
def test_a_simulated_mechanism_is_found_and_most_parameters_are_inside_their_intervals(name):
    simulated = simulate(np.random.default_rng([11, list(KINDS).index(name)]), KINDS[name])
    found = identify(simulated.positions, simulated.orientations)
    assert found.kind == KINDS[name].name
    assert found.odds > 3
    kept = list(inside(found.mechanism, simulated))
    assert sum(kept) >= len(kept) - 2


def test_a_free_movement_is_not_called_a_mechanism_with_confidence():
    for seed in range(2):
        found = identify(simulate(np.random.default_rng([12, seed]), FREE).positions)
        assert found.kind == "free" or not found.decided


def test_the_verdict_is_a_sentence_with_centre_radius_and_odds():
    found = identify(arc(110))
    assert found.kind == "circle"
    assert_allclose(found.mechanism.radius, 0.71, atol=found.mechanism.margins["radius"][0])
    assert found.sentence.startswith("a circle (hinge) about (0.41")
    assert "against a line more than 10000:1" in found.sentence or "against nothing held" in found.sentence


def test_the_interval_of_a_radius_is_that_of_least_squares():
    """The covariance of centre and radius on a whole circle, by hand: σ²/n diag(2, 2, 1)."""
    found = identify(arc(360, samples=2000))
    widths = np.r_[found.mechanism.margins["centre"], found.mechanism.margins["radius"]]
    angle = np.pi * np.sin(np.linspace(0, 7, 2000))
    design = np.column_stack([np.cos(angle), np.sin(angle), np.ones(2000)])
    expected = 1.96 * 2e-3 * np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    assert_allclose(widths, expected, rtol=0.1)


def test_a_short_arc_against_a_line_is_undecided_and_says_so():
    found = identify(arc(3, samples=100))
    assert {one.kind for one in found.candidates[:2]} == {"circle", "line"}
    assert not found.decided
    assert found.sentence.startswith("undecided: ")
    assert identify(arc(40, samples=100)).decided


def test_confidence_is_deserved():
    """Of arcs from nothing to 25 degrees hardly one is called a line with confidence."""
    wrong = confident = 0
    for seed in range(20):
        found = identify(arc(1.0 + 1.2 * seed, samples=60 + 20 * seed, radius=0.3, seed=seed))
        confident += found.decided
        wrong += found.decided and found.kind != "circle"
    assert wrong <= 1
    assert confident >= 8


def test_place_direction_and_unit_change_nothing_but_themselves():
    simulated = simulate(np.random.default_rng([11, 3]), KINDS["circle"])
    found, turned = identify(simulated.positions), identify(7.0 * simulated.positions @ FRAME.T + [100.0, 0.0, -3.0])
    assert turned.kind == found.kind
    assert_allclose(np.log(turned.odds), np.log(found.odds), rtol=1e-3)
    assert_allclose(turned.mechanism.centre, 7.0 * FRAME @ found.mechanism.centre + [100.0, 0.0, -3.0], atol=1e-4)
    assert_allclose(abs(turned.mechanism.axis @ FRAME @ found.mechanism.axis), 1.0, atol=1e-6)
    assert_allclose(turned.mechanism.margins["radius"], 7.0 * found.mechanism.margins["radius"], rtol=1e-2)


def test_neighbours_that_are_copies_count_once():
    once, copied = identify(arc(90)), identify(np.repeat(arc(90), 6, axis=0))
    assert_allclose(copied.effective_samples, once.effective_samples, rtol=0.3)
    assert_allclose(copied.mechanism.margins["radius"], once.mechanism.margins["radius"], rtol=0.3)


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.9])
def test_the_correlation_time_of_a_first_order_process_is_the_known_one(kept):
    values, shocks = np.zeros((20000, 2)), noise((20000, 2), size=1.0)
    for row in range(1, 20000):
        values[row] = kept * values[row - 1] + shocks[row]
    assert_allclose(correlation_time(values, np.zeros(20000, dtype=int)), (1 + kept) / (1 - kept), rtol=0.15)


def test_exact_movements_are_found_exactly():
    angle = np.linspace(0, 2, 50)
    found = identify(np.column_stack([0.2 * np.cos(angle), 0.2 * np.sin(angle), np.full(50, 0.3)]))
    assert found.kind == "circle"
    assert_allclose(found.mechanism.centre, [0, 0, 0.3], atol=1e-6)
    assert found.candidates[0].noise < 1e-6


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    """Two strokes of wiping in the bundled example: round, on a plate."""
    folder = tmp_path_factory.mktemp("example") / "wiping"
    uc.datasets.write_example(folder)
    return [uc.read(folder / f"{name}.csv")[0].values for name in ("plate1_1", "plate4_1")]


def test_a_cycle_that_is_wanted_on_a_plate_is_no_hinge(plates):
    for positions in plates:
        found = identify(positions)
        assert found.kind == "plane"
        assert ", against nothing held more than 10000:1" in found.sentence or ", against a circle" in found.sentence
        assert found.doubt.startswith("within the plane the path is near a circle of radius ")
        assert "strokes from other starts would tell whether it is held" in found.doubt


def crank(stray, depth=1.0, samples=200):
    """Three turns about (0.3, 0, 0) at 0.1 m, noise of 2 mm; who strays comes from outside and comes near slowly."""
    angle = np.linspace(0, 6 * np.pi, samples)
    radius = 0.1 + stray * np.exp(-angle / 3)
    flat = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(samples)])
    return [0.3, 0.0, 0.0] + (flat + noise(flat.shape) * [depth, 1.0, 1.0]) @ FRAME.T


def test_a_crank_is_a_hinge_and_one_that_is_left_is_a_habit():
    held, left = identify(crank(0.0)), identify(crank(0.03))
    assert (held.kind, left.kind) == ("circle", "plane")
    assert held.decided
    assert_allclose(held.mechanism.radius, 0.1, atol=held.mechanism.margins["radius"][0])
    assert held.doubt.startswith("a policy that keeps to this path within a surface looks the same in one stroke")


def test_a_sensor_that_is_noisier_in_one_direction_makes_no_habit_of_a_hinge():
    assert identify(crank(0.0, depth=3.0)).kind == "circle"


def test_several_strokes_or_forces_leave_no_doubt_of_one():
    groups = np.repeat([0, 1], 100)
    assert identify(crank(0.0), groups=groups).doubt == ""
    assert identify(straight_stroke(0.0)[0], forces=straight_stroke(0.0)[1]).doubt == ""
    assert "in one stroke" in identify(straight_stroke(0.0)[0]).doubt


def test_a_radius_that_is_not_known_decides_nothing(plates):
    found = identify(plates[0][:, :2])
    assert found.mechanism.margins["radius"] > 0.5 * found.mechanism.radius
    assert not found.decided
    assert found.sentence.startswith("undecided: a circle")


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_axes_are_on_one_side_that_of_the_largest_entry_of_their_common_direction(way):
    tilts = [np.array([np.sin(angle), 0.1, -np.cos(angle)]) for angle in (-0.5, 0.0, 0.4, 0.7)]
    signs = way * np.array([1.0, -1.0, 1.0, -1.0])
    planes = [Plane(centre=AT, frame=frame_of(sign * tilt)) for sign, tilt in zip(signs, tilts, strict=True)]
    turned = np.array([one.axis for one in on_one_side(planes)])
    assert_allclose(turned, [-tilt / np.linalg.norm(tilt) for tilt in tilts], atol=1e-12)
    assert_allclose([one.axis for one in on_one_side(planes[:1])], turned[:1])


@pytest.mark.parametrize("kind", [Plane, Line, Circle, Screw, Slider, Hinge, TurningScrew])
def test_turning_an_axis_round_changes_nothing_but_the_frame(kind):
    rng = np.random.default_rng(13)
    one = kind(centre=AT, frame=FRAME, radius=0.4, pitch=0.05, orientation=np.array([0.5, 0.5, -0.5, 0.5]))
    quaternions = np.array([0.4, 0.5, -0.6, 0.5]) + 0.2 * rng.standard_normal((20, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    track = Track(AT + 0.3 * rng.standard_normal((20, 3)), np.arange(20), quaternions)
    other = one.facing(-one.axis)
    assert_allclose(other.axis, -one.axis)
    assert_allclose(np.linalg.det(other.frame), 1.0)
    assert_allclose(np.abs(other.residuals(track)), np.abs(one.residuals(track)), atol=1e-12)


def test_planes_of_other_tilts_have_normals_on_one_side():
    positions, groups = demonstrations(3, tilt=0.4)
    planes = identify(positions, groups=groups).candidates[0].mechanisms
    assert len(planes) == 3
    assert min(one.axis[2] for one in planes) > 0.6


def test_lengths_are_in_the_unit_that_is_said():
    metres, millimetres, nothing = (
        identify(scale * arc(110), unit=unit).sentence for scale, unit in ((1, "m"), (1e3, "mm"), (1e3, ""))
    )
    assert re.search(r"radius 0\.7[01]\d* m ± [\d.]+ mm,", metres)
    assert re.search(r"radius 7\d\d\.?\d* mm ± [\d.]+ mm,", millimetres)
    assert re.search(r"radius 7\d\d\.?\d* ± [\d.]+,", nothing)


def test_an_exact_line_is_no_screw_without_a_radius():
    assert identify(np.arange(30.0)[:, None] * [1.0, 0.0, 0.0]).kind == "line"


def demonstrations(count, tilt):
    """Wiping on planes that are tilted more and more."""
    u, rows = np.linspace(0, 9, 40), []
    for k in range(count):
        flat = np.column_stack([0.1 * np.cos(3 * u), 0.12 * np.sin(2 * u), np.zeros(40)])
        c, s = np.cos(tilt * k), np.sin(tilt * k)
        rows.append(flat @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) + [0, 0, tilt * k])
    positions = np.concatenate(rows)
    return positions + noise(positions.shape, size=1e-3), np.repeat(np.arange(count), 40)


def test_demonstrations_share_a_mechanism_or_have_one_each_as_the_data_say():
    same, groups = demonstrations(2, tilt=0.0)
    found = identify(same, groups=groups)
    assert (found.kind, len(found.candidates[0].mechanisms)) == ("plane", 1)
    other, _ = demonstrations(2, tilt=0.3)
    found = identify(other, groups=groups)
    assert (found.kind, len(found.candidates[0].mechanisms)) == ("plane", 2)
    for k, mechanism in enumerate(found.candidates[0].mechanisms):
        assert_allclose(abs(mechanism.axis), np.abs([0, -np.sin(0.3 * k), np.cos(0.3 * k)]), atol=5e-3)
    assert found.sentence.startswith("a plane for each of 2 demonstrations: a plane through")


def test_what_one_stroke_tells_of_a_mechanism_of_its_own_several_do_not_tell_better():
    turn = np.linspace(0.0, 2.0, 60)
    bent, groups = [], np.repeat(np.arange(3), 60)
    for tilt in (0.0, 0.5, 1.0):
        flat = np.column_stack([turn, 0.3 * turn**3, np.zeros(60)])
        turned = [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]]
        bent.append(flat @ turned + [0.0, 0.0, tilt])
    free = identify(np.concatenate(bent) + noise((180, 3), size=1e-3), groups=groups)
    assert (free.kind, len(free.candidates[0].mechanisms)) == ("plane", 3)
    assert free.doubt.startswith("free strokes keep to a plane of their own, too, where they turn as little as here")
    assert identify(bent[0] + noise((60, 3), size=1e-3)).doubt.startswith("free strokes keep to a plane")
    wiped, groups = demonstrations(3, tilt=0.4)
    assert identify(wiped, groups=groups).doubt == ""
    lines = np.concatenate([way * turn[:, None] for way in np.eye(3)]) + noise((180, 3), size=1e-3)
    assert "looks the same in one stroke" in identify(lines, groups=np.repeat(np.arange(3), 60)).doubt


def test_the_order_of_demonstrations_changes_nothing():
    positions, groups = demonstrations(2, tilt=0.0)
    mixed = np.argsort(-groups, kind="stable")
    first, second = identify(positions, groups=groups), identify(positions[mixed], groups=groups[mixed])
    assert_allclose(second.candidates[0].log_evidence, first.candidates[0].log_evidence, rtol=1e-6)


def straight_stroke(sideways):
    """Along x on a table, with 10 N on it, friction of 3 N, and a side that is pushed against or not."""
    along = 0.2 * strokes(np.random.default_rng(5), 200, 1)[:, 0]
    positions = np.column_stack([along, np.zeros(200), np.zeros(200)])
    force = np.column_stack([-3 * np.sign(np.gradient(along)), sideways * np.sin(20 * along), np.full(200, 10.0)])
    return positions + noise(positions.shape), force + noise(force.shape, 1, 0.05)


def test_forces_tell_what_is_held_from_what_nobody_wanted():
    on_a_table = identify(*straight_stroke(0.0)[:1], forces=straight_stroke(0.0)[1])
    assert on_a_table.kind == "line"
    assert [one.held for one in on_a_table.witnesses] == [True, False]
    assert "undetermined along (0.00, " in on_a_table.sentence
    in_a_slot = identify(*straight_stroke(6.0)[:1], forces=straight_stroke(6.0)[1])
    assert [one.held for one in in_a_slot.witnesses] == [True, True]


def test_friction_is_no_witness():
    positions, force = straight_stroke(0.0)
    force[:, 2] = 0.0
    found = identify(positions, forces=force)
    assert not any(one.held for one in found.witnesses)


def test_a_hinge_turns_its_tool_and_a_circle_does_not():
    angle = 1.2 * np.sin(np.linspace(0, 6, 60))
    positions = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.zeros(60)]) + noise((60, 3), seed=2)
    turning = np.column_stack([np.zeros((60, 2)), np.sin(angle / 2), np.cos(angle / 2)]) + noise((60, 4), seed=1)
    still = np.array([0.0, 0.0, 0.0, 1.0]) + noise((60, 4), seed=1)
    assert identify(positions, turning).kind == "hinge"
    assert identify(positions, -turning).kind == "hinge"
    assert identify(positions, still).kind == "circle"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"positions": np.zeros((20, 4))}, "positions: got 4 columns, expected two or three"),
        ({"positions": np.zeros((9, 3))}, "a demonstration of 9 samples, expected at least 10"),
        ({"positions": np.ones((20, 3))}, "positions: all rows are the same"),
        ({"positions": noise((20, 3)), "forces": np.zeros((19, 3))}, r"forces: got an array of shape \(19, 3\)"),
        ({"positions": noise((20, 3)), "orientations": np.zeros((20, 4))}, "quaternions that are not zero"),
        ({"positions": noise((20, 2)), "orientations": np.ones((20, 4))}, "beside positions in space"),
    ],
)
def test_what_does_not_fit_is_refused(arguments, sentence):
    with pytest.raises(InvalidDataError, match=sentence):
        identify(**arguments)


def door(rng, samples=150, degrees=70.0, centre=None, size=3e-3):
    """Opened once about a vertical hinge, which is anywhere unless it is told."""
    way = np.clip(np.linspace(-0.1, 1.1, samples), 0, 1)
    angle, middle = np.radians(degrees) * way + rng.uniform(0, 6), rng.uniform(-0.5, 0.5, 2)
    x, y = middle if centre is None else centre
    exact = np.column_stack([x + 0.7 * np.cos(angle), y + 0.7 * np.sin(angle), np.full(samples, 0.3)])
    return exact + size * rng.standard_normal(exact.shape)


def drawer(rng, samples=150, along=None, size=3e-3):
    """Pulled once by 0.5 m, from anywhere, along any direction unless it is told."""
    way = rng.standard_normal(3) if along is None else np.array(along)
    exact = 0.5 * np.clip(np.linspace(-0.1, 1.1, samples), 0, 1)[:, None] * way / np.linalg.norm(way)
    start = rng.uniform(-0.5, 0.5, 3) if along is None else np.zeros(3)
    return start + exact + size * rng.standard_normal(exact.shape)


def together(parts):
    return identify(np.concatenate(parts), groups=np.repeat(np.arange(len(parts)), [len(one) for one in parts]))


@pytest.mark.parametrize("seed", range(4))
def test_doors_and_drawers_are_called_what_each_is(seed):
    rng = np.random.default_rng(seed)
    found = together([door(rng, 400), door(rng, 400), drawer(rng, 400), drawer(rng, 400)])
    assert found.kind == "mixture"
    assert [one.kind for one in found.candidates[0].mechanisms] == ["circle", "circle", "line", "line"]
    assert found.candidates[0].kinds[:2] == ["circle", "circle"]
    assert "circle" not in found.candidates[0].kinds[2:]
    for one in found.candidates[0].mechanisms[:2]:
        assert_allclose(one.radius, 0.7, atol=2 * one.margins["radius"].item())
    assert "looks the same in one stroke" in found.doubt


@pytest.mark.parametrize("seed", range(4))
def test_what_is_of_one_kind_is_called_a_mixture_by_nobody(seed):
    rng = np.random.default_rng(seed)
    kinds = {
        "circle": [door(rng, centre=(0.1, 0.2)) for _ in range(3)],
        "line": [drawer(rng, along=(0.0, 0.6, 0.8)) for _ in range(3)],
    }
    for kind, parts in kinds.items():
        found = together(parts)
        assert (found.kind, len(found.candidates[0].mechanisms)) == (kind, 1)
    for kind, make in {"circle": door, "line": drawer}.items():
        found = together([make(rng, size=size) for size in (2e-3, 3e-3, 3e-3)])
        assert (found.kind, len(found.candidates[0].mechanisms)) == (kind, 3)


def test_in_a_mixture_a_short_arc_is_undecided_by_itself():
    rng = np.random.default_rng(1)
    found = together([door(rng, 400), door(rng, degrees=7.0), drawer(rng, 400), drawer(rng, 400)])
    assert found.candidates[0].kinds == ["circle", "undecided", "line", "line"]
    assert not found.decided
    assert "circle for 1, undecided for 1, line for 2 of 4 demonstrations" in found.summary


def test_forces_beside_mechanisms_of_several_kinds_are_no_witnesses():
    rng = np.random.default_rng(0)
    positions, groups = np.concatenate([door(rng), drawer(rng)]), np.repeat([0, 1], 150)
    assert identify(positions, forces=np.ones((300, 3)), groups=groups).witnesses == []


@pytest.mark.parametrize(("degrees", "size"), [(5, 5e-4), (10, 2e-3), (20, 5e-3), (90, 5e-3)])
def test_intervals_of_an_arc_hold_what_is_true_however_short_it_is(degrees, size):
    """Radius and axis; binomial with 0.95 of 40, at least 33 in all but one of a thousand."""
    angle = np.radians(degrees) * np.linspace(0, 1, 120)
    exact = 0.7 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(120)])
    held = []
    for seed in range(40):
        track, _, scale, origin = _track(exact + noise(exact.shape, seed, size), None, None)
        one = fit(Circle, track)
        circle = one.certain(one_noise([one])).placed(scale, origin, "m")
        off = np.arccos(abs(circle.axis[2])) <= np.hypot(*circle.margins["tilt"]) * 1.25
        held.append((abs(circle.radius - 0.7) <= circle.margins["radius"].item(), off))
    assert np.sum(held, axis=0).min() >= 33


def test_a_radius_that_a_straight_path_does_not_tell_is_not_told():
    rng = np.random.default_rng(0)
    track, _, scale, origin = _track(drawer(rng), None, None)
    one = fit(Circle, track)
    circle = one.certain(one_noise([one])).placed(scale, origin, "m")
    assert circle.vague
    assert circle.sentence == "a circle (hinge) of a radius that the recording does not tell"


@needs_rim
def test_the_flat_rim_is_a_plane_across_the_tools_axis(monkeypatch):
    monkeypatch.setenv("UNCONSTRAIN_DATA", str(DATA))
    rows = normals(rate=4.0)
    flat, tilted = ([row for row in rows if row["bout"].startswith("A") == is_flat] for is_flat in (True, False))
    assert max(row["angle"] for row in flat) < 3
    assert max(abs(row["angle"] - row["angle_curved"]) for row in tilted) < 2  # no surface is nearer to the tool


def test_the_mean_normal_of_a_curved_surface_is_that_of_its_slopes():
    u, v = np.random.default_rng(0).uniform(-0.1, 0.1, (2, 500))
    positions = np.column_stack([u, v, 0.2 * u - 0.1 * v + u**2 - 2 * u * v])
    slopes = np.array([(0.2 + 2 * u - 2 * v).mean(), (-0.1 - 2 * u).mean()])
    normal, off = mean_normal(positions, np.array([0.0, 0.0, 1.0]))
    assert_allclose(normal * np.sign(normal[2]), np.append(-slopes, 1.0) / np.sqrt(1.0 + slopes @ slopes), atol=1e-6)
    assert off < 1e-12


@pytest.mark.slow
def test_sixty_mechanisms():
    *_, row = mechanisms(60, seed=101)[0]
    assert row["right"] >= 0.90
    assert 0.88 <= row["inside"] <= 0.99
    assert row["confident_and_wrong"] <= 0.02 * row["confident"]


def stroke(rng, hold, samples=400, step=0.01, size=6e-4):
    """A movement to a goal with a swirl, which ``hold`` (states -> rows of A) takes directions from."""
    swirl, goal = np.array([[-0.7, -0.55, 0.0], [0.55, -0.7, 0.0], [0.0, 0.0, -0.7]]), np.array([0.45, 0.1, 1.05])

    def policy(states):
        way = (states - goal) @ swirl.T
        return way / np.sqrt(1.0 + 4.0 * np.vecdot(way, way))[:, None]

    start = goal + rng.uniform(-0.5, 0.5, 3)
    movement = uc.rollout(policy, start, samples, step, hold(start, rng.standard_normal(3)))
    return movement.states + size * rng.standard_normal((samples, 3))


def on_plane(_, normal):
    return Plane(centre=np.zeros(3), frame=frame_of(normal / np.linalg.norm(normal)))


def on_sphere(start, way):
    return Sphere(centre=start + 0.4 * way / np.linalg.norm(way), frame=np.eye(3), radius=0.4)


def on_cylinder(start, way):
    frame = frame_of(way / np.linalg.norm(way))
    return Cylinder(centre=start + 0.3 * frame[1], frame=frame, radius=0.3)


@pytest.mark.parametrize(
    ("hold", "seed"),
    [(on_plane, 7), *((on_cylinder, seed) for seed in (0, 14, 18)), *((on_sphere, seed) for seed in (8, 14, 16))],
)
def test_a_surface_is_not_likelier_for_bending_as_a_stroke_turns(hold, seed):
    """Unrolled, these strokes are straighter on another surface than on their own."""
    found = identify(stroke(np.random.default_rng(seed), hold)[::3])
    other = {"plane", "cylinder", "sphere"} - {hold.__name__.removeprefix("on_")}
    assert not (found.decided and found.kind in other)


def wandering(rng):
    """A free movement that goes on turning, on no surface."""
    turns = np.linspace(0.0, 9.0, 400)[:, None] * rng.uniform(0.7, 1.3, 3) + rng.uniform(0.0, 6.0, 3)
    return 0.2 * np.sin(turns) + noise((400, 3), size=6e-4)


@pytest.mark.parametrize("hold", [on_cylinder, on_sphere])
def test_what_a_stroke_keeps_to_is_told_where_it_is_round(hold):
    told, right = 0, []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        positions = stroke(rng, hold)
        found = uc.constraints.kept(positions)
        if found is not None:
            again = np.random.default_rng(seed)
            start = np.array([0.45, 0.1, 1.05]) + again.uniform(-0.5, 0.5, 3)
            normal = hold(start, again.standard_normal(3)).rows(positions)[:, 0]
            right.append(np.linalg.norm(np.einsum("nkd,nd->nk", found.rows(positions), normal), axis=1).mean())
            told += 1
    assert told >= 4
    assert np.median(right) > 0.99


def test_what_is_flat_free_or_out_of_order_keeps_to_nothing_round():
    rngs = [np.random.default_rng(seed) for seed in range(6)]
    flat = [stroke(rng, on_plane) for rng in rngs]
    assert sum(uc.constraints.kept(one) is not None for one in flat) <= 2
    assert [uc.constraints.kept(wandering(rng)) for rng in rngs] == 6 * [None]
    turn = np.linspace(0.0, 9.0, 300)[:, None]
    ring = np.hstack([np.cos(turn), np.sin(turn)]) + noise((300, 2))
    assert uc.constraints.kept(ring).kind == uc.constraints.kept(1000.0 * ring + 5000.0).kind == "circle"
    assert uc.constraints.kept(ring[:150], wound=True) is None  # it turns 0.7 times
    assert uc.constraints.kept(ring, wound=True) is not None  # 1.4 times
    assert uc.constraints.kept(1.2 * np.random.default_rng(0).permutation(ring) + noise((300, 2), size=0.1)) is None
    assert uc.constraints.kept(np.ones((300, 2))) is None
    assert uc.constraints.kept(ring[:5]) is None
    assert uc.constraints.kept(ring.astype(np.float32)).kind == "circle"
    blinking = np.zeros((400, 3))
    blinking[1::2] = 1.0  # what is looked at stands still
    assert uc.constraints.kept(blinking) is None
    for count in (13, 50, 77, 100, 333):
        assert uc.constraints.kept(np.tile([0.1, 0.2, 0.3], (count, 1))) is None  # the mean of which is rounded
    for rounds in (3.0, 11.5, 12.0, 17.0, 24.0):  # as many as the parts that are compared, too
        turn = 2 * np.pi * rounds * np.linspace(0.0, 1.0, 800)
        pot = 0.1 * np.column_stack([np.cos(turn), np.sin(turn), 0.5 * np.sin(turn / 7)]) + noise((800, 3), size=3e-4)
        assert uc.constraints.kept(pot, wound=True) is not None, rounds

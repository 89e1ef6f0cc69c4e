"""What a constraint matrix can be."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from unconstrain.base.errors import InvalidDataError, SettingError
from unconstrain.constraints.known import JacobianRows, Plane, PolicyAligned, SwitchingLine
from unconstrain.risks.projection import null_space_projection


def circle(states):
    return np.column_stack([states[:, 1], -states[:, 0]])


def test_a_plane_blocks_its_normal_everywhere():
    A = Plane([0, 3, 4])(np.zeros((5, 3)), np.zeros(5))
    assert A.shape == (5, 1, 3)
    assert_allclose(A[2], [[0, 0.6, 0.8]])


def test_a_plane_has_a_normal():
    with pytest.raises(SettingError, match=r"normal: got \[0, 0, 0\], expected a vector that is not zero"):
        Plane([0, 0, 0])
    with pytest.raises(InvalidDataError, match=r"normal: got an array of shape \(1, 3\), expected one dimension"):
        Plane([[0, 0, 1]])


def test_a_line_switches_when_its_time_comes():
    line = SwitchingLine([[1, 0], [0, 1], [1, 1]], [0.5, 1.0])
    A = line(np.zeros((5, 2)), np.array([0.0, 0.49, 0.5, 0.99, 7.0]))
    assert A.shape == (5, 1, 2)
    assert_array_equal(A[:, 0], [[1, 0], [1, 0], [0, 1], [0, 1], [1, 1]])


def test_a_line_switches_on_time_where_the_clock_is_a_sum_of_steps():
    line = SwitchingLine([[1, 0], [0, 1]], [0.3])
    assert_array_equal(line(np.zeros((1, 2)), np.array([0.1 + 0.1 + 0.1 - 1e-16]))[0, 0], [0, 1])


def test_a_line_that_never_switches_is_a_plane():
    line = SwitchingLine([[3, 4]], [])
    N = null_space_projection(line(np.zeros((2, 2)), np.zeros(2)))
    assert_allclose(N, null_space_projection(Plane([3, 4])(np.zeros((2, 2)), np.zeros(2))))


@pytest.mark.parametrize(
    "constraint",
    [SwitchingLine([[1, 0], [0, 1]], [0.3]), PolicyAligned(circle, [0.1, 0.2], 0.02)],
    ids=["line", "aligned"],
)
def test_no_stretch_holds_at_a_time_that_is_none(constraint):
    with pytest.raises(InvalidDataError, match="times: found nan at row 1, and the constraint depends on them"):
        constraint(np.ones((3, 2)), np.array([0.0, np.nan, 1.0]))


def test_random_lines_switch_at_regular_intervals():
    line = SwitchingLine.random(np.random.default_rng(0), duration=0.9, switches=2, dimensions=4)
    assert_array_equal(line.directions, np.random.default_rng(0).standard_normal((3, 4)))
    assert_allclose(line.switches, [0.3, 0.6])
    assert len(SwitchingLine.random(np.random.default_rng(0), 1.0, switches=0).switches) == 0


@pytest.mark.parametrize(
    ("directions", "switches", "error", "sentence"),
    [
        ([[1, 0], [0, 1]], [1, 2], InvalidDataError, "switches: got 2 values, expected 1"),
        ([1, 0], [], InvalidDataError, r"directions: got an array of shape \(2,\)"),
        ([[1, 0]] * 3, [2, 1], SettingError, r"switches: got \[2.0, 1.0\], expected ascending times"),
    ],
)
def test_a_line_has_one_switch_less_than_directions(directions, switches, error, sentence):
    with pytest.raises(error, match=sentence):
        SwitchingLine(directions, switches)


@pytest.mark.parametrize("angle", [0.0, 0.4, -2.0])
def test_aligned_constraints_leave_motion_along_the_turned_policy_only(angle):
    states = np.random.default_rng(0).standard_normal((6, 2))
    A = PolicyAligned(circle, [angle], 0.02)(states, np.zeros(6))
    for x, N in zip(states, null_space_projection(A), strict=True):
        pi = circle(x[None])[0]
        c, s = np.cos(angle), np.sin(angle)
        alpha = np.array([c * pi[0] - s * pi[1], s * pi[0] + c * pi[1]])
        assert_allclose(N, np.outer(alpha, alpha) / (alpha @ alpha), atol=1e-12)


def test_each_time_step_has_its_angle_and_the_last_one_stays():
    states = np.tile([[1.0, 0.5]], (5, 1))
    aligned = PolicyAligned(circle, [0.0, 1.0, 2.0], 0.1)
    A = aligned(states, np.array([0.0, 0.1, 0.1 + 0.1, 0.3, 9.0]))
    single = [PolicyAligned(circle, [a], 0.1)(states[:1], np.zeros(1))[0] for a in (0, 1, 2, 2, 2)]
    assert_array_equal(A, single)


def test_random_angles_are_uniform_up_to_the_widest():
    aligned = PolicyAligned.random(np.random.default_rng(1), circle, 0.3, 500, 0.02)
    assert_array_equal(aligned.angles, np.random.default_rng(1).uniform(-0.3, 0.3, 500))


def test_where_the_policy_stands_still_an_aligned_constraint_blocks_all():
    A = PolicyAligned(circle, [0.1], 0.02)(np.zeros((1, 2)), np.zeros(1))
    assert_array_equal(A, [np.eye(2)])


def test_time_steps_have_a_length():
    with pytest.raises(SettingError, match="dt: got 0, expected a number above 0"):
        PolicyAligned(circle, [0.0], 0)


def test_rows_of_a_jacobian_are_picked():
    J = np.random.default_rng(0).standard_normal((4, 6, 7))
    held = JacobianRows(lambda states: J, (0, 2))
    assert_array_equal(held(np.zeros((4, 7)), np.zeros(4)), J[:, [0, 2]])


def test_a_row_that_the_jacobian_does_not_have_is_refused():
    with pytest.raises(SettingError, match=r"rows: got \(0, 6\), expected rows of the Jacobian, 0 to 5"):
        JacobianRows(lambda x: np.ones((len(x), 6, 7)), (0, 6))(np.zeros((2, 7)), np.zeros(2))

"""Pictures show what they are given."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from unconstrain.base.errors import MissingExtraError
from unconstrain.pages import figures
from unconstrain.pages.figures.planes import arrow_lines, broken, clipped
from unconstrain.pages.figures.style import DASHES, MARKERS
from unconstrain.paper.figures import charts, overview, plates
from unconstrain.recordings.demonstration import Demonstration

rng = np.random.default_rng(0)
NORMALS = [np.array(normal, float) for normal in ([0, 0, 1], [0, 0.3, 1], [1, 0, 0], [-0.95, 0.1, 0.1], [0, -1, 0])]


class TestMethods:
    def test_each_has_a_colour_a_marker_and_a_dash_of_its_own(self):
        for looks in (figures.COLOURS, MARKERS, DASHES):
            assert len({looks[method] for method in figures.METHODS}) == len(figures.METHODS)

    def test_methods_are_told_apart_without_colour(self):
        """By lightness, as in a grey print."""

        def lightness(colour: str) -> float:
            linear = [(int(colour[at : at + 2], 16) / 255) ** 2.2 for at in (1, 3, 5)]
            return float(np.dot(linear, [0.2126, 0.7152, 0.0722])) ** (1 / 2.2)

        found = sorted(lightness(figures.COLOURS[method]) for method in figures.METHODS)
        assert np.diff(found).min() > 0.03


class TestArrows:
    def test_an_arrow_goes_from_its_point_to_its_tip(self):
        points, vectors = rng.normal(size=(2, 7, 2))
        lines = arrow_lines(points, vectors).reshape(7, 6, 2)
        np.testing.assert_allclose(lines[:, 0], points)
        np.testing.assert_allclose(lines[:, 1], points + vectors)
        assert np.isnan(lines[:, 5]).all()
        assert not np.isnan(lines[:, :5]).any()

    def test_both_barbs_are_as_long(self):
        points, vectors = rng.normal(size=(2, 7, 2))
        lines = arrow_lines(points, vectors, head=0.3).reshape(7, 6, 2)
        for barb in (2, 4):
            length = np.linalg.norm(lines[:, barb] - lines[:, 1], axis=1)
            np.testing.assert_allclose(length, 0.3 * np.linalg.norm(vectors, axis=1))

    def test_long_arrows_are_cut_and_short_ones_are_not(self):
        cut = clipped(np.array([[3.0, 4.0], [0.3, 0.4], [0.0, 0.0]]), 1.0)
        np.testing.assert_allclose(cut, [[0.6, 0.8], [0.3, 0.4], [0.0, 0.0]])


class TestStrokes:
    def test_no_line_goes_where_the_tool_was_lifted(self):
        line = np.column_stack([np.arange(40.0), np.zeros(40)])
        lifted = np.concatenate([line, line + np.array([0.0, 9.0])])
        found = broken(lifted)
        np.testing.assert_array_equal(np.flatnonzero(np.isnan(found[:, 0])), [40])
        np.testing.assert_array_equal(np.delete(found, 40, axis=0), lifted)

    @pytest.mark.parametrize("count", [1, 2, 50])
    def test_a_steady_movement_stays_whole(self, count):
        line = np.column_stack([np.arange(count), np.arange(count)]).astype(float)
        np.testing.assert_array_equal(broken(line), line)


class TestPlates:
    @pytest.mark.parametrize("normal", NORMALS, ids=str)
    def test_axes_lie_in_the_plane(self, normal):
        plate = plates.Quad.around(rng.normal(size=(20, 3)), normal)
        np.testing.assert_allclose(plate.axes.T @ plate.axes, np.eye(2), atol=1e-12)
        np.testing.assert_allclose(normal @ plate.axes, 0.0, atol=1e-12)

    @pytest.mark.parametrize("normal", NORMALS, ids=str)
    def test_a_point_in_the_plane_keeps_its_place(self, normal):
        plate = plates.Quad.around(rng.normal(size=(20, 3)), normal)
        points = plate.grid(5)
        np.testing.assert_allclose(plate.flatten(plate.place(points)), points, atol=1e-12)

    def test_it_reaches_around_the_movement(self):
        states = rng.normal(size=(20, 3)) * [1, 1, 0]
        plate = plates.Quad.around(states, np.array([0.0, 0.0, 1.0]))
        assert (np.abs(plate.flatten(states)) < plate.half).all()

    def test_a_movement_that_stays_put_has_a_plate_too(self):
        plate = plates.Quad.around(np.ones((4, 3)), np.array([0.0, 0.0, 1.0]))
        assert np.isfinite(plate.corners).all()


class TestCharts:
    def test_a_vector_field_has_equal_axes(self):
        made = figures.vector_field(np.zeros((4, 2)), {"truth": np.ones((4, 2))}, longest=1.0, scale=1.0)
        assert made.layout.yaxis.scaleanchor == "x"

    def test_the_truth_is_drawn_last(self):
        fields = {key: np.ones((4, 2)) for key in ("truth", *figures.METHODS)}
        made = figures.vector_field(np.zeros((4, 2)), fields, longest=1.0, scale=1.0)
        assert made.data[-1].legendgroup == "truth"

    def test_axes_say_what_they_show(self):
        x, ones = np.arange(3.0), np.ones(3)
        curves = dict.fromkeys(figures.METHODS, (ones, ones))
        made = charts.bands(x, curves, title="nUPE", labels=("angle (rad)", "nUPE"))
        assert (made.layout.xaxis.title.text, made.layout.yaxis.title.text) == ("angle (rad)", "nUPE")

    def test_bands_never_go_below_zero(self):
        x, ones = np.arange(3.0), np.ones(3)
        for log in (False, True):
            made = charts.bands(x, {"direct": (ones, 2 * ones)}, title="", labels=("", ""), log=log)
            assert min(made.data[0].y) >= 0.5 * log

    def test_spectra_begin_at_one_and_descend(self):
        eigenvalues = np.sort(rng.random((4, 9)), axis=1)
        for trace in figures.spectra(eigenvalues).data:
            assert trace.y[0] == 1.0
            assert (np.diff(trace.y) <= 0).all()

    def test_spectra_of_nothing_are_finite(self):
        assert np.isfinite(figures.spectra(np.zeros((2, 5))).data[0].y).all()

    def test_scores_that_overflowed_are_left_out(self):
        scores = np.array([[np.inf, 2.0, 1.0], [np.nan, np.inf, np.nan]])
        made = figures.step_scores(scores, np.array([2, 0]))
        assert len(made.data) == 2
        np.testing.assert_array_equal(made.data[0].y, [np.nan, 2.0, 1.0])
        assert list(made.data[1].x) == [2]

    def test_time_series_have_a_row_for_each_component(self):
        made = figures.over_time(np.arange(5.0), {"observed": rng.random((5, 3))}, ["vx", "vy", "vz"])
        assert [trace.yaxis for trace in made.data] == ["y", "y2", "y3"]
        assert made.layout.xaxis3.title.text == "time (s)"


class TestMapOfWhatIsKnown:
    points, values = rng.normal(size=(30, 2)), rng.uniform(0, 0.5, 30)

    def test_what_is_known_least_lies_on_top(self):
        made = figures.known_map(self.points, self.values, self.points[:3], labels=("x", "y"), scale="spread")
        drawn = np.array(made.data[0].marker.color)
        np.testing.assert_allclose(drawn, np.sort(self.values))
        assert made.data[0].marker.cmax == self.values.max()
        assert list(made.data[-1].text) == ["1", "2", "3"]

    def test_colours_do_not_end_before_the_top_that_is_asked_for(self):
        made = figures.known_map(self.points, self.values, self.points[:1], labels=("x", "y"), scale="", top=2.0)
        assert made.data[0].marker.cmax == 2.0

    def test_directions_go_through_the_marked_points(self):
        marked, ways = self.points[:4], rng.normal(size=(4, 2))
        made = figures.known_map(self.points, self.values, marked, labels=("x", "y"), scale="", directions=ways)
        ends = np.column_stack([made.data[1].x, made.data[1].y]).reshape(4, 3, 2)
        np.testing.assert_allclose(ends[:, :2].mean(axis=1), marked)
        drawn = ends[:, 1] - ends[:, 0]
        np.testing.assert_allclose(drawn[:, 0] * ways[:, 1], drawn[:, 1] * ways[:, 0], atol=1e-12)


class TestRatioTable:
    def test_cells_say_their_number_and_are_coloured_by_its_logarithm(self):
        values = np.array([[1.0, 0.01, np.nan], [1584.3, 3.98e6, 20.0]])
        cells = charts.ratio_table(["a", "b"], ["x", "y", "z"], values, top=10.0).data[0]
        assert [list(row) for row in cells.text] == [["1", "0.01", ""], ["1584", "4e6", "20"]]
        np.testing.assert_allclose(cells.z, [[0, -1, np.nan], [1, 1, 1]])


class TestOverview:
    states = rng.uniform(-1, 1, (30, 2))

    def test_it_draws_a_file(self, tmp_path):
        demo = Demonstration(self.states, self.states)
        overview.overview(tmp_path / "a.png", [demo], np.tanh, {"learnt": np.negative}, arrows=5)
        assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")

    def test_without_matplotlib_it_says_what_to_install(self, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
        with pytest.raises(MissingExtraError, match=r"'matplotlib', which is not installed.*unconstrain\[viz\]"):
            overview.overview(tmp_path / "a.png", [], np.tanh, {})


def test_without_plotly_pictures_say_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(MissingExtraError, match=r"'plotly', which is not installed.*unconstrain\[viz\]"):
        figures.bars(["a"], {"direct": [1.0]}, title="", label="")

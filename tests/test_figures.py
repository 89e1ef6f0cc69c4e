"""Pictures show what they are given."""

from __future__ import annotations

import re
import sys

import matplotlib.colors
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seen import contrast
from unconstrain.base.errors import MissingExtraError
from unconstrain.pages import figures, html
from unconstrain.pages.figures.compact import compact
from unconstrain.pages.figures.planes import arrow_lines, broken, clipped
from unconstrain.pages.figures.style import INK, MARKERS, RULE, described, power, readable, svg
from unconstrain.paper.figures import charts, plates

rng = np.random.default_rng(0)
NORMALS = [np.array(normal, float) for normal in ([0, 0, 1], [0, 0.3, 1], [1, 0, 0], [-0.95, 0.1, 0.1], [0, -1, 0])]


class TestMethods:
    def test_each_has_a_colour_and_a_marker_of_its_own(self):
        for looks in (figures.COLOURS, MARKERS):
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
        lines = arrow_lines(points, vectors).reshape(7, 6, 2)
        for barb in (2, 4):
            length = np.linalg.norm(lines[:, barb] - lines[:, 1], axis=1)
            np.testing.assert_allclose(length, 0.32 * np.linalg.norm(vectors, axis=1))

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


def lines(made, key, axes=0):
    """Points (N, 2) of each line of a key."""
    return [np.column_stack(one.get_data()) for one in made.axes[axes].lines if one.get_gid() == f"key:{key}"]


class TestCharts:
    def test_a_vector_field_has_equal_axes(self):
        made = figures.vector_field(np.zeros((4, 2)), {"truth": np.ones((4, 2))}, longest=1.0, scale=1.0)
        assert made.axes[0].get_aspect() == 1.0

    def test_the_truth_is_drawn_last(self):
        fields = {key: np.ones((4, 2)) for key in ("truth", *figures.METHODS)}
        made = figures.vector_field(np.zeros((4, 2)), fields, longest=1.0, scale=1.0)
        assert made.axes[0].lines[-1].get_gid() == "key:truth"

    def test_axes_say_what_they_show(self):
        x, ones = np.arange(3.0), np.ones(3)
        curves = dict.fromkeys(figures.METHODS, (ones, ones))
        [axes] = charts.bands(x, curves, title="nUPE", labels=("angle (rad)", "nUPE")).axes
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("angle (rad)", "nUPE")

    def test_bands_never_go_below_zero(self):
        x, ones = np.arange(3.0), np.ones(3)
        for log in (False, True):
            [axes] = charts.bands(x, {"direct": (ones, 2 * ones)}, title="", labels=("", ""), log=log).axes
            [band] = axes.collections
            assert band.get_paths()[0].vertices[:, 1].min() >= 0.5 * log

    def test_spectra_begin_at_one_and_descend(self):
        eigenvalues = np.sort(rng.random((4, 9)), axis=1)
        made = figures.spectra(eigenvalues)
        for line in (*lines(made, "each field"), *lines(made, "median")):
            assert line[0, 1] == 1.0
            assert (np.diff(line[:, 1]) <= 0).all()

    def test_spectra_of_nothing_are_finite(self):
        assert np.isfinite(lines(figures.spectra(np.zeros((2, 5))), "median")).all()

    def test_scores_that_overflowed_are_left_out(self):
        scores = np.array([[np.inf, 2.0, 1.0], [np.nan, np.inf, np.nan]])
        curve, chosen = figures.step_scores(scores, np.array([2, 0])).axes[0].lines
        np.testing.assert_array_equal(curve.get_ydata(), [np.nan, 2.0, 1.0])
        assert list(np.atleast_1d(chosen.get_xdata())) == [2]

    def test_time_series_have_a_row_for_each_component(self):
        values = rng.random((5, 3))
        made = figures.over_time(np.arange(5.0), {"observed": values}, ["vx", "vy", "vz"])
        assert [axes.get_ylabel() for axes in made.axes] == ["vx", "vy", "vz"]
        assert [axes.get_xlabel() for axes in made.axes] == ["", "", "time (s)"]
        for row in range(3):
            np.testing.assert_array_equal(lines(made, "observed", row)[0][:, 1], values[:, row])

    def test_movements_in_space_are_to_scale(self):
        states = rng.uniform(size=(30, 3)) * [4.0, 2.0, 1.5]
        [axes] = figures.movements([("training", states)]).axes
        spans = np.array([np.ptp(getattr(axes, f"get_{name}lim")()) for name in "xyz"])
        np.testing.assert_allclose(spans / spans.max(), axes._box_aspect / axes._box_aspect.max())


class TestAsText:
    """A picture as it stands in a page."""

    def drawn(self, label="angle (rad)"):
        curves = dict.fromkeys(figures.METHODS, (np.arange(1.0, 4.0), np.ones(3)))
        made = charts.bands(np.arange(3.0), curves, title="nUPE", labels=(label, "error"))
        return made, svg(made, 400, described(made))

    def test_its_keys_can_be_found(self):
        assert set(re.findall(r'data-key="([^"]*)"', self.drawn()[1])) == set(figures.METHODS)

    def test_what_the_page_decides_is_left_to_it(self):
        text = self.drawn()[1]
        assert "var(--ink)" in text
        assert INK not in text
        assert RULE not in text

    def test_names_are_text_and_never_markup_or_mathematics(self):
        text = self.drawn("<b>$x_1$</b> & co")[1]
        assert text.count("&lt;b&gt;$x_1$&lt;/b&gt; &amp; co") == 2  # the axis and the words for it
        assert "<b>" not in text

    def test_it_says_in_words_what_it_shows(self):
        said = "nUPE: error over angle (rad); direct from 1 to 3, inconsistency from 1 to 3, hybrid from 1 to 3."
        assert described(self.drawn()[0]) == said
        assert f'role="img" aria-label="{said}"' in self.drawn()[1]

    def test_names_in_the_key_are_those_in_the_words_and_space_has_three_axes(self):
        states = np.column_stack([np.arange(3.0), np.arange(3.0), [0.5, 0.1, 0.2]])
        made = figures.movements([("training", states)], labels=("x [m]", "y [m]", "z [m]"))
        assert described(made) == "z [m] over x [m] and y [m]; training data from 0.1 to 0.5."
        page = html.picture("it", [made], "", labels={"training": "strokes"})
        assert 'aria-label="z [m] over x [m] and y [m]; strokes from 0.1 to 0.5."' in page

    def test_bars_are_told_one_by_one_and_many_by_how_far_they_reach(self):
        few = figures.bars(["a", "b"], {"direct": [0.5, 0.25], "hybrid": [0.1, 0.2]}, title="", label="nCPE")
        assert described(few) == "nCPE; direct a 0.5, b 0.25; hybrid a 0.1, b 0.2."
        many = figures.bars([*"abcdefghijklmnop"], {"direct": np.linspace(0.1, 1.6, 16)}, title="", label="nCPE")
        assert described(many) == "nCPE; direct from 0.1 to 1.6."

    def test_shades_are_told_with_what_they_mean(self):
        points, values = np.random.default_rng(0).uniform(size=(9, 2)), np.linspace(0.0, 0.4, 9)
        made = figures.known_map(points, values, points[:1], labels=("x", "y"), scale="spread")
        assert "; spread from 0 to 0.4" in described(made)

    def test_the_same_picture_is_the_same_text(self):
        assert self.drawn()[1] == self.drawn()[1]

    @pytest.mark.parametrize(("value", "text"), [(0.001, "0.001"), (20.0, "20"), (1e-6, "10⁻⁶"), (1e4, "10⁴")])
    def test_powers_are_read_without_mathematics(self, value, text):
        assert power(value) == text

    @given(st.tuples(*[st.floats(0.0, 1.0)] * 3))
    def test_text_on_any_colour_can_be_read(self, colour):
        assert contrast(matplotlib.colors.to_rgb(readable(colour)), colour) >= 4.5


class TestMapOfWhatIsKnown:
    points, values = rng.normal(size=(30, 2)), rng.uniform(0, 0.5, 30)

    def test_what_is_known_least_lies_on_top(self):
        axes, bar = figures.known_map(self.points, self.values, self.points[:3], labels=("x", "y"), scale="spread").axes
        [drawn] = axes.collections
        np.testing.assert_allclose(drawn.get_array(), np.sort(self.values))
        assert drawn.get_clim() == (0.0, self.values.max())
        assert [text.get_text() for text in axes.texts] == ["1", "2", "3"]
        assert bar.get_ylabel() == "spread"

    def test_colours_do_not_end_before_the_top_that_is_asked_for(self):
        made = figures.known_map(self.points, self.values, self.points[:1], labels=("x", "y"), scale="", top=2.0)
        assert made.axes[0].collections[0].get_clim() == (0.0, 2.0)

    def test_directions_go_through_the_marked_points(self):
        marked, ways = self.points[:4], rng.normal(size=(4, 2))
        made = figures.known_map(self.points, self.values, marked, labels=("x", "y"), scale="", directions=ways)
        [ends] = lines(made, "to leave free")
        ends = ends.reshape(4, 3, 2)
        np.testing.assert_allclose(ends[:, :2].mean(axis=1), marked)
        drawn = ends[:, 1] - ends[:, 0]
        np.testing.assert_allclose(drawn[:, 0] * ways[:, 1], drawn[:, 1] * ways[:, 0], atol=1e-12)


class TestRatioTable:
    def test_cells_say_their_number_and_are_coloured_by_its_logarithm(self):
        values = np.array([[1.0, 0.01, np.nan], [1584.3, 3.98e6, 20.0]])
        axes = charts.ratio_table(["a", "b"], ["x", "y", "z"], values, top=10.0).axes[0]
        assert [text.get_text() for text in axes.texts] == ["1", "0.01", "", "1584", "4e6", "20"]
        found = np.ma.filled(axes.collections[0].get_array(), np.nan).reshape(2, 3)
        np.testing.assert_allclose(found, [[0, -1, np.nan], [1, 1, 1]])


def test_without_matplotlib_pictures_say_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.style", None)
    with pytest.raises(MissingExtraError, match=r"'matplotlib', which is not installed.*unconstrain\[viz\]"):
        figures.bars(["a"], {"direct": [1.0]}, title="", label="")


class TestCompact:
    """The same picture in fewer bytes."""

    @given(st.lists(st.tuples(st.sampled_from("MLQC"), st.lists(st.floats(-999, 999), min_size=6, max_size=6))))
    def test_a_path_ends_every_segment_where_it_did(self, drawn):
        segments = [
            ("M", [0.0, 0.0]),
            *((letter, at[: {"M": 2, "L": 2, "Q": 4, "C": 6}[letter]]) for letter, at in drawn),
        ]
        path = " ".join(letter + " " + " ".join(f"{value:f}" for value in at) for letter, at in segments)
        [short] = re.findall(r' d="([^"]*)"', compact(f'<path d="{path} z"/>'))
        found, at, letter = [], np.zeros(2), ""
        tokens = re.findall(r"[MlqcZz]|-?(?:\d+\.?\d*|\.\d+)", short)
        while tokens[0] != "z":
            letter = tokens.pop(0) if tokens[0].isalpha() else letter
            count = {"M": 2, "l": 2, "q": 4, "c": 6}[letter]
            points = np.array([float(tokens.pop(0)) for _ in range(count)]).reshape(-1, 2)
            at = (points if letter == "M" else at + points)[-1]
            found.append(at)
        wanted = [np.array(points[-2:]) for _, points in segments]
        np.testing.assert_allclose(found, wanted, atol=0.051)
        assert len(short) <= len(path) + 2

    def test_groups_that_say_nothing_go(self):
        assert compact('<g>\n<g data-key="a">\n<g>\n<path d="M 1 2 L 3 4"/>\n</g>\n</g>\n</g>') == (
            '\n<g data-key="a">\n<path d="M1 2l2 2"/>\n</g>\n'
        )


@pytest.mark.parametrize("size", [(300.0, 200.0, 150.0), (0.3, 0.2, 0.01), (30.0, 40.0, 50.0)])
def test_names_of_axes_in_space_lie_beyond_their_ticks(size):
    turn = np.linspace(0, 6, 200)
    track = np.column_stack([np.cos(turn), np.sin(turn), 0.3 * np.sin(2 * turn)]) * size
    made = figures.movements([("training", track)], labels=("x [mm]", "y [mm]", "z [mm]"))
    made.set_size_inches(660 / 72, 350 / 72)
    made.draw_without_rendering()
    for axis in (made.axes[0].xaxis, made.axes[0].yaxis, made.axes[0].zaxis):
        name, *ticks = (
            text.get_window_extent().get_points().mean(axis=0)
            for text in (axis.label, *(tick.label1 for tick in axis.get_major_ticks()))
        )
        assert min(np.linalg.norm(tick - name) for tick in ticks) > 17  # pixels

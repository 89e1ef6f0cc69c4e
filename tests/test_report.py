"""Reports can be read by people, in a browser and without a network, and by machines."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import unconstrain as uc
from recorded import needs_rim
from seen import coloured, on_a_phone, opened, unreadable, width_of
from unconstrain.base.errors import MissingExtraError, SettingError
from unconstrain.pages import fit, html
from unconstrain.paper import pages as report
from unconstrain.paper.experiments import figure4, figure5, table1, toy
from unconstrain.paper.experiments.trials import Result
from unconstrain.paper.pages import parts, washing_arm
from unconstrain.paper.systems.wiping import PLATES, Strokes, demonstrate

SMALL = {"demonstrations": 8, "steps": 10, "per_axis": 4, "folds": 4}
MADE_HERE = {
    "table1": lambda: table1.run(table1.Settings(**SMALL, trials=2)),
    "figure4": lambda: figure4.run(figure4.Settings(**SMALL, arrows=5)),
    "figure5": lambda: figure5.run(figure5.Settings(**SMALL, widest=(0.0, 0.5, 1.5), trials=2)),
    "of another kind": lambda: Result("else", Odd(), [{"method": "direct", "seen": True, "ncpe": 0.1, "nupe": None}]),
}


RESULTS = [*MADE_HERE, "table2", "washing"]


@dataclass(frozen=True)
class Odd:
    """Settings.

    Parameters
    ----------
    first, second : float
        Something with a :class:`~unconstrain.Hybrid` and <angles>,
        over two lines.
    """

    first: float = 0.5
    second: tuple[bool, str] = (True, "a")


def wiping(columns: slice = slice(None), times: bool = True) -> list[uc.Demonstration]:
    """As a user has it: without the truth."""
    demos = [
        demonstrate(plate, np.random.default_rng(at), strokes=Strokes(count=2, duration=4.0))
        for at, plate in enumerate(PLATES[:5])
    ]
    return [
        uc.Demonstration(one.states[:, columns], one.actions[:, columns], one.times if times else None, name=one.name)
        for one in demos
    ]


def plane() -> list[uc.Demonstration]:
    settings = toy.ToySettings(**SMALL)
    return toy.demonstrate(settings, np.random.default_rng(0), toy.random_lines)


def still() -> list[uc.Demonstration]:
    return [uc.Demonstration(np.zeros((4, 4)), np.zeros((4, 2)), name="still")]


FITS = {
    "in the plane": (uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 3), uc.Hybrid()), plane),
    "in space": (uc.LocallyLinearPolicy(), wiping),
    "in one dimension": (uc.ParametricPolicy(uc.Affine(), uc.Direct()), lambda: wiping(slice(1), times=False)),
    "that never moves": (uc.LocallyLinearPolicy(None, learner=uc.Inconsistency()), still),
}


@pytest.fixture(scope="session")
def results(once, washed, tabled):
    """Each result, computed when first asked for."""
    elsewhere = {"table2": tabled, "washing": washed}
    return lambda name: elsewhere[name]() if name in elsewhere else once(f"result {name}", MADE_HERE[name])


@pytest.fixture(scope="session")
def files(once, results):
    """Name and text of each file that is written of a result."""

    def written(name):
        with TemporaryDirectory() as folder:
            report.write(results(name), Path(folder) / "new" / "folder")
            return {path.name: path.read_text("utf-8") for path in (Path(folder) / "new" / "folder").iterdir()}

    return lambda name: once(f"files {name}", lambda: written(name))


@pytest.fixture(scope="session")
def pages(results, files):
    """The page of each result."""
    return lambda name: files(name)[f"{results(name).name}.html"]


def fit_page(name, title="A policy"):
    policy, demos = FITS[name][0], FITS[name][1]()
    return fit.policy_page(policy.fit_demonstrations(demos), demos, title)


class TestFiles:
    @pytest.mark.parametrize("name", RESULTS)
    def test_json_and_html_are_written(self, results, files, name):
        result = results(name)
        data, page = f"{result.name}.json", f"{result.name}.html"
        assert files(name).keys() == {data, page}
        assert json.loads(files(name)[data]) == json.loads(json.dumps(result.to_json()))

    def test_a_second_time_replaces_the_first(self, results, tmp_path):
        for _ in range(2):
            data, page = report.write(results("of another kind"), tmp_path)
            assert (data.name, page.name) == ("else.json", "else.html")
        assert sorted(tmp_path.iterdir()) == sorted([data, page])

    def test_what_is_not_finite_becomes_null(self, results, tmp_path):
        row = {"a": np.nan, "b": -np.inf, "c": np.float64(1.5), "d": np.arange(2), "e": (None, True), "f": np.int64(3)}
        data, _ = report.write(replace(results("of another kind"), rows=[row]), tmp_path)
        found = json.loads(data.read_text("utf-8"), parse_constant=pytest.fail)["rows"]
        assert found == [{"a": None, "b": None, "c": 1.5, "d": [0, 1], "e": [None, True], "f": 3}]

    def test_nothing_is_left_when_writing_fails(self, results, tmp_path, monkeypatch):
        def full(*_):
            raise OSError("no space left")

        monkeypatch.setattr(Path, "replace", full)
        with pytest.raises(OSError, match="no space"):
            report.write(results("of another kind"), tmp_path)
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize(
        ("name", "module"),
        [("of another kind", "jinja2"), ("table1", "jinja2")],
    )
    def test_without_the_extra_it_writes_the_numbers_and_says_what_to_install(
        self, results, tmp_path, monkeypatch, name, module
    ):
        html._templates.cache_clear()
        monkeypatch.setitem(sys.modules, module, None)
        missing = module.partition(".")[0]
        with pytest.raises(MissingExtraError, match=rf"'{missing}', which is not installed.*unconstrain\[viz\]"):
            report.write(results(name), tmp_path / "out")
        assert [path.suffix for path in (tmp_path / "out").iterdir()] == [".json"]


class TestRows:
    """What machines may rely on."""

    ERRORS = {f"{metric}_{what}" for metric in ("nupe", "ncpe", "ninc") for what in ("mean", "sd")}

    def rows(self, files, name):
        return json.loads(files(name)[f"{name}.json"])["rows"]

    def test_table1_has_a_row_for_each_method_and_constraint(self, files):
        rows = self.rows(files, "table1")
        assert len({(row["method"], row["constraint"]) for row in rows}) == len(rows) == 8
        for row in rows:
            assert row.keys() >= self.ERRORS | {f"paper_{name}" for name in self.ERRORS}

    def test_table1_is_in_plain_units(self, files):
        rows = self.rows(files, "table1")
        [row] = [row for row in rows if (row["method"], row["constraint"]) == ("hybrid", "random")]
        assert row["paper_nupe_mean"] == pytest.approx(0.00373)

    def test_figure5_has_a_row_for_each_method_and_angle(self, files):
        rows = self.rows(files, "figure5")
        assert {row["theta_max"] for row in rows} == {0.0, 0.5, 1.5}
        assert all(row.keys() >= self.ERRORS for row in rows)

    def test_washing_says_which_surfaces_were_seen(self, files):
        rows = self.rows(files, "washing")
        assert all(row.keys() >= {"method", "surface", "seen", "ncpe", "nupe"} for row in rows)
        assert sum(row["seen"] for row in rows) == 20
        assert sum(not row["seen"] for row in rows) == 8


class References(HTMLParser):
    """Everything a browser would fetch."""

    def __init__(self):
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in {"src", "href", "srcset", "data", "poster", "action"} and not (value or "").startswith("data:"):
                self.found.append(f"{tag} {name}={value}")


class TestPages:
    @pytest.mark.parametrize("name", RESULTS)
    def test_a_page_refers_to_nothing_outside_itself(self, pages, name):
        page = pages(name)
        references = References()
        references.feed(page)
        assert references.found == []
        style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)[1]
        assert "url(" not in style
        assert "@import" not in style

    def test_names_are_text_and_never_markup(self):
        evil = "<script>alert(1)</script>"
        demos = [replace(demo, name=evil) for demo in plane()]
        page = fit.policy_page(uc.ParametricPolicy().fit_demonstrations(demos), demos, evil)
        assert evil not in page
        assert "&lt;script&gt;alert(1)" in page

    def test_text_is_escaped_and_markup_is_not(self):
        assert html.section("a < b", html.paragraph("<i>")).split() == ["<h2>a", "&lt;", "b</h2>", "<p>&lt;i&gt;</p>"]
        assert "<p><i>&lt;b&gt;</i></p>" in html.paragraph(html.markup("<i>{}</i>").format("<b>"))

    def test_without_graphics_the_arm_is_drawn_as_lines(self, results, monkeypatch):
        def fail(*_):
            raise SettingError("no graphics")

        monkeypatch.setattr(washing_arm, "film", fail)
        page = report.page(results("washing"))
        assert "as lines" in page
        assert "<code>apt-get install libosmesa6</code>" in page

    def test_settings_are_explained_by_their_docstring(self, pages):
        page = pages("of another kind")
        assert "Something with a Hybrid and &lt;angles&gt;, over two lines." in page
        assert '<td class="left">yes, a</td>' in page

    def test_ours_is_beside_the_papers(self, pages):
        page = pages("table1")
        assert "58.3 ± 9.6" in page  # direct, random constraint, nUPE × 10⁻²
        assert "0.373 ± 1.1" in page

    @pytest.mark.parametrize("name", ["table1", "figure5"])
    def test_medians_stand_beside_means(self, results, pages, name):
        rows = [row | {"nupe_median": 0.0777, "ncpe_median": 0.0888} for row in results(name).rows]
        page = report.page(replace(results(name), rows=rows))
        for median in ("7.77", "8.88"):
            assert page.count(median) == len(rows)
            assert median not in pages(name)

    def test_arrows_that_were_cut_are_confessed(self, results):
        result = results("figure4")
        wild = {**result.details["none"]["fields"], "inconsistency": 1e6 * result.details["policy"] + 1e6}
        details = result.details | {"none": {**result.details["none"], "fields": wild}}
        assert "100% of inconsistency" in report.page(replace(result, details=details))

    def test_movements_that_leave_the_picture_are_named(self, results):
        result = results("washing")
        [split] = result.details["splits"]
        run = split.rollouts["direct"]
        away = replace(run, states=run.states + np.linspace(0, 10, len(run))[:, None])
        changed = replace(split, rollouts=split.rollouts | {"direct": away})
        details = {"splits": [changed], "reproductions": []}  # pictures of the arm take long
        page = report.page(replace(result, details=details))
        assert re.search(r"These left the picture: [^.]*direct after [\d.]+ s on \+16° about y", page)


class TestNumbers:
    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (0.0131, "0.0131"),
            (50217.0, "50200"),
            (58.338, "58.3"),
            (0.034, "0.034"),
            (1.0, "1"),
            (-0.5, "−0.5"),
            (0.99999, "1"),
            (1.234e-7, "1.23×10⁻⁷"),
            (9.999e-8, "1×10⁻⁷"),
            (7.4e7, "7.4×10⁷"),
            (0.0, "0"),
            (None, "–"),
            (np.nan, "–"),
            (np.inf, "–"),
        ],
    )
    def test_numbers_have_three_significant_digits(self, value, text):
        assert html.number(value) == text

    def test_mean_and_deviation_are_scaled_together(self):
        assert parts.mean_sd(0.00131, 0.00028) == "0.131 ± 0.028"
        assert parts.mean_sd(None, None) == "–"


class TestInABrowser:
    @pytest.mark.parametrize(
        ("name", "count"),
        [("table1", 2), ("table2", 4), ("figure4", 6), ("figure5", 5), ("washing", 16), ("of another kind", 0)],
    )
    def test_a_page_draws_all_its_pictures(self, pages, browser, tmp_path, name, count):
        assert len(opened(browser, pages(name), tmp_path)) == count

    @needs_rim
    def test_the_page_of_real_recordings_draws_all_its_pictures(self, washed_rim, browser, tmp_path):
        assert len(opened(browser, report.page(washed_rim), tmp_path)) == 2 + 2 + 1 + 4 * 4

    @pytest.mark.parametrize("name", FITS)
    def test_the_page_of_a_fit_draws_all_its_pictures(self, browser, tmp_path, name):
        assert len(opened(browser, fit_page(name), tmp_path)) >= 2

    def test_a_key_hides_its_traces_in_all_panels(self, pages, browser, tmp_path):
        opened(browser, pages("figure4"), tmp_path)
        hidden = "return [...document.querySelectorAll('[data-key=direct]')].map(g => g.style.display === 'none')"
        for expected in (True, False):
            browser.execute_script("document.querySelectorAll('.key button[value=direct]').forEach(one => one.click())")
            found = browser.execute_script(hidden)
            assert found == [expected] * len(found)
            assert len(found) >= 2

    def test_text_that_cannot_be_read_is_found(self, browser, tmp_path, pages):
        page = pages("table1").replace("--soft: #5c6570", "--soft: #9aa0a6")
        with pytest.raises(AssertionError, match="light"):
            opened(browser, page, tmp_path)
        with coloured(browser, "dark"):
            assert unreadable(browser) == []

    @pytest.mark.parametrize("name", ["table1", "figure5", "washing"])
    def test_a_page_fits_on_a_phone(self, pages, browser, tmp_path, name):
        with on_a_phone(browser, 400, 800):
            graphs = opened(browser, pages(name), tmp_path)
            assert width_of(browser) <= 400
            assert all(graph["wide"] <= 400 for graph in graphs)

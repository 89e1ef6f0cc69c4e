"""The page to play with: what it shows at first, what strokes do, by hand and by key; in Chromium."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from selenium.webdriver import ActionChains, Keys

import unconstrain as uc
from seen import on_a_phone, unnamed_canvases, width_of
from test_cli import refused, run

SIDE, WIDTH = 5, 0.8
"""Of the page's kernels."""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("play") / "play.html"
    said = run("play", "-o", path)
    assert said.startswith("✔ A page to draw on")
    assert said.endswith(f"page: {path}\n")
    return path


@pytest.fixture
def plate(page, browser):
    """The page, opened anew; at the end it has said nothing in the console."""
    browser.get_log("browser")
    browser.get(page.as_uri())
    yield browser
    assert not browser.get_log("browser")


def strokes(browser):
    """States, actions, wanted actions, and whose they are, of all strokes on the plate."""
    found = browser.execute_script("return plate.strokes.map((one) => [one.states, one.actions, one.wanted]);")
    groups = np.repeat(np.arange(len(found)), [len(one[0]) for one in found])
    return (*(np.concatenate([np.array(one[part]) for one in found]) for part in range(3)), groups)


def misses(browser):
    """The number of each learner, as a share."""
    script = (
        "return ['direct', 'hybrid', 'robust'].map((name) => document.getElementById(`${name}-number`).textContent);"
    )
    return [
        float(text.removeprefix("misses ").rstrip("\N{NO-BREAK SPACE} %")) / 100
        for text in browser.execute_script(script)
    ]


def set_to(browser, name, value):
    script = "const one = document.getElementById(arguments[0]); one.value = arguments[1];"
    browser.execute_script(f"{script} one.dispatchEvent(new Event('input'));", name, value)


def draw_circle(browser, radius):
    canvas = browser.find_element("id", "plate")
    scale = canvas.size["width"] / 2.16
    angles = np.linspace(0, 6, 40)
    around = np.rint(scale * radius * np.column_stack([np.cos(angles), -np.sin(angles)])).astype(int)
    chain = ActionChains(browser, duration=2).move_to_element_with_offset(canvas, *map(int, around[0])).click_and_hold()
    for step in np.diff(around, axis=0):
        chain.move_by_offset(*map(int, step))
    chain.release().perform()


def test_the_first_picture_tells_the_story(plate):
    direct, hybrid, robust = misses(plate)
    assert direct > 0.25
    assert hybrid < 0.15 * direct
    assert robust < 0.3 * hybrid
    assert plate.find_element("id", "verdict").text.startswith(f"Regression misses {100 * direct:.0f}")


def test_what_is_learnt_of_the_example_is_what_python_learns(plate):
    states, actions, wanted, groups = strokes(plate)
    learnt = plate.execute_script("return Object.entries(plate.learnt.weights).map(([k, w]) => [k, Array.from(w)]);")
    learners = {"direct": uc.Direct(), "robust": uc.Segments("groups"), "hybrid": uc.Hybrid()}
    shown = dict(zip(("direct", "hybrid", "robust"), misses(plate), strict=True))
    for name, weights in learnt:
        features = uc.NormalisedRBF.grid(-1, 1, SIDE, width=WIDTH)
        policy = uc.ParametricPolicy(features, learners[name], validation=uc.Folds(4))
        policy.fit(states, actions, groups=groups)
        expected = policy.solution_.weights[0].T.ravel()
        assert_allclose(weights, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max(), err_msg=name)
        error = ((policy(states) - wanted) ** 2).sum(axis=1).mean() / wanted.var(axis=0).sum()
        assert_allclose(shown[name], error, rtol=0.1)


def test_the_default_learner_says_which_way_it_took_and_what_others_miss(plate):
    ways = plate.execute_script("return plate.learnt.compared.ways.map((one) => [one.name, one.missed]);")
    missed, said = dict(ways), plate.find_element("id", "taken").text
    assert said.startswith(": rail by rail (")
    assert re.search(r"not regression \([\d.]+\s%\) or softened hybrid \([\d.]+\s%\)$", said)
    assert missed["segments"] == min(missed.values())
    plate.find_element("id", "clear").click()
    assert plate.find_element("id", "taken").text == ""


def test_the_first_click_after_drawing_by_keys_is_not_lost(plate):
    canvas, clear = plate.find_element("id", "plate"), plate.find_element("id", "clear")
    where = clear.rect["y"]
    canvas.send_keys(Keys.SPACE, *[Keys.ARROW_RIGHT] * 8, Keys.SPACE)
    assert plate.find_element("id", "hint").is_displayed()
    assert clear.rect["y"] == where
    clear.click()
    assert plate.execute_script("return plate.strokes.length") == 0
    assert not plate.find_element("id", "hint").is_displayed()


def test_a_rail_lets_through_what_runs_along_it(plate):
    set_to(plate, "noise", 0)
    _, actions, wanted, groups = strokes(plate)
    for group in range(groups.max() + 1):
        mine = groups == group
        rail = np.linalg.svd(actions[mine], full_matrices=False)[2][0]
        assert_allclose(actions[mine], np.outer(wanted[mine] @ rail, rail), atol=1e-9)


def test_a_stroke_drawn_by_hand_is_learnt_from(plate):
    before = len(set(strokes(plate)[3]))
    draw_circle(plate, 0.7)
    assert len(set(strokes(plate)[3])) == before + 1
    assert f"{before + 1} strokes" in plate.find_element("id", "strokes").text
    plate.find_element("id", "clear").click()
    assert plate.find_element("id", "verdict").text == "Nothing is drawn yet."
    draw_circle(plate, 0.5)
    states, _, wanted, groups = strokes(plate)
    assert set(groups) == {0}
    assert_allclose(np.linalg.norm(states, axis=1), 0.5, atol=0.03)
    assert_allclose(np.linalg.norm(wanted, axis=1), 1.0)


def test_learning_takes_a_moment(plate):
    for _ in range(4):
        plate.find_element("id", "example").click()
    taken = plate.execute_script("return performance.getEntriesByName('refit').map((one) => one.duration)")
    assert len(taken) == 5
    assert min(taken) < 100  # ms


def test_keys_draw_as_a_hand_does(plate):
    plate.find_element("id", "clear").click()
    canvas = plate.find_element("id", "plate")
    canvas.send_keys(Keys.SPACE, *[Keys.ARROW_RIGHT] * 8, *[Keys.ARROW_UP] * 6, Keys.SPACE)
    states, _, _, groups = strokes(plate)
    assert set(groups) == {0}
    assert_allclose(states[[0, -1]], [[0, 0], [0.32, 0.24]], atol=1e-6)
    canvas.send_keys(Keys.DELETE)
    assert plate.execute_script("return plate.strokes.length") == 0


def test_with_one_rail_nobody_can_tell(plate):
    set_to(plate, "range", 0)
    direct, hybrid, robust = misses(plate)
    assert min(hybrid, robust) > 0.7 * direct
    assert plate.find_element("id", "verdict").text.startswith("Nobody can tell yet")


def test_the_threshold_walks_from_the_arrows_to_regression(plate):
    direct = misses(plate)[0]
    top = int(plate.find_element("id", "split").get_attribute("max"))
    walked = []
    for split in (0, top // 2, top):
        set_to(plate, "split", split)
        walked.append(misses(plate)[1])
    assert walked[0] < walked[1] <= walked[2]
    assert walked[2] == direct
    assert f"0 of {top} directions" in plate.find_element("id", "split-says").text
    plate.find_element("id", "auto").click()
    assert misses(plate)[1] < 0.15 * direct


def test_the_truth_can_be_hidden(plate):
    plate.find_element("id", "truth").click()
    assert plate.find_element("id", "direct-number").text == "misses ?"
    assert "Which of the three" in plate.find_element("id", "verdict").text


def test_it_fits_a_phone_and_names_every_picture(plate):
    with on_a_phone(plate, 360, 740, scale=2):
        assert width_of(plate) <= 360
        assert unnamed_canvases(plate) == 0


def test_the_page_is_small_and_is_not_written_over(page):
    assert page.stat().st_size < 100_000
    assert "--force to replace it" in refused("play", "-o", page)

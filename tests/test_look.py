"""The page of demonstrations: in space, in time, with a policy and a constraint; in Chromium."""

import contextlib
import json
import re
import shlex

import numpy as np
import pytest
from numpy.testing import assert_allclose
from selenium.webdriver import ActionChains, Keys

import unconstrain as uc
from seen import coloured, on_a_phone, unnamed_canvases, width_of
from test_cli import call, refused, run, write
from test_one_model import FEATURES, of_one_model
from unconstrain.pages.look import look_page, marks_of

NAMES = ("x", "y", "z")


def wipes(count=4, samples=120, dimensions=3):
    """Movements on planes of other tilts, the second of which has a gap and the third a pause."""
    files = []
    for index in range(count):
        time = np.linspace(0, 4, samples)
        x, y = np.cos(2 * time + index), np.sin(2 * time + index)
        columns = [x, y, 0.3 * (index - 1.5) * x, 0.1 * time]
        if index == 2:
            columns = [
                np.where(np.arange(samples) < 50, c, c[np.maximum(np.arange(samples) - 30, 49)]) for c in columns
            ]
        table = np.column_stack([time, *columns[:dimensions]])
        files.append(np.delete(table, slice(60, 80), axis=0) if index == 1 else table)
    return files


def bent():
    """Ovals on a plate that is bent along its middle: one half is always level, the other in each at another tilt."""
    rng, times = np.random.default_rng(0), np.arange(0, 8, 0.02)
    for tilt in np.linspace(-1.0, 1.0, 6):
        x, y = 0.8 * np.cos(1.5 * times + tilt), 0.4 * np.sin(1.5 * times + tilt)
        track = np.column_stack([x, y, tilt * np.maximum(x, 0.0)])
        yield np.column_stack([times, track + 1e-3 * rng.standard_normal(track.shape)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings, a policy and a constraint learnt from them, and the page of all."""
    place = tmp_path_factory.mktemp("look")
    for index, table in enumerate(wipes()):
        np.savetxt(place / f"wipe_{index}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    files = sorted(place.glob("wipe_?.csv"))
    reading = ("--state", "x,y,z", "--differentiate")
    run("fit", *files, *reading, "-o", place / "policy.npz")
    run("constraint", files[0], *reading, "-o", place / "constraint.npz")
    said = run("look", *files, *reading, place / "policy.npz", place / "constraint.npz", "-o", place / "look.html")
    (place / "said.txt").write_text(said, "utf-8")
    return place


@pytest.fixture
def page(folder, browser):
    """The page, opened anew; at the end it has said nothing in the console."""
    yield from opened(browser, folder / "look.html")


def opened(browser, path):
    browser.get_log("browser")
    browser.get(path.as_uri())
    yield browser
    assert not browser.get_log("browser")


def text(browser, name):
    return browser.find_element("id", name).text


def test_numbers_arrive_as_they_were(folder, page):
    found = page.execute_script(
        "return look.demos.map((one) => [Array.from(one.times), one.states.map((c) => Array.from(c))])"
    )
    assert len(found) == 4
    for index, (times, states) in enumerate(found):
        table = np.loadtxt(folder / f"wipe_{index}.csv", delimiter=",", skiprows=1)
        if index != 2:  # whose pause is left out
            assert_allclose(times, table[:, 0], atol=1e-3)
            assert_allclose(states, table[:, 1:].T, atol=1e-4)


@pytest.mark.parametrize("absent", [40, 6])
def test_a_gap_is_told_once_and_shown_where_it_is(absent):
    times = np.delete(3 + np.arange(120) * 0.01, slice(40, 40 + absent))
    recording = uc.Recording(("x", "y"), np.column_stack([np.sin(times), np.cos(times)]), times)
    recipe = uc.Recipe(states=("x", "y"), differentiate="central")
    with pytest.warns(uc.preparation.PreparationWarning) if absent > 4 else contextlib.nullcontext():
        [demonstration] = uc.prepare(recording, recipe)
    [found] = uc.preparation.survey_set([recording], recipe)
    marks = [one for one in marks_of(recording, found, demonstration) if "gap" in one.code]
    assert [one.code for one in marks if one.message] == ["clock-gap"]
    assert [one.start for one in marks if one.length] == [pytest.approx(0.39)]
    assert all(one.start is None for one in marks if not one.length)


def test_the_first_lines_say_what_is_there_and_what_is_odd(folder, page):
    assert text(page, "summary").startswith("4 demonstrations, ")
    said, verdict = " ".join((folder / "said.txt").read_text("utf-8").split()), text(page, "verdict")
    assert verdict.startswith("! ")
    assert said.startswith(verdict.removesuffix(" What is marked is listed below."))
    assert "constraint: of wipe_0, and drawn there alone" in said
    rest = page.execute_script("return [...document.getElementById('rest').children].map((one) => one.textContent)")
    assert rest[::2] == [name for name in ("Trust", "Do not trust", "Next") if f"{name}: " in said]
    assert all(f"{name}: {one}" in said for name, one in zip(rest[:-2:2], rest[1:-2:2], strict=True))
    assert rest[-1].startswith("Tilt the plane, and begin at the next start")  # the page is open by now
    near = page.execute_script("return shown.patches.map((one) => one.at)")
    drawn = np.loadtxt(folder / "wipe_0.csv", delimiter=",", skiprows=1)[:, 1:]
    assert np.abs(np.array(near)[:, None] - drawn).max(axis=2).min(axis=1).max() < 0.02
    notes = text(page, "notes")
    assert "clock-gap: wipe_1: 1 gap in the time stamps, the longest 0.706 s after 1.98319 s" in notes
    assert notes.count("gap: wipe_1") == 1
    assert notes.count("pause: wipe_2") == 1
    assert "dashes: gap" in text(page, "time-says")


def test_a_demonstration_is_left_out_by_its_tick_and_by_a_click_in_the_scene(folder, page):
    assert text(page, "command").endswith("--state x,y,z --differentiate -o policy.npz")
    page.find_element("id", "demo-3").click()
    assert "--leave-out wipe_3 -o policy.npz" in text(page, "command")
    x, y = page.execute_script(
        "const d = look.demos[1]; return look.project(look.axes.map((k) => d.states[k][10])).map(Math.round);"
    )
    canvas = page.find_element("id", "scene")
    half = canvas.size["width"] / 2, canvas.size["height"] / 2
    ActionChains(page).move_to_element_with_offset(canvas, x - int(half[0]), y - int(half[1])).click().perform()
    out = [index for index, one in enumerate(page.execute_script("return look.demos.map((d) => d.kept)")) if not one]
    assert len(out) == 2
    command = text(page, "command")
    assert f"--leave-out wipe_{out[0]},wipe_{out[1]}" in command
    told = shlex.split(command)[1:]
    done = call(*told[:-1], folder / "again.npz", "--force")
    assert done.code == 0
    assert "2 demonstrations" in done.out


def test_the_roll_out_in_the_page_is_that_of_python(folder, page):
    policy = uc.load(folder / "policy.npz")
    page.find_element("id", "plane").click()
    script = "const one = document.getElementById('tilt'); one.value = 30; one.dispatchEvent(new Event('input'));"
    page.execute_script(script)
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]));")
    track, times = map(np.array, page.execute_script("return [look.roll.track, look.roll.times]"))
    plane = uc.constraints.Plane(np.array([np.sin(np.pi / 6), 0.0, np.cos(np.pi / 6)]))
    expected = uc.rollout(policy, track[0], 1600, float(times[-1]) / 1600, plane)  # Euler
    along = np.column_stack([np.interp(expected.times[::4], times, column) for column in track.T])
    assert_allclose(along, expected.states[::4], atol=0.03)
    assert_allclose((track - track[0]) @ plane.normal, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "policy",
    [uc.LocallyLinearPolicy(), uc.ParametricPolicy(uc.KMeansRBF(6)), uc.ParametricPolicy(uc.Polynomial(2))],
    ids=["local", "rbf", "quadratic"],
)
def test_what_no_recording_tells_is_what_python_says(browser, tmp_path, policy):
    demos = [uc.Demonstration(one[:, 1:], np.gradient(one[:, 1:], one[:, 0], axis=0), one[:, 0]) for one in bent()]
    policy.learner = uc.NoiseCorrected()
    assert_untold(policy.fit_demonstrations(demos), demos, browser, tmp_path)


@pytest.mark.parametrize("kind", FEATURES)
def test_what_no_recording_tells_of_one_model_is_what_python_says(browser, tmp_path, kind):
    demos = [uc.Demonstration(one[:, 1:], np.gradient(one[:, 1:], one[:, 0], axis=0), one[:, 0]) for one in bent()]
    with of_one_model(FEATURES[kind]):
        policy = uc.LocallyLinearPolicy(learner=uc.NoiseCorrected()).fit_demonstrations(demos)
    assert_untold(policy, demos, browser, tmp_path)


def assert_untold(policy, demos, browser, tmp_path):
    path, states = tmp_path / "look.html", demos[0].states[::20] * 1.3
    path.write_text(look_page(demos, NAMES, "told", policy=policy), "utf-8")
    way = np.array([0.6, 0.0, 0.8])
    left = np.broadcast_to(np.eye(3) - np.outer(way, way), (len(states), 3, 3))
    for page in opened(browser, path):
        for normal, projections, typical in ((None, None, 1.0), (way.tolist(), left, 0.5), (None, None, 1e-3)):
            script = "return arguments[0].map((state) => untold.at(state, arguments[1], arguments[2]))"
            found = page.execute_script(script, states.tolist(), normal, typical)
            expected = uc.evaluation.diagnosis.untold_at(policy, states, typical, projections)
            assert_allclose(found, expected, rtol=1e-3)
            assert any(expected)


def test_commands_and_pages_say_the_same_share_of_the_same_files(browser, tmp_path):
    for k, table in enumerate(bent()):
        np.savetxt(tmp_path / f"{k}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    files = sorted(tmp_path.glob("?.csv"))
    model = ("--variance", 0.12)  # in narrower fields no state of most of a movement is told
    run("fit", *files, "--state", "x,y,z", "--differentiate", *model, "-o", tmp_path / "p.npz")
    looked = call("look", *files, tmp_path / "p.npz", "-o", tmp_path / "look.html").out
    share = re.search(r"at (\d+%) of the recorded states no recording tells the policy", " ".join(looked.split()))[1]
    diagnosed = run("diagnose", *files, "--state", "x,y,z", "--differentiate", *model, "--json")
    determined = json.loads(diagnosed)["states_determined"]
    assert share == f"{1 - determined:.0%}"
    for told in (run("info", tmp_path / "p.npz"), run("export", tmp_path / "p.npz", "-o", tmp_path / "p.c")):
        assert f"at {share} of the recorded states no recording tells the policy" in " ".join(told.split())
    start = ",".join(map(str, np.loadtxt(files[0], delimiter=",", skiprows=1)[0, 1:]))
    how = ("--start", start, "--dt", 0.02, "--steps", 400, "--method", "rk4", "-o", tmp_path / "path.csv")
    rolled = " ".join(run("rollout", tmp_path / "p.npz", *how).split())
    for page in opened(browser, tmp_path / "look.html"):
        said = text(page, "policy-says").replace(" %", "%")
    shares = [re.search(r"(\d+)% of the time", one) for one in (rolled, said)]
    assert "where it is thin, fewer than 3 tell the policy" in said
    assert 5 < int(shares[0][1]) < 95
    assert abs(int(shares[0][1]) - int(shares[1][1])) <= 2


def test_the_start_is_dragged_and_the_scene_is_turned(page):
    canvas = page.find_element("id", "scene")
    half = np.array([canvas.size["width"] / 2, canvas.size["height"] / 2])
    before = page.execute_script("return [look.view.yaw, look.roll.start]")
    ring = np.array(page.execute_script("return look.project(look.roll.start)"))
    chain = ActionChains(page).move_to_element_with_offset(canvas, *map(int, ring - half))
    chain.click_and_hold().move_by_offset(40, -25).release().perform()
    yaw, start = page.execute_script("return [look.view.yaw, look.roll.start]")
    assert yaw == before[0]
    assert np.linalg.norm(np.subtract(start, before[1])) > 0.05
    assert_allclose(page.execute_script("return look.project(look.roll.start)"), np.add(ring, [40, -25]), atol=1.5)
    page.execute_script("look.roll.start = [9, 9, 9]; window.dispatchEvent(new Event('resize'));")
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]));")
    assert "No demonstration passes near for 100 % of the time, first at 0 s, where it is grey and dashed" in text(
        page, "policy-says"
    )
    assert text(page, "policy-says").startswith("The thick line: ")  # black by day, white by night
    canvas.send_keys(Keys.ARROW_LEFT)
    assert page.execute_script("return look.view.yaw") != yaw


def test_a_dozen_demonstrations_have_a_colour_each_by_day_and_by_night(browser, tmp_path):
    times = 0.1 * np.arange(20)
    for index in range(12):
        table = np.column_stack([times, np.cos(times + index), np.sin(times)])
        np.savetxt(tmp_path / f"{index}.csv", table, delimiter=",", header="t,x,y", comments="")
    run("look", *tmp_path.glob("*.csv"), "--differentiate", "-o", tmp_path / "look.html")
    for scheme in ("light", "dark"):
        with coloured(browser, scheme):
            for shown in opened(browser, tmp_path / "look.html"):
                fills = shown.execute_script("return look.demos.map((one) => one.swatch.style.fill)")
                assert len(set(fills)) == 12


def test_every_colour_and_time_can_be_shown(page):
    for name in ("speed", "free", "regions", "demonstration"):
        change = "const one = document.getElementById('colour'); one.value = arguments[0];"
        page.execute_script(f"{change} one.dispatchEvent(new Event('change'));", name)
        assert text(page, "legend")
    free = page.execute_script("return Array.from(look.demos[0].free)")
    assert 0 <= min(free) <= max(free) <= 1
    page.execute_script(
        "const one = document.getElementById('now'); one.value = 500; one.dispatchEvent(new Event('input'));"
    )
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]));")
    assert text(page, "now-says") == "2 s"


@pytest.mark.parametrize("tilts", [(30, 30, 30), (10, 20, 30)])
def test_the_plane_begins_as_that_of_the_recordings_where_all_are_in_one(browser, tmp_path, tilts):
    times, files = np.arange(0, 4, 0.05), []
    for index, tilt in enumerate(np.radians(tilts)):
        x, y = np.exp(-0.5 * times) * np.cos(times + index), np.exp(-0.5 * times) * np.sin(times + index)
        table = np.column_stack([times, np.cos(tilt) * x, y, -np.sin(tilt) * x])
        files.append(write(tmp_path / f"{index}.csv", "t,x,y,z", table))
    policy, page = tmp_path / "p.npz", tmp_path / "look.html"
    run("fit", *files, "--model", "affine", "--learner", "direct", "-o", policy)
    run("look", *files, policy, "-o", page)
    for seen in opened(browser, page):
        roll = seen.execute_script("return look.roll")
        begins = (True, 30, 0) if len({*tilts}) == 1 else (False, 0, 0)
        assert (roll["plane"], roll["tilt"], roll["turn"]) == begins
        assert seen.find_element("id", "plane").is_selected() is begins[0]
        assert seen.find_element("id", "tilt").get_attribute("value") == f"{begins[1]}"
        assert text(seen, "tilt-says") == f"{begins[1]}°"


@pytest.mark.parametrize("unit", ["px", "mm"])
def test_what_was_drawn_on_a_screen_is_shown_as_there(browser, tmp_path, unit):
    times = np.arange(0, 4, 0.05)
    table = np.column_stack([times, 300 + 100 * np.cos(times), 200 + 100 * times])
    files = [write(tmp_path / f"{k}.csv", f"t,x [{unit}],y [{unit}]", np.add(table, [0, k, k])) for k in range(3)]
    run("look", *files, "-o", tmp_path / "look.html")
    for seen in opened(browser, tmp_path / "look.html"):
        upper, lower = seen.execute_script("return [[300, 200], [300, 600]].map((point) => look.project(point)[1])")
        assert (upper < lower) is (unit == "px")
        assert ("points downwards, as on a screen" in text(seen, "legend")) is (unit == "px")


def test_a_gap_in_time_alone_is_no_reason_to_doubt(tmp_path):
    for index, table in enumerate(wipes(4)[:2] + wipes(4)[3:]):
        write(tmp_path / f"{index}.csv", "t,x,y,z", table)
    asked = (tmp_path / "*.csv", "--by", "savgol")
    for command in (("inspect", *asked), ("look", *asked, "-o", tmp_path / "look.html")):
        assert run(*command).startswith("✔ 3 demonstrations, nothing odd but gaps in time, which nothing is smoothed")
    rests = wipes(4)[2]
    write(tmp_path / "3.csv", "t,x,y,z", rests)
    assert run("inspect", *asked).startswith("! 1 of 4 demonstrations not as it should be: ")


@pytest.mark.parametrize(("tilts", "mark"), [((0.0,) * 4, "!"), ((0.5, -0.5, 0.3, -0.2), "✔")])
def test_it_agrees_with_diagnose_and_leaves_to_it_what_recordings_tell(tmp_path, tilts, mark):
    time = np.linspace(0, 4, 60)
    for k, tilt in enumerate(tilts):
        x, y = np.cos(2 * time + k) + 0.1 * k, np.sin(2 * time + k)
        table = np.column_stack([time, x, y, tilt * (x if k % 2 else y)])
        np.savetxt(tmp_path / f"wipe_{k}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    files = sorted(tmp_path.glob("wipe_?.csv"))
    said = run("look", *files, "-o", tmp_path / "a.html")
    whole = " ".join(said.split())
    assert said.startswith(f"{mark} 4 demonstrations, nothing odd: ready to learn from.")
    assert "'unconstrain diagnose' judges what recordings tell of a policy." in whole
    flat = "All demonstrations lie on one plane or parallel ones"
    judged = " ".join(run("diagnose", *files, "--model", "affine").split())
    assert [flat in whole, flat in judged, judged.startswith("✖")] == [mark == "!"] * 3


def test_regions_count_demonstrations_not_samples(browser, tmp_path):
    ways = np.linspace(0, 1, 50)[:, None] * [1.0, 0.0], np.linspace(0, 0.5, 80)[:, None] * [1.0, 0.0]
    demos = [uc.Demonstration(way, np.ones((len(way), 2))) for way in ways]
    path = tmp_path / "look.html"
    path.write_text(look_page(demos, ("x", "y"), "two"), "utf-8")
    for page in opened(browser, path):
        first, second = page.execute_script("return look.demos.map((one) => Array.from(one.regions))")
        assert_allclose(first, np.where(ways[0][:, 0] < 0.551, 2, 1))  # a twentieth of the extent is near
        assert_allclose(second, 2)


@pytest.mark.parametrize("dimensions", [1, 2, 4])
def test_it_shows_any_number_of_states(browser, tmp_path, dimensions):
    demos = []
    for index, table in enumerate(wipes(3, dimensions=dimensions)):
        states = table[:, 1:]
        demos.append(
            uc.Demonstration(
                states, np.gradient(states, axis=0), table[:, 0] if dimensions > 1 else None, name=f"</script>{index}"
            )
        )
    policy = uc.LocallyLinearPolicy(None, learner=uc.Direct()).fit_demonstrations(demos)
    path = tmp_path / "look.html"
    path.write_text(look_page(demos, [f"q{k}" for k in range(dimensions)], "<i>many</i>", policy=policy), "utf-8")
    for page in opened(browser, path):
        assert page.find_element("tag name", "h1").text == "<i>many</i>"
        assert len(page.find_elements("css selector", "#list li")) == 3
        assert len(page.execute_script("return look.roll.track")) > 1
        selects = page.find_elements("css selector", "#axes select")
        assert len(selects) == (3 if dimensions == 4 else 0)
        for one in selects:
            one.find_elements("tag name", "option")[-1].click()


def test_a_policy_that_cannot_be_rolled_out_says_why(browser, tmp_path):
    demos = [uc.Demonstration(table[:, 1:], table[:, 1:2], table[:, 0]) for table in wipes(3)]
    policy = uc.ParametricPolicy(uc.Affine(), uc.Direct()).fit_demonstrations(demos)
    path = tmp_path / "look.html"
    path.write_text(look_page(demos, NAMES, "one action", policy=policy), "utf-8")
    for page in opened(browser, path):
        assert "1 actions for 3 states" in text(page, "policy-says")


def test_a_page_of_much_data_is_small_and_drawn_soon(browser, tmp_path):
    rng = np.random.default_rng(0)
    demos = [
        uc.Demonstration(np.cumsum(rng.standard_normal((2000, 3)), axis=0), np.ones((2000, 3)), np.arange(2000) / 100)
        for _ in range(8)
    ]
    path = tmp_path / "look.html"
    path.write_text(look_page(demos, NAMES, "much"), "utf-8")
    assert path.stat().st_size < 400_000
    for page in opened(browser, path):
        assert (
            page.execute_script("return performance.getEntriesByName('drawn')[0].startTime") < 2000 * 3
        )  # shared machine


def test_it_fits_a_phone_and_names_what_it_draws(page):
    with on_a_phone(page, 360, 740, scale=2):
        assert width_of(page) <= 360
        assert unnamed_canvases(page) == 0


def test_without_a_recording_there_is_nothing_to_look_at(folder, tmp_path):
    assert "holds no recording to look at" in refused("look", folder / "policy.npz", "-o", tmp_path / "look.html")
    assert "--force to replace it" in refused("look", folder / "wipe_0.csv", "-o", folder / "look.html")
    assert not list(tmp_path.iterdir())

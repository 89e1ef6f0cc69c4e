"""What people see and what robots run: pages in Chromium, and exported code against Python.

Needs chromium with its driver and a compiler: ``scripts/install-system browser compiler``.
"""

from __future__ import annotations

import ctypes
import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from click.testing import CliRunner
from selenium.webdriver import ActionChains
from table import Row, row, script

import unconstrain as uc
from unconstrain.base.arrays import Array
from unconstrain.cli import main as command

sys.path.append(str(Path(__file__).parents[1] / "tests"))
import seen
import test_ros2

STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Werror")

DRAWN = """
const done = arguments[arguments.length - 1];
requestAnimationFrame(() => setTimeout(() => done(performance.now() / 1000)));
"""
"""Seconds from the start of the navigation to after the frame in which the page was first drawn."""


def ran(*arguments: object) -> None:
    """Run a command line in this process; raises where it does not end well."""
    result = CliRunner().invoke(command, [str(one) for one in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output


def reaches(folder: Path, count: int, samples: int) -> Path:
    """Demonstrations in three dimensions, a file each: movements to a goal along planes of their own."""
    rng = np.random.default_rng(4)
    for index in range(count):
        plane = uc.constraints.Plane(normal=rng.normal(size=3))
        demo = uc.rollout(lambda x: -x, rng.normal(size=3), samples, 4.0 / samples, plane)
        table = np.column_stack([np.arange(samples) * 4.0 / samples, demo.states])
        np.savetxt(folder / f"reach_{index}.csv", table, delimiter=",", header="t,x,y,z", comments="")
    return folder


def look(driver: Any, folder: Path) -> Iterator[Row]:
    """Eight demonstrations of 2,000 samples, in three dimensions."""
    (folder / "shown").mkdir()
    page = folder / "look.html"
    ran("look", reaches(folder / "shown", 8, 2000), "--differentiate", "-o", page)
    yield row("look, 8 × 2,000 samples in 3-D: page", page.stat().st_size / 1e3, "kB", 1500, 400)
    driver.get(page.as_uri())
    yield row("look: first picture in Chromium", driver.execute_async_script(DRAWN), "s", 2.0, 1.0)
    yield row("look: texts of too little contrast", len(seen.unreadable(driver)), "", 0, 0)
    yield row("look: severe messages in the console", severe(driver), "", 0, 0)


def severe(driver: Any) -> int:
    """Errors that the page has told the console."""
    return sum(entry["level"] == "SEVERE" for entry in driver.get_log("browser"))


def play(driver: Any, folder: Path) -> Iterator[Row]:
    """Strokes of some 200 samples, drawn by hand; the three learners learn anew after each."""
    page = folder / "play.html"
    ran("play", "-o", page)
    driver.get(page.as_uri())
    yield row("JavaScript against Python, fit: weights, relative to the largest", fitted(driver), "", 1e-6)
    canvas = driver.find_element("id", "plate")
    driver.execute_script("performance.clearMeasures('refit');")
    for radius in (0.4, 0.6, 0.8):
        circle(driver, canvas, radius * canvas.size["width"] / 2.16)
    refits = driver.execute_script("return performance.getEntriesByName('refit').map(one => one.duration);")
    samples = driver.execute_script("return plate.strokes.slice(-3).map(one => one.states.length);")
    yield row("play: samples of a stroke", float(np.median(samples)), "")
    yield row("play: three learners learn anew", float(np.median(refits)), "ms", 100.0, 16.0)
    yield row("play: severe messages in the console", severe(driver), "", 0, 0)


def fitted(driver: Any) -> float:
    """By how much the page's weights are off Python's, of three learners of its example, relative to the largest."""
    strokes = driver.execute_script("return plate.strokes.map((one) => [one.states, one.actions]);")
    weights = "const { weights: { direct, hybrid }, compared: { ways } } = plate.learnt;"
    learnt = f"{weights} return [direct, hybrid, ways[ways.length - 1].weights].map((one) => Array.from(one));"
    states, actions = (np.concatenate([np.array(one[part]) for one in strokes]) for part in range(2))
    groups, off = np.repeat(np.arange(len(strokes)), [len(one[0]) for one in strokes]), []
    for found, learner in zip(
        driver.execute_script(learnt), (uc.Direct(), uc.Hybrid(), uc.Segments("groups")), strict=True
    ):
        policy = uc.ParametricPolicy(uc.NormalisedRBF.grid(-1, 1, 5, width=0.8), learner, validation=uc.Folds(4))
        expected = policy.fit(states, actions, groups=groups).solution_.weights[0].T.ravel()
        off.append(np.abs(found - expected).max() / np.abs(expected).max())
    return float(max(off))


def circle(driver: Any, canvas: Any, radius: float) -> None:
    """Draw one, slowly."""
    angles = np.linspace(0.0, 6.0, 220)
    points = np.rint(radius * np.column_stack([np.cos(angles), -np.sin(angles)])).astype(int)
    chain = ActionChains(driver, duration=2).move_to_element_with_offset(canvas, *map(int, points[0])).click_and_hold()
    for step in np.diff(points, axis=0):
        chain.move_by_offset(*map(int, step))
    chain.release().perform()


def reports(driver: Any, folder: Path) -> Iterator[Row]:
    """The pages of ``fit``, ``diagnose`` and ``constraint`` about the recordings of the example, and of the paper's."""
    ran("example", folder / "wiping")
    strokes, policy = folder / "wiping", folder / "policy.npz"
    asked: dict[str, Sequence[object]] = {
        "fit": ("fit", strokes, "-o", policy, "--report", folder / "fit.html"),
        "diagnose": ("diagnose", strokes, "--report", folder / "diagnose.html"),
        "constraint": ("constraint", strokes, "-o", folder / "held.npz", "--report", folder / "constraint.html"),
        "washing": ("demo", "--out", folder),
        "table1": ("reproduce", "table1", "--trials", 4, "--workers", 1, "--out", folder),
        "figure4": ("reproduce", "figure4", "--workers", 1, "--out", folder),
        "figure5": ("reproduce", "figure5", "--trials", 2, "--workers", 1, "--out", folder),
    }
    faults: Counter[str] = Counter()
    for name, arguments in asked.items():
        ran(*arguments)
        page = folder / f"{name}.html"
        yield row(f"page of {name}", page.stat().st_size / 1e3, "kB", 1000, 300)
        driver.get(page.as_uri())
        labels = [graph["label"] for graph in driver.execute_script(seen.GRAPHS)]
        faults["things without a name"] += len(driver.execute_script(seen.UNNAMED))
        faults["pictures whose text has no number"] += sum(not re.search(r"\d", label) for label in labels)
        faults["tables with columns out of sight"] += len(driver.execute_script(seen.CUT_OFF))
        for scheme in ("light", "dark"):
            with seen.coloured(driver, scheme):
                faults[f"texts of too little contrast, {scheme}"] += len(seen.unreadable(driver))
        faults["severe messages in the console"] += severe(driver)
    yield from (row(f"pages of reports: {name}", count, "", 0, 0) for name, count in faults.items())


def javascript(driver: Any, folder: Path) -> Iterator[Row]:
    """An exported policy in a page, against Python."""
    policy, states, _ = test_ros2.learnt(3)
    policy.export_javascript(folder / "policy.js")
    module = (folder / "policy.js").read_text("utf-8") + "\nwindow.found = states.map(policy);"
    given = f"const states = {json.dumps(states.tolist())};"
    page = folder / "module.html"
    page.write_text(f'<!doctype html><meta charset="utf-8"><script type="module">{given}\n{module}</script>')
    driver.get(page.as_uri())
    expected = policy(states)
    off = np.abs(np.array(driver.execute_script("return window.found")) - expected).max() / np.abs(expected).max()
    yield row("JavaScript against Python, prediction", off, "", 1e-9)


def compiled(folder: Path) -> Iterator[Row]:
    """Two policies in one program, as C99 and as C++11 with all warnings; and in single precision."""
    first, states, notes = test_ros2.learnt(7)
    second = test_ros2.learnt(3)[0]
    warned = 0
    for name, policy, single in (("one", first, False), ("other", second, False), ("short", first, True)):
        policy.export_c(folder / f"{name}.c", single=single)
    for compiler in (("gcc", "-std=c99"), ("g++", "-std=c++11", "-x", "c++")):
        for name in ("one", "other", "short"):
            line = [*compiler, *STRICT, "-c", f"{name}.c", "-o", f"{name}.o"]
            warned += subprocess.run(line, cwd=folder, check=False).returncode != 0
    yield row("C: files with warnings, C99 and C++11", warned, "", 0, 0)
    objects = ["one.o", "other.o", "short.o"]
    linked = subprocess.run(["g++", "-shared", "-fPIC", *objects, "-o", "all.so"], cwd=folder, check=False)
    yield row("C: policies that cannot be linked together", float(linked.returncode != 0), "", 0, 0)
    near = states[first.support(states) > 0.05]
    off = np.abs(single_precision(folder / "short.c", near) - first(near)).max() / np.abs(first(near)).max()
    yield row("C: single precision against Python, relative to the largest action", off, "", 1e-5)
    drive = test_ros2.node_of(first, notes, folder)
    lines = [test_ros2.NAMES, test_ros2.state(states[0]), "time 20000"]
    answers = drive(*lines, parameters=test_ros2.REAL_TIME)[1]
    yield row("ROS 2 node, message in to command out, seven joints", int(answers[-1]) / 1e3, "µs", 50.0, 10.0)


def single_precision(path: Path, states: Array) -> Array:
    """What an exported C file says at some states, (N, d)."""
    library = path.with_suffix(".so")
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", path, "-lm", "-o", library], check=True)
    policy = ctypes.CDLL(str(library)).short_step
    given, said = states.astype(np.float32), np.empty((len(states), states.shape[1]), np.float32)
    for x, u in zip(given, said, strict=True):
        policy(x.ctypes.data_as(ctypes.c_void_p), u.ctypes.data_as(ctypes.c_void_p))
    return said.astype(np.float64)


def main() -> list[Row]:
    """Everything once."""
    rows: list[Row] = []
    with TemporaryDirectory() as name, TemporaryDirectory() as own, seen.chromium(own) as driver:
        folder = Path(name)
        for each in (look, play, reports, javascript):
            rows += each(driver, folder)
        rows += compiled(folder)
    return rows


if __name__ == "__main__":
    script(main)

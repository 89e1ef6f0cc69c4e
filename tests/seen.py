"""What people see: pages, opened in a browser by day and by night, and what commands print."""

import shutil
from collections.abc import Sequence
from contextlib import contextmanager

import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

GRAPHS = """
return [...document.querySelectorAll("figure svg[role=img]")].map(graph => ({
  id: graph.closest("figure").id, label: graph.getAttribute("aria-label"),
  drawn: graph.querySelectorAll("path, use, image").length,
  wide: graph.getBoundingClientRect().width, high: graph.getBoundingClientRect().height,
}));
"""

TEXTS = """
document.querySelectorAll("details").forEach(one => one.open = true);
const clear = "rgba(0, 0, 0, 0)", walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = {};
const behind = one => {
  for (; one; one = one.parentElement) {
    const colour = getComputedStyle(one).backgroundColor;
    if (colour !== clear) return colour;
  }
};
while (walk.nextNode()) {
  const one = walk.currentNode.parentElement, style = getComputedStyle(one);
  if (!walk.currentNode.data.trim() || one.closest("script, style, title")) continue;
  const own = one.tagName === "text" || one.tagName === "tspan" ? style.fill : style.color;
  if (own === "rgb(0, 0, 0)" && one.closest("svg") || own === "rgb(254, 254, 254)") continue;  // on coloured cells
  found[own + " on " + behind(one)] = [own, behind(one), walk.currentNode.data.trim().slice(0, 40)];
}
return Object.values(found);
"""

UNNAMED = """
return [...document.querySelectorAll(`svg:not([aria-hidden]):not([aria-label]), img:not([alt]), th:not([scope]),
  table:not(:has(caption)), button:empty, html:not([lang])`)].map(one => one.outerHTML.slice(0, 80));
"""

CUT_OFF = """
const tables = innerWidth < 1000 ? [] : [...document.querySelectorAll(".wide")].filter(one => !one.closest("details"));
return tables.filter(one => one.scrollWidth > one.clientWidth)
  .map(one => [one.scrollWidth, one.clientWidth, one.innerText.slice(0, 80)]);
"""
"""Tables of which some columns have to be scrolled to, though the screen is wide and nothing folds them away."""


QUIETLY = (
    "headless",
    "no-sandbox",
    "disable-gpu",
    "disable-dev-shm-usage",
    "enable-unsafe-swiftshader",  # WebGL without a graphics card
    "no-first-run",
    "disable-background-networking",
    "disable-component-update",
    "disable-sync",
    "window-size=1200,1000",
)


def missing_for_pages():
    """Which programs are not there that open pages."""
    return [program for program in ("chromium", "chromedriver") if shutil.which(program) is None]


@contextmanager
def chromium(folder):
    """Chromium without a window, which keeps its things in a folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for argument in (*QUIETLY, f"user-data-dir={folder}"):
        options.add_argument(f"--{argument}")
    with webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver"))) as started:
        yield started


def opened(browser, page, folder):
    """Open a page, check that it is complete, light, readable and described, and return its graphs."""
    path = folder / "page.html"
    path.write_text(page, "utf-8")
    assert path.stat().st_size <= 1_000_000
    browser.get(path.as_uri())
    graphs = browser.execute_script(GRAPHS)
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    assert browser.execute_script("return performance.getEntriesByType('resource').map(one => one.name)") == []
    assert browser.execute_script(UNNAMED) == []
    assert browser.execute_script(CUT_OFF) == []
    for graph in graphs:
        assert graph["label"], graph
        assert graph["drawn"] >= 10, graph
        assert min(graph["wide"], graph["high"]) > 50, graph
    for scheme in ("light", "dark"):
        with coloured(browser, scheme):
            assert unreadable(browser) == [], scheme
    return graphs


def unreadable(browser):
    """Colours of text and ground whose contrast is below 4.5, the least that WCAG asks for, with some of the text."""
    pairs = browser.execute_script(TEXTS)
    assert len(pairs) >= 2
    return [one for one in pairs if contrast(*map(_rgb, one[:2])) < 4.5 and one[2] not in "✔!✖"]


def contrast(one: Sequence[float], other: Sequence[float]) -> float:
    """Ratio of the relative luminances of two colours, red, green and blue from 0 to 1, as WCAG 2 defines it."""
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: Sequence[float]) -> float:
    linear = [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in colour]
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


def _rgb(text: str) -> list[float]:
    return [float(part) / 255.0 for part in text[text.index("(") + 1 : -1].split(",")[:3]]


@contextmanager
def coloured(browser, scheme):
    """As somebody sees it who prefers light or dark."""
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    try:
        yield
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


@contextmanager
def on_a_phone(browser, width, height, scale=1):
    """As somebody sees it on a screen of so many pixels, each ``scale`` wide in the glass."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        yield
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def width_of(browser):
    """Width of a page, to the right of which one would have to scroll."""
    return browser.execute_script("return document.documentElement.scrollWidth")


def unnamed_canvases(browser):
    """How many drawings have no text for those who cannot see them."""
    script = "return [...document.querySelectorAll('canvas')].filter((c) => !c.getAttribute('aria-label')).length"
    return browser.execute_script(script)


def below(said):
    """What follows a verdict."""
    verdict, _, rest = said.partition("\n\n")
    assert verdict[:2] in ("✔ ", "! ", "✖ ")
    return rest

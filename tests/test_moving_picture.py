"""The README's moving picture: as its script draws it, small, described, and still where somebody prefers that."""

import re
from xml.etree import ElementTree as ET

import numpy as np
from numpy.testing import assert_allclose

import moving_picture
from seen import coloured

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
TEXT = moving_picture.PATH.read_text()


def test_it_is_what_the_script_computes():
    made = moving_picture.picture()
    assert NUMBER.sub("", made) == NUMBER.sub("", TEXT)
    assert_allclose(np.array(NUMBER.findall(made), float), np.array(NUMBER.findall(TEXT), float), atol=1.0)


def test_it_is_small_and_described():
    assert len(TEXT) < 500_000
    root = ET.fromstring(TEXT)
    said = [root.find(f"{{http://www.w3.org/2000/svg}}{tag}") for tag in ("title", "desc")]
    assert root.get("aria-labelledby").split() == [one.get("id") for one in said]
    assert all(len(one.text) > 30 for one in said)


def test_it_moves_but_not_for_who_prefers_stillness(browser):
    browser.get(moving_picture.PATH.as_uri())
    script = "return document.getAnimations().filter((one) => one.playState === 'running').length"
    assert browser.execute_script(script) > 100
    still = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": still})
    assert browser.execute_script(script) == 0
    hidden = "return [...document.querySelectorAll('.way')].map((one) => getComputedStyle(one).strokeDashoffset)"
    assert set(browser.execute_script(hidden)) == {"0px"}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert browser.get_log("browser") == []


def test_it_is_dark_where_the_rest_is(browser):
    browser.get(moving_picture.PATH.as_uri())
    ground = "return getComputedStyle(document.querySelector('.paper')).fill"
    with coloured(browser, "light"):
        light = browser.execute_script(ground)
    with coloured(browser, "dark"):
        assert browser.execute_script(ground) != light

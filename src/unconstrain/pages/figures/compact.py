"""SVG of matplotlib's with half of the bytes and the same picture, to a tenth of a pixel."""

import re
from itertools import cycle

_SEGMENT = re.compile(r"([MLQCz])([^MLQCz]*)")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def compact(svg: str) -> str:
    """Paths with relative steps, coordinates with one decimal, no groups that say nothing, one font."""
    svg = re.sub(r' d="([^"]*)"', lambda found: f' d="{_relative(found[1])}"', _without_empty_groups(svg))
    svg = re.sub(r' transform="rotate\(-0 [^"]*"', "", svg)
    svg = re.sub(r' (?:x|y|width|height|transform)="[^"]*', lambda found: re.sub(r"(\.\d)\d+", r"\1", found[0]), svg)
    svg = re.sub(r' style="[^"]*', lambda found: re.sub("font-family:[^;]*; |(?<=[:;]) ", "", found[0]), svg)
    return re.sub(r"\n+", "\n", svg)


def _relative(path: str) -> str:
    """Steps are between rounded places, so that rounding does not add up; a letter stands once for all that follow."""
    made, at, begun, before = "", (0, 0), (0, 0), ""
    for letter, numbers in _SEGMENT.findall(path):
        tenths = [round(10 * float(number)) for number in _NUMBER.findall(numbers)]
        named = letter if letter in "Mz" else letter.lower()
        steps = tenths if letter == "M" else [value - start for value, start in zip(tenths, cycle(at), strict=False)]
        made += ("" if named == before else named) + _joined(steps, named == before)
        at = begun if letter == "z" else (tenths[-2], tenths[-1])
        begun, before = (at, letter) if letter == "M" else (begun, named)
    return made


def _joined(tenths: list[int], goes_on: bool) -> str:
    """Numbers with a space where they would run into each other."""
    texts = [re.sub(r"^(-?)0\.", r"\1.", f"{value / 10:g}") for value in tenths]
    said = "".join(text if text.startswith("-") else f" {text}" for text in texts)
    return said if goes_on else said.lstrip()


def _without_empty_groups(svg: str) -> str:
    kept: list[bool] = []

    def group(found: re.Match[str]) -> str:
        if found[0] == "</g>":
            return "</g>" if kept.pop() else ""
        kept.append(found[0] != "<g>")
        return found[0] if kept[-1] else ""

    return re.sub(r"</g>|<g\b[^>]*>", group, svg)

"""Draw the README's moving picture from what is computed here: ``python scripts/moving_picture.py``.

A limit cycle is recorded behind random rails (section IV-A of the paper). Ordinary regression and the default learner
see the same strokes, and both policies are let go from the same starts. One SVG, moved by CSS: still where somebody
prefers that, dark where the rest is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

import unconstrain as uc
from unconstrain.paper.experiments import toy

SIZE, REACH, GAP, TOP = 300, 1.16, 20, 58
"""Of a panel, pixels, and what it shows of the plane; between panels, and above them, pixels."""

LOOP, RECORDED, LET_GO = 14.0, (0.3, 5.0), (5.6, 12.0)
"""Seconds: of all; when strokes are drawn; when policies move."""

STROKE = 1.1
"""Seconds that a stroke takes."""

STEPS = 24
"""Moments at which a movement is where it was computed; between them it is straight and steady."""

PATH = Path(__file__).parents[1] / "docs" / "_static" / "moving.svg"

STYLE = """
svg { --paper: #fbfaf7; --card: #fff; --rule: #d9dde2; --ink: #1d2126; --soft: #5c6470; --rail: #b26a00;
  --wrong: #b3261e; --right: #00795a; font: 15px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif }
@media (prefers-color-scheme: dark) { svg { --paper: #14171b; --card: #1c2026; --rule: #343a43; --ink: #eceae4;
  --soft: #a3abb6; --rail: #e9b44c; --wrong: #ff8a7a; --right: #3ecf9f } }
.paper { fill: var(--paper) } .card { fill: var(--card); stroke: var(--rule) }
text { fill: var(--ink); text-anchor: middle } .title { font-size: 18px; font-weight: 650 }
.soft { fill: var(--soft) } .small { font-size: 12px }
path { fill: none; stroke: var(--ink); stroke-width: 2 } .stroke, .way { stroke-dasharray: 1 2 }
.rail { stroke: var(--rail); stroke-width: 1.5; opacity: 0 } .wanted { stroke: var(--soft); stroke-dasharray: 5 5 }
.wrong { stroke: var(--wrong); fill: var(--wrong) } .right { stroke: var(--right); fill: var(--right) }
path.wrong, path.right { fill: none; stroke-width: 2.2 } circle { stroke: var(--card); stroke-width: 1.5 }
circle.wrong, circle.right { stroke: var(--card) } text.wrong, text.right { stroke: none; font-weight: 650 }
g, path, circle { animation: 14s linear infinite }
.shown { animation-name: shown } @keyframes shown { 0%, 95.7% { opacity: 1 } 99.5%, 100% { opacity: 0 } }
@media (prefers-reduced-motion: reduce) { g, path, circle { animation: none !important } }
"""

TOLD = (
    "Three panels. Left: strokes recorded on a plate, each along a rail that turns at random. Middle: let go from "
    "seven starts, the policy of ordinary regression wanders off. Right: from the same starts, the policy that "
    "unconstrain learnt from the same strokes comes to the circle that was wanted."
)


def at(states: np.ndarray) -> np.ndarray:
    """Pixels in a panel of states (T, 2)."""
    return SIZE * (0.5 + 0.5 * np.array([1.0, -1.0]) * states / REACH)


def line(states: np.ndarray) -> str:
    """The data of a path."""
    return "M" + " ".join(f"{x:.1f},{y:.1f}" for x, y in at(states))


def percent(second: float) -> str:
    """A moment of the loop."""
    return f"{100 * second / LOOP:.2f}".rstrip("0").rstrip(".") + "%"


class Picture:
    """What is drawn, and how it moves."""

    def __init__(self) -> None:
        self.moves: list[str] = []

    def moving(self, tag: str, kind: str, moments: Sequence[tuple[float, str]], rest: str) -> str:
        """An element that has some style at each of some moments of the loop."""
        name = f"m{len(self.moves)}"
        steps = " ".join(f"{percent(second)} {{ {style} }}" for second, style in moments)
        self.moves.append(f"@keyframes {name} {{ {steps} }}")
        return f'<{tag} class="{kind}" style="animation-name:{name}" {rest}/>'

    def stroke(self, states: np.ndarray, begin: float) -> Iterator[str]:
        """A demonstration that is drawn, and the rails that hold it meanwhile."""
        end = begin + STROKE
        for rail in rails(states):
            shown = [(0, "opacity: 0"), (begin - 0.25, "opacity: 0"), (begin, "opacity: .8")]
            gone = [(end, "opacity: .8"), (end + 0.4, "opacity: 0")]
            yield self.moving("path", "rail", [*shown, *gone], f'd="{line(rail)}"')
        drawn = [(0, "stroke-dashoffset: 1"), (begin, "stroke-dashoffset: 1"), (end, "stroke-dashoffset: 0")]
        yield self.moving("path", "stroke", drawn, f'pathLength="1" d="{line(states)}"')

    def way(self, states: np.ndarray, kind: str) -> Iterator[str]:
        """A roll-out that is drawn as it goes, with a dot ahead."""
        rows = np.linspace(0, len(states) - 1, STEPS + 1).round().astype(int)
        seconds = np.interp(rows, (0, len(states) - 1), LET_GO)
        length = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(states, axis=0), axis=1))]
        left = 1 - (length / length[-1])[rows]
        drawn = [(when, f"stroke-dashoffset: {share:.3f}") for when, share in zip(seconds, left, strict=True)]
        whole = f'pathLength="1" d="{line(states)}"'
        yield self.moving("path", f"way {kind}", [(0, "stroke-dashoffset: 1"), *drawn], whole)
        places = [f"translate({x:.1f}px,{y:.1f}px)" for x, y in at(states[rows])]
        gone = [(when, f"transform: {place}") for when, place in zip([0, *seconds], [places[0], *places], strict=True)]
        yield self.moving("circle", kind, gone, f'r="5.5" transform="{places[-1].replace("px", "")}"')


def rails(states: np.ndarray) -> Iterator[np.ndarray]:
    """The lines that a stroke runs along, a little longer than it."""
    steps = np.diff(states, axis=0)
    turned = np.abs(steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0])
    corners = np.flatnonzero(turned > 1e-6 * np.linalg.norm(steps[:-1], axis=1) * np.linalg.norm(steps[1:], axis=1)) + 1
    for first, last in zip([0, *corners], [*corners, len(states) - 1], strict=True):
        along = steps[first] / np.linalg.norm(steps[first])
        yield np.array([states[first] - 0.1 * along, states[last] + 0.1 * along])


def panel(number: int, title: str, inside: Iterator[str], below: str) -> str:
    """A panel with its title and what is said below it."""
    left, middle = GAP + number * (SIZE + GAP), SIZE / 2
    return (
        f'<g transform="translate({left},{TOP})"><text class="title" x="{middle}" y="-20">{title}</text>'
        f'<rect class="card" width="{SIZE}" height="{SIZE}" rx="10"/><g class="shown" clip-path="url(#panel)">'
        f"{''.join(inside)}</g>{below}</g>"
    )


def said(text: str, kind: str, below: int = 28) -> str:
    """A line so many pixels below a panel."""
    return f'<text class="{kind}" x="{SIZE / 2}" y="{SIZE + below}">{text}</text>'


def picture() -> str:
    """Record, learn, let go, draw."""
    settings, drawn = toy.ToySettings(), Picture()
    recorded = toy.demonstrate(settings, np.random.default_rng(1), toy.random_lines)
    test = toy.demonstrate(settings, np.random.default_rng(100), toy.free)
    direct = toy.policy(settings).fit_demonstrations(recorded)
    angles = 0.3 + 2 * np.pi / 5 * np.arange(5)
    starts = np.array([*(0.9 * np.column_stack([np.cos(angles), np.sin(angles)])), [0.1, 0.0], [-0.08, 0.06]])
    begins = np.linspace(RECORDED[0], RECORDED[1] - STROKE, len(recorded))
    strokes = (part for demo, begin in zip(recorded, begins, strict=True) for part in drawn.stroke(demo.states, begin))
    panels = [panel(0, "What is recorded", strokes, said("each stroke on rails that nobody knows", "soft"))]
    dashed = said("dashed: what was wanted", "soft small", -9)
    ring = np.sqrt(settings.rho) * np.column_stack([f(np.linspace(0, 2 * np.pi, 73)) for f in (np.cos, np.sin)])
    for number, (title, kind, policy) in enumerate(
        [("Ordinary regression", "wrong", direct), ("unconstrain", "right", direct.with_learner(uc.Robust()))], start=1
    ):
        movements = uc.rollout(policy, starts, 400, settings.dt, None, method="euler", least_support=0.0)
        ways = [part for one in movements for part in drawn.way(one.states, kind)]
        missed = said(f"misses {100 * uc.nupe(policy, test):.2g} % of the policy", kind)
        wanted = f'<path class="wanted" d="{line(ring)}"/>'
        panels.append(panel(number, title, iter([wanted, *ways]), missed + (dashed if kind == "right" else "")))
    width, height = 3 * SIZE + 4 * GAP, TOP + SIZE + 48
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'role="img" aria-labelledby="title told"><title id="title">What a movement wants, behind its record</title>'
        f'<desc id="told">{TOLD}</desc><style>{STYLE}{chr(10).join(drawn.moves)}</style>'
        f'<clipPath id="panel"><rect width="{SIZE}" height="{SIZE}" rx="10"/></clipPath>'
        f'<rect class="paper" width="{width}" height="{height}" rx="14"/>{"".join(panels)}</svg>\n'
    )


if __name__ == "__main__":
    PATH.write_text(picture(), "utf-8")

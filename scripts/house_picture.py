"""The plan of the house as a picture: ``make house HOUSE='--draw docs/_static/house.svg'``."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path as File
from textwrap import wrap
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, PathPatch
from matplotlib.path import Path

from house import House, lines

WIDTH, BOX, STOREY, GAP = 10.0, 0.78, 1.32, 0.44
"""Of the page; of a box and a floor upwards; between boxes. All lengths are inches."""

NARROWEST, PER_ROOT = 1.9, 0.075
"""A box is as wide as the square root of its lines says, but no narrower than its words."""

MARGIN, LANE, PAD = 0.8, 0.075, 0.12
"""Left and right of a floor for what passes by; between passing arrows; around the words in a box."""

LETTERS = 18
"""Letters of a caption to an inch."""

INK, FAINT, PAPER = "#33373d", "#7b828c", "#ffffff"
COLOURS = ("#0072b2", "#c2540a", "#00856a", "#a8467f", "#8a6d00", "#2f7f9e", "#6f4e9c")
"""In turn for rooms and for the arrows that lead to them; dark enough to be read."""

Point = tuple[float, float]
Gap = tuple[float, float]
Arrow = tuple[str, str]


class Box(NamedTuple):
    """Where a room is drawn, and its colour."""

    left: float
    bottom: float
    width: float
    colour: str

    @property
    def middle(self) -> float:
        """Where arrows arrive, from the left."""
        return self.left + self.width / 2


class Plan:
    """Where everything is drawn.

    A room that all others import is the ground, as wide as the page, and no arrow is drawn to it.
    """

    def __init__(self, house: House) -> None:
        self.house = house
        arrows = [(room, other) for room in house.rooms for other in house.below[room]]
        above = {other: sum(other == each for _, each in arrows) for other in house.rooms}
        self.ground = [room for room in house.rooms if above[room] == len(house.rooms) - 1]
        self.boxes = self._boxes()
        self.arrows = [arrow for arrow in arrows if arrow[1] not in self.ground]
        self.ways = {arrow: self._way(arrow) for arrow in self.arrows}

    def _boxes(self) -> dict[str, Box]:
        boxes: dict[str, Box] = {}
        for floor in sorted(set(self.house.floors.values())):
            rooms = self.on(floor)
            left = (WIDTH - sum(map(self._width, rooms)) - GAP * (len(rooms) - 1)) / 2
            for room in rooms:
                boxes[room] = Box(left, STOREY * (floor - 1), self._width(room), COLOURS[len(boxes) % len(COLOURS)])
                left += self._width(room) + GAP
        return boxes

    def on(self, floor: int) -> list[str]:
        """Rooms on a floor, from the left."""
        return [room for room in self.house.rooms if self.house.floors[room] == floor]

    def _width(self, room: str) -> float:
        if room in self.ground:
            return WIDTH - 0.6
        return max(NARROWEST, PER_ROOT * lines(self.house.files(room)) ** 0.5)

    def gaps(self, floor: int) -> list[Gap]:
        """Where arrows can pass a floor: between its boxes, and beside them."""
        boxes = [self.boxes[room] for room in self.on(floor)]
        ends = [boxes[0].left - MARGIN, *(end for box in boxes for end in (box.left, box.left + box.width))]
        ends.append(ends[-1] + MARGIN)
        return list(zip(ends[::2], ends[1::2], strict=True))

    def _way(self, arrow: Arrow) -> dict[int, Gap]:
        """The gap by which an arrow passes each floor between its ends: the one that is least out of its way."""
        room, other = arrow
        at, end = self.boxes[room].middle, self.boxes[other].middle
        way: dict[int, Gap] = {}
        for floor in range(self.house.floors[room] - 1, self.house.floors[other], -1):
            way[floor] = min(self.gaps(floor), key=lambda gap: abs(sum(gap) / 2 - at) + abs(sum(gap) / 2 - end))
            at = sum(way[floor]) / 2
        return way

    def lane(self, floor: int, gap: Gap, other: str) -> float:
        """Where in a gap the arrows to one room pass: all in one line."""
        passing = {each for (_, each), way in self.ways.items() if way.get(floor) == gap}
        row = sorted(passing, key=lambda each: (self.boxes[each].middle, each))
        apart = min(LANE, 0.8 * (gap[1] - gap[0]) / len(row))
        return sum(gap) / 2 + apart * (row.index(other) - (len(row) - 1) / 2)

    def points(self, arrow: Arrow) -> list[Point]:
        """Ends of the vertical pieces of an arrow, from the top."""
        room, other = arrow
        start, end = self.boxes[room], self.boxes[other]
        points = [(self._start(room, other), start.bottom)]
        for floor, gap in self.ways[arrow].items():
            x, bottom = self.lane(floor, gap, other), STOREY * (floor - 1)
            points += [(x, bottom + BOX), (x, bottom)]
        return [*points, (end.middle, end.bottom + BOX + 0.05)]

    def _start(self, room: str, other: str) -> float:
        arrows = [arrow for arrow in self.arrows if arrow[0] == room]
        row = sorted((self._heading(arrow), arrow[1]) for arrow in arrows)
        place = [each for _, each in row].index(other) - (len(row) - 1) / 2
        return self.boxes[room].middle + place * min(0.16, 0.8 * self.boxes[room].width / len(row))

    def _heading(self, arrow: Arrow) -> tuple[float, float]:
        end = self.boxes[arrow[1]].middle
        return (sum(next(iter(self.ways[arrow].values()), (end, end))) / 2, end)


def draw(house: House, path: File) -> None:
    """Draw rooms as boxes, floor by floor from the ground up, and imports as curves between them."""
    plan, height = Plan(house), STOREY * (max(house.floors.values()) - 1) + BOX
    with mpl.rc_context({"svg.hashsalt": "house", "font.family": "DejaVu Sans"}):
        figure = Figure(figsize=(WIDTH, height + 0.1), facecolor=PAPER)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, WIDTH), ylim=(-0.05, height + 0.05))
        axes.axis("off")
        for arrow in plan.arrows:
            _arrow(axes, plan.points(arrow), plan.boxes[arrow[1]].colour)
        for room in house.rooms:
            _room(axes, house, room, plan.boxes[room])
        for floor in set(house.floors.values()):
            axes.text(0.1, STOREY * (floor - 1) + BOX / 2, f"{floor}", size=9, color=FAINT, va="center", ha="center")
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None, dpi=150)


def _room(axes: Any, house: House, room: str, box: Box) -> None:
    corner, style = (box.left, box.bottom), "round,pad=0,rounding_size=0.07"
    axes.add_patch(FancyBboxPatch(corner, box.width, BOX, style, fc=PAPER, ec=box.colour, lw=1.4, zorder=3))
    left, right, top = box.left + PAD, box.left + box.width - PAD, box.bottom + BOX - 0.1
    axes.text(left, top, room, size=10.5, weight="bold", color=box.colour, va="top", zorder=4)
    axes.text(right, top - 0.02, f"{lines(house.files(room))}", size=8, color=FAINT, va="top", ha="right", zorder=4)
    caption = "\n".join(wrap(house.caption(room), int(LETTERS * (right - left)), break_on_hyphens=False))
    axes.text(left, top - 0.21, caption, size=7.5, color=INK, va="top", linespacing=1.2, zorder=4)


def _arrow(axes: Any, points: list[Point], colour: str) -> None:
    vertices, codes = [points[0]], [Path.MOVETO]
    for (x, y), (to_x, to_y) in pairwise(points):
        bend = (y - to_y) / 2
        vertices += [(x, y - bend), (to_x, to_y + bend), (to_x, to_y)]
        codes += [Path.CURVE4] * 3
    axes.add_patch(PathPatch(Path(vertices, codes), fc="none", ec=colour, lw=0.9, alpha=0.7, zorder=1))
    axes.plot(*points[-1], marker=(3, 0, 180), ms=5, color=colour, mew=0, zorder=2)

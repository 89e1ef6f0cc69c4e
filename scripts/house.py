"""The plan of the house, made from the imports themselves, and its figures beside what they may be.

Rooms are the direct children of the package. Each figure says in one line what it counts; most have a limit and an
aim. This script fails where a figure is above its limit and where rooms import each other in a circle.

    make house                            the plan and the figures
    make house HOUSE=--list               what was counted, line by line
    make house HOUSE=--walk               the way of the data through the rooms
    make house HOUSE='--draw FILE.svg'    the plan as a picture
"""

from __future__ import annotations

import argparse
import ast
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import groupby
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any, NamedTuple

import grimp

SOURCE = Path(__file__).parents[1] / "src" / "unconstrain"
GROUND = ("base",)
"""Rooms that a walk does not enter: their checks and array helpers are called from everywhere."""

FIELDS_OF_TUPLES = ("_asdict", "_fields", "_make", "_replace")
"""A NamedTuple's own, public in spite of their names."""

Function = ast.FunctionDef | ast.AsyncFunctionDef
Import = ast.Import | ast.ImportFrom


class House:
    """A package as rooms: its files, parsed, and which room imports which.

    Parameters
    ----------
    root : Path
        Folder of the package.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.trees = {path: ast.parse(path.read_text()) for path in sorted(root.rglob("*.py"))}
        self.rooms = sorted({self.room(path) for path in self.trees} - {"__init__", "__main__"})

    def room(self, path: Path) -> str:
        """Name of the room that a file is in."""
        return path.relative_to(self.root).parts[0].removesuffix(".py")

    def door(self, room: str) -> Path:
        """File whose ``__all__`` says what a room offers."""
        return self.root / room / "__init__.py" if (self.root / room).is_dir() else self.root / f"{room}.py"

    def files(self, room: str) -> list[Path]:
        """Files of one room."""
        return [path for path in self.trees if self.room(path) == room]

    def caption(self, room: str) -> str:
        """First sentence of a room's docstring."""
        said = ast.get_docstring(self.trees[self.door(room)]) or ""
        return " ".join(said.split("\n\n")[0].split()).split(". ")[0].rstrip(".")

    def nodes(self, paths: Iterable[Path] | None = None) -> Iterator[tuple[Path, Any]]:
        """Every node of the files named, or of all."""
        return ((path, node) for path in paths or self.trees for node in ast.walk(self.trees[path]))

    @cached_property
    def imports(self) -> set[tuple[str, str]]:
        """Pairs of rooms of which the first imports the second; ("room", "") is an import of the package's own face."""
        sys.path.insert(0, str(self.root.parent))
        graph = grimp.build_graph(self.root.name, exclude_type_checking_imports=True, cache_dir=None)
        sys.path.pop(0)
        both = ((each, other) for each in graph.modules for other in graph.find_modules_directly_imported_by(each))
        pairs = {(_second(each), _second(other)) for each, other in both}
        return {(room, other) for room, other in pairs if room in self.rooms and room != other}

    @cached_property
    def below(self) -> dict[str, list[str]]:
        """What each room imports."""
        return {room: sorted(other for each, other in self.imports if each == room and other) for room in self.rooms}

    @cached_property
    def floors(self) -> dict[str, int]:
        """For each room the length of the longest chain of imports that starts there; 1 if it imports no room."""
        floors: dict[str, int] = {}
        for room in TopologicalSorter(self.below).static_order():
            floors[room] = 1 + max((floors[other] for other in self.below[room]), default=0)
        return floors

    def offered(self, path: Path) -> list[str]:
        """Names in a file's ``__all__``, be it a list or made by ``lazy_loader``."""
        return [name for value in self._faces(path) for name in _names_in(value, path)]

    def is_open(self, room: str) -> bool:
        """Whether a room offers its modules rather than names, as those do whose face ``lazy_loader`` makes."""
        return any(isinstance(value, ast.Call) for value in self._faces(self.door(room)))

    def _faces(self, path: Path) -> list[ast.expr]:
        assigned = (node for node in self.trees[path].body if isinstance(node, ast.Assign))
        return [node.value for node in assigned if "__all__" in _words(node.targets[0])]


def _second(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def _words(node: ast.AST) -> set[str]:
    named = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    return named | {each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)}


def _names_in(value: ast.expr, path: Path) -> list[str]:
    if "attach_stub" in _words(value):
        stub = ast.parse(path.with_suffix(".pyi").read_text())
        return [name.asname or name.name for node in stub.body if isinstance(node, Import) for name in node.names]
    modules = {key for node in ast.walk(value) if isinstance(node, ast.Dict) for key in node.keys}
    constants = (node for node in ast.walk(value) if isinstance(node, ast.Constant) and node not in modules)
    return [node.value for node in constants if isinstance(node.value, str)]


def circle(house: House) -> list[str]:
    """Rooms that import each other in a circle, the first one again at the end; empty where there is none."""
    try:
        TopologicalSorter(house.below).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))
    return []


def bypasses(house: House) -> list[str]:
    """Imports past another room's door: of what its ``__all__`` lacks, or from a module inside it.

    From inside the rooms that offer modules, anything may be imported. Imports for type checkers count here.
    """
    found = ((path, node, what) for path, node in house.nodes() for what in _imported(house, path, node))
    return [_at(house, path, node, ".".join(what)) for path, node, what in found if _is_past(house, path, what)]


def _imported(house: House, path: Path, node: ast.AST) -> list[tuple[str, ...]]:
    """What an import of this package names, from the room on: ``("risks", "moments", "Moments")``."""
    if not isinstance(node, Import):
        return []
    start: tuple[str, ...] = ()
    if isinstance(node, ast.ImportFrom):
        here = (house.root.name, *path.relative_to(house.root).parts)
        start = (*(here[: -node.level] if node.level else ()), *(node.module.split(".") if node.module else ()))
    whole = ((*start, *alias.name.split(".")) for alias in node.names)
    return [name[1:] for name in whole if name[0] == house.root.name]


def _is_past(house: House, path: Path, what: tuple[str, ...]) -> bool:
    if len(what) < 2 or what[0] not in house.rooms or house.room(path) not in {*house.rooms} - {what[0]}:
        return False
    return what[1] not in house.offered(house.door(what[0])) or (len(what) > 2 and not house.is_open(what[0]))


def private_touches(house: House) -> list[str]:
    """``thing._name``, ``getattr(thing, "_name")`` and imports of ``_name``, where only other rooms define the name."""
    defined = {room: _defined(house, room) for room in house.rooms}
    anywhere = set().union(*defined.values())
    found = ((path, node, name) for path, node in house.nodes() for name in filter(_is_private, _touched(node)))
    return [
        _at(house, path, node, name)
        for path, node, name in found
        if name in anywhere - defined.get(house.room(path), anywhere)
    ]


def _touched(node: ast.AST) -> list[Any]:
    if isinstance(node, ast.Attribute):
        return [] if _words(node.value) in ({"self"}, {"cls"}) else [node.attr]
    if isinstance(node, ast.ImportFrom):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.Call) and _words(node.func) & {"getattr", "hasattr", "setattr"}:
        return [each.value for each in node.args[1:2] if isinstance(each, ast.Constant)]
    return []


def _is_private(name: Any) -> bool:
    return str(name).startswith("_") and not str(name).startswith("__") and name not in FIELDS_OF_TUPLES


def _defined(house: House, room: str) -> set[str]:
    nodes = [node for _, node in house.nodes(house.files(room))]
    stored = [node for node in nodes if isinstance(getattr(node, "ctx", None), ast.Store)]
    names = {node.name for node in nodes if isinstance(node, Function | ast.ClassDef)}
    names |= {node.id for node in stored if isinstance(node, ast.Name)}
    return names | {node.attr for node in stored if isinstance(node, ast.Attribute)}


def checks_of_learners(house: House) -> list[str]:
    """Calls of ``isinstance`` that name a class which the learners define."""
    own = {node.name for _, node in house.nodes(house.files("learners")) if isinstance(node, ast.ClassDef)}
    calls = ((path, node) for path, node in house.nodes() if isinstance(node, ast.Call) and len(node.args) == 2)
    asked = ((path, node) for path, node in calls if _words(node.func) == {"isinstance"} and own & _words(node.args[1]))
    return [_at(house, path, node, ast.unparse(node)) for path, node in asked]


def _at(house: House, path: Path, node: Any, what: str) -> str:
    return f"{path.relative_to(house.root.parent)}:{node.lineno}: {what}"


def lines(paths: Iterable[Path]) -> int:
    """Lines of files, blank ones and comments too."""
    return sum(path.read_text().count("\n") for path in paths)


def lengths(house: House, *, docstrings: bool) -> list[int]:
    """Lines of each function, from ``def`` to its last."""
    functions = [node for _, node in house.nodes() if isinstance(node, Function)]
    return [_lines_of(node) - (0 if docstrings else _lines_said(node)) for node in functions]


def _lines_of(node: Any) -> int:
    return int(node.end_lineno - node.lineno + 1)


def _lines_said(node: Function) -> int:
    return 0 if ast.get_docstring(node) is None else _lines_of(node.body[0])


class Call(NamedTuple):
    """A call from one room into another, by the names of the functions."""

    caller: str
    room: str
    callee: str


def calls(house: House, work: Callable[[], object], ground: Sequence[str] = GROUND) -> list[Call]:
    """Calls from one room into another while ``work`` is done, each pair of functions when it is first seen.

    A call from the ground, another library or a comprehension counts as one from the function that these work for.
    """
    seen: dict[Call, None] = {}

    def room_of(frame: FrameType) -> str | None:
        path = Path(frame.f_code.co_filename)
        room = house.room(path) if path.is_relative_to(house.root) else None
        return room if room in house.rooms and room not in ground else None

    def look(frame: FrameType, event: str, _: object) -> None:
        if event != "call" or (room := room_of(frame)) is None:
            return
        caller = frame.f_back
        while caller is not None and room_of(caller) is None:
            caller = caller.f_back
        if caller is not None and (above := room_of(caller)) != room:
            seen[Call(f"{above}: {_name(caller)}", room, _name(frame))] = None

    sys.setprofile(look)
    try:
        work()
    finally:
        sys.setprofile(None)
    return list(seen)


def _name(frame: FrameType) -> str:
    return frame.f_code.co_qualname.split(".<locals>")[0]


def visits(walk: Iterable[Call]) -> list[tuple[str, list[str]]]:
    """Rooms in the order in which they are entered, and what is called there; calls in a row are one visit."""
    return [(room, list(dict.fromkeys(each.callee for each in there))) for room, there in groupby(walk, _room_entered)]


def _room_entered(call: Call) -> str:
    return call.room


def returns(walk: Iterable[Call]) -> int:
    """How often a room is entered that was entered and left before; coming back from a call is no entering."""
    rooms = [room for room, _ in visits(walk)]
    return len(rooms) - len(set(rooms))


def walk_of_fitting(house: House) -> list[Call]:
    """What ``LocallyLinearPolicy.fit_demonstrations`` calls, with the paper's learner, in one thread."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy is imported: work in other threads would not be seen
    sys.path.insert(0, str(house.root.parent))
    import numpy as np

    import unconstrain as uc

    rng = np.random.default_rng(0)
    normals = np.eye(2)[[0, 1, 0, 1]]
    tables = [(states, -states * normal) for states, normal in zip(rng.normal(size=(4, 30, 2)), normals, strict=True)]
    demonstrations = [uc.Demonstration(states, actions) for states, actions in tables]
    policy = uc.LocallyLinearPolicy(None, learner=uc.Hybrid())  # on fields of one width, as in the paper
    policy.fit_demonstrations(demonstrations)  # imports what is imported on first use
    return calls(house, lambda: policy.fit_demonstrations(demonstrations))


class Figure(NamedTuple):
    """One figure: what it is now, what it must not exceed, what it should be, and what it counts."""

    name: str
    now: float
    limit: float | None
    aim: float | None
    counts: str

    @property
    def is_kept(self) -> bool:
        """Whether the limit is."""
        return self.limit is None or self.now <= self.limit


def figures(house: House) -> list[Figure]:
    """All figures of the package."""
    return [*_figures_of_rooms(house), *_figures_of_code(house)]


def _figures_of_rooms(house: House) -> list[Figure]:
    arrows, face = sum(map(len, house.below.values())), sum(not other for _, other in house.imports)
    again = returns(walk_of_fitting(house))
    return [
        Figure("rooms", len(house.rooms), 16, 13, "direct children of the package"),
        Figure("floors", max(house.floors.values()), 9, 8, "rooms in the longest chain of imports"),
        Figure("arrows", arrows, 60, 45, "pairs of rooms, one importing the other; not if only for type checkers"),
        Figure("arrows to the face", face, None, None, "rooms that import the package itself, as its users do"),
        Figure("returns", again, 8, 4, "rooms entered again while demonstrations are learnt from (--walk)"),
        Figure("bypasses", len(bypasses(house)), 0, 0, "imports past another room's __all__"),
        Figure("private touches", len(private_touches(house)), 0, 0, "uses of another room's _names"),
    ]


def _figures_of_code(house: House) -> list[Figure]:
    outside = [path for path in house.trees if house.room(path) != "paper"]
    doors = {path for path in house.trees if path.name == "__init__.py"} | set(map(house.door, house.rooms))
    offered = {path: len(house.offered(path)) for path in house.trees}
    bare, whole = lengths(house, docstrings=False), lengths(house, docstrings=True)
    return [
        Figure("checks of learners", len(checks_of_learners(house)), 2, 0, "isinstance of a class in learners"),
        Figure("lines of policies", lines(house.files("policies")), 680, 420, "all lines, blank ones too"),
        Figure("lines in all", lines(outside), 34667, 16000, "the same, of the package without paper"),
        Figure("names at doors", sum(map(offered.get, doors)), 259, 150, "in __all__ of rooms and folders"),
        Figure("names in all", sum(offered.values()), None, None, "in __all__ of every file"),
        Figure("longest function", max(bare), 41, 40, "its lines without the docstring"),
        Figure("median function", median(bare), 6, 5, "the same"),
        Figure("longest, all lines", max(whole), None, None, "with the docstring"),
        Figure("median, all lines", median(whole), None, None, "the same"),
    ]


def plan(house: House) -> Iterator[str]:
    """The plan in words, from the top floor down."""
    for room in sorted(house.rooms, key=lambda room: (-house.floors[room], room)):
        below = " ".join(house.below[room]) or "nothing"
        yield f"{house.floors[room]:>3}  {room:<12}{lines(house.files(room)):>6} lines   imports {below}"


def table(every: Iterable[Figure]) -> Iterator[str]:
    """The figures in words."""
    yield f"  {'':<20}{'now':>8}{'at most':>8}{'aim':>8}"
    for each in every:
        cells = "".join(f"{'' if value is None else f'{value:g}':>8}" for value in (each.now, each.limit, each.aim))
        yield f"{' ' if each.is_kept else '✗'} {each.name:<20}{cells}   {each.counts}"


def _print_walk(house: House) -> None:
    been: set[str] = set()
    for number, (room, called) in enumerate(visits(walk_of_fitting(house)), 1):
        print(f"{number:>3}  {room:<12}{'again' if room in been else '':<7}{', '.join(called)}")
        been.add(room)


def _print_list(house: House) -> None:
    for count in (bypasses, private_touches, checks_of_learners):
        print(f"\n{(count.__doc__ or '').splitlines()[0]}", *count(house), sep="\n  ")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what is asked for; 1 if rooms form a circle or a figure is above its limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="what was counted, line by line")
    parser.add_argument("--walk", action="store_true", help="the way of the data through the rooms")
    parser.add_argument("--draw", type=Path, metavar="FILE", help="draw the plan")
    asked = parser.parse_args(arguments)
    house = House(SOURCE)
    if around := circle(house):
        print("Rooms import each other in a circle:", " -> ".join(around))
        return 1
    if asked.draw:
        from house_picture import draw

        draw(house, asked.draw)
        return 0
    return _report(house, asked)


def _report(house: House, asked: argparse.Namespace) -> int:
    if asked.walk:
        _print_walk(house)
        return 0
    every = figures(house)
    print(*plan(house), "", *table(every), sep="\n")
    if asked.list:
        _print_list(house)
    return int(not all(figure.is_kept for figure in every))


if __name__ == "__main__":
    sys.exit(main())

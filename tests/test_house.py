"""What ``make house`` counts, on a package of a few lines, and that rooms do not import each other in a circle."""

import sys
from importlib import import_module
from textwrap import dedent

import pytest

import house
from house import Call, Figure, House
from house_picture import draw

PACKAGE = {
    "__init__.py": """
        import lazy_loader
        attribute, names, __all__ = lazy_loader.attach_stub(__name__, __file__)
    """,
    "__init__.pyi": """
        from .risks import Moments as Moments
        from .learners import Robust as Robust
    """,
    "__main__.py": "from .learners import Robust",
    "base/__init__.py": """
        'The ground.'
        import lazy_loader
        attribute, names, __all__ = lazy_loader.attach(__name__, ["arrays"], {"arrays": ["Array"]})
    """,
    "base/arrays.py": """
        Array = list
        def each(it, count): return [it() for _ in range(count)]
    """,
    "risks/__init__.py": """
        'Sums. And more.'
        from .moments import Moments
        __all__ = ["Moments"]
    """,
    "risks/moments.py": """
        from ..base.arrays import Array
        class Moments:
            _sums = 0
            def total(self): return self._sums
    """,
    "learners.py": """
        from .risks import Moments
        class Robust:
            def learn(self): return Moments().total()
    """,
}


@pytest.fixture
def build(tmp_path):
    """A package made of the files above and others."""

    def build(**others):
        for name, text in {**PACKAGE, **{f"{name}.py": text for name, text in others.items()}}.items():
            path = tmp_path / "cottage" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(dedent(text).strip() + "\n")
        return House(tmp_path / "cottage")

    return build


def test_rooms_are_the_children_of_the_package_with_a_caption_each(build):
    cottage = build()
    assert cottage.rooms == ["base", "learners", "risks"]
    assert [cottage.caption(room) for room in cottage.rooms] == ["The ground", "", "Sums"]


def test_arrows_are_pairs_of_rooms_inside_functions_too(build):
    text = "def late():\n    from .risks import Moments\n    from .base.arrays import Array, each"
    assert build(policies=text).below["policies"] == ["base", "risks"]


def test_what_only_a_type_checker_imports_is_no_arrow(build):
    text = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .risks import Moments"
    assert build(policies=text).below["policies"] == []


@pytest.mark.parametrize("text", ["import cottage as uc", "from cottage import Moments", "from . import Moments"])
def test_arrows_to_the_face_are_counted_apart(build, text):
    cottage = build(pages=text)
    assert ("pages", "") in cottage.imports
    assert cottage.below["pages"] == []


def test_a_floor_is_the_longest_chain_of_imports(build):
    cottage = build(policies="from .base import arrays\nfrom .learners import Robust")
    assert cottage.floors == {"base": 1, "risks": 2, "learners": 3, "policies": 4}


def test_a_circle_is_found_and_fails(build, monkeypatch, capsys):
    cottage = build(policies="from .pages import show", pages="def show():\n    from . import policies")
    assert set(house.circle(cottage)) == {"pages", "policies"}
    monkeypatch.setattr(house, "SOURCE", cottage.root)
    assert house.main([]) == 1
    assert "circle: pages -> policies -> pages" in capsys.readouterr().out


def test_without_a_circle_there_is_none(build):
    assert house.circle(build()) == []


@pytest.mark.parametrize(
    "text", ["from .risks.moments import Moments", "from .risks import hidden", "import cottage.risks.moments"]
)
def test_an_import_past_the_door_is_found(build, text):
    (found,) = house.bypasses(build(policies=text))
    assert found.startswith("cottage/policies.py:1: risks.")


@pytest.mark.parametrize(
    "text", ["from .risks import Moments", "from . import risks", "from .base.arrays import each", "import os.path"]
)
def test_an_import_by_the_door_is_not(build, text):
    assert house.bypasses(build(policies=text)) == []


@pytest.mark.parametrize("text", ["moments._sums", "getattr(moments, '_sums')", "from .risks import _sums"])
def test_a_private_touch_is_found(build, text):
    assert house.private_touches(build(policies=text)) == ["cottage/policies.py:1: _sums"]


@pytest.mark.parametrize(
    "text", ["self._sums", "_sums = 1; other._sums", "pair._replace(a=1)", "os._exit(0)", "a.__dict__"]
)
def test_what_is_ones_own_or_public_or_elsewhere_is_not(build, text):
    assert house.private_touches(build(policies=text)) == []


@pytest.mark.parametrize("asked", ["Robust", "(int, Robust)", "learners.Robust", "int | Robust"])
def test_a_check_for_a_learner_is_found(build, asked):
    (found,) = house.checks_of_learners(build(policies=f"isinstance(it, {asked})"))
    assert found == f"cottage/policies.py:1: isinstance(it, {asked})"


def test_a_check_for_anything_else_is_not(build):
    assert house.checks_of_learners(build(policies="isinstance(Robust, Moments)")) == []


def test_names_are_those_of_lists_and_of_lazy_ones(build):
    cottage = build(policies='__all__ = ["Policy", "fit"]\nother = ["no"]')
    offered = {path.relative_to(cottage.root).as_posix(): cottage.offered(path) for path in cottage.trees}
    assert {name: names for name, names in offered.items() if names} == {
        "__init__.py": ["Moments", "Robust"],
        "base/__init__.py": ["arrays", "Array"],
        "policies.py": ["Policy", "fit"],
        "risks/__init__.py": ["Moments"],
    }


def test_a_function_is_as_long_as_its_lines_and_its_docstring(build):
    cottage = build(policies='def fit():\n    """Learn.\n\n    Soon.\n    """\n    # here\n    return 1')
    assert max(house.lengths(cottage, docstrings=False)) == 3
    assert max(house.lengths(cottage, docstrings=True)) == 7
    assert house.lines(cottage.files("policies")) == 7


def test_a_walk_lists_calls_between_rooms_once_and_passes_through_the_ground(build, monkeypatch):
    cottage = build(policies="from .base.arrays import each\ndef fit(it): return each(it.learn, 3)")
    monkeypatch.syspath_prepend(cottage.root.parent)
    try:
        policies, learners = import_module("cottage.policies"), import_module("cottage.learners")
        walk = house.calls(cottage, lambda: policies.fit(learners.Robust()))
    finally:
        for name in [name for name in sys.modules if name.startswith("cottage")]:
            del sys.modules[name]
    assert walk == [
        Call("policies: fit", "learners", "Robust.learn"),
        Call("learners: Robust.learn", "risks", "Moments.total"),
    ]


def walk(*rooms):
    return [Call("policies: fit", room, f"{room}{number}") for number, room in enumerate(rooms)]


def test_calls_in_a_row_are_one_visit():
    assert house.visits(walk("models", "risks", "risks")) == [("models", ["models0"]), ("risks", ["risks1", "risks2"])]


def test_a_return_is_a_visit_to_a_room_that_was_left():
    assert house.returns(walk("models", "models", "risks", "learners")) == 0
    assert house.returns(walk("models", "risks", "models", "learners", "risks")) == 2


@pytest.mark.parametrize(("now", "limit", "kept"), [(60, 60, True), (61, 60, False), (61, None, True)])
def test_a_figure_above_its_limit_is_marked(now, limit, kept):
    figure = Figure("arrows", now, limit, None, "pairs of rooms")
    assert figure.is_kept == kept
    assert list(house.table([figure]))[-1].startswith(" " if kept else "✗")


@pytest.mark.parametrize(("limit", "code"), [(2, 1), (3, 0)])
def test_a_figure_above_its_limit_fails(build, monkeypatch, capsys, limit, code):
    monkeypatch.setattr(house, "SOURCE", build().root)
    monkeypatch.setattr(house, "figures", lambda it: [Figure("rooms", len(it.rooms), limit, None, "children")])
    assert house.main(["--list"]) == code
    assert "learners         3 lines   imports risks" in capsys.readouterr().out


def test_the_picture_names_every_room_but_draws_no_arrow_to_the_ground(build, tmp_path):
    draw(build(learners="from .base.arrays import Array\nfrom .risks import Moments"), tmp_path / "house.svg")
    picture = (tmp_path / "house.svg").read_text()
    assert all(f"<!-- {room} -->" in picture for room in ("base", "learners", "risks"))


@pytest.fixture(scope="module")
def ours():
    return House(house.SOURCE)


def test_our_rooms_do_not_import_each_other_in_a_circle(ours):
    assert house.circle(ours) == []


def test_our_rooms_each_say_what_they_are_for(ours):
    assert all(0 < len(ours.caption(room)) <= 100 for room in ours.rooms)

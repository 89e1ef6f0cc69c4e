"""One C99 file for a policy, with fixed sizes, no allocation and no state."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import singledispatch
from importlib import resources
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base import files
from ..base.arrays import Array
from ..base.errors import SettingError
from ..models import ClosedForm, spaces

TOLERANCE = 1e-9
"""The self-test allows this share of the largest action: mathematics libraries differ in the last digit of ``exp``."""


SELF_TESTS = 16
"""States inside the data, and as many far outside, that the self-test of an exported file looks at."""

FAR = 100.0
"""How far outside, as a multiple of the policy's reach; for a polynomial, whose actions grow faster, its root."""


def export_c(form: ClosedForm, policy: Callable[[Array], Array], path: str | os.PathLike[str], name: str) -> None:
    """Write :func:`c_source` to a file, with a self-test that compares it with the policy."""
    states = _probes(form)
    files.write(path, c_source(form, name, states, policy(states)))


def c_source(form: ClosedForm, name: str, states: Array, actions: Array) -> str:
    """C99 source of ``void NAME_step(const double state[n], double action[d])``.

    Constants are hexadecimal, so that no digit is lost. The file needs
    nothing but ``exp``, where states are angles also ``sin`` and ``cos``, from
    the standard library. With ``NAME_SELF_TEST`` defined, in capitals, it has a
    ``main`` that compares itself with the given actions.

    Parameters
    ----------
    form : ClosedForm
    name : str
        A C identifier.
    states, actions : ndarray, shape (K, n) and (K, d)
        What the self-test looks at, and what it expects there.

    Raises
    ------
    SettingError
        If the name is none in C.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise SettingError(f"name: got {name!r}, expected a name in C: a letter, then letters, digits, underscores.")
    (m, d, models), n, straight = form.sizes, states.shape[1], form.embedding.frame is None
    defined = f"void {name}_step(const double state[{n}]"
    if not straight:
        defined = f"static void {name}_of_coordinates(const double state[{m}]"
    fill = {
        "name": name,
        "NAME": name.upper(),
        "macro": f"{name.upper()}_SELF_TEST",
        "version": _version(),
        "what": f"{n} states to {d} actions, {models} model{'s' * (models > 1)}",
        "n": str(n),
        "d": str(d),
        "models": str(models),
        "more": "" if straight else f", {name.upper()}_COORDINATES = {m}",
        "inputs": "STATES" if straight else "COORDINATES",
        "needs": "exp()" if straight else "exp(), sin() and cos()",
        "defined": f"{defined}, double action[{d}])",
        "frame": "" if form.embedding.frame is None else _braced(form.embedding.frame),
        "own": "\n".join(_own_coordinates(form, name)),
        "rotation": _braced(spaces.ROTATION),
        "tests": str(len(states)),
        "origin": _braced(form.origin),
        "maps": _braced(form.maps if form.is_affine else form.maps[:, :, 0]),
        "slopes": "" if form.exponents is None else _braced(form.exponents),
        "terms": str(form.maps.shape[2]),
        "degree": str(form.degree),
        "monomials": "" if form.monomials is None else _braced(form.monomials, str),
        "test_states": _braced(states),
        "test_actions": _braced(actions),
        "tolerance": float(TOLERANCE * np.abs(actions).max()).hex(),
    }
    source = "".join(_template(part) for part in ("head", *_body(form), *_end(form), "self_test"))
    return re.sub(r"@([a-z_]+|NAME)@", lambda found: fill[found[1]], source)


def _body(form: ClosedForm) -> tuple[str, ...]:
    """Names of the templates that are the policy."""
    if form.exponents is not None:
        return "shares", "maps" if form.is_affine else "constants"
    return ("affine",) if form.monomials is None else ("polynomial",)


def _end(form: ClosedForm) -> tuple[str, ...]:
    """Names of the templates between the policy of coordinates and that of states."""
    if form.embedding.frame is None:
        return ()
    return "rotation", "coordinates"


def _own_coordinates(form: ClosedForm, name: str) -> Iterator[str]:
    """Statements that set the coordinates ``own`` of the ``state``, before they are turned."""
    column = place = 0
    for factor in form.embedding.space.factors:
        columns, size, _ = factor.sizes
        yield from _statements(factor, [f"state[{column + i}]" for i in range(columns)], place, name)
        column, place = column + columns, place + size


@singledispatch
def _statements(_: spaces.Space, states: Sequence[str], place: int, _name: str) -> list[str]:
    return [f"    own[{place + i}] = {state};" for i, state in enumerate(states)]


@_statements.register(spaces.Circle)
def _of_angle(space: spaces.Circle, states: Sequence[str], place: int, _name: str) -> list[str]:
    radius = _hexadecimal(space.radius)
    pairs = enumerate(("cos", "sin"), place)
    return [f"    own[{i}] = {radius} * {function}({states[0]} / {radius});" for i, function in pairs]


@_statements.register(spaces.Sphere)
def _of_quaternion(space: spaces.Sphere, states: Sequence[str], place: int, name: str) -> list[str]:
    return [f"    {name}_rotation({', '.join(states[i] for i in space.places)}, own + {place});"]


def _template(part: str) -> str:
    """C with ``@WORDS@`` to fill in."""
    return (resources.files(__package__) / "templates" / f"{part}.c.in").read_text()


def _hexadecimal(value: float) -> str:
    return (float(value) + 0.0).hex()  # adding zero makes a minus zero plain


def _probes(form: ClosedForm) -> Array:
    """States for a self-test, inside and far outside, the same for the same policy."""
    drawn = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * SELF_TESTS, len(form.origin)))
    drawn[SELF_TESTS:] *= FAR ** (1 / form.degree)
    return form.embedding.states(form.origin + form.reach * drawn)


def _braced(values: NDArray[Any], said: Callable[[Any], str] = _hexadecimal) -> str:
    """An initialiser, by rows."""
    if np.ndim(values) > 1:
        return "{\n" + ",\n".join(_braced(row, said) for row in values) + "}"
    return "{" + ", ".join(map(said, values)) + "}"


def _version() -> str:
    try:
        return version("unconstrain")
    except PackageNotFoundError:
        return "from its sources"

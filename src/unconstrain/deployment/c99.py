"""A policy in C: a source file and its header, with fixed sizes, no allocation and no state."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial, singledispatch
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base import files
from ..base.arrays import Array
from ..base.errors import SettingError
from ..models import ClosedForm, spaces
from .description import Description
from .filling import filled, own_version

TOLERANCE = 1e-9
"""The self-test allows this share of the largest action: mathematics libraries differ in the last digit of ``exp``."""

TOLERANCE_SINGLE = 1e-5
"""The same in single precision."""

SELF_TESTS = 16
"""States inside the data, and as many far outside, that the self-test of an exported file looks at."""

FAR = 100.0
"""How far outside, as a multiple of the policy's reach; for a polynomial, whose actions grow faster, its root."""


class Source(NamedTuple):
    """A header and the source that it belongs to; the source begins with the header, and needs no other file."""

    header: str
    source: str


def export_c(
    form: ClosedForm,
    policy: Callable[[Array], Array],
    path: str | os.PathLike[str],
    name: str | None,
    described: Description,
    *,
    single: bool = False,
) -> str:
    """Write :func:`c_source` to a file and its header beside it, with a self-test; return what names in it begin with.

    The name is by default as the file is called. A header that is there is replaced, as the file is.

    Raises
    ------
    SettingError
        If the path is that of a header, and as :func:`c_source` does.
    """
    place = Path(path)
    if place.suffix == ".h":
        raise SettingError(f"{path}: got the name of a header, expected that of the source, such as {place.stem}.c.")
    name = c_name(place.stem) if name is None else name
    made = c_source(form, name, policy, described, place.name, single=single)
    files.write(place, made.source)
    files.write(place.with_suffix(".h"), made.header)
    return name


def c_name(stem: str) -> str:
    """A name in C that is like that of a file."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_")
    return plain if plain[:1].isalpha() else f"policy_{plain}".rstrip("_")


def c_source(
    form: ClosedForm,
    name: str,
    policy: Callable[[Array], Array],
    described: Description,
    file: str = "FILE.c",
    *,
    single: bool = False,
) -> Source:
    """Source and header of ``void NAME_step(const double state[n], double action[d])`` and what belongs to it.

    Constants have all digits. The file needs nothing but ``exp``, for angles ``sin`` and ``cos``, and for a guided
    policy ``sqrt``, from the standard library. The self-test expects what the policy says.

    Raises
    ------
    SettingError
        If the name is none in C, or a number is too large for a ``float``.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise SettingError(f"name: got {name!r}, expected a name in C: a letter, then letters, digits, underscores.")
    fill = {"name": name, "NAME": name.upper(), "macro": f"{name.upper()}_SELF_TEST", "file": file}
    fill |= _sizes(form, described) | _numbers(form, name, policy, single)
    said = _single if single else _double
    fill |= {"speed_limit": said(speed_limit(form, policy, described))} | _correction(form, name, said)
    fill["under"] = filled("under.h", fill) if form.correction else ""
    header = filled("header.h", fill)
    return Source(header, header + "\n" + "".join(filled(f"{part}.c", fill) for part in _parts(form)))


def _parts(form: ClosedForm) -> tuple[str, ...]:
    """Names of the templates that the source consists of."""
    turns = any(isinstance(factor, spaces.Sphere) for factor in form.embedding.space.factors)
    relative = ("straight",) if form.embedding.frame is None else (*["rotation"][:turns], "coordinates")
    kernels = () if form.exponents is None else ("kernels",)
    if form.blending is not None:
        body: tuple[str, ...] = ("shares", "maps" if form.is_affine else "constants")
    else:
        body = ("affine",) if form.monomials is None else ("polynomial",)
    guided = () if form.correction is None else ("potential", form.correction.kind, "guided")
    return "head", *relative, *kernels, *body, *guided, "within" if form.precisions is None else "support", "self_test"


def _correction(form: ClosedForm, name: str, said: Callable[[Any], str]) -> dict[str, str]:
    """What templates say of a guided policy; ``step`` is the function of the policy in it."""
    if form.correction is None:
        return {"step": f"void {name}_step"}
    tables = {key: _braced(table, said) for key, table in form.correction.tables.items()}
    numbers = {key: said(value) for key, value in form.correction.numbers.items()}
    return {"step": f"static void {name}_wanted", "slopes_of_v": str(len(form.correction.weights)), **tables, **numbers}


def _sizes(form: ClosedForm, described: Description) -> dict[str, str]:
    """What templates say of the policy in whole numbers and words."""
    (m, d, models), n = form.sizes, form.columns
    needs = [] if form.exponents is None else ["exp()"]
    needs += [] if form.embedding.frame is None else ["sin()", "cos()"]
    needs += [] if form.correction is None else ["sqrt()"]
    kernels = "How near to the data a state is: from 1 to 0 far from all of it."
    box = "1 where each coordinate is within the reach of the data, else 0: more is not known of such a policy."
    return {
        "version": own_version(),
        "what": f"{n} states to {d} actions, {models} model{'s' * (models > 1)}",
        "about": "\n".join(f" * {line}" for line in described.comment()),
        "support_is": box if form.precisions is None else kernels,
        "needs": ", ".join(needs) or "nothing",
        "n": str(n),
        "d": str(d),
        "m": str(m),
        "models": str(models),
        "kernels": "" if form.exponents is None else str(len(form.exponents)),
        "terms": str(form.maps.shape[2]),
        "degree": str(form.degree),
    }


def _numbers(form: ClosedForm, name: str, policy: Callable[[Array], Array], single: bool) -> dict[str, str]:
    """What templates say in numbers of the asked precision."""
    said = _single if single else _double
    braced = partial(_braced, said=said)
    states = _probes(form)
    states = states.astype(np.float32).astype(np.float64) if single else states
    actions = policy(states)
    tolerance = (TOLERANCE_SINGLE if single else TOLERANCE) * np.abs(actions).max()
    optional = {"slopes": form.exponents, "precisions": form.precisions, "frame": form.embedding.frame}
    return {key: "" if table is None else braced(table) for key, table in optional.items()} | {
        "real": "float" if single else "double",
        "f": "f" if single else "",
        "origin": braced(form.origin),
        "reach": braced(form.within),
        "limits": braced(_limits(form)),
        "maps": braced(form.maps),
        "map": braced(form.maps[0]),
        "constants": braced(form.maps[:, :, 0]),
        "monomials": "" if form.monomials is None else _braced(form.monomials, str),
        "rotation": braced(spaces.ROTATION),
        "own": "\n".join(_own_coordinates(form, name, said)),
        "tests": str(len(states)),
        "test_states": braced(states),
        "test_actions": braced(actions),
        "tolerance": _double(tolerance),
    }


def _limits(form: ClosedForm) -> Array:
    """Range of each state column in the data, (n, 2); without an end for angles and orientations."""
    ends = np.column_stack([form.origin - form.within, form.origin + form.within])
    if form.embedding.frame is None:
        return ends
    parts, place = [], 0
    for factor in form.embedding.space.factors:
        columns, size, _ = factor.sizes
        straight = isinstance(factor, spaces.Euclidean)
        parts.append(ends[place : place + size] if straight else np.tile([-np.inf, np.inf], (columns, 1)))
        place += size
    return np.concatenate(parts)


def speed_limit(form: ClosedForm, policy: Callable[[Array], Array], described: Description) -> float:
    """No action demonstrated was larger, nor one of the policy at a kernel's centre, or within half of the reach."""
    if form.exponents is None or form.precisions is None:
        z = form.reach * np.random.default_rng(0).uniform(-0.5, 0.5, (SELF_TESTS, len(form.origin)))
    else:
        z = form.exponents[:, :-1] / form.precisions
    own = np.linalg.norm(policy(form.embedding.states(form.origin + z)), axis=1)
    return max(described.fastest, float(own.max()))


def _own_coordinates(form: ClosedForm, name: str, said: Callable[[Any], str]) -> Iterator[str]:
    """Statements that set the coordinates ``own`` of the ``state``, before they are turned."""
    column = place = 0
    for factor in form.embedding.space.factors:
        columns, size, _ = factor.sizes
        yield from _statements(factor, [f"state[{column + i}]" for i in range(columns)], place, name, said)
        column, place = column + columns, place + size


@singledispatch
def _statements(
    _: spaces.Space, states: Sequence[str], place: int, _name: str, _said: Callable[[Any], str]
) -> list[str]:
    return [f"    own[{place + i}] = {state};" for i, state in enumerate(states)]


@_statements.register(spaces.Circle)
def _of_angle(
    space: spaces.Circle, states: Sequence[str], place: int, _name: str, said: Callable[[Any], str]
) -> list[str]:
    radius, f = said(space.radius), "f" if said is _single else ""
    pairs = enumerate(("cos", "sin"), place)
    return [f"    own[{i}] = {radius} * {function}{f}({states[0]} / {radius});" for i, function in pairs]


@_statements.register(spaces.Sphere)
def _of_quaternion(
    space: spaces.Sphere, states: Sequence[str], place: int, name: str, _said: Callable[[Any], str]
) -> list[str]:
    return [f"    {name}_rotation({', '.join(states[i] for i in space.places)}, own + {place});"]


def _double(value: float) -> str:
    """A number with all its digits."""
    plain = repr(float(value) + 0.0)  # adding zero makes a minus zero plain
    return plain.replace("inf", "HUGE_VAL")


def _single(value: float) -> str:
    """A number as a ``float``."""
    near = np.float32(min(max(float(value), -_LARGEST), _LARGEST)) + np.float32(0.0)
    if np.isfinite(value) and abs(value) > _LARGEST:
        raise SettingError(f"float: {value:.3g} is too large for it. Export in double precision, or change the units.")
    return f"{near}f" if np.isfinite(value) else str(value).replace("inf", "HUGE_VALF")


_LARGEST = float(np.finfo(np.float32).max)


def _probes(form: ClosedForm) -> Array:
    """States for a self-test, inside and far outside, the same for the same policy."""
    drawn = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * SELF_TESTS, len(form.origin)))
    drawn[SELF_TESTS:] *= FAR ** (1 / form.degree)
    return form.embedding.states(form.origin + form.reach * drawn)


def _braced(values: NDArray[Any], said: Callable[[Any], str]) -> str:
    """An initialiser, by rows."""
    if np.ndim(values) > 1:
        return "{\n" + ",\n".join(_braced(row, said) for row in values) + "}"
    return "{" + ", ".join(map(said, values)) + "}"

"""A policy as one JavaScript module, for pages and whatever runs them."""

import json
import os
from functools import singledispatch
from typing import Any

from ..base import files
from ..models import ClosedForm, spaces
from .description import Description
from .filling import filled, template


def export_javascript(form: ClosedForm, path: str | os.PathLike[str], described: Description) -> None:
    """Write an ES module that exports what :func:`javascript` offers."""
    (_, d, models), n = form.sizes, form.columns
    fill = {
        "what": f"{n} states to {d} actions, {models} model{'s' * (models > 1)}",
        "about": "\n".join(f" * {line}" for line in described.comment()),
        "n": str(n),
        "d": str(d),
        "runtime": template("policy.js"),
        "formula": formula(form),
    }
    files.write(path, filled("policy.js", fill))


def javascript(form: ClosedForm) -> str:
    """JavaScript expression of an object with functions ``policy``, ``support``, and ``under`` of a projection as well.

    Where there are no kernels, ``support`` is 1 within the reach of the data and 0 outside.
    """
    return f"(function () {{\n{template('policy.js')}\nreturn policyOf({formula(form)});\n}})()"


def formula(form: ClosedForm) -> str:
    """The numbers of a formula as JSON, of which no digit is lost."""
    plain: dict[str, Any] = {"origin": form.origin.tolist(), "maps": form.maps.tolist()}
    more = {"exponents": form.exponents, "monomials": form.monomials, "precision": form.precisions}
    plain |= {name: values.tolist() for name, values in more.items() if values is not None}
    plain |= {} if form.precisions is not None else {"reach": form.within.tolist()}
    if form.embedding.frame is not None:
        plain["frame"] = form.embedding.frame.tolist()
        plain["factors"] = [_factor(factor) for factor in form.embedding.space.factors]
    if form.correction is not None:
        tables = {name: table.tolist() for name, table in form.correction.tables.items()}
        plain["correction"] = {"kind": form.correction.kind, **tables, **form.correction.numbers}
    return json.dumps(plain, allow_nan=False)


@singledispatch
def _factor(space: spaces.Space) -> dict[str, Any]:
    return {"columns": space.sizes[0]}


@_factor.register(spaces.Circle)
def _circle(space: spaces.Circle) -> dict[str, Any]:
    return {"columns": 1, "radius": float(space.radius)}


@_factor.register(spaces.Sphere)
def _sphere(space: spaces.Sphere) -> dict[str, Any]:
    return {"columns": 4, "places": list(map(int, space.places))}

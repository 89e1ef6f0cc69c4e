"""A policy as an ONNX graph, for any number of states at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial, reduce, singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, require_extra
from ..models import ClosedForm, Correction, spaces
from .description import Description

OPSET = 17
"""Of the standard operators; runtimes of 2022 know it."""

IR_VERSION = 8


def onnx_model(form: ClosedForm, described: Description, *, single: bool) -> bytes:
    """Serialised graph of standard operators, from ``states`` (N, n) to ``actions`` (N, d) and ``support`` (N,)."""
    require_extra("onnx", "onnx")
    from onnx import TensorProto, checker, helper

    n, d, _ = form.sizes
    to = "actions" if form.correction is None else "wanted"
    graph = _Graph(np.float32 if single else np.float64)
    relative = graph.add("Sub", _coordinates(graph, form), graph.constant("origin", form.origin))
    kernels = form.exponents
    exponents = "" if kernels is None else graph.affine(relative, kernels[:, :n].T, kernels[:, n], "exponents")
    if form.blending is not None:
        _blended(graph, form, relative, graph.add("Softmax", exponents, axis=-1), to)
    elif form.monomials is not None:
        _polynomial(graph, form, relative, form.monomials, to)
    else:
        graph.affine(relative, form.maps[0, :, :n].T, form.maps[0, :, n], "map", to=to)
    if form.correction is not None:
        _corrected(graph, form.correction)
    _supported(graph, form, relative, exponents)
    kind = TensorProto.FLOAT if single else TensorProto.DOUBLE
    taken = {"states": ["N", form.columns]} | ({} if form.correction is None else {"projections": ["M", d, d]})
    given, told = (
        [helper.make_tensor_value_info(name, kind, size) for name, size in of.items()]
        for of in (taken, {"actions": ["N", d], "support": ["N"]})
    )
    made = helper.make_graph(graph.nodes, "unconstrain_policy", given, told, graph.constants)
    model = helper.make_model(
        made, producer_name="unconstrain", opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION
    )
    helper.set_model_props(model, described.whole)
    checker.check_model(model, full_check=True)
    return bytes(model.SerializeToString())


def _supported(graph: _Graph, form: ClosedForm, relative: str, exponents: str) -> None:
    """The ``support`` as :meth:`~unconstrain.ClosedForm.support` has it."""
    zero = graph.constant("none", np.array(0.0))
    if form.precisions is None or not exponents:
        beyond = graph.add("Sub", graph.add("Abs", relative), graph.constant("within", form.within))
        inside = graph.add("LessOrEqual", graph.add("ReduceMax", beyond, axes=[1], keepdims=0), zero)
        graph.add("Where", inside, graph.constant("one", np.array(1.0)), zero, to="support")
        return
    halves = graph.constant("halves", 0.5 * form.precisions)
    far = graph.add("MatMul", graph.add("Mul", relative, relative), halves)
    nearest = graph.add("Sub", graph.add("ReduceMax", exponents, axes=[1], keepdims=0), far)
    graph.add("Exp", graph.add("Min", nearest, zero), to="support")


def _coordinates(graph: _Graph, form: ClosedForm) -> str:
    """Coordinates of the ``states``, which are these themselves where no angle is among them."""
    frame, column, own = form.embedding.frame, 0, list[str]()
    if frame is None:
        return "states"
    for factor in form.embedding.space.factors:
        stop = column + factor.sizes[0]
        own.append(_own_coordinates(factor, graph, np.arange(column, stop), f"column_{column}"))
        column = stop
    return graph.add("MatMul", graph.add("Concat", *own, axis=1), graph.constant("frame", frame.T))


@singledispatch
def _own_coordinates(_: spaces.Space, graph: _Graph, columns: NDArray[np.intp], name: str) -> str:
    return graph.gathered(columns, name)


@_own_coordinates.register(spaces.Circle)
def _of_angle(space: spaces.Circle, graph: _Graph, columns: NDArray[np.intp], name: str) -> str:
    radius = graph.constant(f"{name}_radius", np.array(space.radius))
    quarter = graph.constant(f"{name}_quarter", np.array([np.pi / 2, 0.0]))  # runtimes lack a double cosine
    angles = graph.add("Add", graph.add("Div", graph.gathered(columns, name), radius), quarter)
    return graph.add("Mul", graph.add("Sin", angles), radius)


@_own_coordinates.register(spaces.Sphere)
def _of_quaternion(space: spaces.Sphere, graph: _Graph, columns: NDArray[np.intp], name: str) -> str:
    first, second = columns[space.places][spaces.PAIRS.T]
    products = graph.add("Mul", graph.gathered(first, f"{name}_first"), graph.gathered(second, f"{name}_second"))
    length = graph.constant(f"{name}_length", np.eye(10)[:4].sum(axis=0)[:, None])
    unit = graph.add("Div", products, graph.add("MatMul", products, length))
    return graph.add("MatMul", unit, graph.constant(f"{name}_rotation", spaces.ROTATION.T))


def _blended(graph: _Graph, form: ClosedForm, relative: str, shares: str, to: str) -> None:
    n, d, models = form.sizes
    maps = graph.constant("maps", form.maps.reshape(models, -1))
    if not form.is_affine:
        graph.add("MatMul", shares, maps, to=to)
        return
    # Each row of the blended map times (z, 1), without a change of shape: a runtime takes longer to begin with
    # a node than to do what little is in it.
    blend = graph.add("MatMul", shares, maps)
    tiled = graph.affine(relative, np.tile(np.eye(n, n + 1), (1, d)), np.tile(np.eye(n + 1)[n], d), "tiled")
    graph.add(
        "MatMul", graph.add("Mul", blend, tiled), graph.constant("sum", np.repeat(np.eye(d), n + 1, axis=0)), to=to
    )


def _polynomial(graph: _Graph, form: ClosedForm, relative: str, monomials: NDArray[np.intp], to: str) -> None:
    n = len(form.origin)
    whole = graph.affine(relative, np.eye(n, n + 1), np.eye(n + 1)[n], "whole")  # (z, 1)
    factors = [
        graph.add("Gather", whole, graph.constant(f"factor_{place}", column.astype(np.int64)), axis=1)
        for place, column in enumerate(monomials.T)
    ]
    terms = reduce(partial(graph.add, "Mul"), factors)
    graph.add("MatMul", terms, graph.constant("map", form.maps[0].T), to=to)


def _corrected(graph: _Graph, correction: Correction) -> None:
    """From what is ``wanted`` to ``actions`` under ``projections`` (M, n, n), M = 1 or N; by default nothing holds."""
    goal, steep = correction.goal, correction.weights[:, None] * correction.directions
    projections = graph.constant("projections", np.eye(len(goal))[None])
    column = graph.constant("column", np.array([2]))

    def held(vectors: str) -> str:
        return graph.add("Squeeze", graph.add("MatMul", projections, graph.add("Unsqueeze", vectors, column)), column)

    z = graph.add("Sub", "states", graph.constant("goal", goal))
    beyond = graph.add("Relu", graph.affine(z, correction.directions.T, -correction.offsets, "beyond"))
    squares, weights = graph.add("Mul", beyond, beyond), graph.constant("weights", correction.weights[:, None])
    slope = held(graph.add("MatMul", beyond, graph.constant("steep", steep)))
    number = {name: graph.constant(name, np.array(value)) for name, value in correction.numbers.items()}
    if correction.kind == "descent":
        _descended(graph, number, held("wanted"), slope)
        return
    turning = held(graph.add("MatMul", z, graph.constant("turn", correction.turn.T)))
    _circled(graph, number, held("wanted"), slope, turning, graph.add("MatMul", squares, weights))


def _descended(graph: _Graph, number: Mapping[str, str], v: str, slope: str) -> None:
    add, zero, two = graph.add, *(graph.constant(f"number_{each}", np.array(float(each))) for each in (0, 2))
    half = add("Div", slope, two)
    away = add("Add", v, half)
    distance, depth = graph.length(away), graph.length(half)
    allowed = add("Max", add("Sub", depth, number["pace"]), add("Div", depth, two))
    usual = add("Sqrt", add("Add", graph.inner(v, v), add("Mul", number["pace"], number["pace"])))
    climb = add("Div", add("Max", graph.inner(v, half), zero), add("Max", add("Mul", depth, usual), graph.tiny()))
    further = add("Mul", add("Mul", climb, climb), add("Sub", distance, allowed))
    share = add("Div", add("Sub", allowed, further), add("Max", distance, graph.tiny()))
    moved = add("Sub", add("Mul", add("Max", share, zero), away), half)
    add("Where", add("LessOrEqual", distance, allowed), v, moved, to="actions")


def _circled(graph: _Graph, number: Mapping[str, str], v: str, slope: str, turning: str, twice: str) -> None:
    add, one, two = graph.add, *(graph.constant(f"number_{each}", np.array(float(each))) for each in (1, 2))
    steep, width = graph.length(slope), add("Mul", number["middle"], add("Sqrt", add("Max", twice, number["level"])))
    off = add("Div", add("Sub", twice, number["level"]), add("Mul", two, add("Max", steep, width)))
    outward = add("Div", slope, add("Max", steep, graph.tiny()))
    speed, ends = graph.inner(outward, v), [add("Neg", add("Mul", number[name], off)) for name in ("slow", "fast")]
    radial = add("Max", add("Min", *ends), add("Min", speed, add("Max", *ends)))
    along = add("Sub", turning, add("Mul", graph.inner(outward, turning), outward))
    pace = graph.length(along)
    longest = add("Max", pace, add("Mul", number["rate"], width))
    now = add("Div", graph.inner(along, v), longest)
    low, high = (add("Mul", number[name], pace) for name in ("least", "most"))
    kept = add("Sub", add("Max", low, add("Min", now, high)), now)
    moved = add("Sum", v, add("Mul", add("Div", kept, longest), along), add("Mul", add("Sub", radial, speed), outward))
    add("Mul", add("Min", one, add("Div", steep, width)), moved, to="actions")


class _Graph:
    """Nodes and constants, as they come."""

    def __init__(self, dtype: type[np.floating[Any]]) -> None:
        self.dtype = dtype
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, name: str, values: Any) -> str:
        from onnx import numpy_helper

        table = np.asarray(values)
        kind = table.dtype if np.issubdtype(table.dtype, np.integer) else self.dtype
        if not any(each.name == name for each in self.constants):
            self.constants.append(numpy_helper.from_array(np.ascontiguousarray(table, kind), name))
        return name

    def add(self, operator: str, *inputs: str, to: str = "", **settings: Any) -> str:
        from onnx import helper

        result = to or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [result], **settings))
        return result

    def inner(self, one: str, other: str) -> str:
        """Inner products (N, 1) of rows."""
        axis = self.constant("axis", np.array([1]))
        return self.add("ReduceSum", self.add("Mul", one, other), axis, keepdims=1)

    def length(self, vectors: str) -> str:
        """Lengths (N, 1) of rows."""
        return self.add("Sqrt", self.inner(vectors, vectors))

    def tiny(self) -> str:
        """What a length is at least where it divides."""
        return self.constant("tiny", np.array(1e-30))

    def gathered(self, columns: NDArray[np.intp], name: str) -> str:
        """Some columns of the states."""
        return self.add("Gather", "states", self.constant(name, columns.astype(np.int64)), axis=1)

    def affine(self, of: str, slopes: Array, offsets: Array, name: str, to: str = "") -> str:
        parts = self.constant(f"{name}_slopes", slopes), self.constant(f"{name}_offsets", offsets)
        return self.add("Gemm", of, *parts, to=to)

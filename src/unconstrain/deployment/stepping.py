"""One state at a time, in Python, with nothing but the arithmetic."""

from collections.abc import Callable
from dataclasses import replace
from threading import local
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.arrays import Array
from ..base.errors import InvalidDataError
from ..models import ClosedForm, Model, Scale, spaces

Step: TypeAlias = Callable[[ArrayLike, Array | None], Array]
"""From a state (n,) to an action (d,), written into the second argument if that is given."""


def stepper(model: Model, weights: Array, n: int, scale: Scale | None = None) -> Step:
    """Prepare a policy for single states.

    Each thread has its own buffers, made on its first call; after that only
    the answer is allocated. Numbers are not checked: NaN gives NaN.

    Parameters
    ----------
    model : Model
        Without a formula (:class:`~unconstrain.ClosedForm`) a step has the price of the features.
    weights : ndarray, shape (M, d, p)
    n : int
        Dimension of the states.
    scale : Scale, optional
        Units in which model and weights are.

    Returns
    -------
    callable
        Raises InvalidDataError for a state of another shape than (n,).
    """
    form = model.fields.formula(model.features, weights)
    if form is None:
        units = scale or Scale(np.ones(n), np.ones(weights.shape[1]))
        return _without_formula(model, units.actions[:, None] * weights[0], units.states)
    form = replace(form, embedding=model.embedding) if scale is None else scale.form(form)
    if form.blending is not None:
        return _blended(form, form.blending)
    return _affine(form) if form.monomials is None else _polynomial(form, form.monomials)


def _without_formula(model: Model, weights: Array, units: Array) -> Step:
    relative, dot = _relative_to(np.zeros(len(units)), spaces.Embedding()), np.dot

    def step(state: ArrayLike, out: Array | None = None) -> Array:
        row = np.empty((1, len(units)))
        relative(state, row[0])
        return dot(weights, model.design(row / units)[0], out)

    return step


def _affine(form: ClosedForm) -> Step:
    n, d, _ = form.sizes
    relative, dot = _relative_to(form.origin, form.embedding), np.dot
    whole = np.ascontiguousarray(form.maps[0])
    buffers = _PerThread(n, 0, d)

    def step(state: ArrayLike, out: Array | None = None) -> Array:
        z, head, _, _ = buffers.own
        relative(state, head)
        return dot(whole, z, out)

    return step


def _polynomial(form: ClosedForm, monomials: NDArray[np.intp]) -> Step:
    relative, take, multiply, dot = _relative_to(form.origin, form.embedding), np.take, np.multiply, np.dot
    whole, (first, *others) = np.ascontiguousarray(form.maps[0]), np.ascontiguousarray(monomials.T)
    buffers = _PerThread(len(form.origin), len(monomials), len(monomials))

    def step(state: ArrayLike, out: Array | None = None) -> Array:
        z, head, terms, factors = buffers.own
        relative(state, head)
        take(z, first, 0, terms, "clip")  # other modes would make a buffer of their own
        for which in others:
            multiply(terms, take(z, which, 0, factors, "clip"), terms)
        return dot(whole, terms, out)

    return step


def _blended(form: ClosedForm, exponents: Array) -> Step:
    n, d, models = form.sizes
    relative, affine = _relative_to(form.origin, form.embedding), form.is_affine
    exp, dot, divide = np.exp, np.dot, np.divide
    # A column of ones, so that one product gives the blend and the sum of the shares.
    slopes, maps = np.ascontiguousarray(exponents), np.column_stack([form.maps.reshape(models, -1), np.ones(models)])
    buffers = _PerThread(n, models, maps.shape[1])

    def step(state: ArrayLike, out: Array | None = None) -> Array:
        z, head, e, sums = buffers.own
        relative(state, head)
        dot(slopes, z, e)
        e -= e[e.argmax()]
        exp(e, e)
        dot(e, maps, sums)
        blend = dot(sums[:-1].reshape(d, n + 1), z) if affine else sums[:-1]
        return divide(blend, sums[-1:], out)

    return step


def _relative_to(origin: Array, embedding: spaces.Embedding) -> Callable[[ArrayLike, Array], None]:
    subtract, n, straight = np.subtract, embedding.states(origin[None]).shape[1], embedding.frame is None

    def relative(state: ArrayLike, out: Array) -> None:
        try:
            if len(state) == n:  # type: ignore[arg-type]  # what has no length is refused below
                subtract(state if straight else embedding(np.asarray([state], np.float64))[0], origin, out)
                return
        except (TypeError, ValueError):
            pass
        raise InvalidDataError(f"step: got a state of shape {np.shape(state)}, expected {n} numbers.")

    return relative


class _PerThread(local):
    """Buffers: (z, 1), its first n entries, exponents or monomials, sums or factors."""

    def __init__(self, n: int, models: int, sums: int) -> None:
        z = np.ones(n + 1)
        self.own = z, z[:n], np.empty(models), np.empty(sums)

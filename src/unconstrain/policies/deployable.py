"""A fitted policy leaves the estimator framework: single steps, C, ONNX."""

from __future__ import annotations

import os
from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..base import files
from ..base.arrays import Array
from ..base.errors import SettingError
from ..deployment import Step, c_source, onnx_model, stepper, stepper_on
from ..learners import Solution
from ..models import ClosedForm

__all__ = ["Deployable"]

SELF_TESTS = 16
"""States inside the data, and as many far outside, that the self-test of an exported file looks at."""

FAR = 100.0
"""How far outside, as a multiple of the policy's reach."""


class Deployable:
    """What a policy can do without its estimator."""

    solution_: Solution
    n_features_in_: int
    n_outputs_: int
    _prepared: tuple[Solution, Step] | None

    @abstractmethod
    def __call__(self, states: ArrayLike) -> Array:
        """Actions (N, d) at states (N, n)."""

    @abstractmethod
    def _features(self, states: Array) -> Array:
        """Features φ(x), shape (N, p)."""

    @abstractmethod
    def _closed_form(self) -> ClosedForm | None:
        """The fitted policy as one formula, None where its features have none."""

    def step(self, x: ArrayLike, out: Array | None = None) -> Array:
        """Predict for one state, without overhead: for control loops.

        The same as :meth:`predict` to rounding. It is prepared on the first
        call after each fit. Any number of threads may call it at once, also
        while one of them learns by :meth:`partial_fit`; each step is then by
        the old or by the new solution, never by half of each.

        Parameters
        ----------
        x : array_like, shape (n,)
            Not checked: NaN gives NaN.
        out : ndarray, shape (d,), optional
            Written to and returned; without it the result is a new array.

        Returns
        -------
        ndarray, shape (d,)

        Raises
        ------
        InvalidDataError
            If the state is not of shape (n,).
        """
        known = self.__dict__
        prepared = known.get("_prepared")
        if prepared is None or prepared[0] is not known.get("solution_"):
            prepared = self._prepare_step()
        return prepared[1](x, out)

    def closed_form(self) -> ClosedForm:
        """The policy as one formula: what is exported, and what other targets can be made from.

        Raises
        ------
        SettingError
            If the features are a callable that does not say its formula.
        """
        check_is_fitted(self, "solution_")
        form = self._closed_form()
        if form is None:
            features = getattr(self, "features_", None)
            name = getattr(features, "__name__", type(features).__name__)
            raise SettingError(
                f"cannot export a policy on the features {name}: they are Python code. Can be exported are locally "
                "linear policies, and parametric ones on Affine, NormalisedRBF or KMeansRBF features, or on features "
                "that offer closed_form(weights) -> unconstrain.ClosedForm."
            )
        return form

    def export_c(self, path: str | os.PathLike[str], name: str | None = None) -> None:
        """Write the policy as one C99 file that needs only ``exp`` of the standard library.

        It defines ``void NAME_step(const double state[n], double action[d])``
        and, with ``NAME_SELF_TEST`` (in capitals) defined, a ``main`` that
        compares itself with :meth:`predict`.

        Parameters
        ----------
        path : str or path-like
        name : str, optional
            A C identifier; ``"policy"`` by default.

        Raises
        ------
        SettingError
            If the features cannot be exported (:meth:`closed_form`), or the name is none in C.
        """
        form = self.closed_form()
        states = _probes(form)
        source = c_source(form, "policy" if name is None else name, states, self(states))
        files.write(path, source)

    def export_onnx(self, path: str | os.PathLike[str]) -> None:
        """Write the policy as an ONNX graph, ``states`` (N, n) to ``actions`` (N, d), in float64.

        Raises
        ------
        MissingExtraError
            If ``onnx`` is not installed; it comes with ``unconstrain[onnx]``.
        SettingError
            If the features cannot be exported (:meth:`closed_form`).
        """
        files.write(path, onnx_model(self.closed_form()))

    def _prepare_step(self) -> tuple[Solution, Step]:
        check_is_fitted(self, "solution_")
        solution = self.solution_
        form = self._closed_form()
        # What another thread has learnt meanwhile is prepared at the next step: the solution is then another.
        step = stepper(form) if form else stepper_on(self._features, solution.weights[0], self.n_features_in_)
        self._prepared = solution, step
        return self._prepared

    def __getstate__(self) -> Any:
        state: Any = super().__getstate__()
        # Buffers are made again where they are needed; samples are no part of a policy that goes elsewhere.
        return {name: value for name, value in state.items() if name not in ("_prepared", "_kept")}


def _probes(form: ClosedForm) -> Array:
    """States for a self-test, inside and far outside, the same for the same policy."""
    drawn = np.random.default_rng(0).uniform(-1.0, 1.0, (2 * SELF_TESTS, len(form.origin)))
    drawn[SELF_TESTS:] *= FAR
    return form.origin + form.reach * drawn

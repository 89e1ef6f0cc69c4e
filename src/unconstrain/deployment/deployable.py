"""What a fitted policy can do without what it learnt from."""

import os
from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..base.arrays import Array
from ..models import ClosedForm, Scale
from .c99 import export_c
from .javascript import export_javascript, javascript
from .onnx_graph import export_onnx
from .stepping import Step, stepper


class Deployable:
    """A model and the weights of a solution, in control loops and on other machines."""

    training_: Any
    solution_: Any
    n_features_in_: int
    scale_: Scale | None

    @abstractmethod
    def __call__(self, states: ArrayLike) -> Array:
        """Actions (N, d) at states (N, n)."""

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
        solution, step = known.get("_prepared") or (None, None)
        if step is None or solution is not known.get("solution_"):
            step = self._prepare_step(known)
        return step(x, out)

    def _prepare_step(self, known: dict[str, Any]) -> Step:
        check_is_fitted(self, "solution_")
        # What another thread has learnt meanwhile is prepared at the next step: the solution is then another.
        solution = known["solution_"]
        step = stepper(known["training_"].model, solution.weights, known["n_features_in_"], known.get("scale_"))
        known["_prepared"] = solution, step
        return step

    def closed_form(self) -> ClosedForm:
        """The policy as one formula: what is exported, and what other targets can be made from.

        Raises
        ------
        SettingError
            If the features are a callable that does not say its formula.
        InvalidDataError
            If the weights are not finite.
        """
        check_is_fitted(self, "solution_")
        form = self.training_.model.formula(self.solution_.checked().weights)
        return form if self.scale_ is None else self.scale_.form(form)

    def export_c(self, path: str | os.PathLike[str], name: str = "policy") -> None:
        """Write the policy as one C99 file that needs only ``exp`` (``sin``, ``cos``) of the standard library.

        It defines ``void NAME_step(const double state[n], double action[d])``
        and, with ``NAME_SELF_TEST`` (in capitals) defined, a ``main`` that
        compares itself with :meth:`predict`. The name is a C identifier.
        Raises as :meth:`closed_form` does, and for another name.
        """
        export_c(self.closed_form(), self, path, name)

    def export_onnx(self, path: str | os.PathLike[str]) -> None:
        """Write the policy as an ONNX graph, ``states`` (N, n) to ``actions`` (N, d), in float64.

        Needs the extra ``onnx``. Raises as :meth:`closed_form` does.
        """
        export_onnx(self.closed_form(), path)

    def export_javascript(self, path: str | os.PathLike[str]) -> None:
        """Write the policy as an ES module that needs nothing else, with ``policy(state)`` and ``support(state)``.

        Raises as :meth:`closed_form` does.
        """
        export_javascript(self.closed_form(), path, self._precision())

    def javascript(self) -> str:
        """The policy as a JavaScript expression, to put into a page; it is an object of the same two functions.

        Raises as :meth:`closed_form` does.
        """
        return javascript(self.closed_form(), self._precision())

    def _precision(self) -> Array | None:
        """One over the variance of the kernels along each coordinate; None where there are none."""
        model = self.training_.model
        variance = getattr(model.fields, "variance", None) or getattr(model.features, "variance", None)
        if variance is None:
            return None
        units = 1.0 if self.scale_ is None else self.scale_.states
        return np.ones(len(self.closed_form().origin)) / (variance * units**2)

    def __getstate__(self) -> Any:
        """Leave out buffers, which are made again where they are needed."""
        state: Any = super().__getstate__()
        return {name: value for name, value in state.items() if name != "_prepared"}

"""What a fitted policy can do without what it learnt from."""

import os
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..base import files
from ..base.arrays import Array
from ..models import ClosedForm, Scale
from .c99 import export_c
from .description import Description
from .javascript import export_javascript, javascript
from .onnx_graph import onnx_model
from .ros2 import Messages, export_ros2
from .scaled import Scaler, scaled
from .stepping import Step, stepper


class Exportable:
    """What has a formula, on other machines."""

    @abstractmethod
    def __call__(self, states: ArrayLike) -> Array:
        """Actions (N, d) at states (N, n)."""

    @abstractmethod
    def closed_form(self, scaler: Scaler | None = None) -> ClosedForm:
        """The policy as one formula: what is exported, and what other targets can be made from."""

    @abstractmethod
    def describe(self, form: ClosedForm, notes: Mapping[str, Any] | None = None) -> Description:
        """What is said of the formula where it is used, with the notes of the policy's file."""

    def export_c(
        self,
        path: str | os.PathLike[str],
        name: str | None = None,
        *,
        single: bool = False,
        scaler: Scaler | None = None,
        notes: Mapping[str, Any] | None = None,
    ) -> str:
        """Write the policy as a C source that needs only the mathematics of the standard library, and its header.

        They are C99 and C++11, and offer ``void NAME_step(const double state[n], double action[d])``,
        ``double NAME_support(const double state[n])``, and limits of states and speed. With ``NAME_SELF_TEST`` (in
        capitals) defined, there is a ``main`` that compares the file with :meth:`predict`. Returns ``NAME``.

        Parameters
        ----------
        path : str or path-like
            Of the source; the header has the suffix ``.h``.
        name : str, optional
            What all names begin with, a C identifier; by default as the file is called.
        single : bool
            Compute in ``float`` rather than ``double``.
        scaler : object, optional
            As in :meth:`closed_form`.
        notes : mapping, optional
            What to say in the comment, as :func:`unconstrain.storage.load_notes` reads it from a policy's file.

        Raises
        ------
        SettingError
            For another name, if a number does not fit ``float``, and as :meth:`closed_form` does.

        Examples
        --------
        >>> policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [-2.0]])
        >>> policy.export_c("wipe-2.c")  # and wipe-2.h
        'wipe_2'
        """
        form = self.closed_form(scaler)
        return export_c(form, self._after(scaler), path, name, self.describe(form, notes), single=single)

    def export_onnx(
        self,
        path: str | os.PathLike[str],
        *,
        single: bool = False,
        scaler: Scaler | None = None,
        notes: Mapping[str, Any] | None = None,
    ) -> None:
        """Write the policy as an ONNX graph, ``states`` (N, n) to ``actions`` (N, d), in float64 or float32.

        A second output is the ``support`` (N,): stop where it is near 0. Needs the extra ``onnx``. Parameters and
        errors as in :meth:`export_c`; what is said goes into the metadata.

        Examples
        --------
        >>> policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [-2.0]])
        >>> policy.export_onnx("wipe.onnx")
        """
        form = self.closed_form(scaler)
        files.write(path, onnx_model(form, self.describe(form, notes), single=single))

    def export_ros2(
        self,
        folder: str | os.PathLike[str],
        name: str | None = None,
        *,
        messages: Messages | None = None,
        scaler: Scaler | None = None,
        notes: Mapping[str, Any] | None = None,
    ) -> Messages:
        """Write a ROS 2 package with a node around the C source, and a loop in Python; return which messages it takes.

        Other parameters and errors are as in :meth:`export_c`; the name is by default that of the folder.

        Parameters
        ----------
        messages : {"joints", "pose"}, optional
            Whether states are the positions of joints (``JointState`` in, ``Float64MultiArray`` out) or of a pose
            (``PoseStamped`` in, ``TwistStamped`` out); by default of a pose where they are x, y and z or three lengths.

        Raises
        ------
        SettingError
            Also if actions are no velocities of the states, or these are centred, orientations, or not three of a pose.

        Examples
        --------
        >>> policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [-2.0]])
        >>> policy.export_ros2("wipe")
        'joints'
        """
        form = self.closed_form(scaler)
        return export_ros2(form, self._after(scaler), folder, name, self.describe(form, notes), messages)

    def _after(self, scaler: Scaler | None) -> Callable[[ArrayLike], Array]:
        return self if scaler is None else lambda states: self(scaler.transform(np.asarray(states)))

    def export_javascript(
        self, path: str | os.PathLike[str], *, scaler: Scaler | None = None, notes: Mapping[str, Any] | None = None
    ) -> None:
        """Write the policy as an ES module that needs nothing else, with ``policy(state)`` and ``support(state)``.

        The scaler and errors are as in :meth:`closed_form`, the notes as in :meth:`export_c`.
        """
        form = self.closed_form(scaler)
        export_javascript(form, path, self.describe(form, notes))

    def javascript(self, scaler: Scaler | None = None) -> str:
        """The policy as a JavaScript expression, to put into a page; it is an object of the same two functions.

        The scaler and errors are as in :meth:`closed_form`.
        """
        return javascript(self.closed_form(scaler))


class Deployable(Exportable):
    """A model and the weights of a solution, in control loops and on other machines."""

    learner: Any
    training_: Any
    solution_: Any
    n_features_in_: int
    scale_: Scale | None

    def step(self, x: ArrayLike, out: Array | None = None) -> Array:
        """Predict for one state, without overhead: for control loops.

        The same as :meth:`predict` to rounding. It is prepared on the first call after each fit. Any number of threads
        may call it at once, also while one of them learns by :meth:`partial_fit`; each step is then by the old or by
        the new solution, never by half of each.

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

        Examples
        --------
        >>> policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [-2.0]])
        >>> policy.step([0.5]).round(6)
        array([-1.])
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

    def closed_form(self, scaler: Scaler | None = None) -> ClosedForm:
        """The policy as one formula: what is exported, and what other targets can be made from.

        Parameters
        ----------
        scaler : object with ``transform``, optional
            What the states went through before, such as the scaler in a pipeline: ``pipeline[:-1]`` where
            ``pipeline[-1]`` is this policy. The formula is then that of both.

        Raises
        ------
        SettingError
            If the features are a callable that does not say its formula, or the scaler does more than to shift and
            scale each state.
        InvalidDataError
            If the weights are not finite.

        Examples
        --------
        >>> policy = uc.ParametricPolicy(uc.Affine(), "direct").fit([[0.0], [1.0]], [[0.0], [-2.0]])
        >>> policy.closed_form()
        ClosedForm(1 state, 1 action, 1 model)
        """
        check_is_fitted(self, "solution_")
        form = self.training_.model.formula(self.solution_.checked().weights)
        form = form if self.scale_ is None else self.scale_.form(form)
        return form if scaler is None else scaled(form, scaler)

    def describe(self, form: ClosedForm, notes: Mapping[str, Any] | None = None) -> Description:
        """Columns, units and origin, by the notes of the policy's file, and what it was learnt by."""
        names = getattr(self, "feature_names_in_", None)
        actions = [f"u{place}" for place in range(1, form.sizes[1] + 1)]  # nobody has said what they are
        told = {"recipe": {"states": None if names is None else list(names), "actions": actions}} | dict(notes or {})
        learner = type(self.learner).__name__ if self.learner is not None else "Robust"
        method = getattr(self.solution_, "method", "")
        unit = 1.0 if self.scale_ is None else float(self.scale_.actions.max())
        described = Description.of(form, f"{learner}: {method}" if method else learner, told)
        return replace(described, fastest=unit * self.training_.fastest)

    def __getstate__(self) -> Any:
        """Leave out buffers, which are made again where they are needed."""
        state: Any = super().__getstate__()
        return {name: value for name, value in state.items() if name != "_prepared"}

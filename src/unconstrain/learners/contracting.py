"""The quadratic of the softened hybrid, minimised among models that contract: the guarantee is in the learning."""

import warnings
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_vector, check_at_least, require_extra
from ..base.errors import InvalidDataError, SettingError
from ..models import Affine, Model, Scale, spaces
from ..risks import inconsistency, standard_risk
from ..training import Training
from .hybrid import Hybrid, chosen_softness
from .learner import Learner
from .solution import Solution

RIDGE = 1e-10
"""What no sample excites is zero: this share of the mean curvature is added to that of each weight."""


@dataclass(frozen=True, eq=False)
class Contracting(Learner):
    """Minimise ``E_i + softness E_2`` under the condition that each affine model contracts and rests at the goal.

    With ``π_m(x) = J_m (x − x*)``, ``(J_m + J_mᵀ) / 2 ≤ −rate I``: a semidefinite program for each model, solved by
    Clarabel through cvxpy (the extra ``certify``). Whatever the fields are,

        ``(x − x*)ᵀ Σ_m s_m(x) π_m(x) ≤ −rate ‖x − x*‖²``:

    the distance to the goal falls along every movement, free and on every flat surface through the goal. A policy of
    one model does more: since ``dxᵀ N J dx = dxᵀ J dx`` in the range of N, its movements come together on every flat
    surface. :func:`~unconstrain.certify` says so of a policy, with its margins. For affine features and
    :class:`~unconstrain.LocallyLinearPolicy`, where actions are velocities of states in their own units.

    Parameters
    ----------
    rate : float
        In 1/s: distances fall by this share each second, or faster.
    goal : array_like, shape (n,), optional
        Where it rests. Needed by local models, which agree on no such place by themselves; a single one finds it.
    softness : float or "auto"
        As in :class:`Hybrid`, or chosen as by its ``alpha="auto"``.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Contracting(rate=1.5)).fit(states, actions)  # doctest: +SKIP
    >>> uc.certify(policy, states).holds  # doctest: +SKIP
    True
    """

    rate: float = 0.1
    goal: ArrayLike | None = None
    softness: float | Literal["auto"] = "auto"

    def __post_init__(self) -> None:
        check_at_least("rate", self.rate, 0.0, strict=True)
        if self.softness != "auto":
            check_at_least("softness", self.softness, 0.0)

    def within(self, scale: Scale) -> Self:
        """Refuse: what contracts in one unit need not in another.

        Raises
        ------
        SettingError
            Always.
        """
        raise SettingError("scale: got one, and Contracting is about distances in the units of the data. Fit without.")

    def takes(self, model: Model) -> bool:
        """Whether it is affine."""
        return isinstance(model.features, Affine)

    def learn(self, training: Training) -> Solution:
        """Learn from all folds, with a softness that is given or chosen by cross-validation."""
        folds, rate = training.folds, self.rate / training.action_unit
        softness = chosen_softness(folds) if self.softness == "auto" else self.softness
        charts = self._charts(training.model, folds.whole.cross.shape)
        objective = inconsistency(folds.whole) + softness * standard_risk(folds.whole)
        program = _Program(charts.shape[1] - 1, rate, rests=self.goal is not None)
        parts = zip(charts, objective.hessian, objective.linear, strict=True)
        weights = np.stack([program.solved(*part) for part in parts])
        found = Hybrid(threshold=0.0, softness=softness).learn(training)
        return replace(found, weights=weights, method="contracting")

    def _charts(self, model: Model, shape: tuple[int, ...]) -> Array:
        """``B_m`` (M, n + 1, n + 1) with ``W B_m = (J_m, π_m(x*))`` for weights W over ``T_m φ``, x* zero if not given.

        Raises
        ------
        SettingError
            If models are not affine from flat states to their velocities, or local and there is no goal.
        """
        models, n, p = shape
        flat = self.takes(model) and isinstance(model.embedding.space, spaces.Euclidean)
        if not flat or p != n + 1:
            raise SettingError(
                "learner: Contracting expects affine models of velocities of flat states, ParametricPolicy(Affine()) "
                "or LocallyLinearPolicy; take Guided for any other policy."
            )
        if models > 1 and self.goal is None:
            raise SettingError("goal: got none for local models; expected a state where all of them rest.")
        at = np.zeros(n) if self.goal is None else as_vector(self.goal, "goal", n)
        features = model.design(at + np.vstack([np.eye(n), np.zeros(n)])).T  # (n + 1, n + 1)
        features[:, :-1] -= features[:, -1:]
        return features[None] if model.centring is None else np.asarray(model.centring @ features)


class _Program:
    """The semidefinite program of a model, compiled once: in J, and in what it does at the goal unless it rests there.

    The variables are multiples of the rate.
    """

    def __init__(self, n: int, rate: float, *, rests: bool) -> None:
        cvxpy = require_extra("cvxpy", "certify")
        self._rate, self._free = rate, n * (n + (not rests))
        self._found = cvxpy.Variable((n, n + (not rests)))
        self._root, self._target = cvxpy.Parameter((self._free, self._free)), cvxpy.Parameter(self._free)
        missed = self._root @ cvxpy.vec(self._found, order="F") - self._target
        jacobian = self._found[:, :n]
        conditions = [jacobian + jacobian.T << -2.0 * np.eye(n)]
        self._problem: Any = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(missed)), conditions)

    def solved(self, chart: Array, hessian: Array, linear: Array) -> Array:
        """Weights (d, p) over ``T_m φ`` that are least among those that contract, exactly so."""
        n = len(chart) - 1
        back = np.linalg.inv(chart)
        change = self._rate * np.kron(back.T, np.eye(n))[:, : self._free]
        curved = change.T @ hessian @ change
        size = np.trace(curved) / len(curved) or 1.0
        root = np.linalg.cholesky(curved / size + RIDGE * np.eye(len(curved)), upper=True)
        self._root.value, self._target.value = root, np.linalg.solve(root.T, change.T @ linear / size)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that it is inaccurate: what counts is exact below
            self._problem.solve(solver="CLARABEL")
        if self._found.value is None:
            raise InvalidDataError(f"no contracting policy was found (Clarabel: {self._problem.status}).")
        found = np.zeros((n, n + 1))
        found[:, : self._found.shape[1]] = self._found.value
        jacobian = found[:, :n]
        beyond = float(np.linalg.eigvalsh(0.5 * (jacobian + jacobian.T))[-1]) + 1.0
        found[:, :n] -= max(beyond, 0.0) * (1.0 + 1e-9) * np.eye(n)
        return self._rate * found @ back

"""Locally linear policies (section III-D)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..base.arrays import Array, as_matrix
from ..learners import Learner, SampleLearner
from ..models import Affine, ClosedForm, ReceptiveFields, choose_variance, cover, exponents
from ..recordings import FirstLook
from ..training import Validation
from .base import Policy

__all__ = ["LocallyLinearPolicy"]


class LocallyLinearPolicy(Policy):
    """Linear models in Gaussian receptive fields, averaged by their weights (section III-D).

    Each local model is learnt on its own, its threshold too. Its regressors
    are ``((x − c_m) / σ, 1)``: centred on the field and free of units.

    Parameters
    ----------
    variance : float, optional
        The fields' σ², in squared units of the state. By default a quarter of
        the states' total variance, more where that takes over 100 fields.
    at_least : float
        Fields are added until every sample has at least this weight in one.
    centres : array_like, shape (M, n), optional
        Use these instead.
    learner : Learner, optional
        :class:`~unconstrain.Hybrid` by default.
    validation : Folds or HeldOut, optional
        What the learner chooses its thresholds on; ten folds by default.

    Attributes
    ----------
    solution_ : Solution
        Weights (M, d, n + 1) over ``((x − origin) / σ, 1)``, with one origin
        for all fields, and what the data determined.
    fields_ : ReceptiveFields
        The fields in use.
    """

    def __init__(
        self,
        variance: float | None = None,
        at_least: float = 0.7,
        centres: ArrayLike | None = None,
        learner: Learner | SampleLearner | None = None,
        validation: Validation | None = None,
    ) -> None:
        self.variance = variance
        self.at_least = at_least
        self.centres = centres
        self.learner = learner
        self.validation = validation

    def _place(self, look: FirstLook) -> None:
        states = look.different
        variance = self.variance if self.variance is not None else choose_variance(states, self.at_least)
        if self.centres is None:
            self.fields_ = cover(states, variance, self.at_least)
        else:
            self.fields_ = ReceptiveFields(as_matrix(self.centres, "centres"), variance)
        self.features_ = Affine(self.fields_.centres.mean(axis=0), np.sqrt(variance))

    def _features(self, states: Array) -> Array:
        return as_matrix(self.features_(states), "features")

    def _weights(self, states: Array) -> Array:
        return self.fields_.weights(states)

    def _shares(self, states: Array) -> Array:
        return self.fields_.shares(states)

    def _centring(self) -> Array:
        # Gathering over common features is one product; centring each field afterwards is exact.
        offsets = -self.features_(self.fields_.centres)[:, :-1]
        models, n = offsets.shape
        centring = np.tile(np.eye(n + 1), (models, 1, 1))
        centring[:, :n, n] = offsets
        return centring

    def _closed_form(self) -> ClosedForm:
        weights, centres, variance = self.solution_.weights, self.fields_.centres, self.fields_.variance
        origin, scale = self.features_.centre, self.features_.scale
        maps = np.concatenate([weights[..., :-1] / scale, weights[..., -1:]], axis=2)
        reach = np.abs(centres - origin).max(axis=0) + np.sqrt(variance)
        return ClosedForm(np.asarray(origin), maps, exponents(centres, variance, np.asarray(origin)), reach)

    def support(self, states: ArrayLike) -> Array:
        """Weight in the nearest field, from 1 at its centre to 0 far from all data, shape (N,)."""
        check_is_fitted(self, "solution_")
        return self.fields_.support(self._checked_states(states))

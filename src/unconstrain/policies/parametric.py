"""Policies on fixed features (section III-C)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..base.arrays import Array, as_matrix
from ..base.errors import SettingError
from ..learners import Learner, SampleLearner
from ..models import ClosedForm, FeatureMap, KMeansRBF, Placeable
from ..recordings import FirstLook
from ..training import Validation
from .base import Policy

__all__ = ["ParametricPolicy"]


class ParametricPolicy(Policy):
    """A policy that is linear in fixed features, ``π̃(x) = W b(x)`` (section III-C).

    Parameters
    ----------
    features : callable, optional
        A feature map, such as :class:`~unconstrain.NormalisedRBF` or
        :class:`~unconstrain.Affine`, or anything that maps (N, n) to (N, p).
        By default 25 normalised RBFs placed on the data.
    learner : Learner, optional
        :class:`~unconstrain.Hybrid` by default.
    validation : Folds or HeldOut, optional
        What the learner chooses its threshold on; ten folds by default.

    Attributes
    ----------
    solution_ : Solution
        Weights (1, d, p) and what the data determined.
    features_ : callable
        The features in use.
    """

    def __init__(
        self,
        features: FeatureMap | Placeable | None = None,
        learner: Learner | SampleLearner | None = None,
        validation: Validation | None = None,
    ) -> None:
        self.features = features
        self.learner = learner
        self.validation = validation

    def _place(self, look: FirstLook) -> None:
        features = self.features if self.features is not None else KMeansRBF()
        if not callable(features) and not isinstance(features, Placeable):
            raise SettingError(f"features: got {features!r}, expected a function of states such as NormalisedRBF.")
        self.features_ = features.place(look.different) if isinstance(features, Placeable) else features

    def _features(self, states: Array) -> Array:
        features = self.features_(states)
        if np.ndim(features) != 2 or np.shape(features)[0] != states.shape[0]:
            raise SettingError(
                f"features: got an array of shape {tuple(np.shape(features))} for {states.shape[0]} states, "
                "expected (samples, features)."
            )
        return as_matrix(features, "features")

    def _weights(self, states: Array) -> None:
        return None

    _shares = _weights

    def _centring(self) -> None:
        return None

    def _roughness(self) -> Array | None:
        measure = getattr(self.features_, "roughness", None)
        return None if measure is None else measure()[None]

    def _closed_form(self) -> ClosedForm | None:
        closed = getattr(self.features_, "closed_form", None)
        return None if closed is None else closed(self.solution_.weights[0])

    def support(self, states: ArrayLike) -> Array:
        """How near to the features' kernels each state is, from 1 to 0, shape (N,).

        Raises
        ------
        SettingError
            If the feature map has no place in state space, and so no ``support``.
        """
        check_is_fitted(self, "solution_")
        if not hasattr(self.features_, "support"):
            raise SettingError(f"support: {type(self.features_).__name__} does not say where its data was.")
        return np.asarray(self.features_.support(self._checked_states(states)))

"""Policies as scikit-learn estimators.

Both are one model with a leading axis of M: features φ(x), shared by all
models, and how much each sample counts in each model. A parametric policy has
M = 1. The steps are those of the paper: fix features and fields, sum over the
samples, solve.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted, validate_data

from .arrays import Array, as_groups, as_matrix, as_table, as_weights, check_at_least
from .demonstration import Demonstration, stack
from .errors import InvalidDataError, SettingError
from .features import Affine, FeatureMap, KMeansRBF, Placeable
from .learners import Hybrid, Learner, Solution
from .moments import Moments, gather_blocks
from .objectives import inconsistency, vec
from .projection import unit_actions
from .receptive_fields import ReceptiveFields, choose_variance, cover
from .validation import FoldedMoments, Folds, Groups, Splitter, Validation

__all__ = ["LocallyLinearPolicy", "ParametricPolicy", "Policy"]

PLACING_SAMPLES = 20_000
"""Features and fields are placed on at most this many samples, evenly spaced in the first batch."""

AT_REST = 1e-12
"""Actions shorter than this share of the largest in the first batch are rounding around rest."""

_ROWS = 4096


class Policy(RegressorMixin, BaseEstimator):
    """What both policies share: fitting from a stream, predicting, changing the learner."""

    learner: Learner | None
    validation: Validation | None
    _folds: FoldedMoments
    _splitter: Splitter
    _flat: bool

    @abstractmethod
    def _place(self, states: Array) -> None:
        """Fix features and fields on some different states."""

    @abstractmethod
    def _features(self, states: Array) -> Array:
        """Features φ(x) as they are summed, shape (N, p)."""

    @abstractmethod
    def _weights(self, states: Array) -> Array | None:
        """How much each sample counts in each model, shape (N, M), or None for a single model."""

    @abstractmethod
    def _shares(self, states: Array) -> Array | None:
        """Share of each model in the prediction, shape (N, M), or None for a single model."""

    @abstractmethod
    def _solve(self, learner: Learner, folds: FoldedMoments) -> Solution:
        """Find the weights of the features φ(x)."""

    def fit(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None, groups: Groups | None = None
    ) -> Self:
        """Learn the unconstrained policy.

        Parameters
        ----------
        X : array_like, shape (N, n)
            States.
        y : array_like, shape (N, d) or (N,)
            Observed actions, each the projection of the policy by an unknown constraint.
        sample_weight : array_like, shape (N,), optional
            A weight of two is the same as a repetition.
        groups : array_like, shape (N,), optional
            Which demonstration each sample is from, so that whole
            demonstrations can be held out.

        Returns
        -------
        self

        Raises
        ------
        InvalidDataError
            If the arrays are ragged, empty, of different lengths or not finite.
        """
        for fitted in ("_folds", "_splitter", "n_features_in_", "solution_"):
            self.__dict__.pop(fitted, None)
        return self._learn(X, y, sample_weight, groups, more=False)

    def partial_fit(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None, groups: Groups | None = None
    ) -> Self:
        """Learn from a further batch; the sums are those of all batches at once.

        The first batch fixes features, fields, action dimensions, and the
        spread by which samples are dealt into folds; it should be typical.
        Parameters, result and errors as in :meth:`fit`.
        """
        return self._learn(X, y, sample_weight, groups, more=True)

    def _learn(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None, groups: Groups | None, *, more: bool
    ) -> Self:
        first = not hasattr(self, "_folds")
        states, actions = self._checked(X, y, reset=first)
        weights = as_weights(sample_weight, len(states))
        names = None if groups is None else as_groups(groups, len(states))
        if not weights.any():
            raise InvalidDataError("sample_weight: all weights are zero, expected at least one that counts.")
        if not weights.all():  # a weight of zero is the same as not being there
            counting = weights > 0
            states, actions, weights = states[counting], actions[counting], weights[counting]
            names = None if names is None else names[counting]
        if first:
            self._at_rest = AT_REST * float(np.abs(actions).max())
            self._begin(states, weights, names, more)
        self._folds = self._folds + self._gather(states, actions, weights, names)
        self._conclude()
        return self

    def fit_demonstrations(
        self, demonstrations: Demonstration | Sequence[Demonstration], speed_power: float = 0.0
    ) -> Self:
        """Learn from demonstrations, each its own group.

        Parameters
        ----------
        demonstrations : Demonstration or sequence of Demonstration
        speed_power : float
            Samples count by this power of their speed. 0 is the paper; 2
            helps on noisy recordings, since the direction of a slow movement
            is mostly noise.

        Returns
        -------
        self
        """
        check_at_least("speed_power", speed_power, 0.0)
        states, actions, groups = stack(demonstrations)
        speed = np.linalg.norm(actions, axis=1)
        if speed_power == 0.0 or not speed.any():
            return self.fit(states, actions, groups=groups)
        return self.fit(states, actions, (speed / speed.max()) ** speed_power, groups)

    def held_out_score(self) -> float:
        """:meth:`score` on each fold by what is learnt from the others, from the moments alone.

        Of local models each is judged by itself in its own field. NaN where
        there is nothing to hold out.
        """
        check_is_fitted(self, "solution_")
        parts, learner = self._folds.parts, self._learner()
        filled = [i for i, part in enumerate(parts) if part.weight.any()]
        missed = moved = 0.0
        for i in filled if len(filled) > 1 else ():
            others = tuple(parts[j] for j in filled if j != i)
            weights = self._solve(learner, FoldedMoments(others, range(len(others)))).weights
            missed += float(inconsistency(parts[i])(vec(weights)).sum())
            moved += float(parts[i].energy.sum())
        return 1.0 - missed / moved if moved > 0 else float("nan")

    def predict(self, X: ArrayLike) -> Array:
        """Predict the unconstrained policy.

        Parameters
        ----------
        X : array_like, shape (N, n)
            States.

        Returns
        -------
        ndarray, shape (N, d), or (N,) where it was fitted to (N,) actions
        """
        check_is_fitted(self, "solution_")
        states = self._checked_states(X)
        actions = np.concatenate([self._predict_block(states[rows]) for rows in _chunks(np.arange(len(states)))])
        return actions[:, 0] if self._flat else actions

    def __call__(self, states: ArrayLike) -> Array:
        """Be a policy: the same as :meth:`predict`, always of shape (N, d)."""
        return self.predict(states).reshape(-1, self.n_outputs_)

    def score(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> float:
        """Share of the observed motion that the policy, projected onto each action, explains.

        ``1 − E_i / Σ w uᵀu`` with the inconsistency of eq. 4; 1 is best. The
        usual R² would punish a policy for what constraints took away.

        Parameters
        ----------
        X, y, sample_weight
            As in :meth:`fit`.
        """
        check_is_fitted(self, "solution_")
        states, actions = self._checked(X, y, reset=False)
        weights = as_weights(sample_weight, len(states))
        directions, lengths = unit_actions(actions)
        missed = weights @ (lengths - (directions * self(states)).sum(axis=1)) ** 2
        moved = weights @ lengths**2
        return float(1.0 - missed / moved) if moved > 0 else 0.0

    def with_learner(self, learner: Learner) -> Self:
        """Return the same policy with another learner, from the same moments: no second pass over the data."""
        check_is_fitted(self, "solution_")
        other = clone(self).set_params(learner=learner)
        other.__dict__ |= {name: value for name, value in self.__dict__.items() if name not in other.__dict__}
        other._splitter = deepcopy(self._splitter)  # each keeps its own list of demonstrations from here on
        other._conclude()
        return other

    @property
    def moments_(self) -> Moments:
        """Moments of all samples so far, over the features as they are summed."""
        return self._folds.whole

    def _checked(self, X: ArrayLike, y: ArrayLike, *, reset: bool) -> tuple[Array, Array]:
        states = self._checked_states(X, reset=reset)
        if y is None:
            raise InvalidDataError("requires y to be passed, but the target y is None: expected the observed actions.")
        actions, flat = as_table(y, "actions")
        if len(actions) != len(states):
            raise InvalidDataError(
                f"got {len(states)} states and {len(actions)} actions (inconsistent numbers of samples), "
                "expected one action for each state."
            )
        if reset:
            self._flat, self.n_outputs_ = flat, actions.shape[1]
        elif actions.shape[1] != self.n_outputs_:
            raise InvalidDataError(f"actions: got {actions.shape[1]} columns, expected {self.n_outputs_} as before.")
        return states, actions

    def _checked_states(self, X: ArrayLike, *, reset: bool = False) -> Array:
        if isinstance(X, list | tuple):
            X = as_matrix(X, "states")  # our words for ragged rows
        try:
            # scikit-learn checks names, sparse input and the number of columns; the numbers are ours to check.
            table = validate_data(self, X, reset=reset, dtype=np.float64, ensure_all_finite=False)
        except ValueError as error:
            raise InvalidDataError(str(error)) from error
        return as_matrix(table, "states")

    def _begin(self, states: Array, weights: Array, groups: Groups | None, more: bool) -> None:
        validation = self.validation if self.validation is not None else Folds()
        self._splitter = Splitter(validation, states, weights, groups, more)
        # Different states in a fixed order: repetition and order must not move the features
        # (beyond PLACING_SAMPLES they may).
        self._place(np.unique(states[:: -(-len(states) // PLACING_SAMPLES)], axis=0))
        features, actions, in_models = self._block(states[:1], np.zeros((1, self.n_outputs_)), weights[:1])
        empty = Moments.zero(in_models.shape[1], actions.shape[1], features.shape[1])
        self._folds = FoldedMoments((empty,) * validation.count, validation.held_out)

    def _gather(self, states: Array, actions: Array, weights: Array, groups: Groups | None) -> FoldedMoments:
        folds = self._splitter.assign(states, groups)
        order = np.argsort(folds, kind="stable")
        starts = np.searchsorted(folds[order], np.arange(len(self._folds.parts) + 1))
        models, d, p = self._folds.parts[0].cross.shape
        parts = []
        for start, stop in pairwise(starts):
            blocks = (self._block(states[rows], actions[rows], weights[rows]) for rows in _chunks(order[start:stop]))
            parts.append(gather_blocks(blocks, models, d, p, self._at_rest))
        return FoldedMoments(tuple(parts), self._folds.held_out)

    def _block(self, states: Array, actions: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Features, actions, and how much each sample counts in each model."""
        in_models = self._weights(states)
        column = weights[:, None]
        return self._features(states), actions, column if in_models is None else column * in_models

    def _conclude(self) -> None:
        self.solution_ = self._solve(self._learner(), self._folds)

    def _learner(self) -> Learner:
        return self.learner if self.learner is not None else Hybrid()

    def _predict_block(self, states: Array) -> Array:
        weights, models = self.solution_.weights, self._shares(states)
        features = self._features(states)
        if models is None:
            return features @ weights[0].T
        return np.einsum("nm,nmd->nd", models, np.tensordot(features, weights, axes=(1, 2)))

    def __sklearn_tags__(self) -> Any:
        """Say that actions may have several columns."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags


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
        learner: Learner | None = None,
        validation: Validation | None = None,
    ) -> None:
        self.features = features
        self.learner = learner
        self.validation = validation

    def _place(self, states: Array) -> None:
        features = self.features if self.features is not None else KMeansRBF()
        if not callable(features) and not isinstance(features, Placeable):
            raise SettingError(f"features: got {features!r}, expected a function of states such as NormalisedRBF.")
        self.features_ = features.place(states) if isinstance(features, Placeable) else features

    def _features(self, states: Array) -> Array:
        features = self.features_(states)
        if np.ndim(features) != 2 or len(features) != len(states):
            raise SettingError(
                f"features: got an array of shape {np.shape(features)} for {len(states)} states, "
                "expected (samples, features)."
            )
        return as_matrix(features, "features")

    def _weights(self, states: Array) -> None:
        return None

    _shares = _weights

    def _solve(self, learner: Learner, folds: FoldedMoments) -> Solution:
        return learner.solve(folds)

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
        learner: Learner | None = None,
        validation: Validation | None = None,
    ) -> None:
        self.variance = variance
        self.at_least = at_least
        self.centres = centres
        self.learner = learner
        self.validation = validation

    def _place(self, states: Array) -> None:
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

    def _solve(self, learner: Learner, folds: FoldedMoments) -> Solution:
        # Gathering over common features is one product; centring each field afterwards is exact.
        offsets = -self.features_(self.fields_.centres)[:, :-1]
        models, n = offsets.shape
        centring = np.tile(np.eye(n + 1), (models, 1, 1))
        centring[:, :n, n] = offsets
        solution = learner.solve(folds.in_features(centring))
        return replace(solution, weights=solution.weights @ centring)

    def support(self, states: ArrayLike) -> Array:
        """Weight in the nearest field, from 1 at its centre to 0 far from all data, shape (N,)."""
        check_is_fitted(self, "solution_")
        return self.fields_.support(self._checked_states(states))


def _chunks(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    return (rows[start : start + _ROWS] for start in range(0, len(rows), _ROWS))

"""What all policies share: sums from a stream, a learner, prediction."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from itertools import chain, pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted, validate_data

from ..arrays import Array, as_groups, as_matrix, as_table, as_weights, check_at_least
from ..batches import Batch, FirstLook, Groups
from ..demonstration import Demonstration, stack
from ..errors import InvalidDataError, SettingError
from ..learners import Hybrid, Learner, Solution
from ..moments import Moments, gather_blocks
from ..objectives import inconsistency, vec
from ..projection import unit_actions
from ..robust import RobustSolution, SampleLearner, Samples, Uncertainty, uncertainty
from ..validation import FoldedMoments, Folds, Splitter, Validation
from .deployable import Deployable

__all__ = ["Policy"]

AT_REST = 1e-12
"""Actions shorter than this share of the largest at first look are rounding around rest."""

_ROWS = 4096


class Policy(Deployable, RegressorMixin, BaseEstimator):
    """What both policies share: fitting from a stream, predicting, stepping, changing the learner."""

    learner: Learner | SampleLearner | None
    validation: Validation | None
    _folds: FoldedMoments
    _kept: tuple[Batch, ...]
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
    def _centring(self) -> Array | None:
        """T_m, shape (M, p, p), with which model m is solved in features ``T_m φ``; None for φ itself."""

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
        self._forget()
        batch = self._checked(X, y, sample_weight, groups, reset=True)
        return self._begin(FirstLook.at(batch), more=False)._learn([batch])

    def partial_fit(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None, groups: Groups | None = None
    ) -> Self:
        """Learn from a further batch; the sums are those of all batches at once.

        The first batch fixes features, fields, action dimensions, and the
        spread by which samples are dealt into folds; it should be typical.
        Parameters, result and errors as in :meth:`fit`.

        The solution is found anew each time. Where only the last counts,
        :meth:`fit_batches` is faster.
        """
        first = not hasattr(self, "_folds")
        batch = self._checked(X, y, sample_weight, groups, reset=first)
        if first:
            self._begin(FirstLook.at(batch), more=True)
        return self._learn([batch])

    def fit_batches(self, batches: Iterable[Sequence[Any]]) -> Self:
        """Learn from more than fits into memory, batch by batch, solving once.

        What can be walked through twice, such as a list or
        :class:`unconstrain.Stream`, is: first to choose features, fields and
        folds, then to sum. The result is that of :meth:`fit` on everything,
        to rounding, however the samples are cut into batches. A generator
        is walked through once; as in :meth:`partial_fit` its first batch
        then fixes what would have been chosen, and should be typical.

        Parameters
        ----------
        batches : iterable of tuples
            Each ``(X, y)``, ``(X, y, sample_weight)`` or ``(X, y, sample_weight, groups)``,
            as :meth:`fit` takes them.

        Returns
        -------
        self

        Raises
        ------
        InvalidDataError
            As :meth:`fit` does, and if there is no batch.
        """
        self._forget()
        checked = self._each_checked(batches)
        if iter(batches) is not batches:
            return self._begin(FirstLook.total(map(FirstLook.at, checked)), more=False)._learn(
                self._checked(*batch, reset=False) for batch in batches
            )
        first = next(checked, None)
        self._begin(None if first is None else FirstLook.at(first), more=True)
        return self._learn(chain([first] if first is not None else [], checked))

    def _each_checked(self, batches: Iterable[Sequence[Any]]) -> Iterator[Batch]:
        return (self._checked(*batch, reset=number == 0) for number, batch in enumerate(batches))

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
        parts, filled, learner = self._folds.parts, self._folds.filled, self._learner()
        if isinstance(self.solution_, RobustSolution):
            return self.solution_.held_out_score
        assert not isinstance(learner, SampleLearner)
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

    def uncertainty(self, X: ArrayLike) -> Uncertainty:
        """How far the unconstrained policy may be from :meth:`predict`, and why.

        Parameters
        ----------
        X : array_like, shape (N, n)
            States.

        Returns
        -------
        Uncertainty
            Standard deviations of each action coordinate, (N, d): from noise, from what the data does not
            determine, and in total.

        Raises
        ------
        SettingError
            If the learner does not look at samples; :class:`~unconstrain.Robust` does.
        """
        check_is_fitted(self, "solution_")
        if not isinstance(self.solution_, RobustSolution):
            raise SettingError(
                f"uncertainty: {type(self._learner()).__name__} does not tell it. Fit with learner=Robust()."
            )
        return uncertainty(self.solution_, *self._in_models(X))

    def _in_models(self, X: ArrayLike) -> tuple[Array, Array, Array]:
        """Features (N, p), shares of the models (N, M), and T_m (M, p, p)."""
        states, centring = self._checked_states(X), self._centring()
        features, shares = self._features(states), self._shares(states)
        return (
            features,
            np.ones((len(states), 1)) if shares is None else shares,
            np.eye(features.shape[1])[None] if centring is None else centring,
        )

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
        missed = moved = 0.0
        for states, actions, weights, _ in self._checked(X, y, sample_weight, reset=False).blocks():
            directions, lengths = unit_actions(actions)
            counts = np.ones(len(states)) if weights is None else weights
            missed += float(counts @ (lengths - (directions * self(states)).sum(axis=1)) ** 2)
            moved += float(counts @ lengths**2)
        return 1.0 - missed / moved if moved > 0 else 0.0

    def with_learner(self, learner: Learner | SampleLearner) -> Self:
        """Return the same policy with another learner, from the same moments: no second pass over the data.

        Raises
        ------
        SettingError
            If the learner needs the samples, and they were not kept: this policy's own does not need them.
        """
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

    def _forget(self) -> None:
        for fitted in ("_folds", "_splitter", "_kept", "n_features_in_", "solution_"):
            self.__dict__.pop(fitted, None)

    def _checked(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        groups: Groups | None = None,
        *,
        reset: bool,
    ) -> Batch:
        states = self._checked_states(X, reset=reset, convert=False)
        if y is None:
            raise InvalidDataError("requires y to be passed, but the target y is None: expected the observed actions.")
        actions, flat = as_table(y, "actions", convert=False)
        if len(actions) != len(states):
            raise InvalidDataError(
                f"got {len(states)} states and {len(actions)} actions (inconsistent numbers of samples), "
                "expected one action for each state."
            )
        if reset:
            self._flat, self.n_outputs_ = flat, actions.shape[1]
        elif actions.shape[1] != self.n_outputs_:
            raise InvalidDataError(f"actions: got {actions.shape[1]} columns, expected {self.n_outputs_} as before.")
        weights = None if sample_weight is None else as_weights(sample_weight, len(states))
        if weights is not None and not weights.any():
            raise InvalidDataError("sample_weight: all weights are zero, expected at least one that counts.")
        return Batch(states, actions, weights, None if groups is None else as_groups(groups, len(states)))

    def _checked_states(self, X: ArrayLike, *, reset: bool = False, convert: bool = True) -> Array:
        if isinstance(X, list | tuple):
            X = as_matrix(X, "states")  # our words for ragged rows
        try:
            # scikit-learn checks names, sparse input and the number of columns; the numbers are ours to check.
            kind = np.float64 if convert else "numeric"
            table = validate_data(self, X, reset=reset, dtype=kind, ensure_all_finite=False)
        except ValueError as error:
            raise InvalidDataError(str(error)) from error
        return as_matrix(table, "states", convert=convert)

    def _begin(self, look: FirstLook | None, *, more: bool) -> Self:
        """Choose all that has to be chosen before the first sample is summed."""
        if look is None:
            raise InvalidDataError("got no sample that counts, expected at least one.")
        validation = self.validation if self.validation is not None else Folds()
        self._at_rest = AT_REST * look.fastest
        self._splitter = Splitter(validation, look, more)
        # In a fixed order: repetition and order of the samples must not move the features.
        self._place(np.unique(look.states, axis=0))
        self._folds = self._nothing()
        self._kept = ()
        return self

    def _learn(self, batches: Iterable[Batch]) -> Self:
        if isinstance(self._learner(), SampleLearner):
            batches = tuple(batches)
            self._kept += batches
        self._folds = self._folds + self._summed(batches)
        self._conclude()
        return self

    def _nothing(self) -> FoldedMoments:
        """Moments of no sample."""
        typical = self._splitter.typical[None]
        features, actions, in_models = self._block(typical, np.zeros((1, self.n_outputs_)), np.ones(1))
        empty = Moments.zero(in_models.shape[1], actions.shape[1], features.shape[1])
        validation = self._splitter.validation
        return FoldedMoments((empty,) * validation.count, validation.held_out)

    def _summed(self, batches: Iterable[Batch]) -> FoldedMoments:
        folds = self._nothing()
        return sum((self._gather(block, folds) for batch in batches for block in batch.blocks()), start=folds)

    def _gather(self, batch: Batch, like: FoldedMoments) -> FoldedMoments:
        states, actions, counts, groups = batch
        weights = np.ones(len(states)) if counts is None else counts
        folds = self._splitter.assign(states, groups)
        order = np.argsort(folds, kind="stable")
        starts = np.searchsorted(folds[order], np.arange(len(like.parts) + 1))
        models, d, p = like.parts[0].cross.shape
        parts = []
        for start, stop in pairwise(starts):
            blocks = (self._block(states[rows], actions[rows], weights[rows]) for rows in _chunks(order[start:stop]))
            parts.append(gather_blocks(blocks, models, d, p, self._at_rest))
        return FoldedMoments(tuple(parts), like.held_out)

    def _block(self, states: Array, actions: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Features, actions, and how much each sample counts in each model."""
        in_models = self._weights(states)
        column = weights[:, None]
        return self._features(states), actions, column if in_models is None else column * in_models

    def _conclude(self) -> None:
        learner, centring = self._learner(), self._centring()
        if not isinstance(learner, SampleLearner):
            self.solution_ = self._solve(learner, self._folds)
            return
        if not getattr(self, "_kept", ()):
            raise SettingError(
                f"learner: {type(learner).__name__} needs the samples, and this policy has kept their sums alone. "
                f"Fit it with learner={type(learner).__name__}() from the start."
            )
        folds = self._folds if centring is None else self._folds.in_features(centring)
        filled = tuple(folds.parts[i] for i in folds.filled)
        self.solution_ = learner.learn(self._samples(), FoldedMoments(filled, range(len(filled))))

    def _solve(self, learner: Learner, folds: FoldedMoments) -> Solution:
        """Find the weights of the features φ(x)."""
        centring = self._centring()
        if centring is None:
            return learner.solve(folds)
        solution = learner.solve(folds.in_features(centring))
        return replace(solution, weights=solution.weights @ centring)

    def _samples(self) -> Samples:
        """All samples that were kept, in their order."""
        blocks = [block for batch in self._kept for block in batch.blocks()]
        states, actions = (np.concatenate([block[i] for block in blocks]) for i in (0, 1))
        counts = np.concatenate([np.ones(len(b.states)) if b.weights is None else b.weights for b in blocks])
        dealt = np.concatenate([self._splitter.assign(block.states, block.groups) for block in blocks])
        named = [None if b.groups is None else np.asarray(b.groups) for b in blocks]
        groups = np.zeros(len(states)) if any(n is None for n in named) else np.concatenate(named)  # type: ignore[arg-type]
        centring, p = self._centring(), self._folds.parts[0].gram.shape[-1]
        alone = np.ones((len(states), 1))
        weights, shares = self._weights(states), self._shares(states)
        return Samples(
            self._features(states),
            actions,
            counts,
            alone if weights is None else weights,
            alone if shares is None else shares,
            np.unique(groups, return_inverse=True)[1],
            np.unique(dealt, return_inverse=True)[1],
            np.eye(p)[None] if centring is None else centring,
        )

    def _learner(self) -> Learner | SampleLearner:
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


def _chunks(rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    return (rows[start : start + _ROWS] for start in range(0, len(rows), _ROWS))

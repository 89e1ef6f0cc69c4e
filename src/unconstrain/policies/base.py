"""What all policies share: sums from a stream, a learner, prediction."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import partial
from itertools import chain, pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted, validate_data

from ..base.arrays import (
    BLOCK_ROWS,
    Array,
    as_groups,
    as_matrix,
    as_table,
    as_weights,
    beside,
    check_at_least,
    is_foreign,
    namespace,
    on_host,
    slices,
)
from ..base.errors import InvalidDataError, SettingError
from ..base.threads import Workers, workers
from ..learners import Hybrid, Learner, RobustSolution, SampleLearner, Solution
from ..recordings import Batch, Demonstration, FirstLook, Groups, stack
from ..risks import Moments, Sums, inconsistency, unit_actions, vec
from ..training import FoldedMoments, Folds, Splitter, Validation
from .deployable import Deployable
from .looking import Looking

__all__ = ["Policy"]

AT_REST = 1e-12
"""Actions shorter than this share of the largest at first look are rounding around rest."""

_ROWS = 4096
"""Rows that are predicted together, so that what is made of them stays in cache."""

_SPREAD = 200
"""Weights from which on folds are summed in threads: with fewer, steps are short and threads mostly wait."""


class Policy(Deployable, Looking, RegressorMixin, BaseEstimator):
    """What both policies share: fitting from a stream, predicting, stepping, changing the learner."""

    learner: Learner | SampleLearner | None
    validation: Validation | None
    _flat: bool

    @abstractmethod
    def _place(self, look: FirstLook) -> None:
        """Fix features and fields on what was seen at first look."""

    def fit(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None, groups: Groups | None = None
    ) -> Self:
        """Learn the unconstrained policy.

        Parameters
        ----------
        X : array_like, shape (N, n)
            States. These and the actions may be arrays of any library that
            follows the array API standard; they are summed where they are.
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
        if speed_power and isinstance(self._learner(), SampleLearner):
            raise SettingError("speed_power: learners that look at the samples weigh speed themselves, expected 0.")
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
        if isinstance(learner, SampleLearner):
            return float("nan")
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
            Of the library and on the device of the states.
        """
        check_is_fitted(self, "solution_")
        states = self._checked_states(X)
        blocks = slices(states, BLOCK_ROWS if is_foreign(states) else _ROWS)
        actions: Array = namespace(states).concat([self._predict_block(states[rows, :]) for rows in blocks])
        return actions[:, 0] if self._flat else actions

    def __call__(self, states: ArrayLike) -> Array:
        """Be a policy: the same as :meth:`predict`, always of shape (N, d)."""
        actions = self.predict(states)
        return actions[:, None] if self._flat else actions

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
            xp = namespace(lengths)
            counts = xp.ones_like(lengths) if weights is None else beside(weights, lengths)
            missed += float(counts @ (lengths - xp.sum(directions * self(states), axis=1)) ** 2)
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
        if is_foreign(y) != is_foreign(states):
            y = beside(on_host(y), states)
        actions, flat = as_table(y, "actions", convert=False)
        samples = states.shape[0]
        if actions.shape[0] != samples:
            raise InvalidDataError(
                f"got {samples} states and {actions.shape[0]} actions (inconsistent numbers of samples), "
                "expected one action for each state."
            )
        if reset:
            self._flat, self.n_outputs_ = flat, actions.shape[1]
        elif actions.shape[1] != self.n_outputs_:
            raise InvalidDataError(f"actions: got {actions.shape[1]} columns, expected {self.n_outputs_} as before.")
        weights = None if sample_weight is None else as_weights(sample_weight, samples)
        if weights is not None and not weights.any():
            raise InvalidDataError("sample_weight: all weights are zero, expected at least one that counts.")
        return Batch(states, actions, weights, None if groups is None else as_groups(groups, samples))

    def _checked_states(self, X: ArrayLike, *, reset: bool = False, convert: bool = True) -> Array:
        if isinstance(X, list | tuple):
            X = as_matrix(X, "states")  # our words for ragged rows
        try:
            # scikit-learn checks names, sparse input and the number of columns; the numbers are ours to check.
            kind = np.float64 if convert else "numeric"
            if is_foreign(X):
                table = as_matrix(X, "states", convert=convert)
                validate_data(self, table, reset=reset, skip_check_array=True)
                return table
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
        self._place(look)
        self._folds = self._nothing()
        self._kept = ()
        return self

    def _learn(self, batches: Iterable[Batch]) -> Self:
        kept: tuple[Batch, ...] = ()
        if isinstance(self._learner(), SampleLearner):
            batches = tuple(map(deepcopy, batches))  # the caller may use a buffer again
            kept = (*self._samples_so_far(), *batches)
        summed = self._summed(batches)
        self._folds = self._folds + summed if self._folds.filled else summed
        self._kept = kept
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
        like = self._nothing()
        models, d, p = like.parts[0].cross.shape
        sums = [Sums(models, d, p, self._at_rest) for _ in like.parts]
        with workers() as threads:
            for batch in batches:
                for block in batch.blocks():
                    self._add(block, sums, threads)
        return FoldedMoments(tuple(each.moments.on_host() for each in sums), like.held_out)

    def _add(self, batch: Batch, sums: Sequence[Sums], threads: Workers) -> None:
        """Add samples to the sums of their folds."""
        folds = self._splitter.assign(on_host(batch.states), batch.groups)
        # Each fold in one piece; of small integers NumPy sorts by counting.
        order = np.argsort(folds.astype(np.min_scalar_type(len(sums))), kind="stable")
        starts = np.searchsorted(folds[order], np.arange(len(sums) + 1)).tolist()
        states, actions, weights, _ = batch.at(order)
        weights = beside(np.ones(len(order)) if weights is None else weights, states)

        def add(fold: Sums, start: int, stop: int) -> None:
            for rows in fold.pieces(states, start, stop):
                fold.add(*self._block(states[rows, :], actions[rows, :], weights[rows]))

        ends = zip(sums, pairwise(starts), strict=True)
        calls = [partial(add, fold, start, stop) for fold, (start, stop) in ends if start < stop]
        models, d, p = sums[0].shape
        # Of tensors, what runs where is for their library to say.
        worth = d * p >= _SPREAD and not is_foreign(states)
        threads.run(calls, 0.5 * len(order) * models * (d * p) ** 2 if worth else 0.0)

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
        folds = self._folds if centring is None else self._folds.in_features(centring)
        samples = self._samples()
        # In the order of time, wherever demonstrations come interleaved; and weights such as 1/N are no weak data.
        order = np.argsort(samples.groups, kind="stable")
        factor = max(1.0, len(samples) / samples.counts.sum())
        samples = replace(samples[order], counts=factor * samples.counts[order])
        filled = tuple(factor * folds.parts[i] for i in folds.filled)
        solution = learner.learn(samples, FoldedMoments(filled, range(len(filled))))
        if isinstance(solution, RobustSolution):
            solution = replace(solution, free=solution.free[np.argsort(order)])
        self.solution_ = solution

    def _solve(self, learner: Learner, folds: FoldedMoments) -> Solution:
        """Find the weights of the features φ(x)."""
        centring = self._centring()
        if centring is None:
            return learner.solve(folds)
        solution = learner.solve(folds.in_features(centring))
        return replace(solution, weights=solution.weights @ centring)

    def _learner(self) -> Learner | SampleLearner:
        return self.learner if self.learner is not None else Hybrid()

    def _predict_block(self, states: Array) -> Array:
        weights, models = self.solution_.weights, self._shares(states)
        features = self._features(states)
        if models is None:
            return features @ beside(weights[0].T, states)
        each = namespace(states).tensordot(features, beside(weights, states), axes=((1,), (2,)))  # (N, M, d)
        if is_foreign(each):
            return (models[:, None, :] @ each)[:, 0, :]
        return np.einsum("nm,nmd->nd", models, each)  # NumPy is slow at many small products

    def __sklearn_tags__(self) -> Any:
        """Say that actions may have several columns."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

"""What a policy does for learners that look at the samples: keeps them, and says what is not known."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from ..base.arrays import Array, on_host
from ..base.errors import SettingError
from ..learners import Learner, RobustSolution, SampleLearner, Samples, Solution, Uncertainty
from ..learners.robust import uncertainty
from ..recordings import Batch
from ..training import FoldedMoments, Splitter

__all__ = ["Looking"]


class Looking:
    """A policy's samples, as long as its learner needs them."""

    solution_: Solution
    _folds: FoldedMoments
    _splitter: Splitter
    _kept: tuple[Batch, ...]

    @abstractmethod
    def _checked_states(self, X: ArrayLike) -> Array:
        """States that are fit for use, shape (N, n)."""

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

    def _roughness(self) -> Array | None:
        """Measure of how rough each model is, shape (M, p, p); None where nothing is said of it."""
        return None

    @abstractmethod
    def _learner(self) -> Learner | SampleLearner:
        """The learner in use."""

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
        states, centring = on_host(self._checked_states(X)), self._centring()
        features, shares = self._features(states), self._shares(states)
        return (
            features,
            np.ones((len(states), 1)) if shares is None else shares,
            np.eye(features.shape[1])[None] if centring is None else centring,
        )

    def _samples_so_far(self) -> tuple[Batch, ...]:
        """The batches that were kept; a policy that was stored, or whose learner needed none, has not."""
        kept: tuple[Batch, ...] = getattr(self, "_kept", ())
        if not kept and self._folds.filled:
            name = type(self._learner()).__name__
            raise SettingError(
                f"learner: {name} needs the samples, and this policy has their sums alone. "
                f"Fit it with learner={name}() from the start."
            )
        return kept

    def _samples(self) -> Samples:
        """All samples that were kept, in their order."""
        blocks = [block for batch in self._samples_so_far() for block in batch.blocks()]
        states, actions = (np.concatenate([on_host(block[i]) for block in blocks]) for i in (0, 1))
        counts = np.concatenate([np.ones(len(b.states)) if b.weights is None else b.weights for b in blocks])
        dealt = np.concatenate([self._splitter.assign(on_host(block.states), block.groups) for block in blocks])
        named = [None if b.groups is None else np.asarray(b.groups) for b in blocks]
        groups = np.zeros(len(states)) if any(n is None for n in named) else np.concatenate(named)  # type: ignore[arg-type]
        centring, rough, p = self._centring(), self._roughness(), self._folds.parts[0].gram.shape[-1]
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
            np.zeros((weights.shape[1] if weights is not None else 1, p, p)) if rough is None else rough,
        )

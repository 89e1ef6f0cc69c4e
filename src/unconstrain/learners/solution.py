"""What a learner found, and what it believes of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array
from ..base.display import Shown, counted
from ..base.errors import MissingBeliefError

if TYPE_CHECKING:
    from ..models import Model


class Uncertainty(NamedTuple):
    """Standard deviations of the predicted policy, each of shape (N, d).

    ``from_noise`` is what noise and misfit leave open, ``undetermined`` what
    the data does not say, and ``total`` both: 95 % of the time the policy
    should be within 1.96 of it, where ``undetermined`` is not most of it.
    """

    from_noise: Array
    undetermined: Array
    total: Array


@dataclass(frozen=True, eq=False, repr=False)
class Belief(Shown):
    """What a learner that looks at samples believes beside the weights.

    Parameters
    ----------
    noise : float
        Standard deviation of the noise on each action coordinate, misfit of the model included.
    misfit : float
        Standard deviation, per action coordinate, of what the model of the policy misses: the part of the residuals
        that goes on smoothly in time, and 1.5 % of the actions' size, which no model is trusted to be below.
    free_share : float
        Estimated share of samples that nothing constrained.
    free : ndarray, shape (N,)
        Probability that each sample was free, in the order in which they were given.
    from_noise, undetermined : ndarray, shape (M, d p, d p)
        Covariance of the weights over ``T_m φ``, due to noise in the data and due to what the data does not say.
    held_out_score : float
        Share of the observed motion that is explained where it is held out, as by ``Policy.score``.
    compared : dict
        Logarithm of each candidate's held-out inconsistency over that on noise-corrected moments.
    refuted : bool
        Whether that of the most probable policy was too far above.
    candidates : dict
        Weights (M, d, p) of everything that was learnt to choose from, by name.
    """

    noise: float
    misfit: float
    free_share: float
    free: Array
    from_noise: Array
    undetermined: Array
    held_out_score: float = float("nan")
    compared: dict[str, float] = field(default_factory=dict)
    refuted: bool = False
    candidates: dict[str, Array] = field(default_factory=dict)

    def uncertainty(self, model: Model, states: Array) -> Uncertainty:
        """Posterior spread of the prediction at N states.

        Neighbouring models learn from the same samples, so their errors are
        taken to go together: standard deviations are averaged, not variances.
        """
        spread = _Spread(model, states)
        from_noise = np.hypot(spread.of(self.from_noise), self.misfit)
        undetermined = spread.of(self.undetermined)
        return Uncertainty(from_noise, undetermined, np.hypot(from_noise, undetermined))

    def covariances(self, model: Model, states: Array) -> Array:
        """Covariance of the prediction at N states due to what the data does not say, shape (N, d, d).

        On the diagonal are the squares of ``uncertainty(...).undetermined``. Beside it, models are mixed by their
        correlations, so that the result is positive.
        """
        return _Spread(model, states).covariances(self.undetermined)

    def _summary(self) -> tuple[str, ...]:
        noise = f"noise={self.noise:.3g}", f"misfit={self.misfit:.3g}"
        free = f"{self.free_share:.0%} of {counted(len(self.free), 'sample')} free"
        return *noise, free, *(("likelihood refuted",) if self.refuted else ())


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Shown):
    """What a learner found, for each of M models.

    Parameters
    ----------
    weights : ndarray, shape (M, d, p)
        The policy's weights W. A learner gives them over the features ``T_m φ`` whose moments it is shown; those of a
        fitted policy are over φ.
    determined : ndarray of int, shape (M,)
        How many of the ``directions`` the first objective determined.
    directions : int
        Dimension of the weight space, ``P = d p``.
    threshold : ndarray, shape (M,)
        The λ_t used, as a share of the largest eigenvalue.
    eigenvalues : ndarray, shape (M, P), optional
        Of the inconsistency's Hessian, ascending, where it was factored.
    scores : ndarray, shape (M, P + 1), optional
        Held-out ``E_i + α E_2`` per unit of weight, averaged over the folds,
        for every number of undetermined directions, where the threshold was
        chosen by it.
    method : str
        How it was learnt; of several candidates, which was chosen.
    belief : Belief, optional
        From learners that look at the samples.
    """

    weights: Array
    determined: NDArray[np.intp]
    directions: int
    threshold: Array
    eigenvalues: Array | None = None
    scores: Array | None = None
    method: str = ""
    belief: Belief | None = None

    @property
    def determined_share(self) -> float:
        """Share of all weight directions that the first objective determined, 0 to 1."""
        return float(self.determined.sum() / (self.directions * len(self.determined)))

    @property
    def believed(self) -> Belief:
        """The belief.

        Raises
        ------
        MissingBeliefError
            If the learner has none, since it does not look at the samples.
        """
        if self.belief is None:
            raise MissingBeliefError(
                f"learner: {self.method or 'this one'} works on sums alone and does not tell it. "
                "Fit with learner=Robust()."
            )
        return self.belief

    @property
    def noise(self) -> float:
        """Standard deviation of the noise on each action coordinate, misfit of the model included."""
        return self.believed.noise

    @property
    def free(self) -> Array:
        """Probability that each sample was free, shape (N,), in the order in which they were given."""
        return self.believed.free

    @property
    def free_share(self) -> float:
        """Estimated share of samples that nothing constrained."""
        return self.believed.free_share

    @property
    def candidates(self) -> dict[str, Array]:
        """Weights (M, d, p) of everything that was learnt to choose from, by name."""
        return self.believed.candidates

    def over(self, model: Model) -> Solution:
        """With weights over the features φ(x), from those over ``T_m φ``."""
        centring = model.centring
        if centring is None:
            return self
        belief = self.belief and replace(
            self.belief, candidates={name: one @ centring for name, one in self.belief.candidates.items()}
        )
        return replace(self, weights=self.weights @ centring, belief=belief)

    def _summary(self) -> tuple[str, ...]:
        directions = counted(self.directions * len(self.determined), "direction")
        every = f"{self.determined_share:.0%} of {directions} determined"
        noise = () if self.belief is None else (f"noise={self.noise:.3g}",)
        return self.method or "no method named", counted(len(self.weights), "model"), every, *noise


class _Spread:
    """Each model's features and share at some states, by which a covariance of weights becomes one of actions."""

    def __init__(self, model: Model, states: Array) -> None:
        self._features, shares = model.design(states), model.fields.shares(states)
        centring, p = model.centring, self._features.shape[1]
        self._models = list(zip(shares.T, np.eye(p)[None] if centring is None else centring, strict=True))

    def of(self, covariance: Array) -> Array:
        """Standard deviation of each action coordinate, averaged over the models, shape (N, d)."""
        p = self._features.shape[1]
        d = covariance.shape[1] // p
        spread = np.zeros((len(self._features), d))
        for (share, change), blocks in zip(self._models, covariance, strict=True):
            own = self._features @ change.T
            of_action = blocks.reshape(p, d, p, d)
            for action in range(d):
                variance = ((own @ of_action[:, action, :, action]) * own).sum(axis=1)
                spread[:, action] += share * np.sqrt(np.maximum(variance, 0.0))
        return spread

    def covariances(self, covariance: Array) -> Array:
        """Covariance of the actions, shape (N, d, d)."""
        p = self._features.shape[1]
        d = covariance.shape[1] // p
        spread = self.of(covariance)
        mixed = np.zeros((len(self._features), d, d))
        for (share, change), blocks in zip(self._models, covariance, strict=True):
            own = self._features @ change.T
            local = np.einsum("ni,iajb,nj->nab", own, blocks.reshape(p, d, p, d), own, optimize=True)
            size = np.sqrt(np.maximum(np.einsum("naa->na", local), 0.0))
            inverse = np.where(size > 0, 1.0 / np.where(size > 0, size, 1.0), 0.0)
            mixed += share[:, None, None] * inverse[:, :, None] * local * inverse[:, None, :]
        mixed[:, np.arange(d), np.arange(d)] = 1.0
        return np.asarray(spread[:, :, None] * mixed * spread[:, None, :])

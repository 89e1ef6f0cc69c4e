"""Result of a learner: the weights, and a belief about noise, free samples and uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, check_learnt
from ..base.display import Shown, counted, percent
from ..base.errors import MissingBeliefError

if TYPE_CHECKING:
    from ..models import Model


class Uncertainty(NamedTuple):
    """Standard deviations of the predicted policy, each of shape (N, d).

    ``from_noise`` is due to noise and misfit, ``undetermined`` to directions
    that the data does not determine without any two demonstrations (all may), and ``total`` to both. It should
    be within 1.96 of ``total`` 95 % of the time, except where ``undetermined``
    is most of it.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, -states, groups=np.repeat([0, 1, 2], 20))
    >>> policy.uncertainty(states[:5]).undetermined.shape
    (5, 2)
    """

    from_noise: Array
    undetermined: Array
    total: Array


@dataclass(frozen=True, eq=False, repr=False)
class Judged(Shown):
    """Estimated error of a candidate, without the truth; see :mod:`unconstrain.learners.robust.choice`.

    All are shares of the mean squared action.

    Parameters
    ----------
    loss : float
        Mean squared residual along the held-out actions, without the noise's part.
    variance : float
        Variance across the action.
    bias : float
        Squared bias across the action.
    risk : float
        Sum of the three, up to the least loss of all candidates.
    weights : ndarray, shape (M, d, p)
        What was learnt.
    """

    loss: float
    variance: float
    bias: float
    risk: float
    weights: Array

    def _summary(self) -> tuple[str, ...]:
        return tuple(f"{name}={getattr(self, name):.3g}" for name in ("risk", "loss", "variance", "bias"))


@dataclass(frozen=True, eq=False, repr=False)
class Belief(Shown):
    """Estimates beside the weights, of a learner that uses the samples.

    Parameters
    ----------
    noise : float
        Standard deviation of the noise on each action coordinate, misfit of the model included.
    misfit : float
        Standard deviation of the model's misfit per action coordinate: the part of the residuals that is smooth in
        time, and 0.5 % of the actions' root-mean-square length as a floor.
    free_share : float
        Estimated share of samples that nothing constrained.
    free : ndarray, shape (N,)
        Probability that each sample was free, in the order in which they were given; at most a half where it may as
        well have been held in a way that no other demonstration shows.
    from_noise, undetermined : ndarray, shape (M, d p, d p)
        Posterior covariance of the weights over ``T_m φ``, due to noise and to directions that the data does not
        determine.
    held_out_score : float
        Share of the squared motion that is explained where held out, as by ``Policy.score``.
    left_out : float
        Share of the squared motion that is missed where demonstrations that were held alike are left out together, if
        ``held_out_score`` is not about that, but about what to expect if one model holds for all; else 0.
    candidates : dict
        Judged error of each candidate, by name, where the learner chose among several.
    undecided_share : float
        Estimated share of samples that were free, or held in a way that no other demonstration shows.
    suspects : ndarray of int, shape (K,)
        Samples that look wrong and were left out, by their places among those given.
    told_together : float
        Share of samples at which all actions along themselves determine the policy, those of one or two demonstrations.
    together : ndarray of bool, shape (N,)
        Which samples these are; empty where not known.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, -states, groups=np.repeat([0, 1, 2], 20))
    >>> policy.solution_.belief.free.shape
    (60,)
    """

    noise: float
    misfit: float
    free_share: float
    free: Array
    from_noise: Array
    undetermined: Array
    held_out_score: float = float("nan")
    candidates: dict[str, Judged] = field(default_factory=dict)
    undecided_share: float = 0.0
    suspects: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    told_together: float = 0.0
    together: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    left_out: float = 0.0

    def uncertainty(self, model: Model, states: Array) -> Uncertainty:
        """Posterior standard deviations of the prediction at N states.

        Neighbouring models learn from the same samples, so their errors are
        taken as fully correlated: standard deviations are averaged, not variances.
        """
        spread = _Spread(model, states)
        from_noise = np.hypot(spread.of(self.from_noise), self.misfit)
        undetermined = spread.of(self.undetermined)
        return Uncertainty(from_noise, undetermined, np.hypot(from_noise, undetermined))

    def in_units(self, action: float) -> Belief:
        """With actions measured in a unit ``1 / action`` as large."""
        return replace(
            self,
            noise=action * self.noise,
            misfit=action * self.misfit,
            from_noise=action * (action * self.from_noise),
            undetermined=action * (action * self.undetermined),
            candidates={name: replace(one, weights=action * one.weights) for name, one in self.candidates.items()},
        )

    def covariances(self, model: Model, states: Array) -> Array:
        """Covariance of the prediction at N states in what the data does not determine, shape (N, d, d).

        Variances are the squares of ``uncertainty(...).undetermined``. Correlations are those of the models, averaged
        by their shares, so that the result is positive semidefinite.
        """
        return _Spread(model, states).covariances(self.undetermined)

    def _summary(self) -> tuple[str, ...]:
        noise = f"noise={self.noise:.3g}", f"misfit={self.misfit:.3g}"
        free = f"{percent(self.free_share)} of {counted(len(self.free), 'sample')} free"
        unknown = f"{percent(self.undecided_share)} free or always held alike"
        return *noise, free, *[unknown][: self.undecided_share >= 0.01]


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Shown):
    """Result of a learner, for each of M models.

    Parameters
    ----------
    weights : ndarray, shape (M, d, p)
        The policy's weights W. Those that ``learn`` returns are over the features ``T_m φ`` of ``training.folds``,
        those of a fitted policy over φ.
    determined : ndarray of int, shape (M,)
        Number of the ``directions`` that the first objective determines.
    directions : int
        Dimension of the weight space, ``P = d p``.
    threshold : ndarray, shape (M,)
        The λ_t used, as a share of the largest eigenvalue.
    eigenvalues : ndarray, shape (M, P), optional
        Of the inconsistency's Hessian, ascending, where they were computed.
    scores : ndarray, shape (M, P + 1), optional
        Held-out ``E_i + α E_2`` per unit of weight, averaged over the folds,
        for every number of undetermined directions, where the threshold was
        chosen by it.
    method : str
        Name of the learner, or of the candidate that was taken.
    belief : Belief, optional
        Of learners that use the samples.
    notes : tuple of str
        What had to be assumed, and what could not be tried, sentence by sentence.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(40, 2))
    >>> actions = -states * np.eye(2)[np.arange(40) % 2]  # now one coordinate is held, now the other
    >>> solution = uc.ParametricPolicy(uc.Affine(), uc.Hybrid()).fit(states, actions).solution_
    >>> solution.directions, solution.determined
    (6, array([6]))
    """

    weights: Array
    determined: NDArray[np.intp]
    directions: int
    threshold: Array
    eigenvalues: Array | None = None
    scores: Array | None = None
    method: str = ""
    belief: Belief | None = None
    notes: tuple[str, ...] = ()

    @property
    def determined_share(self) -> float:
        """Share of all weight directions that the first objective determined, 0 to 1."""
        return float(self.determined.sum() / (self.directions * len(self.determined)))

    @property
    def believed(self) -> Belief:
        """What is estimated beside the weights: noise, which samples were free, how far the policy may be off.

        Raises
        ------
        MissingBeliefError
            If the learner has none, since it does not use the samples.
        """
        if self.belief is None:
            raise MissingBeliefError(
                f"noise: {self.method or 'this learner'} learnt from sums, which tell no noise and no free samples. "
                "Fit with learner=Robust(), where it sees the samples: anew on all, and not on from a stored policy."
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
    def left_out(self) -> float:
        """Share of the motion that is missed where those held alike are left out together; see :class:`Belief`."""
        return 0.0 if self.belief is None else self.belief.left_out

    @property
    def candidates(self) -> dict[str, Judged]:
        """Judged error of each candidate, by name."""
        return self.believed.candidates

    def over(self, model: Model) -> Solution:
        """With weights over the features φ(x), from those over ``T_m φ``."""
        centring = model.centring
        if centring is None:
            return self
        belief = self.belief and replace(
            self.belief,
            candidates={
                name: replace(one, weights=one.weights @ centring) for name, one in self.belief.candidates.items()
            },
        )
        return replace(self, weights=self.weights @ centring, belief=belief)

    def checked(self) -> Solution:
        """Itself, if it is finite.

        Raises
        ------
        InvalidDataError
            If the weights are not finite.
        """
        check_learnt(self.weights)
        return self

    def in_units(self, action: float, weight: float) -> Solution:
        """With actions and sample weights measured in units ``1 / action`` and ``1 / weight`` as large."""
        return replace(
            self,
            weights=action * self.weights,
            eigenvalues=None if self.eigenvalues is None else weight * self.eigenvalues,
            scores=None if self.scores is None else action * (action * self.scores),
            belief=self.belief and self.belief.in_units(action),
        )

    def _summary(self) -> tuple[str, ...]:
        directions = counted(self.directions * len(self.determined), "direction")
        every = f"{percent(self.determined_share)} of {directions} determined"
        noise = () if self.belief is None else (f"noise={self.noise:.3g}",)
        return self.method or "no method named", counted(len(self.weights), "model"), every, *noise


class _Spread:
    """Propagates covariances of the weights to the predictions at some states."""

    def __init__(self, model: Model, states: Array) -> None:
        self._features, shares = model.design(states), model.shares(states)
        centring = np.eye(self._features.shape[1])[None] if model.centring is None else model.centring
        self._models, self._regressors = list(zip(shares.T, centring, strict=True)), centring.shape[1]

    def of(self, covariance: Array) -> Array:
        """Standard deviation of each action coordinate, averaged over the models by their shares, shape (N, d)."""
        p = self._regressors
        d = covariance.shape[1] // p
        spread = np.zeros((len(self._features), d))
        for (share, change), blocks in zip(self._models, covariance, strict=True):
            own = self._features @ change.T
            of_action = blocks.reshape(p, d, p, d)
            for action in range(d):
                variance = np.vecdot(own @ of_action[:, action, :, action], own)
                spread[:, action] += share * np.sqrt(np.maximum(variance, 0.0))
        return spread

    def covariances(self, covariance: Array) -> Array:
        """Covariance of the actions, shape (N, d, d)."""
        p = self._regressors
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

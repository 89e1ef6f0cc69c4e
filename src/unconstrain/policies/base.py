"""What both policies share: learning from samples as they come, predicting, leaving for a robot."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy, deepcopy
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any, ClassVar, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from ..base.arrays import Array, Groups, check_at_least, on_host
from ..base.display import ShownWithSolution
from ..base.errors import InvalidDataError, SettingError
from ..base.estimators import checked_states
from ..base.parameters import Parameters, others_by_name
from ..deployment import Deployable
from ..learners import Learner, Robust, Solution, Uncertainty, named
from ..models import FeatureMap, Model, Scale, spaces
from ..recordings import Demonstration, noise_of, preparation, stack, times_of
from ..risks import Moments, along_motion
from ..training import Batch, FirstLook, Folds, Seen, Split, Training, Validation, cluster, is_typical

Asked: TypeAlias = Sequence[float] | Literal["auto"] | None
"""A scale as it is asked for."""

_LOOKED_AT = 2000
"""Samples that are learnt from to choose among scales."""

_FITTED = (
    *("training_", "solution_", "n_features_in_", "feature_names_in_"),
    *("n_outputs_", "_flat", "_waiting", "_space", "scale_"),
)


class Policy(Parameters, ShownWithSolution, Deployable, RegressorMixin, BaseEstimator, ABC):
    """A policy that learns: a :class:`~unconstrain.models.Model`, what was seen, and the solution found.

    Attributes
    ----------
    training_ : Training
        Model, folds and sums of all samples so far, and the samples where the learner needs them.
    solution_ : Solution
        Weights (M, d, p), and what the data determined.
    scale_ : Scale or None
        Units in which both are; None for those of the data.

    Examples
    --------
    >>> isinstance(uc.LocallyLinearPolicy(), uc.Policy)
    True
    """

    learner: Learner | str | None
    validation: Validation | None
    space: spaces.Space | None = None
    scale: Asked = None
    scale_: Scale | None = None
    training_: Training
    solution_: Solution
    n_outputs_: int
    _flat: bool
    _space: spaces.Space
    _usual: ClassVar[str | None] = None

    @abstractmethod
    def places(self, look: FirstLook) -> Mapping[str, Model]:
        """Fix features and fields on what was seen at first look: models to choose from, by name."""

    # Learning: each works on a draft, which takes this policy's place when all has gone well.

    @others_by_name
    def fit(
        self, X: ArrayLike, y: ArrayLike, *, sample_weight: ArrayLike | None = None, groups: Groups | None = None
    ) -> Self:
        """Learn the unconstrained policy. If anything fails, this policy is as it was.

        Warns where next to nothing of held-out motion is explained. ``solution_.notes`` says so, and what was assumed.

        Parameters
        ----------
        X : array_like, shape (N, n)
            States; these and actions of any library of the array API standard are summed where they are.
        y : array_like, shape (N, d) or (N,)
            Observed actions, each the projection of the policy by an unknown constraint.
        sample_weight : array_like, shape (N,), optional
            A weight of two is the same as a repetition.
        groups : array_like, shape (N,), optional
            Which demonstration each sample is from, so that whole demonstrations can be held out.

        Raises
        ------
        InvalidDataError
            If the arrays are ragged, empty, of different lengths or not finite.
        """
        return self._fit(named(self.learner), X, y, sample_weight, groups)

    def _fit(self, learner: Learner, *batch: Any, space: spaces.Space | None = None) -> Self:
        draft = self._draft(*_FITTED)
        checked = draft._checked(*batch, reset=True, space=space)
        look = FirstLook.whole([checked], draft._space)
        began = draft._began(look, learner, more=False, seen=[checked])
        return self._become(began._learnt([checked], learner))

    @others_by_name
    def partial_fit(
        self, X: ArrayLike, y: ArrayLike, *, sample_weight: ArrayLike | None = None, groups: Groups | None = None
    ) -> Self:
        """Learn from a further batch; the sums are those of all batches at once.

        The first batch, which should be typical, fixes features, fields, action dimensions, the spread by which samples
        are dealt into folds, and a scale that is ``"auto"``; a later one that is unlike in it is warned of. Batches of
        too few different states are kept until there are enough. Parameters, result and errors as in :meth:`fit`. The
        solution is found anew each time; where only the last counts, :meth:`fit_batches` is faster. Warns, too, if that
        is from sums alone after samples, as of a stored policy.
        """
        first, learner, draft = not hasattr(self, "solution_"), named(self.learner), self._draft()
        batch = draft._checked(X, y, sample_weight, groups, reset=first)
        waiting: Batch | None = getattr(self, "_waiting", None)
        if not first and waiting is None:
            return self._become(draft._learnt([batch], learner))
        seen = batch if waiting is None else waiting.followed_by(batch)
        look = FirstLook.whole([seen], draft._space)
        draft._began(look, learner, more=True, seen=[seen])._learnt([seen], learner)
        enough = is_typical(seen, batch.states.shape[0], draft._space)
        draft._waiting = None if enough else deepcopy(seen)  # who gave it may use its memory again
        return self._become(draft)

    def fit_batches(self, batches: Iterable[Sequence[Any]]) -> Self:
        """Learn from more than fits into memory, batch by batch, solving once.

        What can be walked through twice, such as a list or :class:`unconstrain.Stream`, is: first to choose features,
        fields and folds, then to sum. The result is that of :meth:`fit` on everything, to rounding, however the samples
        are cut into batches. A generator is walked through once; its first batches fix what would have been chosen.

        Parameters
        ----------
        batches : iterable of tuples
            Each ``(X, y)``, with ``sample_weight`` and ``groups`` or not, as :meth:`fit` takes them; at least one.
        """
        learner = self._check_speed_power(getattr(batches, "speed_power", 0.0))
        if iter(batches) is not batches:
            return self._fit_parts([batches], lambda function, parts: function(*parts), learner, together=True)
        draft = self._draft(*_FITTED)
        checked = draft._each_checked(batches)
        seen: Batch | None = None
        for batch in checked:
            seen = batch if seen is None else seen.followed_by(batch)
            if is_typical(seen, batch.states.shape[0], draft._space):
                break
            seen = deepcopy(seen)  # before the next batch, which may come in the same memory
        look, first = (None, ()) if seen is None else (FirstLook.whole([seen], draft._space), (seen,))
        began = draft._began(look, learner, more=True, seen=first)
        return self._become(began._learnt(chain(first, checked), learner))

    def fit_parts(self, parts: Sequence[Any], summed: Callable[..., Any]) -> Self:
        """Learn from parts wherever they are; see :mod:`unconstrain.cluster`.

        Each is an iterable of batches as :meth:`fit_batches` takes them, or something that ``summed`` makes one of.
        ``summed(function, parts)`` is the sum of a function at each part, in their order; the function and what it
        returns can be pickled. Errors are those of :meth:`fit`, and a learner that needs the samples is refused.
        """
        learner = named(self.learner)
        cluster.check_learner(learner)
        if isinstance(self.scale, str):
            raise SettingError(
                f"scale: got {self.scale!r}, which looks at samples, and a cluster sends sums. Take numbers."
            )
        if not parts:
            raise InvalidDataError("got no part to learn from, expected at least one.")
        return self._fit_parts(parts, summed, learner, together=False)

    def _fit_parts(self, parts: Sequence[Any], summed: Callable[..., Any], learner: Learner, *, together: bool) -> Self:
        draft = self._draft(*_FITTED)
        seen = summed(partial(_seen, draft), parts)
        draft.__dict__.update(seen.noted)
        again = cluster.openings(partial(_opened, draft), parts, summed)
        draft._began(seen.look and seen.look.placed, learner, more=False, together=together, seen=again)
        draft.training_ = summed(partial(_gathered, draft), parts)
        return self._become(draft._solved(learner))

    def fit_demonstrations(
        self, demonstrations: Demonstration | Sequence[Demonstration], speed_power: float = 0.0
    ) -> Self:
        """Learn from demonstrations, each its own group.

        What is not as it seems in them, such as targets for velocities, is said in ``solution_.notes``.

        Parameters
        ----------
        demonstrations : Demonstration or sequence of Demonstration
        speed_power : float
            Samples count by this power of their speed. 0 is the paper; 2 helps on noisy recordings, since the direction
            of a slow movement is mostly noise. Learners that look at samples weigh speed themselves: with this, the
            default is :class:`~unconstrain.Hybrid`.
        """
        demos = [demonstrations] if isinstance(demonstrations, Demonstration) else list(demonstrations)
        states, actions, groups = stack(demos)
        learner = self._check_speed_power(speed_power)
        speed = np.linalg.norm(actions, axis=1)
        weights = (speed / speed.max()) ** speed_power if speed_power and speed.any() else None
        doubts = preparation.doubts_about(demos)
        self._fit(learner, states, actions, weights, groups, times_of(demos), noise_of(demos), space=demos[0].space)
        if self.scale is not None and not self._is_curved:
            doubts.pop("mixed-units", None)  # is what it cures
        self.solution_ = replace(self.solution_, notes=(*self.solution_.notes, *doubts.values()))
        return self

    def with_learner(self, learner: Learner | str) -> Self:
        """Return the same policy with another learner, from the same moments: no second pass over the data.

        Raises
        ------
        SettingError
            If the learner needs the samples, and they were not kept: this policy's own does not need them.
        """
        check_is_fitted(self, "solution_")
        other = copy(self)
        other.learner = learner
        return other._solved(named(learner))

    def in_own_units(self) -> Self:
        """The same policy from states to actions in units of its own, those of ``scale_``."""
        other = self._draft("_prepared")
        other.scale_ = None
        return other

    # What was learnt.

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
        known, states = self.__dict__, checked_states(self, X)  # as it is now: another thread may put in a new one
        scale = known.get("scale_")
        actions = known["training_"].model.predict(
            known["solution_"].weights, states if scale is None else scale.state(states)
        )
        actions = actions if scale is None else scale.given(actions)
        return actions[:, 0] if self._flat else actions

    def __call__(self, states: ArrayLike) -> Array:
        """Be a policy: the same as :meth:`predict`, always of shape (N, d)."""
        actions = self.predict(states)
        return actions[:, None] if self._flat else actions

    @others_by_name
    def score(self, X: ArrayLike, y: ArrayLike, *, sample_weight: ArrayLike | None = None) -> float:
        """Share of the observed motion that the policy explains along it; 1 is best, 0 explains none.

        ``1 − Σ w (‖u‖ − ûᵀ π̃)² / Σ w ‖u‖²``, where a sample of less than half the usual length counts by the square of
        its length: the direction of what rests is noise, and no policy's. It is what ``fit`` prints and verdicts judge;
        :func:`~unconstrain.metrics.inconsistency` counts all alike (eq. 4). Parameters as in :meth:`fit`.
        """
        check_is_fitted(self, "solution_")
        batch, missed, moved = self._checked(X, y, sample_weight, reset=False), 0.0, 0.0
        energy = sum(float(one.counts @ (on_host(one.actions) ** 2).sum(axis=1)) for one in batch.blocks())
        usual = np.sqrt(energy / max(batch.counts.sum(), 1e-300))
        for one in batch.blocks():
            found = along_motion(on_host(one.actions), on_host(self._own(one.states)), one.counts, usual)
            missed, moved = missed + found[0], moved + found[1]
        return 1.0 - missed / moved if moved > 0 else 0.0

    def held_out_score(self) -> float:
        """:meth:`score` on each fold by what is learnt from the others; NaN where there is nothing to hold out.

        By samples where the learner looks at them, less of those below ten standard deviations of their noise; of other
        learners from the moments alone, slow samples like all, each local model by itself in its own field.
        Where ``solution_.left_out`` is not zero, others tell too little of what is held out: then it is what to expect
        if the policy has the form of its model, from how well all demonstrations agree.
        """
        check_is_fitted(self, "solution_")
        belief = self.solution_.belief
        return belief.held_out_score if belief is not None else named(self.learner).held_out_score(self.training_)

    def uncertainty(self, X: ArrayLike) -> Uncertainty:
        """How far the unconstrained policy may be from :meth:`predict`, and why.

        Parameters
        ----------
        X : array_like, shape (N, n)
            States.

        Returns
        -------
        Uncertainty
            Standard deviations of each action coordinate, (N, d): from noise, undetermined as any two
            demonstrations are left out, and in total.

        Raises
        ------
        SettingError
            If the learner does not look at samples; :class:`~unconstrain.Robust` does.

        Examples
        --------
        >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
        >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, -states, groups=np.repeat([0, 1, 2], 20))
        >>> policy.uncertainty(states[:5]).total.shape
        (5, 2)
        """
        model, told = self._fitted_model(), self.solution_.believed
        own = told.uncertainty(model, on_host(self._within(X)))
        return own if self.scale_ is None else Uncertainty(*map(self.scale_.given, own))

    def covariances(self, X: ArrayLike) -> Array:
        """Covariance of the predicted actions due to what the data does not say, shape (N, d, d).

        Its diagonal is the square of ``uncertainty(X).undetermined``. Raises as :meth:`uncertainty` does.

        Examples
        --------
        >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
        >>> policy = uc.ParametricPolicy(uc.Affine(), uc.Robust()).fit(states, -states, groups=np.repeat([0, 1, 2], 20))
        >>> policy.covariances(states[:5]).shape
        (5, 2, 2)
        """
        model, told = self._fitted_model(), self.solution_.believed
        own = told.covariances(model, on_host(self._within(X)))
        return own if self.scale_ is None else own * np.multiply.outer(self.scale_.actions, self.scale_.actions)

    def support(self, states: ArrayLike) -> Array:
        """How near to the data each state is, from 1 to 0 far from all of it, shape (N,).

        Raises
        ------
        SettingError
            If neither fields nor features have a place in state space.
        """
        return self._fitted_model().support(self._within(states))

    def _fitted_model(self) -> Model:
        check_is_fitted(self, "solution_")
        return self.training_.model

    @property
    def space_(self) -> spaces.Space:
        """The state space, which tells straight axes from angles and orientations."""
        return self._fitted_model().embedding.space

    @property
    def features_(self) -> FeatureMap:
        """The features in use."""
        return self._fitted_model().features

    @property
    def moments_(self) -> Moments:
        """Moments of all samples so far, over the features as they are summed."""
        check_is_fitted(self, "solution_")
        return self.training_.moments

    # Inside.

    def _own(self, states: Array) -> Array:
        """Predictions, all in the policy's own units."""
        return self.training_.model.predict(self.solution_.weights, states)

    def _within(self, X: ArrayLike) -> Array:
        """States in the policy's own units."""
        states = checked_states(self, X)
        return states if self.scale_ is None else self.scale_.state(states)

    def _consistency(self, batch: Batch, scale: Array) -> float:
        """How consistent demonstrations are with what is learnt of others in some scale."""
        trial = self._draft(*_FITTED)
        trial.scale, trial.learner = tuple(scale), "hybrid"
        return trial._fit(named(trial.learner), *batch).held_out_score()

    def _scaled(self, batch: Batch) -> Scale | None:
        """The scale that was asked for, or that makes a first batch comparable; None where it is one."""
        asked: Any = self.scale
        auto = isinstance(asked, str) and asked == "auto"
        if asked is None or (auto and self._is_curved):
            return None
        if self._is_curved:
            raise SettingError(f"scale: got one for states in {self._space}, expected Euclidean states.")
        if auto:
            some = batch.at(np.unique(np.linspace(0, batch.states.shape[0] - 1, _LOOKED_AT).astype(np.intp)))
            asked = Scale.comparable(*some[:2], partial(self._consistency, some))
        scale = Scale.of(asked, batch.states.shape[1], batch.actions.shape[1])
        return None if scale.is_one else scale

    @property
    def _is_curved(self) -> bool:
        """Whether some states are angles or orientations, whose columns have no scale."""
        return not isinstance(self._space, spaces.Euclidean)

    def _draft(self, *without: str) -> Self:
        """A copy to work on, without some of its attributes."""
        draft = copy(self)
        for name in without:
            draft.__dict__.pop(name, None)
        return draft

    def _become(self, draft: Self) -> Self:
        self.__dict__ = draft.__dict__  # at once: another thread sees the old policy or the new one
        return self

    def _began(
        self, look: FirstLook | None, learner: Learner, *, more: bool, together: bool = True, seen: Iterable[Batch]
    ) -> Self:
        """Choose all that has to be chosen before the first sample is summed, in one place or in several."""
        if look is None:
            raise InvalidDataError("got no sample that counts: there is none, or all weights are zero.")
        places = self.places(look).items()
        split = Split.begin(self.validation if self.validation is not None else Folds(), look, more)
        keep = None if learner.needs_samples else Training.MOST_KEPT if learner.uses_samples and together else 0
        begun = {name: Training.begin(look, one, split, keep, more=more) for name, one in places}
        if len(begun) > 1:
            suited = getattr(learner, "suited", None) or Robust().suited
            taken = {name: one for name, one in begun.items() if learner.takes(one.model)}
            begun = {"": begun[suited(taken or begun, seen, self._usual)]}
        self.training_ = next(iter(begun.values()))
        return self

    def _learnt(self, batches: Iterable[Batch], learner: Learner) -> Self:
        self.training_ = self.training_.with_batches(batches)
        return self._solved(learner)

    def _solved(self, learner: Learner) -> Self:
        own = learner if self.scale_ is None else learner.within(self.scale_)
        self.solution_ = own.solve(self.training_, vars(self).get("solution_"))
        return self

    def _check_speed_power(self, speed_power: float) -> Learner:
        check_at_least("speed_power", speed_power, 0.0)
        learner = named("hybrid" if self.learner is None and speed_power else self.learner)
        if speed_power and (learner.needs_samples or learner.uses_samples):
            raise SettingError(
                "speed_power: learners that look at the samples weigh speed themselves, expected 0; or take "
                "learner=Hybrid()."
            )
        return learner

    def _each_checked(self, batches: Iterable[Sequence[Any]], *, reset: bool = True) -> Iterator[Batch]:
        space = getattr(batches, "space", None)
        return (self._checked(*one, reset=reset and number == 0, space=space) for number, one in enumerate(batches))

    def _checked(self, X: ArrayLike, *rest: Any, reset: bool, space: spaces.Space | None = None) -> Batch:
        batch, flat = Batch.checked(checked_states(self, X, reset=reset, convert=False), *rest)
        columns = batch.actions.shape[1]
        if reset:
            self._flat, self.n_outputs_ = flat, columns
            self._space = _space_of(self.space or space or spaces.Euclidean())
            self.scale_ = self._scaled(batch)
        elif columns != self.n_outputs_:
            raise InvalidDataError(f"actions: got {columns} columns, expected {self.n_outputs_} as before.")
        elif isinstance(self.scale, str) and not self._is_curved:
            Scale.check(self.scale_, *batch[:2])
        if self.scale_ is None:
            return batch
        noise = None if batch.noise is None else self.scale_.action(batch.noise)
        states, actions = self.scale_.state(batch.states), self.scale_.action(batch.actions)
        return batch._replace(states=states, actions=actions, noise=noise)

    def __sklearn_tags__(self) -> Any:
        """Say that actions may have several columns."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags


def _space_of(asked: Any) -> spaces.Space:
    if isinstance(asked, spaces.Space):
        return asked
    raise SettingError(f"space: got {asked!r}, expected one of unconstrain.spaces, such as Euclidean(2) * Circle().")


def _seen(draft: Policy, part: Iterable[Sequence[Any]]) -> Seen:
    mine = copy(draft)
    look = FirstLook.total(FirstLook.at(batch, mine._space) for batch in mine._each_checked(part))
    return Seen(look, {name: value for name, value in vars(mine).items() if name not in vars(draft)})


def _opened(draft: Policy, part: Iterable[Sequence[Any]]) -> list[Batch]:
    return list(Training.opening(copy(draft)._each_checked(part, reset=False)))


def _gathered(draft: Policy, part: Iterable[Sequence[Any]]) -> Training:
    return draft.training_.with_batches(copy(draft)._each_checked(part, reset=False))

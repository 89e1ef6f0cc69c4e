"""Constraints learnt from what moved under them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, Groups, as_groups, as_matrix, on_host
from ..base.display import Shown, counted
from ..base.errors import InvalidDataError, SettingError
from ..base.parameters import Parameters
from ..models import FeatureMap, Placeable
from ..risks import null_space_projection
from ..training import Batch, FirstLook
from .choice import EXACT, Choice, chosen, simplest
from .evidence import FOLDS, Evidence
from .forms import NAMED, Jacobian, Lifted, Surface, Velocities, forms_of
from .mechanisms import Mechanism, winding


class LearntConstraint(Parameters, Shown):
    """``A(x) u = 0``, or a task ``A(x) u = b(x)``, learnt from states and actions under it.

    ``A(x) = Σ φ_i(x) a_iᵀ``, or ``A(x) = Λ(x) J(x)`` where a Jacobian is given, in closed form from sums: they add, so
    that batches, streams, clusters and tensors serve. See :doc:`/constraints`.

    Parameters
    ----------
    features : FeatureMap or str
        φ: any feature map, "constant", "affine", "quadratic", "rbf", or "auto" for the simplest of these that is, where
        held out, as good as any to a standard error.
    jacobian : callable, optional
        States (N, n) to matrices (N, r, d), such as an arm's.
    task : bool
        Whether there is a b(x), of the same features.

    Attributes
    ----------
    rank_ : int
        How many directions are held at once.
    noise_ : float
        Standard deviation of what moves along each held direction, noise and misfit, in units of the action; of a
        surface, of the distance from it.
    choice_ : Choice
        The form that was taken, what all were worth where held out, and what the data does not tell.
    evidence_ : Evidence
        Sums of all samples so far.
    mechanism_ : Mechanism or None
        What positions showed to hold, in place of the form that was taken; rank and noise are then its own.

    Examples
    --------
    >>> states = np.random.default_rng(0).normal(size=(60, 2))
    >>> actions = states * [1.0, 0.0]  # the second coordinate is held
    >>> constraint = uc.LearntConstraint().fit(states, actions)
    >>> constraint.rank_, np.abs(constraint.projection(states[:1])).round(3)
    (1, array([[[1., 0.],
            [0., 0.]]]))
    """

    rank_: int
    noise_: float
    choice_: Choice
    evidence_: Evidence
    mechanism_: Mechanism | None = None

    def __init__(
        self, features: FeatureMap | Placeable | str = "auto", jacobian: Jacobian | None = None, *, task: bool = False
    ) -> None:
        self.features, self.jacobian, self.task = features, jacobian, task

    def fit(
        self,
        states: ArrayLike,
        actions: ArrayLike | None = None,
        groups: Groups | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Learn the constraint. If anything fails, this one is as it was.

        Parameters
        ----------
        states : array_like, shape (N, n)
        actions : array_like, shape (N, d), optional
            Without them the states are taken for points of a surface ``h(x) = 0``, with ``A = ∇h``.
        groups : array_like, shape (N,), optional
            Which demonstration each sample is from: whole ones are held out. Without it, rows that follow each other.
        sample_weight : array_like, shape (N,), optional

        Raises
        ------
        InvalidDataError
            If an array is not finite or of the wrong shape, nothing moves, or no direction is held.
        SettingError
            If the features or the Jacobian are not what they should be.
        """
        table: Any = as_matrix(states, "states", convert=False)
        moves = table - table.mean(axis=0) if actions is None else actions
        self.fit_parts([[(table, moves, sample_weight, groups)]], _here, surface=actions is None)
        steps = np.diff(on_host(table), axis=0) if actions is None else on_host(moves)
        names = np.zeros(len(steps)) if groups is None else as_groups(groups, len(on_host(table)))[: len(steps)]
        _, inverse, counts = np.unique(names, return_inverse=True, return_counts=True)
        each = np.split(np.asarray(steps)[inverse.argsort(kind="stable")], counts.cumsum()[:-1])
        self.choice_ = replace(self.choice_, wound=winding(each))
        return self

    def fit_each(
        self, states: ArrayLike, actions: ArrayLike | None, groups: Groups
    ) -> dict[Hashable, LearntConstraint]:
        """Learn constraints of one kind, one for each demonstration, such as planes of other tilts.

        Of each, rows that follow each other are held out; all have the features that are best for all together.
        Parameters and errors are those of :meth:`fit`; it is one, too, if in one of them no direction is held.

        Returns
        -------
        dict
            A fitted constraint for each.
        """
        table, names, surface = as_matrix(states, "states"), as_groups(groups, len(np.asarray(states))), actions is None
        moves = None if actions is None else as_matrix(actions, "actions")
        places = {name: np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}
        every = [name for name in NAMED if name != "constant" or not surface]
        found = [
            [self._alone(features, table[rows], None if moves is None else moves[rows]) for rows in places.values()]
            for features in (every if self.features == "auto" else [self.features])
        ]
        best = found[simplest(np.array([list(map(_loss, each)) for each in found]), Surface.margin if surface else 0.0)]
        free = [name for name, one in zip(places, best, strict=True) if one is None]
        if free:
            raise InvalidDataError(f"{free[0]!r}: no direction is held in it, expected one; fit the others without it.")
        return {name: one for name, one in zip(places, best, strict=True) if one is not None}

    def differing(
        self, states: ArrayLike, actions: ArrayLike | None, groups: Groups
    ) -> dict[Hashable, LearntConstraint]:
        """As :meth:`fit_each`, if that misses less where held out than one constraint for all, by a standard error.

        Otherwise, or if in one of them no direction is held, there is none. One for all is judged by demonstrations
        that it was not learnt from.
        """
        table, names = as_matrix(states, "states"), as_groups(groups, len(np.asarray(states)))
        moves = table - table.mean(axis=0) if actions is None else as_matrix(actions, "actions")
        order = list(dict.fromkeys(names.tolist()))
        try:
            each = self.fit_each(states, actions, groups) if len(order) > 1 else {}
        except InvalidDataError:
            return {}
        shared = dict.fromkeys(order, 0.0)
        for left in (order[fold::FOLDS] for fold in range(FOLDS) if each):
            rest = ~np.isin(names, left)
            one = self._alone(self.features, table[rest], None if actions is None else moves[rest], names[rest])
            parts = {name: names == name for name in left if one is not None}
            shared |= {name: _loss(one, table[rows], moves[rows]) for name, rows in parts.items()}
        losses = [list(shared.values()), [_loss(each[name]) for name in order if each]]
        return each if each and simplest(np.array(losses)) else {}

    def _alone(
        self, features: Any, states: Array, actions: Array | None, groups: Groups | None = None
    ) -> LearntConstraint | None:
        try:
            return LearntConstraint(features, self.jacobian, task=self.task).fit(states, actions, groups)
        except InvalidDataError:
            return None

    def fit_batches(self, batches: Iterable[Sequence[Any]]) -> Self:
        """Learn from more than fits into memory: ``(states, actions, sample_weight, groups)``, the last two optional.

        What can be walked through twice is; of a generator, the first batch places the features.
        """
        if iter(batches) is not batches:
            return self.fit_parts([batches], _here)
        rest = iter(batches)
        first = next(rest, None)
        if first is None:
            raise InvalidDataError("got no batch to learn from, expected at least one.")
        begun = self._begun(_looked([first]), surface=False)
        return self._learnt(begun.with_batches(_checked(chain([first], rest))))

    def partial_fit(
        self,
        states: ArrayLike,
        actions: ArrayLike,
        groups: Groups | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Learn from a further batch; the first one places features and folds. As :meth:`fit` otherwise."""
        batch = (states, actions, sample_weight, groups)
        if hasattr(self, "choice_") and not hasattr(self, "evidence_"):
            raise SettingError("this constraint was stored, without what it was learnt from: fit it anew.")
        begun = self.evidence_ if hasattr(self, "evidence_") else self._begun(_looked([batch]), surface=False)
        return self._learnt(begun.with_batches(_checked([batch])))

    def projection(self, states: ArrayLike) -> Array:
        """What the constraint leaves free, ``N = I − A⁺A``, shape (N, d, d)."""
        return null_space_projection(self(states))

    def __call__(self, states: ArrayLike, times: Array | None = None) -> Array:
        """Orthonormal rows of A, zero where fewer are held, shape (N, rank, d); it does not depend on the times."""
        samples = self._lifted(states)
        return self.choice_.fields.rows(samples) if self.mechanism_ is None else self.mechanism_(np.asarray(states))

    def held_by(self, mechanism: Mechanism, states: Array, actions: Array) -> Self:
        """A copy that is held by a mechanism of these states (N, n), along which actions (N, n) are noise."""
        other = copy(self)
        other.mechanism_, other.rank_ = mechanism, mechanism.rank
        other.noise_ = float((np.einsum("nkd,nd->nk", mechanism(states), actions) ** 2).mean() ** 0.5)
        return other

    def target(self, states: ArrayLike, times: Array | None = None) -> Array:
        """The b of the task ``A u = b``, for the rows of A as they are returned, shape (N, rank)."""
        if not self.task:
            raise SettingError("target: this constraint was learnt without one, expected LearntConstraint(task=True).")
        samples, fields = self._lifted(states), self.choice_.fields
        return -self.choice_.unit * fields.residuals(samples, fields.rows(samples))

    def _lifted(self, states: ArrayLike) -> Lifted:
        """States with actions that are zero."""
        if not hasattr(self, "choice_"):
            raise SettingError("this constraint has learnt nothing yet: call fit(states, actions) first.")
        table, choice = as_matrix(states, "states"), self.choice_
        if table.shape[1] != choice.columns:
            raise InvalidDataError(f"states: got {table.shape[1]} columns, expected {choice.columns} as fitted.")
        return choice.form.lift(table, np.zeros((len(table), choice.actions)))

    def fit_parts(self, parts: Sequence[Any], summed: Callable[..., Any], *, surface: bool = False) -> Self:
        """Learn from parts wherever they are; see :mod:`unconstrain.cluster`. Of a ``surface`` actions say nothing."""
        if not parts:
            raise InvalidDataError("got no part to learn from, expected at least one.")
        begun = self._begun(summed(_looked, parts), surface=surface)
        return self._learnt(summed(partial(_gathered, begun), parts))

    def _begun(self, look: FirstLook | None, *, surface: bool) -> Evidence:
        if look is None:
            raise InvalidDataError("got no sample that counts: there is none, or all weights are zero.")
        if look.fastest == 0.0:
            raise InvalidDataError("actions: all are zero, and what never moves does not tell what holds it.")
        chart = None if surface else Velocities(self.jacobian, self.task)
        return Evidence.begin(look, forms_of(self.features, chart, look.states, look.actions), scaled=not surface)

    def _learnt(self, evidence: Evidence) -> Self:
        draft = copy(self)
        draft.choice_, draft.evidence_ = chosen(evidence).checked(), evidence
        draft.rank_, draft.noise_, draft.mechanism_ = draft.choice_.fields.rank, draft.choice_.noise, None
        self.__dict__ = draft.__dict__
        return self

    def _summary(self) -> tuple[str, ...]:
        if not hasattr(self, "choice_"):
            return (f"features={self.features!r}",)
        held = f"{counted(self.rank_, 'direction')} of {self.choice_.actions} held"
        form = self.choice_.name or "own features" if self.mechanism_ is None else self.mechanism_.kind
        return form, held, f"noise={self.noise_:.3g}"


def _loss(one: LearntConstraint | None, *others: Array) -> float:
    """Logarithm of what is missed where held out, or of other states and actions."""
    if one is None:
        return 0.0
    missed = one.choice_.missed(*others) if others else one.choice_.held_out
    return float(np.log(max(missed, EXACT)))


def _here(function: Callable[[Any], Any], parts: Sequence[Any]) -> Any:
    return function(*parts)


def _checked(part: Iterable[Sequence[Any]]) -> Iterable[Batch]:
    return (Batch.checked(as_matrix(batch[0], "states", convert=False), *batch[1:])[0] for batch in part)


def _looked(part: Iterable[Sequence[Any]]) -> FirstLook | None:
    return FirstLook.total(map(FirstLook.at, _checked(part)))


def _gathered(begun: Evidence, part: Iterable[Sequence[Any]]) -> Evidence:
    return begun.with_batches(_checked(part))

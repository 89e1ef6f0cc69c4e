"""What a policy is to do where the demonstrations leave room (footnote 6): objectives beside the standard risk."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..base.arrays import Array, as_vector, check_at_least
from ..base.errors import SettingError
from ..risks import Moments, Quadratic, standard_risk
from ..training import Training

Objective: TypeAlias = Callable[[Moments], Quadratic]
"""Such as :func:`~unconstrain.learners.secondary.standard_risk`, or a function of your own."""


class Secondary(ABC):
    """An objective that is more than a function of moments. They add, to each other and to such functions."""

    needs_samples: ClassVar[bool] = True
    """Whether it looks at the states themselves."""

    @abstractmethod
    def on(self, training: Training) -> Objective:
        """The objective as a function of moments of any part of the training data."""

    def __add__(self, other: Secondary | Objective) -> Secondary:
        """Both, each as it weighs."""
        return Sum(self, None if other is standard_risk else other)

    __radd__ = __add__


@dataclass(frozen=True)
class Sum(Secondary):
    """Two objectives together; None is the standard risk."""

    one: Secondary | Objective | None
    other: Secondary | Objective | None

    def on(self, training: Training) -> Objective:
        """Both on the same part."""
        one, other = on(self.one, training), on(self.other, training)
        return lambda moments: one(moments) + other(moments)


@dataclass(frozen=True, eq=False)
class Like(Secondary):
    """``weight · Σ w ‖v(x) − π̃(x)‖²`` for velocities v(x) that are wanted at the states of the demonstrations.

    They map states (N, n) to actions (N, d), in the units in which the learner sees both (a policy's ``scale_``).
    """

    policy: Callable[[Array], Array]
    weight: float = 1.0

    def on(self, training: Training) -> Objective:
        """The risk of all samples, in proportion to the part's."""
        samples, unit = training.samples, training.action_unit
        wanted = np.asarray(self.policy(samples.states))
        if wanted.shape != samples.actions.shape:
            raise SettingError(
                f"secondary: got actions of shape {wanted.shape} where those of the data are {samples.actions.shape}, "
                "expected the same."
            )
        whole, sizes = samples.risk(wanted / unit, np.ones(len(samples))), samples.sizes
        share = self.weight / np.where(sizes > 0.0, sizes, 1.0)
        return lambda moments: (share * moments.weight) * whole


@dataclass(frozen=True)
class Smooth(Secondary):
    """``weight · Σ w (‖Δπ̃‖² / ‖Δx‖²) s²`` over neighbours in time, with the mean squared distance s² of states.

    The slope along what was shown, as if it went on over all of it: no unit and no rate of sampling matters. Constant
    policies have none, so a millionth of ``‖π̃‖²`` is beside it.
    """

    weight: float = 1.0

    def on(self, training: Training) -> Objective:
        """The slope at all samples, in proportion to the part's."""
        samples = training.samples.counted
        places = training.model.embedding(samples.states)
        ways, spread = np.linalg.norm(np.diff(places, axis=0), axis=1), np.sqrt(places.var(axis=0).sum())
        moved = np.flatnonzero((np.diff(samples.groups) == 0) & (ways > 0.0))
        slopes = (spread / ways[moved])[:, None] * (samples.features[moved + 1] - samples.features[moved])
        steps = replace(samples[moved + 1], features=slopes)
        slope = steps.risk(0.0 * steps.actions, np.ones(len(steps)))
        share = self.weight / np.where(samples.sizes > 0.0, samples.sizes, 1.0)
        little = Damped(1e-6 * self.weight)
        return lambda moments: (share * moments.weight) * slope + little(moments)


@dataclass(frozen=True, eq=False)
class Towards:
    """``v(x) = −gain (x − x*)``."""

    goal: Array
    gain: float

    def __call__(self, states: Array) -> Array:
        """Velocities (N, n)."""
        return -self.gain * (states - self.goal)


def like(policy: Callable[[Array], Array], weight: float = 1.0) -> Secondary:
    """Do as another policy does; see :class:`Like`.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> learner = uc.Hybrid(secondary=uc.learners.secondary.like(lambda states: 2.0 * states))
    >>> policy = uc.ParametricPolicy(uc.Affine(), learner).fit(states, -states * [1.0, 0.0])  # y was always held
    >>> policy.predict([[0.5, 0.5]]).round(2) + 0.0
    array([[-0.5,  1. ]])
    """
    check_at_least("weight", weight, 0.0, strict=True)
    return Like(policy, weight)


def towards(goal: ArrayLike, gain: float, weight: float = 1.0) -> Secondary:
    """Move to a goal (n,) with ``−gain (x − x*)``, gain in 1/s, where actions are velocities of the state.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> learner = uc.Hybrid(secondary=uc.learners.secondary.towards([0.0, 0.0], gain=3.0))
    >>> policy = uc.ParametricPolicy(uc.Affine(), learner).fit(states, -states * [1.0, 0.0])  # y was always held
    >>> policy.predict([[0.5, 0.5]]).round(2) + 0.0
    array([[-0.5, -1.5]])
    """
    check_at_least("gain", gain, 0.0)
    return like(Towards(as_vector(goal, "goal"), float(gain)), weight)


def smooth(weight: float = 1.0) -> Secondary:
    """Change as little as can be along the demonstrated movements; see :class:`Smooth`.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> learner = uc.Hybrid(secondary=uc.learners.secondary.smooth())
    >>> policy = uc.ParametricPolicy(uc.Affine(), learner).fit(states, -states * [1.0, 0.0])  # y was always held
    >>> policy.predict([[0.5, 0.5]]).round(2) + 0.0
    array([[-0.5,  0. ]])
    """
    check_at_least("weight", weight, 0.0, strict=True)
    return Smooth(weight)


def damped(gain: float) -> Objective:
    """Rather not move: ``gain · Σ w ‖π̃(x)‖²``.

    Examples
    --------
    >>> states = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    >>> learner = uc.Hybrid(secondary=uc.learners.secondary.damped(1.0))
    >>> policy = uc.ParametricPolicy(uc.Affine(), learner).fit(states, -states * [1.0, 0.0])  # y was always held
    >>> policy.predict([[0.5, 0.5]]).round(2) + 0.0
    array([[-0.5,  0. ]])
    """
    check_at_least("gain", gain, 0.0, strict=True)
    return Damped(gain)


@dataclass(frozen=True)
class Damped:
    """``gain · Σ w ‖π̃(x)‖²``."""

    gain: float

    def __call__(self, moments: Moments) -> Quadratic:
        """Of these moments."""
        risk = standard_risk(moments)
        return self.gain * Quadratic(risk.hessian, 0.0 * risk.linear, 0.0 * risk.constant, risk.gram)


def on(secondary: Secondary | Objective | None, training: Training) -> Objective:
    """An objective of either kind, as a function of moments; the standard risk for None."""
    if isinstance(secondary, Secondary):
        return secondary.on(training)
    return standard_risk if secondary is None else secondary


STORED = (Damped, Like, Smooth, Sum, Towards)
"""What secondary objectives are made of, for the file of a policy."""

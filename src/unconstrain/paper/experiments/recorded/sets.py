"""Every data set of every kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from inspect import getdoc
from typing import Any
from zlib import crc32

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ....base.errors import SettingError
from . import drawn, simulated
from .movements import movements, named

REPORT_SEED = 0
"""Draws what is reported, and takes the other half of the recorded movements; all other seeds are to develop on."""

RECORDED = {
    "recorded, switching": drawn.switching,
    "recorded, one each": drawn.one_each,
    "recorded, half free": drawn.half_free,
    "recorded, varying": drawn.varying,
    "recorded, rows shuffled": drawn.one_each,
    "recorded, shuffled inside": drawn.one_each,
}
"""Kinds of constraints on recorded movements. In the last two, rows are in any order: without groups, or in them."""


@dataclass(frozen=True, eq=False)
class DataSet:
    """Demonstrations to learn from, and what to test on.

    Parameters
    ----------
    kind : str
        One of :data:`KINDS`.
    name : str
        Which of that kind.
    demonstrations : list of Demonstration
        To learn from, each with its truth.
    test : list of Demonstration
        With the true policy at the states that count; where movements were recorded, the velocities before they were
        projected, at the same states.
    policy : Policy
        To be fitted, as a copy.
    grouped : bool
        Whether the learner is told which demonstration each sample is from, and when it was.
    unspoiled : list of Demonstration, optional
        The same before something was done to it, where what that costs is the question.
    """

    kind: str
    name: str
    demonstrations: list[uc.Demonstration]
    test: list[uc.Demonstration]
    policy: uc.Policy = field(default_factory=uc.LocallyLinearPolicy)
    grouped: bool = True
    unspoiled: list[uc.Demonstration] | None = None

    @property
    def recorded(self) -> bool:
        """Whether the movements are of people, and the truth is what they did freely."""
        return self.kind in RECORDED

    def fit(self, learner: uc.Learner, demonstrations: Sequence[uc.Demonstration] | None = None) -> uc.Policy:
        """Learn from these demonstrations, or from others in their place, told as much as this kind tells."""
        from sklearn.base import clone

        demos = self.demonstrations if demonstrations is None else list(demonstrations)
        policy: uc.Policy = clone(self.policy).set_params(learner=learner)
        if self.grouped:
            return policy.fit_demonstrations(demos)
        states, actions, _ = uc.stack(demos)
        return policy.fit(states, actions)


def cubic(states: Array) -> Array:
    """All monomials of up to the third degree of two coordinates, shape (N, 10)."""
    x, y = states.T
    return np.column_stack([x**i * y**j for i in range(4) for j in range(4 - i)])


def _cubic_policy() -> uc.Policy:
    return uc.ParametricPolicy(cubic)


def _auto_policy() -> uc.Policy:
    return uc.ParametricPolicy("auto")


def _affine_policy() -> uc.Policy:
    return uc.ParametricPolicy(uc.Affine())


def _wide_policy() -> uc.Policy:
    """Ten by ten normalised kernels, so wide that they are nearly dependent: σ² = 0.5 on [−1.1, 1.1]²."""
    return uc.ParametricPolicy(uc.NormalisedRBF.grid(-1.1, 1.1, 10, width=np.sqrt(0.5) / (2.2 / 9)))


@dataclass(frozen=True)
class _Kind:
    """How a simulated kind is drawn, from ``variants`` in turn."""

    draw: Callable[..., simulated.Simulated]
    variants: Mapping[str, tuple[Any, ...]] = field(default_factory=lambda: {"": ()})
    policy: Callable[[], uc.Policy] = uc.LocallyLinearPolicy
    grouped: bool = True


_DECIBELS = {f"{level} dB": (level,) for level in (50, 40, 30, 20, 10)}
_WRONG = {
    f"{size} s.d., {'free' if free else 'planes'}": (size, free) for size in (3, 10, 30) for free in (True, False)
}
SIMULATED = {
    "curved hood": _Kind(simulated.curved_hood),
    "CaPL, cubic": _Kind(simulated.capl, _DECIBELS, _cubic_policy),
    "CaPL, auto": _Kind(simulated.capl, _DECIBELS, _auto_policy),
    "CaPL, local": _Kind(simulated.capl, _DECIBELS),
    "wide kernels": _Kind(simulated.wide_kernels, policy=_wide_policy, grouped=False),
    "rows without order": _Kind(simulated.without_order, grouped=False),
    "coming to rest": _Kind(simulated.to_rest),
    "one bad sample": _Kind(simulated.one_bad_sample, _WRONG),
    "1 % bad samples": _Kind(simulated.bad_samples, _WRONG),
    "unequal speeds": _Kind(simulated.unequal_speeds),
    "correlated noise": _Kind(simulated.correlated_noise),
    "Student noise": _Kind(simulated.student_noise),
    "partly at rest": _Kind(simulated.partly_at_rest, {f"{share:.0%}": (share,) for share in (0.02, 0.1, 0.3)}),
    "along rulers": _Kind(simulated.along_rulers, {"cubic": ("cubic",), "round": ("round",)}),
    "one-sided contact": _Kind(simulated.one_sided),
    "one plane for all": _Kind(simulated.one_plane, policy=_affine_policy),
    "near-parallel planes": _Kind(simulated.parallel_planes),
    "tilted plates": _Kind(simulated.tilted_plates),
    "measured positions": _Kind(simulated.measured_positions, {form: (form,) for form in ("rulers", "plates", "goal")}),
    "reaching": _Kind(simulated.reaching, {f"{share:.0%}": (share,) for share in (0.05, 0.1, 0.2)}),
    "turning planes": _Kind(simulated.turning_planes),
    "two demonstrations": _Kind(simulated.two_demonstrations),
    "fourteen joints": _Kind(simulated.many_joints, policy=_affine_policy),
}

KINDS = (*RECORDED, *SIMULATED)

_ALSO = {
    "recorded, rows shuffled": "All rows are in any order, and nobody says whose they are.",
    "recorded, shuffled inside": "The rows of each demonstration are in any order.",
    "CaPL, cubic": "Learnt on cubic features, in which the policy is exact.",
    "CaPL, auto": "Learnt on features that the learner chooses.",
    "CaPL, local": "Learnt with local models.",
}


def described(kind: str) -> str:
    """What a kind is, in words: those of the function that draws it."""
    drawn_by = RECORDED[kind] if kind in RECORDED else SIMULATED[kind].draw
    return " ".join([*(getdoc(drawn_by) or "").split(), _ALSO.get(kind, "")]).strip()


def data_sets(seed: int = 1, only: Sequence[str] = (), at_most: int = 20) -> Iterator[DataSet]:
    """Every data set of every kind, one after the other.

    Parameters
    ----------
    seed : int
        Draws them. 0 is the half that is reported: every second class of recorded movements, and draws that no other
        seed repeats. All other seeds share the other half of the recorded movements, and are to develop on.
    only : sequence of str
        Kinds to which to keep; all if empty.
    at_most : int
        Data sets of each kind. There are 27 or 26 classes of recorded movements in each half.
    """
    for kind, name in listed(seed, only, at_most):
        yield draw(kind, name, seed)


def listed(seed: int, only: Sequence[str] = (), at_most: int = 20) -> list[tuple[str, str]]:
    """Kind and name of each data set, without drawing it.

    Raises
    ------
    SettingError
        If there is no such kind.
    """
    for kind in only:
        if kind not in KINDS:
            raise SettingError(f"only: got {kind!r}, expected one of {', '.join(KINDS)}.")
    kinds = only or KINDS
    recorded = any(kind in RECORDED for kind in kinds)
    classes = [movement.title for movement in movements(seed == REPORT_SEED)] if recorded else []
    found: list[tuple[str, str]] = []
    for kind in kinds:
        names = classes if kind in RECORDED else _numbered(SIMULATED[kind], at_most)
        found += [(kind, name) for name in names[:at_most]]
    return found


def _numbered(kind: _Kind, count: int) -> list[str]:
    variants = list(kind.variants)
    return [f"{variants[index % len(variants)]} #{index // len(variants) + 1}".strip() for index in range(count)]


def draw(kind: str, name: str, seed: int) -> DataSet:
    """Draw one data set: always the same for the same arguments."""
    rng = np.random.default_rng([crc32(f"{kind} {name}".encode()), seed])
    return _recorded(kind, name, rng) if kind in RECORDED else _simulated(kind, name, rng)


def _recorded(kind: str, name: str, rng: np.random.Generator) -> DataSet:
    movement, following = named(name)
    free = movement.load(rng)
    if kind == "recorded, varying" and movement.dimensions == 2:
        free = drawn.deepened(free, following.load(rng))
    demos = drawn.project_all(free, RECORDED[kind](rng, free))
    if kind == "recorded, rows shuffled":
        return DataSet(kind, name, [simulated.heap(demos, rng)], demos, grouped=False)
    if kind == "recorded, shuffled inside":
        return DataSet(kind, name, [simulated.shuffled(demo, rng) for demo in demos], demos, unspoiled=demos)
    return DataSet(kind, name, demos, demos)


def _simulated(kind: str, name: str, rng: np.random.Generator) -> DataSet:
    of = SIMULATED[kind]
    variant = name.rpartition("#")[0].strip()
    made = of.draw(rng, *of.variants[variant])
    return DataSet(
        kind, name, made.demonstrations, made.test or made.demonstrations, of.policy(), of.grouped, made.unspoiled
    )

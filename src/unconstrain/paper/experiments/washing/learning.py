"""One policy by each method from some surfaces, and its errors on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import unconstrain as uc

from ....base.arrays import Array
from ....base.errors import InvalidDataError
from ..trials import candidate_of
from .surfaces import Surface, simulated_split

if TYPE_CHECKING:
    from . import Settings

BEST = "best candidate"
"""Of those that the default learner chose from, the best on the tilt held out: what no choice can do better than."""


@dataclass(frozen=True, eq=False)
class Split:
    """One way to part the surfaces, and what was learnt.

    Parameters
    ----------
    training, held_out : tuple of Surface
    policies : dict
        Method to fitted policy.
    rollouts : dict
        Method to a movement on the first surface held out.
    """

    training: tuple[Surface, ...]
    held_out: tuple[Surface, ...]
    policies: dict[str, uc.Policy]
    rollouts: dict[str, uc.Demonstration]

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """All of them."""
        return (*self.training, *self.held_out)


def learners(settings: Settings) -> dict[str, uc.Learner]:
    """The three methods."""
    return {
        "direct": uc.Direct(),
        "inconsistency": uc.Inconsistency(),
        "hybrid": uc.Hybrid(threshold=settings.threshold, softness=settings.softness),
    }


def simulate_and_learn(settings: Settings, seed: np.random.SeedSequence) -> Split:
    """Let a hand wipe all plates, and learn from those that are for learning."""
    return learn(settings, *simulated_split(settings, seed))


def learn(settings: Settings, training: Sequence[Surface], held_out: Sequence[Surface]) -> Split:
    """Learn by each method, and follow what was learnt on the first surface held out."""
    policies = fitted(settings, training)
    first, normal = held_out[0].demonstrations[0], held_out[0].normals[0]["plane"]
    rollouts = {
        name: _followed(policies[name], first.states[0], uc.constraints.Plane(normal), settings, name)
        for name in policies
    }
    return Split(tuple(training), tuple(held_out), policies, rollouts)


def fitted(settings: Settings, training: Sequence[Surface]) -> dict[str, uc.Policy]:
    """Method to policy, all from the same samples; "robust" is what is learnt with nothing set for this job."""
    base = uc.LocallyLinearPolicy(settings.variance, settings.at_least, learner=uc.Robust(), validation=uc.Folds())
    base.fit_demonstrations([demo for surface in training for demo in surface.demonstrations])
    return {name: base.with_learner(learner) for name, learner in learners(settings).items()} | {"robust": base}


def simulated_rows(splits: Sequence[Split]) -> list[dict[str, Any]]:
    """Mean errors over the trials of each method on each surface, and their standard deviation."""
    rows = []
    for method in splits[0].policies:
        for at, surface in enumerate(splits[0].surfaces):
            row: dict[str, Any] = {"method": method, "surface": surface.name, "seen": surface in splits[0].training}
            for name, metric in (("ncpe", uc.ncpe), ("nupe", uc.nupe)):
                values = [metric(split.policies[method], split.surfaces[at].demonstrations) for split in splits]
                row[name] = float(np.mean(values))
                row[f"{name}_sd"] = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
            rows.append(row)
    return rows


def recorded_rows(splits: Sequence[Split]) -> list[dict[str, Any]]:
    """Error of each method on each tilt held out, with each kind of normal, and the least of any candidate there."""
    rows = []
    for split in splits:
        robust = split.policies["robust"]
        every = [candidate_of(robust, name) for name in robust.solution_.candidates]
        for surface in split.held_out:
            for kind in surface.normals[0]:
                found = {name: _ncpe_of_bouts(policy, surface, kind) for name, policy in split.policies.items()}
                found[BEST] = min(_ncpe_of_bouts(one, surface, kind) for one in every)
                where = {"surface": surface.name, "seen": False, "normal": kind}
                rows += [{"method": method, **where, "ncpe": error, "nupe": None} for method, error in found.items()]
    return rows


def _followed(
    policy: uc.Policy, start: Array, plane: uc.constraints.Plane, settings: Settings, name: str
) -> uc.Demonstration:
    """Follow a policy in steps much shorter than the camera's: a circle in long straight steps runs outwards."""
    fine, steps = settings.substeps, settings.steps
    while True:
        try:
            dt = 1 / (fine * settings.rate)
            path = uc.rollout(policy, start, fine * steps, dt, plane, name=name, method="euler", least_support=0.0)
        except InvalidDataError:  # it runs away; show how it begins to
            steps = max(1, steps // 2)
        else:
            return path[::fine]


def _ncpe_of_bouts(policy: uc.Policy, surface: Surface, kind: str) -> float:
    """NCPE of a surface whose bouts have each a normal of their own: all errors over all motion."""
    pairs = list(zip(surface.demonstrations, surface.normals, strict=True))
    missed = sum(uc.cpe(policy, demo, uc.constraints.Plane(normals[kind])) for demo, normals in pairs)
    return missed / sum(float(((demo.actions - demo.actions.mean(axis=0)) ** 2).sum()) for demo, _ in pairs)

"""The car-washing experiment (section IV-C): learn to wipe on some surfaces, be tested on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from ..constraints import Plane
from ..datasets import load_rim_wiping
from ..demonstration import Demonstration
from ..errors import InvalidDataError
from ..learners import Direct, Hybrid, Inconsistency, Learner
from ..metrics import cpe, ncpe, nupe
from ..policies import LocallyLinearPolicy, Policy
from ..rollouts import rollout
from ..systems.wiping import HELD_OUT, PLATES, demonstrate
from ..validation import Folds
from .trials import Progress, Result, run_trials

__all__ = ["Settings", "Split", "Surface", "headlines", "run"]


@dataclass(frozen=True)
class Settings:
    """Settings of the washing experiment.

    Parameters
    ----------
    real : bool
        Learn from recorded bouts, leaving one tilt out at a time, instead of
        from simulated demonstrations.
    download : bool
        Fetch the recordings if they are not there.
    seed : int
        Of the simulated demonstrator and camera.
    rate : float
        Samples per second.
    duration : float
        Of each simulated demonstration, s.
    noise : float
        Of the simulated camera, m.
    variance : float
        σ² of the receptive fields, m². The paper has 0.025 in units that it does not state.
    at_least : float
        Weight that every sample has in one of them.
    softness, threshold : float
        See :class:`~unconstrain.Hybrid`.
    steps, substeps : int
        Length of the reproduced movement in samples at ``rate``, and steps of the integration between two of them.
    """

    real: bool = False
    download: bool = False
    seed: int = 0
    rate: float = 20.0
    duration: float = 20.0
    noise: float = 0.002
    variance: float = 0.0125
    at_least: float = 0.7
    softness: float = 0.1
    threshold: float = 0.0
    steps: int = 300
    substeps: int = 5


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface that was wiped.

    Parameters
    ----------
    name : str
    demonstrations : tuple of Demonstration
    normals : tuple of dict
        For each demonstration, unit normals by where they come from: "plane", and "tool" where it is known.
    """

    name: str
    demonstrations: tuple[Demonstration, ...]
    normals: tuple[dict[str, Array], ...]


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
    policies: dict[str, Policy]
    rollouts: dict[str, Demonstration]


def run(settings: Settings | None = None, workers: int = 1, progress: Progress | None = None) -> Result:
    """Run the washing experiment.

    Parameters
    ----------
    settings : Settings, optional
    workers : int
        Processes; the numbers do not depend on it.
    progress : callable, optional
        Called with (done, of) after each split.

    Returns
    -------
    Result
        One row for each method and surface (and each kind of normal, on real
        recordings); ``details["splits"]`` is a list of :class:`Split`.
    """
    chosen = settings or Settings()
    splits = _real_splits(chosen) if chosen.real else _simulated_splits(chosen)
    learnt = run_trials(_learn, [(chosen, *split) for split in splits], workers, progress)
    rows = [row for split in learnt for row in (_real_rows(split) if chosen.real else _simulated_rows(split))]
    return Result("washing", chosen, rows, {"splits": learnt})


def headlines(result: Result) -> list[str]:
    """How the methods do on surfaces that they have not seen, in a sentence for each error."""
    unseen = [row for row in result.rows if not row["seen"]]
    said = []
    for error, label in (("ncpe", "nCPE"), ("nupe", "nUPE")):
        for kind in dict.fromkeys(row.get("normal") for row in unseen):
            of_kind = [row for row in unseen if row.get("normal") == kind and row[error] is not None]
            methods = dict.fromkeys(row["method"] for row in of_kind)
            means = {m: float(np.mean([row[error] for row in of_kind if row["method"] == m])) for m in methods}
            if means:
                of = "" if kind is None else f" with the {kind} normals"
                values = ", ".join(f"{method} {mean:.4f}" for method, mean in means.items())
                ratio = means["hybrid"] / means["direct"]
                said.append(f"{label} on unseen surfaces{of}, mean: {values}; hybrid is {ratio:.2f} times direct")
    return said


def learners(settings: Settings) -> dict[str, Learner]:
    """The three methods."""
    return {
        "direct": Direct(),
        "inconsistency": Inconsistency(),
        "hybrid": Hybrid(threshold=settings.threshold, softness=settings.softness),
    }


def _simulated_splits(settings: Settings) -> list[tuple[list[Surface], list[Surface]]]:
    seeds = np.random.SeedSequence(settings.seed).spawn(len(PLATES))
    surfaces = []
    for plate, seed in zip(PLATES, seeds, strict=True):
        rng = np.random.default_rng(seed)
        demo = demonstrate(plate, rng, duration=settings.duration, rate=settings.rate, noise=settings.noise)
        surfaces.append(Surface(plate.name, (demo,), ({"plane": plate.rotation[:, 2]},)))
    unseen = {plate.name for plate in HELD_OUT}
    return [([s for s in surfaces if s.name not in unseen], [s for s in surfaces if s.name in unseen])]


def _real_splits(settings: Settings) -> list[tuple[list[Surface], list[Surface]]]:
    bouts = load_rim_wiping(download=settings.download, rate=settings.rate, centre=True)
    surfaces = []
    for group in dict.fromkeys(bout.tilt for bout in bouts):
        of_group = [bout for bout in bouts if bout.tilt == group]
        normals = tuple({"plane": bout.plane_normal, "tool": bout.tool_normal} for bout in of_group)
        surfaces.append(Surface(group, tuple(bout.demonstration for bout in of_group), normals))
    return [([s for s in surfaces if s is not out], [out]) for out in surfaces]


def _learn(settings: Settings, training: Sequence[Surface], held_out: Sequence[Surface]) -> Split:
    base = LocallyLinearPolicy(settings.variance, settings.at_least, learner=Direct(), validation=Folds())
    base.fit_demonstrations([demo for surface in training for demo in surface.demonstrations])
    policies = {name: base.with_learner(learner) for name, learner in learners(settings).items()}
    first, normal = held_out[0].demonstrations[0], held_out[0].normals[0]["plane"]
    rollouts = {
        name: _reproduce(policy, first.states[0], Plane(normal), settings, name) for name, policy in policies.items()
    }
    return Split(tuple(training), tuple(held_out), policies, rollouts)


def _reproduce(policy: Policy, start: Array, plane: Plane, settings: Settings, name: str) -> Demonstration:
    """Follow a policy in steps much shorter than the camera's: a circle in long straight steps runs outwards."""
    fine, steps = settings.substeps, settings.steps
    while True:
        try:
            path = rollout(policy, start, fine * steps, 1 / (fine * settings.rate), plane, name=name)
        except InvalidDataError:  # it runs away; show how it begins to
            steps = max(1, steps // 2)
        else:
            return path[::fine]


def _simulated_rows(split: Split) -> list[dict[str, Any]]:
    return [
        {
            "method": method,
            "surface": surface.name,
            "seen": surface in split.training,
            "ncpe": ncpe(policy, surface.demonstrations),
            "nupe": nupe(policy, surface.demonstrations),
        }
        for method, policy in split.policies.items()
        for surface in (*split.training, *split.held_out)
    ]


def _real_rows(split: Split) -> list[dict[str, Any]]:
    return [
        {
            "method": method,
            "surface": surface.name,
            "seen": False,
            "normal": kind,
            "ncpe": _ncpe_of_bouts(policy, surface, kind),
            "nupe": None,
        }
        for method, policy in split.policies.items()
        for surface in split.held_out
        for kind in surface.normals[0]
    ]


def _ncpe_of_bouts(policy: Policy, surface: Surface, kind: str) -> float:
    """NCPE of a surface whose bouts have each a normal of their own: all errors over all motion."""
    pairs = list(zip(surface.demonstrations, surface.normals, strict=True))
    missed = sum(cpe(policy, demo, Plane(normals[kind])) for demo, normals in pairs)
    return missed / sum(float(((demo.actions - demo.actions.mean(axis=0)) ** 2).sum()) for demo, _ in pairs)

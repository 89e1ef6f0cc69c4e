"""Modules under the names that they had up to release 0.1, for code that was written for it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

_NOW = {
    "arrays": "base.arrays",
    "batches": "training.batches",
    "closed_form": "models.formula",
    "cluster": "training.cluster",
    "containment": "motion.containment",
    "datasets": "paper.datasets",
    "demonstration": "recordings.demonstration",
    "diagnosis": "evaluation.diagnosis",
    "errors": "base.errors",
    "experiments": "paper.experiments",
    "features": "models.features",
    "figures": "pages.figures",
    "metrics": "evaluation.metrics",
    "moments": "risks.moments",
    "objectives": "risks.objectives",
    "preparation": "recordings.preparation",
    "projection": "risks.projection",
    "quadratic": "risks.quadratic",
    "readers": "recordings.readers",
    "receptive_fields": "models.receptive_fields",
    "report": "paper.pages",
    "report.diagnosis": "pages.diagnosis",
    "report.fit": "pages.fit",
    "report.html": "pages.html",
    "robust": "learners.robust",
    "robust.samples": "training.samples",
    "robust.uncertainty": "learners.solution",
    "rollouts": "motion.rollouts",
    "simulation": "paper.simulation",
    "streams": "recordings.streams",
    "systems": "paper.systems",
    "threads": "base.threads",
    "validation": "training",
}


class _Former(MetaPathFinder, Loader):
    """Finds a module by its former name: the same object, under one more name."""

    def __init__(self, package: str) -> None:
        self._package = package

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, former = fullname.partition(".")
        now = _now(former) if package == self._package else None
        return ModuleSpec(fullname, self, loader_state=f"{package}.{now}") if now else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = import_module(spec.loader_state)
        self._own = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._own  # the import system has just put the former name there


def _now(former: str) -> str | None:
    """Where a module is now; what nothing is said of is in its package still."""
    if former in _NOW:
        return _NOW[former]
    package, _, name = former.rpartition(".")
    moved = _now(package) if package else None
    return moved and f"{moved}.{name}"


def install(package: str) -> None:
    """Let the package's modules be imported under their former names as well."""
    sys.meta_path.insert(0, _Former(package))  # before whoever would find the file once more under this name

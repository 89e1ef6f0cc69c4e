"""Modules under the names that they had up to release 0.1, for code that was written for it."""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

_MOVED = {
    "base": "arrays errors threads",
    "evaluation": "diagnosis metrics",
    "learners": "robust",
    "models": "features receptive_fields",
    "motion": "rollouts",
    "pages": "figures",
    "paper": "datasets experiments simulation systems",
    "recordings": "demonstration preparation readers streams",
    "risks": "moments objectives projection quadratic",
    "training": "cluster",
}
_NOW = {name: f"{room}.{name}" for room, names in _MOVED.items() for name in names.split()}
_NOW |= {f"report.{name}": f"pages.{name}" for name in ("diagnosis", "fit", "html")}
_NOW |= {
    "batches": "training",
    "closed_form": "models.formula",
    "figures.arms": "paper.figures.arms",
    "report": "paper.pages",
    "validation": "training",
}
_NOW |= {"robust.samples": "training.samples", "robust.uncertainty": "learners.solution"}


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

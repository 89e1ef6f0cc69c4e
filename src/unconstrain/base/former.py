"""Modules under the names that they had up to release 0.1, for code that was written for it."""

from __future__ import annotations

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
    "motion": "containment rollouts",
    "pages": "figures",
    "paper": "datasets experiments simulation systems",
    "recordings": "demonstration preparation readers streams",
    "risks": "moments objectives projection quadratic",
    "training": "cluster",
}
_NOW = {name: f"{room}.{name}" for room, names in _MOVED.items() for name in names.split()}
_NOW |= {"batches": "training", "closed_form": "models.formula", "report": "paper.pages", "validation": "training"}


class _Former(MetaPathFinder, Loader):
    """Finds a module by its former name: the same object, under one more name."""

    def __init__(self, package: str) -> None:
        self._package = package

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, rest = fullname.partition(".")
        room, _, inside = rest.partition(".")
        if package != self._package or room not in _NOW:
            return None
        now = f"{package}.{_NOW[room]}" + (f".{inside}" if inside else "")
        return ModuleSpec(fullname, self, loader_state=now)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = import_module(spec.loader_state)
        self._own = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._own  # the import system has just put the former name there


def install(package: str) -> None:
    """Let the package's modules be imported under their former names as well."""
    sys.meta_path.insert(0, _Former(package))  # before whoever would find the file once more under this name

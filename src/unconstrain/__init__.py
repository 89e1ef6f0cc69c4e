"""Learn the unconstrained policy behind movements recorded under unknown, changing constraints.

>>> import unconstrain as uc
>>> policy = uc.LocallyLinearPolicy().fit(states, actions, groups=groups)  # doctest: +SKIP
>>> policy.predict(states)  # doctest: +SKIP

Importing this package imports nothing heavy; names are resolved on first use.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "Affine": "features",
    "ClosedForm": "closed_form",
    "Demonstration": "demonstration",
    "Direct": "learners",
    "Folds": "validation",
    "HeldOut": "validation",
    "Hybrid": "learners",
    "Inconsistency": "learners",
    "KMeansRBF": "features",
    "Likelihood": "robust",
    "LocallyLinearPolicy": "policies",
    "Moments": "moments",
    "NoiseCorrected": "robust",
    "NormalisedRBF": "features",
    "ParametricPolicy": "policies",
    "Quadratic": "quadratic",
    "ReceptiveFields": "receptive_fields",
    "Recording": "demonstration",
    "Robust": "robust",
    "Segments": "robust",
    "Solution": "learners",
    "Stream": "streams",
    "Truth": "demonstration",
    "UnconstrainError": "errors",
    "action_projection": "projection",
    "cover": "receptive_fields",
    "cpe": "metrics",
    "gather": "moments",
    "inconsistency": "metrics",
    "load": "storage",
    "ncpe": "metrics",
    "ninconsistency": "metrics",
    "null_space_projection": "projection",
    "nupe": "metrics",
    "prepare": "preparation",
    "project": "projection",
    "read": "readers",
    "rollout": "rollouts",
    "save": "storage",
    "stack": "demonstration",
    "upe": "metrics",
}
_ROOMS = ("cluster", "constraints", "datasets", "errors", "experiments", "preparation", "readers", "systems")

__all__ = sorted([*_HOME, *_ROOMS])


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version(__name__)
    if name in _HOME:
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
        globals()[name] = value
        return value
    if name in _ROOMS:
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}.")


def __dir__() -> list[str]:
    return list(__all__)

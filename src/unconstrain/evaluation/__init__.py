"""How good a policy is, and what the data leaves unknown."""

from . import diagnosis
from .diagnosis import Diagnosis, diagnose
from .metrics import cpe, inconsistency, ncpe, ninconsistency, nnpe, npoe, nppe, nupe, upe

__all__ = [
    "Diagnosis",
    "cpe",
    "diagnose",
    "diagnosis",
    "inconsistency",
    "metrics",
    "ncpe",
    "ninconsistency",
    "nnpe",
    "npoe",
    "nppe",
    "nupe",
    "upe",
]

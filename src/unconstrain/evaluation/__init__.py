"""How good a policy is, and what the data leaves unknown."""

from .diagnosis import CONSTRAINED, FREE, SMALL, Diagnosis, diagnose, named, sentences
from .metrics import cpe, inconsistency, ncpe, ninconsistency, nupe, upe

__all__ = [
    "CONSTRAINED",
    "FREE",
    "SMALL",
    "Diagnosis",
    "cpe",
    "diagnose",
    "inconsistency",
    "metrics",
    "named",
    "ncpe",
    "ninconsistency",
    "nupe",
    "sentences",
    "upe",
]

"""Mechanisms with names: found in recorded positions, compared by evidence."""

from .identify import LIKELY as LIKELY
from .identify import identify as identify
from .kept import kept as kept
from .kinds import FLAT_KINDS, KINDS
from .mechanism import Mechanism as Mechanism
from .tied import TIED_KINDS
from .track import winding as winding

STORED = {f"mechanisms.{kind.__name__}": kind for kind in (*KINDS, *FLAT_KINDS, *TIED_KINDS)}
"""Every kind, by a name for its file that no other class has."""

"""Mechanisms with names: found in recorded positions, compared by evidence."""

from .identify import LIKELY as LIKELY
from .identify import identify as identify
from .kept import kept as kept
from .kinds import restored as restored
from .track import winding as winding

"""Mechanisms with names: found in recorded positions, compared by evidence."""

from .identify import identify as identify
from .kinds import restored as restored
from .track import winding as winding

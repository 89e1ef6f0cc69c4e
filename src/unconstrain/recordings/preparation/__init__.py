"""From recordings to demonstrations: which columns are what, derivatives, gaps, trimming."""

from __future__ import annotations

from .movements import Gap, PreparationWarning, differentiate, find_gaps, prepare, resample, trim
from .recipes import Recipe, complete_recipe, guess_recipe
from .surveys import Survey, survey

__all__ = [
    "Gap",
    "PreparationWarning",
    "Recipe",
    "Survey",
    "complete_recipe",
    "differentiate",
    "find_gaps",
    "guess_recipe",
    "prepare",
    "resample",
    "survey",
    "trim",
]

"""From recordings to demonstrations: which columns are what, derivatives, gaps, trimming."""

from .movements import PreparationWarning, differentiate, prepare, resample, trim
from .recipes import Recipe, complete_recipe
from .surveys import survey

__all__ = ["PreparationWarning", "Recipe", "complete_recipe", "differentiate", "prepare", "resample", "survey", "trim"]

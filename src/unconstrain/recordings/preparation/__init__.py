"""From recordings to demonstrations: which columns are what, what is not as it seems, derivatives, trimming."""

from .alignment import align
from .movements import PreparationWarning, differentiate, prepare, resample, trim, window_used
from .plausibility.sets import doubts
from .recipes import Recipe, complete_recipe
from .surveys import survey, survey_set

__all__ = [
    "PreparationWarning",
    "Recipe",
    "align",
    "complete_recipe",
    "differentiate",
    "doubts",
    "prepare",
    "resample",
    "survey",
    "survey_set",
    "trim",
    "window_used",
]

"""From recordings to demonstrations: which columns are what, what is not as it seems, derivatives, trimming.

Examples
--------
>>> recording = uc.Recording(("x", "y", "vx", "vy"), np.zeros((3, 4)))
>>> recipe, _ = uc.preparation.decide(uc.Recipe(), recording)
>>> recipe.states, recipe.actions
(('x', 'y'), ('vx', 'vy'))
"""

from .alignment import align
from .decisions import decide
from .movements import PreparationWarning, differentiate, prepare, resample, trim, window_used
from .plausibility.given import doubts_about
from .plausibility.sets import doubts
from .recipes import Recipe
from .surveys import pieces as pieces
from .surveys import survey, survey_set

__all__ = [
    "PreparationWarning",
    "Recipe",
    "align",
    "decide",
    "differentiate",
    "doubts",
    "doubts_about",
    "prepare",
    "resample",
    "survey",
    "survey_set",
    "trim",
    "window_used",
]

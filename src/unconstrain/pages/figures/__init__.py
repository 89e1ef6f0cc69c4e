"""Pictures of demonstrations, policies and errors.

They know arrays and callables, not estimators or experiments. All are of matplotlib, made in one style; it comes
with the extra ``viz`` and is imported when first used.
"""

from .curves import bars, over_time, spectra, step_scores
from .planes import known_map, paths, vector_field
from .spaces import movements
from .style import COLOURS, LABELS, METHODS, PALETTE

__all__ = [
    "COLOURS",
    "LABELS",
    "METHODS",
    "PALETTE",
    "bars",
    "known_map",
    "movements",
    "over_time",
    "paths",
    "spectra",
    "step_scores",
    "vector_field",
]

"""Pictures of demonstrations, policies and errors.

They know arrays, demonstrations and callables, not estimators or experiments.
Interactive ones are plotly figures; :func:`overview` draws with matplotlib.
Both come with the extra ``viz`` and are imported when first used.
"""

from .arms import arm_on_plate
from .curves import RATIO_COLOURS, bands, bars, dots, over_time, ratio_table, ratios, spectra, step_scores
from .overview import overview
from .planes import Quad, broken, known_map, paths, vector_field
from .spaces import movements
from .style import COLOURS, LABELS, METHODS, PALETTE

__all__ = [
    "COLOURS",
    "LABELS",
    "METHODS",
    "PALETTE",
    "RATIO_COLOURS",
    "Quad",
    "arm_on_plate",
    "bands",
    "bars",
    "broken",
    "dots",
    "known_map",
    "movements",
    "over_time",
    "overview",
    "paths",
    "ratio_table",
    "ratios",
    "spectra",
    "step_scores",
    "vector_field",
]

"""The mathematics: projections, moments (sufficient statistics), quadratics and their minima."""

from .autocorrelation import autocorrelations
from .folded_moments import FoldedMoments
from .moments import Moments, Sums, gather
from .objectives import inconsistency, standard_risk, unvec, vec
from .projection import TURNED, action_projection, along_motion, null_space_projection, project, unit_actions
from .quadratic import (
    NOISE,
    SECONDARY_NOISE,
    Path,
    Quadratic,
    eigensystem,
    lexicographic_path,
    minimum,
    softened_minima,
)

__all__ = [
    "NOISE",
    "SECONDARY_NOISE",
    "TURNED",
    "FoldedMoments",
    "Moments",
    "Path",
    "Quadratic",
    "Sums",
    "action_projection",
    "along_motion",
    "autocorrelations",
    "eigensystem",
    "gather",
    "inconsistency",
    "lexicographic_path",
    "minimum",
    "null_space_projection",
    "project",
    "softened_minima",
    "standard_risk",
    "unit_actions",
    "unvec",
    "vec",
]

"""Models of a policy: features, receptive fields, state spaces, and their closed form."""

from . import spaces
from .features import Affine, FeatureMap, KMeansRBF, NormalisedRBF, Placeable, Polynomial
from .formula import ClosedForm
from .model import Model
from .receptive_fields import Everywhere, ReceptiveFields, choose_variance, cover
from .scale import Scale

__all__ = [
    "Affine",
    "ClosedForm",
    "Everywhere",
    "FeatureMap",
    "KMeansRBF",
    "Model",
    "NormalisedRBF",
    "Placeable",
    "Polynomial",
    "ReceptiveFields",
    "Scale",
    "choose_variance",
    "cover",
    "spaces",
]

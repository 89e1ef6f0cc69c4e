"""Models of a policy: features, receptive fields, state spaces, and their closed form.

Examples
--------
>>> uc.models.Scale.of([1000.0, 1.0], 2, 2).state(np.array([[500.0, 0.5]]))
array([[0.5, 0.5]])
"""

from . import spaces
from .features import Affine, FeatureMap, KMeansRBF, NormalisedRBF, Placeable, Polynomial
from .formula import ClosedForm, Correction
from .model import SUPPORTED, Model
from .receptive_fields import Everywhere, ReceptiveFields, choose_variance, cover
from .scale import Scale

__all__ = [
    "SUPPORTED",
    "Affine",
    "ClosedForm",
    "Correction",
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

"""What a policy is made of: features, receptive fields, its formula."""

from .closed_form import ClosedForm, exponents
from .features import Affine, FeatureMap, KMeansRBF, NormalisedRBF, Placeable
from .receptive_fields import ReceptiveFields, choose_variance, cover

__all__ = [
    "Affine",
    "ClosedForm",
    "FeatureMap",
    "KMeansRBF",
    "NormalisedRBF",
    "Placeable",
    "ReceptiveFields",
    "choose_variance",
    "cover",
    "exponents",
]

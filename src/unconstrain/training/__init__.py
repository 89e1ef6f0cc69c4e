"""What a learner may look at: moments fold by fold, and samples where they are kept."""

from . import cluster
from .first_look import PLACING_SAMPLES, FirstLook
from .folded_moments import FoldedMoments
from .folds import Folds, HeldOut, Split, Validation
from .samples import Samples
from .training import Training

__all__ = [
    "PLACING_SAMPLES",
    "FirstLook",
    "FoldedMoments",
    "Folds",
    "HeldOut",
    "Samples",
    "Split",
    "Training",
    "Validation",
    "cluster",
]

"""What a learner may look at: moments fold by fold, and samples where they are kept."""

from . import cluster
from .batches import Batch
from .first_look import FirstLook, Seen, is_typical
from .folds import Folds, HeldOut, Split, Validation
from .order import mixed
from .samples import Samples
from .training import Training

__all__ = [
    "Batch",
    "FirstLook",
    "Folds",
    "HeldOut",
    "Samples",
    "Seen",
    "Split",
    "Training",
    "Validation",
    "cluster",
    "is_typical",
    "mixed",
]

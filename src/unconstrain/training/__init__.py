"""What a learner may look at: moments, fold by fold."""

from .validation import FoldedMoments, Folds, HeldOut, Splitter, Validation

__all__ = ["FoldedMoments", "Folds", "HeldOut", "Splitter", "Validation"]

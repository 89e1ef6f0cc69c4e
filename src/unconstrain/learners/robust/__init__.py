"""Beyond the paper: learners that look at the samples, hold under noise, and say when they cannot know."""

from ..solution import Uncertainty
from .learner import HIDDEN, Likelihood, NoiseCorrected, Robust, SampleLearner, Segments
from .noise import noise_by_differences

__all__ = [
    "HIDDEN",
    "Likelihood",
    "NoiseCorrected",
    "Robust",
    "SampleLearner",
    "Segments",
    "Uncertainty",
    "noise_by_differences",
]

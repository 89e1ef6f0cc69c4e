"""Beyond the paper: learners that look at the samples, hold under noise, and say when they cannot know."""

from .learner import Likelihood, NoiseCorrected, Robust, Segments
from .posterior import RobustSolution
from .samples import SampleLearner, Samples
from .uncertainty import Uncertainty, covariances, uncertainty

__all__ = [
    "Likelihood",
    "NoiseCorrected",
    "Robust",
    "RobustSolution",
    "SampleLearner",
    "Samples",
    "Segments",
    "Uncertainty",
    "covariances",
    "uncertainty",
]

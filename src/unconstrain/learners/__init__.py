"""From what was observed to a solution."""

from .plain import Direct, Hybrid, Inconsistency, Learner, Solution
from .robust import (
    Likelihood,
    NoiseCorrected,
    Robust,
    RobustSolution,
    SampleLearner,
    Samples,
    Segments,
    Uncertainty,
    covariances,
    uncertainty,
)
from .robust.learner import HIDDEN
from .robust.noise import noise_by_differences

__all__ = [
    "HIDDEN",
    "Direct",
    "Hybrid",
    "Inconsistency",
    "Learner",
    "Likelihood",
    "NoiseCorrected",
    "Robust",
    "RobustSolution",
    "SampleLearner",
    "Samples",
    "Segments",
    "Solution",
    "Uncertainty",
    "covariances",
    "noise_by_differences",
    "robust",
    "uncertainty",
]

"""Learners beyond the paper: they use the samples, estimate noise and uncertainty, and need no α."""

from .constants import SPHERE_HIDDEN_BY_NOISE
from .learner import Likelihood, NoiseCorrected, Robust, Segments
from .noise import noise_by_differences

__all__ = [
    "SPHERE_HIDDEN_BY_NOISE",
    "Likelihood",
    "NoiseCorrected",
    "Robust",
    "Segments",
    "noise_by_differences",
]

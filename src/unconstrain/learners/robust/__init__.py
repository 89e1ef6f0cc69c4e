"""Learners beyond the paper: they use the samples, estimate noise and uncertainty, and need no α.

Examples
--------
>>> noisy = np.random.default_rng(0).normal(0, 0.1, (2000, 2))
>>> variance = uc.robust.noise_by_differences(noisy, np.zeros(2000, int))
>>> bool(0.08 < np.sqrt(variance) < 0.12)
True
"""

from .constants import LEAST_MISFIT, SPHERE_HIDDEN_BY_NOISE
from .learner import Robust
from .noise import noise_by_differences
from .pivot import pivot_of
from .segments import held_throughout

__all__ = [
    "LEAST_MISFIT",
    "SPHERE_HIDDEN_BY_NOISE",
    "Robust",
    "held_throughout",
    "noise_by_differences",
    "pivot_of",
]

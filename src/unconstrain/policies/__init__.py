"""Policies as scikit-learn estimators.

Both are one model with a leading axis of M: features φ(x), shared by all
models, and how much each sample counts in each model. A parametric policy has
M = 1. The steps are those of the paper: fix features and fields, sum over the
samples, solve.
"""

from __future__ import annotations

from ..recordings import PLACING_SAMPLES
from .base import Policy
from .local import LocallyLinearPolicy
from .parametric import ParametricPolicy

__all__ = ["PLACING_SAMPLES", "LocallyLinearPolicy", "ParametricPolicy", "Policy"]

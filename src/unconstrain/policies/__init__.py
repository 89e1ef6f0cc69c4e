"""Policies as scikit-learn estimators.

Examples
--------
>>> uc.policies.ParametricPolicy(uc.Polynomial(2), "hybrid")
ParametricPolicy(features=Polynomial(degree=2), learner='hybrid')
"""

from .base import Policy
from .local import LocallyLinearPolicy
from .parametric import ParametricPolicy

__all__ = ["LocallyLinearPolicy", "ParametricPolicy", "Policy"]

"""Policies as scikit-learn estimators."""

from .base import Policy
from .local import LocallyLinearPolicy
from .parametric import ParametricPolicy

__all__ = ["LocallyLinearPolicy", "ParametricPolicy", "Policy"]

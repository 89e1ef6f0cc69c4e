"""Constraint matrices A(x, t), with A u = 0."""

from .known import Constraint, JacobianRows, Plane, PolicyAligned, SwitchingLine
from .matrices import constraint_matrices

__all__ = ["Constraint", "JacobianRows", "Plane", "PolicyAligned", "SwitchingLine", "constraint_matrices"]

"""Constraint matrices A(x, t), with A u = 0."""

from .known import Constraint, JacobianRows, Plane, PolicyAligned, SwitchingLine

__all__ = ["Constraint", "JacobianRows", "Plane", "PolicyAligned", "SwitchingLine"]

"""Constraint matrices A(x, t), with A u = 0: known, learnt, and mechanisms found in recordings.

Examples
--------
>>> uc.constraints.Plane(normal=[0, 0, 2])(np.zeros((1, 3)), np.zeros(1))
array([[[0., 0., 1.]]])
"""

from .choice import Choice
from .components import null_space_component
from .forms import Constant, Form, Surface, Velocities
from .known import Constraint, JacobianRows, Plane, PolicyAligned, SwitchingLine
from .learnt import LearntConstraint
from .matrices import constraint_matrices
from .mechanisms import identify, kept
from .spectrum import Fields

STORED = (Choice, Constant, Fields, Form, LearntConstraint, Surface, Velocities)
"""What a learnt constraint is made of, for its file."""

__all__ = [
    "STORED",
    "Constraint",
    "JacobianRows",
    "LearntConstraint",
    "Plane",
    "PolicyAligned",
    "SwitchingLine",
    "constraint_matrices",
    "identify",
    "kept",
    "null_space_component",
]

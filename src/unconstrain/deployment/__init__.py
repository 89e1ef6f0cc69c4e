"""A fitted policy where it is used: control loop, C, ONNX. One file for each target.

All are made from a :class:`~unconstrain.ClosedForm`; a new target is one more function of it.
"""

from .c99 import export_c
from .onnx_graph import export_onnx
from .stepping import Step, stepper

__all__ = ["Step", "export_c", "export_onnx", "stepper"]

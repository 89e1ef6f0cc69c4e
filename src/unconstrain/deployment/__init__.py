"""A fitted policy where it is used: control loop, C, ONNX, JavaScript. One file for each target.

All are made from a :class:`~unconstrain.ClosedForm`; a new target is one more function of it.
"""

from .deployable import Deployable, Exportable

__all__ = ["Deployable", "Exportable"]

"""From files to demonstrations: readers, preparation, batches."""

from . import writers
from .demonstration import Demonstration, Recording, Truth, noise_of, stack, times_of
from .preparation import Recipe, prepare
from .readers import read
from .streams import Stream

__all__ = [
    "Demonstration",
    "Recipe",
    "Recording",
    "Stream",
    "Truth",
    "noise_of",
    "preparation",
    "prepare",
    "read",
    "readers",
    "stack",
    "times_of",
    "writers",
]

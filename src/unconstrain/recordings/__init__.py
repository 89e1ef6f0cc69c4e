"""From files to demonstrations: readers, preparation, batches."""

from .batches import PLACING_SAMPLES, Batch, FirstLook, Groups, in_order, mixed
from .demonstration import Demonstration, Recording, Truth, stack
from .preparation import Recipe, complete_recipe, prepare, survey
from .readers import expand, read, read_blocks
from .readers.table import unique_names
from .streams import Stream

__all__ = [
    "PLACING_SAMPLES",
    "Batch",
    "Demonstration",
    "FirstLook",
    "Groups",
    "Recipe",
    "Recording",
    "Stream",
    "Truth",
    "complete_recipe",
    "expand",
    "in_order",
    "mixed",
    "preparation",
    "prepare",
    "read",
    "read_blocks",
    "readers",
    "stack",
    "survey",
    "unique_names",
]

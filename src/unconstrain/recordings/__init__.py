"""From files to demonstrations: readers, preparation, batches."""

from .demonstration import Demonstration, Recording, Truth, stack, times_of
from .preparation import Recipe, complete_recipe, prepare, survey
from .readers import expand, read, read_blocks
from .readers.table import unique_names
from .streams import Stream

__all__ = [
    "Demonstration",
    "Recipe",
    "Recording",
    "Stream",
    "Truth",
    "complete_recipe",
    "expand",
    "preparation",
    "prepare",
    "read",
    "read_blocks",
    "readers",
    "stack",
    "survey",
    "times_of",
    "unique_names",
]

"""Everything that can go wrong, in one family.

Each message says what was got, what was expected, and what to do about it.
Catch :class:`UnconstrainError` to catch them all; warnings are no errors.

Examples
--------
>>> issubclass(uc.errors.SettingError, uc.UnconstrainError)
True
"""

from typing import Any

__all__ = [
    "DivergedError",
    "InvalidDataError",
    "MissingBeliefError",
    "MissingExtraError",
    "ModelFileError",
    "ReadError",
    "SettingError",
    "SupportEndsWarning",
    "UnconstrainError",
    "WriteError",
]


class UnconstrainError(Exception):
    """Root of all errors that this package raises on purpose.

    Examples
    --------
    >>> try:
    ...     uc.LocallyLinearPolicy().fit([[0.0]], [[float("nan")]])
    ... except uc.UnconstrainError as error:
    ...     print(str(error).partition(",")[0])
    actions: found nan at row 0
    """


class InvalidDataError(UnconstrainError, ValueError):
    """An array that cannot be learnt from: NaN, ragged, empty, of the wrong shape."""


class DivergedError(InvalidDataError):
    """A movement that left the finite numbers.

    Attributes
    ----------
    part : Demonstration or list of Demonstration, or None
        What :func:`unconstrain.rollout` would have returned, up to there; None where it did not get beyond the start.
    """

    part: Any = None


class SettingError(UnconstrainError, ValueError):
    """A parameter outside its range, or a name that does not exist."""


class UntoldError(SettingError):
    """Columns of a recording that do not tell which are states and which actions."""

    cure = " 'unconstrain inspect' proposes a command."


class LackingError(InvalidDataError, SettingError):
    """A column or time stamps that a recording lacks, and those beside it may lack too: left out, nothing is cured."""

    cure = ""


class MissingBeliefError(SettingError, AttributeError):
    """Something that only a learner which looks at the samples can tell."""


class ReadError(UnconstrainError):
    """A recording that cannot be read, with the file, the row and the column."""


class ModelFileError(UnconstrainError):
    """A model file that is damaged, of a newer version, or not ours."""


class WriteError(UnconstrainError, OSError):
    """A file that cannot be written."""


class MissingExtraError(UnconstrainError, ImportError):
    """A feature whose optional dependency is not installed."""


class SupportEndsWarning(UserWarning):
    """A movement that stops before it comes to where nothing was demonstrated, or starts there."""


NOTHING_LEFT = "no demonstration is left to read; check episodes=, task= and leave_out=, or leave them off."
"""What a ReadError says where everything was to be passed over."""

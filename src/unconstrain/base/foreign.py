"""The door to what other people's libraries read: whatever they raise becomes one error of ours."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple, Self

from .errors import ReadError, UnconstrainError

MOST_NUMBERS = 2**31
"""Numbers that are read into memory from one file, at most: 16 GiB."""

MOST_PACKED = 1100
"""Times as large as what it is packed in, at most: DEFLATE packs 1032 zeros in one byte."""

_OF_PYTHON: dict[type[Exception], str] = {
    MemoryError: "it needs more memory than there is",
    RecursionError: "it is nested too deeply",
    OverflowError: "a number in it is too large",
}


@contextmanager
def ours_alone(
    path: str | os.PathLike[str],
    expected: str,
    error: type[UnconstrainError] = ReadError,
    said: str = "cannot be read",
    kinds: bool = False,
) -> Iterator[None]:
    """Hold it around every access to a file in a foreign format: damaged bytes make libraries raise what they like.

    Parameters
    ----------
    path : path
        The file, which the message names.
    expected : str
        The kind of file that was expected.
    error : type
        What to raise.
    said : str
        What is wrong with the file.
    kinds : bool
        Name the kind of what was raised, too.

    Raises
    ------
    ReadError
        Or ``error``, with the first line of what was raised. Errors of ours pass as they are.
    """
    try:
        yield
    except UnconstrainError:
        raise
    except Exception as failure:
        kind = f"{type(failure).__name__}: " if kinds else ""
        raise error(f"{os.fspath(path)}: {said} ({kind}{_why(failure)}). Expected {expected}.") from failure


class Stamp(NamedTuple):
    """By what is seen that a file has changed: its size in bytes, and when it last did, nanoseconds."""

    size: int
    changed: int

    @classmethod
    def of(cls, path: str | os.PathLike[str]) -> Self:
        """The stamp of a file, zeros where there is none."""
        try:
            found = os.stat(path)  # noqa: PTH116
        except OSError:
            return cls(0, 0)
        return cls(found.st_size, found.st_mtime_ns)


@contextmanager
def unchanged(path: str | os.PathLike[str], before: Stamp | None = None) -> Iterator[None]:
    """Hold it around reading a file: what is written meanwhile, or was since a stamp, may be lost or come twice.

    Raises
    ------
    ReadError
        If the file changed.
    """
    known = Stamp.of(path) if before is None else before
    _compare(path, known, "since it was first read")
    yield
    _compare(path, known, "while it was read")


def _compare(path: str | os.PathLike[str], before: Stamp, when: str) -> None:
    now = Stamp.of(path)
    if now != before:
        raise ReadError(
            f"{os.fspath(path)}: has changed {when}, from {before.size:,} to {now.size:,} bytes. Read it again when "
            "nobody writes to it."
        )


def check_size(numbers: int, stored: int | None = None) -> None:
    """Refuse what would not go into memory, before it is made, or is said to be far larger than what there is of it.

    Parameters
    ----------
    numbers : int
        How many will be held.
    stored : int, optional
        Bytes that they are packed in.

    Raises
    ------
    ValueError
    """
    if stored is not None and numbers > MOST_PACKED * (stored + 1000):
        raise ValueError(f"it says that it holds {numbers:,} numbers, in {stored:,} bytes")
    if numbers > MOST_NUMBERS:
        raise ValueError(f"it holds {numbers:,} numbers, of which {MOST_NUMBERS:,} can be read; read a part of it")


def _why(failure: Exception) -> str:
    known = [said for kind, said in _OF_PYTHON.items() if isinstance(failure, kind)]
    return known[0] if known else (str(failure).splitlines() or [""])[0][:200] or type(failure).__name__

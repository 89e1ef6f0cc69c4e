"""The terminal: what cannot be printed costs nothing that is made, and names are text, whatever they hold."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, BinaryIO

SHOWN = {code: f"\\x{code:02x}" for code in (*range(0x20), *range(0x7F, 0xA0)) if code not in b"\n\t"} | {
    code: f"\\u{code:04x}" for code in (*range(0x2028, 0x202F), *range(0x2066, 0x206A))
}
"""Control characters, those that turn the direction of text among them, as they are shown."""


class Patient(io.RawIOBase):
    """Bytes on their way out: once they cannot be written, they are given up, and the reason is kept.

    Parameters
    ----------
    stream : binary stream, optional
        None is one that is closed.
    """

    def __init__(self, stream: BinaryIO | None) -> None:
        self._stream = stream
        self.trouble = None if stream else OSError(errno.EBADF, os.strerror(errno.EBADF))

    def writable(self) -> bool:
        """Yes."""
        return True

    def isatty(self) -> bool:
        """Whether somebody looks."""
        return self._stream is not None and self._stream.isatty()

    def fileno(self) -> int:
        """Of the stream, or an OSError."""
        return super().fileno() if self._stream is None else self._stream.fileno()

    def write(self, data: Any) -> int:
        """Write all, at once."""
        if self._stream is not None and self.trouble is None:
            try:
                self._stream.write(data)
                self._stream.flush()
            except OSError as error:
                self.trouble = error
                self._give_up()
        return len(data)

    def _give_up(self) -> None:
        """Let what waits in the stream's buffer vanish, else Python fails with it when it ends."""
        with suppress(OSError), open(os.devnull, "wb") as nowhere:  # noqa: PTH123
            os.dup2(nowhere.fileno(), self.fileno())


class Plain(io.TextIOWrapper):
    """Text whose control characters are shown, and what has no place in the encoding, too."""

    def write(self, text: str) -> int:
        """Write it as it is shown."""
        super().write(text.translate(SHOWN))
        return len(text)


@contextmanager
def plain_output() -> Iterator[Patient]:
    """Print plain and patiently in this block; yields where standard output goes."""
    before = sys.stdout, sys.stderr
    if None in before:
        _occupy()
    out, err = (Patient(getattr(stream, "buffer", None)) for stream in before)
    sys.stdout, sys.stderr = (_plain(stream, patient) for stream, patient in zip(before, (out, err), strict=True))
    try:
        yield out
    finally:
        sys.stdout, sys.stderr = before


def _plain(stream: Any, patient: Patient) -> Plain:
    encoding = getattr(stream, "encoding", None) or "ascii"
    known = "utf-8" if encoding.lower() in ("ascii", "us-ascii", "ansi_x3.4-1968") else encoding
    return Plain(patient, known, "backslashreplace", newline=None, write_through=True)  # type: ignore[arg-type]


def _occupy() -> None:
    """Keep files from the numbers of closed standard streams, which others print to."""
    number = 0
    while number < 3:
        number = os.open(os.devnull, os.O_RDWR)
    os.close(number)

"""Reading in a process of its own: what ends a library, or keeps it for ever, ends that process and no other.

The process begins with the first file that is read so, and then waits for the next. It imports nothing from the working
folder. It is no prison: a file that was made to take over the library that reads it has what this user has.
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from io import BufferedReader
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from ...base.errors import UnconstrainError

SLOWEST = 1e6
"""Bytes of a file that are read in a second of a processor, at least."""

PATIENCE = 5.0
"""Seconds of a processor that each table may take beyond that."""

_PACKAGES = Path(__file__).parents[3]
_PROGRAM = f"""\
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
from {__name__} import serve
serve()
"""


def apart(read: Callable[..., Iterator[Any]], path: Path, *told: Any) -> Iterator[Any]:
    """What ``read(place, path, *told)`` gives in a process of its own; ``place`` is the file, from the root.

    Raises
    ------
    UnconstrainError
        As ``read`` does, which may raise nothing else.
    ChildProcessError
        If the process ends, or works for longer than any file of this size takes.
    """
    seconds = PATIENCE + path.stat().st_size / SLOWEST
    reader = _Reader.waiting()
    try:
        found = reader.ask(seconds, read, path.absolute(), path, *told)
        while found is not None:
            yield found
            found = reader.ask(seconds)
    finally:
        reader.wait()


class _Reader:
    """The process, for the one that asks."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=_PACKAGES,
        )
        self._asking = cast(IO[bytes], self._process.stdin)
        self._telling = cast(BufferedReader, self._process.stdout)
        self._is_asked = False
        pickle.dump(_search_path(), self._asking)

    @classmethod
    def waiting(cls) -> _Reader:
        """One that waits, or a new one."""
        while reader := _WAITING.pop(os.getpid(), None):
            if reader._process.poll() is None:
                return reader
            reader.end()
        return cls()

    def ask(self, seconds: float, *call: Any) -> Any:
        """The first that a call gives, or what the last call gives next; None after the last."""
        self._is_asked = True
        try:
            pickle.dump((seconds, call), self._asking)
            self._asking.flush()
            found = _receive(self._telling)
        except (EOFError, OSError, pickle.UnpicklingError):
            raise ChildProcessError(_said(self._process.wait(), seconds)) from None
        self._is_asked = False
        if isinstance(found, UnconstrainError):
            raise found
        return found

    def wait(self) -> None:
        """Leave what was not read, and wait for another file; or end, if one waits already or this one is at work."""
        if not self._is_asked:
            self.ask(PATIENCE, iter, ())
        if self._is_asked or _WAITING.setdefault(os.getpid(), self) is not self:
            self.end()

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._telling.close()
        with suppress(OSError):
            self._asking.close()


_WAITING: dict[int, _Reader] = {}
"""One for each process that asks: what a fork finds here is its parent's."""


@atexit.register
def _end() -> None:
    if reader := _WAITING.pop(os.getpid(), None):
        reader.end()


def _said(code: int, seconds: float) -> str:
    """How the process ended, in words."""
    if sys.platform != "win32" and code == -signal.SIGPROF:
        return f"reading it did not end in {seconds:.0f} s"
    return f"reading it ended the process, with {code}"


def _search_path() -> list[str]:
    """Where this process finds modules, but for the working folder."""
    places = [Path(place).absolute() for place in sys.path if place and not _is_here(place)]
    return [*map(str, places), str(_PACKAGES)]


def _is_here(place: str) -> bool:
    try:
        return os.path.samefile(place, os.curdir)  # noqa: PTH121
    except OSError:
        return False


def _receive(file: BufferedReader) -> Any:
    buffers = [np.empty(size, np.uint8) for size in pickle.load(file)]
    if any(file.readinto(buffer.data) < len(buffer) for buffer in buffers):
        raise EOFError
    return pickle.load(file, buffers=buffers)


def _send(found: Any, file: IO[bytes]) -> None:
    """Arrays as they lie in memory, then what holds them."""
    buffers: list[pickle.PickleBuffer] = []
    content = pickle.dumps(found, 5, buffer_callback=buffers.append)
    pickle.dump([buffer.raw().nbytes for buffer in buffers], file)
    for buffer in buffers:
        file.write(buffer.raw())
    file.write(content)
    file.flush()


def serve() -> None:
    """Answer what is asked on the standard input, until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asks is interrupted, too
    telling = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    given: Iterator[Any] = iter(())
    while True:
        try:
            seconds, call = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        if call:
            given = call[0](*call[1:])
        _allow(seconds)
        found = _next(given)
        _allow(0.0)
        _send(found, telling)


def _allow(seconds: float) -> None:
    """Let the system end this process after so many seconds of a processor, where it does such; 0 is without end."""
    if sys.platform != "win32":
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _next(given: Iterator[Any]) -> Any:
    try:
        return next(given, None)
    except UnconstrainError as error:
        return error

"""Files go out whole or not at all: whoever looks sees the old one or the new one."""

import os
import secrets
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from .errors import UnconstrainError, WriteError


def write(
    path: str | os.PathLike[str],
    data: str | bytes | Callable[[BinaryIO], object],
    error: type[UnconstrainError] = WriteError,
) -> None:
    """Write a file beside its place, then put it there in one step.

    A file that is there keeps its permissions, and a symbolic link keeps pointing to where it points.

    Parameters
    ----------
    path : str or path-like
    data : str, bytes, or callable
        Text is stored as UTF-8. A callable gets a binary stream to write to.
    error : type
        What to raise where the file cannot be written.

    Raises
    ------
    WriteError
        Or ``error``, in one sentence that begins with the path. The old file is then as it was.
    """
    try:
        _replace(Path(os.path.realpath(path)), data)
    except OSError as failure:
        raise error(f"{os.fspath(path)}: cannot be written ({failure.strerror or failure}).") from failure


def _replace(target: Path, data: str | bytes | Callable[[BinaryIO], object]) -> None:
    mode = _mode(target)
    # A name may have 255 bytes; this one has at most 183.
    temporary = target.with_name(f".{target.name[:40]}.{secrets.token_hex(8)}.part")
    try:
        with temporary.open("xb") as stream:  # made anew, so the process's umask holds
            if mode is not None:
                temporary.chmod(mode)
            _fill(stream, data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _mode(target: Path) -> int | None:
    """Permissions of the file that is there; None where there is none."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(mode):
        raise OSError("it is a folder or a device, expected a file")
    return stat.S_IMODE(mode)


def _fill(stream: BinaryIO, data: str | bytes | Callable[[BinaryIO], object]) -> None:
    if callable(data):
        data(stream)
    else:
        stream.write(data.encode() if isinstance(data, str) else data)

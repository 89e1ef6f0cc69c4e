"""Files go out whole or not at all: whoever looks sees the old one or the new one."""

import ctypes
import importlib
import os
import secrets
import shutil
import stat
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from glob import escape
from pathlib import Path
from typing import BinaryIO

from .display import legible
from .errors import UnconstrainError, WriteError

PACKINGS = (".gz", ".bz2", ".xz")
"""Suffixes of files that are packed."""
PICKLES = (".pkl", ".pickle", ".joblib")

_LOCKS = importlib.import_module("fcntl") if os.name == "posix" else None
_UNNAMED = getattr(os, "O_TMPFILE", 0) if Path("/proc/self/fd").is_dir() else 0
_EXCHANGE = 2  # RENAME_EXCHANGE of renameat2(2)


def stem(path: str | os.PathLike[str]) -> str:
    """Name of a file without its suffix, and without that of the packing: as its demonstration is called."""
    file = Path(path)
    return Path(file.stem).stem if file.suffix.lower() in PACKINGS else file.stem


def write(
    path: str | os.PathLike[str],
    data: str | bytes | Callable[[BinaryIO], object],
    error: type[UnconstrainError] = WriteError,
) -> None:
    """Write a file beside its place, then put it there in one step.

    A file that is there keeps its permissions, and a symbolic link keeps pointing to where it points. What killed runs
    left beside this place is removed.

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
    with _told(path, error):
        _replace(Path(os.path.realpath(path)), data)


def check(path: str | os.PathLike[str]) -> None:
    """Find out whether :func:`write` may work, before there is anything to write.

    Raises
    ------
    WriteError
        As :func:`write` does.
    """
    with _told(path, WriteError):
        target = Path(os.path.realpath(path))
        _mode(target)
        if not target.parent.is_dir():
            raise OSError(f"there is no folder {target.parent}")
        if not os.access(target.parent, os.W_OK | os.X_OK):
            raise OSError("its folder may not be written to")


@contextmanager
def workshop(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A folder beside a place, to make there what comes to it; gone at the end, or with the next work for this place.

    Raises
    ------
    WriteError
        As :func:`write` does.
    """
    target = Path(os.path.realpath(path))
    folder = _beside(target)
    try:
        with _told(path, WriteError):
            _sweep(target)
            folder.mkdir()
        with _claimed(folder):
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def put_folder(made: Path, path: str | os.PathLike[str]) -> None:
    """Put a folder in its place; what was there takes the place of what was made, in one step where the system can.

    Raises
    ------
    WriteError
        As :func:`write` does.
    """
    target = Path(os.path.realpath(path))
    with _told(path, WriteError):
        if not target.exists():
            made.rename(target)
        elif not _exchanged(made, target):
            old = target.with_name(f"{target.name[:40]}.before-{secrets.token_hex(4)}")  # not lost, if killed here
            target.rename(old)
            made.rename(target)
            old.rename(made)


@contextmanager
def _told(path: str | os.PathLike[str], error: type[UnconstrainError]) -> Iterator[None]:
    try:
        yield
    except OSError as failure:
        raise error(f"{os.fspath(path)}: cannot be written ({failure.strerror or failure}).") from failure


def _replace(target: Path, data: str | bytes | Callable[[BinaryIO], object]) -> None:
    mode = _mode(target)
    _sweep(target)
    temporary = _beside(target)
    try:
        with ExitStack() as claim:
            with _new(temporary) as stream:
                claim.enter_context(_claimed(stream.fileno()))  # until it has its place
                if mode is not None:
                    os.chmod(stream.fileno() if os.chmod in os.supports_fd else temporary, mode)  # noqa: PTH101
                _fill(stream, data)
                stream.flush()
                os.fsync(stream.fileno())
                if not temporary.exists():
                    os.link(f"/proc/self/fd/{stream.fileno()}", temporary, src_dir_fd=stream.fileno())
            temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _new(path: Path) -> BinaryIO:
    """A file that is made anew, so that the process's umask holds; without a name, so that a kill leaves none."""
    if _UNNAMED:
        with suppress(OSError):  # some file systems have no such files
            return os.fdopen(os.open(path.parent, _UNNAMED | os.O_RDWR, 0o666), "w+b")
    return path.open("x+b")


def _beside(target: Path) -> Path:
    # A name may have 255 bytes; this one has at most 183.
    return target.with_name(f".{target.name[:40]}.{secrets.token_hex(8)}.part")


@contextmanager
def _claimed(place: int | Path) -> Iterator[None]:
    """Hold what is being made, an open file or a folder, so that nobody takes it for what a killed run left."""
    if _LOCKS is None:
        yield
        return
    held = os.open(place, os.O_RDONLY) if isinstance(place, Path) else os.dup(place)
    try:
        with suppress(OSError):  # some file systems have no locks
            _LOCKS.flock(held, _LOCKS.LOCK_EX | _LOCKS.LOCK_NB)
        yield
    finally:
        os.close(held)


def _sweep(target: Path) -> None:
    """Remove what killed runs left beside a place: what nobody holds."""
    for left in target.parent.glob(f".{escape(target.name[:40])}.{'[0-9a-f]' * 16}.part"):
        if _is_left(left):
            (shutil.rmtree if left.is_dir() else Path.unlink)(left)


def _is_left(path: Path) -> bool:
    if _LOCKS is None:
        return False
    try:
        held = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        _LOCKS.flock(held, _LOCKS.LOCK_EX | _LOCKS.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(held)
    return True


def _exchanged(one: Path, other: Path) -> bool:
    """Whether two names could change places in one step."""
    rename = getattr(ctypes.CDLL(None), "renameat2", None) if os.name == "posix" else None
    here = -100  # AT_FDCWD
    return rename is not None and rename(here, os.fsencode(one), here, os.fsencode(other), _EXCHANGE) == 0


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
        stream.write(legible(data).encode() if isinstance(data, str) else data)

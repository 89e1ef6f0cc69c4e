"""Files that are packed: opened as what is in them."""

import bz2
import gzip
import lzma
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, cast

from ...base.errors import ReadError
from ...base.files import PACKINGS

OPENERS: dict[bytes, Callable[[BinaryIO], Any]] = {
    b"\x1f\x8b": lambda file: gzip.GzipFile(fileobj=file),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ\x00": lzma.LZMAFile,
}
"""First bytes of a packed file, and what opens it."""


def open_packed(file: BinaryIO) -> BinaryIO:
    """What is in an open file, unpacked where it is packed."""
    head = file.read(8)
    file.seek(0)
    unpack = next((opener for magic, opener in OPENERS.items() if head.startswith(magic)), None)
    return file if unpack is None else cast(BinaryIO, unpack(file))


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """Open a file to read, unpacked where it is packed.

    Raises
    ------
    ReadError
        If it cannot be opened, read or unpacked.
    """
    try:
        with path.open("rb") as file, open_packed(file) as content:
            yield content
    except (EOFError, lzma.LZMAError, gzip.BadGzipFile, gzip.zlib.error) as error:  # type: ignore[attr-defined]
        raise ReadError(f"{path}: cannot be unpacked ({error}). It may have been copied in part.") from error
    except OSError as error:
        raise ReadError(f"{path}: could not be read ({error.strerror or error}).") from error


def suffix(path: Path) -> str:
    """Suffix of what is in a file, in small letters."""
    return Path(path.stem if path.suffix.lower() in PACKINGS else path.name).suffix.lower()

"""All formats, and which one a file is in: by its first bytes, else by its suffix."""

from pathlib import Path

from ...base.errors import ReadError
from . import c3d, excel, hdf5, matlab, npz, packed, parquet, records, ros, text
from .table import Format

FORMATS = (
    *(npz.FORMAT, npz.ARRAY, parquet.FORMAT, hdf5.FORMAT, matlab.FORMAT, ros.FORMAT, c3d.FORMAT),
    *(excel.FORMAT, records.FORMAT, text.FORMAT),
)


def format_of(path: Path) -> Format:
    """The format of a file.

    Raises
    ------
    ReadError
        If there is no such file, or it is in no format that is known.
    """
    if ros.is_recording(path):
        return ros.FORMAT
    if not path.is_file():
        raise ReadError(f"{path}: {'a folder' if path.is_dir() else 'no such file'}, expected the path of a file.")
    suffix = packed.suffix(path)
    with packed.opened(path) as file:
        head = file.read(4096)
    fitting = [known for known in FORMATS if known.recognises(head)]
    found = [
        *(known for known in fitting if known.by_content),
        *(known for known in FORMATS if suffix in known.suffixes),
        *fitting,
    ]
    if not found:
        raise ReadError(
            f"{path}: neither its suffix nor its content is of a known format. Supported are {', '.join(suffixes())}."
        )
    return found[0]


def suffixes() -> tuple[str, ...]:
    """The suffixes of all formats."""
    return tuple(suffix for known in FORMATS for suffix in known.suffixes)

"""What a folder stands for: the frames of a LeRobot data set, or the files of one kind in it.

Of folders in it only partitions, such as ``day=1``, belong to it.
"""

import warnings
from collections import defaultdict
from pathlib import Path

from ...base.display import counted, listed
from ...base.errors import ReadError
from . import packed
from .formats import suffixes
from .lerobot import frames_of
from .ros import is_recording

ASIDE = (".txt", ".json", ".jsonl", ".log", ".dat", ".out")
"""Files of these kinds beside others are notes, not recordings."""


def files_in(folder: Path) -> list[Path]:
    """The files to read, in the order of their names.

    Raises
    ------
    ReadError
        If there is none, or they are of several kinds.

    Warns
    -----
    UserWarning
        Of files of that kind in folders in it, which are not read.
    """
    if is_recording(folder):
        return [folder]
    frames = frames_of(folder)
    if frames:
        return frames
    kinds: dict[str, list[Path]] = defaultdict(list)
    below: dict[str, list[Path]] = defaultdict(list)
    for path in sorted(folder.rglob("*")):
        if path.is_file() and packed.suffix(path) in suffixes() and not path.name.startswith("."):
            inside = all("=" in part for part in path.relative_to(folder).parent.parts)
            (kinds if inside else below)[packed.suffix(path)].append(path)
    if not kinds:
        more = " ".join(_below(folder, *found) for found in below.items())
        raise ReadError(f"{folder}: a folder without a file to read.{more and ' '}{more}")
    chosen = [kind for kind in kinds if kind not in ASIDE] if len(kinds) > 1 else list(kinds)
    if len(chosen) != 1:
        held = ", ".join(f"{len(paths)} {kind}" for kind, paths in kinds.items())
        kind = next(iter(chosen or kinds))
        raise ReadError(f"{folder}: holds files of several kinds ({held}); say which, such as '{folder}/*{kind}'.")
    if chosen[0] in below:
        found = f"{counted(len(kinds[chosen[0]]), 'file')} read"
        warnings.warn(f"{folder}: {found}. {_below(folder, chosen[0], below[chosen[0]])}", stacklevel=3)
    return kinds[chosen[0]]


def _below(folder: Path, kind: str, paths: list[Path]) -> str:
    inside = list(dict.fromkeys(str(path.relative_to(folder).parts[0]) for path in paths))
    return f"Folders in it ({listed(inside, 3)}) hold {len(paths)} more {kind}; '{folder}/**/*{kind}' reads all."

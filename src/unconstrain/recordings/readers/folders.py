"""What a folder stands for: the frames of a LeRobot data set, or the files of one kind in it."""

from collections import defaultdict
from pathlib import Path

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
    """
    if is_recording(folder):
        return [folder]
    frames = frames_of(folder)
    if frames:
        return frames
    kinds: dict[str, list[Path]] = defaultdict(list)
    for path in sorted(folder.rglob("*")):
        if path.is_file() and packed.suffix(path) in suffixes() and not path.name.startswith("."):
            kinds[packed.suffix(path)].append(path)
    if not kinds:
        raise ReadError(f"{folder}: a folder without a file to read.")
    chosen = [kind for kind in kinds if kind not in ASIDE] if len(kinds) > 1 else list(kinds)
    if len(chosen) != 1:
        held = ", ".join(f"{len(paths)} {kind}" for kind, paths in kinds.items())
        kind = next(iter(chosen or kinds))
        raise ReadError(f"{folder}: holds files of several kinds ({held}); say which, such as '{folder}/*{kind}'.")
    return kinds[chosen[0]]

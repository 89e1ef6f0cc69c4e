"""NumPy archives: ``states`` (N, n), ``actions`` (N, d), and if known ``times`` (N,) and ``groups`` (N,).

The columns are called x1..xn and u1..ud. Nothing in the file is ever unpickled.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Array
from ...base.errors import ReadError
from ..demonstration import Recording
from .table import Format, seconds, split_by_group

Contents = dict[str, NDArray[np.generic]]

_EXPECTED = "Expected a NumPy archive, as from numpy.savez(path, states=..., actions=..., times=..., groups=...)"


def read_npz(path: Path, group: str | None, time: str | None) -> list[Recording]:
    """Read one archive; see :class:`~.table.ReadFile`. Errors say what is in there."""
    contents = _load(path)
    _check_keys(path, contents, {"states", "actions", *filter(None, (group, time))}, {"times", "groups"})
    states, actions = (_numbers(path, contents, key, 2) for key in ("states", "actions"))
    columns = [f"x{i + 1}" for i in range(states.shape[1])] + [f"u{i + 1}" for i in range(actions.shape[1])]
    for key, array in contents.items():
        if len(array) != len(states):
            raise ReadError(f"{path}: {len(states)} rows of states, but {len(array)} of {key}; expected as many.")
    clock, label = time or "times", group or "groups"
    times = seconds(_numbers(path, contents, clock, 1), clock) if clock in contents else None
    groups = _groups(path, contents, label) if label in contents else None
    return split_by_group(columns, np.hstack([states, actions]), times, groups, path.stem)


def _load(path: Path) -> Contents:
    try:
        # Opened here, since numpy leaves a damaged file open.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    # Damaged bytes make NumPy, zipfile and zlib raise a dozen unrelated types; none of them must pass this door.
    except Exception as error:
        raise ReadError(f"{path}: cannot be read ({type(error).__name__}: {error}). {_EXPECTED}.") from error


def _check_keys(path: Path, contents: Contents, needed: set[str], optional: set[str]) -> None:
    if "header" in contents and "array0" in contents:
        raise ReadError(f"{path}: is a policy that was saved, not recordings to learn from.")
    if not needed <= set(contents) <= needed | optional:
        held = ", ".join(f"{key} {array.shape}" for key, array in contents.items()) or "nothing"
        raise ReadError(f"{path}: holds {held}. {_EXPECTED}; needed are {', '.join(sorted(needed))}.")


def _numbers(path: Path, contents: Contents, key: str, dimensions: int) -> Array:
    array = contents[key]
    if array.dtype.kind not in "fiub" or array.ndim != dimensions or not array.size:
        raise ReadError(
            f"{path}: {key} is {array.dtype} of shape {array.shape}, "
            f"expected real numbers in {dimensions} dimension{'s' * (dimensions > 1)}, not empty."
        )
    with np.errstate(all="ignore"):  # a long double beyond float64 becomes infinity, which is found later
        return array.astype(np.float64)


def _groups(path: Path, contents: Contents, key: str) -> list[str]:
    array = contents[key]
    if array.dtype.kind not in "iubfU" or array.ndim != 1:
        raise ReadError(
            f"{path}: {key} is {array.dtype} of shape {array.shape}, expected one number or text for each sample."
        )
    try:
        return [str(label) for label in array.tolist()]
    except (SystemError, ValueError) as error:  # what NumPy and Python raise for characters that do not exist
        raise ReadError(f"{path}: {key} holds damaged text ({error}).") from error


FORMAT = Format((".npz",), lambda head: head.startswith(b"PK\x03\x04"), read_npz)

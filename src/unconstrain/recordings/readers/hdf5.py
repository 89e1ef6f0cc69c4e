"""HDF5 files: each group that holds data sets of one length is a recording; its data sets are columns (:mod:`~.trees`).

The layouts of robot learning are understood: ``data/demo_0/{actions, obs/...}`` (robomimic, robosuite), with the lists
in ``mask``; ``observations`` with one row more than ``actions`` (Minari); episodes that ``terminals`` and ``timeouts``
end (D4RL); ``action`` and ``observations/qpos`` (ALOHA). What comes after each step (``next_obs``) is left out.

The HDF5 library ends, or never does, on some damaged files; it is given them in a process of its own (:mod:`~.apart`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import BLOCK_ROWS, require_extra
from ...base.foreign import ours_alone
from .apart import apart
from .clocks import find_clock
from .nodes import Visit
from .reading import Reading
from .table import Format, Table
from .trees import Branch, tables_of

EXPECTED = "an HDF5 file"

AFTER = re.compile(r"next_(obs|observations?)|mask|metadata|images?|#refs#|#subsystem#")
"""Groups and data sets that are not read as columns."""

OBSERVATIONS = ("obs", "observations", "observation")
"""Groups whose data sets stand beside those of the group that they are in."""

INFOS = ("infos", "info")
"""As those, but their names alone might be mistaken for others."""

ENDS = ("terminals", "timeouts")
"""Data sets that are true in the last row of an episode."""

_DEMONSTRATION = re.compile(r"/data/demo_\d+$")
_CONTROL_RATE = re.compile(r'"control_freq"\s*:\s*([\d.]+)')
_ROLES = {"groups": "group"}


def read_hdf5(path: Path, reading: Reading) -> Iterator[Table]:
    """Read one file by some rows at a time; see :class:`~.table.ReadFile`."""
    return apart(_read, path, reading, BLOCK_ROWS)


def _read(place: Path, path: Path, reading: Reading, rows: int) -> Iterator[Table]:
    h5py = require_extra("h5py", "data")
    with ours_alone(path, EXPECTED), h5py.File(place, "r") as file:
        branch = _branch(file, path.stem, reading, _masks(file, Visit(h5py)), Visit(h5py))
        yield from tables_of(branch, path, reading, rows)


def _branch(node: Any, name: str, reading: Reading, masks: Mapping[str, list[str]], visit: Visit) -> Branch:
    """A group with what is in it, as far as it may become columns."""
    members: dict[str, Any] = {}
    for title, child in visit.members(node).items():
        picture = getattr(child, "ndim", 0) > 1 and child.dtype == np.uint8
        if picture or AFTER.fullmatch(title):
            continue
        if hasattr(child, "keys"):
            below = _branch(child, child.name.strip("/"), reading, masks, visit)
            members |= _beside(below, title, members) if title in (*OBSERVATIONS, *INFOS) else {title: below}
        elif title in (reading.group, reading.time):
            members[title] = child
        else:
            members[_ROLES.get(title, title)] = child
    members = _in_one(members) | _episodes(members)
    # There the states are those of the simulator, not what the actions belong to.
    simulated = _DEMONSTRATION.search(node.name) is not None and find_clock(list(members)) is None
    return Branch(members, name, _attributes(node), tuple(masks.get(name.rpartition("/")[2], ())), not simulated)


def _in_one(members: Mapping[str, Any]) -> dict[str, Any]:
    """What is in groups of different contents and of one length, as parts of one movement, side by side."""
    groups = {title: member.members for title, member in members.items() if isinstance(member, Branch)}
    sets = [*(member for title, member in members.items() if title not in groups)]
    sets += [each for group in groups.values() for each in group.values()]
    lengths = {each.shape[0] if getattr(each, "ndim", 0) else 0 for each in sets}
    alike = len({tuple(group) for group in groups.values()}) < len(groups)
    if not groups or alike or len(lengths) != 1 or lengths == {0} or len(groups) == len(members) == 1:
        return dict(members)
    beside = {f"{title}.{name}": each for title, group in groups.items() for name, each in group.items()}
    return {title: member for title, member in members.items() if title not in groups} | beside


def _beside(below: Branch, group: str, members: Mapping[str, Any]) -> dict[str, Any]:
    """What is in a group of observations, beside what the actions are in."""
    clear = group in OBSERVATIONS
    return {
        title if clear and title not in members else f"{group}.{title}": child for title, child in below.members.items()
    }


def _episodes(members: Mapping[str, Any]) -> dict[str, Any]:
    """The number of the episode of each row, where data sets say which row is the last of one."""
    ends = [members[name] for name in ENDS if name in members and getattr(members[name], "ndim", 0) == 1]
    if "observations" not in members or not ends or len({len(each) for each in ends}) > 1:
        return {}
    is_end = np.any([np.asarray(each) != 0 for each in ends], axis=0)
    return {"episode": np.concatenate([[0], np.cumsum(is_end)[:-1]])}


def _masks(file: Any, visit: Visit) -> dict[str, list[str]]:
    """For each demonstration the lists that it is in."""
    lists: dict[str, list[str]] = {}
    mask = visit.members(file).get("mask")
    for title, names in visit.members(mask).items() if hasattr(mask, "items") else ():
        for name in names[()].tolist() if getattr(names, "ndim", 0) == 1 else ():
            text = name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
            lists.setdefault(text, []).append(title)
    return lists


def _attributes(node: Any) -> dict[str, Any]:
    """Single numbers and words that are attached to a group."""
    found: dict[str, Any] = {}
    for name, value in node.attrs.items():
        if isinstance(value, str | int | float | np.number | np.bool_):
            found[name] = value if isinstance(value, str) else value.item() if hasattr(value, "item") else value
    rate = next((match[1] for value in found.values() if (match := _CONTROL_RATE.search(str(value)))), None)
    return found if rate is None else {**found, "control_freq": float(rate)}


FORMAT = Format(
    (".h5", ".hdf5", ".hdf", ".he5"),
    lambda head: head.startswith(b"\x89HDF\r\n\x1a\n"),
    read_hdf5,
    in_blocks=True,
    expected=EXPECTED,
)

"""What is in an HDF5 file itself, each group once: links that lead out of it or round in it are not followed."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...base.foreign import check_size
from .trees import Elsewhere


class Visit:
    """One walk through a file.

    Parameters
    ----------
    h5py : module
    """

    def __init__(self, h5py: Any) -> None:
        self._h5py = h5py
        self._groups: set[Any] = set()

    def members(self, group: Any) -> dict[str, Any]:
        """Groups that were not met before, and data sets, by name; empty of a group that was visited already.

        Raises
        ------
        ValueError
            If its data sets hold more than can be read, or say that they hold far more than the file does.
        """
        self._groups.add(self._place(group))
        kept: dict[str, Any] = {}
        for title in group:
            child = self._inside(group, title)
            is_set = isinstance(child, self._h5py.Dataset)
            if isinstance(child, self._h5py.Group) and self._place(child) not in self._groups:
                self._groups.add(self._place(child))
                kept[title] = child
            elif child is Elsewhere or (is_set and (child.is_virtual or child.external)):
                kept[title] = Elsewhere()
            elif is_set:
                check_size(child.size or 0, child.id.get_storage_size())
                kept[title] = self._words(child) if self._h5py.check_string_dtype(child.dtype) else child
        return kept

    def _inside(self, group: Any, title: str) -> Any:
        """A member, Elsewhere if it is in another file, None if it is nowhere."""
        if isinstance(group.get(title, getlink=True), self._h5py.ExternalLink):
            return Elsewhere
        child = group.get(title)
        return Elsewhere if child is not None and child.file.filename != group.file.filename else child

    def _place(self, node: Any) -> Any:
        return self._h5py.h5o.get_info(node.id).addr

    def _words(self, child: Any) -> Any:
        """Words as NumPy holds them; as they are where there is no row of them."""
        return np.array(child.asstr("utf-8", "replace")[:], dtype=np.str_) if child.ndim == 1 else child

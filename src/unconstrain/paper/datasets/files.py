"""Where a published file is on this machine: a local copy, an earlier download, or a new one where that is allowed."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ...base.arrays import require_extra
from ...base.errors import MissingExtraError, ReadError

DATA_VARIABLE = "UNCONSTRAIN_DATA"
"""Environment variable with a folder that holds local copies."""


@dataclass(frozen=True)
class Source:
    """Files that were published together.

    Parameters
    ----------
    folder : str
        Of their local copies, below that of ``UNCONSTRAIN_DATA``.
    url : str, optional
        Of the folder that they can be downloaded from, at one commit; None where there is no such place.
    origin : str
        Where else they come from, in words.
    """

    folder: str
    url: str | None
    origin: str = ""

    def path(self, file: str, download: bool) -> Path:
        """Where a file is, with the published content; fetched if there is none and that is allowed.

        Raises
        ------
        ReadError
            If there is no local copy and ``download`` is False, the download fails, or the file is not the published
            one.
        MissingExtraError
            If a download is asked for and the extra ``data`` is not installed.
        """
        path = self._located(file, download and self.url is not None)
        self._verify(path)
        return path

    def sha256(self, file: str) -> str:
        """Checksum of the published file."""
        return _checksums()[f"{self.folder}/{file}"]

    def _located(self, file: str, download: bool) -> Path:
        local = os.environ.get(DATA_VARIABLE)
        places = [Path(local) / file, Path(local) / self.folder / file] if local else []
        kept = _cache(needed=download)
        if kept is not None:
            places.append(kept / file)
        found = next((place for place in places if place.is_file()), None)
        if found is not None:
            return found
        if download and kept is not None:
            return self._fetched(file, kept)
        tried = ", ".join(map(str, places)) or "no folder"
        raise ReadError(f"{file} is not on this machine (looked in {tried}). {self._where(file)}")

    def _where(self, file: str) -> str:
        """What can be done where a file is missing."""
        if self.url is None:
            return f"Set {DATA_VARIABLE} to a folder that holds a copy of {self.origin}."
        return (
            f"Either allow the download with download=True, or set {DATA_VARIABLE} to a folder that holds a copy of "
            f"{self.url}{file}."
        )

    def _fetched(self, file: str, folder: Path) -> Path:
        pooch = require_extra("pooch", "data")
        url = f"{self.url}{file}"
        try:
            return Path(pooch.retrieve(url, known_hash=f"sha256:{self.sha256(file)}", fname=file, path=folder))
        # Wrong checksum: ValueError; no network, no space, no permission: OSError, as all of requests'.
        except (OSError, ValueError) as error:
            raise ReadError(
                f"{file} could not be downloaded from {url} ({error}). "
                f"Try again, or set {DATA_VARIABLE} to a folder that holds a copy."
            ) from error

    def _verify(self, path: Path) -> None:
        found, expected = hashlib.sha256(path.read_bytes()).hexdigest(), self.sha256(path.name)
        if found != expected:
            raise ReadError(
                f"{path}: its SHA-256 is {found}, expected {expected}: damaged, or another version. "
                "Remove it and download it again."
            )


@cache
def _checksums() -> dict[str, str]:
    """By folder and file, from a list as ``sha256sum`` writes it."""
    lines = (Path(__file__).parent / "SHA256SUMS").read_text(encoding="utf-8").splitlines()
    return {file: checksum for checksum, file in (line.split() for line in lines)}


def _cache(*, needed: bool) -> Path | None:
    """Folder of earlier downloads; None if nothing can have been downloaded."""
    try:
        return Path(require_extra("pooch", "data").os_cache("unconstrain"))
    except MissingExtraError:
        if needed:
            raise
        return None

"""Streams know what they read: nothing that a file said it had is lost without a word."""

import os
import shutil

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from unconstrain.base.errors import ReadError
from unconstrain.recordings import readers

ROWS = 150_000
TABLE = np.column_stack([np.arange(ROWS), np.ones((ROWS, 3))])


def text(path, rows):
    np.savetxt(path, TABLE[:rows], "%d", ",", header="x1,x2,u1,u2", comments="")


def parquet(path, rows):
    pq.write_table(
        pa.table(dict(zip(("x1", "x2", "u1", "u2"), TABLE[:rows].T, strict=True))), path, row_group_size=10_000
    )


def array(path, rows):
    np.save(path, TABLE[:rows])


def hdf5(path, rows):
    with h5py.File(path.with_suffix(".made"), "w") as file:
        file["states"], file["actions"] = TABLE[:rows, :2], TABLE[:rows, 2:]
    path.write_bytes(path.with_suffix(".made").read_bytes())


KINDS = {"csv": text, "parquet": parquet, "npy": array, "h5": hdf5}


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    folder = tmp_path_factory.mktemp("originals")
    for kind, write in KINDS.items():
        write(folder / f"whole.{kind}", ROWS)
        write(folder / f"part.{kind}", ROWS - 40_000)
    return folder


def shrunk(path, originals):
    os.truncate(path, path.stat().st_size // 2)


def rewritten(path, originals):
    path.write_bytes((originals / f"part{path.suffix}").read_bytes())


def replaced(path, originals):
    shutil.copy(originals / f"part{path.suffix}", path.with_name("other"))
    path.with_name("other").replace(path)


@pytest.mark.parametrize("change", [shrunk, rewritten, replaced])
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_changes_while_it_is_read_is_said(originals, tmp_path, monkeypatch, kind, change):
    monkeypatch.setattr(readers.blocks, "WHOLE_ROWS", 2**16)
    path = shutil.copy(originals / f"whole.{kind}", tmp_path / f"a.{kind}")
    blocks = readers.read_blocks(path)
    assert len(next(blocks)) < ROWS
    change(path, originals)
    with pytest.raises(ReadError, match=rf"a\.{kind}: (has changed while|cannot be read|says that it has)"):
        list(blocks)


@pytest.mark.parametrize("kind", ["csv", "parquet", "h5"])
def test_a_file_that_changes_between_two_walks_is_said(originals, tmp_path, kind):
    path = shutil.copy(originals / f"whole.{kind}", tmp_path / f"a.{kind}")
    counted = []
    stream = uc.Stream(path, uc.Recipe(("x1", "x2"), ("u1", "u2")), progress=lambda *now: counted.append(now))
    assert sum(len(block.states) for block in stream) == ROWS
    assert counted[-1] == (ROWS, None)
    stream._held = None
    rewritten(path, originals)
    with pytest.raises(ReadError, match=rf"a\.{kind}: has changed since it was first read, from .* to .* bytes"):
        list(stream)


def test_an_array_is_read_by_rows_as_it_is_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(readers.blocks, "WHOLE_ROWS", 2**16)
    table = np.random.default_rng(0).normal(size=(ROWS, 2))
    for kind in ("f8", "f4", ">f8", "i4"):
        np.save(tmp_path / "a.npy", (100 * table).astype(kind))
        [whole] = uc.read(tmp_path / "a.npy")
        blocks = list(readers.read_blocks(tmp_path / "a.npy"))
        assert len(blocks) > 1
        np.testing.assert_array_equal(np.concatenate([block.values for block in blocks]), whole.values)

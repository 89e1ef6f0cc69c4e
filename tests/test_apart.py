"""Reading in a process of its own: it may end, or go on for ever, and the program that asked goes on."""

import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_array_equal

import ends
import unconstrain as uc
from test_cli import environment
from unconstrain.recordings import readers
from unconstrain.recordings.readers import apart as reading
from unconstrain.recordings.readers.apart import apart

FILE = Path(__file__)


def written(path, rows=9):
    states = np.arange(2.0 * rows).reshape(rows, 2)
    with h5py.File(path, "w") as file:
        file["states"], file["actions"] = states, states + 1
    return states


@pytest.mark.parametrize(
    ("read", "said"), [(ends.ends, "ended the process, with -11"), (ends.never_ends, "did not end in")]
)
def test_a_process_that_ends_or_does_not_is_an_error(monkeypatch, read, said):
    monkeypatch.setattr(reading, "PATIENCE", 0.2)
    given = apart(read, FILE)
    process = next(given)
    with pytest.raises(ChildProcessError, match=said):
        next(given)
    [(another, *_)] = apart(ends.rows, FILE, 1)
    assert another not in (process, os.getpid())


def test_time_is_given_by_the_size_of_a_file(monkeypatch, tmp_path):
    (tmp_path / "a").write_bytes(bytes(10**5))
    monkeypatch.setattr(reading, "PATIENCE", 0.1)
    monkeypatch.setattr(reading, "SLOWEST", 1e5)
    begun = time.monotonic()
    with pytest.raises(ChildProcessError, match="did not end in 1 s"):
        list(apart(ends.never_ends, tmp_path / "a"))
    assert time.monotonic() - begun > 1.0


def test_one_process_reads_file_after_file_and_another_where_two_are_read_at_once():
    first, second, both = apart(ends.rows, FILE, 2), apart(ends.rows, FILE, 2), set()
    both |= {next(first)[0], next(second)[0]}
    first.close()
    second.close()
    after = {process for _ in range(3) for process, *_ in apart(ends.rows, FILE, 2)}
    assert len(both) == 2
    assert len(after) == 1
    assert after < both


def test_what_waits_is_replaced_where_it_ended_meanwhile():
    [(process, *_)] = apart(ends.rows, FILE, 1)
    os.kill(process, 9)
    time.sleep(0.2)
    [(another, *_)] = apart(ends.rows, FILE, 1)
    assert another != process


def test_what_a_library_prints_is_no_answer():
    assert len(list(apart(ends.prints, FILE))) == 1
    assert len(list(apart(ends.rows, FILE, 3))) == 3


def test_paths_are_of_where_the_program_is_and_errors_name_them_as_told(tmp_path, monkeypatch):
    for name in "ab":
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        states = written("a.h5", rows=ord(name))
        assert_array_equal(uc.read("a.h5")[0].select(["x1", "x2"]), states)
    Path("a.h5").write_bytes(b"\x89HDF\r\n\x1a\n and no more")
    with pytest.raises(uc.errors.ReadError, match=r"^a\.h5: cannot be read"):
        uc.read("a.h5")


def test_what_was_read_may_be_changed_and_a_file_that_was_left_may_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr(readers.hdf5, "BLOCK_ROWS", 3)
    written(tmp_path / "a.h5")
    blocks = readers.read_blocks(tmp_path / "a.h5")
    next(blocks).values[:] = 0.0
    blocks.close()
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["times"] = np.arange(9) * 0.1
    assert uc.read(tmp_path / "a.h5")[0].times[-1] == pytest.approx(0.8)


def test_nothing_is_imported_from_the_working_folder(tmp_path):
    written(tmp_path / "a.h5")
    (tmp_path / "h5py.py").write_text("open('run', 'w')")
    code = "import unconstrain as uc; print(len(uc.read('a.h5')[0]))"
    told = {"cwd": tmp_path, "env": environment(), "text": True, "stderr": subprocess.STDOUT}
    assert subprocess.check_output([sys.executable, "-c", code], **told) == "9\n"
    assert not (tmp_path / "run").exists()


def test_a_missing_library_is_said(tmp_path):
    written(tmp_path / "a.h5")
    (tmp_path / "missing").mkdir()
    (tmp_path / "missing" / "h5py.py").write_text("raise ImportError")
    code = "import sys; sys.path.insert(0, 'missing'); import unconstrain as uc; uc.read('a.h5')"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False
    )
    assert "MissingExtraError" in done.stderr
    assert "unconstrain[data]" in done.stderr

"""Files are written whole or not at all."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from unconstrain.base import files
from unconstrain.base.errors import ModelFileError, UnconstrainError, WriteError
from unconstrain.evaluation.diagnosis import Place
from unconstrain.recordings.remarks import titled

posix = pytest.mark.skipif(os.name != "posix", reason="permissions and links as on POSIX")


def half(stream):
    stream.write(b"half")
    raise OSError(28, "No space left on device")


def interrupted(*_, **__):
    raise KeyboardInterrupt


@pytest.fixture
def there(tmp_path):
    """A file that is there."""
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")
    return path


def names(folder):
    return [path.name for path in folder.iterdir()]


@pytest.mark.parametrize("data", ["Zoë\n", "Zoë\n".encode(), lambda stream: stream.write("Zoë\n".encode())])
@pytest.mark.parametrize("old", [None, b"old"])
def test_text_bytes_and_writers_are_written(tmp_path, data, old):
    if old is not None:
        (tmp_path / "a.txt").write_bytes(old)
    files.write(tmp_path / "a.txt", data)
    assert (tmp_path / "a.txt").read_bytes() == "Zoë\n".encode()
    assert names(tmp_path) == ["a.txt"]


def test_a_bare_name_is_in_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files.write("a.txt", "new")
    assert (tmp_path / "a.txt").read_text() == "new"


@pytest.mark.parametrize("name", ["x" * 255, "ё" * 127])
def test_the_longest_name_can_be_written(tmp_path, name):
    files.write(tmp_path / name, "new")
    assert names(tmp_path) == [name]


def test_the_old_file_survives_a_writer_that_fails(there):
    with pytest.raises(WriteError) as caught:
        files.write(there, half)
    assert str(caught.value) == f"{there}: cannot be written (No space left on device)."
    assert there.read_bytes() == b"old"
    assert names(there.parent) == ["a.txt"]


def test_an_error_that_is_not_of_the_file_system_passes(there):
    with pytest.raises(ZeroDivisionError):
        files.write(there, lambda stream: stream.write(b"x") / 0)
    assert there.read_bytes() == b"old"
    assert names(there.parent) == ["a.txt"]


@pytest.mark.parametrize(
    ("module", "name"),
    [(files, "_new"), (os, "dup"), (os, "chmod"), (files, "_fill"), (os, "fsync"), (os, "link"), (Path, "replace")],
)
@posix
def test_an_interrupted_write_leaves_the_old_file_and_no_other(there, monkeypatch, module, name):
    if name == "link" and not files._UNNAMED:
        pytest.skip("this system has no files without a name")
    with monkeypatch.context() as patch:
        patch.setattr(module, name, interrupted)
        with pytest.raises(KeyboardInterrupt):
            files.write(there, "new")
    assert there.read_bytes() == b"old"
    assert names(there.parent) == ["a.txt"]


KILLED = """
import sys, time
from unconstrain.base import files

def half(stream):
    stream.write(b"half")
    stream.flush()
    print("writing", flush=True)
    time.sleep(60)

def folder(path):
    with files.workshop(path) as made, open(made / "half", "wb") as stream:
        half(stream)

files._UNNAMED *= sys.argv[2] == "unnamed"
folder(sys.argv[1]) if sys.argv[2] == "folder" else files.write(sys.argv[1], half)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system has no SIGKILL")
@pytest.mark.parametrize("kind", ["unnamed", "named", "folder"])
def test_a_kill_leaves_the_old_file_whole_and_the_next_write_no_other(there, kind):
    environment = os.environ | {"PYTHONPATH": str(Path(files.__file__).parents[2])}
    child = subprocess.Popen([sys.executable, "-c", KILLED, there, kind], stdout=subprocess.PIPE, env=environment)
    with child:
        assert child.stdout.readline() == b"writing\n"
        files.write(there, "old")  # what is being written is no other's to remove
        assert len(names(there.parent)) == 1 + (kind != "unnamed" or not files._UNNAMED)
        child.kill()
    assert child.returncode == -signal.SIGKILL
    assert there.read_bytes() == b"old"
    assert kind != "unnamed" or not files._UNNAMED or names(there.parent) == ["a.txt"]
    files.write(there, "new")
    assert there.read_bytes() == b"new"
    assert names(there.parent) == ["a.txt"]


@pytest.mark.parametrize("unnamed", [True, False])
def test_two_that_write_to_one_place_both_write(there, unnamed, monkeypatch):
    monkeypatch.setattr(files, "_UNNAMED", files._UNNAMED * unnamed)
    files.write(there, lambda stream: files.write(there, "first") or stream.write(b"second"))
    assert there.read_bytes() == b"second"
    assert names(there.parent) == ["a.txt"]


def test_what_is_not_of_a_killed_run_stays(there):
    for name in (".a.txt.part", ".a.txt.0123456789abcdeg.part", ".b.txt.0123456789abcdef.part"):
        (there.parent / name).touch()
    files.write(there, "new")
    assert len(names(there.parent)) == 4


@pytest.mark.parametrize("one_step", [True, False])
def test_a_folder_comes_to_its_place(tmp_path, one_step, monkeypatch):
    if not one_step:
        monkeypatch.setattr(files, "_exchanged", lambda *_: False)
    for content in ("old", "new"):
        with files.workshop(tmp_path / "set") as folder:
            (folder / "made").mkdir()
            (folder / "made" / "a").write_text(content)
            files.put_folder(folder / "made", tmp_path / "set")
        assert (tmp_path / "set" / "a").read_text() == content
        assert names(tmp_path) == ["set"]


@posix
@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        files.write(tmp_path / "a.txt", "new")
        now = os.umask(mask)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == mode
    assert now == mask


@posix
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755, 0o666, 0o400])
def test_an_old_file_keeps_its_permissions(there, mode):
    there.chmod(mode)
    files.write(there, "new")
    assert stat.S_IMODE(there.stat().st_mode) == mode
    assert there.read_bytes() == b"new"


@posix
def test_what_only_its_owner_may_read_is_never_open_to_others(there):
    there.chmod(0o600)

    def look(stream):
        assert stat.S_IMODE(os.fstat(stream.fileno()).st_mode) == 0o600

    files.write(there, look)


@posix
@pytest.mark.parametrize("exists", [True, False])
def test_a_link_keeps_pointing_to_where_it_points(tmp_path, exists):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "a.txt", tmp_path / "link"
    if exists:
        target.write_text("old")
    link.symlink_to(target)
    files.write(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert names(tmp_path / "far") == ["a.txt"]


@posix
def test_a_link_to_itself_is_refused(tmp_path):
    (tmp_path / "link").symlink_to("link")
    with pytest.raises(WriteError, match=r"link: cannot be written \(.*symbolic links"):
        files.write(tmp_path / "link", "new")
    assert names(tmp_path) == ["link"]


@pytest.mark.parametrize(
    ("name", "reason"), [("none/a.txt", "No such file or directory"), ("a.txt/b.txt", "Not a directory")]
)
def test_where_there_is_no_folder_the_place_is_named(there, name, reason):
    with pytest.raises(WriteError) as caught:
        files.write(there.parent / name, "new")
    assert str(caught.value) == f"{there.parent / name}: cannot be written ({reason})."


def test_a_folder_is_not_replaced(tmp_path):
    with pytest.raises(WriteError, match=r"cannot be written \(it is a folder or a device, expected a file\)\."):
        files.write(tmp_path, "new")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_device_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(WriteError, match="it is a folder or a device"):
        files.write(tmp_path / "pipe", "new")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_the_caller_chooses_the_error(tmp_path):
    with pytest.raises(ModelFileError, match="cannot be written"):
        files.write(tmp_path, "new", ModelFileError)


def test_it_is_an_error_of_this_package_and_of_the_system():
    assert issubclass(WriteError, UnconstrainError)
    assert issubclass(WriteError, OSError)


def test_a_recording_is_told_with_its_file_where_it_is_not_called_as_that():
    assert [files.stem(name) for name in ("wipe.csv", "a/wipe.v2.csv.GZ", "wipe.v2.npz")] == [
        "wipe",
        "wipe.v2",
        "wipe.v2",
    ]
    assert titled("wipe.v2", "wipe.v2.csv") == "'wipe.v2'"
    assert titled("wipe", "wipe.v2.csv") == "'wipe' of wipe.v2.csv"
    assert str(Place("wipe.v2", 1, None, "wipe.v2.csv", 4)) == "wipe.v2.csv row 4"

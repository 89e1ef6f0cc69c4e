"""How commands end: one sentence whatever happens, what was made is kept, and names are text."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import unconstrain as uc
from unconstrain import cli

FIT = "unconstrain fit a.csv --model affine --learner direct -o p.npz"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A recording, in the working folder."""
    monkeypatch.chdir(tmp_path)
    record("a.csv")
    return tmp_path


def record(name, head="t,x,y,vx,vy", demo=None):
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (20, 2))
    rows = np.column_stack([0.1 * np.arange(20), states, -states])
    tail = "" if demo is None else f",{demo}"
    lines = [head + ("" if demo is None else ",demo"), *(",".join(map(str, row)) + tail for row in rows)]
    Path(name).write_text("\n".join(lines) + "\n")


def shell(command, **more):
    line = f'unconstrain() {{ "{sys.executable}" -m unconstrain "$@"; }}; set -o pipefail; {command}'
    environment = os.environ | {"PYTHONPATH": str(Path(uc.__file__).parents[1])} | more
    return subprocess.run(["bash", "-c", line], capture_output=True, env=environment, check=False, timeout=60)


def call(*args):
    return CliRunner().invoke(cli.main, args, prog_name="unconstrain")


@pytest.mark.parametrize(
    ("how", "code", "said"),
    [
        ("{} | head -c 1", 0, ""),
        ("{} > /dev/full", 2, "Error: standard output: cannot be written (No space left on device).\n"),
        ("{} >&-", 2, "Error: standard output: cannot be written (Bad file descriptor).\n"),
        (
            "{} >&- 2>&- <&-",
            2,
            "",
        ),  # the next file that is opened would get a closed stream's number, and be printed to
        ("{} > /dev/null 2> /dev/full", 0, ""),
    ],
)
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_what_cannot_be_printed_costs_no_file(folder, how, code, said):
    ran = shell(how.format(FIT))
    errors = [line for line in ran.stderr.decode().splitlines(keepends=True) if not line.startswith("Note: ")]
    assert (ran.returncode, "".join(errors)) == (code, said)
    assert uc.load(folder / "p.npz").predict(np.zeros((1, 2))).shape == (1, 2)


RAISED = [
    (MemoryError("Unable to allocate 9. GiB"), 2, "not enough memory (Unable to allocate 9. GiB). Take fewer columns"),
    (RecursionError("maximum recursion depth exceeded"), 2, "something that was read is nested too deeply."),
    (KeyboardInterrupt(), 130, "interrupted."),
    (OSError(errno.ENOSPC, "No space left on device", "/x"), 2, "/x: No space left on device."),
    (BrokenPipeError(errno.EPIPE, "Broken pipe"), 2, "[Errno 32] Broken pipe"),
    (ZeroDivisionError("as told"), 1, "a fault of unconstrain, not of your data: ZeroDivisionError: as told ("),
]


@pytest.mark.parametrize(("error", "code", "said"), RAISED, ids=[type(one[0]).__name__ for one in RAISED])
@pytest.mark.parametrize("command", ["fit", "constraint", "diagnose"])
def test_whatever_happens_is_said_in_one_sentence(folder, monkeypatch, command, error, code, said):
    def fail(*_, **__):
        raise error

    for name in ("read", "Stream"):
        monkeypatch.setattr(uc, name, fail, raising=False)
    Path("old.npz").write_text("old")
    output = ("--report", "old.npz") if command == "diagnose" else ("-o", "old.npz")
    ran = call(command, "a.csv", *output, "--force")
    assert (ran.exit_code, ran.stdout) == (code, "")
    assert ran.stderr.startswith(f"Error: {said}")
    assert len(ran.stderr.splitlines()) == 1
    assert Path("old.npz").read_text() == "old"


def test_a_fault_says_how_to_report_it(folder, monkeypatch):
    monkeypatch.setattr(uc, "load", lambda _: 1 / 0)
    told = call("export", "p.npz", "-o", "p.c").stderr
    assert "Please report it to the authors with the command and what it prints with UNCONSTRAIN_TRACEBACK=1" in told
    monkeypatch.setenv("UNCONSTRAIN_TRACEBACK", "1")
    assert "Traceback (most recent call last)" in call("export", "p.npz", "-o", "p.c").stderr


HOSTILE = ["[/x]", "[bold]x", ":smile:", "\x1b[2Jx", "\x1b]0;title\x07x", "x\x9b31m", "x\x08\x08y", "x\u202ey"]


def is_plain(said):
    return not any(
        ord(letter) < 32 or 127 <= ord(letter) < 160 or letter == "\u202e" for letter in said if letter != "\n"
    )


@pytest.mark.parametrize("name", HOSTILE, ids=ascii)
def test_names_from_files_are_text(folder, name):
    record("b.csv", head=f"t,x,y,v{name},vy", demo=name)
    for command in (
        ("inspect", "b.csv"),
        ("fit", "b.csv", "--state", "x,y", "--action", f"v{name},vy", "--model", "affine", "-o", "p.npz"),
        ("score", "p.npz", "b.csv"),
        ("rollout", "p.npz", "--start", "0,0", "--steps", "2"),
        ("inspect", f"{name}.csv"),
        ("inspect", "b.csv", "--state", name),
    ):
        ran = call(*command)
        assert ran.exit_code in (0, 2)
        assert ran.stdout or ran.stderr
        assert is_plain(ran.stdout + ran.stderr), ran.output
    shown = call("inspect", "b.csv").stdout
    assert (name if is_plain(name) else "\\x" if name.isascii() or "\x9b" in name else "\\u202e") in shown


@pytest.mark.skipif(sys.platform != "linux", reason="names are bytes on Linux")
def test_names_that_are_no_utf_8_are_shown(folder):
    bad, policy = os.fsdecode(b"bad\xff.csv"), os.fsdecode(b"p\xff.npz")
    Path("a.csv").rename(bad)
    for command in (
        ("fit", bad, "--model", "affine", "--learner", "direct", "-o", policy, "--report", "r.html"),
        ("export", policy, "-o", os.fsdecode(b"\xff.c")),
        ("convert", bad, "all.parquet"),
        ("inspect", "all.parquet"),
        ("score", policy, bad),
    ):
        ran = call(*command)
        assert ran.exit_code == 0, ran.stderr
    assert "bad\\udcff" in ran.stdout
    ran = shell("unconstrain inspect bad*.csv", LC_ALL="C", PYTHONCOERCECLOCALE="0", PYTHONUTF8="0")
    assert (ran.returncode, ran.stdout.count(b"bad\\udcff") > 0) == (0, True), ran.stderr

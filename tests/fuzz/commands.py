"""Command lines with hostile names, whose output is closed, full or broken."""

import contextlib
import io
import os
import signal
import subprocess
import sys
import traceback
from pathlib import Path

import unconstrain as uc
from unconstrain import cli

from .attack import taught
from .kills import content_of

NAMES = (
    *("[/x]", "[bold]", "\x1b[2J", "a\nb", "\u202egnp", "é\udcff", "--help", "%s%n{0}", "<script>", " ", "\u2028"),
    "a" * 90,
)
OUTPUTS = ("kept", "full", "closed", "broken", "ascii")


def commands(rng, folder):
    before = Path.cwd()
    os.chdir(folder)
    try:
        return asked(rng)
    finally:
        os.chdir(before)


def asked(rng):
    word, state = rng.choice(NAMES), "x"
    name = word.replace("/", "\\")
    if rng.randrange(2):
        state = word.replace("\n", " ").replace(",", "")
    rows = "".join(f'"{word}",{0.1 * at},{at % 7},{at % 5},1,{at % 3}\n' for at in range(30))
    file = rng.choice(("a.csv", f"./{name}.csv"))
    Path(file).write_bytes(os.fsencode(f"demo,t,{state},y,vx,vy\n{rows}"))
    uc.save(taught(), "p.npz")
    before = content_of(Path("p.npz"))
    line, way = rng.choice(lines(file, name)), rng.choice(OUTPUTS)
    code = (in_a_process if rng.randrange(10) == 0 else here)(line, way)
    said, out = (Path(name).read_text("utf-8", "replace") for name in ("err", "out"))
    if "Traceback" in said or "a fault of unconstrain" in said or code not in (0, 2):
        return f"{line} {way}: {code} {said[-300:]}"
    if "\x1b[" in said or "\x1b[" in out:
        return f"{line} {way}: control sequences on the terminal"
    return None if content_of(Path("p.npz")) == before else f"{line} {way}: its input is another now"


def lines(file, name):
    return (
        ["inspect", file], ["fit", file, "-o", "q.npz", "--report", "q.html", "--model", "affine"], ["info", "p.npz"],
        ["score", "p.npz", file], ["rollout", "p.npz", "--start", "1,0"], ["export", "p.npz", "-o", f"./{name}.c"],
        ["diagnose", file, "--model", "affine"], ["convert", file, "-o", "c.parquet"], ["fit", file, "-o", "p.npz"],
        ["inspect", f"./{name}"], ["score", file, file], ["constraint", file, "-o", "k.npz"], ["doctor", "--json"],
        ["example", f"./{name}"], ["look", file, "-o", f"./{name}.html", "--rrd", f"./{name}.rrd"],
        ["rollout", "p.npz", "--start", "1,0", "--obstacle", "0.5,0,0.2", "-o", f"./{name}.txt"],
        ["rollout", "p.npz", "--start", "1,0", "--obstacle", name], ["rollout", "p.npz", "--constraint", f"./{name}"],
        ["rollout", "p.npz", "--start", "1,0", "--constraint", "p.npz"], ["export", "p.npz", "-o", "p.js", "--json"],
        ["export", "p.npz", "--ros2", f"./{name}", "--name", name], ["score", "p.npz", file, "--constraint", file],
    )  # fmt: skip


def outputs(way):
    """Descriptors for what is printed and for what is complained."""
    err, out = (os.open(name, os.O_CREAT | os.O_WRONLY) for name in ("err", "out"))
    if way == "full":
        os.close(out)
        out = os.open("/dev/full", os.O_WRONLY)
    if way == "broken":
        os.close(out)
        read_end, out = os.pipe()
        os.close(read_end)
    return out, err


def in_a_process(line, way):
    """The exit code of a command line as users run it."""
    out, err = outputs(way)
    closed = (lambda: os.close(1)) if way == "closed" else None
    coding = {"PYTHONIOENCODING": "ascii:strict"} if way == "ascii" else {}
    words = [os.fsencode(word) for word in line]
    asked = [sys.executable, "-m", "unconstrain", *words]
    try:
        return subprocess.run(asked, stdout=out, stderr=err, env=os.environ | coding, preexec_fn=closed).returncode
    finally:
        os.close(out)
        os.close(err)


def here(line, way):
    """The exit code of a command line that is run in this process."""
    code = 99
    with printing(way):
        try:
            cli.main(line, prog_name="unconstrain")
        except SystemExit as end:
            code = end.code or 0
        except BaseException:  # noqa: BLE001
            traceback.print_exc()
    return code


@contextlib.contextmanager
def printing(way):
    """Printing where it is told, and as before afterwards."""
    kept, streams = [os.dup(1), os.dup(2)], (sys.stdout, sys.stderr)
    handled = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    for at, opened in enumerate(outputs(way), start=1):
        os.dup2(opened, at)
        os.close(opened)
    coding = "ascii" if way == "ascii" else "utf-8"
    sys.stdout = io.TextIOWrapper(open(1, "wb", closefd=False), encoding=coding)  # noqa: SIM115
    sys.stderr = io.TextIOWrapper(open(2, "wb", buffering=0, closefd=False), write_through=True)  # noqa: SIM115
    if way == "closed":
        os.close(1)
        sys.stdout = None
    try:
        yield
    finally:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.stdout.flush()
        sys.stdout, sys.stderr = streams
        for at, before in enumerate(kept, start=1):
            os.dup2(before, at)
            os.close(before)
        signal.signal(signal.SIGPIPE, handled)

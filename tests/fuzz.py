"""Attacks on what docs/reliability promises: damaged files, odd data, kills, full disks, names that are hostile.

``python tests/fuzz.py`` goes on for a minute, ``--seconds S`` for as long as that, and ``--long`` until each attack was
tried as often as its row of the table wants, with ``--only NAME ...`` for some of them. Trial number N of an attack is
made from its seed alone, in a process of its own that is given ten seconds and some memory: ``--trial NAME N`` runs it
again, here. The exit code is 1 if there was a fault.
"""

import argparse
import hashlib
import io
import json
import logging
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import threading
import time
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import foreign
import unconstrain as uc
from unconstrain.paper.experiments.journal import Journal
from unconstrain.paper.systems.arm import Arm
from unconstrain.recordings import preparation, readers
from unconstrain.recordings.writers import write_recordings

HANG_S = 10.0
"""Seconds of a processor after which a trial counts as a hang; of a clock, twelve times as many."""

MEMORY = 12 * 2**30
"""Bytes of address space that a trial is given; what it wants beyond is a MemoryError."""

ODD = (0, 1, -1, 2, 127, 255, 2**15, 2**31 - 1, -(2**31), 2**32 - 1, 2**62, -(2**63))
WORDS = (
    "nan",
    "inf",
    "-1",
    "1e999",
    "",
    "0",
    "null",
    "NaN",
    '"',
    "[",
    "{",
    "\x00",
    "é",
    "\x1b[31m",
    "1e-320",
    "9" * 400,
)


class Attack(NamedTuple):
    """``attempt(rng, folder)`` gives None, or the words of a fault; ``wanted`` trials make a row of the table."""

    name: str
    attempt: Callable
    wanted: int
    prepare: Callable = lambda folder: None


# Files


def damaged(content, rng):
    """Bytes changed, left out, doubled or cut, and numbers in them made odd."""
    harmed = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at, length = (int(rng.integers(0, max(len(harmed), 1))) for _ in range(2))
        length = min(length, int(rng.choice([1, 4, 8, 64, 4096])))
        match rng.integers(7):
            case 0:
                harmed[at : at + 1] = rng.bytes(1)
            case 1:
                del harmed[at : at + length]
            case 2:
                harmed[at:at] = harmed[at : at + length]
            case 3:
                width = int(rng.choice([1, 2, 4, 8]))
                odd = int(rng.choice(ODD)) % 2 ** (8 * width)
                harmed[at : at + width] = odd.to_bytes(width, str(rng.choice(["little", "big"])))
            case 4:
                del harmed[at:]
            case 5:
                harmed[at : at + length] = bytes(length)
            case 6:
                harmed[at : at + int(rng.integers(0, 8))] = str(rng.choice(WORDS)).encode()
    return bytes(harmed)


def repacked(content, rng):
    """An archive with one of its members damaged, and sums of it that agree."""
    packed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        chosen = int(rng.integers(len(names)))
        for at, name in enumerate(names):
            inside = old.read(name)
            new.writestr(name, damaged(inside, rng) if at == chosen else inside)
    return packed.getvalue()


def made(kind, folder):
    """A small file of some kind."""
    from test_formats import workbook

    path = folder / f"a.{kind}"
    states, actions = foreign.STATES, foreign.ACTIONS
    if kind == "npz":
        np.savez(path, states=states, actions=actions, times=foreign.STEPS * 0.1, groups=foreign.STEPS // 10)
    elif kind == "npy":
        np.save(path, states)
    elif kind == "hdf5":
        foreign.robomimic(path)
    elif kind == "mat":
        import scipy.io

        scipy.io.savemat(path, foreign.lasa([(states, foreign.STEPS)] * 2), do_compression=False)
    elif kind == "json":
        path.write_text(json.dumps([{"t": 0.1 * at, "x": row.tolist()} for at, row in enumerate(states)]))
    elif kind == "xlsx":
        workbook(path, one=[["t", "x"], *states[:, :2].tolist()])
    elif kind == "c3d":
        motion_capture(path)
    elif kind in ("bag", "mcap", "db3"):
        written = foreign.bag(folder / f"recorded-{kind}", kind)
        shutil.copy(written if written.is_file() else next(written.glob(f"*.{kind}")), path)
    elif kind == "urdf":
        from test_arm import URDF

        path.write_text(URDF)
    elif kind == "journal":
        journal(path).begin()
        journal(path).add(0, [1.0, {"a": 2}])
    elif kind == "model":
        uc.save(taught(), path)
    else:
        columns = ("x", "y", "z", "vx", "vy", "vz")
        several = [uc.Recording(columns, np.hstack([states, actions]), foreign.STEPS * 0.1, name) for name in "ab"]
        write_recordings(several, path)
    return path.read_bytes()


def motion_capture(path):
    import ezc3d

    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["LABELS"]["value"] = ["hand", "tool"]
    content["data"]["points"] = np.ones((4, 2, 30))
    content.write(str(path))


def journal(path):
    return Journal(path, uc.Folds())


def taught(model=None):
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (60, 2))
    return (model or uc.LocallyLinearPolicy()).fit(states, -states, groups=np.arange(60) // 10)


USES = {
    "urdf": lambda path: Arm.from_urdf(path, "hook"),
    "journal": lambda path: journal(path).begin(),
    "model": lambda path: uc.load(path).predict(np.zeros((1, 2))),
}
"""What is done with files that are no recordings."""


def read(path):
    recordings = uc.read(path, topic="joint_states" if path.suffix in (".bag", ".mcap", ".db3") else None)
    preparation.survey_set(recordings)
    recipe, _ = preparation.decide(uc.Recipe(), recordings[0])
    uc.prepare(recordings, recipe)
    list(readers.read_blocks(path))


def of_files(kind):
    whole = {}

    def prepare(folder):
        whole["content"] = made(kind, folder)

    def attempt(rng, folder):
        content, path = whole["content"], folder / f"b.{kind}"
        packed = kind in ("npz", "xlsx", "model") and rng.integers(2)
        path.write_bytes(repacked(content, rng) if packed else damaged(content, rng))
        USES.get(kind, read)(path)

    return Attack(f"file {kind}", attempt, 200_000, prepare)


# Learning


def odd_table(rng, rows, columns, plain):
    """Numbers as they come, and as they should not."""
    table = rng.normal(size=(rows, columns)) * 10.0 ** rng.integers(-3, 4)
    if plain:
        return table
    for _ in range(rng.integers(0, 3)):
        some = rng.random(table.shape) < rng.choice([0.02, 0.5, 1.0])
        match rng.integers(6):
            case 0:
                table[some] = 0.0
            case 1:
                table *= 10.0 ** rng.integers(-29, 29)
            case 2:
                table[:, rng.integers(columns)] = rng.normal()
            case 3:
                table[some] = rng.choice([np.nan, np.inf, 1e30, -1e30, 1e-300, 5e-324])
            case 4:
                table = table[rng.integers(0, rows, rows)]
            case 5:
                table = np.round(table)
    return table


LEARNERS = (uc.Direct, uc.Inconsistency, uc.Hybrid, uc.Robust, uc.NoiseCorrected, uc.Segments, uc.Likelihood)


def learning(rng, folder):
    rows, n, d = int(rng.integers(1, 60)), int(rng.integers(1, 5)), int(rng.integers(1, 5))
    plain = rng.random() < 0.3
    states, actions = odd_table(rng, rows, n, plain), odd_table(rng, rows, d, plain)
    weights = None if rng.integers(3) else rng.choice([0.0, 1.0, 1e-310, 1e300], rows)
    groups = None if rng.integers(3) == 0 else rng.integers(0, rng.integers(1, 8), rows)
    learner = LEARNERS[rng.integers(len(LEARNERS))]()
    features = (uc.Affine(), uc.Polynomial(2), uc.KMeansRBF(5))[rng.integers(3)]
    policy = uc.LocallyLinearPolicy(learner=learner) if rng.integers(2) else uc.ParametricPolicy(features, learner)
    if isinstance(learner, uc.Segments) and rng.integers(2):
        policy.learner = uc.Segments("groups")
    policy.fit(states, actions, weights, groups)
    if rng.integers(4) == 0:
        policy.partial_fit(odd_table(rng, rows, n, plain), odd_table(rng, rows, d, plain), None, groups)
    found = policy.predict(states)
    return None if np.isfinite(found).all() else f"{policy} predicts what is not finite"


# Models whose digest was mended


def mended(header, arrays):
    said = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        said.update(f"{name}{array.dtype.str}{array.shape}".encode() + array.tobytes())
    return said.hexdigest()


def places(value, at=()):
    """Where in a header something may be put."""
    yield at
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inside in inner:
        yield from places(inside, (*at, key))


def tampered_array(array, rng):
    match rng.integers(6):
        case 0:
            return array[:0]
        case 1:
            return array.astype(str)
        case 2:
            return array.reshape(-1)
        case 3:
            return np.full(array.shape, np.nan)
        case 4:
            return np.concatenate([array, array]) if array.ndim else array[None]
    return array.astype(np.int8, casting="unsafe") if array.dtype.kind in "fiu" else np.zeros(3)


ODD_VALUES = (None, True, 0, -1, 2**70, 1e308, "word", [], {}, {"list": []}, {"array": "array0"}, {"array": "none"})
MODELS = (
    lambda: taught(),
    lambda: taught(uc.ParametricPolicy(uc.KMeansRBF(4), "hybrid")),
    lambda: taught(uc.LocallyLinearPolicy(scale="auto", learner="robust")),
    lambda: taught(uc.LocallyLinearPolicy(space=uc.spaces.Circle() * uc.spaces.Circle())),
)


def of_tampering():
    models = []

    def prepare(folder):
        for at, make in enumerate(MODELS):
            uc.save(make(), folder / f"{at}.npz")
            models.append((folder / f"{at}.npz").read_bytes())

    def attempt(rng, folder):
        with np.load(io.BytesIO(models[rng.integers(len(models))]), allow_pickle=False) as file:
            arrays = dict(file)
        header = json.loads(str(arrays.pop("header")))
        header.pop("digest")
        for _ in range(rng.integers(1, 3)):
            tamper(header["content"], arrays, rng)
        np.savez(folder / "b.npz", header=np.array(json.dumps({**header, "digest": mended(header, arrays)})), **arrays)
        policy = uc.load(folder / "b.npz")
        uc.storage.load_notes(folder / "b.npz")
        if not hasattr(policy, "solution_"):  # it has learnt nothing, and says so
            return None
        columns = policy.n_features_in_
        found = policy.predict(np.zeros((3, columns))), policy.step(np.ones(columns)), repr(policy)
        policy.export_c(folder / "b.c")
        return None if all(len(one) for one in found) else "it predicts nothing"

    return Attack("tampered models", attempt, 5_000, prepare)


def tamper(content, arrays, rng):
    """One value of a header, or one array, made another."""
    if rng.integers(2) and arrays:
        name = sorted(arrays)[rng.integers(len(arrays))]
        arrays[name] = tampered_array(arrays[name], rng)
        return
    found = [at for at in places(content) if at and at[0] == "policy" and len(at) > 1]
    *way, last = found[rng.integers(len(found))]
    inside = content
    for key in way:
        inside = inside[key]
    if rng.integers(4) == 0 and isinstance(inside, dict):
        del inside[last]
    else:
        inside[last] = ODD_VALUES[rng.integers(len(ODD_VALUES))]


# Kills


def of_kills():
    known = {}

    def prepare(folder):
        known["policies"] = [taught(), taught(uc.ParametricPolicy(uc.Affine()))]
        for policy in known["policies"]:
            policy.export_c(folder / "c.c")  # what is prepared once is not what is killed

    def attempt(rng, folder):
        writers = {
            "a.npz": lambda path, one: uc.save(one, path),
            "a.c": lambda path, one: one.export_c(path),
            "a.csv": lambda path, one: write_recordings([moved(one)], path),
            "a.parquet": lambda path, one: write_recordings([moved(one)], path),
            "data": lambda path, one: write_recordings([moved(one)], path),
        }
        name = list(writers)[rng.integers(len(writers))]
        path, write = folder / name, writers[name]
        contents = []
        for policy in known["policies"]:
            write(path, policy)
            contents.append(content_of(path))
        child = os.fork()
        if child == 0:
            while True:
                for policy in known["policies"]:
                    write(path, policy)
        time.sleep(float(rng.uniform(0.0, 0.06)))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        if content_of(path) not in contents:
            return f"{name}: torn or lost"
        write(path, known["policies"][0])
        left = [each.name for each in folder.iterdir() if each.name != name]
        return f"{name}: litter {left}" if left else None

    return Attack("kills", attempt, 1_000, prepare)


def moved(policy):
    values = policy.predict(foreign.STATES[:, :2])
    return uc.Recording(("x", "y"), values, foreign.STEPS * 0.1, "a")


def content_of(path):
    """What a file or the files of a folder hold; of archives what is in them, since they name the time."""
    if path.is_dir():
        return {str(each.relative_to(path)): content_of(each) for each in sorted(path.rglob("*")) if each.is_file()}
    if path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    return path.read_bytes() if path.exists() else None


# Commands

NAMES = (
    "[/x]",
    "[bold]",
    "\x1b[2J",
    "a\nb",
    "\u202egnp",
    "é\udcff",
    "--help",
    "%s%n{0}",
    "<script>",
    "a" * 90,
    " ",
    "\u2028",
)
OUTPUTS = ("kept", "full", "closed", "broken", "ascii")


def commands(rng, folder):
    os.chdir(folder)
    word, state = NAMES[rng.integers(len(NAMES))], "x"
    name = word.replace("/", "\\")
    if rng.integers(2):
        state = word.replace("\n", " ").replace(",", "")
    rows = "".join(f'"{word}",{0.1 * at},{at % 7},{at % 5},1,{at % 3}\n' for at in range(30))
    file = ("a.csv", f"./{name}.csv")[rng.integers(2)]
    Path(file).write_bytes(os.fsencode(f"demo,t,{state},y,vx,vy\n{rows}"))
    uc.save(taught(), "p.npz")
    lines = (
        ["inspect", file], ["fit", file, "-o", "q.npz", "--report", "q.html", "--model", "affine"], ["info", "p.npz"],
        ["score", "p.npz", file], ["rollout", "p.npz", "--start", "1,0"], ["export", "p.npz", "-o", f"./{name}.c"],
        ["diagnose", file, "--model", "affine"], ["convert", file, "-o", "c.parquet"], ["fit", file, "-o", "p.npz"],
        ["inspect", f"./{name}"], ["score", file, file], ["constraint", file, "-o", "k.npz"], ["doctor", "--json"],
    )  # fmt: skip
    line, way = lines[rng.integers(len(lines))], OUTPUTS[rng.integers(len(OUTPUTS))]
    before = content_of(Path("p.npz"))
    child = os.fork()
    if child == 0:
        command(line, way)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    said = Path("err").read_text("utf-8", "replace")
    if "Traceback" in said or "a fault of unconstrain" in said or code not in (0, 2):
        return f"{line} {way}: {code} {said[-300:]}"
    if "\x1b[" in said or "\x1b[" in Path("out").read_text("utf-8", "replace"):
        return f"{line} {way}: control sequences on the terminal"
    return None if content_of(Path("p.npz")) == before else f"{line} {way}: its input is another now"


def command(line, way):
    """Run a command line in this process, printing where it is told, and end the process."""
    from unconstrain import cli

    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    err, out = (os.open(name, os.O_CREAT | os.O_WRONLY) for name in ("err", "out"))
    os.dup2(err, 2)
    if way == "full":
        out = os.open("/dev/full", os.O_WRONLY)
    if way == "broken":
        read_end, out = os.pipe()
        os.close(read_end)
    os.dup2(out, 1)
    coding = "ascii" if way == "ascii" else "utf-8"
    sys.stdout = io.TextIOWrapper(open(1, "wb", closefd=False), encoding=coding)  # noqa: SIM115
    sys.stderr = io.TextIOWrapper(open(2, "wb", buffering=0, closefd=False), write_through=True)  # noqa: SIM115
    if way == "closed":
        os.close(1)
        sys.stdout = None
    code = 99
    try:
        cli.main(line, prog_name="unconstrain")
    except SystemExit as end:
        code = end.code or 0
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
    os._exit(code)


# Streams that change


def streams(rng, folder):
    kind = ("csv", "parquet", "npy", "hdf5")[rng.integers(4)]
    rows = int(rng.integers(140_000, 260_000))
    path = folder / f"a.{kind}"
    table = np.column_stack([np.arange(rows), np.ones((rows, 3))]) * 1e-3

    def write(count):
        if kind == "csv":
            text = b"".join(b"%.3f,0.001,0.001,0.001\n" % each for each in table[:count, 0])
            path.write_bytes(b"x1,x2,u1,u2\n" + text)
        elif kind == "npy":
            np.save(path, table[:count])
        elif kind == "parquet":
            import pyarrow as pa
            import pyarrow.parquet as pq

            columns = dict(zip(("x1", "x2", "u1", "u2"), table[:count].T, strict=True))
            pq.write_table(pa.table(columns), path, row_group_size=int(rng.choice([20_000, 200_000])))
        else:
            import h5py

            with h5py.File(folder / "made", "w") as file:
                file["states"], file["actions"] = table[:count, :2], table[:count, 2:]
            path.write_bytes((folder / "made").read_bytes())

    write(rows)
    second = bool(rng.integers(2))
    stream = uc.Stream(path, uc.Recipe(("x1", "x2"), ("u1", "u2"))) if kind != "npy" else None
    walked = (len(block.states) for block in stream) if stream else (len(block) for block in readers.read_blocks(path))
    if second and stream:
        sum(walked)
        walked = (len(block.states) for block in stream)
        got = 0
    else:
        got = next(walked)
    match rng.integers(3):
        case 0:
            os.truncate(path, int(rng.integers(0, path.stat().st_size)))
        case 1:
            write(rows - int(rng.integers(1, 100_000)))
        case 2:
            shutil.copy(path, folder / "other")
            os.truncate(folder / "other", int(rng.integers(0, path.stat().st_size)))
            (folder / "other").replace(path)
    got += sum(walked)
    return None if got == rows else f"{kind}: {got} of {rows} rows, without a word"


FILES = ("npz", "npy", "hdf5", "parquet", "mat", "csv", "json", "xlsx", "c3d", "bag", "mcap", "db3", "urdf", "journal")
ATTACKS = (
    *map(of_files, (*FILES, "model")),
    Attack("learning", learning, 50_000),
    of_tampering(),
    of_kills(),
    Attack("commands", commands, 1_000),
    Attack("streams", streams, 100),
)


# Trials


def trial(attack, number, folder):
    """None, or the words of a fault."""
    rng = np.random.default_rng([[one.name for one in ATTACKS].index(attack.name), number])
    inside = Path(tempfile.mkdtemp(dir=folder))
    before = Path.cwd()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return attack.attempt(rng, inside)
    except uc.UnconstrainError:
        return None
    except Exception as error:  # noqa: BLE001 - what is looked for
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:100]} ({Path(place.filename).name}:{place.lineno})"
    finally:
        os.chdir(before)
        shutil.rmtree(inside, ignore_errors=True)


def child(attack, first, step, folder, line):
    """Try one number after the other, and tell."""
    logging.disable()  # of the libraries that are given damaged files
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    number = first
    while True:
        line.send((number, trial(attack, number, folder)))
        number += step


class Tally:
    """What came of an attack."""

    def __init__(self):
        self.tried, self.faults, self.hangs, self.crashes = 0, Counter(), 0, 0
        self.examples = {}

    def add(self, number, said):
        self.tried += 1
        if said is not None:
            self.faults[said[:160]] += 1
            self.examples.setdefault(said[:160], number)

    @property
    def is_clean(self):
        return not (self.faults or self.hangs or self.crashes)


def is_heard(line, process):
    """Whether there is word before the process has worked for so many seconds, or waited twelve times as long."""
    before, until = worked(process), time.monotonic() + 12 * HANG_S
    while not line.poll(1.0):
        if worked(process) - before > HANG_S or time.monotonic() > until:
            return False
    return True


def worked(process):
    """Seconds of a processor that a process has used."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def watch(attack, folder, until, wanted, lane, lanes, tally):
    """Let a process try, and begin another one where it hangs or ends."""
    context, number = multiprocessing.get_context("fork"), lane
    while time.monotonic() < until and tally.tried < wanted:
        mine, theirs = context.Pipe()
        worker = context.Process(target=child, args=(attack, number, lanes, folder, theirs), daemon=False)
        worker.start()
        theirs.close()
        while time.monotonic() < until and tally.tried < wanted:
            try:
                alive = is_heard(mine, worker.pid)
                number, said = mine.recv() if alive else (number, None)
            except EOFError:
                tally.crashes += 1
                tally.add(number, f"ended the process with {worker.exitcode}")
                number += lanes
                break
            if not alive:
                tally.hangs += 1
                tally.add(number, "did not end")
                number += lanes
                break
            tally.add(number, said)
            number += lanes
        worker.kill()
        worker.join()


def run(attack, seconds, wanted, lanes=1):
    """Try an attack for some time, or so often."""
    folder, tally = Path(tempfile.mkdtemp(prefix="fuzz-")), Tally()
    try:
        attack.prepare(folder)
        until = time.monotonic() + seconds
        lane_of = [(attack, folder, until, wanted, lane, lanes, tally) for lane in range(lanes)]
        threads = [threading.Thread(target=watch, args=args) for args in lane_of]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return tally


def main():
    asked = argparse.ArgumentParser(description="Attack what is promised, and print what came of it.")
    asked.add_argument("--long", action="store_true", help="until each attack was tried as often as it should be")
    asked.add_argument("--seconds", type=float, help="in all; 60 by default, without end with --long")
    asked.add_argument("--only", nargs="+", default=[""], help="attacks whose names begin so")
    asked.add_argument("--lanes", type=int, default=len(os.sched_getaffinity(0)), help="processes side by side")
    asked.add_argument("--trial", nargs=2, metavar=("NAME", "N"), help="one trial again, in this process")
    told = asked.parse_args()
    if told.trial:
        attack = next(one for one in ATTACKS if one.name == told.trial[0])
        folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
        attack.prepare(folder)
        print(trial(attack, int(told.trial[1]), folder))
        return 0
    chosen = [attack for attack in ATTACKS if attack.name.startswith(tuple(told.only))]
    seconds = told.seconds if told.seconds is not None else np.inf if told.long else 60.0
    print(f"{'attack':<18}{'tried':>9}{'wanted':>9}{'faults':>8}{'hangs':>7}{'crashes':>9}")
    clean = True
    for attack in chosen:
        tally = run(attack, seconds / len(chosen), attack.wanted if told.long else np.inf, told.lanes)
        figures = tally.tried, attack.wanted, sum(tally.faults.values()), tally.hangs, tally.crashes
        print("{:<18}{:>9}{:>9}{:>8}{:>7}{:>9}".format(attack.name, *figures), flush=True)
        for said, count in tally.faults.most_common(8):
            print(f"    {count} x {said}  (--trial '{attack.name}' {tally.examples[said]})", flush=True)
        clean &= tally.is_clean
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())

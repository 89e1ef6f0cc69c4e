"""Many trials, in processes that are watched."""

import gc
import hashlib
import json
import logging
import multiprocessing
import os
import resource
import shutil
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from itertools import count
from multiprocessing.connection import wait
from pathlib import Path

from .attack import trial

HANG_S = 10.0
"""Seconds of a processor after which a trial counts as a hang; of waiting, twelve times as many."""

MEMORY = 4 * 2**30
"""Bytes of address space that a process is given; what it wants beyond is a MemoryError."""

REPLACED = 20_000
"""Trials after which another process goes on: libraries lose a little memory with each damaged file."""

TRACED = 1000
"""Trials of which is noted which files of the project they enter."""

KEPT_S = 20.0
"""Seconds after which a tally is written again."""

APART = "src/unconstrain/recordings/readers/apart.py"
ROOT = Path(__file__).resolve().parents[2]
CONTEXT = multiprocessing.get_context("fork")
HANG, CRASH = "did not end", "ended the process"


@dataclass
class Tally:
    """What came of an attack, and of which code: the files that it entered, with their digests."""

    tried: int = 0
    seconds: float = 0.0
    faults: dict[str, int] = field(default_factory=dict)
    examples: dict[str, int] = field(default_factory=dict)
    code: dict[str, str] = field(default_factory=dict)

    def add(self, number, said):
        self.faults[said[:200]] = self.faults.get(said[:200], 0) + 1
        self.examples.setdefault(said[:200], number)

    def count(self, begin):
        return sum(count for said, count in self.faults.items() if said.startswith(begin))

    @classmethod
    def kept(cls, path):
        """The tally of earlier runs, if the code that they entered is still what it was."""
        found = cls(**json.loads(path.read_text())) if path.exists() else cls()
        return found if found.code and found.code == digests(found.code) else cls()

    def keep(self, path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self), indent=1))


def digests(files):
    """Files of the project with what they are now."""
    ours = [file for file in files if (ROOT / file).is_file()]
    return {file: hashlib.sha256((ROOT / file).read_bytes()).hexdigest() for file in ours}


class Worker:
    """A process that tries the numbers that it is given."""

    def __init__(self, attack, folder):
        self.attack, self.folder, self.numbers, self.given = attack, folder, range(0), 0
        self.at = CONTEXT.RawValue("q")
        self.line, theirs = CONTEXT.Pipe()
        self.process = CONTEXT.Process(target=_work, args=(attack, folder, theirs, self.at), daemon=True)
        self.process.start()
        theirs.close()

    def give(self, numbers):
        self.numbers, self.given, self.at.value = numbers, self.given + len(numbers), numbers.start
        self.line.send(numbers)
        self._notice()

    def heard(self, tally):
        """Count what it has to tell; the worker that goes on is another one where this one hangs or has ended."""
        try:
            while self.line.poll():
                match self.line.recv():
                    case (int(number), said):
                        tally.add(number, said)
                    case code:
                        tally.code |= digests(code)
                        tally.tried += len(self.numbers)
                        self.numbers = range(0)
            return self._after(HANG, tally) if self.hangs() else self
        except (EOFError, ConnectionError):
            self.process.join()
            return self._after(f"{CRASH} with {self.process.exitcode}", tally)

    def hangs(self):
        """Whether it has worked at one number for so many seconds, or done nothing for twelve times as long."""
        now, worked = time.monotonic(), _worked(self.process.pid)
        if self.at.value != self.number:
            self.number, self.begun = self.at.value, worked
        if worked != self.worked:
            self.worked, self.since = worked, now
        return bool(self.numbers) and (worked - self.begun > HANG_S or now - self.since > 12 * HANG_S)

    def end(self):
        self.process.kill()
        self.process.join()
        self.line.close()

    def _notice(self):
        self.number, self.since = self.at.value, time.monotonic()
        self.begun = self.worked = _worked(self.process.pid)

    def _after(self, said, tally):
        number, numbers, other = self.at.value, self.numbers, Worker(self.attack, self.folder)
        self.end()
        done = numbers.index(number) + 1
        tally.add(number, said)
        tally.tried += done
        if numbers[done:]:
            other.give(numbers[done:])
        return other


def _worked(process):
    """Seconds of a processor that a process and its children have used; of those that have ended no more."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") + sum(map(_worked, children))


def _work(attack, folder, line, at):
    logging.disable()  # of the libraries that are given damaged files
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    inside = Path(tempfile.mkdtemp(dir=folder))
    while True:
        numbers = line.recv()
        with _entered(numbers.start < TRACED) as code:
            for at.value in numbers:
                if (said := trial(attack, at.value, inside)) is not None:
                    line.send((at.value, said))
        ours = [file for file in (*code, *_apart(code)) if file.startswith(("src/", "tests/"))]
        line.send([file for file in ours if Path(file).name != "running.py"])


def _apart(code):
    """Where the project reads in another process, all that may be entered there."""
    beside = (ROOT / APART).parent.glob("*.py") if APART in code else ()
    return [str(file.relative_to(ROOT)) for file in beside]


@contextmanager
def _entered(is_asked):
    """Files whose functions are called, from the root; not for a lambda alone, by which formats know their files."""
    code, root = set(), f"{ROOT}/"

    def called(frame, event, arg):
        if frame.f_code.co_name != "<lambda>":
            code.add(frame.f_code.co_filename.removeprefix(root))

    sys.setprofile(called if is_asked else None)
    yield code
    sys.setprofile(None)


@contextmanager
def _folder():
    """A folder in memory, if there is such a place."""
    memory = Path("/dev/shm")
    folder = Path(tempfile.mkdtemp(prefix="fuzz-", dir=memory if memory.is_dir() else None))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def run(attack, seconds=float("inf"), wanted=float("inf"), lanes=1, tally=None, keep=lambda tally: None):
    """Try an attack for some time, or until it was tried so often."""
    tally = tally or Tally()
    if not seconds or tally.tried >= wanted:
        return tally
    with _folder() as folder:
        attack.prepare(folder)
        gc.freeze()
        begun = kept = time.monotonic()
        earlier = tally.seconds
        given = _portions(attack, tally.tried, wanted, begun + seconds)
        workers = [Worker(attack, folder) for _ in range(lanes)]
        while workers := [worker for worker in workers if _goes_on(worker, given)]:
            wait([worker.line for worker in workers], 0.5)
            workers = [_fresh(worker.heard(tally)) for worker in workers]
            tally.seconds = earlier + time.monotonic() - begun
            if time.monotonic() - kept > KEPT_S:
                keep(tally)
                kept = time.monotonic()
    keep(tally)
    return tally


def _portions(attack, begin, end, until):
    """Numbers to give out, for as long as there is time."""
    size = max(1, attack.wanted // 1000)
    for at in count(begin, size):
        if at >= end or time.monotonic() > until:
            return
        yield range(at, min(at + size, end))


def _goes_on(worker, given):
    """Whether a worker has something to do, or is given it."""
    if not worker.numbers and (numbers := next(given, None)):
        worker.give(numbers)
    if not worker.numbers:
        worker.end()
    return bool(worker.numbers)


def _fresh(worker):
    if worker.numbers or worker.given < REPLACED:
        return worker
    worker.end()
    return Worker(worker.attack, worker.folder)

"""SIGKILL while files are written."""

import os
import signal
import time
import zipfile

import foreign
import unconstrain as uc
from unconstrain.recordings.writers import write_recordings

from .attack import Attack, taught

LATEST = 0.05
"""Seconds after the start of a writer until it is killed, at most."""


def moved(policy):
    values = policy.predict(foreign.STATES[:, :2])
    return uc.Recording(("x", "y"), values, foreign.STEPS * 0.1, "a")


def record(path, policy):
    write_recordings([moved(policy)], path)


WRITERS = {
    "a.npz": lambda path, policy: uc.save(policy, path),
    "a.c": lambda path, policy: policy.export_c(path),
    "a.csv": record,
    "a.parquet": record,
    "data": record,
}


def content_of(path):
    """What a file or the files of a folder hold; of archives what is in them, since they name the time."""
    if path.is_dir():
        return {str(each.relative_to(path)): content_of(each) for each in sorted(path.rglob("*")) if each.is_file()}
    if path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    return path.read_bytes() if path.exists() else None


def held(folder):
    """What each thing in a folder holds."""
    return {path.name: content_of(path) for path in folder.iterdir()}


def killed(write, path, policies, seconds):
    """Let a process write one after the other, and kill it."""
    child = os.fork()
    if child == 0:
        while True:
            for policy in policies:
                write(path, policy)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def of_kills():
    policies = []

    def prepare(folder):
        policies[:] = [taught(), taught(uc.ParametricPolicy(uc.Affine()))]

    def attempt(rng, folder):
        name, write = rng.choice([*WRITERS.items()])
        written = []
        for policy in policies:
            write(folder / name, policy)
            written.append(held(folder))
        killed(write, folder / name, policies, rng.uniform(0.0, LATEST))
        found = held(folder)
        if any(found.get(each) not in (one[each], other[each]) for one, other in [written] for each in one):
            return f"{name}: torn or lost"
        write(folder / name, policies[0])
        left = held(folder).keys() - written[0].keys()
        return f"{name}: litter {sorted(left)}" if left else None

    return Attack("kills", attempt, 1_000, prepare)

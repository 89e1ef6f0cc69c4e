"""What reads a file in a process of its own, and how such may end."""

import os
import signal


def rows(place, path, count):
    for _ in range(count):
        yield os.getpid(), place, path


def ends(place, path):
    yield os.getpid()
    os.kill(os.getpid(), signal.SIGSEGV)


def never_ends(place, path):
    yield os.getpid()
    while True:
        pass


def prints(place, path):
    print("on its way", flush=True)
    os.write(1, b"as libraries do")
    yield os.getpid()

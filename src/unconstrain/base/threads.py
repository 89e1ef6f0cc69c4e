"""Independent pieces of work side by side, in as many threads as BLAS may use, and no more.

Matrices of the size that occurs here leave most of BLAS' threads waiting for one another, which takes longer than one
thread alone where another program wants the cores too, and they go on waiting for some time after each product. Several
pieces of work at once, in a thread each, with one of BLAS, do not wait. What was said to BLAS (OPENBLAS_NUM_THREADS and
its like, or ``threadpoolctl``) counts here too, so that processes side by side do not get in each other's way. The
limit is the process's, and so it is one for all who ask for it at once: the first sets it, the last takes it back.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from functools import cache
from typing import Any

from threadpoolctl import OpenBLASController, ThreadpoolController

WORTH_A_THREAD = 1e7
"""Multiplications below which threads take longer than they save."""


@contextmanager
def workers() -> Iterator[Workers]:
    """As many threads as BLAS may use; meanwhile it uses one.

    Hold it around arithmetic alone, not around what a caller's iterator does: entering takes some microseconds.
    """
    _limit.hold()
    try:
        yield _limit
    finally:
        _limit.release()


class Workers:
    """One thread for BLAS and the others for some work, for as long as anybody holds it; see :func:`workers`."""

    def __init__(self) -> None:
        self._clear()

    def _clear(self) -> None:
        self._lock = threading.Lock()
        self._holders = 0
        self._before: list[int] = []
        self._pool: ThreadPoolExecutor | None = None
        self._own = threading.local()

    def run(self, calls: Sequence[Callable[[], Any]], multiplications: float) -> list[Any]:
        """Results of some calls that take so many multiplications in all."""
        pool = self._shared() if len(calls) > 1 and multiplications >= WORTH_A_THREAD else None
        if pool is None:
            return [call() for call in calls]
        # Each in the caller's context: what was said by np.errstate holds there too.
        running = [pool.submit(copy_context().run, call) for call in calls]
        return [each.result() for each in running]

    def hold(self) -> None:
        """Limit BLAS, if nobody has."""
        with self._lock:
            self._holders += 1
            if self._holders > 1:
                return
            self._before = [library.num_threads for library in _blas()]
            _set([1] * len(self._before))

    def release(self) -> None:
        """Take the limit back, if nobody else holds it."""
        with self._lock:
            self._holders -= 1
            if self._holders:
                return
            pool, self._pool = self._pool, None
            _set(self._before)
        if pool is not None:
            pool.shutdown()

    def _shared(self) -> ThreadPoolExecutor | None:
        """Threads that all holders share; None where there is but one, or this is one of them and must not wait."""
        with self._lock:
            threads = max(self._before, default=1)
            if threads == 1 or hasattr(self._own, "of_the_pool"):
                return None
            if self._pool is None:
                self._pool = ThreadPoolExecutor(threads, initializer=self._mark)
            return self._pool

    def begin_anew(self) -> None:
        """In a process that was forked, which has none of the threads: nobody holds anything."""
        held, before = self._holders, self._before
        self._clear()
        if held:
            _set(before)

    def _mark(self) -> None:
        self._own.of_the_pool = True


_limit = Workers()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_limit.begin_anew)


def _set(threads: Sequence[int]) -> None:
    for library, number in zip(_blas(), threads, strict=True):
        if library.num_threads != number:
            # OpenBLAS listens to one thread until that is done, and who sets the limit need not be who takes it back.
            if isinstance(library, OpenBLASController):
                library.clear_controlling_thread(force=True)
            library.set_num_threads(number)
            if isinstance(library, OpenBLASController):
                library.clear_controlling_thread(force=True)


@cache
def _blas() -> list[Any]:
    return list(ThreadpoolController().select(user_api="blas").lib_controllers)

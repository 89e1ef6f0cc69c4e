"""Independent pieces of work side by side, in as many threads as BLAS may use, and no more.

Matrices of the size that occurs here leave most of BLAS' threads waiting for
one another, which takes longer than one thread alone where another program
wants the cores too, and they go on waiting for some time after each product.
Several pieces of work at once, in a thread each, with one of BLAS, do not
wait. What was said to BLAS (OPENBLAS_NUM_THREADS and its like, or
``threadpoolctl``) counts here too, so that processes side by side do not get
in each other's way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

WORTH_A_THREAD = 1e7
"""Multiplications below which threads take longer than they save."""


class Workers:
    """Threads for some work, as long as BLAS is limited to one; see :func:`workers`."""

    def __init__(self, pool: ThreadPoolExecutor | None) -> None:
        self._pool = pool

    def run(self, calls: Sequence[Callable[[], Any]], multiplications: float) -> list[Any]:
        """Results of some calls that take so many multiplications in all."""
        if self._pool is None or len(calls) < 2 or multiplications < WORTH_A_THREAD:
            return [call() for call in calls]
        # Each in the caller's context: what was said by np.errstate holds there too.
        running = [self._pool.submit(copy_context().run, call) for call in calls]
        return [each.result() for each in running]


@contextmanager
def workers() -> Iterator[Workers]:
    """As many threads as BLAS may use; meanwhile it uses one."""
    blas = _blas()
    threads = max((library.num_threads for library in blas.lib_controllers), default=1)
    if threads == 1:
        yield Workers(None)
        return
    with blas.limit(limits=1), ThreadPoolExecutor(threads) as pool:
        yield Workers(pool)


@cache
def _blas() -> Any:
    return ThreadpoolController().select(user_api="blas")

"""Independent pieces of work side by side, in as many threads as BLAS may use, and no more.

Matrices of the size that occurs here leave most of BLAS' threads waiting for
one another, which takes longer than one thread alone where another program
wants the cores too. Several pieces of work at once, in a thread each, with
one of BLAS, do not wait. What was said to BLAS (OPENBLAS_NUM_THREADS and its
like, or ``threadpoolctl``) counts here too, so that processes side by side do
not get in each other's way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

__all__ = ["side_by_side"]

LARGE = 500
"""A single piece of work on matrices from this size on gains from several threads of BLAS."""

WORTH_A_THREAD = 1e7
"""Multiplications below which starting threads takes longer than they save."""


def side_by_side(calls: Sequence[Callable[[], Any]], multiplications: float, size: int) -> list[Any]:
    """Results of some calls that take so many multiplications in all, with matrices of ``size`` rows."""
    if len(calls) == 1 and size >= LARGE:
        return [calls[0]()]
    blas = _blas()
    threads = max((library.num_threads for library in blas.lib_controllers), default=1)
    if threads == 1:
        return [call() for call in calls]
    with blas.limit(limits=1):
        if len(calls) == 1 or multiplications < WORTH_A_THREAD:
            return [call() for call in calls]
        with ThreadPoolExecutor(min(threads, len(calls))) as pool:
            # Each in the caller's context: what was said by np.errstate holds there too.
            running = [pool.submit(copy_context().run, call) for call in calls]
            return [each.result() for each in running]


@cache
def _blas() -> Any:
    return ThreadpoolController().select(user_api="blas")

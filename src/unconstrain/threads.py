"""Independent solves side by side, in as many threads as BLAS may use, and no more.

A solve of the size that occurs here leaves most of BLAS' threads waiting for
one another, and small ones are many times slower for it. Several at once, in
a thread each, keep all cores busy. What was said to BLAS (OPENBLAS_NUM_THREADS
and its like, or ``threadpoolctl``) counts here too, so that processes side by
side do not get in each other's way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

__all__ = ["side_by_side"]

LARGE = 500
"""Matrices from this size on gain from several threads of BLAS."""

WORTH_A_THREAD = 4e6
"""Multiplications below which starting threads takes longer than they save."""


def side_by_side(calls: Sequence[Callable[[], Any]], matrices: int, size: int) -> list[Any]:
    """Results of some calls, each of which solves with ``matrices`` matrices of ``size`` rows."""
    blas = _blas()
    threads: int = max((library.num_threads for library in blas.lib_controllers), default=1)
    if threads == 1:
        return [call() for call in calls]
    with blas.limit(limits=max(1, threads // len(calls)) if size >= LARGE else 1):
        if len(calls) == 1 or len(calls) * matrices * size**3 < WORTH_A_THREAD:
            return [call() for call in calls]
        with ThreadPoolExecutor(min(threads, len(calls))) as pool:
            return list(pool.map(lambda call: call(), calls))


@cache
def _blas() -> Any:
    return ThreadpoolController().select(user_api="blas")

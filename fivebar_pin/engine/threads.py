"""Threads for work that lets go of the interpreter while it computes."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from fivebar_pin._arrays import integer

__all__ = ["each", "threads_of"]


def threads_of(asked: int | None) -> int:
    """Return how many threads to use: as many as were asked for, or as this process may run at once.

    Raises:
        InvalidInputError: not a whole number of one at least.
    """
    if asked is not None:
        return integer("threads", asked, least=1)
    return max(1, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)


def each(work: Callable[[int], None], count: int, threads: int) -> None:
    """Do work(0), work(1), ..., work(count - 1), by so many threads at once; the first error is raised."""
    if threads == 1 or count <= 1:
        for k in range(count):
            work(k)
        return
    with ThreadPoolExecutor(min(threads, count)) as pool:
        for done in [pool.submit(work, k) for k in range(count)]:
            done.result()

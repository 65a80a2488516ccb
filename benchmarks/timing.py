"""Time callables against each other."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

SHORTEST = 2e-3
"""Time over which calls are counted together [s]; the clock and the caches need that long to settle."""


def best_of(call: Callable[[], Any], *, repeats: int = 5, budget: float = 2.0) -> tuple[float, Any]:
    """Return the shortest time of a call [s] in several runs within a time budget [s], and the last result.

    A call before the first run is not timed: it compiles what is not compiled yet. The first run is one call; it tells
    how often the others repeat a short one.
    """
    call()
    start = time.perf_counter()
    result = call()
    first = time.perf_counter() - start
    count = max(1, int(SHORTEST / first))
    best, spent = first, first
    for _ in range(repeats - 1):
        if spent > budget:
            break
        start = time.perf_counter()
        for _ in range(count):
            result = call()
        taken = time.perf_counter() - start
        best, spent = min(best, taken / count), spent + taken
    return best, result

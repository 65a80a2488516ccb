"""Time callables against each other."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any


def best_of(call: Callable[[], Any], *, repeats: int = 5, budget: float = 2.0) -> tuple[float, Any]:
    """Return the shortest time [s] of several calls within a time budget [s], and the last result."""
    best, spent, result = float("inf"), 0.0, None
    for k in range(repeats):
        start = time.perf_counter()
        result = call()
        taken = time.perf_counter() - start
        best, spent = min(best, taken), spent + taken
        if k and spent > budget:
            break
    return best, result

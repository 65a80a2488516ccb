"""Make something once for each chain, and let go of it with the chain."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from fivebar_pin.chain import ClosedChain

__all__ = ["T", "once_per_chain"]


T = TypeVar("T")


def once_per_chain(make: Callable[[ClosedChain], T]) -> Callable[[ClosedChain], T]:
    """Remember what `make` returns, by chain; it must not refer to the chain itself, or neither is ever let go."""
    made: weakref.WeakKeyDictionary[ClosedChain, T] = weakref.WeakKeyDictionary()

    @wraps(make)
    def remembered(chain: ClosedChain) -> T:
        found = made.get(chain)
        if found is None:
            found = made.setdefault(chain, make(chain))  # one and the same for threads that ask at once
        return found

    return remembered

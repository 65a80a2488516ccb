"""Make something once for each chain, and let go of it with the chain."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from fivebar_pin.chain import ClosedChain

__all__ = ["T", "once_per_chain"]


T = TypeVar("T")

_MADE = "_made"  # where a chain keeps it, beside its fields: copies do not take it along
_ABSENT = object()


def once_per_chain(make: Callable[[ClosedChain], T]) -> Callable[[ClosedChain], T]:
    """Remember what `make` returns with the chain that it is made of."""

    @wraps(make)
    def remembered(chain: ClosedChain) -> T:
        made: dict[Any, Any] | None = chain.__dict__.get(_MADE)
        if made is None:
            made = chain.__dict__.setdefault(_MADE, {})
        found = made.get(make, _ABSENT)
        if found is _ABSENT:
            found = made.setdefault(make, make(chain))  # one and the same for threads that ask at once
        return found  # type: ignore[no-any-return]

    return remembered

"""Loop closures: the family of constraints that make a closed chain of an open tree."""

from fivebar_pin.closures.closure import Closure, ClosureKind

__all__ = [
    "Closure",
    "ClosureKind",
]

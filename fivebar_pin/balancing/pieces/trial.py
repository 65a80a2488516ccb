"""One step of the search for counterweights: about which size and place each is looked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fivebar_pin._arrays import Array, Immutable

__all__ = ["Size", "Trial"]


@dataclass(frozen=True, slots=True, eq=False)
class Size(Immutable):
    """Outer radius and centre (2,) or (3,) about which a piece is bounded from above, in chain lengths.

    Where `stray` is given, the centre stays within that distance.
    """

    radius: float
    center: Array
    stray: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Trial(Immutable):
    """What is tried.

    Attributes:
        sizes: by index of the body, about which its piece is bounded in size from above; from below without.
        without: bodies that get nothing.
        elastic: whether pieces may stick out of their regions, by a variable of their own.
    """

    sizes: Mapping[int, Size] = field(default_factory=dict)
    without: frozenset[int] = frozenset()
    elastic: bool = False

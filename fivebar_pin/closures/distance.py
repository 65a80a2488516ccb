"""distance: a rod without mass between two points, |p_2 - p_1| - length = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from fivebar_pin._arrays import number
from fivebar_pin.closures.closure import Entry
from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.closures.rows import Row, length
from fivebar_pin.errors import InvalidInputError

__all__ = ["Distance"]


@dataclass(frozen=True, eq=False)
class Distance(FrameClosure, word="distance"):
    """A rod without mass, with a ball at either end. One row [m].

    Its multiplier is the force with which the rod pushes its ends apart; where it is negative, the rod pulls [N].

    Where the points coincide the rod has no direction. No closed configuration lies there, because the length is
    positive; a search that starts there takes the x axis of frame 1 for it.

    Attributes:
        length: distance of the points [m].
    """

    length: float | None = None

    row_names: ClassVar[tuple[str, ...]] = ("length",)
    is_rod: ClassVar[bool] = True
    entries: ClassVar[tuple[Entry, ...]] = (
        Entry("length", None, "a distance closure needs the length of its rod, e.g. 0.7 [m]"),
    )

    def __post_init__(self) -> None:
        FrameClosure.__post_init__(self)
        name, hint = f"length of closure {self.name}", "Points that coincide are a closure of kind '3d'."
        if self.length is None:
            raise InvalidInputError(name, None, "must be given: the distance of the two points [m]")
        value = number(name, self.length)
        if value <= 0.0:
            raise InvalidInputError(name, value, "must be positive [m]", hint)
        object.__setattr__(self, "length", value)

    @property
    def rows(self) -> tuple[Row, ...]:
        """Its length."""
        assert self.length is not None
        return (length(self.length),)

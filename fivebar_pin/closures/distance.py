"""distance: a rod without mass between two points, |p_2 - p_1| - length = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin._arrays import Array, cross, number
from fivebar_pin.closures.closure import Entry
from fivebar_pin.closures.frame_closure import (
    FrameClosure,
    FramePair,
    point_accelerations,
    point_velocity,
)
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
    row_units: ClassVar[tuple[str, ...]] = ("m",)
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

    def residual(self, pair: FramePair) -> Array:
        """Return |p_2 - p_1| - length."""
        return np.asarray(np.linalg.norm(pair.p2 - pair.p1, axis=-1)[..., None] - self.length)

    def selector(self, pair: FramePair) -> Array:
        """Return T = [u, p_2 x u] (..., 1, 6), u along the rod."""
        u, _ = _direction(pair)
        return np.concatenate([u, cross(pair.p2, u)], axis=-1)[..., None, :]

    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return u . (a_2 - a_1) + (|d'|^2 - (u . d')^2) / |d|; exact everywhere."""
        u, size = _direction(pair)
        a2, a1 = point_accelerations(pair, V1, V2, A1, A2)
        rate = point_velocity(V2, pair.p2) - point_velocity(V1, pair.p1)
        across = rate - np.sum(rate * u, axis=-1, keepdims=True) * u
        return np.asarray(np.sum(u * (a2 - a1), axis=-1, keepdims=True) + np.sum(across**2, -1, keepdims=True) / size)


def _direction(pair: FramePair) -> tuple[Array, Array]:
    """Return the unit vector from point 1 to point 2 (..., 3) and their distance (..., 1)."""
    d = pair.p2 - pair.p1
    size = np.linalg.norm(d, axis=-1, keepdims=True)
    met = size == 0.0
    return np.where(met, pair.R1[..., 0], d / np.where(met, 1.0, size)), size

"""A region in the coordinates of one body's space, and what a piece of material is asked there in cones."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.forms import fixed_form
from fivebar_pin.balancing.moments import Moments

__all__ = ["Shape", "round_overhang"]

S = TypeVar("S", bound="Shape")


@dataclass(frozen=True, slots=True, eq=False)
class Shape(Immutable, ABC):
    """A region in the coordinates of one body's space (d = 2 planar, 3 spatial), lengths in any one unit.

    Attributes:
        center: (d,).
        axes: rows d_i (d, d), orthonormal.
        semi_axes: half extents along them (d,).
        by_direction: whether a planar piece needs its second moments one by one, or their sum alone.
    """

    by_direction: ClassVar[bool] = True

    center: Array
    axes: Array
    semi_axes: Array

    @abstractmethod
    def holds(self, moments: Moments) -> list[Array]:
        """Return the forms that must not be negative for a mass distribution within."""

    @abstractmethod
    def holds_round(self, moments: Moments, text: str, w: Array) -> None:
        """Ask a round piece of radius r with w = m r to lie within as a whole; `text` is the label of the cones."""

    @abstractmethod
    def overhang(self, points: Array, unit: float) -> float:
        """Return how far points (k, d) stick out, 0 where they do not.

        Args:
            points: from the centre, along the axes, in the same unit of length as the result [m].
            unit: the unit of this shape [m].
        """

    @property
    def spread(self) -> float:
        """Radius about the centre that holds all material within, in the mean square."""
        return float(self.semi_axes.max())

    @property
    def room(self) -> float:
        """Largest radius of a round piece within."""
        return float(self.semi_axes.min())

    @property
    def radius(self) -> float:
        """Radius about the origin that holds all material within, in the mean square."""
        return float(np.linalg.norm(self.center) + self.spread)

    def shrunk(self: S, share: float) -> S:
        """Return it about the same centre with all lengths times a share."""
        return replace(self, semi_axes=share * self.semi_axes)

    def along(self, moments: Moments) -> list[Array]:
        """Return the forms m d_i.(c' - c) of the mass centre c'."""
        off = moments.off(self.center)
        return [
            np.asarray(sum((float(x) * f for x, f in zip(axis, off, strict=True)), fixed_form(0.0)))
            for axis in self.axes
        ]

    def spreads(self, moments: Moments) -> list[Array]:
        """Return the forms sum of m (d_i.(x - c))^2 / a_i^2."""
        out = []
        for d, a in zip(self.axes, self.semi_axes, strict=True):
            at = float(d @ self.center)
            out.append((moments.second(d, d) - 2.0 * at * moments.first(d) + at**2 * moments.m) / a**2)
        return out


def round_overhang(points: Array, semi_axes: Array) -> float:
    """Return how far an ellipsoid about the origin would have to grow, in its least semi-axis, to hold points."""
    return max(0.0, float((np.linalg.norm(points / semi_axes, axis=1).max() - 1.0) * semi_axes.min()))

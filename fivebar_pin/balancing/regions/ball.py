"""Material within a distance of a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen
from fivebar_pin.balancing.moments import Moments
from fivebar_pin.balancing.regions.region import Region, positive
from fivebar_pin.balancing.regions.shape import Shape, round_overhang

__all__ = ["Ball", "BallShape"]


@dataclass(frozen=True, slots=True, eq=False)
class Ball(Region):
    """Material within a distance of a point.

    Attributes:
        radius: [m].
        center: in the axes of the frame (3,) [m].
        frame: name of a frame of the body; the joint frame unless given.
    """

    radius: float
    center: npt.ArrayLike = (0.0, 0.0, 0.0)
    frame: str = ""

    def __post_init__(self) -> None:
        positive("radius of the ball", self.radius)
        object.__setattr__(self, "center", checked("center", self.center, (3,)))

    def half_extents(self) -> Array:
        """Return the radius three times (3,) [m]."""
        return np.full(3, float(self.radius))

    def shape(self, body: str, center: Array, R: Array, *, plane: Array | None, unit: float) -> Shape:
        """Return the ball or, in the plane, the circle that is its shadow."""
        semi = self.half_extents()
        if plane is None:
            return BallShape(frozen(center / unit), frozen(R.T), frozen(semi / unit))
        flat = plane[:2] @ center / unit
        return BallShape(frozen(flat), frozen(np.eye(2)), frozen(semi[:2] / unit))


@dataclass(frozen=True, slots=True, eq=False)
class BallShape(Shape):
    """sum of m |x - c|^2 <= r^2 m; a round piece of radius s: |m (c' - c)| + m s <= r m."""

    by_direction = False

    def holds(self, moments: Moments) -> list[Array]:
        """Return r^2 m less the inertia about the centre, over r^2."""
        m, r = moments.m, float(self.semi_axes[0])
        return [(r * r * m - moments.inertia_about(self.center)) / r**2]

    def holds_round(self, moments: Moments, text: str, w: Array) -> None:
        """Ask for the centre within the radius that is left."""
        moments.cones.add(text, "soc", [float(self.semi_axes[0]) * moments.m - w, *moments.off(self.center)])

    def overhang(self, points: Array, unit: float) -> float:
        """Return the farthest distance beyond the radius."""
        return round_overhang(points, unit * self.semi_axes)

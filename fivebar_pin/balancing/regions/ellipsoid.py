"""Material within an ellipsoid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen
from fivebar_pin.balancing.forms import fixed_form
from fivebar_pin.balancing.moments import Moments
from fivebar_pin.balancing.regions.region import Region, positive
from fivebar_pin.balancing.regions.shape import Shape, round_overhang

__all__ = ["Ellipsoid", "EllipsoidShape"]


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid(Region):
    """Material within an ellipsoid along the axes of the frame.

    Attributes:
        semi_axes: half lengths (3,) [m].
        center, frame: as for `Ball`.
    """

    semi_axes: npt.ArrayLike
    center: npt.ArrayLike = (0.0, 0.0, 0.0)
    frame: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "semi_axes", checked("semi-axes of the ellipsoid", self.semi_axes, (3,)))
        for k, length in enumerate(np.asarray(self.semi_axes)):
            positive(f"semi_axes[{k}] of the ellipsoid", float(length))
        object.__setattr__(self, "center", checked("center", self.center, (3,)))

    def half_extents(self) -> Array:
        """Return the semi-axes (3,) [m]."""
        return np.asarray(self.semi_axes, dtype=np.float64)

    def shape(self, body: str, center: Array, R: Array, *, plane: Array | None, unit: float) -> Shape:
        """Return the ellipsoid or, in the plane, the ellipse that is its shadow."""
        semi = self.half_extents()
        if plane is None:
            return EllipsoidShape(frozen(center / unit), frozen(R.T), frozen(semi / unit))
        shadow = plane[:2] @ (R * semi**2) @ R.T @ plane[:2].T
        squares, directions = np.linalg.eigh(shadow)
        flat = plane[:2] @ center / unit
        return EllipsoidShape(frozen(flat), frozen(directions.T), frozen(np.sqrt(squares) / unit))


@dataclass(frozen=True, slots=True, eq=False)
class EllipsoidShape(Shape):
    """sum over the axes of m (d_i.(x - c))^2 / a_i^2 <= m: exact [Wensing, Kim, Slotine 2018]."""

    def holds(self, moments: Moments) -> list[Array]:
        """Return the mass less the spreads along all axes."""
        return [moments.m - np.sum(self.spreads(moments), axis=0)]

    def holds_round(self, moments: Moments, text: str, w: Array) -> None:
        """Ask for a ball within an ellipsoid, by the S-lemma: [[m - l, 0, b^T], [0, l 1, A w], [b, A w, m 1]] >= 0."""
        d, zero, m, semi_axes = moments.d, fixed_form(0.0), moments.m, self.semi_axes
        along = self.along(moments)
        l = moments.cones.variable(0.5)
        b = [f / float(a) for f, a in zip(along, semi_axes, strict=True)]
        A = [[w / float(semi_axes[i]) if i == j else zero for j in range(d)] for i in range(d)]
        top = [[m - l, *(zero for _ in range(d)), *b]]
        middle = [[zero, *(l if i == j else zero for j in range(d)), *A[i]] for i in range(d)]
        last = [[b[i], *A[i], *(m if i == j else zero for j in range(d))] for i in range(d)]
        moments.cones.semidefinite(text, top + middle + last)

    def overhang(self, points: Array, unit: float) -> float:
        """Return how far the ellipsoid would have to grow, in its least semi-axis."""
        return round_overhang(points, unit * self.semi_axes)

"""Material within a box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen
from fivebar_pin.balancing.moments import Moments
from fivebar_pin.balancing.regions.region import Region, positive
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.errors import InvalidInputError

__all__ = ["Box", "BoxShape"]

_ASKEW = 1e-9  # what an edge along the normal may lack of one, as the cosine of its angle [-]


@dataclass(frozen=True, slots=True, eq=False)
class Box(Region):
    """Material within a box along the axes of the frame.

    Attributes:
        size: full lengths of the edges (3,) [m].
        center, frame: as for `Ball`.
    """

    size: npt.ArrayLike
    center: npt.ArrayLike = (0.0, 0.0, 0.0)
    frame: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", checked("size of the box", self.size, (3,)))
        for k, edge in enumerate(np.asarray(self.size)):
            positive(f"size[{k}] of the box", float(edge))
        object.__setattr__(self, "center", checked("center", self.center, (3,)))

    def half_extents(self) -> Array:
        """Return half the edges (3,) [m]."""
        return 0.5 * np.asarray(self.size, dtype=np.float64)

    def shape(self, body: str, center: Array, R: Array, *, plane: Array | None, unit: float) -> Shape:
        """Return the box or, in the plane, the rectangle that is its shadow.

        Raises:
            InvalidInputError: a box that stands askew to the plane of the mechanism.
        """
        semi = self.half_extents()
        if plane is None:
            return BoxShape(frozen(center / unit), frozen(R.T), frozen(semi / unit))
        across = np.abs(R.T @ plane[2])
        k = int(np.argmax(across))
        if across[k] < 1.0 - _ASKEW:
            raise InvalidInputError(
                f"box for body {body}",
                "askew",
                "must have one edge along the normal of the plane of motion",
                "Name a frame that is aligned with the plane.",
            )
        keep = [i for i in range(3) if i != k]
        flat = plane[:2] @ center / unit
        return BoxShape(frozen(flat), frozen((plane[:2] @ R[:, keep]).T), frozen(semi[keep] / unit))


@dataclass(frozen=True, slots=True, eq=False)
class BoxShape(Shape):
    """Every axis by itself, sum of m (d_i.(x - c))^2 <= a_i^2 m, and products of two half-spaces: exact in the plane.

    In space the conditions are necessary ones.
    """

    @property
    def spread(self) -> float:
        """Half the diagonal."""
        return float(np.linalg.norm(self.semi_axes))

    def holds(self, moments: Moments) -> list[Array]:
        """Return one form for each axis, and in space one for each pair of half-spaces."""
        return [moments.m - s for s in self.spreads(moments)] + self._corners(moments)

    def _corners(self, moments: Moments) -> list[Array]:
        """Products of two half-spaces of a box, (1 + s u_i)(1 + t u_j) with u_i = d_i.(x - c) / a_i."""
        if moments.planar:
            return []
        m, c, first, out = moments.m, self.center, moments.first, []
        for i in range(3):
            for j in range(i):
                di, dj = self.axes[i] / self.semi_axes[i], self.axes[j] / self.semi_axes[j]
                ui, uj = first(di) - float(di @ c) * m, first(dj) - float(dj @ c) * m
                both = moments.second(di, dj) - float(di @ c) * first(dj) - float(dj @ c) * first(di)
                both = both + float(di @ c) * float(dj @ c) * m
                out += [m + s * ui + t * uj + s * t * both for s in (1.0, -1.0) for t in (1.0, -1.0)]
        return out

    def holds_round(self, moments: Moments, text: str, w: Array) -> None:
        """Ask for the centre within what each face leaves."""
        pairs = zip(self.along(moments), self.semi_axes, strict=True)
        moments.cones.add(text, "nonneg", [float(a) * moments.m - w + s * f for f, a in pairs for s in (1.0, -1.0)])

    def overhang(self, points: Array, unit: float) -> float:
        """Return the farthest distance beyond a face."""
        return max(0.0, float((np.abs(points) - unit * self.semi_axes).max()))

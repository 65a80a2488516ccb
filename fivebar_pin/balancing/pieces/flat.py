"""What flat pieces have in common."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen, number
from fivebar_pin.balancing.pieces.materials import density_of, least_flat
from fivebar_pin.balancing.pieces.piece import Piece, check_arm
from fivebar_pin.balancing.pieces.solid import FlatSolid
from fivebar_pin.errors import InvalidInputError

__all__ = ["Flat"]

_IN_PLANE = 1e-9  # share of a line that must lie in the plane of motion [-]
_AT_THE_JOINT = 1e-12  # distance of a piece from its joint that gives it no direction [m]


@dataclass(frozen=True, slots=True, eq=False)
class Flat(Piece):
    """A flat piece; see `Disc`.

    Attributes:
        solidity: m^2 / (d t I_c) of the solid piece [-].
        alpha: of w^2 = alpha m I_c + beta m^3; beta is what the solid piece leaves over, or 0.
    """

    flat = True
    solidity: ClassVar[float]

    density: float | str
    thickness: float
    line: npt.ArrayLike | None = None
    arm: float | None = None

    def __post_init__(self) -> None:
        density_of(self.density)
        number("thickness of the counterweight", self.thickness, positive=True, unit="m")
        check_arm(self.arm)
        if self.line is not None:
            line = checked("line of the counterweight", self.line, (3,))
            if not line.any():
                raise InvalidInputError("line of the counterweight", line.tolist(), "must not be zero")
            object.__setattr__(self, "line", line)

    @classmethod
    def of(cls, density: float, thickness: float, arm: float | None) -> Piece:
        """Return the piece with its centre anywhere."""
        return cls(density, thickness, arm=arm)

    def solid(self, axes: Array, mass: float, length: float) -> FlatSolid:
        """Return the bounds for scaled parameters of one body (axes (3, 3): rows e_1, e_2, n)."""
        least = least_flat(self.solidity, self.density, self.thickness, mass, length)
        return FlatSolid(f"a {self.shape}", least, _across(self.line, axes), *self.factors(least))

    @classmethod
    @abstractmethod
    def factors(cls, least: float) -> tuple[float, float]:
        """Return alpha and beta of w^2 = alpha m I_c + beta m^3."""

    def outer_radius(self, mass: float, inertia: Array, axes: Array) -> float:
        """Return sqrt(alpha I / m + beta m)."""
        solid = self.solid(axes, 1.0, 1.0)
        polar = max(float(axes[2] @ inertia @ axes[2]), solid.least * mass * mass)
        return float(np.sqrt(solid.alpha * polar / mass + solid.beta * mass))

    def size(self, mass: float, inertia: Array, axes: Array) -> tuple[float, ...]:
        """Return the two lengths in the plane and the thickness [m]."""
        polar = float(axes[2] @ inertia @ axes[2])
        area = mass / (density_of(self.density) * self.thickness)
        return (*self.outline(mass, polar, area), self.thickness)

    @classmethod
    @abstractmethod
    def outline(cls, mass: float, polar: float, area: float) -> tuple[float, float]:
        """Return the two lengths [m] of a piece of a mass, a polar inertia and an area [m2]."""

    def axes_at(self, place: Array, axes: Array) -> Array:
        """Return x along the line from the joint to the piece, z along the normal."""
        flat = place - axes[2] * float(axes[2] @ place)
        size = float(np.linalg.norm(flat))
        x = np.asarray(flat / size if size > _AT_THE_JOINT else axes[0])
        return np.column_stack([x, np.cross(axes[2], x), axes[2]])

    def kind(self) -> dict[str, float | None]:
        """Return density, thickness and the arm asked for."""
        return {"density": density_of(self.density), "thickness": self.thickness, "arm": self.arm}


def _across(line: npt.ArrayLike | None, axes: Array) -> Array | None:
    if line is None:
        return None
    flat = axes[:2] @ np.asarray(line)
    size = float(np.linalg.norm(flat))
    if size < _IN_PLANE * float(np.linalg.norm(line)):
        raise InvalidInputError("line of the counterweight", np.asarray(line).tolist(), "must not leave the plane")
    return frozen([-flat[1] / size, flat[0] / size])

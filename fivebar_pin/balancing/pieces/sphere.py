"""Solid balls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.pieces.materials import ball_radius, density_of, usable
from fivebar_pin.balancing.pieces.piece import Piece, check_arm, register
from fivebar_pin.balancing.pieces.solid import RoundSolid

__all__ = ["Sphere"]


@register
@dataclass(frozen=True, slots=True, eq=False)
class Sphere(Piece):
    """Counterweights made as solid balls, for mechanisms of any kind.

    Attributes:
        density: [kg/m3], or one of `MATERIALS`.
        arm: as for `Disc`.
    """

    shape = "ball"
    flat = False

    density: float | str
    arm: float | None = None

    def __post_init__(self) -> None:
        density_of(self.density)
        check_arm(self.arm)

    @classmethod
    def of(cls, density: float, thickness: float, arm: float | None) -> Piece:
        """Return the ball; a thickness it has none."""
        return cls(density, arm)

    def solid(self, axes: Array, mass: float, length: float) -> RoundSolid:
        """Return the bounds for scaled parameters of one body (axes play no part)."""
        radius = ball_radius(density_of(self.density), mass) / length
        return RoundSolid("a ball", usable(0.2 * radius**2, self.density), beta=radius)

    def outer_radius(self, mass: float, inertia: Array, axes: Array) -> float:
        """Return its radius, which its mass says."""
        return ball_radius(density_of(self.density), mass)

    def size(self, mass: float, inertia: Array, axes: Array) -> tuple[float, ...]:
        """Return the radius: a ball has the inertia that it has."""
        return (ball_radius(density_of(self.density), mass),)

    @classmethod
    def radius_of(cls, size: tuple[float, ...]) -> float:
        """Return the radius."""
        return size[0]

    @classmethod
    def principal(cls, mass: float, size: tuple[float, ...]) -> Array:
        """Return 2 m r^2 / 5 three times."""
        return np.ones(3) * 0.4 * mass * size[0] * size[0]

    @classmethod
    def words(cls, size: tuple[float, ...]) -> str:
        """Return the radius."""
        return f"{1e3 * size[0]:.4g}"

    @classmethod
    def visual(cls, size: tuple[float, ...]) -> tuple[str, tuple[float, ...]]:
        """Return a sphere."""
        return "sphere", size

    def kind(self) -> dict[str, float | None]:
        """Return density and the arm asked for."""
        return {"density": density_of(self.density), "arm": self.arm}

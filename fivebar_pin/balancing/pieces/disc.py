"""Flat discs, solid or with a bore."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.pieces.flat import Flat
from fivebar_pin.balancing.pieces.materials import DISC
from fivebar_pin.balancing.pieces.piece import register

__all__ = ["Disc"]

_BORED = 1e-5  # bore below this share of the area is not drilled: its radius is below a thousandth [-]


@register
@dataclass(frozen=True, slots=True, eq=False)
class Disc(Flat):
    """Counterweights made as flat discs, solid or with a bore, of one material and thickness.

    Attributes:
        density: [kg/m3], or one of `MATERIALS`.
        thickness: along the normal of the plane [m].
        line: direction in joint axes (3,) along which the centres must lie, through the joint; anywhere unless given.
        arm: side [m] of the square arm of the same material that carries the disc, from the joint to its rim; a fifth
            of its outer radius unless given, 0 for none (the body itself carries it).
    """

    shape = "disc"
    solidity = DISC

    @classmethod
    def factors(cls, least: float) -> tuple[float, float]:
        """Return those of r^2 = I_c / m + m / (2 pi d t)."""
        return 1.0, least

    @classmethod
    def outline(cls, mass: float, polar: float, area: float) -> tuple[float, float]:
        """Return (radius, bore) from I = m (r^2 + b^2) / 2 and A = pi (r^2 - b^2)."""
        total = max(2.0 * polar / mass, area / np.pi)  # r^2 + b^2
        difference = area / np.pi
        bore = total - difference
        return float(np.sqrt(0.5 * (total + difference))), float(np.sqrt(0.5 * bore)) if bore > _BORED * total else 0.0

    @classmethod
    def radius_of(cls, size: tuple[float, ...]) -> float:
        """Return the radius."""
        return size[0]

    @classmethod
    def principal(cls, mass: float, size: tuple[float, ...]) -> Array:
        """Return those of a ring with height."""
        a, b, t = size
        side = mass * (3.0 * (a * a + b * b) + t * t) / 12.0
        return np.array([side, side, 0.5 * mass * (a * a + b * b)])

    @classmethod
    def words(cls, size: tuple[float, ...]) -> str:
        """Return radius, bore radius where there is one, and thickness."""
        r, bore, t = (1e3 * s for s in size)
        return f"radius {r:.4g}, " + (f"bore radius {bore:.4g}, " if bore else "") + f"thickness {t:.4g}"

    @classmethod
    def visual(cls, size: tuple[float, ...]) -> tuple[str, tuple[float, ...]]:
        """Return a cylinder."""
        return "cylinder", (size[0], size[-1])

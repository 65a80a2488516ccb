"""Flat rectangles along the line from the joint to their centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.pieces.flat import Flat
from fivebar_pin.balancing.pieces.piece import register

__all__ = ["Bar"]


@register
@dataclass(frozen=True, slots=True, eq=False)
class Bar(Flat):
    """Counterweights made as flat rectangles, along the line from the joint to their centre.

    Attributes:
        density, thickness, line, arm: as for `Disc`.
    """

    shape = "bar"
    solidity = 6.0

    @classmethod
    def factors(cls, least: float) -> tuple[float, float]:
        """Return those of r^2 = 3 I_c / m, half the diagonal."""
        return 3.0, 0.0

    @classmethod
    def outline(cls, mass: float, polar: float, area: float) -> tuple[float, float]:
        """Return (length, width) from I = m (l^2 + w^2) / 12 and A = l w."""
        squares = max(12.0 * polar / mass, 2.0 * area)  # l^2 + w^2
        plus, minus = np.sqrt(squares + 2.0 * area), np.sqrt(max(squares - 2.0 * area, 0.0))
        return float(0.5 * (plus + minus)), float(0.5 * (plus - minus))

    @classmethod
    def radius_of(cls, size: tuple[float, ...]) -> float:
        """Return half the diagonal."""
        return 0.5 * float(np.hypot(size[0], size[1]))

    @classmethod
    def principal(cls, mass: float, size: tuple[float, ...]) -> Array:
        """Return those of a cuboid."""
        a, b, t = size
        return mass / 12.0 * np.array([b * b + t * t, a * a + t * t, a * a + b * b])

    @classmethod
    def words(cls, size: tuple[float, ...]) -> str:
        """Return length, width and thickness."""
        return " x ".join(f"{1e3 * s:.4g}" for s in size)

    @classmethod
    def visual(cls, size: tuple[float, ...]) -> tuple[str, tuple[float, ...]]:
        """Return a box."""
        return "box", size

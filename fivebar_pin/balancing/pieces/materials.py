"""Densities, and how dense material may be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, number
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = [
    "DISC",
    "MATERIALS",
    "Density",
    "ball_radius",
    "density_bound",
    "density_of",
    "least_flat",
    "thickness_of",
    "usable",
]

MATERIALS: Mapping[str, float] = {
    "aluminium": 2700.0,
    "brass": 8500.0,
    "lead": 11340.0,
    "steel": 7850.0,
    "tungsten": 19250.0,
}  # densities [kg/m3]
DISC = 2.0 * np.pi  # m^2 / (d t I_c) of a solid disc [-]
_DENSER = 1e-7  # share of the least inertia that may be missing: less is round-off of a body's moments [-]
_RANGE = 1e12  # a bound on density is of use within this range of the mechanism's own inertia [-]
_THICKNESS = 0.2  # of flat material unless given [chain lengths]


@dataclass(frozen=True, slots=True, eq=False)
class Density(Immutable):
    """Scaled bound on how dense material may be.

    Attributes:
        least: in the plane, I_c >= least m^2; in space, det(S_c)^(1/3) >= least m^(5/3).
    """

    least: float

    def lacking(self, mass: float, own: float) -> float:
        """Return the inertia that a flat body of a mass and I_c = own lacks, zero if no more than round-off."""
        least = self.least * mass**2
        return least - own if own < (1.0 - _DENSER) * least else 0.0

    def raised(self, mass: float, own: Array) -> Array:
        """Return principal second moments (3,), ascending, the smallest raised to one level if the body is too dense.

        The level t of the k smallest has t^k s_{k+1} .. s_3 = (least m^(5/3))^3.
        """
        least = (self.least * mass ** (5.0 / 3.0)) ** 3
        if own[0] > 0.0 and np.cbrt(np.prod(own)) >= (1.0 - _DENSER) * np.cbrt(least):
            return own
        for k in (1, 2):
            if own[k] > 0.0:
                level = (least / float(np.prod(own[k:]))) ** (1.0 / k)
                if level <= own[k]:
                    return np.append(np.full(k, level), own[k:])
        return np.full(3, np.cbrt(least))


def density_of(material: str | float) -> float:
    """Return the density [kg/m3] of a named material, or the number given.

    Raises:
        UnknownNameError: a material that is not known.
        InvalidInputError: a density that is not positive and finite.
    """
    if isinstance(material, str):
        if material not in MATERIALS:
            raise UnknownNameError("material", material, MATERIALS)
        return MATERIALS[material]
    return number("density", material, positive=True, unit="kg/m3")


def thickness_of(thickness: float | None, length: float) -> float:
    """Return the thickness [m] of flat material given, checked, or that of a chain of a characteristic length."""
    return _THICKNESS * length if thickness is None else number("thickness", thickness, positive=True, unit="m")


def density_bound(density: float, thickness: float, *, planar: bool, mass: float, length: float) -> Density:
    """Return the bound for material of a density [kg/m3], in the plane of a thickness [m], scaled."""
    if planar:
        return Density(least_flat(DISC, density, thickness, mass, length))
    return Density(usable(0.2 * (ball_radius(density, mass) / length) ** 2, density))


def ball_radius(density: float, mass: float) -> float:
    """Return the radius [m] of a ball of a density [kg/m3] and a mass [kg]."""
    return float(np.cbrt(3.0 * mass / (4.0 * np.pi * density)))


def least_flat(shape: float, density: float | str, thickness: float, mass: float, length: float) -> float:
    """Return the least I_c / m^2 of a flat piece, 1 / (shape d t), scaled."""
    return usable(mass / (shape * density_of(density) * thickness * length**2), density, thickness)


def usable(least: float, density: str | float, thickness: float | None = None) -> float:
    """Return the factor of a bound on density, refused where nothing can be computed with it."""
    if not 1.0 / _RANGE <= least <= _RANGE:
        name = "density" if thickness is None else "density and thickness"
        value = density if thickness is None else (density, thickness)
        rule = f"give inertias {least:.3g} x those of the mechanism, beyond 1 / {_RANGE:g} to {_RANGE:g}"
        raise InvalidInputError(name, value, rule, "Use kg/m3 and m, or material=None for any density.")
    return least

"""Counterweights that can be made, as bounds on their moments: discs, bars and balls of one material.

A flat piece of density d and thickness t, mass m, polar inertia I_c about its own centre and outer radius r has

    disc with a bore or without:   I_c >= m^2 / (2 pi d t),    r^2 =   I_c / m + m / (2 pi d t)
    bar, square or longer:         I_c >= m^2 / (6 d t),       r^2 = 3 I_c / m        (half its diagonal)

and equality on the left is the solid disc, the square bar. With w = m r both read w^2 = alpha m I_c + beta m^3, so

    w >= sqrt(alpha least + beta) m^(3/2)              every piece (convex: a bound from below on what can be made)
    w >= (r_0 m + (alpha I_c + beta m^2) / r_0) / 2    enough for a chosen r_0 (linear, exact where r = r_0)

and the piece lies within a ball of radius R about c when |m c' - m c| + w <= R m. A ball of density d has the radius
(3 m / (4 pi d))^(1/3) and the second moments k m^(5/3) in every direction, k = (3 / (4 pi d))^(2/3) / 5; of all bodies
no denser than d it is the one with the smallest det(second moments), so det(S_c)^(1/3) >= k m^(5/3) for any of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, frozen, number
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["MATERIALS", "Bar", "Disc", "Piece", "Sphere", "density_of"]

MATERIALS: Mapping[str, float] = {
    "aluminium": 2700.0,
    "brass": 8500.0,
    "lead": 11340.0,
    "steel": 7850.0,
    "tungsten": 19250.0,
}  # densities [kg/m3]
_IN_PLANE = 1e-9  # share of a line that must lie in the plane of motion [-]
_DISC, _BAR = 2.0 * np.pi, 6.0  # m^2 / (d t I_c) of a solid disc and of a square bar [-]
_RANGE = 1e12  # a bound on density is of use within this range of the mechanism's own inertia [-]
THICKNESS = 0.2  # of flat material unless given [chain lengths]
ARM = 0.2  # side of the arms that carry counterweights unless given [outer radii]


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
    return THICKNESS * length if thickness is None else number("thickness", thickness, positive=True, unit="m")


@dataclass(frozen=True, slots=True, eq=False)
class _Flat(Immutable):
    """What flat pieces have in common; see `Disc`."""

    density: float | str
    thickness: float
    line: npt.ArrayLike | None = None
    arm: float | None = None

    def __post_init__(self) -> None:
        density_of(self.density)
        number("thickness of the counterweight", self.thickness, positive=True, unit="m")
        _check_arm(self.arm)
        if self.line is not None:
            line = checked("line of the counterweight", self.line, (3,))
            if not line.any():
                raise InvalidInputError("line of the counterweight", line.tolist(), "must not be zero")
            object.__setattr__(self, "line", line)


@dataclass(frozen=True, slots=True, eq=False)
class Disc(_Flat):
    """Counterweights made as flat discs, solid or with a bore, of one material and thickness.

    Attributes:
        density: [kg/m3], or one of `MATERIALS`.
        thickness: along the normal of the plane [m].
        line: direction in joint axes (3,) along which the centres must lie, through the joint; anywhere unless given.
        arm: side [m] of the square arm of the same material that carries the disc, from the joint to its rim; a fifth
            of its outer radius unless given, 0 for none (the body itself carries it).
    """

    def solid(self, axes: Array, mass: float, length: float) -> Solid:
        """Return the bounds for scaled parameters of one body (axes (3, 3): rows e_1, e_2, n)."""
        least = _least_flat(_DISC, self.density, self.thickness, mass, length)
        return Solid("a disc", least, 1.0, least, _across(self.line, axes))


@dataclass(frozen=True, slots=True, eq=False)
class Bar(_Flat):
    """Counterweights made as flat rectangles, along the line from the joint to their centre.

    Attributes:
        density, thickness, line, arm: as for `Disc`.
    """

    def solid(self, axes: Array, mass: float, length: float) -> Solid:
        """Return the bounds for scaled parameters of one body (axes (3, 3): rows e_1, e_2, n)."""
        least = _least_flat(_BAR, self.density, self.thickness, mass, length)
        return Solid("a bar", least, 3.0, 0.0, _across(self.line, axes))


@dataclass(frozen=True, slots=True, eq=False)
class Sphere(Immutable):
    """Counterweights made as solid balls, for mechanisms of any kind.

    Attributes:
        density: [kg/m3], or one of `MATERIALS`.
        arm: as for `Disc`.
    """

    density: float | str
    arm: float | None = None

    def __post_init__(self) -> None:
        density_of(self.density)
        _check_arm(self.arm)

    def solid(self, axes: Array, mass: float, length: float) -> Solid:
        """Return the bounds for scaled parameters of one body (axes play no part)."""
        radius = ball_radius(density_of(self.density), mass) / length
        return Solid("a ball", _usable(0.2 * radius**2, self.density), 1.0, radius)


Piece = Disc | Bar | Sphere


@dataclass(frozen=True, slots=True, eq=False)
class Solid(Immutable):
    """Scaled bounds of a piece. Flat: I_c >= least m^2 and w^2 = alpha m I_c + beta m^3, w = m r.

    A ball: second moments about the centre >= least m^(5/3) and w >= beta m^(4/3).

    Attributes:
        word: "a disc", "a bar" or "a ball".
        least, alpha, beta: factors of the bounds.
        across: normal (2,) of the line that the centre must lie on, or None.
        radius: the r_0 for which the outer radius is bounded from above, or None for the bound from below.
    """

    word: str
    least: float
    alpha: float
    beta: float
    across: Array | None = None
    radius: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Density(Immutable):
    """Scaled bound on how dense material may be.

    Attributes:
        least: in the plane, I_c >= least m^2; in space, det(S_c)^(1/3) >= least m^(5/3).
    """

    least: float


def density_bound(density: float, thickness: float, *, planar: bool, mass: float, length: float) -> Density:
    """Return the bound for material of a density [kg/m3], in the plane of a thickness [m], scaled."""
    if planar:
        return Density(_least_flat(_DISC, density, thickness, mass, length))
    return Density(_usable(0.2 * (ball_radius(density, mass) / length) ** 2, density))


def ball_radius(density: float, mass: float) -> float:
    """Return the radius [m] of a ball of a density [kg/m3] and a mass [kg]."""
    return float(np.cbrt(3.0 * mass / (4.0 * np.pi * density)))


def _least_flat(shape: float, density: float | str, thickness: float, mass: float, length: float) -> float:
    """Return the least I_c / m^2 of a flat piece, 1 / (shape d t), scaled."""
    return _usable(mass / (shape * density_of(density) * thickness * length**2), density, thickness)


def _usable(least: float, density: str | float, thickness: float | None = None) -> float:
    """Return the factor of a bound on density, refused where nothing can be computed with it."""
    if not 1.0 / _RANGE <= least <= _RANGE:
        name = "density" if thickness is None else "density and thickness"
        value = density if thickness is None else (density, thickness)
        rule = f"give inertias {least:.3g} x those of the mechanism, beyond 1 / {_RANGE:g} to {_RANGE:g}"
        raise InvalidInputError(name, value, rule, "Use kg/m3 and m, or material=None for any density.")
    return least


def _across(line: npt.ArrayLike | None, axes: Array) -> Array | None:
    if line is None:
        return None
    flat = axes[:2] @ np.asarray(line)
    size = float(np.linalg.norm(flat))
    if size < _IN_PLANE * float(np.linalg.norm(line)):
        raise InvalidInputError("line of the counterweight", np.asarray(line).tolist(), "must not leave the plane")
    return frozen([-flat[1] / size, flat[0] / size])


def _check_arm(width: float | None) -> None:
    if width is not None and width != 0.0:
        number("side of the arm", width, positive=True, unit="m")

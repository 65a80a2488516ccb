"""Where a piece of material may lie, how dense and how heavy it may be: what all kinds of material have in common."""

from __future__ import annotations

from collections.abc import Mapping

from fivebar_pin._arrays import checked
from fivebar_pin.balancing.pieces.materials import Density, density_bound
from fivebar_pin.balancing.regions.ball import Ball
from fivebar_pin.balancing.regions.region import Region, resolve
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.variables.variable import MassBounds
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["check_names", "densest", "masses_of", "shape_of"]

_REACH = 1.0  # radius of the ball about the joint frame that material lies in unless given [chain lengths]


def shape_of(setting: Setting, b: int, region: Region | Mapping[str, Region] | None) -> Shape:
    """Return where material of a body may lie; a ball about the joint frame unless given."""
    chain, space = setting.chain, setting.space
    own = region.get(chain.joints[b]) if isinstance(region, Mapping) else region
    where = own or Ball(_REACH * chain.length)
    return resolve(where, chain, b, space.axes[b], planar=space.planar, unit=space.length)


def densest(setting: Setting, density: tuple[float, float] | None) -> Density | None:
    """Return the bound for material of a density [kg/m3] and a thickness [m], or None for any."""
    if density is None:
        return None
    return density_bound(*density, planar=setting.space.planar, mass=setting.mass, length=setting.space.length)


def masses_of(setting: Setting, b: int, masses: MassBounds) -> tuple[float, float] | None:
    """Return the bounds on the mass of the material of a body [kg], or None.

    Raises:
        UnknownNameError: a body that does not exist.
        InvalidInputError: bounds that are none.
    """
    name = setting.chain.joints[b]
    check_names(setting, masses, "mass bound")
    given = masses.get(name) if isinstance(masses, Mapping) else masses
    if given is None:
        return None
    low, high = (float(v) for v in checked(f"masses of {name}", given, (2,)))
    if not 0.0 <= low <= high:
        raise InvalidInputError(f"masses of {name}", (low, high), "must be 0 <= low <= high [kg]")
    return low, high


def check_names(setting: Setting, given: object, what: str) -> None:
    """Raise for a mapping by bodies of which one does not exist."""
    for name in given if isinstance(given, Mapping) else ():
        if name not in setting.chain.joints:
            raise UnknownNameError(f"body of a {what}", name, setting.chain.joints)

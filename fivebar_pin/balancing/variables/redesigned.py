"""Whole bodies in place of the present ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.variables.asked import material
from fivebar_pin.balancing.variables.material import Bounds
from fivebar_pin.balancing.variables.part import Part
from fivebar_pin.balancing.variables.placement import check_names, densest, masses_of, shape_of
from fivebar_pin.balancing.variables.variable import MassBounds, Stated, Variable, register
from fivebar_pin.errors import InvalidInputError

__all__ = ["RedesignedBodies"]

_LIGHTEST, _HEAVIEST = 0.5, 2.0  # of a redesigned body unless given [present masses]


@register("redesign")
@dataclass(frozen=True, slots=True, eq=False)
class RedesignedBodies(Variable):
    """Bodies made anew.

    Attributes:
        bodies, region, masses: as for `balance`.
        density: of the material [kg/m3], and its thickness [m]; None for any.
    """

    aim = "distance"

    bodies: Sequence[str] | None = None
    region: Region | Mapping[str, Region] | None = None
    masses: MassBounds = None
    density: tuple[float, float] | None = None

    @classmethod
    def of(cls, stated: Stated) -> RedesignedBodies:
        """Return it from the arguments of `balance`.

        Raises:
            InvalidInputError: counterweights, which are added, or bodies that lose material.
        """
        if stated.remove:
            raise InvalidInputError("remove", list(stated.remove), "has no meaning for a redesign")
        piece = stated.counterweight
        if piece is not None:
            word = "pieces" if isinstance(piece, Mapping) else type(piece).__name__
            raise InvalidInputError("counterweight", word, "needs mode 'add'")
        return cls(stated.bodies, stated.region, stated.masses, stated.density)

    def parts(self, setting: Setting) -> list[Part]:
        """Return one new body for each that may change."""
        check_names(setting, self.region, "region")
        return [self._part(setting, b) for b in setting.chosen(self.bodies)]

    def _part(self, setting: Setting, b: int) -> Part:
        present = float(setting.chain.inertial_parameters[b, 0])
        limits = Bounds(
            shape=shape_of(setting, b, self.region),
            density=densest(setting, self.density),
            masses=masses_of(setting, b, self.masses) or (_LIGHTEST * present, _HEAVIEST * present),
        )
        return material(b, 1, f"new body {setting.chain.joints[b]}", limits, planar=setting.space.planar, new=True)

"""Material taken from present bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import TINY, Array
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.variables.asked import material
from fivebar_pin.balancing.variables.material import Bounds
from fivebar_pin.balancing.variables.part import Part
from fivebar_pin.balancing.variables.placement import check_names, densest, shape_of
from fivebar_pin.balancing.variables.variable import Variable
from fivebar_pin.errors import InvalidInputError

__all__ = ["RemovedMaterial"]

_WHOLE = 1e-9  # negative eigenvalue of a pseudo-inertia that is round-off [of its mass, at the chain's length]


@dataclass(frozen=True, slots=True, eq=False)
class RemovedMaterial(Variable):
    """Material taken from bodies, up to half of their mass; what is left is a body, in space too.

    Attributes:
        bodies: names of their joints.
        region: where it may lie, one for all bodies or by body.
        density: that it has at most [kg/m3], and its thickness [m]; None for any.
    """

    bodies: Sequence[str]
    region: Region | Mapping[str, Region] | None = None
    density: tuple[float, float] | None = None

    def parts(self, setting: Setting) -> list[Part]:
        """Return one piece of material for each body."""
        check_names(setting, self.region, "region")
        return [self._part(setting, b) for b in setting.named(self.bodies, "remove")]

    def _part(self, setting: Setting, b: int) -> Part:
        limits = Bounds(
            shape=shape_of(setting, b, self.region),
            density=densest(setting, self.density),
            taken_from=_body(setting, b),
        )
        return material(b, -1, f"material removed from {setting.chain.joints[b]}", limits, planar=setting.space.planar)


def _body(setting: Setting, b: int) -> Array:
    """Return the body that material is taken from, which must exist in space and not only in the plane."""
    P = setting.body(b)
    lowest = float(np.linalg.eigvalsh(P)[0]) / max(float(P[3, 3]), TINY)
    if lowest < -_WHOLE:
        raise InvalidInputError(
            f"remove: inertia of body {setting.chain.joints[b]}",
            [float(v) for v in setting.chain.inertial_parameters[b]],
            f"is not that of a body in space (pseudo-inertia has the eigenvalue {lowest:.3g}, scaled)",
            "Give all six entries of its inertia: what is left must be a body.",
        )
    return P

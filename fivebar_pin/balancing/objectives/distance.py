"""How far a design is from the present one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.objectives.objective import Designs, Objective, register
from fivebar_pin.balancing.objectives.term import Term
from fivebar_pin.balancing.regressors.measures import Measurement

__all__ = ["DistanceMoved"]


@register
@dataclass(frozen=True, slots=True)
class DistanceMoved(Objective):
    """Length of the difference in the scaled parameters [-]."""

    word = "distance"
    quantity = None
    distance = True

    def term(self, designs: Designs) -> Term:
        """Return |E y + X0 - X|."""
        setting = designs.setting
        X = setting.space.of(setting.chain.inertial_parameters).reshape(-1) / setting.unit
        return Term(self.name, ((designs.E, designs.X0 - X),), False, 1.0)

    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return it for bodies of parameters (nb, 10)."""
        chain, space = measurement.chain, measurement.space
        assert space is not None
        away = space.of(pi - chain.inertial_parameters).reshape(-1) / (space.scale * (chain.mass or 1.0))
        return float(np.linalg.norm(away))

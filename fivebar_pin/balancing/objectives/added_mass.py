"""The mass that a design adds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.objectives.linear import Linear
from fivebar_pin.balancing.objectives.objective import register
from fivebar_pin.balancing.regressors.measures import Measurement

__all__ = ["AddedMass"]


@register
@dataclass(frozen=True, slots=True)
class AddedMass(Linear):
    """Moving mass less the present one [kg]."""

    word = "added_mass"
    quantity = None

    def weight(self, measurement: Measurement) -> Array:
        """Return one for every mass."""
        weight = np.zeros(measurement.chain.inertial_parameters.size)
        weight[::10] = 1.0
        return weight

    def start(self, measurement: Measurement) -> float:
        """Return the present mass."""
        return float(self.weight(measurement) @ measurement.chain.inertial_parameters.reshape(-1))

    def size(self, measurement: Measurement, pi: Array) -> float:
        """Return both masses together."""
        return measurement.chain.mass + float(pi[:, 0].sum())

"""The inertia that the motors feel."""

from __future__ import annotations

from dataclasses import dataclass

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.objectives.linear import Linear
from fivebar_pin.balancing.objectives.objective import register
from fivebar_pin.balancing.regressors.measures import Measurement, reflected_inertia

__all__ = ["Inertia"]


@register
@dataclass(frozen=True, slots=True)
class Inertia(Linear):
    """Mean trace of N^T M N of the bodies over the motions, rotors apart [kg m2]."""

    word = "inertia"
    quantity = None

    def weight(self, measurement: Measurement) -> Array:
        """Return the mean over all samples."""
        return reflected_inertia(measurement.chain, measurement.required(self.name))

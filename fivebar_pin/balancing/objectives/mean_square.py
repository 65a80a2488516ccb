"""Mean squares along motions."""

from __future__ import annotations

from dataclasses import dataclass

from fivebar_pin._arrays import ROUND_OFF, Array
from fivebar_pin.balancing.objectives.objective import AlongMotions, Designs, register
from fivebar_pin.balancing.objectives.rms import Rms
from fivebar_pin.balancing.objectives.term import Term
from fivebar_pin.balancing.regressors.measures import Measurement
from fivebar_pin.balancing.regressors.rows import Rows

__all__ = ["MeanSquare"]


@register
@dataclass(frozen=True, slots=True)
class MeanSquare(AlongMotions):
    """Square of the rms of a quantity."""

    word = "mean_square"
    squared = True

    quantity: str

    @property
    def root(self) -> Rms:
        """Return the rms."""
        return Rms(self.quantity)

    def term(self, designs: Designs) -> Term:
        """Return that of the rms."""
        return self.root.term(designs)

    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return it for bodies of parameters (nb, 10)."""
        rms = self.root.value(measurement, pi)
        return rms * rms

    def size(self, measurement: Measurement, pi: Array) -> float:
        """Return what makes it round-off when its root is."""
        rms = self.root.size(measurement, pi)
        return ROUND_OFF * rms * rms

    def rms_rows(self, measurement: Measurement) -> Rows:
        """Return the rows of the rms."""
        return self.rows(measurement)

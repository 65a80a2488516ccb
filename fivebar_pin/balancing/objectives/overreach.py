"""How far counterweights stick out of their regions, on the way to some that do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.objectives.objective import Designs, Objective
from fivebar_pin.balancing.objectives.term import Term, linear_term
from fivebar_pin.balancing.regressors.measures import Measurement

__all__ = ["Overreach"]


@dataclass(frozen=True, slots=True)
class Overreach(Objective):
    """How far all elastic pieces stick out of their regions together, times their masses, scaled.

    It is no property of the bodies, and counts as nothing once they are made; it has no shorthand.
    """

    word = "overreach"
    quantity = None

    def term(self, designs: Designs) -> Term:
        """Return the sum of the variables that say so."""
        row = np.zeros(designs.E.shape[1])
        row[[p.start + k for p in designs.parts if (k := p.part.sticks_out) is not None]] = 1.0
        return linear_term(self.name, row, 0.0, 1.0)

    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return nothing."""
        return 0.0

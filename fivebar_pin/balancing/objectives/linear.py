"""Atoms that are linear in the inertial parameters."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.objectives.objective import Designs, Objective
from fivebar_pin.balancing.objectives.term import Term, linear_term
from fivebar_pin.balancing.regressors.measures import Measurement

__all__ = ["Linear"]


class Linear(Objective):
    """weight . pi, less what it is now where it is a gain; may be negative."""

    __slots__ = ()

    @abstractmethod
    def weight(self, measurement: Measurement) -> Array:
        """Return the functional (10 nb,)."""

    def start(self, measurement: Measurement) -> float:
        """Return what is subtracted."""
        return 0.0

    def term(self, designs: Designs) -> Term:
        """Return weight . full_E y and what is left."""
        weight = self.weight(designs.measurement)
        constant = float(weight @ designs.pi0) - self.start(designs.measurement)
        return linear_term(self.name, weight @ designs.full_E, constant, abs(float(weight @ designs.present)) or 1.0)

    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return it for bodies of parameters (nb, 10)."""
        return float(self.weight(measurement) @ pi.reshape(-1)) - self.start(measurement)

    def values(self, measurement: Measurement, X: Array) -> Array:
        """Return it for many designs (k, 10 nb)."""
        return np.asarray(X @ self.weight(measurement) - self.start(measurement))

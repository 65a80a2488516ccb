"""Root mean squares along motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.objectives.objective import AlongMotions, Designs, register
from fivebar_pin.balancing.objectives.scale import typical
from fivebar_pin.balancing.objectives.term import Term
from fivebar_pin.balancing.regressors.measures import Measurement
from fivebar_pin.balancing.regressors.rows import Rows, root_mean_square

__all__ = ["Rms"]

_NOTHING = 1e-16  # rows of a triangular factor below this share of its largest entry are left out [-]


@register
@dataclass(frozen=True, slots=True)
class Rms(AlongMotions):
    """Root of the mean over all samples of the square of the length of a quantity, all rows summed."""

    word = "rms"

    quantity: str

    def term(self, designs: Designs) -> Term:
        """Return the length of the triangular factor of all rows, |R (y, 1)|."""
        rows = self.rows(designs.measurement)
        G, g = rows.F @ designs.full_E, rows.F @ designs.pi0 + rows.f
        stacked = np.column_stack([G.reshape(-1, G.shape[-1]), g.reshape(-1)]) / np.sqrt(len(g))
        R = np.asarray(np.linalg.qr(stacked, mode="r"))
        used = np.abs(R).max(axis=1) > _NOTHING * float(np.abs(R).max(initial=0.0))
        R = R[used] if used.any() else R[:1]
        scale = typical(rows, rows.rms(designs.present), designs.present)
        return Term(self.name, ((R[:, :-1], R[:, -1]),), False, scale)

    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return it for bodies of parameters (nb, 10)."""
        return self.rows(measurement).rms(pi)

    def size(self, measurement: Measurement, pi: Array) -> float:
        """Return the rms of the sizes of what adds up to each value."""
        rows = measurement.rows.get(self.quantity)
        return 0.0 if rows is None else root_mean_square(rows.sizes(pi))

    def rms_rows(self, measurement: Measurement) -> Rows:
        """Return the rows themselves."""
        return self.rows(measurement)

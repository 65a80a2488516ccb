"""Peaks along motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, reals
from fivebar_pin.balancing.objectives.objective import AlongMotions, Designs, positive_limit, register
from fivebar_pin.balancing.objectives.scale import typical
from fivebar_pin.balancing.objectives.term import Term
from fivebar_pin.balancing.regressors.measures import Measurement
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.errors import InvalidInputError

__all__ = ["Peak"]

_NOWHERE = 1e-15  # share of a direction in vectors along motions that is round-off [-]


@register
@dataclass(frozen=True, slots=True)
class Peak(AlongMotions):
    """Largest length of a quantity over all samples; of several motors, joints or closures the largest of all."""

    word = "peak"

    quantity: str

    def term(self, designs: Designs) -> Term:
        """Return the longest of all vectors."""
        rows = self.rows(designs.measurement)
        G, g = rows.F @ designs.full_E, rows.F @ designs.pi0 + rows.f
        vectors = tuple(pair for s in rows.groups for pair in _thin(G[:, s], g[:, s]))
        return Term(self.name, vectors, False, typical(rows, rows.peak(designs.present), designs.present))

    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return it for bodies of parameters (nb, 10)."""
        return self.rows(measurement).peak(pi)

    def size(self, measurement: Measurement, pi: Array) -> float:
        """Return the peak of the sizes of what adds up to each value."""
        rows = measurement.rows.get(self.quantity)
        return 0.0 if rows is None else rows.longest(rows.sizes(pi))

    def values(self, measurement: Measurement, X: Array) -> Array:
        """Return it for many designs (k, 10 nb)."""
        rows = self.rows(measurement)
        n, r, P = rows.F.shape
        values = (X @ rows.F.reshape(n * r, P).T + rows.f.reshape(-1)).reshape(len(X), n, r)
        values *= values
        lengths = [values[:, :, g].sum(axis=2).max(axis=1) for g in rows.groups]
        return np.asarray(np.sqrt(np.max(lengths, axis=0))) if lengths else np.zeros(len(X))

    def limits(self, designs: Designs, top: npt.ArrayLike) -> list[Block]:
        """Return the cones of an upper bound; where a quantity is one number for every motor, one for each of them."""
        rows = self.rows(designs.measurement)
        if not rows.single:
            return self.term(designs).bounded(positive_limit(self.name, top))
        given = np.atleast_1d(reals(f"limit of {self.name}", top))
        if given.shape not in ((1,), (len(rows.groups),)):
            rule = f"must be one number, or {len(rows.groups)}"
            raise InvalidInputError(f"limit of {self.name}", given.tolist(), rule)
        each = np.broadcast_to(given, (len(rows.groups),))
        G, g = rows.F @ designs.full_E, rows.F @ designs.pi0 + rows.f
        blocks = []
        for k, label in enumerate(rows.labels):
            limit = positive_limit(f"{self.name} of {label}", float(each[k]))
            both = np.concatenate([-G[:, k], G[:, k]]) / limit
            offset = 1.0 - np.r_[g[:, k], -g[:, k]] / limit
            blocks.append(Block(f"{self.name} of {label} <= {limit:g}", "nonneg", both, offset, np.ones(offset.size)))
        return blocks


def _thin(G: Array, g: Array) -> list[tuple[Array, Array]]:
    """Return vectors G y + g of the same lengths without the directions in which none ever points.

    A moment about the normal of a plane is one row instead of three: its cone is a pair of bounds.

    Args:
        G, g: one vector a sample (n, d, k), (n, d).
    """
    if g.shape[1] > 1:
        whole = np.moveaxis(np.concatenate([G, g[..., None]], axis=2), 1, 0).reshape(g.shape[1], -1)
        axes, size, _ = np.linalg.svd(whole, full_matrices=False)
        axes = axes[:, size > _NOWHERE * size[0]] if size[0] > 0.0 else axes[:, :1]
        G, g = np.matmul(axes.T, G), g @ axes
    return list(zip(G, g, strict=True))

"""revolute: a hinge, R_1^T (p_2 - p_1) = 0 and t_k . R_1^T R_2 n = 0 (k = 1, 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures.axis_closure import AxisClosure
from fivebar_pin.closures.closure import Entry
from fivebar_pin.closures.frame_closure import FramePair, point_drift, point_rows, point_selector
from fivebar_pin.closures.rows import Row, along, tilt

__all__ = ["Revolute"]


@dataclass(frozen=True, eq=False)
class Revolute(AxisClosure, word="revolute"):
    """A hinge: the points coincide and the axes are parallel. Five rows [m, -]."""

    row_names: ClassVar[tuple[str, ...]] = ("x", "y", "z", "tilt 1", "tilt 2")
    row_units: ClassVar[tuple[str, ...]] = ("m", "m", "m", "-", "-")
    entries: ClassVar[tuple[Entry, ...]] = (
        Entry("axis", 3, "a revolute closure needs its hinge axis, e.g. [0, 0, 1]"),
    )

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the three axes, and the two tilts."""
        n, across = self.triad
        return (*(along(axis) for axis in np.eye(3)), *(tilt(t, n) for t in across))

    def residual(self, pair: FramePair) -> Array:
        """Return the three rows of the points and the two tilts."""
        return np.concatenate([point_rows(pair), self.tilt(pair)], axis=-1)

    def selector(self, pair: FramePair) -> Array:
        """Return T (..., 5, 6)."""
        T = point_selector(pair, 5)
        T[..., 3:, 3:] = self.tilt_selector(pair)
        return T

    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return the second rate at zero joint accelerations; exact everywhere."""
        rates = point_drift(pair, V1, V2, A1, A2), self.tilt_drift(pair, V1, V2, A1, A2)
        return np.concatenate(rates, axis=-1)

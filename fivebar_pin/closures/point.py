"""3d: two points coincide, R_1^T (p_2 - p_1) = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures.frame_closure import FrameClosure, FramePair, point_drift, point_rows, point_selector
from fivebar_pin.closures.rows import Row, along

__all__ = ["Point"]


@dataclass(frozen=True, eq=False)
class Point(FrameClosure, word="3d"):
    """Two points coincide: a ball joint, or a pin of a planar loop. Three rows [m]."""

    row_names: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    row_units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    by_points: ClassVar[bool] = True

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the three axes."""
        return tuple(along(axis) for axis in np.eye(3))

    def residual(self, pair: FramePair) -> Array:
        """Return R_1^T (p_2 - p_1)."""
        return point_rows(pair)

    def selector(self, pair: FramePair) -> Array:
        """Return T (..., 3, 6)."""
        return point_selector(pair, 3)

    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return the second rate at zero joint accelerations; exact everywhere."""
        return point_drift(pair, V1, V2, A1, A2)

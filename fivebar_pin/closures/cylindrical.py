"""cylindrical: a hinge that may slide along its axis, t_k . R_1^T (p_2 - p_1) = 0 and t_k . R_1^T R_2 n = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures.axis_closure import AxisClosure
from fivebar_pin.closures.closure import Entry, Mark
from fivebar_pin.closures.frame_closure import FramePair, point_drift, point_rows, point_selector
from fivebar_pin.closures.rows import Row, along, tilt

__all__ = ["Cylindrical"]

_STRETCH = 2.5  # length of the axis that is drawn, in pins of a hinge [-]


@dataclass(frozen=True, eq=False)
class Cylindrical(AxisClosure, word="cylindrical"):
    """A hinge that may slide: frame 2 lies on the axis of frame 1, and the axes are parallel. Four rows [m, -].

    The links may be offset along the hinge, by whatever the rest of the mechanism makes of it. It carries no force
    along the axis and no moment about it.
    """

    row_names: ClassVar[tuple[str, ...]] = ("across 1", "across 2", "tilt 1", "tilt 2")
    row_units: ClassVar[tuple[str, ...]] = ("m", "m", "-", "-")
    entries: ClassVar[tuple[Entry, ...]] = (Entry("axis", 3, "a cylindrical closure needs its axis, e.g. [0, 0, 1]"),)

    @property
    def mark(self) -> Mark:
        """A long pin along the axis."""
        return Mark("pin", np.asarray(self.axis), stretch=_STRETCH)

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the two directions across the axis, and the two tilts."""
        n, across = self.triad
        return (*(along(t) for t in across), *(tilt(t, n) for t in across))

    def residual(self, pair: FramePair) -> Array:
        """Return the two rows across the axis and the two tilts."""
        return np.concatenate([point_rows(pair) @ self.triad[1].T, self.tilt(pair)], axis=-1)

    def selector(self, pair: FramePair) -> Array:
        """Return T (..., 4, 6)."""
        across = np.matmul(self.triad[1], point_selector(pair, 3))
        tilt = np.zeros_like(across)
        tilt[..., 3:] = self.tilt_selector(pair)
        return np.concatenate([across, tilt], axis=-2)

    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return the second rate at zero joint accelerations; exact everywhere."""
        across = point_drift(pair, V1, V2, A1, A2) @ self.triad[1].T
        return np.concatenate([across, self.tilt_drift(pair, V1, V2, A1, A2)], axis=-1)

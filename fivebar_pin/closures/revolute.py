"""revolute: a hinge, R_1^T (p_2 - p_1) = 0 and t_k . R_1^T R_2 n = 0 (k = 1, 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin.closures.axis_closure import AxisClosure
from fivebar_pin.closures.closure import Entry
from fivebar_pin.closures.rows import Row, along, tilt

__all__ = ["Revolute"]


@dataclass(frozen=True, eq=False)
class Revolute(AxisClosure, word="revolute"):
    """A hinge: the points coincide and the axes are parallel. Five rows [m, -]."""

    row_names: ClassVar[tuple[str, ...]] = ("x", "y", "z", "tilt 1", "tilt 2")
    entries: ClassVar[tuple[Entry, ...]] = (
        Entry("axis", 3, "a revolute closure needs its hinge axis, e.g. [0, 0, 1]"),
    )

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the three axes, and the two tilts."""
        n, across = self.triad
        return (*(along(axis) for axis in np.eye(3)), *(tilt(t, n) for t in across))

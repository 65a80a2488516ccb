"""cylindrical: a hinge that may slide along its axis, t_k . R_1^T (p_2 - p_1) = 0 and t_k . R_1^T R_2 n = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin.closures.axis_closure import AxisClosure
from fivebar_pin.closures.closure import Entry, Mark
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

"""3d: two points coincide, R_1^T (p_2 - p_1) = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.closures.rows import Row, along

__all__ = ["Point"]


@dataclass(frozen=True, eq=False)
class Point(FrameClosure, word="3d"):
    """Two points coincide: a ball joint, or a pin of a planar loop. Three rows [m]."""

    row_names: ClassVar[tuple[str, ...]] = ("x", "y", "z")

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the three axes."""
        return tuple(along(axis) for axis in np.eye(3))

"""6d: two frames coincide, R_1^T (p_2 - p_1) = 0 and log(R_1^T R_2) = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin.closures.closure import Mark
from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.closures.rows import Row, along, turned

__all__ = ["Weld"]


@dataclass(frozen=True, eq=False)
class Weld(FrameClosure, word="6d"):
    """Two frames coincide: the bodies are one. Six rows [m, rad]."""

    row_names: ClassVar[tuple[str, ...]] = ("x", "y", "z", "rx", "ry", "rz")

    @property
    def mark(self) -> Mark:
        """A box."""
        return Mark("box")

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the three axes, turned about them."""
        return (*(along(axis) for axis in np.eye(3)), *(turned(axis) for axis in np.eye(3)))

"""The rows that closures between frames are made of.

With frame 1 (axes R_1, origin p_1) and frame 2, b a vector of frame 1, n one of frame 2 and x_0 a number,

    along     b · R_1^T (p_2 - p_1) - x_0              length   |p_2 - p_1| - x_0
    tilt      b · R_1^T R_2 n - x_0                    turned   b · log(R_1^T R_2) - x_0
    spin      of velocities alone: R_2 n · (ω_2 - ω_1), its residual zero

Vectors are of length one. A kind of closure names its rows, and everything else follows: their equations are
those of `fivebar_pin.engine.rows`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, frozen

__all__ = ["Row", "Sort", "along", "length", "spin", "tilt", "turned"]

Sort = Literal["along", "tilt", "turned", "length", "spin"]

_ZERO = np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class Row(Immutable):
    """One row: its sort, b (3,), n (3,) and x_0 [m, rad or -]."""

    sort: Sort
    direction: Array
    other: Array
    number: float

    @property
    def unit(self) -> str:
        """Unit of the row: "m", "rad" or "-"."""
        return {"along": "m", "length": "m", "tilt": "-", "turned": "rad", "spin": "rad"}[self.sort]


def along(direction: npt.ArrayLike, number: float = 0.0) -> Row:
    """Return the row of two points at a distance x_0 along a vector of frame 1."""
    return Row("along", frozen(direction), frozen(_ZERO), number)


def tilt(direction: npt.ArrayLike, other: npt.ArrayLike, number: float = 0.0) -> Row:
    """Return the row of a vector of frame 1 and one of frame 2 at a cosine x_0."""
    return Row("tilt", frozen(direction), frozen(other), number)


def turned(direction: npt.ArrayLike, number: float = 0.0) -> Row:
    """Return the row of a rotation vector with the component x_0 along a vector of frame 1."""
    return Row("turned", frozen(direction), frozen(_ZERO), number)


def spin(other: npt.ArrayLike) -> Row:
    """Return the row of two bodies that do not turn on each other about a vector of frame 2."""
    return Row("spin", frozen(_ZERO), frozen(other), 0.0)


def length(number: float) -> Row:
    """Return the row of two points at a distance x_0."""
    return Row("length", frozen(_ZERO), frozen(_ZERO), number)

"""What holds freedoms that move nothing else at rest: rows of velocities alone, whose residual is always zero.

    spin      u · (ω_2 - ω_1) = 0, u an axis of frame 2: body 2 does not spin about it on body 1
    still     v_k = 0 for some velocity coordinates of one joint

They are no closures of a file: `mechanism.idle` puts them beside those that a chain has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, frozen
from fivebar_pin.closures.anchored import Anchored
from fivebar_pin.closures.closure import Closure, ClosureKind
from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.closures.rows import Row, spin

__all__ = ["AnchoredStill", "Spin", "Still"]

_AT_REST = ClosureKind("at rest")


@dataclass(frozen=True, eq=False)
class Spin(FrameClosure):
    """Body 2 does not spin, relative to body 1, about an axis (3,) of frame 2, unit. One row [rad/s]."""

    axis: npt.ArrayLike = (0.0, 0.0, 1.0)

    kind: ClassVar[ClosureKind] = _AT_REST
    row_names: ClassVar[tuple[str, ...]] = ("spin",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", frozen(self.axis))
        FrameClosure.__post_init__(self)

    @property
    def rows(self) -> tuple[Row, ...]:
        """About the axis."""
        return (spin(self.axis),)

    def values(self) -> dict[str, float | list[float]]:
        """Return the axis."""
        return {"axis": np.asarray(self.axis).tolist()}


@dataclass(frozen=True, eq=False)
class Still(Closure):
    """One velocity coordinate of a joint is zero. One row.

    Attributes:
        joint: its name.
        place: which of its velocity coordinates.
    """

    joint: str
    place: int

    kind: ClassVar[ClosureKind] = _AT_REST
    row_names: ClassVar[tuple[str, ...]] = ("still",)
    joined: ClassVar[int | None] = 1

    def __post_init__(self) -> None:
        self._settle()  # named after the joint

    @property
    def joins(self) -> tuple[str, ...]:
        """Name of the joint."""
        return (self.joint,)

    def check(self, model: pin.Model, frames: Mapping[str, pin.Frame]) -> None:
        """Do nothing: it is made for the model."""

    def anchor(
        self, model: pin.Model, frames: Mapping[str, pin.Frame], support: npt.NDArray[np.bool_], start: int
    ) -> AnchoredStill:
        """Find the coordinate."""
        j = int(model.getJointId(self.joint))
        column = np.array([int(model.idx_vs[j]) + self.place], dtype=np.intp)
        return AnchoredStill(self, slice(start, start + 1), (0, 0), (j,), column)


@dataclass(frozen=True, slots=True, eq=False)
class AnchoredStill(Anchored):
    """A coordinate at rest, found."""

    closure: Still

    def row_scale(self, length: float, column_scale: Array) -> Array:
        """Measure lengths in lengths of the chain."""
        return np.asarray(1.0 / column_scale[self.columns])

    def numbers(self) -> Array:
        """Return the ratio, one, and what the sum is, zero."""
        return np.array([1.0, 0.0])

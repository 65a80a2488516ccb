"""Closures between two frames: frame 1 on one body, frame 2 on another.

The rows are written in the axes of frame 1, so that the redundant rows of a planar loop are constant combinations
whichever way the plane lies or moves. A kind of this branch names its rows.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, all_of
from fivebar_pin.closures.anchored import Anchored, FramePair, Segment
from fivebar_pin.closures.closure import Closure
from fivebar_pin.closures.rows import Row
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["AnchoredFrames", "FrameClosure"]


@dataclass(frozen=True, eq=False)
class FrameClosure(Closure):
    """A closure between two frames of the open tree; abstract.

    Attributes:
        frames: names of frame 1 and frame 2; they coincide (up to what the kind leaves free) when the loop is closed.
        is_rod: it is drawn as a rod between the two points.
    """

    frames: tuple[str, str]

    is_rod: ClassVar[bool] = False

    def __post_init__(self) -> None:
        frames = all_of("closure frames", self.frames, str)
        if isinstance(self.frames, str) or len(frames) != 2 or not all(frames):
            raise InvalidInputError("closure frames", self.frames, "must be two frame names")
        self._settle(frames=frames)

    @property
    @abstractmethod
    def rows(self) -> tuple[Row, ...]:
        """Its rows."""

    def opposed(self, pair: FramePair) -> npt.NDArray[np.bool_]:
        """Return where the loop is closed falsely (...)."""
        return np.zeros(pair.p1.shape[:-1], dtype=np.bool_)

    @property
    def joins(self) -> tuple[str, ...]:
        """Names of the two frames."""
        return self.frames

    @property
    def ends(self) -> tuple[str, ...]:
        """Names of the two frames."""
        return self.frames

    def check(self, model: pin.Model, frames: Mapping[str, pin.Frame]) -> None:
        """Raise where a frame does not exist or both are on one body."""
        for frame in self.frames:
            if frame not in frames:
                raise UnknownNameError(f"frame of closure {self.name}", frame, frames)
        first, second = (frames[f].parentJoint for f in self.frames)
        if first == second:
            raise InvalidInputError(
                f"closure {self.name}", self.frames, f"joins two frames of one body ({model.names[first]})"
            )

    def anchor(
        self, model: pin.Model, frames: Mapping[str, pin.Frame], support: npt.NDArray[np.bool_], start: int
    ) -> AnchoredFrames:
        """Find both frames."""
        one, two = (frames[f] for f in self.frames)
        i, j = int(one.parentJoint), int(two.parentJoint)
        sign = support[j].astype(float) - support[i].astype(float)
        columns = np.flatnonzero(sign)
        return AnchoredFrames(
            self,
            slice(start, start + len(self.row_names)),
            (i, j),
            (i, j),
            columns,
            (np.array(one.placement.rotation), np.array(two.placement.rotation)),
            (np.array(one.placement.translation), np.array(two.placement.translation)),
            sign[columns],
        )


@dataclass(frozen=True, slots=True, eq=False)
class AnchoredFrames(Anchored):
    """A closure with its frames found.

    Attributes:
        R, p: placements of the frames in their joints.
        sign: +1 where a column moves only body 2, -1 only body 1.
    """

    closure: FrameClosure
    R: tuple[Array, Array]
    p: tuple[Array, Array]
    sign: Array

    def row_scale(self, length: float, column_scale: Array) -> Array:
        """Measure lengths in lengths of the chain."""
        return np.array([1.0 / length if row.unit == "m" else 1.0 for row in self.closure.rows])

    def numbers(self) -> Array:
        """Return the placements of the frames and the values of the closure."""
        placed = [x.ravel() for x in (*self.R, *self.p)]
        return np.concatenate([*placed, *(np.ravel(x) for x in self.closure.values().values())])

    def opposed(self, pair: FramePair) -> npt.NDArray[np.bool_]:
        """Return where the loop is closed falsely (n,)."""
        return self.closure.opposed(pair)

    def segments(self) -> tuple[Segment, ...]:
        """Return the rod, where it is one."""
        return (Segment(self.joints, self.p, rod=True),) if self.closure.is_rod else ()

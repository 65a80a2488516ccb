"""Closures between two frames: frame 1 on one body, frame 2 on another.

The rows are written in the axes of frame 1, so that the redundant rows of a planar loop are constant combinations
whichever way the plane lies or moves. A kind of this branch is its equations: residual, selector and drift of a pair
of frames with poses R_i, p_i in the world, on bodies with velocities V_i and accelerations A_i.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, all_of, cross, skew
from fivebar_pin.closures.anchored import Anchored, Segment, TreePoses, TreeRates
from fivebar_pin.closures.closure import Closure
from fivebar_pin.closures.rows import Row
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = [
    "AnchoredFrames",
    "FrameClosure",
    "FramePair",
    "point_accelerations",
    "point_drift",
    "point_rows",
    "point_selector",
    "point_velocity",
]


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """World poses of the two frames of a closure. R (..., 3, 3), p (..., 3)."""

    R1: Array
    p1: Array
    R2: Array
    p2: Array


@dataclass(frozen=True, eq=False)
class FrameClosure(Closure):
    """A closure between two frames of the open tree; abstract.

    Attributes:
        frames: names of frame 1 and frame 2; they coincide (up to what the kind leaves free) when the loop is closed.
        row_units: unit of every row: "m", "rad" or "-".
        is_rod: it is drawn as a rod between the two points.
    """

    frames: tuple[str, str]

    row_units: ClassVar[tuple[str, ...]]
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

    @abstractmethod
    def residual(self, pair: FramePair) -> Array:
        """Return the rows that vanish when the loop is closed (..., m)."""

    @abstractmethod
    def selector(self, pair: FramePair) -> Array:
        """Return T (..., m, 6): residual rate = T @ (velocity of body 2 minus body 1, world axes and origin)."""

    @abstractmethod
    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return the residual's second rate when the joint accelerations are zero (..., m).

        V_i, A_i (..., 6) are the spatial velocity and bias acceleration of the bodies that carry the frames, world
        axes at the world origin.
        """

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

    def look(self, poses: TreePoses) -> FramePair:
        """Return the world poses of both frames."""
        (i, j), (Ri, Rj), (pi, pj) = self.joints, self.R, self.p
        return FramePair(
            np.matmul(poses.R[i], Ri),
            poses.p[i] + np.matmul(poses.R[i], pi),
            np.matmul(poses.R[j], Rj),
            poses.p[j] + np.matmul(poses.R[j], pj),
        )

    def residual(self, seen: FramePair) -> Array:
        """Return the rows (n, m)."""
        return self.closure.residual(seen)

    def jacobian(self, seen: FramePair, poses: TreePoses) -> Array:
        """Return the Jacobian in its columns (n, m, columns)."""
        return np.asarray(np.matmul(self.closure.selector(seen), poses.S[:, :, self.columns] * self.sign))

    def drift(self, seen: FramePair, rates: TreeRates) -> Array:
        """Return the second rate at zero joint accelerations (n, m)."""
        i, j = self.joints
        return self.closure.drift(seen, rates.V[i], rates.V[j], rates.A[i], rates.A[j])

    def selector(self, seen: FramePair) -> Array:
        """Return T (n, m, 6)."""
        return self.closure.selector(seen)

    def place(self, seen: FramePair) -> tuple[Array, Array]:
        """Return the origin of frame 2 and the axes of frame 1."""
        return seen.p2, seen.R1

    def row_scale(self, length: float, column_scale: Array) -> Array:
        """Measure lengths in lengths of the chain."""
        return np.array([1.0 / length if unit == "m" else 1.0 for unit in self.closure.row_units])

    def numbers(self) -> Array:
        """Return the placements of the frames and the values of the closure."""
        placed = [x.ravel() for x in (*self.R, *self.p)]
        return np.concatenate([*placed, *(np.ravel(x) for x in self.closure.values().values())])

    def opposed(self, seen: FramePair) -> npt.NDArray[np.bool_]:
        """Return where the loop is closed falsely (n,)."""
        return self.closure.opposed(seen)

    def segments(self) -> tuple[Segment, ...]:
        """Return the rod, where it is one."""
        return (Segment(self.joints, self.p, rod=True),) if self.closure.is_rod else ()


def point_rows(pair: FramePair) -> Array:
    """Return R_1^T (p_2 - p_1), (..., 3) [m]."""
    return np.asarray(np.matmul(np.swapaxes(pair.R1, -1, -2), (pair.p2 - pair.p1)[..., None])[..., 0])


def point_selector(pair: FramePair, rows: int) -> Array:
    """Return T (..., rows, 6) of which the first three rows are those of `point_rows`, the others zero."""
    R1T = np.swapaxes(pair.R1, -1, -2)
    T = np.zeros((*pair.p1.shape[:-1], rows, 6))
    T[..., :3, :3] = R1T
    T[..., :3, 3:] = -np.matmul(R1T, skew(pair.p2))
    return T


def point_drift(pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
    """Return the second rate of `point_rows` (..., 3); exact everywhere."""
    w1 = V1[..., 3:]
    d = pair.p2 - pair.p1
    a2, a1 = point_accelerations(pair, V1, V2, A1, A2)
    d_rate = point_velocity(V2, pair.p2) - point_velocity(V1, pair.p1)
    local_rate = d_rate - cross(w1, d)
    point: Array = a2 - a1 - cross(A1[..., 3:], d) - cross(w1, cross(w1, d)) - 2.0 * cross(w1, local_rate)
    return np.asarray(np.matmul(np.swapaxes(pair.R1, -1, -2), point[..., None])[..., 0])


def point_velocity(V: Array, p: Array) -> Array:
    """Return the velocity of the point p of a body (..., 3)."""
    return np.asarray(V[..., :3] + cross(V[..., 3:], p))


def point_accelerations(pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> tuple[Array, Array]:
    """Return the accelerations of the origins of frame 2 and of frame 1, in this order (..., 3)."""
    return _point_acceleration(V2, A2, pair.p2), _point_acceleration(V1, A1, pair.p1)


def _point_acceleration(V: Array, A: Array, p: Array) -> Array:
    return np.asarray(A[..., :3] + cross(A[..., 3:], p) + cross(V[..., 3:], point_velocity(V, p)))

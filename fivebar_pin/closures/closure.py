"""The kinds of loop closure and the rows each contributes.

A closure joins frame 1 on one body to frame 2 on another. Its rows are written in the axes of frame 1, so that
the redundant rows of a planar loop are constant combinations whichever way the plane lies or moves.
With p_i, R_i the pose of frame i in the world and Q = R_1^T R_2:

    3d        R_1^T (p_2 - p_1)                                   three rows [m]
    6d        the same, and log(Q)                                six rows [m, rad]
    revolute  the same three, and t_k . Q n  (k = 1, 2)           five rows [m, -]

where n is the hinge axis (the same coordinates in both frames) and t_1, t_2 complete it to an orthonormal triad.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, all_of, checked, cross, frozen, skew
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Closure", "ClosureKind"]


class ClosureKind(str, Enum):
    """What a closure holds together."""

    POINT = "3d"
    WELD = "6d"
    REVOLUTE = "revolute"

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return {"3d": 3, "6d": 6, "revolute": 5}[self.value]

    @classmethod
    def parse(cls, text: object) -> ClosureKind:
        """Return the kind written in a sidecar, in any letter case."""
        if isinstance(text, cls):
            return text
        try:
            return cls(str(text).strip().lower())
        except ValueError:
            raise UnknownNameError("closure kind", text, [k.value for k in cls]) from None


@dataclass(frozen=True, slots=True, eq=False)
class Closure(Immutable):
    """A loop closure between two frames of the open tree.

    Attributes:
        frames: names of frame 1 and frame 2; they coincide (up to what the kind leaves free) when the loop is closed.
        kind: rows it holds; a `ClosureKind` or its sidecar word ("3d", "6d", "revolute").
        axis: hinge axis of a revolute closure, unit, in the axes of either frame; unused by the other kinds.
        name: what messages call it; made from the frames unless given.
    """

    frames: tuple[str, str]
    kind: ClosureKind = ClosureKind.POINT
    axis: npt.ArrayLike = field(default=(0.0, 0.0, 1.0), repr=False)
    name: str = ""

    def __post_init__(self) -> None:
        frames = all_of("closure frames", self.frames, str)
        if isinstance(self.frames, str) or len(frames) != 2 or not all(frames):
            raise InvalidInputError("closure frames", self.frames, "must be two frame names")
        object.__setattr__(self, "frames", frames)
        object.__setattr__(self, "kind", ClosureKind.parse(self.kind))
        axis = checked("closure axis", self.axis, (3,))
        longest = float(np.abs(axis).max())
        if longest < 1e-9:
            raise InvalidInputError("closure axis", axis.tolist(), "must not be zero")
        axis = axis / longest if longest > 1e100 else axis  # the square of its length would overflow
        object.__setattr__(self, "axis", frozen(axis / np.linalg.norm(axis)))
        object.__setattr__(self, "name", self.name or f"{frames[0]}~{frames[1]}")

    @property
    def row_names(self) -> tuple[str, ...]:
        """Names of the rows, in the axes of frame 1."""
        rotation = {
            ClosureKind.POINT: (),
            ClosureKind.WELD: ("rx", "ry", "rz"),
            ClosureKind.REVOLUTE: ("tilt 1", "tilt 2"),
        }[self.kind]
        return ("x", "y", "z", *rotation)


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """World poses of the two frames of a closure. R (..., 3, 3), p (..., 3)."""

    R1: Array
    p1: Array
    R2: Array
    p2: Array


def residual(closure: Closure, pair: FramePair) -> Array:
    """Return the rows that vanish when the loop is closed, (..., m)."""
    R1T = np.swapaxes(pair.R1, -1, -2)
    point: Array = np.matmul(R1T, (pair.p2 - pair.p1)[..., None])[..., 0]
    if closure.kind is ClosureKind.POINT:
        return point
    Q = np.matmul(R1T, pair.R2)
    if closure.kind is ClosureKind.WELD:
        return np.concatenate([point, log3(Q)], axis=-1)
    n, T = _triad(closure)
    return np.concatenate([point, np.matmul(Q, n) @ T.T], axis=-1)


def selector(closure: Closure, pair: FramePair) -> Array:
    """Return T (..., m, 6): residual rate = T @ (velocity of body 2 minus body 1, world axes, at the world origin)."""
    R1T = np.swapaxes(pair.R1, -1, -2)
    T = np.zeros((*pair.p1.shape[:-1], closure.kind.rows, 6))
    T[..., :3, :3] = R1T
    T[..., :3, 3:] = -np.matmul(R1T, skew(pair.p2))
    if closure.kind is ClosureKind.WELD:
        T[..., 3:, 3:] = np.matmul(_left_jacobian_inverse(log3(np.matmul(R1T, pair.R2))), R1T)
    elif closure.kind is ClosureKind.REVOLUTE:
        n, tilt = _triad(closure)
        Qn = np.matmul(np.matmul(R1T, pair.R2), n)
        T[..., 3:, 3:] = np.matmul(cross(Qn[..., None, :], tilt), R1T)
    return T


def drift(closure: Closure, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
    """Return the residual's second rate when the joint accelerations are zero, (..., m).

    V_i, A_i (..., 6) are the spatial velocity and bias acceleration of the bodies that carry the frames, world axes
    at the world origin. The rotation rows of a weld are exact on the closed loop, the others everywhere.
    """
    w1, w2 = V1[..., 3:], V2[..., 3:]
    d = pair.p2 - pair.p1
    a2 = _point_acceleration(V2, A2, pair.p2)
    a1 = _point_acceleration(V1, A1, pair.p1)
    d_rate = _point_velocity(V2, pair.p2) - _point_velocity(V1, pair.p1)
    local_rate = d_rate - cross(w1, d)
    point: Array = a2 - a1 - cross(A1[..., 3:], d) - cross(w1, cross(w1, d)) - 2.0 * cross(w1, local_rate)
    R1T = np.swapaxes(pair.R1, -1, -2)
    point = np.matmul(R1T, point[..., None])[..., 0]
    if closure.kind is ClosureKind.POINT:
        return point
    w = np.matmul(R1T, (w2 - w1)[..., None])[..., 0]
    alpha = np.matmul(R1T, (A2[..., 3:] - A1[..., 3:] - cross(w1, w2))[..., None])[..., 0]
    if closure.kind is ClosureKind.WELD:
        return np.concatenate([point, alpha], axis=-1)
    n, tilt = _triad(closure)
    Qn = np.matmul(np.matmul(R1T, pair.R2), n)
    return np.concatenate([point, (cross(alpha, Qn) + cross(w, cross(w, Qn))) @ tilt.T], axis=-1)


def opposed(closure: Closure, pair: FramePair) -> npt.NDArray[np.bool_]:
    """Return where a revolute closure is met with its two axes pointing against each other (a false solution)."""
    if closure.kind is not ClosureKind.REVOLUTE:
        return np.zeros(pair.p1.shape[:-1], dtype=np.bool_)
    n, _ = _triad(closure)
    Qn = np.matmul(np.matmul(np.swapaxes(pair.R1, -1, -2), pair.R2), n)
    return np.asarray(Qn @ n < 0.0)


def log3(Q: Array) -> Array:
    """Return the rotation vector of Q, (..., 3, 3) -> (..., 3) [rad], accurate near zero and near half a turn."""
    from scipy.spatial.transform import Rotation

    flat = np.reshape(Q, (-1, 3, 3))
    return np.asarray(Rotation.from_matrix(flat).as_rotvec()).reshape(*Q.shape[:-2], 3)


def _left_jacobian_inverse(phi: Array) -> Array:
    """Return J_l^-1(phi): rate of the rotation vector = J_l^-1 @ (angular velocity in the fixed axes)."""
    angle2 = np.sum(phi * phi, axis=-1)[..., None, None]
    angle = np.sqrt(angle2)
    half = 0.5 * angle
    small = angle < 1e-3
    safe = np.where(small, 1.0, half)
    b = np.where(small, 1.0 / 12.0 + angle2 / 720.0, (1.0 - safe / np.tan(safe)) / np.where(small, 1.0, angle2))
    K = skew(phi)
    return np.asarray(np.eye(3) - 0.5 * K + b * np.matmul(K, K))


def _triad(closure: Closure) -> tuple[Array, Array]:
    """Return the hinge axis n (3,) and the two rows t_k (2, 3) that complete it."""
    n = np.asarray(closure.axis, dtype=np.float64)
    t1 = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    t1 /= np.linalg.norm(t1)
    return n, np.stack([t1, np.cross(n, t1)])


def _point_velocity(V: Array, p: Array) -> Array:
    return np.asarray(V[..., :3] + cross(V[..., 3:], p))


def _point_acceleration(V: Array, A: Array, p: Array) -> Array:
    return np.asarray(A[..., :3] + cross(A[..., 3:], p) + cross(V[..., 3:], _point_velocity(V, p)))

"""Two frames over a batch: their points and turns, and how these move with the bodies that carry them.

V_i, A_i (..., 6) are the spatial velocity and acceleration of the bodies, world axes at the world origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, cross, skew

__all__ = [
    "FramePair",
    "left_jacobian_inverse",
    "log3",
    "point_accelerations",
    "point_drift",
    "point_rows",
    "point_selector",
    "point_velocity",
]

_SMALL = 1e-3  # angle below which the series of the left Jacobian is exact to round-off [rad]


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """World poses of the two frames of a closure. R (..., 3, 3), p (..., 3)."""

    R1: Array
    p1: Array
    R2: Array
    p2: Array


def point_rows(pair: FramePair) -> Array:
    """Return R_1^T (p_2 - p_1), (..., 3) [m]."""
    return np.asarray(np.matmul(np.swapaxes(pair.R1, -1, -2), (pair.p2 - pair.p1)[..., None])[..., 0])


def point_selector(pair: FramePair) -> Array:
    """Return T (..., 3, 6) of `point_rows`."""
    R1T = np.swapaxes(pair.R1, -1, -2)
    return np.concatenate([R1T, -np.matmul(R1T, skew(pair.p2))], axis=-1)


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


def log3(Q: Array) -> Array:
    """Return the rotation vector of Q, (..., 3, 3) -> (..., 3) [rad], accurate near zero and near half a turn."""
    from scipy.spatial.transform import Rotation

    flat = np.reshape(Q, (-1, 3, 3))
    return np.asarray(Rotation.from_matrix(flat).as_rotvec()).reshape(*Q.shape[:-2], 3)


def left_jacobian_inverse(phi: Array) -> Array:
    """Return J_l^-1(phi): rate of the rotation vector = J_l^-1 @ (angular velocity in the fixed axes)."""
    angle2 = np.sum(phi * phi, axis=-1)[..., None, None]
    angle = np.sqrt(angle2)
    half = 0.5 * angle
    small = angle < _SMALL
    safe = np.where(small, 1.0, half)
    b = np.where(small, 1.0 / 12.0 + angle2 / 720.0, (1.0 - safe / np.tan(safe)) / np.where(small, 1.0, angle2))
    K = skew(phi)
    return np.asarray(np.eye(3) - 0.5 * K + b * np.matmul(K, K))

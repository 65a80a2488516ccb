"""Rotations: the rotation vector from one frame to another, and its rates."""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.vectors import Matrix, Vector, add, cross, dot, product, scaled

__all__ = ["quaternion_of", "rotation_vector", "turning_moment"]

_SMALL = 1e-3  # angle below which a series is exact to round-off [rad]


@compiled
def rotation_vector(R1: Matrix, R2: Matrix) -> Vector:
    """Return log(R_1^T R_2) in world axes, that is R_1 log(...) [rad]."""
    # of the quaternion of R_2 R_1^T, whose real part is taken as not negative
    Q = product(R2, (R1[0], R1[3], R1[6], R1[1], R1[4], R1[7], R1[2], R1[5], R1[8]))
    x, y, z, w = quaternion_of(Q)
    s = sqrt(x * x + y * y + z * z)
    if s == 0.0:
        return 0.0, 0.0, 0.0
    return scaled(2.0 * atan2(s, w) / s, (x, y, z))


@compiled
def quaternion_of(Q: Matrix) -> tuple[float, float, float, float]:
    """Return a rotation as a quaternion x, y, z, w with w >= 0, exact near half a turn too [Shepperd 1978]."""
    trace = Q[0] + Q[4] + Q[8]
    largest = max(trace, Q[0], Q[4], Q[8])
    if largest == trace:
        w = sqrt(max(1.0 + trace, 0.0))
        k = 0.5 / w
        x, y, z, w = k * (Q[7] - Q[5]), k * (Q[2] - Q[6]), k * (Q[3] - Q[1]), 0.5 * w
    elif largest == Q[0]:
        x = sqrt(max(1.0 + Q[0] - Q[4] - Q[8], 0.0))
        k = 0.5 / x
        x, y, z, w = 0.5 * x, k * (Q[1] + Q[3]), k * (Q[2] + Q[6]), k * (Q[7] - Q[5])
    elif largest == Q[4]:
        y = sqrt(max(1.0 - Q[0] + Q[4] - Q[8], 0.0))
        k = 0.5 / y
        x, y, z, w = k * (Q[1] + Q[3]), 0.5 * y, k * (Q[5] + Q[7]), k * (Q[2] - Q[6])
    else:
        z = sqrt(max(1.0 - Q[0] - Q[4] + Q[8], 0.0))
        k = 0.5 / z
        x, y, z, w = k * (Q[2] + Q[6]), k * (Q[5] + Q[7]), 0.5 * z, k * (Q[3] - Q[1])
    if w < 0.0:
        return -x, -y, -z, -w
    return x, y, z, w


@compiled
def turning_moment(phi: Vector, b: Vector) -> Vector:
    """Return J_l^-T b: the rate of b · phi for fixed b is this times the relative angular velocity."""
    angle2 = dot(phi, phi)
    angle = sqrt(angle2)
    if angle < _SMALL:
        k = 1.0 / 12.0 + angle2 / 720.0
    else:
        half = 0.5 * angle
        k = (1.0 - half * cos(half) / sin(half)) / angle2
    # J_l^-1 = 1 - K / 2 + k K K, K = [phi]x, and K^T = -K
    along = cross(phi, b)
    return add(add(b, scaled(0.5, along)), scaled(k, cross(phi, along)))

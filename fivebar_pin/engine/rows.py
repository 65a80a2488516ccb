"""The rows of closures at one sample: what they leave open, the wrenches they stand for, Jacobian and drift.

A closure joins frame 1, with axes R_1 and origin P_1 on one body, and frame 2 on another. With the directions b of
frame 1 and n of frame 2 its rows are

    along     b · R_1^T (P_2 - P_1) - x_0              tilt     b · R_1^T R_2 n - x_0
    turned    b · log(R_1^T R_2) - x_0                 length   |P_2 - P_1| - x_0
    ratio     sum_k c_k q_k - offset

The rate of a row is the power of a wrench, a force f at P_2 and a moment m, on the velocity of body 2 relative to body 1:
its entries in the Jacobian are the powers of this wrench on what single coordinates move [Ball 1900], and its multiple by
lambda is what the closure does to body 2. Rows are measured in lengths of the chain.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.tables import (
    ACCELERATION,
    ALONG,
    ALPHA,
    CLOSURE_SIZE,
    CLOSURES,
    CLOSURES_END,
    COLUMN,
    COLUMN_SIZE,
    COLUMNS,
    DIRECTION,
    ENTRY0,
    ENTRY0_END,
    ENTRY_AXIS,
    ENTRY_CENTRE,
    ENTRY_MOTION,
    ENTRY_PITCH,
    ENTRY_SIZE,
    FORCE,
    FRAMES,
    JACOBIAN0,
    LEAD,
    MOMENT,
    OFFSET,
    OMEGA,
    ORIGIN,
    OTHER,
    POINT,
    POSE1,
    POSE2,
    RATE1,
    RATE2,
    RATIO,
    RESIDUAL,
    ROTATION,
    ROW0,
    ROW0_END,
    ROW_SIZE,
    SECOND_FRAME,
    SIGN,
    SORT,
    TIES,
    TILT,
    TURNED,
    UNIT,
    VELOCITY,
    WRENCH,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import coordinate, power
from fivebar_pin.engine.vectors import (
    Matrix,
    Vector,
    add,
    cross,
    dot,
    length_of,
    matrix_at,
    product,
    put,
    scaled,
    sub,
    times,
    vector_at,
)  # fmt: skip

__all__ = ["drifts", "frame_of", "jacobian", "look", "motion_of_point", "rotation_vector"]

_SMALL = 1e-3  # angle below which a series is exact to round-off [rad]


@compiled
def frame_of(W: Array, pose: int, k: int) -> tuple[Matrix, Vector]:
    """Return axes and origin in the world of a frame whose placement on a link stands from W[k] on."""
    R = matrix_at(W, pose + ROTATION)
    p = add(vector_at(W, pose + ORIGIN), times(R, vector_at(W, k + ORIGIN)))
    return product(R, matrix_at(W, k + ROTATION)), p


@compiled
def look(I: Integers, W: Array) -> None:
    """Write the residuals of all rows and the wrenches of those between frames, scaled."""
    for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
        if I[c + TIES] == 1:
            _tie(I, W, c)
        else:
            R1, P1 = frame_of(W, I[c + POSE1], I[c + FRAMES])
            R2, P2 = frame_of(W, I[c + POSE2], I[c + FRAMES] + SECOND_FRAME)
            for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
                residual, f, m = _row(W, I[r + SORT], I[r + DIRECTION], R1, R2, sub(P2, P1))
                W[I[r + RESIDUAL]] = residual
                put(W, I[r + WRENCH] + FORCE, f)
                put(W, I[r + WRENCH] + MOMENT, m)
                put(W, I[r + WRENCH] + POINT, P2)


@compiled
def _tie(I: Integers, W: Array, c: int) -> None:
    """Write the residual of coordinates that are tied to each other, scaled."""
    r = I[c + ROW0]
    total = -W[I[r + DIRECTION] + OFFSET]
    for e in range(I[c + ENTRY0], I[c + ENTRY0_END], ENTRY_SIZE):
        total += W[I[e + RATIO]] * coordinate(I, W, I[COLUMNS] + COLUMN_SIZE * I[e + COLUMN])
    W[I[r + RESIDUAL]] = W[I[r + DIRECTION] + UNIT] * total


@compiled
def _row(W: Array, sort: int, k: int, R1: Matrix, R2: Matrix, d: Vector) -> tuple[float, Vector, Vector]:
    """Return residual, force and moment of the row whose direction stands from W[k] on, scaled."""
    b, zero = times(R1, vector_at(W, k)), (0.0, 0.0, 0.0)
    if sort == ALONG:
        gap, f, m = dot(b, d), b, zero
    elif sort == TILT:
        n = times(R2, vector_at(W, k + OTHER))
        gap, f, m = dot(b, n), zero, cross(n, b)
    elif sort == TURNED:
        phi = rotation_vector(R1, R2)
        gap, f, m = dot(b, phi), zero, _turning(phi, b)
    else:
        gap = length_of(d)
        f, m = scaled(1.0 / gap, d) if gap > 0.0 else (R1[0], R1[3], R1[6]), zero
    unit = W[k + UNIT]
    return unit * (gap - W[k + OFFSET]), scaled(unit, f), scaled(unit, m)


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
def _turning(phi: Vector, b: Vector) -> Vector:
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


@compiled
def jacobian(I: Integers, W: Array) -> None:
    """Write the entries of the closure Jacobian, row after row, in the order of the entries of the closure."""
    for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
        for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
            k = I[r + JACOBIAN0]
            if I[c + TIES] == 1:
                for e in range(I[c + ENTRY0], I[c + ENTRY0_END], ENTRY_SIZE):
                    W[k] = W[I[r + DIRECTION] + UNIT] * W[I[e + RATIO]]
                    k += 1
            else:
                f, m = vector_at(W, I[r + WRENCH] + FORCE), vector_at(W, I[r + WRENCH] + MOMENT)
                point = vector_at(W, I[r + WRENCH] + POINT)
                for e in range(I[c + ENTRY0], I[c + ENTRY0_END], ENTRY_SIZE):
                    motion, axis, centre = I[e + ENTRY_MOTION], I[e + ENTRY_AXIS], I[e + ENTRY_CENTRE]
                    W[k] = I[e + SIGN] * power(W, motion, axis, centre, I[e + ENTRY_PITCH], f, m, point)
                    k += 1


@compiled
def drifts(I: Integers, W: Array) -> None:
    """Write the second rates of the rows, scaled, as their lead; the rates of the links are those of a = 0.

    Those of turned rows are exact where the closure is met, all others everywhere.
    """
    for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
        if I[c + TIES] == 1:
            W[I[I[c + ROW0] + LEAD]] = 0.0
        else:
            R1, P1 = frame_of(W, I[c + POSE1], I[c + FRAMES])
            R2, P2 = frame_of(W, I[c + POSE2], I[c + FRAMES] + SECOND_FRAME)
            one, two, d = I[c + RATE1], I[c + RATE2], sub(P2, P1)
            w1, w2 = vector_at(W, one + OMEGA), vector_at(W, two + OMEGA)
            alpha1, alpha2 = vector_at(W, one + ALPHA), vector_at(W, two + ALPHA)
            velocity1, acceleration1 = motion_of_point(W, one, sub(P1, vector_at(W, I[c + POSE1] + ORIGIN)))
            velocity2, acceleration2 = motion_of_point(W, two, sub(P2, vector_at(W, I[c + POSE2] + ORIGIN)))
            d_rate, d_rate2 = sub(velocity2, velocity1), sub(acceleration2, acceleration1)
            # second rates of R_1^T d and of R_1^T R_2 n, in world axes
            local = sub(d_rate, cross(w1, d))
            point = sub(sub(d_rate2, cross(alpha1, d)), add(cross(w1, cross(w1, d)), scaled(2.0, cross(w1, local))))
            w, alpha = sub(w2, w1), sub(sub(alpha2, alpha1), cross(w1, w2))
            for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
                k, sort = I[r + DIRECTION], I[r + SORT]
                b = times(R1, vector_at(W, k))
                if sort == ALONG:
                    drift = dot(b, point)
                elif sort == TILT:
                    n = times(R2, vector_at(W, k + OTHER))
                    drift = dot(b, add(cross(alpha, n), cross(w, cross(w, n))))
                elif sort == TURNED:
                    drift = dot(b, alpha)
                else:
                    drift = _lengthening(d, d_rate, d_rate2)
                W[I[r + LEAD]] = W[k + UNIT] * drift


@compiled
def motion_of_point(W: Array, rate: int, r: Vector) -> tuple[Vector, Vector]:
    """Return velocity and acceleration of a point of a link that lies r away from its origin."""
    w = vector_at(W, rate + OMEGA)
    across = cross(w, r)
    turning = add(cross(vector_at(W, rate + ALPHA), r), cross(w, across))
    return add(vector_at(W, rate + VELOCITY), across), add(vector_at(W, rate + ACCELERATION), turning)


@compiled
def _lengthening(d: Vector, rate1: Vector, rate2: Vector) -> float:
    """Return the second rate of |d|: u · d'' + (|d'|^2 - (u · d')^2) / |d|."""
    size = length_of(d)
    if size == 0.0:
        return 0.0
    u = scaled(1.0 / size, d)
    across = sub(rate1, scaled(dot(u, rate1), u))
    return dot(u, rate2) + dot(across, across) / size

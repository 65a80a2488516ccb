"""The open tree at one sample: poses, velocities and accelerations of its links.

With R_λ, p_λ the pose of the parent, A, a the placement of the joint on it, and x the coordinates of the joint,

    R = R_λ A Q(x),                     p = p_λ + R_λ (a + A d(x))
    ω = ω_λ + ω_r,                      v = v_λ + ω_λ × r + u,              r = p - p_λ
    α = α_λ + ω_λ × ω_r + ω_r',         a = a_λ + α_λ × r + ω_λ × (ω_λ × r) + (2 ω_λ + ω_r) × u + u'

where the joint turns with ω_r and slides with u, ω_r' and u' being what its own accelerations add. Velocities and
accelerations are those of the origin of the link, in world axes.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.ellipsoids import roll, rolling
from fivebar_pin.engine.tables import (
    A_HERE,
    ACCELERATION,
    ALIGNED,
    ALPHA,
    AXIS,
    BALL,
    COLUMN0,
    COLUMN_SIZE,
    DOF,
    EGG,
    FIXED,
    FREE,
    KIND,
    LEADING,
    LINK_SIZE,
    LINKS,
    LINKS_END,
    MOTION,
    OMEGA,
    ORIGIN,
    PARENT_POSE,
    PARENT_RATE,
    PITCH,
    PLANAR,
    POSE,
    QS,
    QS_KIND,
    RATE,
    REVOLUTE,
    ROTATION,
    SCREW,
    SHIFT,
    SLIDE,
    TURN,
    TURNING,
    V_HERE,
    VELOCITY,
    WAY,
    Integers,
    Q,
    V,
)  # fmt: skip
from fivebar_pin.engine.vectors import (
    Matrix,
    Vector,
    add,
    axis_at,
    cross,
    dot,
    matrix_at,
    product,
    put,
    put_matrix,
    scaled,
    sub,
    times,
    turned_about_z,
    vector_at,
)  # fmt: skip

__all__ = ["accelerate", "coordinate", "drift", "integrate", "move", "own", "place", "set_coordinate"]

_SMALL = 1e-4  # angle below which two terms of a series are exact to round-off [rad]


@compiled
def place(I: Integers, W: Array) -> None:
    """Write the poses of all links at the configuration q."""
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        k, fixed = I[j + Q], I[j + FIXED]
        R = matrix_at(W, I[j + PARENT_POSE] + ROTATION)
        p = add(vector_at(W, I[j + PARENT_POSE] + ORIGIN), times(R, vector_at(W, fixed + ORIGIN)))
        if W[fixed + ALIGNED] != 1.0:
            R = product(R, matrix_at(W, fixed + ROTATION))
        kind = I[j + KIND]
        if kind == REVOLUTE:
            c, s = cos(W[k]), sin(W[k])
            R = turned_about_z(R, c, s)
        elif kind == TURNING:
            R = turned_about_z(R, W[k], W[k + 1])
        elif kind == SLIDE:
            p = add(p, times(R, (0.0, 0.0, W[fixed + LEADING] * W[k])))
        elif kind == SCREW:
            p = add(p, times(R, (0.0, 0.0, W[fixed + LEADING] * W[k])))
            c, s = cos(W[k]), sin(W[k])
            R = turned_about_z(R, c, s)
        elif kind == BALL:
            R = product(R, _of_quaternion(W, k))
        elif kind == PLANAR:
            p = add(p, times(R, (W[k], W[k + 1], 0.0)))
            R = turned_about_z(R, W[k + 2], W[k + 3])
        elif kind == FREE:
            p = add(p, times(R, vector_at(W, k)))
            R = product(R, _of_quaternion(W, k + 3))
        elif kind == EGG:
            R, d = roll(I, W, j, R)
            p = add(p, d)
        put_matrix(W, I[j + POSE] + ROTATION, R)
        put(W, I[j + POSE] + ORIGIN, p)


@compiled
def move(I: Integers, W: Array) -> None:
    """Write the velocities of all links at the joint velocities v."""
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        parent, here = I[j + PARENT_RATE], I[j + RATE]
        turning, sliding = own(I, W, j, I[V_HERE])
        omega = vector_at(W, parent + OMEGA)
        r = sub(vector_at(W, I[j + POSE] + ORIGIN), vector_at(W, I[j + PARENT_POSE] + ORIGIN))
        put(W, here + OMEGA, add(omega, turning))
        put(W, here + VELOCITY, add(add(vector_at(W, parent + VELOCITY), cross(omega, r)), sliding))


@compiled
def accelerate(I: Integers, W: Array) -> None:
    """Write the accelerations of all links at the joint accelerations a; their velocities stand there already."""
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        turning, sliding = own(I, W, j, I[V_HERE])
        turning_rate, sliding_rate = own(I, W, j, I[A_HERE])
        _accelerate(I, W, j, turning, sliding, turning_rate, sliding_rate)


@compiled
def drift(I: Integers, W: Array) -> None:
    """Write the accelerations of all links at no joint accelerations; their velocities stand there already."""
    zero = (0.0, 0.0, 0.0)
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        turning, sliding = own(I, W, j, I[V_HERE])
        _accelerate(I, W, j, turning, sliding, zero, zero)


@compiled
def _accelerate(
    I: Integers, W: Array, j: int, turning: Vector, sliding: Vector, turning_rate: Vector, sliding_rate: Vector
) -> None:
    """Write the accelerations of a link from those of its parent and from the rates of its joint."""
    if I[j + KIND] == EGG:  # which moves its own axes
        turning_more, sliding_more = rolling(I, W, j, turning, sliding)
        turning_rate, sliding_rate = add(turning_rate, turning_more), add(sliding_rate, sliding_more)
    parent, here = I[j + PARENT_RATE], I[j + RATE]
    omega, alpha = vector_at(W, parent + OMEGA), vector_at(W, parent + ALPHA)
    r = sub(vector_at(W, I[j + POSE] + ORIGIN), vector_at(W, I[j + PARENT_POSE] + ORIGIN))
    put(W, here + ALPHA, add(add(alpha, cross(omega, turning)), turning_rate))
    carried = add(cross(alpha, r), cross(omega, cross(omega, r)))
    relative = add(cross(add(add(omega, omega), turning), sliding), sliding_rate)
    put(W, here + ACCELERATION, add(vector_at(W, parent + ACCELERATION), add(carried, relative)))


@compiled
def own(I: Integers, W: Array, j: int, rates: int) -> tuple[Vector, Vector]:
    """Return what link j turns and slides with by its own joint; the rates of all joints stand from W[rates] on."""
    turning, sliding = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    c = I[j + COLUMN0]
    for k in range(rates + I[j + V], rates + I[j + V] + I[j + DOF]):
        axis = scaled(W[k], axis_at(W, I[c + AXIS]))
        if I[c + MOTION] != SHIFT:
            turning = add(turning, axis)
        if I[c + MOTION] != TURN:
            sliding = add(sliding, scaled(W[k] * W[I[c + PITCH]], axis_at(W, I[c + WAY])))
        c += COLUMN_SIZE
    return turning, sliding


@compiled
def integrate(I: Integers, W: Array, x: int) -> None:
    """Move q along the tangent that stands from W[x] on."""
    for j in range(I[LINKS] + LINK_SIZE, I[LINKS_END], LINK_SIZE):
        kind, k, i = I[j + KIND], I[j + Q], x + I[j + V]
        if kind in (REVOLUTE, SLIDE, SCREW):
            W[k] += W[i]
        elif kind == EGG:
            put(W, k, add(vector_at(W, k), vector_at(W, i)))
        elif kind == TURNING:
            _turn(W, k, W[i])
        elif kind == BALL:
            _turn_quaternion(W, k, vector_at(W, i))
        elif kind == PLANAR:
            _glide(W, k, W[i], W[i + 1], W[i + 2])
        elif kind == FREE:
            _fly(W, k, vector_at(W, i), vector_at(W, i + 3))


@compiled
def coordinate(I: Integers, W: Array, c: int) -> float:
    """Return the coordinate of the joint, of one degree of freedom, of the column whose record begins at c."""
    k = I[c + QS]
    return atan2(W[k + 1], W[k]) if I[c + QS_KIND] == TURNING else W[k]


@compiled
def set_coordinate(I: Integers, W: Array, c: int, x: float) -> None:
    """Write it."""
    k = I[c + QS]
    if I[c + QS_KIND] == TURNING:
        W[k], W[k + 1] = cos(x), sin(x)
    else:
        W[k] = x


@compiled
def _turn(W: Array, k: int, angle: float) -> None:
    """Turn a cosine and a sine on by an angle."""
    c, s = cos(angle), sin(angle)
    x, y = c * W[k] - s * W[k + 1], s * W[k] + c * W[k + 1]
    size = sqrt(x * x + y * y)
    W[k], W[k + 1] = x / size, y / size


@compiled
def _of_quaternion(W: Array, k: int) -> Matrix:
    """Return the rotation of a unit quaternion x, y, z, w."""
    x, y, z, w = W[k], W[k + 1], W[k + 2], W[k + 3]
    return (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w),
        2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w),
        2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip


@compiled
def _sinc(x: float) -> float:
    """Return sin(x) / x."""
    return 1.0 - x * x / 6.0 if abs(x) < _SMALL else sin(x) / x


@compiled
def _turn_quaternion(W: Array, k: int, phi: Vector) -> None:
    """Turn a quaternion on by a rotation vector in its own axes."""
    half = 0.5 * sqrt(dot(phi, phi))
    u, c, w, real = scaled(0.5 * _sinc(half), phi), cos(half), vector_at(W, k), W[k + 3]
    x, y, z = add(add(scaled(c, w), scaled(real, u)), cross(w, u))
    last = real * c - dot(w, u)
    size = sqrt(x * x + y * y + z * z + last * last)
    W[k], W[k + 1], W[k + 2], W[k + 3] = x / size, y / size, z / size, last / size


@compiled
def _glide(W: Array, k: int, x: float, y: float, angle: float) -> None:
    """Move a planar joint on by a constant velocity in its own axes."""
    s, half = _sinc(angle), _sinc(0.5 * angle)
    c = 0.5 * angle * half * half  # (1 - cos) / angle
    dx, dy = s * x - c * y, c * x + s * y
    W[k], W[k + 1] = W[k] + W[k + 2] * dx - W[k + 3] * dy, W[k + 1] + W[k + 3] * dx + W[k + 2] * dy
    _turn(W, k + 2, angle)


@compiled
def _fly(W: Array, k: int, u: Vector, phi: Vector) -> None:
    """Move a free body on by a constant velocity in its own axes."""
    angle = sqrt(dot(phi, phi))
    half = _sinc(0.5 * angle)
    across = cross(phi, u)
    third = 1.0 / 6.0 if angle < _SMALL else (1.0 - _sinc(angle)) / (angle * angle)
    d = add(add(u, scaled(0.5 * half * half, across)), scaled(third, cross(phi, across)))
    put(W, k, add(vector_at(W, k), times(_of_quaternion(W, k + 3), d)))
    _turn_quaternion(W, k + 3, phi)
    if cos(0.5 * angle) < 0.0:  # of the two quaternions Pinocchio takes the one near that before
        for i in range(k + 3, k + 7):
            W[i] = -W[i]

"""The rows of closures at one sample: what they leave open, the wrenches they stand for, Jacobian and drift.

A closure joins frame 1, with axes R_1 and origin P_1 on one body, and frame 2 on another. With the directions b of
frame 1 and n of frame 2 its rows are

    along     b · R_1^T (P_2 - P_1) - x_0              tilt     b · R_1^T R_2 n - x_0
    turned    b · log(R_1^T R_2) - x_0                 length   |P_2 - P_1| - x_0
    ratio     sum_k c_k q_k - offset

The rate of a row is the power of a wrench, a force f at P_2 and a moment m, on the velocity of body 2 relative to
body 1: its entries in the Jacobian are the powers of this wrench on what single coordinates move [Ball 1900], and its
multiple by lambda is what the closure does to body 2. Rows are measured in lengths of the chain.
"""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.rotations import rotation_vector, turning_moment
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
    ENTRY_WAY,
    FORCE,
    FRAMES,
    JACOBIAN0,
    LEAD,
    LENGTH,
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
    SHIFT,
    SIGN,
    SORT,
    SPIN,
    TIES,
    TILT,
    TURN,
    TURNED,
    UNIT,
    VELOCITY,
    WRENCH,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import coordinate
from fivebar_pin.engine.vectors import (
    Matrix,
    Vector,
    add,
    axis_at,
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

__all__ = ["axes_of", "drifts", "jacobian", "look", "motion_of_point", "point_of"]


@compiled
def _arm(W: Array, pose: int, frame: int) -> Vector:
    """Return where a frame is, from the origin of its link; its placement on the link stands from W[frame] on."""
    return times(matrix_at(W, pose + ROTATION), vector_at(W, frame + ORIGIN))


@compiled
def point_of(W: Array, pose: int, frame: int) -> Vector:
    """Return the origin of a frame."""
    return add(vector_at(W, pose + ORIGIN), _arm(W, pose, frame))


@compiled
def _turned(W: Array, pose: int, frame: int, u: Vector) -> Vector:
    """Return a vector of a frame in world axes."""
    return times(matrix_at(W, pose + ROTATION), times(matrix_at(W, frame + ROTATION), u))


@compiled
def axes_of(W: Array, pose: int, frame: int) -> Matrix:
    """Return the axes of a frame."""
    return product(matrix_at(W, pose + ROTATION), matrix_at(W, frame + ROTATION))


@compiled
def look(I: Integers, W: Array) -> None:
    """Write the residuals of all rows and the wrenches of those between frames, scaled."""
    for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
        if I[c + TIES] == 1:
            _tie(I, W, c)
        elif I[c + TIES] == 2:
            W[I[I[c + ROW0] + RESIDUAL]] = 0.0
        else:
            pose1, pose2, frame = I[c + POSE1], I[c + POSE2], I[c + FRAMES]
            P2 = point_of(W, pose2, frame + SECOND_FRAME)
            d = sub(P2, point_of(W, pose1, frame))
            for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
                residual, f, m = _row(W, I[r + SORT], I[r + DIRECTION], pose1, pose2, frame, d)
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
def _row(W: Array, sort: int, k: int, pose1: int, pose2: int, frame: int, d: Vector) -> tuple[float, Vector, Vector]:
    """Return residual, force and moment of the row whose direction stands from W[k] on, scaled."""
    b, zero = _turned(W, pose1, frame, vector_at(W, k)), (0.0, 0.0, 0.0)
    if sort == ALONG:
        gap, f, m = dot(b, d), b, zero
    elif sort == TILT:
        n = _turned(W, pose2, frame + SECOND_FRAME, vector_at(W, k + OTHER))
        gap, f, m = dot(b, n), zero, cross(n, b)
    elif sort == TURNED:
        phi = rotation_vector(axes_of(W, pose1, frame), axes_of(W, pose2, frame + SECOND_FRAME))
        gap, f, m = dot(b, phi), zero, turning_moment(phi, b)
    elif sort == SPIN:
        gap, f, m = W[k + OFFSET], zero, _turned(W, pose2, frame + SECOND_FRAME, vector_at(W, k + OTHER))
    else:
        gap = length_of(d)
        f, m = scaled(1.0 / gap, d) if gap > 0.0 else _turned(W, pose1, frame, (1.0, 0.0, 0.0)), zero
    unit = W[k + UNIT]
    return unit * (gap - W[k + OFFSET]), scaled(unit, f), scaled(unit, m)


@compiled
def jacobian(I: Integers, W: Array) -> None:
    """Write the entries of the closure Jacobian, row after row, in the order of the entries of the closure.

    With w, u what a column gives body 2 at P_2 at unit rate, the turning and the velocity, J = f · u + m · w.
    """
    for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
        k = 0
        if I[c + TIES] > 0:
            for e in range(I[c + ENTRY0], I[c + ENTRY0_END], ENTRY_SIZE):
                r = I[c + ROW0]
                W[I[r + JACOBIAN0] + k] = W[I[r + DIRECTION] + UNIT] * W[I[e + RATIO]]
                k += 1
        else:
            point = point_of(W, I[c + POSE2], I[c + FRAMES] + SECOND_FRAME)
            for e in range(I[c + ENTRY0], I[c + ENTRY0_END], ENTRY_SIZE):
                w, u = _unit_motion(I, W, e, point)
                for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
                    f, m = vector_at(W, I[r + WRENCH] + FORCE), vector_at(W, I[r + WRENCH] + MOMENT)
                    W[I[r + JACOBIAN0] + k] = dot(f, u) + dot(m, w)
                k += 1


@compiled
def _unit_motion(I: Integers, W: Array, e: int, point: Vector) -> tuple[Vector, Vector]:
    """Return how body 2 of a closure turns relative to body 1, and how a point of it moves, with one column alone."""
    axis = scaled(I[e + SIGN], axis_at(W, I[e + ENTRY_AXIS]))
    across = cross(axis, sub(point, vector_at(W, I[e + ENTRY_CENTRE])))
    motion, pitch = I[e + ENTRY_MOTION], W[I[e + ENTRY_PITCH]]
    turns = 0.0 if motion == SHIFT else 1.0
    slides = 0.0 if motion == TURN else pitch
    way = scaled(I[e + SIGN] * slides, axis_at(W, I[e + ENTRY_WAY]))
    return scaled(turns, axis), add(scaled(turns, across), way)


@compiled
def drifts(I: Integers, W: Array) -> None:
    """Write the second rates of the rows, scaled, as their lead; the rates of the links are those of a = 0.

    The wrenches of the rows stand there already. Those of turned rows are exact where the closure is met, all others
    everywhere.
    """
    for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
        if I[c + TIES] > 0:
            W[I[I[c + ROW0] + LEAD]] = 0.0
        else:
            _drifts(I, W, c)


@compiled
def _drifts(I: Integers, W: Array, c: int) -> None:
    """Write the second rates of the rows of a closure between frames."""
    pose1, pose2, frame, one, two = I[c + POSE1], I[c + POSE2], I[c + FRAMES], I[c + RATE1], I[c + RATE2]
    r1, r2 = _arm(W, pose1, frame), _arm(W, pose2, frame + SECOND_FRAME)
    d = sub(add(vector_at(W, pose2 + ORIGIN), r2), add(vector_at(W, pose1 + ORIGIN), r1))
    w1, alpha1 = vector_at(W, one + OMEGA), vector_at(W, one + ALPHA)
    velocity1, acceleration1 = motion_of_point(W, one, r1)
    velocity2, acceleration2 = motion_of_point(W, two, r2)
    d_rate, d_rate2 = sub(velocity2, velocity1), sub(acceleration2, acceleration1)
    # second rates of R_1^T d and of R_1^T R_2 n, in world axes
    local = sub(d_rate, cross(w1, d))
    point = sub(sub(d_rate2, cross(alpha1, d)), add(cross(w1, cross(w1, d)), scaled(2.0, cross(w1, local))))
    w = sub(vector_at(W, two + OMEGA), w1)
    alpha = sub(sub(vector_at(W, two + ALPHA), alpha1), cross(w1, vector_at(W, two + OMEGA)))
    for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
        k, sort = I[r + DIRECTION], I[r + SORT]
        if sort == ALONG:
            drift = dot(vector_at(W, I[r + WRENCH] + FORCE), point)
        elif sort == SPIN:
            drift = dot(vector_at(W, I[r + WRENCH] + MOMENT), alpha)
        elif sort == LENGTH:
            drift = W[k + UNIT] * _lengthening(d, d_rate, d_rate2)
        else:
            second = alpha
            b = _turned(W, pose1, frame, vector_at(W, k))
            if sort == TILT:
                n = _turned(W, pose2, frame + SECOND_FRAME, vector_at(W, k + OTHER))
                second = add(cross(alpha, n), cross(w, cross(w, n)))
            drift = W[k + UNIT] * dot(b, second)
        W[I[r + LEAD]] = drift


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

"""Joints whose link rolls on an ellipsoid that is fixed to the parent [Seth, Sherman, Eastman and Delp 2010].

With a = diag(r_x, r_y, r_z) the radii and x, y, z three turns in a row, about the x axis, the new y and the new z,

    Q = R_x R_y R_z,     d = a n,     n = R_x R_y e_z = (sin y, -sin x cos y, cos x cos y)

so that the link turns about e_x, (0, cos x, sin x) and n and, besides, slides along dd/dx and dd/dy.
"""

from __future__ import annotations

from math import cos, sin

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.tables import (
    AXIS,
    COLUMN0,
    FIXED,
    LEADING,
    PARENT_POSE,
    RADII,
    ROTATION,
    V_HERE,
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
    matrix_at,
    product,
    put_matrix,
    scaled,
    sub,
    times,
    turned_about_z,
    vector_at,
)  # fmt: skip

__all__ = ["roll", "rolling"]


@compiled
def roll(I: Integers, W: Array, j: int, R: Matrix) -> tuple[Matrix, Vector]:
    """Return axes and shift of a link from the axes R of its joint; write what its coordinates turn and slide along."""
    k, fixed, c = I[j + Q], I[j + FIXED], I[j + COLUMN0]
    cx, sx, cy, sy = cos(W[k]), sin(W[k]), cos(W[k + 1]), sin(W[k + 1])
    a = vector_at(W, fixed + RADII)
    tilted = (cy, 0.0, sy, sx * sy, cx, -sx * cy, -cx * sy, sx, cx * cy)
    turns = (1.0, 0.0, sy, 0.0, cx, -sx * cy, 0.0, sx, cx * cy)
    ways = (0.0, a[0] * cy, 0.0, -a[1] * cx * cy, a[1] * sx * sy, 0.0, -a[2] * sx * cy, -a[2] * cx * sy, 0.0)
    put_matrix(W, I[c + AXIS], product(R, turns))
    put_matrix(W, I[c + WAY], product(R, ways))
    d = scaled(W[fixed + LEADING], (a[0] * sy, -a[1] * sx * cy, a[2] * cx * cy))
    cz, sz = cos(W[k + 2]), sin(W[k + 2])
    return turned_about_z(product(R, tilted), cz, sz), times(R, d)


@compiled
def rolling(I: Integers, W: Array, j: int, turning: Vector, sliding: Vector) -> tuple[Vector, Vector]:
    """Return what the joint adds to the accelerations of its link as its axes move on the parent, or with the link.

    Args:
        I, W: the chain and working memory.
        j: record of the link.
        turning, sliding: what it turns and slides with by its joint.
    """
    k, fixed, c, v = I[j + Q], I[j + FIXED], I[j + COLUMN0], I[V_HERE] + I[j + V]
    cx, sx, cy, sy = cos(W[k]), sin(W[k]), cos(W[k + 1]), sin(W[k + 1])
    x, y, a, turns = W[v], W[v + 1], scaled(W[fixed + LEADING], vector_at(W, fixed + RADII)), I[c + AXIS]
    first = scaled(x, axis_at(W, turns))
    second = scaled(y, axis_at(W, turns + 1))
    third = scaled(W[v + 2], axis_at(W, turns + 2))
    bend = (
        -a[0] * sy * y * y,
        a[1] * (sx * cy * (x * x + y * y) + 2.0 * cx * sy * x * y),
        a[2] * (2.0 * sx * sy * x * y - cx * cy * (x * x + y * y)),
    )
    R = product(matrix_at(W, I[j + PARENT_POSE] + ROTATION), matrix_at(W, fixed + ROTATION))
    return add(cross(first, second), cross(add(first, second), third)), sub(times(R, bend), cross(turning, sliding))

"""Closure forces and what the joints carry, at one sample after the other, by the factors of the passive columns.

    J_p^T lambda = g_p          g what the joints of the open tree need

The blocks are solved from the last one to the first, each by the transposed factors. The closures then do to their
bodies what their rows stand for, and the loads are gathered down the tree once more: what is left in the joints is
what the motors give, and nothing in the passive ones.
"""

from __future__ import annotations

from math import nan

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import factorise, least_pivot, substitute_back
from fivebar_pin.engine.bodies import joint_forces
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.engine.entries import need, read, write
from fivebar_pin.engine.rows import axes_of, jacobian, look, point_of
from fivebar_pin.engine.tables import (
    A_HERE,
    BLOCK_SIZE,
    BLOCKS,
    BLOCKS_END,
    CLOSURE_SIZE,
    CLOSURES,
    CLOSURES_END,
    COLUMN,
    COLUMN_LIST,
    ENTRIES,
    ENTRIES_END,
    ENTRY0,
    ENTRY0_END,
    ENTRY_SIZE,
    FORCE,
    FRAMES,
    JACOBIAN0,
    JOINT,
    LEAD,
    LINK_SIZE,
    LINKS,
    LINKS_END,
    LOAD,
    LOADS,
    MOMENT,
    NQ,
    NV,
    ORIGIN,
    POINT,
    POSE,
    POSE1,
    POSE2,
    POSES,
    Q_HERE,
    RAW,
    RHS,
    ROTATION,
    ROW0,
    ROW0_END,
    ROW_LIST,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SECOND_FRAME,
    SHAKING,
    TIES,
    V_HERE,
    WIDTH,
    WRENCH,
    Integers,
    X,
)  # fmt: skip
from fivebar_pin.engine.tree import move, place
from fivebar_pin.engine.vectors import (
    Vector,
    add,
    back,
    cross,
    matrix_at,
    product,
    push,
    put,
    put_matrix,
    scaled,
    sub,
    times,
    vector_at,
)  # fmt: skip

__all__ = ["marks", "reactions"]

_NOTHING = (0.0, 0.0, 0.0)
_POSE_TO_LOAD = 2  # a pose is twelve numbers, a load six


@entry
def reactions(
    I: Integers, W: Array, q: Array, v: Array, a: Array, bodies: Integers,
    links: Integers, points: Array, wrenches: Array, forces: Array, carried: Array, left: Array, weakest: Array,
) -> int:  # fmt: skip
    """Write the forces in the rows of closures, and the wrenches of joints and closures at their points.

    Args:
        I, W: the chain, with square blocks of unmixed rows, and working memory.
        q, v, a: consistent motion (n, ...).
        bodies: records of the links that carry the bodies (nb,).
        links, points, wrenches: of forces from outside (k,), (k, 3), (n, k, 6).
        forces: multipliers of the rows, scaled; is written (n, rows).
        carried: by joints, then closures, world axes; is written (n, 6 (nb + closures)).
        left: what is left in the joints, that is the torques of the motors; is written (n, nv).
        weakest: least pivot of the scaled factors, zero where a block is singular; is written (n,).

    Returns:
        Number of a spring whose force has no direction, else -1.
    """
    lost, i, count = -1, 0, (I[LINKS_END] - I[LINKS]) // LINK_SIZE
    while lost < 0 and i < q.shape[0]:
        read(W, I[Q_HERE], q, i, I[NQ])
        read(W, I[V_HERE], v, i, I[NV])
        read(W, I[A_HERE], a, i, I[NV])
        place(I, W)
        look(I, W)
        jacobian(I, W)
        regular = factorise(I, W)
        weakest[i] = least_pivot(I, W) if regular else 0.0
        move(I, W)
        lost = need(I, W, _NOTHING, links, points, wrenches, i)
        joint_forces(I, W)
        for b in range(bodies.shape[0]):
            write(W, I[bodies[b] + LOAD], carried, i, 6 * b, 6)
        if weakest[i] > 0.0:
            _multipliers(I, W)
            for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
                forces[i, (r - I[ROWS]) // ROW_SIZE] = W[I[r + LEAD]]
            for k in range(I[LOADS], I[LOADS] + 6 * count):
                W[k] = 0.0
            for c in range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE):
                _hold(I, W, c)
                write(W, I[SHAKING], carried, i, 6 * (bodies.shape[0] + (c - I[CLOSURES]) // CLOSURE_SIZE), 6)
            joint_forces(I, W)
            for b in range(bodies.shape[0]):
                for k in range(6):
                    carried[i, 6 * b + k] += W[I[bodies[b] + LOAD] + k]
            write(W, I[JOINT], left, i, 0, I[NV])
        i += 1
    return lost


@compiled
def _multipliers(I: Integers, W: Array) -> None:
    """Write lambda as the lead of the rows, J_p^T lambda = what the joints need."""
    for k in range(I[NV]):
        W[I[X] + k] = W[I[JOINT] + k]
    for g in range(I[BLOCKS_END] - BLOCK_SIZE, I[BLOCKS] - BLOCK_SIZE, -BLOCK_SIZE):
        for k in range(I[g + WIDTH]):
            W[I[RHS] + k] = W[I[X] + I[I[g + COLUMN_LIST] + k]]
        substitute_back(I, W, g)
        for i in range(I[g + RAW]):
            r = I[I[g + ROW_LIST] + i]
            k, W[I[r + LEAD]] = I[r + JACOBIAN0], W[I[RHS] + i]
            for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
                W[I[X] + I[e + COLUMN]] -= W[k] * W[I[r + LEAD]]
                k += 1


@compiled
def _hold(I: Integers, W: Array, c: int) -> None:
    """Add what a closure does to what its bodies need; its wrench on body 2 stands where the shaking one did."""
    force, moment, point = _NOTHING, _NOTHING, _NOTHING
    for r in range(I[c + ROW0], I[c + ROW0_END], ROW_SIZE):
        k, lead = I[r + WRENCH], W[I[r + LEAD]]
        if I[c + TIES] > 0:
            j = I[r + JACOBIAN0]
            for e in range(I[c + ENTRY0], I[c + ENTRY0_END], ENTRY_SIZE):
                W[I[JOINT] + I[e + COLUMN]] -= W[j] * lead
                j += 1
        else:
            force = add(force, scaled(lead, vector_at(W, k + FORCE)))
            moment = add(moment, scaled(lead, vector_at(W, k + MOMENT)))
            point = vector_at(W, k + POINT)
    put(W, I[SHAKING] + FORCE, force)
    put(W, I[SHAKING] + MOMENT, moment)
    if I[c + TIES] == 0:
        arm1 = sub(point, vector_at(W, I[c + POSE1] + ORIGIN))
        arm2 = sub(point, vector_at(W, I[c + POSE2] + ORIGIN))
        load1 = I[LOADS] + (I[c + POSE1] - I[POSES]) // _POSE_TO_LOAD
        load2 = I[LOADS] + (I[c + POSE2] - I[POSES]) // _POSE_TO_LOAD
        push(W, load1 + FORCE, force)
        push(W, load1 + MOMENT, add(moment, cross(arm1, force)))
        push(W, load2 + FORCE, scaled(-1.0, force))
        push(W, load2 + MOMENT, scaled(-1.0, add(moment, cross(arm2, force))))


@entry
def marks(
    I: Integers, W: Array, q: Array, bodies: Integers, axes: Array, free: Integers, directions: Array,
    reach: Integers, limits: Array, turned: int, places: Array, carried: Array, seen: Array,
) -> None:  # fmt: skip
    """Write the wrenches of joints and closures as they are seen: nan where redundant closures leave them open.

    Args:
        I, W, bodies: as for `reactions`.
        q: configurations (n, nq).
        axes: of the joints in those of their links, matrix after matrix (9 nb,).
        free: closures that can be strained, and whether by a moment, else by a force (k, 2).
        directions: of the unit strain, in the axes of frame 1 (k, 3).
        reach: whether a joint or closure feels it (nb + closures, k).
        limits: squares of what is felt of it above which a force, a moment, is open (2,).
        turned: whether it is seen in the axes of the joint or of frame 1, else in those of the world.
        places: working memory for axes and points (12 (nb + closures),).
        carried: wrenches, world axes (n, 6 (nb + closures)).
        seen: is written, the same shape.
    """
    nb, total = bodies.shape[0], reach.shape[0]
    for i in range(q.shape[0]):
        read(W, I[Q_HERE], q, i, I[NQ])
        place(I, W)
        for b in range(nb):
            R = product(matrix_at(W, I[bodies[b] + POSE] + ROTATION), matrix_at(axes, 9 * b))
            put_matrix(places, 12 * b, R)
            put(places, 12 * b + ORIGIN, vector_at(W, I[bodies[b] + POSE] + ORIGIN))
        for x in range(nb, total):
            c = I[CLOSURES] + CLOSURE_SIZE * (x - nb)
            R = axes_of(W, I[c + POSE1], I[c + FRAMES])
            p = point_of(W, I[c + POSE2], I[c + FRAMES] + SECOND_FRAME)
            put_matrix(places, 12 * x, R)
            put(places, 12 * x + ORIGIN, p)
        for x in range(total):
            R, p = matrix_at(places, 12 * x), vector_at(places, 12 * x + ORIGIN)
            forces, moments = _NOTHING, _NOTHING  # squares of what is felt
            for k in range(reach.shape[1]):
                if reach[x, k] == 1:
                    at = 12 * (nb + free[k, 0])
                    d = times(matrix_at(places, at), (directions[k, 0], directions[k, 1], directions[k, 2]))
                    m = d if free[k, 1] == 1 else cross(sub(vector_at(places, at + ORIGIN), p), d)
                    f = _NOTHING if free[k, 1] == 1 else d
                    if turned == 1:
                        f, m = back(R, f), back(R, m)
                    forces, moments = add(forces, _squared(f)), add(moments, _squared(m))
            y = 6 * x
            f = carried[i, y], carried[i, y + 1], carried[i, y + 2]
            m = carried[i, y + 3], carried[i, y + 4], carried[i, y + 5]
            if turned == 1:
                f, m = back(R, f), back(R, m)
            for k in range(3):
                seen[i, y + k] = nan if forces[k] > limits[0] else f[k]
                seen[i, y + 3 + k] = nan if moments[k] > limits[1] else m[k]


@compiled
def _squared(u: Vector) -> Vector:
    return u[0] * u[0], u[1] * u[1], u[2] * u[2]

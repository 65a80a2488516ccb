"""What Python calls: samples one after the other, from its arrays into its arrays."""

from __future__ import annotations

from math import pi

from numpy import rint, trunc

from fivebar_pin._arrays import Array
from fivebar_pin.engine.bodies import drag, inertia_forces, joint_forces, torques, twists, weigh
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.engine.complement import accelerations, velocities
from fivebar_pin.engine.following import advance
from fivebar_pin.engine.rows import look
from fivebar_pin.engine.springs import apply, pull
from fivebar_pin.engine.tables import (
    A_HERE,
    CARRIED,
    COLUMN_SIZE,
    COLUMNS,
    DIRECTION,
    FARTHEST,
    FOLLOWED,
    JOINT,
    MOTORS,
    N_HERE,
    NA,
    NQ,
    NV,
    Q_HERE,
    RATIOS,
    RESIDUAL,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SCALE,
    SHAKING,
    SORT,
    STATUS,
    TAU,
    TO,
    TO_A,
    TO_V,
    UNIT,
    V_HERE,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import accelerate, coordinate, move, place, set_coordinate
from fivebar_pin.engine.vectors import Vector, larger

__all__ = ["bring", "drive", "loads", "need", "open_by", "read", "read_matrix", "write", "write_matrix"]


@entry
def drive(
    I: Integers, W: Array, x_a: Array, v_a: Array, a_a: Array, q: Array, v: Array, a: Array, N: Array, gap: Array
) -> int:
    """Follow the branch of q[0] along a motion (n, na) and write q, v, a, N and the closure residual of each sample.

    Returns:
        Number of samples that were followed; `STATUS` tells how it ended.
    """
    read(W, I[Q_HERE], q, 0, I[NQ])
    W[I[STATUS]] = FOLLOWED
    done = 0
    while W[I[STATUS]] == FOLLOWED and done < x_a.shape[0]:
        read(W, I[TO], x_a, done, I[NA])
        read(W, I[TO_V], v_a, done, I[NA])
        read(W, I[TO_A], a_a, done, I[NA])
        advance(I, W, done == 0)
        if W[I[STATUS]] == FOLLOWED:
            velocities(I, W)
            accelerations(I, W)
            write(W, I[Q_HERE], q, done, 0, I[NQ])
            write(W, I[V_HERE], v, done, 0, I[NV])
            write(W, I[A_HERE], a, done, 0, I[NV])
            write_matrix(W, I[N_HERE], N, done, I[NV], I[NA])
            gap[done] = open_by(I, W)
            done += 1
    return done


@entry
def bring(I: Integers, W: Array, turns: Integers, x: Array, most: float, q: Array, gap: Array) -> int:
    """Bring q[0], where it is closed, along the straight line of the motors to x[0], and write its residual.

    Whole turns of motors that come back to the same pose count for nothing: those whose coordinates are a cosine and a
    sine (`turns` 2) go the short way, others (1) keep the sense in which they turn; 0 marks those that are counted.

    Returns:
        How many ends of the line were reached: 2 for both, or q stays as it is. -1 where q is open by more than `most`,
        -2 where the line is so long that to follow it would take for ever.
    """
    read(W, I[Q_HERE], q, 0, I[NQ])
    place(I, W)
    look(I, W)
    if not open_by(I, W) <= most:
        return -1
    far = False
    for a in range(I[NA]):
        k = I[I[MOTORS] + a]
        c = I[COLUMNS] + COLUMN_SIZE * k
        at = coordinate(I, W, c)
        whole = (x[0, a] - at) / (2.0 * pi)
        whole = rint(whole) if turns[a] == 2 else (trunc(whole) if turns[a] == 1 else 0.0)
        if whole != 0.0:
            at += 2.0 * pi * whole
            set_coordinate(I, W, c, at)
        W[I[TO] + a] = at
        far = far or not abs(x[0, a] - at) <= FARTHEST * W[I[SCALE] + k]
    if far:
        return -2
    reached = 0
    advance(I, W, True)
    if W[I[STATUS]] == FOLLOWED:
        reached = 1
        read(W, I[TO], x, 0, I[NA])
        advance(I, W, False)
        if W[I[STATUS]] == FOLLOWED:
            reached = 2
            write(W, I[Q_HERE], q, 0, 0, I[NQ])
            gap[0] = open_by(I, W)
    return reached


@entry
def loads(
    I: Integers, W: Array, q: Array, v: Array, a: Array, N: Array, about: Array,
    links: Integers, points: Array, wrenches: Array, table: Array,
) -> int:  # fmt: skip
    """Write what motors need, what shakes the frame and what it carries, and what the joints of the open tree need.

    Args:
        I, W: the chain and working memory.
        q, v, a, N: consistent motion (n, ...).
        about: point of the moments (3,).
        links, points, wrenches: of forces from outside (k,), (k, 3), (n, k, 6).
        table: is written (n, na + 12 + nv): torques, shaking force and moment, frame force and moment, joint torques.

    Returns:
        Number of a spring whose force has no direction, else -1.
    """
    centre, lost, i, na = (about[0], about[1], about[2]), -1, 0, I[NA]
    while lost < 0 and i < q.shape[0]:
        read(W, I[Q_HERE], q, i, I[NQ])
        read(W, I[V_HERE], v, i, I[NV])
        read(W, I[A_HERE], a, i, I[NV])
        read_matrix(W, I[N_HERE], N, i, I[NV], na)
        place(I, W)
        move(I, W)
        twists(I, W)
        lost = need(I, W, centre, links, points, wrenches, i)
        torques(I, W)
        joint_forces(I, W)
        for k in range(6):
            W[I[CARRIED] + k] += W[I[SHAKING] + k]
        write(W, I[TAU], table, i, 0, na)
        write(W, I[SHAKING], table, i, na, 6)
        write(W, I[CARRIED], table, i, na + 6, 6)
        write(W, I[JOINT], table, i, na + 12, I[NV])
        i += 1
    return lost


@compiled
def need(
    I: Integers, W: Array, about: Vector, links: Integers, points: Array, wrenches: Array, sample: int
) -> int:  # fmt: skip
    """Write what every link and every joint need to accelerate as they do, moving as they are; see `loads`."""
    accelerate(I, W)
    inertia_forces(I, W, about)
    weigh(I, W, about)
    drag(I, W)
    lost = pull(I, W)
    apply(I, W, links, points, wrenches, sample, about)
    return lost


@compiled
def open_by(I: Integers, W: Array) -> float:
    """Return the largest residual, in the units of rows between frames [m or rad]; infinite where one is no number."""
    most = 0.0
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        unit = 1.0 if I[r + SORT] == RATIOS else W[I[r + DIRECTION] + UNIT]
        most = larger(most, abs(W[I[r + RESIDUAL]]) / unit)
    return most


@compiled
def read(W: Array, at: int, table: Array, i: int, count: int) -> None:
    """Copy row i of a table into working memory."""
    for k in range(count):
        W[at + k] = table[i, k]


@compiled
def write(W: Array, at: int, table: Array, i: int, column: int, count: int) -> None:
    """Copy working memory into row i of a table, from a column on."""
    for k in range(count):
        table[i, column + k] = W[at + k]


@compiled
def read_matrix(W: Array, at: int, tables: Array, i: int, rows: int, columns: int) -> None:
    """Copy matrix i of some into working memory, row by row."""
    for r in range(rows):
        for c in range(columns):
            W[at + r * columns + c] = tables[i, r, c]


@compiled
def write_matrix(W: Array, at: int, tables: Array, i: int, rows: int, columns: int) -> None:
    """Copy working memory into matrix i of some."""
    for r in range(rows):
        for c in range(columns):
            tables[i, r, c] = W[at + r * columns + c]

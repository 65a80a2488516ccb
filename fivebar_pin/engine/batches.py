"""Tree and closures over batches, in Pinocchio's terms: for those who look at many configurations at once.

Spatial quantities are linear before angular, in world axes at the world origin: with the velocity v and acceleration
a of the origin p of a link that turns with ω, α,

    V = (v - ω × p, ω),        A = (a - α × p - ω × v, α)
"""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.engine.entries import read, write
from fivebar_pin.engine.rows import axes_of, drifts, jacobian, look, point_of
from fivebar_pin.engine.tables import (
    A_HERE,
    ACCELERATION,
    ALPHA,
    AXIS,
    CENTRE,
    CLOSURE_SIZE,
    CLOSURES,
    CLOSURES_END,
    COLUMN,
    COLUMN_SIZE,
    COLUMNS,
    DIRECTION,
    ENTRIES,
    ENTRIES_END,
    ENTRY_SIZE,
    FORCE,
    FRAMES,
    JACOBIAN0,
    LEAD,
    LINK_SIZE,
    LINKS,
    MOMENT,
    MOTION,
    NQ,
    NV,
    OMEGA,
    ORIGIN,
    PITCH,
    POINT,
    POSE,
    POSE1,
    Q_HERE,
    RATE,
    RESIDUAL,
    ROTATION,
    ROW0,
    ROW0_END,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SECOND_FRAME,
    SHIFT,
    TIES,
    TURN,
    UNIT,
    V_HERE,
    VELOCITY,
    WAY,
    WRENCH,
    Integers,
    X,
)
from fivebar_pin.engine.tree import accelerate, integrate, move, place
from fivebar_pin.engine.vectors import Vector, add, axis_at, cross, scaled, sub, vector_at

__all__ = ["closures", "drift", "integrated", "poses", "rates"]


@entry
def poses(I: Integers, W: Array, bodies: Integers, turns: Array, q: Array, R: Array, p: Array, S: Array) -> None:
    """Write poses of joints and the motion subspaces of all velocity coordinates.

    Args:
        I, W: the tree and working memory.
        bodies: the link of every joint's body (joints,); that of joint 0 is the ground.
        turns: axes of the body in those of its link (joints, 3, 3).
        q: configurations (n, nq).
        R, p: are written (joints, n, 3, 3), (joints, n, 3).
        S: is written (n, 6, nv).
    """
    for i in range(q.shape[0]):
        read(W, I[Q_HERE], q, i, I[NQ])
        place(I, W)
        for j in range(bodies.shape[0]):
            pose = I[I[LINKS] + LINK_SIZE * bodies[j] + POSE]
            for a in range(3):
                p[j, i, a] = W[pose + ORIGIN + a]
                for b in range(3):
                    total = 0.0
                    for c in range(3):
                        total += W[pose + ROTATION + 3 * a + c] * turns[j, c, b]
                    R[j, i, a, b] = total
        for k in range(I[NV]):
            linear, angular = subspace(I, W, I[COLUMNS] + COLUMN_SIZE * k)
            for a in range(3):
                S[i, a, k], S[i, 3 + a, k] = linear[a], angular[a]


@compiled
def subspace(I: Integers, W: Array, c: int) -> tuple[Vector, Vector]:
    """Return the motion subspace of a velocity coordinate."""
    e, turning, zero = axis_at(W, I[c + AXIS]), I[c + MOTION] != SHIFT, (0.0, 0.0, 0.0)
    carried = cross(vector_at(W, I[c + CENTRE]), e)
    slide = 0.0 if I[c + MOTION] == TURN else W[I[c + PITCH]]
    return add(carried if turning else zero, scaled(slide, axis_at(W, I[c + WAY]))), e if turning else zero


@entry
def rates(I: Integers, W: Array, bodies: Integers, q: Array, v: Array, V: Array, A: Array) -> None:
    """Write spatial velocities and accelerations, at no joint accelerations, of joints: (joints, n, 6) each."""
    for k in range(I[NV]):
        W[I[A_HERE] + k] = 0.0
    for i in range(q.shape[0]):
        read(W, I[Q_HERE], q, i, I[NQ])
        read(W, I[V_HERE], v, i, I[NV])
        place(I, W)
        move(I, W)
        accelerate(I, W)
        for j in range(bodies.shape[0]):
            link = I[LINKS] + LINK_SIZE * bodies[j]
            p, here = vector_at(W, I[link + POSE] + ORIGIN), I[link + RATE]
            omega, alpha = vector_at(W, here + OMEGA), vector_at(W, here + ALPHA)
            velocity, acceleration = vector_at(W, here + VELOCITY), vector_at(W, here + ACCELERATION)
            at_origin = sub(velocity, cross(omega, p))
            bias = sub(sub(acceleration, cross(alpha, p)), cross(omega, velocity))
            for a in range(3):
                V[j, i, a], V[j, i, 3 + a] = at_origin[a], omega[a]
                A[j, i, a], A[j, i, 3 + a] = bias[a], alpha[a]


@entry
def integrated(I: Integers, W: Array, q: Array, x: Array, out: Array) -> None:
    """Write configurations (n, nq) moved along tangents (n, nv)."""
    for i in range(q.shape[0]):
        read(W, I[Q_HERE], q, i, I[NQ])
        read(W, I[X], x, i, I[NV])
        integrate(I, W, I[X])
        write(W, I[Q_HERE], out, i, 0, I[NQ])


@entry
def closures(I: Integers, W: Array, q: Array, residual: Array, J: Array, T: Array, frames: Array) -> None:
    """Write what closures are at configurations.

    Args:
        I, W: the chain and working memory.
        q: configurations (n, nq).
        residual: of all rows, is written (n, m).
        J: entries of the closure Jacobian that can differ from zero are written (n, m, nv).
        T: wrench on body 2 of a unit force in every row, world axes and origin, is written (n, m, 6).
        frames: of closures between frames R_1, p_1, R_2, p_2 are written, row by row (n, closures, 24).
    """
    for i in range(q.shape[0]):
        read(W, I[Q_HERE], q, i, I[NQ])
        place(I, W)
        look(I, W)
        jacobian(I, W)
        k = 0
        for c, at in enumerate(range(I[CLOSURES], I[CLOSURES_END], CLOSURE_SIZE)):
            for r in range(I[at + ROW0], I[at + ROW0_END], ROW_SIZE):
                unit = 1.0 / W[I[r + DIRECTION] + UNIT]
                residual[i, k] = unit * W[I[r + RESIDUAL]]
                m = I[r + JACOBIAN0]
                for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
                    J[i, k, I[e + COLUMN]] = unit * W[m]
                    m += 1
                if I[at + TIES] == 0:
                    f = vector_at(W, I[r + WRENCH] + FORCE)
                    moment = add(vector_at(W, I[r + WRENCH] + MOMENT), cross(vector_at(W, I[r + WRENCH] + POINT), f))
                    for a in range(3):
                        T[i, k, a], T[i, k, 3 + a] = unit * f[a], unit * moment[a]
                k += 1
            if I[at + TIES] == 0:
                for side in range(2):
                    pose, frame = I[at + POSE1 + side], I[at + FRAMES] + SECOND_FRAME * side
                    R, p = axes_of(W, pose, frame), point_of(W, pose, frame)
                    for a in range(9):
                        frames[i, c, 12 * side + a] = R[a]
                    for a in range(3):
                        frames[i, c, 12 * side + 9 + a] = p[a]


@entry
def drift(I: Integers, W: Array, q: Array, v: Array, out: Array) -> None:
    """Write the second rates of all rows at no joint accelerations (n, m)."""
    for k in range(I[NV]):
        W[I[A_HERE] + k] = 0.0
    for i in range(q.shape[0]):
        read(W, I[Q_HERE], q, i, I[NQ])
        read(W, I[V_HERE], v, i, I[NV])
        place(I, W)
        move(I, W)
        accelerate(I, W)
        look(I, W)
        drifts(I, W)
        for k, r in enumerate(range(I[ROWS], I[ROWS_END], ROW_SIZE)):
            out[i, k] = W[I[r + LEAD]] / W[I[r + DIRECTION] + UNIT]

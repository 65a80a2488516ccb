"""The equations of motion in the motors' coordinates, at one sample after the other.

    M_bar a_a + b = tau,        a = N a_a + a_0

a_0 being the accelerations of all joints when the motors have none, and b what the motors then need.
"""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import factorise, least_pivot
from fivebar_pin.engine.bodies import reduced_inertia, torques, twists
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.engine.complement import accelerations, complement, velocities
from fivebar_pin.engine.entries import need, open_by, read, write, write_matrix
from fivebar_pin.engine.rows import jacobian, look
from fivebar_pin.engine.tables import (
    A_HERE,
    COLUMN,
    ENTRIES,
    ENTRIES_END,
    ENTRY_SIZE,
    JACOBIAN0,
    M_BAR,
    MOTORS,
    N_HERE,
    NA,
    NQ,
    NV,
    Q_HERE,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    TAU,
    TO_A,
    TO_V,
    V_HERE,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import move, place
from fivebar_pin.engine.vectors import larger

__all__ = ["DRIVEN", "GIVEN", "OPEN", "RATE", "STATES", "WEAKEST", "reduced"]

GIVEN, DRIVEN = range(2)
"""Velocities of all joints are given, or follow from those of the motors."""
OPEN, WEAKEST, RATE, STATES = range(4)
"""Columns of what is told of a state: closure residual, least pivot, rate of the closures, scaled."""


@entry
def reduced(
    I: Integers, W: Array, q: Array, v: Array, source: int, links: Integers, points: Array, wrenches: Array,
    N: Array, M: Array, bias: Array, rest: Array, states: Array,
) -> int:  # fmt: skip
    """Write complement, reduced inertia, bias and the accelerations at rest of the motors.

    Args:
        I, W: the chain, with square blocks, and working memory.
        q, v: states (n, nq), (n, nv).
        source: where the velocities come from, `GIVEN` or `DRIVEN`.
        links, points, wrenches: of forces from outside (k,), (k, 3), (n, k, 6).
        N, M, bias, rest: are written (n, nv, na), (n, na, na), (n, na), (n, nv); not where a block is singular.
        states: what is told of the states; is written (n, STATES).

    Returns:
        Number of a spring whose force has no direction, else -1.
    """
    lost, i = -1, 0
    while lost < 0 and i < q.shape[0]:
        read(W, I[Q_HERE], q, i, I[NQ])
        read(W, I[V_HERE], v, i, I[NV])
        place(I, W)
        look(I, W)
        jacobian(I, W)
        regular = factorise(I, W)
        states[i, OPEN], states[i, WEAKEST], states[i, RATE] = open_by(I, W), least_pivot(I, W) if regular else 0.0, 0.0
        if states[i, WEAKEST] > 0.0:
            complement(I, W)
            for a in range(I[NA]):
                W[I[TO_V] + a], W[I[TO_A] + a] = W[I[V_HERE] + I[I[MOTORS] + a]], 0.0
            if source == DRIVEN:
                velocities(I, W)
            else:
                move(I, W)
            states[i, RATE] = _rate(I, W)
            accelerations(I, W)
            twists(I, W)
            lost = need(I, W, (0.0, 0.0, 0.0), links, points, wrenches, i)
            torques(I, W)
            reduced_inertia(I, W, I[M_BAR])
            write(W, I[TAU], bias, i, 0, I[NA])
            write(W, I[A_HERE], rest, i, 0, I[NV])
            write_matrix(W, I[M_BAR], M, i, I[NA], I[NA])
            write_matrix(W, I[N_HERE], N, i, I[NV], I[NA])
        i += 1
    return lost


@compiled
def _rate(I: Integers, W: Array) -> float:
    """Return the largest rate of the rows, scaled; infinite where one is not a number."""
    most = 0.0
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        k, rate = I[r + JACOBIAN0], 0.0
        for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
            rate += W[k] * W[I[V_HERE] + I[e + COLUMN]]
            k += 1
        most = larger(most, abs(rate))
    return most

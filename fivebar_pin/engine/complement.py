"""The natural orthogonal complement at one sample, and the rates that follow [Angeles and Lee 1988].

J_p N_p = -J_a,    v = N v_a,    J_p a_p = -(J_a a_a + (dJ/dt) v)
"""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import combine, solve, substitute
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.rows import drifts
from fivebar_pin.engine.tables import (
    A_HERE,
    BLOCK_SIZE,
    BLOCKS,
    BLOCKS_END,
    COLUMN,
    COLUMN_LIST,
    COLUMN_SIZE,
    COLUMNS,
    ENTRIES,
    ENTRIES_END,
    ENTRY_SIZE,
    HEIGHT,
    JACOBIAN0,
    LEAD,
    LOCAL,
    MISFIT,
    MIX,
    MOTOR_COUNT,
    MOTOR_LIST,
    MOTORS,
    N_HERE,
    NA,
    NV,
    OWNER,
    RAW,
    RAW_RHS,
    RHS,
    ROUNDED,
    ROW_LIST,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SCALE,
    STATUS,
    TO_A,
    TO_V,
    TOGETHER,
    V_HERE,
    WIDTH,
    Integers,
    X,
)  # fmt: skip
from fivebar_pin.engine.tree import drift, move

__all__ = ["accelerations", "complement", "velocities"]

_TIED = 1e-7  # rate of closures at unit speed of a motor from which on they tie it to others [-]


@compiled
def complement(I: Integers, W: Array) -> None:
    """Write the passive rows of N; where the closures tie the motors to each other, `STATUS` says so."""
    na = I[NA]
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        n, columns = I[g + WIDTH], I[g + COLUMN_LIST]
        for i in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
            a = I[i]
            _right_side(I, W, g, I[N_HERE] + a)
            substitute(I, W, g)
            for k in range(n):
                W[I[N_HERE] + I[columns + k] * na + a] = W[I[RHS] + k]
            for k in range(n, I[g + HEIGHT]):
                if not abs(W[I[RHS] + k]) * W[I[SCALE] + I[I[MOTORS] + a]] <= max(_TIED, ROUNDED * W[I[MISFIT]]):
                    W[I[STATUS]] = TOGETHER


@compiled
def _right_side(I: Integers, W: Array, g: int, N: int) -> None:
    """Write what the rows of a block lack at unit speed of one motor, whose column of N begins at W[N]."""
    raw_rhs = I[RHS] if I[g + MIX] < 0 else I[RAW_RHS]
    for i in range(I[g + RAW]):
        r = I[I[g + ROW_LIST] + i]
        k, value = I[r + JACOBIAN0], 0.0
        for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
            if I[e + LOCAL] < 0:
                value -= W[k] * W[N + I[e + COLUMN] * I[NA]]
            k += 1
        W[raw_rhs + i] = value
    combine(I, W, g)


@compiled
def velocities(I: Integers, W: Array) -> None:
    """Write the velocities of all coordinates and links, v = N v_a, from those of the motors."""
    k = I[COLUMNS] + OWNER
    for i in range(I[NV]):
        g = I[k]
        k += COLUMN_SIZE
        if g < 0:
            W[I[V_HERE] + i] = W[I[TO_V] - 1 - g]
        else:
            total = 0.0
            for m in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
                total += W[I[N_HERE] + i * I[NA] + I[m]] * W[I[TO_V] + I[m]]
            W[I[V_HERE] + i] = total
    move(I, W)


@compiled
def accelerations(I: Integers, W: Array) -> None:
    """Write the accelerations of all coordinates; those of the links are left as at no joint accelerations."""
    drift(I, W)
    drifts(I, W)
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        W[I[r + LEAD]] = -W[I[r + LEAD]]
    for a in range(I[NA]):
        W[I[X] + I[I[MOTORS] + a]] = W[I[TO_A] + a]
    solve(I, W)
    for k in range(I[NV]):
        W[I[A_HERE] + k] = W[I[X] + k]

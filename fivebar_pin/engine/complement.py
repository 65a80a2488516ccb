"""The natural orthogonal complement at one sample, and the rates that follow [Angeles and Lee 1988].

    J_p N_p = -J_a,    v = N v_a,    J_p a_p = -(J_a a_a + (dJ/dt) v)
"""

from __future__ import annotations

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import clear, mix_in, solve, substitute
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
    MOTOR_COUNT,
    MOTOR_LIST,
    MOTORS,
    N_HERE,
    NA,
    NV,
    OWNER,
    RAW,
    RHS,
    ROW_LIST,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SCALE,
    V_HERE,
    WIDTH,
    Integers,
    X,
)  # fmt: skip
from fivebar_pin.engine.tree import accelerate, move

__all__ = ["accelerations", "complement", "velocities"]


@compiled
def complement(I: Integers, W: Array) -> float:
    """Write the passive rows of N; return by how much the closures tie the motors to each other, scaled."""
    tied, na = 0.0, I[NA]
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        n, columns = I[g + WIDTH], I[g + COLUMN_LIST]
        for i in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
            a = I[i]
            _right_side(I, W, g, I[N_HERE] + a)
            substitute(I, W, g)
            for k in range(n):
                W[I[N_HERE] + I[columns + k] * na + a] = W[I[RHS] + k]
            for k in range(n, I[g + HEIGHT]):
                tied = max(tied, abs(W[I[RHS] + k]) * W[I[SCALE] + I[I[MOTORS] + a]])
    return tied


@compiled
def _right_side(I: Integers, W: Array, g: int, N: int) -> None:
    """Write what the rows of a block lack at unit speed of one motor, whose column of N begins at W[N]."""
    clear(I, W, g)
    for i in range(I[g + RAW]):
        r = I[I[g + ROW_LIST] + i]
        k, value = I[r + JACOBIAN0], 0.0
        for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
            if I[e + LOCAL] < 0:
                value -= W[k] * W[N + I[e + COLUMN] * I[NA]]
            k += 1
        mix_in(I, W, g, i, value)


@compiled
def velocities(I: Integers, W: Array, v_a: Array) -> None:
    """Write the velocities of all coordinates and links, v = N v_a."""
    k = I[COLUMNS] + OWNER
    for i in range(I[NV]):
        g = I[k]
        k += COLUMN_SIZE
        if g < 0:
            W[I[V_HERE] + i] = v_a[-1 - g]
        else:
            total = 0.0
            for m in range(I[g + MOTOR_LIST], I[g + MOTOR_LIST] + I[g + MOTOR_COUNT]):
                total += W[I[N_HERE] + i * I[NA] + I[m]] * v_a[I[m]]
            W[I[V_HERE] + i] = total
    move(I, W)


@compiled
def accelerations(I: Integers, W: Array, a_a: Array) -> None:
    """Write the accelerations of all coordinates; those of the links are left as at no joint accelerations."""
    for k in range(I[NV]):
        W[I[A_HERE] + k] = 0.0
    accelerate(I, W)
    drifts(I, W)
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        W[I[r + LEAD]] = -W[I[r + LEAD]]
    for a in range(I[NA]):
        W[I[X] + I[I[MOTORS] + a]] = a_a[a]
    solve(I, W)
    for k in range(I[NV]):
        W[I[A_HERE] + k] = W[I[X] + k]

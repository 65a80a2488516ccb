"""From one design of a mechanism to another: the constants change, the loops stay closed.

From a closed configuration of one design the constants go to those of another along straight lines,
c_s = (1 - s) c_0 + s c_1, and Newton's method follows from where the step before ended. A step is taken where no block
of the passive Jacobian turns singular on the straight line between the Jacobians at its ends,

    |J_p0^-1|, |J_p1^-1| <= β,    β |J_p1 - J_p0| <= 1,

so that the determinants keep their signs, and where no joint moves far; else it is halved. What comes out is on the
assembly mode that the configuration began on.
"""

from __future__ import annotations

from math import sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import inverse_norm
from fivebar_pin.engine.closing import close
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.engine.entries import read, write
from fivebar_pin.engine.following import copy_state
from fivebar_pin.engine.rows import jacobian, look
from fivebar_pin.engine.tables import (
    BLOCK_SIZE,
    BLOCKED,
    BLOCKS,
    BLOCKS_END,
    CLOSED,
    COLUMN,
    ENTRIES,
    ENTRIES_END,
    ENTRY_SIZE,
    FOLLOWED,
    J_BEFORE,
    J_HERE,
    JACOBIAN0,
    LOCAL,
    MOTORS,
    MOVED,
    NA,
    NORMS,
    NORMS_BEFORE,
    NQ,
    NUMBER,
    NV,
    Q_BEFORE,
    Q_HERE,
    RAW,
    RESIDUAL,
    ROW_LIST,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SCALE,
    SIGNS,
    SIGNS_BEFORE,
    STATUS,
    Integers,
)  # fmt: skip
from fivebar_pin.engine.tree import place
from fivebar_pin.engine.vectors import larger

__all__ = ["lead", "left_open"]

_SHORTEST = 2.0**-12  # step, of the way to another design, below which the way is blocked [-]
_FARTHEST = 0.5  # move of a joint in one step up to which Newton ends nearby [rad, or chain lengths]


@entry
def lead(I: Integers, W: Array, before: Array, knots: Array, q: Array) -> None:
    """Lead q[0], closed for the constants before[0], through the constants (k, constants) of the knots, in place.

    The motors stay where they are. `STATUS` tells how it ended.
    """
    read(W, I[Q_HERE], q, 0, I[NQ])
    read(W, 0, before, 0, before.shape[1])
    close(I, W)
    _measure(I, W)
    W[I[STATUS]] = FOLLOWED if W[I[CLOSED]] == 1.0 else BLOCKED
    for knot in range(knots.shape[0]):
        done, step = 0.0, 1.0
        while done < 1.0 and W[I[STATUS]] == FOLLOWED:
            step = min(step, 1.0 - done)
            copy_state(I, W, I[Q_HERE], I[Q_BEFORE], I[J_HERE], I[J_BEFORE], I[SIGNS], I[SIGNS_BEFORE])
            for k in range(I[NV]):
                W[I[MOVED] + k] = 0.0
            _between(W, before, knots, knot, done + step)
            close(I, W)
            if W[I[CLOSED]] == 1.0:
                _measure(I, W)
                _compare(I, W)
            if W[I[CLOSED]] == 1.0:
                done, step = done + step, 2.0 * step
            else:
                copy_state(I, W, I[Q_BEFORE], I[Q_HERE], I[J_BEFORE], I[J_HERE], I[SIGNS_BEFORE], I[SIGNS])
                step *= 0.5
                if step < _SHORTEST:
                    W[I[STATUS]] = BLOCKED
    write(W, I[Q_HERE], q, 0, 0, I[NQ])


@compiled
def _between(W: Array, before: Array, knots: Array, knot: int, s: float) -> None:
    """Write the constants at a share s of the way to a knot, from the one before it."""
    for i in range(knots.shape[1]):
        start = knots[knot - 1, i] if knot > 0 else before[0, i]
        W[i] = knots[knot, i] if s >= 1.0 else start + s * (knots[knot, i] - start)


@compiled
def _measure(I: Integers, W: Array) -> None:
    """Write the norms of the inverses of the blocks."""
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        W[I[NORMS] + I[g + NUMBER]] = inverse_norm(I, W, g)


@compiled
def _compare(I: Integers, W: Array) -> None:
    """Take the flag `CLOSED` down unless this point and the one before are on one branch."""
    for k in range(I[NV]):
        if not abs(W[I[MOVED] + k]) <= _FARTHEST * W[I[SCALE] + k]:
            W[I[CLOSED]] = 0.0
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        k = I[g + NUMBER]
        change = _change(I, W, g)
        kept = W[I[NORMS] + k] * change <= 1.0 and W[I[NORMS_BEFORE] + k] * change <= 1.0
        if not (kept and W[I[SIGNS] + k] == W[I[SIGNS_BEFORE] + k]):
            W[I[CLOSED]] = 0.0


@compiled
def _change(I: Integers, W: Array, g: int) -> float:
    """Return how far the passive columns of a block have changed, scaled."""
    total, before = 0.0, I[J_BEFORE] - I[J_HERE]
    for i in range(I[g + RAW]):
        r = I[I[g + ROW_LIST] + i]
        k = I[r + JACOBIAN0]
        for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
            if I[e + LOCAL] >= 0:
                total += ((W[k] - W[k + before]) * W[I[SCALE] + I[e + COLUMN]]) ** 2
            k += 1
    return sqrt(total)


@entry
def left_open(I: Integers, W: Array, q: Array, N: Array, sample: int) -> float:
    """Return by how much the rows of I are open at a sample of a motion, or opened at unit speed of a motor, scaled.

    Args:
        I: records of the chain with other rows in place of its own.
        W: working memory.
        q, N: the motion (n, nq), (n, nv, na).
        sample: its number.
    """
    read(W, I[Q_HERE], q, sample, I[NQ])
    place(I, W)
    look(I, W)
    jacobian(I, W)
    most = 0.0
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        most = larger(most, abs(W[I[r + RESIDUAL]]))
        for a in range(I[NA]):
            rate, k = 0.0, I[r + JACOBIAN0]
            for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
                rate += W[k] * N[sample, I[e + COLUMN], a]
                k += 1
            most = larger(most, abs(rate) * W[I[SCALE] + I[I[MOTORS] + a]])
    return most

"""Solving for the passive coordinates, block by block.

A block is closures that determine some passive coordinates together, once the actuated coordinates and those of
earlier blocks are known; the blocks in their order are a triangular system, so that a chain of loops on one crank
costs by its length. A block A x = b with as many rows as columns is factorised by Gauss with the largest pivot of
each column; a taller one, consistent because its mechanism moves at all, by Householder. Most blocks are of one
column or of two: they have no loops.
"""

from __future__ import annotations

from math import inf, sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.factors import (
    gauss,
    gauss_of_two,
    householder,
    invert,
    lower,
    reflect,
    square,
    upper,
    upper_back,
)  # fmt: skip
from fivebar_pin.engine.tables import (
    BLOCK_SIZE,
    BLOCKS,
    BLOCKS_END,
    COLUMN,
    COLUMN_LIST,
    ENTRIES,
    ENTRIES_END,
    ENTRY_SIZE,
    FACTORS,
    HEIGHT,
    JACOBIAN0,
    LEAD,
    LOCAL,
    MIX,
    NORMS,
    NUMBER,
    PIVOTS,
    RAW,
    RAW_RHS,
    RHS,
    ROW_LIST,
    SCALE,
    SIGNS,
    WEAK,
    WIDTH,
    Integers,
    X,
)  # fmt: skip

__all__ = ["combine", "factorise", "inverse_norm", "least_pivot", "solve", "substitute", "substitute_back"]

_EXPLICIT = 4  # columns up to which the inverse is made
_ITERATIONS = 2  # of inverse iteration, which is warm: blocks change little from one sample to the next
_STIRRED = 0.3  # part of a direction without any symmetry that is added to where it starts [-]
_GOLDEN = 0.6180339887498949


@compiled
def factorise(I: Integers, W: Array) -> bool:
    """Factorise all blocks of the Jacobian, and tell whether none is singular; their determinants leave their signs."""
    regular = True
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        _gather(I, W, g)
        n, m, A = I[g + WIDTH], I[g + HEIGHT], I[g + FACTORS]
        at = I[SIGNS] + I[g + NUMBER]
        if m > n:
            W[at] = householder(W, A, m, n)
        elif n > 2:
            W[at] = gauss(W, A, n, I[g + PIVOTS])
        elif n == 2:
            W[at] = gauss_of_two(W, A, I[g + PIVOTS])
        else:
            W[at] = invert(W, A)
        regular = regular and W[at] != 0.0
    return regular


@compiled
def _gather(I: Integers, W: Array, g: int) -> None:
    """Write the passive columns of a block where its factors will stand, its rows combined where they are mixed."""
    n, raw, height, mix, A = I[g + WIDTH], I[g + RAW], I[g + HEIGHT], I[g + MIX], I[g + FACTORS]
    for i in range(A, A + height * n):
        W[i] = 0.0
    for i in range(raw):
        r = I[I[g + ROW_LIST] + i]
        k = I[r + JACOBIAN0]
        for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
            local = I[e + LOCAL]
            if local >= 0:
                if mix < 0:
                    W[A + i * n + local] = W[k]
                else:
                    for h in range(height):
                        W[A + h * n + local] += W[mix + h * raw + i] * W[k]
            k += 1


@compiled
def solve(I: Integers, W: Array) -> None:
    """Solve J x = lead for the passive part of x; its actuated part stands there already."""
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        raw_rhs = I[RHS] if I[g + MIX] < 0 else I[RAW_RHS]
        for i in range(I[g + RAW]):
            r = I[I[g + ROW_LIST] + i]
            k, value = I[r + JACOBIAN0], W[I[r + LEAD]]
            for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
                if I[e + LOCAL] < 0:
                    value -= W[k] * W[I[X] + I[e + COLUMN]]
                k += 1
            W[raw_rhs + i] = value
        combine(I, W, g)
        substitute(I, W, g)
        for k in range(I[g + WIDTH]):
            W[I[X] + I[I[g + COLUMN_LIST] + k]] = W[I[RHS] + k]


@compiled
def combine(I: Integers, W: Array, g: int) -> None:
    """Combine the rows of a right side where those of its block are mixed, from RAW_RHS to RHS."""
    raw, mix = I[g + RAW], I[g + MIX]
    for h in range(I[g + HEIGHT] if mix >= 0 else 0):
        total = 0.0
        for i in range(raw):
            total += W[mix + h * raw + i] * W[I[RAW_RHS] + i]
        W[I[RHS] + h] = total


@compiled
def substitute(I: Integers, W: Array, g: int) -> None:
    """Solve A x = rhs of a block in place; of a tall one x has the least residual, which stands behind it."""
    n, m, b, A, pivots = I[g + WIDTH], I[g + HEIGHT], I[RHS], I[g + FACTORS], I[g + PIVOTS]
    if m > n:
        reflect(W, A, m, n, b)
        upper(W, A, n, b)
    elif n > 2:
        lower(W, A, n, b, pivots)
        upper(W, A, n, b)
    elif n == 2:
        first, second = W[b], W[b + 1]
        if W[pivots] == 1.0:
            first, second = second, first
        second = (second - W[A + 2] * first) * W[A + 3]
        W[b], W[b + 1] = (first - W[A + 1] * second) * W[A], second
    else:
        W[b] *= W[A]


@compiled
def substitute_back(I: Integers, W: Array, g: int) -> None:
    """Solve A^T x = rhs of a factorised square block in place; of a tall one R^T x = rhs."""
    n, b, A, pivots = I[g + WIDTH], I[RHS], I[g + FACTORS], I[g + PIVOTS]
    upper_back(W, A, n, b)
    if I[g + HEIGHT] == n:
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                W[b + i] -= W[A + k * n + i] * W[b + k]
        for k in range(n - 1, -1, -1):
            p = int(W[pivots + k])
            W[b + k], W[b + p] = W[b + p], W[b + k]


@compiled
def inverse_norm(I: Integers, W: Array, g: int) -> float:
    """Write and return the size of the (pseudo-)inverse of a factorised block, scaled: 1 / its smallest singular value.

    Of small square blocks it is the Frobenius norm, which is at least as large.
    """
    n, at = I[g + WIDTH], I[NORMS] + I[g + NUMBER]
    if n > 2 or I[g + HEIGHT] > n:
        W[at] = _norm_by_columns(I, W, g)
    elif n == 2:
        W[at] = _norm_of_two(I, W, g)
    else:
        W[at] = _norm_of_one(I, W, g)
    return float(W[at])


@compiled
def _norm_of_one(I: Integers, W: Array, g: int) -> float:
    """Return the size of the inverse of a block (1, 1)."""
    return float(abs(W[I[g + FACTORS]]) / W[I[SCALE] + I[I[g + COLUMN_LIST]]])


@compiled
def _norm_of_two(I: Integers, W: Array, g: int) -> float:
    """Return the size of the inverse of a block (2, 2), of U^-1 L^-1 = [[p (1 + u l q), -p u q], [-l q, q]]."""
    k, columns = I[g + FACTORS], I[g + COLUMN_LIST]
    p, u, low, q = W[k], W[k + 1], W[k + 2], W[k + 3]  # p, q are the inverses on the diagonal
    row1, row2 = p / W[I[SCALE] + I[columns]], q / W[I[SCALE] + I[columns + 1]]
    across, along = u * q, 1.0 + u * low * q
    return sqrt(row1 * row1 * (along * along + across * across) + row2 * row2 * (1.0 + low * low))


@compiled
def _norm_by_columns(I: Integers, W: Array, g: int) -> float:
    """Return the size of the inverse of a block of any size, see `inverse_norm`.

    Small square blocks: the Frobenius norm, which is at least as large. Others: inverse iteration on A^T A, which
    starts from the weakest direction of the sample before, in `WEAK`, and leaves that of this one there. It is
    stirred: what was weakest in a symmetric mechanism is often orthogonal to what will be.
    """
    n, b, weak, columns = I[g + WIDTH], I[RHS], I[g + WEAK], I[g + COLUMN_LIST]
    explicit = n <= _EXPLICIT and I[g + HEIGHT] == n
    most = 0.0
    for k in range(n if explicit else _ITERATIONS):
        if explicit:
            for i in range(n):
                W[b + i] = 1.0 if i == k else 0.0
        else:
            for i in range(n):
                stir = _STIRRED * ((_GOLDEN * i) % 1.0 - 0.5) if k == 0 else 0.0
                W[b + i] = (W[weak + i] + stir) / W[I[SCALE] + I[columns + i]]
            substitute_back(I, W, g)
            size = sqrt(square(W, b, n))
            for i in range(n):
                W[b + i] /= size
        if I[g + HEIGHT] == n:
            substitute(I, W, g)
        else:
            upper(W, I[g + FACTORS], n, b)
        for i in range(n):
            W[b + i] /= W[I[SCALE] + I[columns + i]]
        size = square(W, b, n)
        most = most + size if explicit else size
        for i in range(n):
            W[weak + i] = W[b + i] / sqrt(size) if size < inf else 1.0  # a singular block is not remembered
    return sqrt(most)


@compiled
def least_pivot(I: Integers, W: Array) -> float:
    """Return the least pivot of all factors, scaled; zero where one is not a number."""
    least = inf
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        n = I[g + WIDTH]
        for k in range(n):
            size = abs(W[I[g + FACTORS] + k * n + k]) * W[I[SCALE] + I[I[g + COLUMN_LIST] + k]]
            if not size >= least:
                least = size if size > 0.0 else 0.0
    return least

"""Solving for the passive coordinates, block by block.

A block is closures that determine some passive coordinates together, once the actuated coordinates and those of
earlier blocks are known; the blocks in their order are a triangular system, so that a chain of loops on one crank costs
by its length. A block A x = b with as many rows as columns is factorised by Gauss with the largest pivot of each column;
a taller one, consistent because its mechanism moves at all, by Householder.

Its factors stand from `FACTOR` on, row by row. Behind those of a tall block stand the first numbers of the reflections
A = H_1 ... H_n R, H = 1 - w w^T; the others stand below the diagonal.
"""

from __future__ import annotations

from math import inf, sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled
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
        sign = _gauss(W, A, n, I[g + PIVOTS]) if m == n else _householder(W, A, m, n)
        W[I[SIGNS] + I[g + NUMBER]] = sign
        regular = regular and sign != 0.0
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
def _gauss(W: Array, A: int, n: int, pivots: int) -> float:
    """Factorise A = P L U in place and return the sign of det A."""
    sign = 1.0
    for k in range(n):
        p, most = k, abs(W[A + k * n + k])
        for i in range(k + 1, n):
            if abs(W[A + i * n + k]) > most:
                p, most = i, abs(W[A + i * n + k])
        W[pivots + k] = p
        if not most > 0.0:
            return 0.0
        if p != k:
            sign = -sign
            for j in range(n):
                W[A + k * n + j], W[A + p * n + j] = W[A + p * n + j], W[A + k * n + j]
        if W[A + k * n + k] < 0.0:
            sign = -sign
        for i in range(k + 1, n):
            if W[A + i * n + k] != 0.0:
                factor = W[A + i * n + k] / W[A + k * n + k]
                W[A + i * n + k] = factor
                for j in range(k + 1, n):
                    W[A + i * n + j] -= factor * W[A + k * n + j]
    return sign


@compiled
def _householder(W: Array, A: int, m: int, n: int) -> float:
    """Factorise A = Q R (m, n), m > n, in place and return 1, or 0 where a column depends on those before."""
    for k in range(n):
        size = 0.0
        for i in range(k, m):
            size += W[A + i * n + k] ** 2
        size = sqrt(size)
        if not size > 0.0:
            return 0.0
        head = W[A + k * n + k]
        size = -size if head > 0.0 else size
        unit = sqrt(size * (size - head))  # so that w w^T reflects the column onto size e_k
        W[A + m * n + k] = first = (head - size) / unit
        for i in range(k + 1, m):
            W[A + i * n + k] /= unit
        W[A + k * n + k] = size
        for j in range(k + 1, n):
            along = first * W[A + k * n + j]
            for i in range(k + 1, m):
                along += W[A + i * n + k] * W[A + i * n + j]
            W[A + k * n + j] -= along * first
            for i in range(k + 1, m):
                W[A + i * n + j] -= along * W[A + i * n + k]
    return 1.0


@compiled
def solve(I: Integers, W: Array) -> None:
    """Solve J x = lead for the passive part of x; its actuated part stands there already."""
    for g in range(I[BLOCKS], I[BLOCKS_END], BLOCK_SIZE):
        for i in range(I[g + RAW]):
            r = I[I[g + ROW_LIST] + i]
            k, value = I[r + JACOBIAN0], W[I[r + LEAD]]
            for e in range(I[r + ENTRIES], I[r + ENTRIES_END], ENTRY_SIZE):
                if I[e + LOCAL] < 0:
                    value -= W[k] * W[I[X] + I[e + COLUMN]]
                k += 1
            W[I[RAW_RHS] + i] = value
        combine(I, W, g)
        substitute(I, W, g)
        for k in range(I[g + WIDTH]):
            W[I[X] + I[I[g + COLUMN_LIST] + k]] = W[I[RHS] + k]


@compiled
def combine(I: Integers, W: Array, g: int) -> None:
    """Combine the rows of a right side where those of its block are mixed; the raw ones stand behind, at RAW_RHS."""
    raw, mix = I[g + RAW], I[g + MIX]
    for h in range(I[g + HEIGHT]):
        k, total = mix + h * raw, W[I[RAW_RHS] + h]
        if mix >= 0:
            total = 0.0
            for i in range(raw):
                total += W[k + i] * W[I[RAW_RHS] + i]
        W[I[RHS] + h] = total


@compiled
def substitute(I: Integers, W: Array, g: int) -> None:
    """Solve A x = rhs of a factorised block in place; of a tall one x has the least residual, which stands behind it."""
    n, m, b, A, pivots = I[g + WIDTH], I[g + HEIGHT], I[RHS], I[g + FACTORS], I[g + PIVOTS]
    if m == n:
        for k in range(n):
            p = int(W[pivots + k])
            W[b + k], W[b + p] = W[b + p], W[b + k]
        for i in range(1, n):
            for k in range(i):
                W[b + i] -= W[A + i * n + k] * W[b + k]
    else:
        _reflect(W, A, m, n, b)
    _upper(W, A, n, b)


@compiled
def substitute_back(I: Integers, W: Array, g: int) -> None:
    """Solve A^T x = rhs of a factorised square block in place; of a tall one R^T x = rhs."""
    n, b, A, pivots = I[g + WIDTH], I[RHS], I[g + FACTORS], I[g + PIVOTS]
    _upper_back(W, A, n, b)
    if I[g + HEIGHT] == n:
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                W[b + i] -= W[A + k * n + i] * W[b + k]
        for k in range(n - 1, -1, -1):
            p = int(W[pivots + k])
            W[b + k], W[b + p] = W[b + p], W[b + k]


@compiled
def _reflect(W: Array, A: int, m: int, n: int, b: int) -> None:
    """Return Q^T b in place."""
    for k in range(n):
        first = W[A + m * n + k]
        along = first * W[b + k]
        for i in range(k + 1, m):
            along += W[A + i * n + k] * W[b + i]
        W[b + k] -= along * first
        for i in range(k + 1, m):
            W[b + i] -= along * W[A + i * n + k]


@compiled
def _upper(W: Array, A: int, n: int, b: int) -> None:
    """Solve U x = b in place, U the upper triangle of A."""
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            W[b + i] -= W[A + i * n + k] * W[b + k]
        W[b + i] /= W[A + i * n + i]


@compiled
def _upper_back(W: Array, A: int, n: int, b: int) -> None:
    """Solve U^T x = b in place."""
    for i in range(n):
        for k in range(i):
            W[b + i] -= W[A + k * n + i] * W[b + k]
        W[b + i] /= W[A + i * n + i]


@compiled
def inverse_norm(I: Integers, W: Array, g: int) -> float:
    """Return the size of the (pseudo-)inverse of a factorised block, scaled: one over its smallest singular value.

    Small square blocks: the Frobenius norm, which is at least as large. Others: inverse iteration on A^T A, which starts
    from the weakest direction of the sample before, in `WEAK`, and leaves that of this one there. It is stirred: what was
    weakest in a symmetric mechanism is often orthogonal to what will be.
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
            size = sqrt(_square(W, b, n))
            for i in range(n):
                W[b + i] /= size
        if I[g + HEIGHT] == n:
            substitute(I, W, g)
        else:
            _upper(W, I[g + FACTORS], n, b)
        for i in range(n):
            W[b + i] /= W[I[SCALE] + I[columns + i]]
        size = _square(W, b, n)
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


@compiled
def _square(W: Array, b: int, n: int) -> float:
    """Return the square of the length of a vector."""
    total = 0.0
    for i in range(b, b + n):
        total += W[i] * W[i]
    return total

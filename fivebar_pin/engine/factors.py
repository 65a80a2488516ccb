"""The factors of one block, in place, and triangular systems.

They stand from W[A] on, row by row, those on the diagonal of an upper triangle as their inverses. Behind those of a
tall matrix stand the first numbers of the reflections A = H_1 ... H_n R, H = 1 - w w^T; the others stand below the
diagonal.
"""

from __future__ import annotations

from math import sqrt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled

__all__ = ["gauss", "gauss_of_two", "householder", "invert", "lower", "reflect", "square", "upper", "upper_back"]


@compiled
def invert(W: Array, k: int) -> float:
    """Write the inverse of a number in its place and return its sign, or 0 where it has none."""
    x = W[k]
    regular = abs(x) > 0.0
    if regular:
        W[k] = 1.0 / x
    return (1.0 if x > 0.0 else -1.0) if regular else 0.0


@compiled
def gauss_of_two(W: Array, A: int, pivots: int) -> float:
    """Factorise A = P L U (2, 2) in place and return the sign of det A."""
    swap = abs(W[A + 2]) > abs(W[A])
    W[pivots], W[pivots + 1] = 1.0 if swap else 0.0, 1.0
    if swap:
        W[A], W[A + 1], W[A + 2], W[A + 3] = W[A + 2], W[A + 3], W[A], W[A + 1]
    sign = invert(W, A)
    factor = W[A + 2] * W[A]
    W[A + 2] = factor
    W[A + 3] -= factor * W[A + 1]
    sign *= invert(W, A + 3)
    return -sign if swap else sign


@compiled
def gauss(W: Array, A: int, n: int, pivots: int) -> float:
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
        sign *= invert(W, A + k * n + k)
        for i in range(k + 1, n):
            if W[A + i * n + k] != 0.0:
                factor = W[A + i * n + k] * W[A + k * n + k]
                W[A + i * n + k] = factor
                for j in range(k + 1, n):
                    W[A + i * n + j] -= factor * W[A + k * n + j]
    return sign


@compiled
def householder(W: Array, A: int, m: int, n: int) -> float:
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
        W[A + k * n + k] = 1.0 / size
        for j in range(k + 1, n):
            along = first * W[A + k * n + j]
            for i in range(k + 1, m):
                along += W[A + i * n + k] * W[A + i * n + j]
            W[A + k * n + j] -= along * first
            for i in range(k + 1, m):
                W[A + i * n + j] -= along * W[A + i * n + k]
    return 1.0


@compiled
def lower(W: Array, A: int, n: int, b: int, pivots: int) -> None:
    """Solve P L x = b in place."""
    for k in range(n):
        p = int(W[pivots + k])
        W[b + k], W[b + p] = W[b + p], W[b + k]
    for i in range(1, n):
        total = W[b + i]
        for k in range(i):
            total -= W[A + i * n + k] * W[b + k]
        W[b + i] = total


@compiled
def upper(W: Array, A: int, n: int, b: int) -> None:
    """Solve U x = b in place, U the upper triangle of A."""
    for i in range(n - 1, -1, -1):
        total = W[b + i]
        for k in range(i + 1, n):
            total -= W[A + i * n + k] * W[b + k]
        W[b + i] = total * W[A + i * n + i]


@compiled
def upper_back(W: Array, A: int, n: int, b: int) -> None:
    """Solve U^T x = b in place."""
    for i in range(n):
        total = W[b + i]
        for k in range(i):
            total -= W[A + k * n + i] * W[b + k]
        W[b + i] = total * W[A + i * n + i]


@compiled
def reflect(W: Array, A: int, m: int, n: int, b: int) -> None:
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
def square(W: Array, b: int, n: int) -> float:
    """Return the square of the length of a vector."""
    total = 0.0
    for i in range(b, b + n):
        total += W[i] * W[i]
    return total

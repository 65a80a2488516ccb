"""Vectors of three and matrices of nine numbers (row by row) as tuples, and where they stand among others.

Tuples of numbers stay in registers; slices of arrays would be counted as references, once for every use.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import TypeAlias

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled

__all__ = [
    "Matrix",
    "Vector",
    "add",
    "axis_at",
    "back",
    "cross",
    "dot",
    "larger",
    "length_of",
    "matrix_at",
    "product",
    "push",
    "put",
    "put_matrix",
    "scaled",
    "sub",
    "times",
    "turned_about_z",
    "vector_at",
]

Vector: TypeAlias = tuple[float, float, float]
Matrix: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]


_1, _2, _3, _4, _5, _6, _7, _8 = (np.uint64(k) for k in range(1, 9))  # places without a sign need no check for it


@compiled
def larger(most: float, size: float) -> float:
    """Return the larger one, infinite where the second is not a number: max() would pass over it."""
    if size <= most:
        return most
    return size if size < inf else inf


@compiled
def vector_at(W: Array, k: int) -> Vector:
    """Return the three numbers from place k on."""
    i = np.uint64(k)
    return W[i], W[i + _1], W[i + _2]


@compiled
def put(W: Array, k: int, u: Vector) -> None:
    """Write them."""
    i = np.uint64(k)
    W[i], W[i + _1], W[i + _2] = u


@compiled
def push(W: Array, k: int, u: Vector) -> None:
    """Add to them."""
    i = np.uint64(k)
    W[i], W[i + _1], W[i + _2] = W[i] + u[0], W[i + _1] + u[1], W[i + _2] + u[2]


@compiled
def axis_at(W: Array, k: int) -> Vector:
    """Return the column of a rotation whose first number stands at place k."""
    i = np.uint64(k)
    return W[i], W[i + _3], W[i + _6]


@compiled
def matrix_at(W: Array, k: int) -> Matrix:
    """Return the nine numbers from place k on."""
    i = np.uint64(k)
    return W[i], W[i + _1], W[i + _2], W[i + _3], W[i + _4], W[i + _5], W[i + _6], W[i + _7], W[i + _8]


@compiled
def put_matrix(W: Array, k: int, A: Matrix) -> None:
    """Write them."""
    i = np.uint64(k)
    W[i], W[i + _1], W[i + _2], W[i + _3], W[i + _4], W[i + _5], W[i + _6], W[i + _7], W[i + _8] = A


@compiled
def add(u: Vector, w: Vector) -> Vector:
    return u[0] + w[0], u[1] + w[1], u[2] + w[2]


@compiled
def sub(u: Vector, w: Vector) -> Vector:
    return u[0] - w[0], u[1] - w[1], u[2] - w[2]


@compiled
def scaled(s: float, u: Vector) -> Vector:
    return s * u[0], s * u[1], s * u[2]


@compiled
def dot(u: Vector, w: Vector) -> float:
    return u[0] * w[0] + u[1] * w[1] + u[2] * w[2]


@compiled
def length_of(u: Vector) -> float:
    return sqrt(dot(u, u))


@compiled
def cross(u: Vector, w: Vector) -> Vector:
    return u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]


@compiled
def times(A: Matrix, u: Vector) -> Vector:
    """Return A u."""
    return (
        A[0] * u[0] + A[1] * u[1] + A[2] * u[2],
        A[3] * u[0] + A[4] * u[1] + A[5] * u[2],
        A[6] * u[0] + A[7] * u[1] + A[8] * u[2],
    )


@compiled
def back(A: Matrix, u: Vector) -> Vector:
    """Return A^T u."""
    return (
        A[0] * u[0] + A[3] * u[1] + A[6] * u[2],
        A[1] * u[0] + A[4] * u[1] + A[7] * u[2],
        A[2] * u[0] + A[5] * u[1] + A[8] * u[2],
    )


@compiled
def product(A: Matrix, B: Matrix) -> Matrix:
    """Return A B."""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6],
        A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7],
        A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6],
        A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )


@compiled
def turned_about_z(A: Matrix, c: float, s: float) -> Matrix:
    """Return A turned about its own z axis by the angle of this cosine and sine."""
    return (
        c * A[0] + s * A[1], c * A[1] - s * A[0], A[2],
        c * A[3] + s * A[4], c * A[4] - s * A[3], A[5],
        c * A[6] + s * A[7], c * A[7] - s * A[6], A[8],
    )  # fmt: skip

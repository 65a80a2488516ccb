"""Vectors of three and matrices of nine numbers (row by row) as tuples, and where they stand in tables.

Tuples of numbers stay in registers; slices of arrays would be counted as references, once for every use.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled

__all__ = [
    "Matrix",
    "Vector",
    "add",
    "axis_of",
    "back",
    "cross",
    "dot",
    "length_of",
    "matrix_at",
    "product",
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


@compiled
def vector_at(table: Array, i: int, k: int) -> Vector:
    """Return the three numbers from column k on in row i."""
    return table[i, k], table[i, k + 1], table[i, k + 2]


@compiled
def put(table: Array, i: int, k: int, u: Vector) -> None:
    """Write them."""
    table[i, k], table[i, k + 1], table[i, k + 2] = u


@compiled
def matrix_at(table: Array, i: int, k: int) -> Matrix:
    """Return the nine numbers from column k on in row i."""
    return (
        table[i, k], table[i, k + 1], table[i, k + 2],
        table[i, k + 3], table[i, k + 4], table[i, k + 5],
        table[i, k + 6], table[i, k + 7], table[i, k + 8],
    )  # fmt: skip


@compiled
def put_matrix(table: Array, i: int, k: int, A: Matrix) -> None:
    """Write them."""
    table[i, k], table[i, k + 1], table[i, k + 2] = A[0], A[1], A[2]
    table[i, k + 3], table[i, k + 4], table[i, k + 5] = A[3], A[4], A[5]
    table[i, k + 6], table[i, k + 7], table[i, k + 8] = A[6], A[7], A[8]


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
    return math.sqrt(dot(u, u))


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


@compiled
def axis_of(A: Matrix, k: int) -> Vector:
    """Return axis 0, 1 or 2 (a column) of a rotation."""
    if k == 2:
        return A[2], A[5], A[8]
    if k == 1:
        return A[1], A[4], A[7]
    return A[0], A[3], A[6]

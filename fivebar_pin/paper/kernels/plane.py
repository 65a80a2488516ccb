"""Vectors of the plane as complex numbers, four at a time: what the kernels of the paper are written in."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled

__all__ = ["CArray", "Four", "Two", "Vectors", "cross", "dot", "four", "put", "put_four", "sum_of", "times", "turned"]

CArray: TypeAlias = npt.NDArray[np.complex128]
Two: TypeAlias = tuple[float, float]
Four: TypeAlias = tuple[float, float, float, float]
Vectors: TypeAlias = tuple[complex, complex, complex, complex]


@compiled
def turned(r: float, t: float) -> complex:
    """Return r e^{i angle} from t = tan(angle / 2)."""
    s = r / (1.0 + t * t)
    return complex(s * (1.0 - t * t), s * (t + t))


@compiled
def times(s: float, z: complex) -> complex:
    return complex(s * z.real, s * z.imag)


@compiled
def cross(x: complex, y: complex) -> float:
    """Return Im(conj(x) y)."""
    return x.real * y.imag - x.imag * y.real


@compiled
def dot(x: complex, y: complex) -> float:
    """Return Re(conj(x) y)."""
    return x.real * y.real + x.imag * y.imag


@compiled
def sum_of(k: Vectors, b: Vectors) -> complex:
    return k[0] * b[0] + k[1] * b[1] + k[2] * b[2] + k[3] * b[3]


@compiled
def put(table: Array, i: int, x: float, y: float, z: float) -> None:
    table[i, 0], table[i, 1], table[i, 2] = x, y, z


@compiled
def four(table: Array, i: int) -> Four:
    return table[i, 0], table[i, 1], table[i, 2], table[i, 3]


@compiled
def put_four(table: Array, i: int, x: Four) -> None:
    table[i, 0], table[i, 1], table[i, 2], table[i, 3] = x

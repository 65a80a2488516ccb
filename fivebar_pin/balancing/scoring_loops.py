"""What scoring does with every design, compiled: is it physical, how large are its numbers, how long its vectors.

All stands in one file, which is what the machine code kept for the next process is checked against.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled, entry

__all__ = ["enlarge", "first_unphysical", "squares"]

_PHYSICAL = 1e-9  # invariant of the second moments about a mass centre that counts as zero [of their size]
_LANES = 64  # designs side by side: one number of each fills whole registers, all numbers of all stay in cache


@entry
def first_unphysical(X: Array) -> int:
    """Return the index, design by design, of the first body that is not physical; -1 where all are.

    Args:
        X: inertial parameters (k, nb, 10).
    """
    for k in range(X.shape[0]):
        for body in range(X.shape[1]):
            if not _is_physical(X[k, body]):
                index: int = k * X.shape[1] + body
                return index
    return -1


@numba.njit(error_model="numpy", fastmath=False)  # each step rounded: decisions, and overflow, as written
def _is_physical(pi: Array) -> bool:
    """Tell whether the mass and the second moments about the mass centre are positive semidefinite.

    The second moments S = 1/2 tr(I) E - I - m c c^T are so when the three invariants of S are not negative; without
    mass there is no first moment either. Numbers that are none fail every comparison.
    """
    m, x, y, z = pi[0], pi[1], pi[2], pi[3]
    xx, xy, yy, xz, yz, zz = pi[4], pi[5], pi[6], pi[7], pi[8], pi[9]
    per = 1.0 / m if m > 0.0 else 1.0
    px, py, pz, half = x * per, y * per, z * per, 0.5 * (xx + yy + zz)
    a, b, c = half - xx - x * px, half - yy - y * py, half - zz - z * pz
    d, e, f = -xy - x * py, -xz - x * pz, -yz - y * pz
    size = half + x * px + y * py + z * pz
    trace = a + b + c
    minors = a * b + a * c + b * c - d * d - e * e - f * f
    determinant = a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e)
    mass = (m >= 0.0) & (m < np.inf) & ((m > 0.0) | ((x == 0.0) & (y == 0.0) & (z == 0.0)))
    first, second, third = -_PHYSICAL * size, -_PHYSICAL * size**2, -_PHYSICAL * size**3
    return bool(mass & (trace >= first) & (minors >= second) & (determinant >= third))


@entry
def enlarge(largest: Array, X: Array) -> None:
    """Raise numbers (nb, 10) to the largest size that each has among the designs X (k, nb, 10)."""
    for k in range(X.shape[0]):
        for body in range(X.shape[1]):
            for i in range(X.shape[2]):
                largest[body, i] = max(largest[body, i], abs(X[k, body, i]))


@entry
def squares(x: Array, columns: npt.NDArray[np.intp], W: Array, w: Array, ends: npt.NDArray[np.intp]) -> Array:
    """Return |y|^2 of every part of y = W x[columns] + w, for every design (parts, k).

    Args:
        x: parameters of the designs (k, p).
        columns: those that matter (c,).
        W: factors of all parts one below the other (r, c); zeros cost nothing.
        w: what does not depend on the design (r,).
        ends: row after the last of each part (parts,).
    """
    out = np.empty((len(ends), len(x)))
    beside, y, total = np.zeros((len(columns), _LANES)), np.zeros(_LANES), np.zeros(_LANES)
    for start in range(0, len(x), _LANES):
        count = min(_LANES, len(x) - start)
        _turn(beside, x[start : start + count], columns)
        row = 0
        for part in range(len(ends)):
            total[:] = 0.0
            for r in range(row, ends[part]):
                y[:] = w[r]
                _add_row(y, W[r], beside)
                for k in range(_LANES):
                    total[k] += y[k] * y[k]
            for k in range(count):
                out[part, start + k] = total[k]
            row = ends[part]
    return out


@compiled
def _turn(beside: Array, x: Array, columns: npt.NDArray[np.intp]) -> None:
    """Write the numbers of designs side by side (c, lanes)."""
    for k in range(x.shape[0]):
        for c in range(len(columns)):
            beside[c, k] = x[k, columns[c]]


@compiled
def _add_row(y: Array, factors: Array, beside: Array) -> None:
    """Add a row of factors (c,) times the numbers of designs (c, lanes) to a number of each (lanes,)."""
    for c in range(len(factors)):
        if factors[c] != 0.0:
            for k in range(_LANES):
                y[k] += factors[c] * beside[c, k]

"""The rows that closures between frames are made of, and their equations over a batch.

With frame 1 (axes R_1, origin p_1) and frame 2, b a vector of frame 1, n one of frame 2 and x_0 a number,

    along     b · R_1^T (p_2 - p_1) - x_0              length   |p_2 - p_1| - x_0
    tilt      b · R_1^T R_2 n - x_0                    turned   b · log(R_1^T R_2) - x_0

Vectors are of length one. A kind of closure names its rows, and everything else follows. The same equations for
one sample are those of `fivebar_pin.engine.rows`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, cross, frozen
from fivebar_pin.closures.points import (
    FramePair,
    left_jacobian_inverse,
    log3,
    point_accelerations,
    point_drift,
    point_rows,
    point_selector,
    point_velocity,
)

__all__ = ["Row", "Rows", "Sort", "along", "length", "tilt", "turned"]

Sort = Literal["along", "tilt", "turned", "length"]

_ZERO = np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class Row(Immutable):
    """One row: its sort, b (3,), n (3,) and x_0 [m, rad or -]."""

    sort: Sort
    direction: Array
    other: Array
    number: float

    @property
    def unit(self) -> str:
        """Unit of the row: "m", "rad" or "-"."""
        return {"along": "m", "length": "m", "tilt": "-", "turned": "rad"}[self.sort]


def along(direction: npt.ArrayLike, number: float = 0.0) -> Row:
    """Return the row of two points at a distance x_0 along a vector of frame 1."""
    return Row("along", frozen(direction), frozen(_ZERO), number)


def tilt(direction: npt.ArrayLike, other: npt.ArrayLike, number: float = 0.0) -> Row:
    """Return the row of a vector of frame 1 and one of frame 2 at a cosine x_0."""
    return Row("tilt", frozen(direction), frozen(other), number)


def turned(direction: npt.ArrayLike, number: float = 0.0) -> Row:
    """Return the row of a rotation vector with the component x_0 along a vector of frame 1."""
    return Row("turned", frozen(direction), frozen(_ZERO), number)


def length(number: float) -> Row:
    """Return the row of two points at a distance x_0."""
    return Row("length", frozen(_ZERO), frozen(_ZERO), number)


class Rows:
    """Some rows, those of one sort computed together.

    Args:
        rows: in order.
    """

    def __init__(self, rows: Sequence[Row]) -> None:
        self._m = len(rows)
        self._number = np.array([row.number for row in rows])
        self._sorts: list[tuple[Sort, npt.NDArray[np.intp], Array, Array]] = []
        for sort in dict.fromkeys(row.sort for row in rows):
            which = np.array([k for k, row in enumerate(rows) if row.sort == sort])
            b, n = (np.stack([getattr(rows[k], name) for k in which]) for name in ("direction", "other"))
            self._sorts.append((sort, which, b, n))

    def residual(self, pair: FramePair) -> Array:
        """Return what they leave open (..., m)."""
        out = np.empty((*pair.p1.shape[:-1], self._m))
        for sort, which, b, n in self._sorts:
            if sort == "along":
                out[..., which] = point_rows(pair) @ b.T
            elif sort == "tilt":
                out[..., which] = np.sum(_seen(pair, n) * b, axis=-1)
            elif sort == "turned":
                out[..., which] = log3(_turn(pair)) @ b.T
            else:
                out[..., which] = _rod(pair)[1]
        return np.asarray(out - self._number)

    def selector(self, pair: FramePair) -> Array:
        """Return T (..., m, 6): residual rate = T @ (velocity of body 2 minus body 1, world axes and origin)."""
        T, R1T = np.zeros((*pair.p1.shape[:-1], self._m, 6)), np.swapaxes(pair.R1, -1, -2)
        for sort, which, b, n in self._sorts:
            if sort == "along":
                T[..., which, :] = np.matmul(b, point_selector(pair))
            elif sort == "tilt":
                T[..., which, 3:] = np.matmul(cross(_seen(pair, n), b), R1T)
            elif sort == "turned":
                T[..., which, 3:] = np.matmul(b, np.matmul(left_jacobian_inverse(log3(_turn(pair))), R1T))
            else:
                u, _ = _rod(pair)
                T[..., which, :] = np.concatenate([u, cross(pair.p2, u)], axis=-1)[..., None, :]
        return T

    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return their second rate at zero joint accelerations (..., m); of turned rows on the closed loop only."""
        out, R1T = np.empty((*pair.p1.shape[:-1], self._m)), np.swapaxes(pair.R1, -1, -2)
        w1, w2 = V1[..., 3:], V2[..., 3:]
        alpha = np.matmul(R1T, (A2[..., 3:] - A1[..., 3:] - cross(w1, w2))[..., None])[..., 0]
        for sort, which, b, n in self._sorts:
            if sort == "along":
                out[..., which] = point_drift(pair, V1, V2, A1, A2) @ b.T
            elif sort == "tilt":
                w, Qn = np.matmul(R1T, (w2 - w1)[..., None])[..., None, :, 0], _seen(pair, n)
                turning = cross(alpha[..., None, :], Qn) + cross(w, cross(w, Qn))
                out[..., which] = np.sum(turning * b, axis=-1)
            elif sort == "turned":
                out[..., which] = alpha @ b.T
            else:
                out[..., which] = _lengthening(pair, V1, V2, A1, A2)
        return out


def _turn(pair: FramePair) -> Array:
    return np.asarray(np.matmul(np.swapaxes(pair.R1, -1, -2), pair.R2))


def _seen(pair: FramePair, n: Array) -> Array:
    """Return vectors of frame 2 in the axes of frame 1 (..., k, 3)."""
    return np.asarray(np.matmul(n, np.swapaxes(_turn(pair), -1, -2)))


def _rod(pair: FramePair) -> tuple[Array, Array]:
    """Return the unit vector from point 1 to point 2 (..., 3) and their distance (..., 1).

    Where the points coincide it is the x axis of frame 1.
    """
    d = pair.p2 - pair.p1
    size = np.linalg.norm(d, axis=-1, keepdims=True)
    met = size == 0.0
    return np.where(met, pair.R1[..., 0], d / np.where(met, 1.0, size)), size


def _lengthening(pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
    """Return u · (a_2 - a_1) + (|d'|^2 - (u · d')^2) / |d|, (..., 1)."""
    u, size = _rod(pair)
    a2, a1 = point_accelerations(pair, V1, V2, A1, A2)
    rate = point_velocity(V2, pair.p2) - point_velocity(V1, pair.p1)
    across = rate - np.sum(rate * u, axis=-1, keepdims=True) * u
    return np.asarray(np.sum(u * (a2 - a1), axis=-1, keepdims=True) + np.sum(across**2, -1, keepdims=True) / size)

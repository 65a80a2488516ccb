"""Whether rings in the plane have a point in common, decided exactly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.paper.positions import CArray

__all__ = ["common_points"]

_ON = 1e-13  # violation of a point on a circle, by round-off [of the size of the picture]


def common_points(centres: npt.ArrayLike, inner: npt.ArrayLike, outer: npt.ArrayLike) -> tuple[CArray, float]:
    """Return points common to the rings inner_i <= |s - centre_i| <= outer_i, and the least violation otherwise.

    If rings have a common part, its border holds a point where two of their circles meet, or a whole circle, or there
    is no border; so it is enough to look at the meeting points, at some points of each circle and at one centre. Where
    all that is found is one point, the common part is that point alone.

    Args:
        centres: real or complex (k,).
        inner, outer: radii (k,); outer may be infinite.

    Returns:
        The common points among those (m,), none if there are none, and the least over all of them of the largest
        violation, 0.0 where there is a common point.
    """
    c = np.asarray(centres, dtype=np.complex128)
    low, high = np.asarray(inner, dtype=np.float64), np.asarray(outer, dtype=np.float64)
    circles = [(z, r) for z, pair in zip(c, zip(low, high, strict=True), strict=True) for r in pair if np.isfinite(r)]
    points = [c[0]]
    for k, (z, r) in enumerate(circles):
        points += [z + r * turn for turn in (1.0, 1j, -1.0, -1j)]
        for w, t in circles[:k]:
            points += _meet(z, float(r), w, float(t))
    s = np.array(points)
    violation = _violation(s, c, low, high)
    scale = float(np.abs(c).max() + 1.0)
    return s[violation <= _ON * scale], max(float(violation.min()), 0.0)


def _violation(s: CArray, c: CArray, low: Array, high: Array) -> Array:
    distance = np.abs(s[:, None] - c)
    return np.asarray(np.maximum(low - distance, distance - high).max(axis=1))


def _meet(z: complex, r: float, w: complex, t: float) -> list[complex]:
    """Return where two circles meet, or the point between them where they come closest."""
    d = abs(w - z)
    if d == 0.0:
        return []
    along = (d * d + r * r - t * t) / (2.0 * d)
    across = np.sqrt(max(r * r - along * along, 0.0))
    direction = (w - z) / d
    return [z + direction * complex(along, across), z + direction * complex(along, -across)]

"""Whether a motion stays clear of singularities between its samples."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.errors import SingularityError
from fivebar_pin.paper.linkage import FiveBar

__all__ = ["check_path"]

_MEET = 1e-9  # least distance of O2 and O4 that counts as none [of their largest]
_SUBSTEPS = 32
# Quintic Hermite polynomials of (q0, v0 h, a0 h^2, q1, v1 h, a1 h^2), coefficients of s^0 .. s^5.
_HERMITE = np.array(
    [
        [1.0, 0.0, 0.0, -10.0, 15.0, -6.0],
        [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
        [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
        [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
        [0.0, 0.0, 0.0, -4.0, 7.0, -3.0],
        [0.0, 0.0, 0.0, 0.5, -1.0, 0.5],
    ]
)


def check_path(linkage: FiveBar, t: Array, driven: tuple[Array, Array, Array], reach: Array) -> None:
    """Raise when the motion passes a singularity between two samples.

    O2, O3, O4 lie on a line where the distance |O2 O4| reaches a2 + a3 or |a2 - a3|. Intervals that could get there at
    twice the speed of their ends, or over twice the way between them, are followed in small steps along the quintic
    that fits q, v, a at both ends.

    Args:
        linkage: the linkage.
        t: times (n,) [s].
        driven: q, v, a of psi and gamma, each (2, n).
        reach: |O2 O4| at the samples (n,) [m].

    Raises:
        SingularityError: which interval.
    """
    if t.size < 2:
        return
    low, high = _bounds(linkage)
    a1, a4 = float(linkage.lengths[0]), float(linkage.lengths[3])
    speed = np.abs(driven[1]) * np.array([[a1], [a4]])
    speed = speed[0] + speed[1]
    spans = np.diff(t)
    way = np.abs(np.diff(driven[0], axis=1)) * np.array([[a1], [a4]])  # also where the given rates do not tell
    way = way[0] + way[1]
    step = 2.0 * max(float(spans.max()) * float(speed.max()), float(way.max()))
    if low + step < reach.min() and reach.max() < high - step:
        return
    steps = 2.0 * np.maximum(spans * np.maximum(speed[1:], speed[:-1]), way)
    far = np.maximum(reach[1:], reach[:-1]) + steps >= high
    near = np.minimum(reach[1:], reach[:-1]) - steps <= low
    _follow(linkage, t, driven, np.flatnonzero(far | near))


def _bounds(linkage: FiveBar) -> tuple[float, float]:
    a2, a3 = float(linkage.lengths[1]), float(linkage.lengths[2])
    return abs(a2 - a3), a2 + a3


def _gap(linkage: FiveBar, q: Array) -> Array:
    """Return the vector from O2 to O4 as complex numbers, for q (2, ...)."""
    a1, _, _, a4, a5 = linkage.lengths.tolist()
    return np.asarray(a5 + a4 * np.exp(1j * q[1]) - a1 * np.exp(1j * q[0]))


def _follow(linkage: FiveBar, t: Array, driven: tuple[Array, Array, Array], intervals: npt.NDArray[np.intp]) -> None:
    low, high = _bounds(linkage)
    powers = np.linspace(0.0, 1.0, _SUBSTEPS + 1)[:, None] ** np.arange(6)
    basis = powers @ _HERMITE.T  # (substeps + 1, 6)
    for k in intervals:
        h = t[k + 1] - t[k]
        ends = np.stack([x[:, j] * h**order for j in (k, k + 1) for order, x in enumerate(driven)])  # (6, 2)
        d = _gap(linkage, (basis @ ends).T)
        if np.abs(d).max() >= high or np.abs(d).min() <= low or _distance(d) < _MEET * high:
            raise SingularityError(
                f"The motion passes a singularity between sample {k}, t = {t[k]:.6g} s, and sample {k + 1}, "
                f"t = {t[k + 1]:.6g} s: O2, O3 and O4 come to lie on a line. Change the motion or the lengths.",
                sigma=0.0,
                sample=int(k),
                time=float(t[k]),
            )


def _distance(d: Array) -> float:
    """Return the least distance of the polygon through d from zero (where O2 would meet O4)."""
    step = np.diff(d)
    length2 = np.maximum(np.abs(step) ** 2, np.finfo(np.float64).tiny)
    s = np.clip(-(np.conj(step) * d[:-1]).real / length2, 0.0, 1.0)
    return float(np.abs(d[:-1] + s * step).min())

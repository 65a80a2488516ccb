"""Whether a motion stays clear of singularities between its samples."""

from __future__ import annotations

import numpy as np

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
_BASIS = np.linspace(0.0, 1.0, _SUBSTEPS + 1)[:, None] ** np.arange(6) @ _HERMITE.T  # (substeps + 1, 6)


def check_path(linkage: FiveBar, t: Array, driven: tuple[Array, Array, Array], triangle: Array) -> None:
    """Raise when the motion passes a singularity between two samples.

    O2, O3, O4 lie on a line where the distance |O2 O4| reaches a2 + a3 or |a2 - a3|. Intervals that could get there
    are followed in small steps along the quintic that fits q, v, a at both ends.

    Args:
        linkage: the linkage.
        t: times (n,) [s].
        driven: q, v, a of psi and gamma, each (n, 2), row by row in memory.
        triangle: from `positions.close` (n, 3).

    Raises:
        SingularityError: which interval.
    """
    from fivebar_pin.paper.kernels import next_doubtful

    k = -1
    while (k := next_doubtful(linkage.lengths, t, driven[0], driven[1], triangle, k + 1)) < t.size - 1:
        _follow(linkage, t, driven, k)


def _bounds(linkage: FiveBar) -> tuple[float, float]:
    a2, a3 = float(linkage.lengths[1]), float(linkage.lengths[2])
    return abs(a2 - a3), a2 + a3


def _gap(linkage: FiveBar, q: Array) -> Array:
    """Return the vector from O2 to O4 as complex numbers, for q (2, ...)."""
    a1, _, _, a4, a5 = linkage.lengths.tolist()
    return np.asarray(a5 + a4 * np.exp(1j * q[1]) - a1 * np.exp(1j * q[0]))


def _follow(linkage: FiveBar, t: Array, driven: tuple[Array, Array, Array], k: int) -> None:
    low, high = _bounds(linkage)
    h = t[k + 1] - t[k]
    ends = np.stack([x[j] * h**order for j in (k, k + 1) for order, x in enumerate(driven)])  # (6, 2)
    d = _gap(linkage, (_BASIS @ ends).T)
    if np.abs(d).max() >= high or np.abs(d).min() <= low or _distance(d) < _MEET * high:
        raise SingularityError(
            f"The motion passes a singularity between sample {k}, t = {t[k]:.6g} s, and sample {k + 1}, "
            f"t = {t[k + 1]:.6g} s: O2, O3 and O4 come to lie on a line. Change the motion or the lengths.",
            sigma=0.0,
            sample=k,
            time=float(t[k]),
        )


def _distance(d: Array) -> float:
    """Return the least distance of the polygon through d from zero (where O2 would meet O4)."""
    step = np.diff(d)
    length2 = np.maximum(np.abs(step) ** 2, np.finfo(np.float64).tiny)
    s = np.clip(-(np.conj(step) * d[:-1]).real / length2, 0.0, 1.0)
    return float(np.abs(d[:-1] + s * step).min())

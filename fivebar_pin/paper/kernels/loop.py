"""The loop, sample by sample: how it closes, and where it may stop closing.

The equations are those of `positions`. Where O2, O3, O4 make no triangle nothing is computed, so that no divisor is
zero and no root imaginary: numbers too large become infinity and nan, compiled or not.
"""

from __future__ import annotations

import math

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import entry
from fivebar_pin.paper.kernels.plane import CArray, dot, turned

__all__ = ["close_loops", "next_doubtful", "unwind"]


@entry
def close_loops(lengths: Array, sign: float, least: float, half: Array, b: CArray, triangle: Array) -> int:
    """Close the loop (1) at each sample, and return at how many it cannot be closed.

    Args:
        lengths: a1 .. a5 (5,) [m].
        sign: of X, the assembly mode.
        least: X^2 up to which O2, O3, O4 count as on a line [m4].
        half: tan(psi / 2) and tan(gamma / 2) (n, 2) [-].
        b: takes the link vectors (4, n) [m].
        triangle: takes D, X^2 and X (n, 3) [m2, m4, m2]. Where the loop stays open, X and b are left alone.
    """
    a1, a2, a3, a4, a5 = lengths[0], lengths[1], lengths[2], lengths[3], lengths[4]
    refused = 0
    for i in range(len(half)):
        b1, b4 = turned(a1, half[i, 0]), turned(a4, half[i, 1])
        d = b4 - b1 + a5
        D = dot(d, d)
        u = 0.5 * (D + (a2 * a2 - a3 * a3))
        square = a2 * a2 * D - u * u
        triangle[i, 0], triangle[i, 1] = D, square
        if square <= least:
            refused += 1
            continue
        X = sign * math.sqrt(square)
        b2 = d * complex(u / D, X / D)
        triangle[i, 2] = X
        b[0, i], b[1, i], b[2, i], b[3, i] = b1, b2, b2 - d, b4
    return refused


@entry
def unwind(angles: Array) -> None:
    """Make each row of angles in (-pi, pi] continuous along the samples: add a turn where it jumps by more than half.

    Args:
        angles: (k, n) [rad].
    """
    for j in range(len(angles)):
        turns, before = 0.0, angles[j, 0]
        for i in range(1, angles.shape[1]):
            now = angles[j, i]
            if abs(now - before) > math.pi:
                turns -= math.copysign(1.0, now - before)
            angles[j, i], before = now + turns * math.tau, now


@entry
def next_doubtful(lengths: Array, t: Array, q: Array, v: Array, triangle: Array, start: int) -> int:
    """Return the first interval from `start` on in which O2, O3, O4 may come to lie on a line; n - 1 if none does.

    |O2 O4| would have to reach a2 + a3 or |a2 - a3|, at twice the speed of the ends of the interval, or over twice the
    way between them (given rates may not tell).
    """
    a1, a2, a3, a4 = lengths[0], lengths[1], lengths[2], lengths[3]
    last = len(t) - 1
    for k in range(start, last):
        before, after = math.sqrt(triangle[k, 0]), math.sqrt(triangle[k + 1, 0])
        speed = max(a1 * abs(v[k, 0]) + a4 * abs(v[k, 1]), a1 * abs(v[k + 1, 0]) + a4 * abs(v[k + 1, 1]))
        way = a1 * abs(q[k + 1, 0] - q[k, 0]) + a4 * abs(q[k + 1, 1] - q[k, 1])
        reach = 2.0 * max(speed * (t[k + 1] - t[k]), way)
        if max(before, after) + reach >= a2 + a3 or min(before, after) - reach <= abs(a2 - a3):
            return k
    return last

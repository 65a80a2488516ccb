"""The motion of the links, sample by sample, from that of the motors: the equations are those of `positions`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.engine.compiled import compiled, entry
from fivebar_pin.paper.kernels.plane import CArray, Four, Two, Vectors, cross, dot, put_four, times

__all__ = ["Movement", "accelerations", "move", "partials", "rates"]


class Movement(NamedTuple):
    """Where the motion of the links goes, as in `Solution`: (n, 4), (n, 4), (n, 4), (n, 2, 2)."""

    angles: Array
    rates: Array
    accelerations: Array
    partials: Array

    @classmethod
    def empty(cls, n: int) -> Movement:
        """Return room for n samples."""
        return cls(np.empty((n, 4)), np.empty((n, 4)), np.empty((n, 4)), np.empty((n, 2, 2)))


@compiled
def partials(b: Vectors, X: float) -> Four:
    """Return theta_psi, theta_gamma, phi_psi, phi_gamma."""
    return cross(b[2], b[0]) / X, -cross(b[2], b[3]) / X, cross(b[1], b[0]) / X, -cross(b[1], b[3]) / X


@compiled
def rates(P: Four, v: Two) -> Four:
    """Return psi', theta', phi', gamma'."""
    return v[0], P[0] * v[0] + P[1] * v[1], P[2] * v[0] + P[3] * v[1], v[1]


@compiled
def accelerations(b: Vectors, X: float, P: Four, w: Four, a: Two) -> Four:
    """Return psi'', theta'', phi'', gamma'': those of the passive links take the centripetal terms of all."""
    g = times(w[0] * w[0], b[0]) + times(w[1] * w[1], b[1]) - times(w[2] * w[2], b[2]) - times(w[3] * w[3], b[3])
    theta = dot(b[2], g) / X + P[0] * a[0] + P[1] * a[1]
    phi = dot(b[1], g) / X + P[2] * a[0] + P[3] * a[1]
    return a[0], theta, phi, a[1]


@entry
def move(links: CArray, triangle: Array, passive: Array, q: Array, v: Array, a: Array, out: Movement) -> None:
    """Fill the motion of all links.

    Args:
        links, triangle: from `close_loops`.
        passive: theta and phi (2, n) [rad].
        q, v, a: of psi and gamma (n, 2).
        out: the motion.
    """
    for i in range(len(q)):
        b = links[0, i], links[1, i], links[2, i], links[3, i]
        X = triangle[i, 2]
        P = partials(b, X)
        w = rates(P, (v[i, 0], v[i, 1]))
        put_four(out.angles, i, (q[i, 0], passive[0, i], passive[1, i], q[i, 1]))
        put_four(out.rates, i, w)
        put_four(out.accelerations, i, accelerations(b, X, P, w, (a[i, 0], a[i, 1])))
        out.partials[i, 0, 0], out.partials[i, 0, 1], out.partials[i, 1, 0], out.partials[i, 1, 1] = P
